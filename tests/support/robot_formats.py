"""One robot's file as URDF, SDF and MJCF, for tests of the importer."""

import numpy as np

from drake_quad.robot.model import RobotModel

FOOT = '<origin xyz="0 0 -0.27"/><geometry><sphere radius="0.02"/></geometry>'
SDF_FOOT = "<pose>0 0 -0.27 0 0 0</pose><geometry><sphere><radius>0.02</radius></sphere></geometry>"
LEGS = {"FL": (0.3, 0.1), "FR": (0.3, -0.1), "RL": (-0.3, 0.1), "RR": (-0.3, -0.1)}
# Of each leg's link: name, place in the link before [m], axis, limits [deg], effort, mass, centre.
LINKS = (
    ("hip", (0.0, 0.0), "1 0 0", (-40, 30), 50, 0.9, (0.01, 0.0, 0.0)),
    ("thigh", (0.08, 0.0), "0 1 0", (-60, 90), 60, 1.1, (0.0, 0.0, -0.1)),
    ("shank", (0.0, -0.25), "0 1 0", (-150, -20), 70, 0.4, (0.0, 0.0, -0.12)),
)
INERTIA = (0.004, 0.005, 0.003)  # of every link [kg m²]


def place(leg: str, k: int) -> tuple[float, float, float]:
    """Of a leg's link in the one before."""
    x, y = LEGS[leg]
    aside, up = LINKS[k][1]
    return (x, y, 0.0) if k == 0 else (0.0, np.sign(y) * aside, up)


def told(v: object) -> str:
    return " ".join(f"{x:.12g}" for x in np.asarray(v, dtype=float))


def urdf() -> str:
    def inertial(mass: float, com: object) -> str:
        i = dict(zip(("ixx", "iyy", "izz"), INERTIA, strict=True)) | {"ixy": 0, "ixz": 0, "iyz": 0}
        values = " ".join(f'{key}="{value}"' for key, value in i.items())
        place = f'<origin xyz="{told(com)}"/><mass value="{mass}"/>'
        return f"<inertial>{place}<inertia {values}/></inertial>"

    text = f'<link name="body">{inertial(9.0, (0.02, 0, 0))}</link>'
    for leg in LEGS:
        parent = "body"
        for k, (name, _, axis, limits, effort, mass, com) in enumerate(LINKS):
            link, ends = f"{leg}_{name}", np.deg2rad(limits)
            foot = f"<collision>{FOOT}</collision>"
            text += f'<link name="{link}">{inertial(mass, com)}{foot if k == 2 else ""}</link>'
            text += (
                f'<joint name="{link}_joint" type="revolute"><origin xyz="{told(place(leg, k))}"/>'
            )
            text += f'<parent link="{parent}"/><child link="{link}"/><axis xyz="{axis}"/><limit '
            text += f'lower="{ends[0]}" upper="{ends[1]}" effort="{effort}" velocity="9"/></joint>'
            parent = link
    return f'<robot name="r">{text}</robot>'


def sdf() -> str:
    def inertial(mass: float, com: object) -> str:
        i = "".join(f"<{k}>{v}</{k}>" for k, v in zip(("ixx", "iyy", "izz"), INERTIA, strict=True))
        pose = f"<pose>{told(com)} 0 0 0</pose>"
        return f"<inertial>{pose}<mass>{mass}</mass><inertia>{i}</inertia></inertial>"

    text = f'<link name="body">{inertial(9.0, (0.02, 0, 0))}</link>'
    for leg in LEGS:
        parent = "body"
        for k, (name, _, axis, limits, effort, mass, com) in enumerate(LINKS):
            link, ends = f"{leg}_{name}", np.deg2rad(limits)
            foot = f'<collision name="f">{SDF_FOOT}</collision>'
            pose = f'<pose relative_to="{parent}">{told(place(leg, k))} 0 0 0</pose>'
            text += (
                f'<link name="{link}">{pose}{inertial(mass, com)}{foot if k == 2 else ""}</link>'
            )
            text += f'<joint name="{link}_joint" type="revolute"><parent>{parent}</parent>'
            text += f"<child>{link}</child>"
            text += (
                f"<axis><xyz>{axis}</xyz><limit><lower>{ends[0]}</lower><upper>{ends[1]}</upper>"
            )
            text += f"<effort>{effort}</effort><velocity>9</velocity></limit></axis></joint>"
            parent = link
    return f'<sdf version="1.9"><model name="r">{text}</model></sdf>'


def mjcf() -> str:
    """With classes that have attributes from those above them, and angles in degrees."""

    def inertial(mass: float, com: object) -> str:
        return f'<inertial pos="{told(com)}" mass="{mass}" diaginertia="{told(INERTIA)}"/>'

    classes, motors = "", ""
    for name, _, axis, limits, effort, _, _ in LINKS:
        inner = f'<joint range="{told(limits)}"/><motor ctrlrange="-{effort} {effort}"/>'
        outer = f'<joint axis="{axis}"/><default class="{name}">{inner}</default>'
        classes += f'<default class="{name}_outer">{outer}</default>'
    bodies = ""
    for leg in LEGS:
        text = '<geom type="sphere" size="0.02" pos="0 0 -0.27" mass="0"/>'
        for k in (2, 1, 0):
            name, _, _, _, _, mass, com = LINKS[k]
            joint = f'<joint name="{leg}_{name}_joint" class="{name}"/>'
            at = told(place(leg, k))
            text = f'<body name="{leg}_{name}" pos="{at}">{inertial(mass, com)}{joint}{text}</body>'
            motors += f'<motor class="{name}" joint="{leg}_{name}_joint"/>'
        bodies += text
    return (
        f'<mujoco model="r"><default>{classes}</default><worldbody>'
        f'<geom type="plane" size="1 1 1"/><body name="body" pos="0 0 1"><freejoint/>'
        f"{inertial(9.0, (0.02, 0, 0))}{bodies}</body></worldbody>"
        f"<actuator>{motors}</actuator></mujoco>"
    )


FORMATS = {"r.urdf": urdf, "r.sdf": sdf, "r.xml": mjcf}


def figures(robot: RobotModel) -> np.ndarray:
    """All that is read of a robot but its speed limits, which MJCF cannot tell."""
    g = robot.geometry
    arrays = (g.p_BH, g.p_HP, g.thigh, g.shank, g.knee_sign, robot.q_lower, robot.q_upper)
    more = (robot.effort, robot.link_mass, robot.link_com, robot.trunk_com)
    return np.concatenate([np.ravel(a) for a in (*arrays, *more)])
