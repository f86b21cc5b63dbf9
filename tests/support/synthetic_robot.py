"""Writes URDFs of quadrupeds that differ from the normal form in the ways people's files do."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

FLAT = '<inertia ixx="{0}" iyy="{1}" izz="{2}" ixy="{3}" ixz="0.0002" iyz="-0.0001"/>'


@dataclass(frozen=True)
class Quadruped:
    """How the file is to be. All legs are alike, left and right mirrored.

    Attributes:
        hip: Abduction axis of the left front leg in the trunk, (x, y, z) [m].
        out: From the abduction axis to the hip pitch axis, x, y and z [m].
        aside: Lateral offsets of knee and foot [m].
        thigh: From hip pitch to knee: x and z at the file's zero [m].
        shank: From knee to foot: x and z at the file's zero [m].
        signs: Of the axes of abduction, hip pitch and knee of each leg.
        limits: Of the three joints, in the file's terms with all signs +; None: no limits.
        rear: -1 for rear legs mirrored front to back, +1 for legs alike.
        effort: Text of the effort attribute.
        speed: Text of the velocity attribute.
        foot: `sphere`, `cylinder`, `link` (a fixed link without a shape) or `none`.
        tilt: Of the link frames against each other, roll, pitch, yaw [rad].
        roll: How far the left legs are abducted at the file's zero [rad].
        mass: Of every link of a leg [kg].
        base: `free`, `fixed` or `floating`: how the world is told, if at all.
        arm: Whether it has an arm of four joints on its back.
        extra: More text before the end.
    """

    hip: tuple[float, float, float] = (0.3, 0.1, 0.0)
    out: tuple[float, float, float] = (0.0, 0.08, 0.0)
    aside: tuple[float, float] = (0.0, 0.0)
    thigh: tuple[float, float] = (0.0, -0.3)
    shank: tuple[float, float] = (0.0, -0.32)
    signs: tuple[int, int, int] = (1, 1, 1)
    limits: tuple[tuple[float, float] | None, ...] = ((-0.6, 0.8), (-1.2, 1.5), (-2.5, -0.3))
    rear: int = 1
    effort: str = "60"
    speed: str = "12"
    foot: str = "sphere"
    tilt: tuple[float, float, float] = (0.0, 0.0, 0.0)
    roll: float = 0.0
    mass: float = 1.3
    base: str = "free"
    arm: bool = False
    extra: str = ""

    def text(self, *, legs: str = "FL FR RL RR") -> str:
        """The URDF."""
        parts = [_link("body", 12.0, (0.01, 0.002, 0.03), _box("body", 0.5, 0.2, 0.12))]
        if self.base != "free":
            kind = "fixed" if self.base == "fixed" else "floating"
            parts.append('<link name="world"/>')
            parts.append(_joint("to_world", "world", "body", kind, (0, 0, 0.5), (0, 0, 0)))
        parts += [self._leg(name) for name in legs.split()]
        if self.arm:
            parts.append(_arm())
        return f'<robot name="beast">{"".join(parts)}{self.extra}</robot>'

    def _leg(self, name: str) -> str:
        y = 1.0 if name[1] == "L" else -1.0
        x = 1.0 if name[0] == "F" else float(self.rear)
        front = 1.0 if name[0] == "F" else -1.0
        at = [
            (front * self.hip[0], y * self.hip[1], self.hip[2]),
            (
                x * self.out[0] if self.rear < 0 else front * self.out[0],
                y * self.out[1],
                self.out[2],
            ),
            (x * self.thigh[0], y * self.aside[0], self.thigh[1]),
            (x * self.shank[0], y * self.aside[1], self.shank[1]),
        ]
        # Each link's frame is turned by `tilt` against the one before; all is told in them.
        R = [Rotation.identity()]
        for _ in range(3):
            R.append(R[-1] * Rotation.from_euler("xyz", self.tilt))
        parents = ["body", f"{name}_hip", f"{name}_thigh", f"{name}_shank"]
        axes = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 1.0, 0]]) * np.array(self.signs)[:, None]
        splay = Rotation.from_euler("x", y * self.roll)
        at[1:], axes[1:] = [splay.apply(p) for p in at[1:]], splay.apply(axes[1:])
        text = ""
        for k, role in enumerate(("haa", "hfe", "kfe")):
            flip = (y, x, x)[k]  # mirrored legs have mirrored limits
            ends = self.limits[k]
            if ends is not None:
                ends = (ends[0], ends[1]) if flip > 0 else (-ends[1], -ends[0])
                ends = ends if self.signs[k] > 0 else (-ends[1], -ends[0])
            text += _joint(
                f"{name}_{role}",
                parents[k],
                parents[k + 1],
                "revolute" if ends else "continuous",
                R[k].inv().apply(at[k]),
                self.tilt,
                axis=R[k + 1].inv().apply(axes[k]),
                limits=ends,
                effort=self.effort,
                speed=self.speed,
            )
            com = R[k + 1].inv().apply((0.01, 0.02 * y, -0.05 * k))
            text += _link(parents[k + 1], self.mass / (k + 1), com, "")
        foot = R[3].inv().apply(at[3])
        shape = {
            "sphere": '<sphere radius="0.025"/>',
            "cylinder": '<cylinder radius="0.02" length="0.06"/>',
        }.get(self.foot)
        if self.foot == "none":
            return text
        text += _joint(f"{name}_toe", parents[3], f"{name}_foot", "fixed", foot, (0, 0, 0))
        collision = f"<collision><geometry>{shape}</geometry></collision>" if shape else ""
        return text + _link(f"{name}_foot", 0.1, (0.0, 0.0, 0.0), collision)


def _told(v: object) -> str:
    return " ".join(repr(float(x)) for x in np.asarray(v, dtype=float))


def _box(name: str, *size: float) -> str:
    shape = f'<geometry><box size="{_told(size)}"/></geometry>'
    return f'<visual name="{name}">{shape}</visual><collision name="{name}">{shape}</collision>'


def _link(name: str, mass: float, com: object, shapes: str) -> str:
    if mass == 0.0:
        return f'<link name="{name}">{shapes}</link>'
    inertia = FLAT.format(0.01 * mass, 0.012 * mass, 0.008 * mass, 0.001 * mass)
    return (
        f'<link name="{name}"><inertial><origin xyz="{_told(com)}"/><mass value="{mass}"/>'
        f"{inertia}</inertial>{shapes}</link>"
    )


def _joint(
    name: str,
    parent: str,
    child: str,
    kind: str,
    xyz: object,
    rpy: object,
    *,
    axis: object = (1.0, 0.0, 0.0),
    limits: tuple[float, float] | None = None,
    effort: str = "60",
    speed: str = "12",
) -> str:
    ends = f'lower="{limits[0]}" upper="{limits[1]}" ' if limits else ""
    moving = f'<axis xyz="{_told(axis)}"/><limit {ends}effort="{effort}" velocity="{speed}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_told(xyz)}" rpy="{_told(rpy)}"/>'
        f"{moving if kind not in ('fixed', 'floating') else ''}</joint>"
    )


def _arm() -> str:
    text, parent = "", "body"
    for k, axis in enumerate(((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0))):
        name = f"arm_{k}"
        text += _joint(f"{name}_joint", parent, name, "revolute", (0.1, 0, 0.1), (0, 0.3, 0),
                       axis=axis, limits=(0.2 * k, 2.0))  # fmt: skip
        text += _link(name, 0.5, (0.05, 0.0, 0.02), "")
        parent = name
    return text
