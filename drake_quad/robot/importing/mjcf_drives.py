"""What an MJCF says of its joints' drives, and of the pose in which the robot stands."""

import math

from drake_quad.robot.importing.cleaned import DRIVE_NUMBERS, Cleaned, Drive
from drake_quad.robot.importing.records import DROPPED
from drake_quad.robot.importing.xml_numbers import floats

_POSITIONS = {"free": 7, "ball": 4}  # of a joint in a keyframe; of all others one


def read_drives(c: Cleaned) -> None:
    """Takes torque limits and armature of the joints, which Drake is not to see.

    Raises:
        InputError: If one is no number, or a motor's joint is not there.
    """
    _read_joints(c)
    for place in c.root.findall("actuator"):
        for actuator in place:
            name = actuator.get("joint")
            if name is None:
                continue
            if name not in c.drives:
                raise c.refuse(f"{actuator.tag}.joint", name, "there is no such joint")
            drive = c.drives[name]
            gear = (c.strictly(actuator.get("gear"), f"{name}: gear") or [1.0])[0]
            limits = [c.strictly(actuator.get("forcerange"), f"{name}: forcerange")]
            if actuator.tag == "motor":
                limits.append(c.strictly(actuator.get("ctrlrange"), f"{name}: ctrlrange"))
            for limit in limits:
                if len(limit) == 2 and limit != [0.0, 0.0]:
                    drive.effort = min(drive.effort, abs(gear) * max(map(abs, limit)))


def _read_joints(c: Cleaned) -> None:
    """Takes what the joints themselves say, and puts their limits in order."""
    _, otherwise, most = DRIVE_NUMBERS[0]
    for joint in c.root.iter("joint"):
        name = joint.get("name", "")
        if not name:
            continue
        drive = c.drives.setdefault(name, Drive())
        armature = joint.attrib.pop("armature", None)
        drive.rotor_inertia = c.drive_number(armature, f"{name}: armature", otherwise, most)
        text = joint.attrib.pop("actuatorfrcrange", None)
        limit = c.strictly(text, f"{name}: actuatorfrcrange")
        ends = floats(joint.get("range"))
        if len(ends) == 2:
            low, high = c.order_limits(name, *ends)
            joint.set("range", f"{low!r} {high!r}")
            if low == high == 0.0:
                del joint.attrib["range"]
        drive.effort = max(map(abs, limit)) if limit else math.inf


def read_pose(c: Cleaned) -> None:
    """Takes the joints' angles in the first keyframe; Drake is to see none of it."""
    starts, count = {}, 0
    for body in c.root.findall("worldbody"):
        for joint in body.iter():
            if joint.tag in ("joint", "freejoint"):
                kind = "free" if joint.tag == "freejoint" else joint.get("type", "hinge")
                if kind not in _POSITIONS:
                    starts[joint.get("name", "")] = count
                count += _POSITIONS.get(kind, 1)
    for key in c.root.findall("keyframe/key")[:1]:
        told = c.strictly(key.get("qpos"), "keyframe: qpos")
        if told and len(told) != count:
            text = f"keyframe: {len(told)} positions where the joints have {count}"
            c.note(DROPPED, text)
        elif told:
            c.reference.update({name: told[start] for name, start in starts.items() if name})
