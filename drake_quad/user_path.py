"""Paths as people type them."""

from pathlib import Path


def user_path(path: str | Path) -> Path:
    """The path with `~` and `~name` in full; as it is where there is no such user.

    Then no file is there either, which whoever opens it says better than pathlib's RuntimeError.
    """
    try:
        return Path(path).expanduser()
    except RuntimeError:
        return Path(path)
