"""The command `see`: what stairs a depth image shows."""

import json
from math import isfinite, radians
from pathlib import Path
from typing import Annotated, Any

import typer

import drake_quad as dq
from drake_quad.cli.common import JsonOption, claim_file


def see(
    image: Annotated[Path, typer.Argument(help="A depth image: PNG or TIFF, 16 bits a pixel.")],
    *,
    intrinsics: Annotated[
        str,
        typer.Option(
            help="fx,fy,cx,cy \\[px] (0 is the middle of the first pixel), or d435, d455, "
            "kinect_v2."
        ),
    ],
    tilt: Annotated[float, typer.Option(help="Optical axis below the horizon \\[deg].")],
    roll: Annotated[float, typer.Option(help="Roll of the camera, right side down \\[deg].")] = 0.0,
    tilt_error: Annotated[
        float, typer.Option(help="Standard deviation of tilt and roll \\[deg].")
    ] = 2.0,
    height: Annotated[
        float | None, typer.Option(help="Height of the camera over the floor, to 2 cm \\[m].")
    ] = None,
    baseline: Annotated[
        float | None,
        typer.Option(help="Baseline of a stereo camera with a D435's errors \\[m]."),
    ] = None,
    scale: Annotated[float, typer.Option(help="Length of one unit of the image \\[m].")] = 0.001,
    picture: Annotated[
        Path | None, typer.Option(help="File to draw the stairs into (.png, .svg or .pdf).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Tell what stairs a depth image shows: rise, run and count, with intervals of 95 %.

    Exit status 1 if it shows none.
    """
    _check("--tilt", tilt, -40.0, 89.0)
    _check("--roll", roll, -60.0, 60.0)
    _check("--tilt-error", tilt_error, 0.01, 10.0)
    _check("--height", height, 0.05, 3.0)
    _check("--baseline", baseline, 0.005, 1.0)
    _check("--scale", scale, 1e-6, 1.0)
    dq.check_picture_path(picture)
    claim_file(picture, "--picture", reads=[image])
    depth = dq.read_depth_image(image, scale=scale)
    model = dq.parse_intrinsics(intrinsics, width=depth.shape[1], height=depth.shape[0])
    seen = dq.see_stairs(
        depth, model, pitch=radians(tilt), roll=radians(roll), camera_height=height,
        tilt_error=radians(tilt_error), baseline=baseline,
    )  # fmt: skip
    told = dq.describe_seen(seen)
    if picture is not None:
        dq.save_picture(dq.draw_seen(seen, depth), picture, salt=image.name)
        told["picture"] = str(picture)
    print(json.dumps(told) if as_json else words(told))
    raise typer.Exit(0 if told["stairs"] else 1)


def _check(option: str, value: float | None, least: float, most: float) -> None:
    if value is not None and not (isfinite(value) and least <= value <= most):
        remedy = f"must be from {least:g} to {most:g}"
        raise dq.InputError(source=option, field=option[2:], value=value, remedy=remedy)


def words(told: dict[str, Any]) -> str:
    """What is seen, in a few lines."""
    if not told["stairs"]:
        return "No stairs: nothing speaks for two steps."
    least, most = told["count_least"], told["count_most"]
    count = f"{least} steps" if most == least else f"{least} steps are seen; there may be more"
    if most is not None and most != least:
        count = f"{least} to {most} steps"

    def figure(name: str) -> str:
        return f"{told[name]['value']:.3f} ± {told[name]['half_width']:.3f} m"

    kind = "open stairs" if told["open"] else "stairs"
    return "\n".join(
        [
            f"{kind.capitalize()} going {told['going']}: {count}.",
            f"rise {figure('rise')}, run {figure('run')} (95 %)",
            f"first nosing {told['places'][0]:.3f} m ahead of the camera, "
            f"yaw {told['yaw_deg']['value']:.1f} ± {told['yaw_deg']['half_width']:.1f}°",
        ]
    )
