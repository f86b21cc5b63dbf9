"""A run's joints as CSV, with the names, zeros and senses of rotation of the robot's own file.

In a log, angles are those of the robot's normal form; whoever plays them on the robot, or in
another simulator, wants them as the robot's own file means them.
"""

import csv
from pathlib import Path

import numpy as np

from drake_quad.common import FloatArray
from drake_quad.errors import InputError
from drake_quad.robot.mapping import read_mapping
from drake_quad.runs.reader import LOG, RecordedRun, run_of
from drake_quad.util.files import user_path, write_whole

POSITION, SPEED, TORQUE = "", "_velocity", "_effort"  # after a joint's name
BASE = ("base_x", "base_y", "base_z", "base_qw", "base_qx", "base_qy", "base_qz")
DIGITS = 9


def joint_table(run: RecordedRun) -> tuple[list[str], FloatArray]:
    """The columns' names, and a row a sample (N, columns).

    Time [s]; of each joint its angle [rad], speed [rad/s] and the torque of its drive [Nm], about
    the axis and from the zero of the robot's own file; and the pose in W of the trunk's link in
    that file: place [m], and attitude as a quaternion.

    Raises:
        InputError: The log has no sample, or not the robot's joints.
    """
    joints = run.robot.joint_names
    rows = np.array(run.layout.q_joints), np.array(run.layout.v_joints)
    q = run.positions[:, rows[0]].reshape(len(run.log), 12)
    v = run.velocities[:, rows[1] - run.layout.num_positions].reshape(len(run.log), 12)
    if not len(run.log) or np.all(np.isnan(q)):
        raise InputError(
            source=str(run.directory), field=LOG, value=len(run.log),
            remedy="holds no sample of the robot's joints: nothing to export",
        )  # fmt: skip
    mapping = read_mapping(run.robot)
    own = [mapping.get("joints", {}).get(name, {}) for name in joints]
    sign = np.array([float(one.get("sign", 1.0)) for one in own])
    turn = np.array([float(one.get("turn", 0.0)) for one in own])
    torque = run.log.numbers([f"tau_{name}" for name in joints])
    names = ["t"]
    for kind in (POSITION, SPEED, TORQUE):
        names += [f"{name}{kind}" for name in joints]
    parts = [run.log.t[:, None], sign * (q + turn), sign * v, sign * torque]
    return [*names, *BASE], np.concatenate([*parts, _trunk_poses(run, mapping)], axis=1)


def write_joint_table(
    run: RecordedRun | str | Path, path: str | Path, *, option: str = "--csv"
) -> int:
    """Writes the table as CSV, and returns how many rows it has.

    Raises:
        InputError: As `joint_table`; or the file cannot be written.
    """
    names, values = joint_table(run_of(run))

    def write(to: Path) -> None:
        with to.open("w", encoding="utf-8", newline="") as file:
            rows = csv.writer(file, lineterminator="\n")
            rows.writerow(names)
            rows.writerows([f"{x:.{DIGITS}g}" if np.isfinite(x) else "" for x in row]
                           for row in values.tolist())  # fmt: skip

    write_whole(user_path(path), write, option=option)
    return len(values)


def _trunk_poses(run: RecordedRun, mapping: dict[str, object]) -> FloatArray:
    """Place and attitude (N, 7) of the trunk's link as the robot's own file has its frame.

    B's origin is amid the hips, at p_TB in the trunk's frame T, and B is turned about T's z by yaw.
    """
    from scipy.spatial.transform import Rotation

    first = run.layout.q_base
    pose = run.positions[:, first : first + 7]
    trunk = mapping.get("trunk")
    trunk = trunk if isinstance(trunk, dict) else {}
    p_TB = np.array(trunk.get("p_TB", [0.0, 0.0, 0.0]), dtype=float)
    yaw = Rotation.from_euler("z", float(trunk.get("yaw_TB_deg", 0.0)), degrees=True)
    found = np.full((len(pose), 7), np.nan)
    known = np.all(np.isfinite(pose), axis=1) & (np.linalg.norm(pose[:, :4], axis=1) > 0.0)
    R_WT = Rotation.from_quat(pose[known][:, [1, 2, 3, 0]]) * yaw.inv()
    found[known, :3] = pose[known, 4:] - R_WT.apply(p_TB)
    found[known, 3:] = R_WT.as_quat()[:, [3, 0, 1, 2]]
    return found
