"""Pages of the documentation site that are made when it is built; MkDocs calls these hooks.

CONTRIBUTING.md and CHANGELOG.md, which stand at the top of the repository; the command line's
help; and the notebooks, which are executed, so that their figures are those of this commit.
`DRAKE_QUAD_NOTEBOOKS=off mkdocs serve` leaves the notebooks without output, for quick looks.
"""

import os
import re
from pathlib import Path
from typing import Any, cast

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from typer.cli import get_docs_for_click

from drake_quad.cli.main import app

ROOT = Path(__file__).resolve().parents[1]
AT_THE_TOP = ("CONTRIBUTING.md", "CHANGELOG.md")
COMMAND_LINE = "reference/command_line.md"
TIMEOUT = 600  # [s] for a cell of a notebook, the kernels' compilation included


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages that are made; MkDocs calls it once it has listed those of docs/."""
    for name in AT_THE_TOP:
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, name.lower(), content=links_from_docs(text)))
    for notebook in sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")):
        text, pictures = notebook_page(notebook)
        files.append(File.generated(config, f"notebooks/{notebook.stem}.md", content=text))
        for name, picture in pictures.items():
            files.append(File.generated(config, f"notebooks/{name}", content=picture))
    return files


def on_page_markdown(markdown: str, *, page: Page, **_: Any) -> str:
    """Leads links to the pages that are made; MkDocs calls it with each page's text."""
    if page.file.src_uri == COMMAND_LINE:
        markdown += command_line_sections()
    if not page.file.src_uri.startswith("notebooks/"):  # these link to the notebook itself
        markdown = re.sub(r"(\]\([\w./]*notebooks/\w+)\.ipynb", r"\1.md", markdown)
    up = "../" * page.file.src_uri.count("/")
    for name in AT_THE_TOP:
        markdown = markdown.replace(f"]({up}../{name}", f"]({up}{name.lower()}")
    return markdown


def links_from_docs(text: str) -> str:
    """The text of a page at the top of the repository, its links as they are from docs/."""
    text = re.sub(r"\]\(docs/", "](", text)
    for name in AT_THE_TOP:
        text = text.replace(f"]({name}", f"]({name.lower()}")
    return text


def command_line_sections() -> str:
    """Every command with its arguments and options, as `--help` tells them."""
    command = typer.main.get_command(app)
    with command.make_context("drake-quad", [], resilient_parsing=True) as context:
        text = get_docs_for_click(obj=command, ctx=cast(Any, context), name="drake-quad")
    pieces = text[text.index("\n## ") :].split("`")  # code in turn with words
    pieces[::2] = [piece.replace("<", "&lt;") for piece in pieces[::2]]
    return "\n" + "`".join(pieces)


def notebook_page(path: Path) -> tuple[str, dict[str, bytes]]:
    """A notebook as Markdown, executed, and its pictures by their names.

    Raises:
        CellExecutionError: If one of its cells fails: the site is not built then.
    """
    import nbformat
    from nbconvert import MarkdownExporter
    from nbconvert.preprocessors import ExecutePreprocessor

    notebook: Any = nbformat.read(path, as_version=4)
    if os.environ.get("DRAKE_QUAD_NOTEBOOKS") != "off":
        ExecutePreprocessor(timeout=TIMEOUT).preprocess(notebook, {})
    text, resources = MarkdownExporter().from_notebook_node(
        notebook, {"unique_key": path.stem, "output_files_dir": path.stem}
    )
    link = f"*This page is the notebook [{path.name}]({path.name}), executed with the site.*"
    title, _, rest = text.lstrip().partition("\n")
    return f"{title}\n\n{link}\n{rest}", dict(resources["outputs"])
