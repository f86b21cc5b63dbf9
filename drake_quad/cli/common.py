"""What the commands share: options, progress lines, interrupts, output directories.

`drake-quad check go2 --save f | head` is to save its file, and to end with the status of its
answer, although `head` reads no more than ten lines.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from errno import ENAMETOOLONG
from io import TextIOWrapper
from pathlib import Path
from tempfile import TemporaryFile
from types import FrameType
from typing import Annotated, TextIO, cast

import typer
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

import drake_quad as dq
from drake_quad.errors import InputError
from drake_quad.util.files import user_path
from drake_quad.util.progress import LateProgress

MESSAGES = Console(stderr=True)  # results go to stdout

ScenarioArgument = Annotated[
    str, typer.Argument(help="A shipped scenario's name (see `scenarios`), or a YAML file.")
]
RobotArgument = Annotated[
    str, typer.Argument(help="A URDF, SDF, MJCF or .robot.yaml, or a robot's name.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="PATH=VALUE", help="Override a field, e.g. gait.duty_factor=0.8."
    ),
]
WorkersOption = Annotated[
    int | None, typer.Option(help="Number of processes; by default as many as there are cores.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]


LINES = 30.0  # [s] between lines of progress where there is no terminal
STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def interruptible(
    err: Console, words: str = "stopping; writing what was logged"
) -> Iterator[Callable[[], bool]]:
    """Turns Ctrl-C, a polite kill or a closed terminal into a stop.

    A second Ctrl-C is an interrupt as usual.

    Args:
        err: Where the first is answered.
        words: The answer.
    """
    seen = False

    def note(_number: int, _frame: FrameType | None) -> None:
        nonlocal seen
        seen = True
        with suppress(OSError):  # the terminal may be gone
            err.print(f"\n{words}")
        signal.signal(signal.SIGINT, signal.default_int_handler)

    before = [(number, signal.signal(number, note)) for number in STOPS]
    try:
        yield lambda: seen
    finally:
        for number, handler in before:
            signal.signal(number, handler)


@contextmanager
def seconds_progress(label: str, err: Console) -> Iterator[Callable[[float, float], None]]:
    """A bar over simulated time [s], with its pace."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f} s"),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(),
    )
    with LateProgress(*columns, console=err, transient=True, every=LINES) as bar:
        task = bar.add_task(label, total=None, pace="")

        def show(done: float, total: float) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            pace = f"{done / elapsed:.1f} × real time"
            bar.update(task, completed=done, total=max(total, done), pace=pace)

        yield show


