"""Writes models/paper_quadruped.urdf: the robot that the paper leaves unnamed, to its Table I.

The legs are sized so that every corner of Table I's workspace boxes, over the vertical range of
level-body climbing (0.13 m rises), is within reach, and so that no knee or shank meets a nosing
while the treads under the body rise or fall by 0.26 m per metre. Run it from the repository's top:

    python scripts/make_paper_quadruped.py [--foot-radius METRES] [--out FILE]
"""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

HIP_X, HIP_Y, HIP_OFFSET = 0.40, 0.18, 0.09  # abduction axis in B; leg plane beyond it [m]
# A ball foot, as robots of this size have. It rolls by its radius times the shank's turn, about
# 1 rad in a stance, which planner, controller and certificate count with.
THIGH, SHANK, FOOT_RADIUS = 0.52, 0.70, 0.020  # [m]
SHANK_RADIUS, SHIN_END = 0.018, 0.05  # [m]; the shank's shape ends this far above the foot's centre
TRUNK_SIZE, TRUNK_MASS = (0.86, 0.26, 0.16), 38.0
HIP_MASS, THIGH_MASS, SHANK_MASS = 1.8, 2.4, 1.3  # 5.5 kg a leg, 22 kg of 60 kg
ROTOR_INERTIA, GEAR_RATIO = 1.0e-4, 50.0  # 0.25 kg m^2 at the joint
# Torque and speed are within those of drives that one can buy, by their maker's table: RMD-X12-320
# at abduction and hip (320 Nm at most, 85 Nm rated, at 100 rpm), RMD-X15-450 at the knee (450 Nm,
# 145 Nm, 98 rpm); and of a robot, the Unitree B2: 200, 200 and 320 Nm, 23, 23 and 14 rad/s.
#         lower, upper [rad], effort [Nm], velocity [rad/s]
LIMITS = {
    "abduction": (-1.0, 1.0, 200.0, 8.0),
    "hip": (-1.3, 2.2, 200.0, 8.0),
    "knee": (-2.75, -0.15, 300.0, 10.0),
}


