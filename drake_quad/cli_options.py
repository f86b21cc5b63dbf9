"""What the commands' options have in common."""

from typing import Annotated

import typer
from rich.console import Console

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
