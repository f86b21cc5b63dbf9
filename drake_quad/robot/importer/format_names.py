"""The names of attributes and elements in URDF, SDFormat and MJCF.

Others' own are let pass unless they are nearly one of these; so what is, and changes nothing, is
here, too.

Version 1.0 has as attributes what is in elements since.

MuJoCo itself refuses any other, so nothing that it reads is in danger here.
"""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Names:
    """The names that an element knows.

    Attributes:
        attributes: Names of its attributes.
        once: Names of elements in it that occur at most once.
        many: Names of elements in it that may occur several times.
        idle: Attributes and elements that change nothing of a robot; so nobody is asked whether he
            meant one of them.
    """

    attributes: frozenset[str]
    once: frozenset[str]
    many: frozenset[str]
    idle: frozenset[str]


# By an element's tag, or by `parent/tag` where a tag is another thing in another element. What is
# idle, unknown or not in the table is not looked at, with all that is in it.
Table = Mapping[str, Names]


def names(attributes: str = "", *, once: str = "", many: str = "", idle: str = "") -> Names:
    """The names of an element, each a string of words."""
    return Names(*(frozenset(text.split()) for text in (attributes, once, many, idle)))


# fmt: off
_JOINT = names(
    "name type",
    once="origin parent child axis limit dynamics",
    idle="mimic calibration safety_controller dont_collapse drake:screw_thread_pitch",
)
_DRAWN = "verbose drake:illustration_properties drake:perception_properties"
_REDUCED = "role offset hardwareInterface mechanicalReduction mechanical_reduction"
_VALUE = names("value")
URDF = {
    "robot": names(
        "name",
        many="link joint material transmission drake:joint",
        idle="version gazebo sensor frame group loop_joint force_element ros2_control mujoco "
             "drake:collision_filter_group drake:linear_bushing_rpy drake:linear_spring_damper "
             "drake:ball_constraint drake:tendon_constraint",
    ),
    "link": names(
        "name",
        once="inertial",
        many="visual collision",
        idle="type contact gravity kinematic self_filter collision_checking "
             "self_collision_checking",
    ),
    "inertial": names(once="origin mass inertia"),
    "mass": _VALUE,
    "inertia": names("ixx ixy ixz iyy iyz izz"),
    "origin": names("xyz rpy", idle="quat_xyzw"),
    "visual": names("name", once="origin geometry", many="material",
                    idle=f"{_DRAWN} drake:accepting_renderer"),
    "collision": names("name", once="origin geometry",
                       idle=f"{_DRAWN} group concave material drake:proximity_properties"),
    "geometry": names(
        once="box cylinder sphere capsule ellipsoid mesh drake:capsule drake:ellipsoid",
        idle="name convex cone plane",
    ),
    "box": names("size"),
    "cylinder": names("radius length"),
    "sphere": names("radius"),
    "capsule": names("radius length", idle="name"),
    "drake:capsule": names("radius length"),
    "drake:ellipsoid": names("a b c"),
    "mesh": names("filename scale", idle="drake:declare_convex"),
    "joint": _JOINT,
    "drake:joint": _JOINT,
    "parent": names("link"),
    "child": names("link"),
    "axis": names("xyz"),
    "limit": names(
        "lower upper effort velocity",
        idle="acceleration deceleration jerk drake:acceleration drake:jerk command_effort current "
             "gear_velocity",
    ),
    "dynamics": names("damping", idle="friction"),
    "transmission": names(
        many="joint actuator",
        idle="name type mechanicalReduction mechanical_reduction leftActuator rightActuator "
             "flexJoint rollJoint gap_joint passive_joint compensator plugin "
             "use_simulated_gripper_joint",
    ),
    "transmission/joint": names("name", idle=_REDUCED),
    "actuator": names(
        "name",
        once="drake:gear_ratio drake:rotor_inertia",
        idle=f"{_REDUCED} motorTorqueConstant drake:controller_gains",
    ),
    "drake:gear_ratio": _VALUE,
    "drake:rotor_inertia": _VALUE,
}
# fmt: on


