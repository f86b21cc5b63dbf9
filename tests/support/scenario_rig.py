"""What tests of scenarios share: how one is refused, and which fields there are."""

import pytest

from drake_quad.errors import InputError
from drake_quad.scenario.load import parse_scenario
from drake_quad.util.yaml_io import field_types


def refused(text: str, overrides: tuple[str, ...] = ()) -> InputError:
    """The error that the text is refused with, after checking its form."""
    with pytest.raises(InputError) as caught:
        parse_scenario(text, source="mine.yaml", overrides=overrides)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(caught.value.source) and caught.value.field in line
    assert caught.value.remedy
    return caught.value


def leaves(schema: object, path: str = "") -> dict[str, object]:
    """Every field below a scenario's schema that is no dataclass: path -> type."""
    found: dict[str, object] = {}
    for name, kind in (field_types(schema) or {}).items():
        inner = f"{path}.{name}".lstrip(".")
        found |= leaves(kind, inner) if field_types(kind) else {inner: kind}
    return found