@contextmanager
def cells_progress(err: Console) -> Iterator[Callable[[int, int], None]]:
    """A bar over the cells of a chart."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of {task.total:.0f}"),
        TextColumn("{task.fields[pace]}"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with LateProgress(
        *columns, console=err, transient=True, every=LINES, speed_estimate_period=600.0
    ) as bar:
        task = bar.add_task("planning stairs", total=None, pace="")

        def show(done: int, total: int) -> None:
            elapsed = bar.tasks[0].elapsed or 1e-9
            pace = f"{60.0 * done / elapsed:.1f} a minute"
            bar.update(task, completed=done, total=total, pace=pace)

        yield show


LONGEST = ".certificate.json.part"  # of the names that commands write in a directory


PAGES = (".md", ".markdown")  # suffixes of a page


def stem(scenario: str) -> str:
    """The short name of a scenario, a study or a robot, from its file or its name."""
    return Path(scenario).name.removesuffix(".yaml").removesuffix(".scenario")


def claim(directory: Path, option: str = "--out", files: Sequence[str] = ()) -> None:
    """Makes sure before any long work that the directory can be written to; makes nothing.

    Args:
        directory: The directory.
        option: Option by which it was given.
        files: Names of files that will be written there.

    Raises:
        InputError: If it cannot; it names the option by which the directory was given.
    """
    with _writing(directory, option):
        _probe(directory / LONGEST)
    for name in files:
        claim_file(directory / name, option)


def claim_apart(files: Mapping[str, Path | None]) -> None:
    """Makes sure that no two options, by their names, would write to one place.

    Raises:
        InputError: If two would.
    """
    seen: dict[Path, str] = {}
    for option, path in files.items():
        if path is None:
            continue
        other = seen.setdefault(path.resolve(), option)
        if other != option:
            remedy = f"is what {other} writes; give another"
            raise InputError(source=option, field=option[2:], value=str(path), remedy=remedy)


def claim_file(
    path: Path | None,
    option: str,
    *,
    reads: Sequence[str | Path] = (),
    kinds: Sequence[str] = (),
) -> None:
    """The same of a file, if there is to be one, that would not take the place of another's.

    Args:
        path: The file.
        option: Option by which it was given.
        reads: Files that the command reads, or names that may be files: it is none of them.
        kinds: Suffixes of such files. A file that is there already, and not empty, has one of
            them, or none: else it was something else before.

    Raises:
        InputError: If it cannot be written, or would; it names the option.
    """
    if path is None:
        return
    refusal = ""
    with _writing(path, option):
        if path.exists() and any(_is_same(path, one) for one in reads):
            refusal = "is read by this command; give another file"
        elif _is_other(path, kinds):
            refusal = f"is there already, and no {' or '.join(kinds)}; give another file"
        elif path.is_dir():
            refusal = "is a directory; give a file in it"
        elif path.exists() and not path.is_file():  # to be in place of /dev/null would harm
            refusal = "is no file that could be written anew; give another"
        else:
            _probe(path.with_name(f".{path.name}.part"))  # as long a name as `write_whole`'s
    if refusal:
        raise InputError(source=option, field=option[2:], value=str(path), remedy=refusal)


def _is_other(path: Path, kinds: Sequence[str]) -> bool:
    """Whether there is a file already that is of another kind, by its suffix."""
    suffix = path.suffix.lower()
    return bool(kinds and suffix and suffix not in kinds and path.is_file() and path.stat().st_size)


def _is_same(path: Path, other: str | Path) -> bool:
    """Whether `other` is that file; not if it is a name, or cannot be looked at."""
    try:
        return path.samefile(user_path(other))
    except OSError:
        return False


def _probe(path: Path) -> None:
    """Tries a file in the lowest folder on the way to it that is there, and all names for length.

    The file has no name: other commands may begin at the same place at the same time.
    """
    path = path.absolute()
    folder = next(p for p in path.parents if p.exists() or p.is_symlink())
    with TemporaryFile(dir=folder):
        most = os.pathconf(folder, "PC_NAME_MAX")
    if any(len(os.fsencode(name)) > most for name in path.relative_to(folder).parts):
        raise OSError(ENAMETOOLONG, os.strerror(ENAMETOOLONG))


@contextmanager
def _writing(path: Path, option: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        remedy = f"cannot be written to: {error.strerror}; give another with {option}"
        raise InputError(source=option, field=option[2:], value=str(path), remedy=remedy) from None


def make_report(directory: Path, err: Console) -> None:
    """Writes report.html and scene.lcmlog of a finished run."""
    with err.status("writing report.html and scene.lcmlog"):
        run = tell_notices(dq.load_run(directory), err)
        dq.write_report(run)
        dq.write_scene_log(run)


def tell_notices(run: "dq.RecordedRun", err: Console) -> "dq.RecordedRun":
    """Says what of a run's files cannot be used; the run."""
    for notice in run.notices:
        err.print(Text(f"note: {notice}"), soft_wrap=True)
    return run


class Lasting:
    """A stream that drops what is written to it once nobody reads it any more.

    Args:
        stream: Its own, which is that of file descriptor `number`.
        number: 1 or 2.
    """

    def __init__(self, stream: TextIO, number: int) -> None:
        self._stream, self._number = stream, number

    def write(self, text: str) -> int:
        """Writes the text, or drops it; the number of its letters."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._drop()
            return len(text)

    def flush(self) -> None:
        """Hands on what was written, or drops it."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._drop()

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)

    def _drop(self) -> None:
        """Puts nothing in the pipe's place: for this process and whatever it begins."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._number)
        os.close(nowhere)


def make_streams_last() -> None:
    """Puts a `Lasting` in the place of both standard streams.

    Letters that a terminal or a pipe does not have are written as escapes.
    """
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if sys.stdout is not None:  # as of a process that was begun without any
        sys.stdout = cast(TextIO, Lasting(sys.stdout, 1))
    if sys.stderr is not None:
        sys.stderr = cast(TextIO, Lasting(sys.stderr, 2))
