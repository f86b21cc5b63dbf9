"""People's own words in Markdown: shown as they are, whatever they look like."""

import re

# What Markdown, with tables and formulas, would take for its own anywhere in a line; `_` is none
# within a word, `[` none but of a link, `&` none but of an entity.
_MARKS = re.compile(r"[\\`*|$~]|(?<!\w)_|_(?!\w)|\](?=[(\[:])|&(?=#?\w+;)")
_BEGINNINGS = re.compile(r"^(?:(\d+)(?=[.)])|(?=[#>+=-]))")  # of a line: a list, a heading, ...


def in_line(words: str) -> str:
    """Within a line, or a table's cell: one line, without a mark.

    `<` is written as an entity, so that no comment is in it, which parts a page in sections.
    """
    return _MARKS.sub(r"\\\g<0>", " ".join(words.split())).replace("<", "&lt;")


def paragraph(words: str) -> str:
    """The same as a paragraph of its own: nor is its beginning a list's or a heading's."""
    return _BEGINNINGS.sub(r"\1\\", in_line(words))
