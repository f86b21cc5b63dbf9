"""How results show themselves: in a line in a Python session, as a table in a notebook."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table

TABLE = """\
<table>
{%- for name, text in rows %}
<tr><th>{{ name }}</th><td>{{ text }}</td></tr>
{%- endfor %}
</table>"""


def html_table(rows: Iterable[tuple[str, str]]) -> str:
    """A table in HTML of names and values, which are escaped."""
    from jinja2 import Environment  # only notebooks need it

    return Environment(autoescape=True).from_string(TABLE).render(rows=list(rows))


def one_line(thing: object, *parts: str | None) -> str:
    """What `repr` says of a result that holds too much to be listed; empty parts are left out."""
    told = "; ".join(part for part in parts if part)
    return f"<{type(thing).__name__}{': ' if told else ''}{told}>"


def folded(table: "Table") -> "Table":
    """A table for a terminal whose columns go on in a further line where it is too narrow.

    Rich cuts what does not fit, the last digits of figures and the ends of names first.
    """
    for column in table.columns:
        column.overflow = "fold"
    return table
