"""Figures as HTML, where a notebook shows a result."""

from collections.abc import Iterable

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
