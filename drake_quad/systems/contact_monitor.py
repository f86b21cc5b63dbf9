"""ContactMonitor: which foot bears, as the contact solver has it."""

from collections.abc import Mapping

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import GeometryId
from pydrake.multibody.plant import ContactModel, ContactResults, MultibodyPlant
from pydrake.systems.framework import Context, LeafSystem, State

from drake_quad.common import GRAVITY, FloatArray
from drake_quad.estimation.sensor_models import NO_FOOT, PLACES, SUMS, add_contact, conclude
from drake_quad.robot.legs import SHORT_NAMES
from drake_quad.robot.model import RobotModel
from drake_quad.systems.leaf_system import (
    DeclareModelContext,
    DeclareStateOutput,
    EvalModelContext,
    Instant,
)

# The outputs of one instant and their sizes, where the kernel has them: see sensor_models.PLACES.
OUTPUTS = {
    "contact_state": 4,
    "foot_force_measured": 12,
    "foot_contact_position": 12,
    "foot_slip_speed": 4,
    "nonfoot_contact": 2,
}
BEARING, ACTS = slice(0, 4), slice(PLACES, PLACES + 12)


class ContactMonitor(LeafSystem):
    """Reads contact results; never the plan.

    Input ports:
        contact_results: ContactResults of the plant (abstract).
        plant_state: [q; v] of the plant, if it has hydroelastic contacts: their results do not say
            how fast they slip.
    Output ports:
        contact_state_measured: (4,) 1 where a foot bears, held between measurements: the
            robot's contact sensors.
        contact_state: (4,) 1 where a foot's normal force is above `threshold`; as all that follow,
            of the instant at which it is asked for.
        foot_force_measured: (12,) force on each foot from what it touches, in W [N].
        foot_contact_position: (12,) where that force acts, in W [m]; the last place measured while
            the foot touches nothing.
        foot_slip_speed: (4,) tangential speed at the contact [m/s].
        nonfoot_contact: (2,) how many contacts of anything but a foot there are, and the
            greatest normal force among them [N].
        contacts: (34,) the five above, one after the other.
    """

    def __init__(
        self,
        *,
        plant: MultibodyPlant,
        foot_geometries: Mapping[GeometryId, int],
        robot: RobotModel,
        period: float = 0.005,
        threshold: float | None = None,
    ) -> None:
        super().__init__()
        self.set_name("contact_monitor")
        self._feet = dict(foot_geometries)
        instance = plant.GetJointByName(robot.joint_names[0]).model_instance()
        self._own = {
            geometry
            for index in plant.GetBodyIndices(instance)
            for geometry in plant.GetCollisionGeometriesForBody(plant.get_body(index))
        }
        self._shanks = [plant.GetJointByName(name).child_body() for name in robot.joint_names[2::3]]
        # 1 % of the robot's weight: what a run's log calls bearing.
        self._threshold = 0.01 * robot.mass * GRAVITY if threshold is None else threshold
        self._input = self.DeclareAbstractInputPort(
            "contact_results", AbstractValue.Make(ContactResults())
        )
        self._plant, self._state_port = plant, None
        if plant.get_contact_model() != ContactModel.kPoint:
            self._state_port = self.DeclareVectorInputPort(
                "plant_state", plant.num_positions() + plant.num_velocities()
            )
            self._scratch = DeclareModelContext(self, plant)
        self._sensed = DeclareStateOutput(self, "contact_state_measured", 4)
        self._places = int(self.DeclareDiscreteState(12))
        depends = {self._input.ticket(), self.xd_ticket()}
        if self._state_port is not None:
            depends.add(self._state_port.ticket())
        self.parts = Instant(self, "contacts", OUTPUTS, self._measure, depends)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._update)
        # Unrestricted updates see the state that a log sees at the same time, before the plant's
        # step, so that both have one measurement; discrete ones come after that step.
        # Offset 0, as everywhere: k T and T + k T round apart, and the order of ticks would vary.
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: State) -> None:
        now, values = self.parts.Eval(context), state.get_mutable_discrete_state()
        values.set_value(self._sensed, now[BEARING])
        values.set_value(self._places, now[ACTS])

    def _measure(self, context: Context, contacts: FloatArray) -> None:
        results: ContactResults = self._input.Eval(context)
        feet, sums = self._feet, np.zeros(SUMS)
        for k in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(k)
            pair = info.point_pair()
            a, b = feet.get(pair.id_A, NO_FOOT), feet.get(pair.id_B, NO_FOOT)
            row, sign = (b, 1.0) if a == NO_FOOT else (a, -1.0)  # the force is that on B
            if pair.id_A in self._own and pair.id_B in self._own:
                row = NO_FOOT  # a foot that touches the robot itself bears nothing
            add_contact(
                sums, row, sign, info.contact_force(), pair.nhat_BA_W, info.contact_point(),
                info.slip_speed(),
            )  # fmt: skip
        if self._state_port is not None and results.num_hydroelastic_contacts() > 0:
            self._add_surfaces(results, sums, self._state_port.Eval(context), context)
        # Of a foot that touches nothing the last place known stays.
        contacts[ACTS] = context.get_discrete_state(self._places).value()
        conclude(sums, self._threshold, contacts)

    def _add_surfaces(
        self, results: ContactResults, sums: FloatArray, state: FloatArray, context: Context
    ) -> None:
        """Adds the hydroelastic contacts: of each its force, at its surface's centroid."""
        feet, plant, scratch = self._feet, self._plant, EvalModelContext(self._scratch, context)
        plant.SetPositionsAndVelocities(scratch, state)
        for k in range(results.num_hydroelastic_contacts()):
            info = results.hydroelastic_contact_info(k)
            surface = info.contact_surface()
            m, n = feet.get(surface.id_M(), NO_FOOT), feet.get(surface.id_N(), NO_FOOT)
            row, sign = (m, 1.0) if m != NO_FOOT else (n, -1.0)  # the force is that on M
            if surface.id_M() in self._own and surface.id_N() in self._own:
                row = NO_FOOT
            centroid, normal = np.array(surface.centroid()), np.zeros(3)
            for face in range(surface.num_faces()):
                normal += surface.area(face) * np.array(surface.face_normal(face))
            normal /= max(float(np.linalg.norm(normal)), 1e-12)
            slip = 0.0
            if row != NO_FOOT:
                shank = self._shanks[row]
                V = plant.EvalBodySpatialVelocityInWorld(scratch, shank)
                X = plant.EvalBodyPoseInWorld(scratch, shank)
                v = V.Shift(centroid - X.translation()).translational()
                slip = float(np.linalg.norm(v - (v @ normal) * normal))  # what it is on stands
            force = np.array(info.F_Ac_W().translational())
            add_contact(sums, row, sign, force, normal, centroid, slip)


def find_feet(
    plant: MultibodyPlant, robot: RobotModel, names: Mapping[GeometryId, str]
) -> dict[GeometryId, int]:
    """Returns the row (0 to 3) of each foot's collision geometry in a finalized plant.

    In a file a foot's picture may be called as its collision geometry is, and so may other feet.

    Args:
        plant: The plant that holds the robot.
        robot: The robot.
        names: Name of every geometry in the scene.

    Raises:
        KeyError: If a foot is missing.
    """
    shanks = [plant.GetJointByName(name).child_body() for name in robot.joint_names[2::3]]
    found = {
        geometry: row
        for row, (shank, foot) in enumerate(zip(shanks, robot.foot_geometry, strict=True))
        for geometry in plant.GetCollisionGeometriesForBody(shank)
        if names.get(geometry) == foot
    }
    if sorted(found.values()) != [0, 1, 2, 3]:
        raise KeyError(f"feet {SHORT_NAMES} are {robot.foot_geometry}, found {found}")
    return found
