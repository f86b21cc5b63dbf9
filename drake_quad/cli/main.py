"""The drake-quad command: thin over the API.

Results go to stdout, progress and messages to stderr. Exit status: 0 the goal was reached, 1 it was
not, 2 the input cannot be used, or the machine, 130 interrupted before there was anything to keep.
"""

import platform
import re
import sys
from importlib.metadata import version
from itertools import pairwise
from typing import Annotated

import typer

from drake_quad import __version__
from drake_quad.cli.bus import bus_replay, control, simulate
from drake_quad.cli.common import make_streams_last
from drake_quad.cli.passport import passport
from drake_quad.cli.robots import chart, check, inspect
from drake_quad.cli.runs import export, plan, replay, report, run, scenarios
from drake_quad.cli.see import see
from drake_quad.cli.studies import compare, sweep
from drake_quad.errors import DrakeQuadError, InputError, PlanningError, printable

INTERRUPTED = 130  # as shells have it: 128 and the number of SIGINT

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _tell_version(asked: bool) -> None:
    """Prints the versions that a run depends on most, for reports of faults, and ends."""
    if asked:
        python = platform.python_version()
        print(f"drake-quad {__version__} (Drake {version('drake')}, Python {python})")
        raise typer.Exit()


@app.callback()
def options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_tell_version, is_eager=True, help="Tell the version."),
    ] = False,
) -> None:
    """Can my quadruped climb these stairs, how, and how safely?

    Plans a statically stable gait, simulates it in Drake's contact physics, and measures it.
    """


for command in (
    run,
    plan,
    report,
    replay,
    export,
    inspect,
    check,
    chart,
    passport,
    see,
    sweep,
    compare,
    scenarios,
    control,
    simulate,
    bus_replay,
):
    app.command()(command)


def main() -> None:
    """Entry point: errors on purpose become one line and an exit status."""
    make_streams_last()
    try:
        status = app(standalone_mode=False)
    except typer.TyperException as error:  # an option or a command that there is not
        if len(sys.argv) == 1:  # Typer has printed the help
            raise SystemExit(2) from None
        _fail(_usage_line(error), 2)
    except InputError as error:
        _fail(str(error), 2)
    except PlanningError as error:
        _fail(f"no plan: {error.reason}", 1)
    except DrakeQuadError as error:  # a sweep that cannot go on
        _fail(str(error), 2)
    except OSError as error:
        where = error.filename or f"in `{' '.join(['drake-quad', *sys.argv[1:]])}`"
        _fail(f"{where}: {error.strerror or error}", 2)
    except KeyboardInterrupt:  # before Typer sees to it
        _fail("interrupted", INTERRUPTED)
    if status == INTERRUPTED:  # what Typer makes of Ctrl-C, without a word
        _fail("interrupted", INTERRUPTED)
    raise SystemExit(status or 0)


def _usage_line(error: typer.TyperException) -> str:
    """What is wrong with how the command was called, and where the right ways are told."""
    message = error.format_message()
    if (number := _NOT_A_NUMBER.search(message)) is not None:
        return _number_line(number["option"], number["kind"])
    message = message[:1].lower() + message[1:] + ("" if message.endswith((".", "?")) else ".")
    context = getattr(error, "ctx", None)  # errors of usage have one
    command = "drake-quad" if context is None else context.command_path
    return f"{message} `{command} --help` tells what there is."


_NOT_A_NUMBER = re.compile(
    r"value for '(?P<option>--[\w-]+)'.*(?:valid (?P<kind>number|integer)|is not a valid)"
)


def _number_line(option: str, kind: str | None) -> str:
    """What is wrong with an option's number: the text as it was given, and what would be right."""
    given = [
        second if first == option else first.partition("=")[2]
        for first, second in pairwise([*sys.argv[1:], ""])
        if first == option or first.startswith(f"{option}=")
    ]
    value, name = given[-1] if given else "", option.removeprefix("--")
    right = "a whole number" if kind == "integer" else "a number with a decimal point and no unit"
    return str(InputError(source=option, field=name, value=value, remedy=f"must be {right}"))


def _fail(message: str, status: int) -> None:
    print(f"drake-quad: {printable(' '.join(message.split()))}", file=sys.stderr)
    raise SystemExit(status)