def box_inertia(mass: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Principal moments of a solid box [kg m^2]."""
    m = mass / 12.0
    return m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y)


def link(name: str, mass: float, com: str, inertia: tuple[float, ...], shapes: str) -> str:
    """One link; `shapes` holds its visuals and collisions."""
    ixx, iyy, izz = inertia
    return (
        f'  <link name="{name}">\n    <inertial>\n      <origin xyz="{com}"/>\n'
        f'      <mass value="{mass}"/>\n      <inertia ixx="{ixx:.6f}" iyy="{iyy:.6f}" '
        f'izz="{izz:.6f}" ixy="0" ixz="0" iyz="0"/>\n    </inertial>\n{shapes}  </link>\n'
    )


def shape(kind: str, name: str, xyz: str, geometry: str, color: str = "", rpy: str = "") -> str:
    """One visual or collision element."""
    turn = f' rpy="{rpy}"' if rpy else ""
    paint = f'<material name="{color}"/>' if color else ""
    return (
        f'    <{kind} name="{name}"><origin xyz="{xyz}"{turn}/>'
        f"<geometry>{geometry}</geometry>{paint}</{kind}>\n"
    )


def joint(name: str, role: str, parent: str, child: str, xyz: str, axis: str) -> str:
    """One actuated joint with its limits, rotor and gear."""
    lower, upper, effort, velocity = LIMITS[role]
    return (
        f'  <joint name="{name}" type="revolute">\n    <origin xyz="{xyz}"/>\n'
        f'    <parent link="{parent}"/>\n    <child link="{child}"/>\n    <axis xyz="{axis}"/>\n'
        f'    <limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="{velocity}"/>\n'
        f'    <dynamics damping="0.1" friction="0"/>\n  </joint>\n'
        f'  <transmission name="{name}_drive">\n'
        f"    <type>transmission_interface/SimpleTransmission</type>\n"
        f'    <joint name="{name}">\n'
        f"      <hardwareInterface>EffortJointInterface</hardwareInterface>\n    </joint>\n"
        f'    <actuator name="{name}">\n'
        f'      <drake:rotor_inertia value="{ROTOR_INERTIA}"/>\n'
        f'      <drake:gear_ratio value="{GEAR_RATIO}"/>\n    </actuator>\n  </transmission>\n'
    )


def leg(name: str, front: float, left: float, foot_radius: float) -> str:
    """Hip, thigh and shank of one leg; the foot is the sphere at the shank's end."""
    y = left * HIP_OFFSET
    ball = f'<sphere radius="{foot_radius}"/>'
    upper = shape("visual", "motor", f"0 {0.3 * y} 0", '<cylinder radius="0.06" length="0.10"/>',
                  "steel", "1.5708 0 0")  # fmt: skip
    upper += shape("collision", f"{name}_motor", f"0 {0.3 * y} 0",
                   '<cylinder radius="0.06" length="0.10"/>', "", "1.5708 0 0")  # fmt: skip
    thigh_rod = f'<capsule radius="0.04" length="{THIGH - 0.08}"/>'
    thigh = shape("visual", "thigh", f"0 0 {-THIGH / 2}", thigh_rod, name[0] + "_limb")
    thigh += shape("visual", "knee", f"0 0 {-THIGH}", '<sphere radius="0.05"/>', "steel")
    thigh += shape("collision", f"{name}_thigh", f"0 0 {-THIGH / 2}", thigh_rod)
    thigh += shape("collision", f"{name}_knee", f"0 0 {-THIGH}", '<sphere radius="0.05"/>')
    shin = SHANK - SHIN_END  # its round end still clears the ground at 57° of tilt
    shin_rod = f'<capsule radius="{SHANK_RADIUS}" length="{shin}"/>'
    tip_rod = f'<cylinder radius="{foot_radius}" length="{SHIN_END}"/>'
    shank = shape("visual", "shank", f"0 0 {-shin / 2}", shin_rod, name[0] + "_limb")
    shank += shape("visual", "tip", f"0 0 {-SHANK + SHIN_END / 2}", tip_rod, "rubber")
    shank += shape("visual", "foot", f"0 0 {-SHANK}", ball, "rubber")
    shank += shape("collision", f"{name}_shank", f"0 0 {-shin / 2}", shin_rod)
    shank += shape("collision", f"{name}_foot", f"0 0 {-SHANK}", ball)
    t, s = THIGH_MASS * THIGH**2 / 12, SHANK_MASS * SHANK**2 / 12
    return (
        link(f"{name}_hip", HIP_MASS, f"0 {0.5 * y} 0", (0.004, 0.004, 0.004), upper)
        + link(f"{name}_thigh", THIGH_MASS, f"0 0 {-0.4 * THIGH}", (t, t, 0.003), thigh)
        + link(f"{name}_shank", SHANK_MASS, f"0 0 {-0.4 * SHANK}", (s, s, 0.001), shank)
        + joint(f"{name}_abduction", "abduction", "trunk", f"{name}_hip",
                f"{front * HIP_X} {left * HIP_Y} 0", "1 0 0")
        + joint(f"{name}_hip_pitch", "hip", f"{name}_hip", f"{name}_thigh", f"0 {y} 0", "0 1 0")
        + joint(f"{name}_knee", "knee", f"{name}_thigh", f"{name}_shank", f"0 0 {-THIGH}", "0 1 0")
    )  # fmt: skip


def robot(foot_radius: float = FOOT_RADIUS) -> str:
    """The URDF's text.

    Args:
        foot_radius: Radius of the balls at the shanks' ends [m]; their centres stay.
    """
    size = " ".join(str(d) for d in TRUNK_SIZE)
    trunk = shape("visual", "trunk", "0 0 0.02", f'<box size="{size}"/>', "shell")
    trunk += shape("visual", "head", "0.52 0 0.10", '<box size="0.18 0.18 0.14"/>', "F_limb")
    trunk += shape("visual", "eyes", "0.615 0 0.12", '<box size="0.01 0.14 0.05"/>', "rubber")
    trunk += shape("visual", "neck", "0.44 0 0.07", '<box size="0.10 0.12 0.12"/>', "steel")
    trunk += shape("collision", "trunk", "0 0 0.02", f'<box size="{size}"/>')
    trunk += shape("collision", "head", "0.52 0 0.10", '<box size="0.18 0.18 0.14"/>')
    colors = {"shell": ".85 .85 .82 1", "steel": ".35 .37 .40 1", "rubber": ".08 .08 .08 1",
              "F_limb": ".90 .45 .10 1", "R_limb": ".15 .40 .75 1"}  # fmt: skip
    text = '<?xml version="1.0"?>\n<!-- Written by scripts/make_paper_quadruped.py. -->\n'
    text += '<robot name="paper_quadruped" xmlns:drake="https://drake.mit.edu/">\n'
    for name, rgba in colors.items():
        text += f'  <material name="{name}"><color rgba="{rgba}"/></material>\n'
    text += link("trunk", TRUNK_MASS, "0 0 0.0", box_inertia(TRUNK_MASS, *TRUNK_SIZE), trunk)
    for name, front, left in (("FL", 1, 1), ("FR", 1, -1), ("RL", -1, 1), ("RR", -1, -1)):
        text += leg(name, front, left, foot_radius)
    return text + "</robot>\n"


def foot_radius_of(text: str) -> float:
    """A foot radius as it is given on the command line [m]."""
    radius = float(text)
    if not (math.isfinite(radius) and 0.0 < radius <= SHIN_END):
        raise argparse.ArgumentTypeError(f"{text} is not above 0 and at most {SHIN_END} m")
    return radius


def main(arguments: Sequence[str] | None = None) -> None:
    """Writes the file."""
    shipped = Path(__file__).parent.parent / "models" / "paper_quadruped.urdf"
    parser = argparse.ArgumentParser(description="Writes the paper's quadruped as a URDF.")
    parser.add_argument(
        "--foot-radius", type=foot_radius_of, default=FOOT_RADIUS, help="of the feet [m]"
    )
    parser.add_argument("--out", type=Path, default=shipped, help="the file to write")
    given = parser.parse_args(arguments)
    if given.foot_radius != FOOT_RADIUS and given.out.resolve() == shipped.resolve():
        parser.error("another foot radius is for another file: give --out")
    given.out.write_text(robot(given.foot_radius))


if __name__ == "__main__":
    main()
