"""The names of SDFormat, of what makes a robot: of versions 1.0 to 1.12, and Drake's.

Version 1.0 has as attributes what is in elements since.
"""

from drake_quad.robot.importing.names import names

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