# fmt: off
_ROUND = names("radius length", once="radius length")
_EXTRA = (
    "plugin drake:collision_filter_group drake:linear_bushing_rpy drake:linear_spring_damper "
    "drake:ball_constraint drake:tendon_constraint"
)
SDF = {
    "sdf": names("version", many="model world include", idle="light actor"),
    "world": names(
        "name",
        many="model include joint frame",
        idle="namespace gravity physics scene gui wind audio atmosphere magnetic_field road light "
             f"spherical_coordinates actor population state {_EXTRA}",
    ),
    "model": names(
        "name canonical_link placement_frame",
        once="pose origin",
        many="link joint model frame include drake:joint",
        idle="namespace static self_collide allow_auto_disable enable_wind gripper state "
             f"{_EXTRA}",
    ),
    "include": names("merge", once="uri name pose placement_frame", idle="static plugin state"),
    "frame": names("name attached_to", once="pose"),
    "pose": names("relative_to frame degrees rotation_format"),
    "link": names(
        "name",
        once="pose origin inertial",
        many="visual collision",
        idle="gravity enable_wind self_collide kinematic must_be_base_link velocity_decay sensor "
             "projector audio_sink audio_source battery light particle_emitter plugin "
             "drake:deformable_properties",
    ),
    "inertial": names(
        "auto mass",
        once="pose origin mass inertia",
        idle="frame density auto_inertia_params fluid_added_mass",
    ),
    "inertia": names("ixx ixy ixz iyy iyz izz", once="ixx ixy ixz iyy iyz izz"),
    "visual": names(
        "name",
        once="pose origin geometry material",
        idle="transparency visibility_flags cast_shadows laser_retro lighting meta plugin "
             "drake:illustration_properties drake:perception_properties drake:accepting_renderer",
    ),
    "collision": names(
        "name",
        once="pose origin geometry",
        idle="surface max_contacts laser_retro density auto_inertia_params "
             "drake:proximity_properties",
    ),
    "geometry": names(
        once="box capsule cylinder ellipsoid mesh plane sphere drake:capsule drake:ellipsoid",
        idle="cone empty heightmap image polyline",
    ),
    "box": names("size", once="size"),
    "sphere": names("radius", once="radius"),
    "cylinder": _ROUND,
    "capsule": _ROUND,
    "drake:capsule": _ROUND,
    "ellipsoid": names(once="radii"),
    "drake:ellipsoid": names(once="a b c"),
    "mesh": names(
        "filename scale",
        once="uri scale submesh",
        idle="optimization convex_decomposition drake:declare_convex",
    ),
    "joint": names(
        "name type",
        once="pose origin parent child axis drake:rotor_inertia drake:gear_ratio",
        idle="axis2 gearbox_ratio gearbox_reference_body thread_pitch screw_thread_pitch physics "
             "sensor",
    ),
    "drake:joint": names("name type", once="pose drake:parent drake:child drake:damping"),
    "axis": names(
        "xyz",
        once="xyz dynamics limit use_parent_model_frame drake:rotor_inertia drake:gear_ratio",
        idle="mimic initial_position drake:controller_gains drake:mimic",
    ),
    "xyz": names("expressed_in"),
    "dynamics": names(
        "damping", once="damping", idle="friction spring_reference spring_stiffness"
    ),
    "limit": names(
        "lower upper effort velocity",
        once="lower upper effort velocity",
        idle="stiffness dissipation drake:acceleration drake:jerk",
    ),
}
# fmt: on


# fmt: off
_PLACE = "pos quat axisangle xyaxes zaxis euler"
_SOLVER = "solref solimp solmix margin gap condim friction priority contype conaffinity"
_IN_BODY = (
    "body joint freejoint geom attach site camera light plugin composite flexcomp frame replicate "
    "include"
)
_BODY = names(
    f"name childclass user mocap gravcomp fuse simple sleep {_PLACE}",
    once="inertial", many=_IN_BODY,
)
_DRIVE = (
    "name class group user joint jointinparent tendon site refsite slidersite cranksite "
    "cranklength body gear ctrllimited ctrlrange forcelimited forcerange lengthrange delay interp "
    "nsample armature damping"
)
_SERVO = "kp kv dampratio inheritrange"
_DRIVES = {  # what each knows beyond that
    "motor": "",
    "general": "actlimited actrange actdim actearly dyntype dynprm gaintype gainprm biastype "
               "biasprm inheritrange input ffrange velrange",
    "position": f"{_SERVO} timeconst",
    "velocity": "kv",
    "intvelocity": f"{_SERVO} actlimited actrange",
    "orientation": f"{_SERVO} input",
    "pid": f"{_SERVO} ki imax input ffrange posrange velrange slewmax",
    "damper": "kv",
    "cylinder": "timeconst area diameter bias",
    "muscle": "timeconst tausmooth range force scale lmin lmax vmax fpmax fvmax",
    "adhesion": "gain",
    "dcmotor": "motorconst resistance inductance nominal saturation cogging lugre thermal "
               "controller input",
    "plugin": "plugin instance actlimited actrange actdim actearly dyntype dynprm",
}
MJCF = {
    "mujoco": names(
        "model",
        many="compiler option size statistic visual default extension custom asset worldbody "
             "deformable contact equality tendon actuator sensor keyframe include",
    ),
    "compiler": names(
        "alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict "
        "convexhull coordinate discardvisual eulerseq exactmeshinertia fitaabb fusestatic "
        "inertiafromgeom inertiagrouprange meshdir passthrough savecanonical savecompiled "
        "saveinertial settotalmass strippath texturedir usethread",
        once="lengthrange",
    ),
    "default": names(
        "class",
        many="default mesh texture material joint geom site camera light pair equality tendon "
             f"include {' '.join(_DRIVES)}",
    ),
    "asset": names(many="mesh hfield skin texture material model include"),
    "mesh": names(
        "name class content_type file scale inertia builtin params vertex normal texcoord face "
        "refpos refquat smoothnormal maxhullvert material octree_maxdepth octree needsdf",
        many="plugin",
    ),
    "worldbody": _BODY,
    "body": _BODY,
    "inertial": names(f"mass diaginertia fullinertia {_PLACE}"),
    "joint": names(
        "name class type group pos axis ref range limited actuatorfrcrange actuatorfrclimited "
        "actuatorgravcomp armature damping frictionloss margin stiffness springdamper springref "
        "springyield solreflimit solimplimit solreffriction solimpfriction user",
    ),
    "freejoint": names("name group align"),
    "geom": names(
        "name class type size fromto mesh hfield mass density material rgba group user fitscale "
        "shellinertia fluidshape fluidcoef adhesion surfacevel castshadow octree_maxdepth "
        f"{_SOLVER} {_PLACE}",
        many="plugin",
    ),
    "actuator": names(many=f"include {' '.join(_DRIVES)}"),
    **{tag: names(f"{_DRIVE} {own}", many="config") for tag, own in _DRIVES.items()},
    "keyframe": names(many="key include"),
    "key": names("name time qpos qvel act ctrl mpos mquat plastic"),
}
# fmt: on
