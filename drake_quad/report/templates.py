"""The report's HTML templates, which stand beside this file."""

from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

HERE = Path(__file__).parent


def render(template: str, **values: object) -> str:
    """Fills a template; text is escaped, and a value that is missing is an error."""
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    return environment.get_template(template).render(**values)


def read_css(name: str) -> str:
    """A style sheet as it is."""
    return (HERE / name).read_text(encoding="utf-8")
