"""What the commands' options have in common."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from drake_quad.errors import InputError

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
    int | None, typer.Option(help="Processes; as many as there are cores unless told.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]


def claim_file(path: Path | None, option: str) -> None:
    """Makes sure before any long work that the file of an option can be written; makes nothing.

    Raises:
        InputError: If it cannot; it names the option.
    """
    if path is None:
        return

    def refuse(remedy: str) -> InputError:
        return InputError(source=option, field=option[2:], value=str(path), remedy=remedy)

    try:
        if path.is_dir():
            raise refuse("is a directory; give a file in it")
        if path.exists() and not path.is_file():  # to be put in place of /dev/null would harm
            raise refuse("is no file that could be written anew; give another")
        # Folders that are not there yet are made in the lowest that is, when the file is written.
        folder = next(p for p in path.absolute().parents if p.exists() or p.is_symlink())
        probe = folder / f".{path.name}.part"  # as long a name as `write_whole` will take
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise refuse(f"cannot be written: {error.strerror}; give another with {option}") from None
