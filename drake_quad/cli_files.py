"""The directories of the commands: named, claimed before long work, read, and reported on."""

import json
from pathlib import Path
from typing import Any

from rich.console import Console

from drake_quad.errors import InputError


def stem(scenario: str) -> str:
    """The short name of a scenario, a study or a robot, from its file or its name."""
    return Path(scenario).name.removesuffix(".yaml").removesuffix(".scenario")


def claim(directory: Path, option: str = "--out") -> None:
    """Makes sure before any long work that the directory can be written to.

    Raises:
        InputError: If it cannot; it names the option by which the directory was given.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        probe = directory / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(
            source=option,
            field="directory",
            value=str(directory),
            remedy=f"cannot be written to: {error.strerror}; give another with {option}",
        ) from None


def read_summary(directory: Path, *, or_sweep: bool = False) -> dict[str, Any]:
    """The summary of a finished run, all of whose files can be read.

    Args:
        directory: The run's.
        or_sweep: Whether a sweep's would have done as well, for the message.

    Raises:
        InputError: A file is not there, or is none of a run's.
    """
    import pyarrow.parquet as pq

    wanted = "`drake-quad run`" + (" or `drake-quad sweep`" if or_sweep else "")

    def fail(name: str, what: str) -> InputError:
        return InputError(
            source=str(directory),
            field=name,
            value=str(directory / name),
            remedy=f"{what}; give the directory of a finished {wanted}",
        )

    try:
        summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
    except OSError:
        what = "not there" if directory.is_dir() else "no such directory"
        raise fail("summary.json", what) from None
    except ValueError:
        raise fail("summary.json", "is not JSON") from None
    if not (isinstance(summary, dict) and "outcome" in summary):
        raise fail("summary.json", "is not a run's summary")
    try:
        columns = pq.read_schema(directory / "log.parquet").names
    except OSError:
        raise fail("log.parquet", "not there") from None
    except ValueError:  # Arrow's own errors are ValueErrors
        raise fail("log.parquet", "is cut short or not Parquet") from None
    if "t" not in columns or "margin" not in columns:
        raise fail("log.parquet", "is not a run's log")
    return summary


def make_report(directory: Path, err: Console) -> None:
    """Writes report.html and scene.lcmlog of a finished run."""
    from drake_quad.report.build import build_report
    from drake_quad.report.scene_log import write_scene_log

    with err.status("writing report.html and scene.lcmlog"):
        build_report(directory)
        write_scene_log(directory)
