"""Sections of a Markdown page, read as a reader of Markdown does: no name breaks them."""

import json
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import sweep_rig as rig
from markdown_it import MarkdownIt
from markdown_it.token import Token

from drake_quad.sweep import report as section_module
from drake_quad.sweep.charts import curves_svg
from drake_quad.sweep.report import in_line, paragraph, section, write_section

READER = MarkdownIt("commonmark").enable(["table", "strikethrough"])
NAMES = (
    "a | b", "a \\| b\\", "x$\\foo$", "[/x] [bold]", "<b>&amp;", "<!-- end x -->", "&#124;", "R&D",
    "`a` *b* _c_ ~~d~~ **e**", "![a](http://b) [c]: d", "course[1].rise", "body_path_z", "100 %",
    "-5 to 3", "# a", "> a", "1. a", "12) a", "- a", "+ a", "---", "===", "```", "~~~",
)  # fmt: skip


def shown(token: Token) -> str:
    """What a reader sees of a line; nothing in it is more than text."""
    assert token.children is not None
    assert {child.type for child in token.children} <= {"text"}, token.content
    return "".join(child.content for child in token.children)


@pytest.mark.parametrize("name", NAMES)
def test_words_are_shown_as_they_are(name: str) -> None:
    """As a paragraph of its own, and in a table's cell; lines are joined."""
    kinds = [token.type for token in READER.parse(paragraph(name))]
    assert kinds == ["paragraph_open", "inline", "paragraph_close"]
    assert shown(READER.parse(paragraph(name))[1]) == name
    table = f"| {in_line(name)} | b |\n| --- | --- |\n| c | {in_line(f'd  {name}')} |\n"
    cells = [shown(token) for token in READER.parse(table) if token.type == "inline"]
    assert cells == [name, "b", "c", f"d {name}"]
    assert in_line(" two\nlines ") == "two lines"


def test_words_without_marks_are_written_as_they_are() -> None:
    """A page is read as it stands, too: what needs no escape has none."""
    for words in (
        "course[1].rise",
        "body_path_z",
        "-5 to 3",
        "true state",
        "0.5 to 1 (R&D), 100 %",
    ):
        assert in_line(words) == words


@pytest.fixture(scope="module")
def findings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Of a sweep, for all names."""
    directory = tmp_path_factory.mktemp("swept")
    return rig.sweep_made_up(directory, directory / "a")


@pytest.mark.parametrize("name", NAMES)
def test_no_name_breaks_a_section(
    findings: dict[str, Any], tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a study, of what varies, a band, a cause or an outcome; written again it is there once."""
    drawn = cache(lambda shown: curves_svg(json.loads(shown)))  # the same picture three times
    monkeypatch.setattr(section_module, "curves_svg", lambda bands: drawn(json.dumps(bands)))
    bands = [{**band, "label": name} for band in findings["bands"]["simulation.friction"]]
    causes = [{"trials": 1, "cause": name}]
    told = {**findings, "description": name, "bands": {name: bands}, "causes": causes}
    told["figures"] = {name: findings["figures"]["margin.minimum"]}
    told["worst"] = [{**findings["worst"][0], "outcome": name}]
    page = tmp_path / "page.md"
    write_section(page, told, "drake-quad sweep x", "x")
    once = page.read_text()
    for _ in range(2):
        write_section(page, told, "drake-quad sweep x", "x")
    assert page.read_text() == once
    tokens = READER.parse(once)
    heads = ("th_open", "td_open")
    cells = [shown(after) for one, after in pairwise(tokens) if one.type in heads]
    of_bands = 4 * (len(bands) + 1)
    assert set(cells[:of_bands:4]) == {name} and cells[of_bands::6] == ["figure", name]
    assert len(cells) == of_bands + 2 * 6
    lines = ["".join(c.content for c in t.children or []) for t in tokens if t.type == "inline"]
    assert f"{name}." in lines and f"1 × {name}" in lines
    again = f"trial {findings['worst'][0]['index']} ({name}):"
    assert f"To run the worst of them again at that commit, {again}" in lines


def test_a_study_without_a_description_has_no_line_for_it(findings: dict[str, Any]) -> None:
    """Nor a dot alone."""
    for nothing in ("", " \n"):
        written = section({**findings, "description": nothing}, "drake-quad sweep x", "x")
        assert written.startswith("## x\n\n```\ndrake-quad sweep x\n```\n")
