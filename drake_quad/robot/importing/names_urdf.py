"""The names of URDF, of what makes a robot: those of ROS, of Drake, and of others that are common.

Others' own are let pass unless they are nearly one of these; so what is, and changes nothing, is
here, too.
"""

from drake_quad.robot.importing.names import names

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
