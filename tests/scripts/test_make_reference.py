"""The documents' tables of columns, keys and fields are those of the program."""

from pathlib import Path

import pytest
from make_reference import BLOCK, BLOCKS, DOCS, renew

PAGES = [page for page in sorted(DOCS.glob("*.md")) if BLOCK.search(page.read_text("utf-8"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_generated_parts_are_what_the_program_says(page: Path) -> None:
    """Else `python -m scripts.make_reference` was forgotten."""
    text = page.read_text(encoding="utf-8")
    assert renew(text) == text


def test_every_part_stands_in_a_page() -> None:
    """None is generated for nobody."""
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert {found[1] for found in BLOCK.findall(text)} == set(BLOCKS)
