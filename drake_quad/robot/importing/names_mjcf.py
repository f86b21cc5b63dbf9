"""The names of MJCF: of what makes a robot, in any version of MuJoCo so far.

MuJoCo itself refuses any other, so nothing that it reads is in danger here.
"""

from drake_quad.robot.importing.names import names

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
