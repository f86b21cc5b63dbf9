"""ContactMonitor: which foot bears, as the contact solver has it."""

from collections.abc import Mapping

from pydrake.common.value import AbstractValue
from pydrake.geometry import GeometryId
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from drake_quad.gait.legs import SHORT_NAMES
from drake_quad.robot.robot_model import RobotModel


class ContactMonitor(LeafSystem):
    """Reads contact results; never the plan.

    Input ports:
        contact_results: ContactResults of the plant (abstract).
    Output ports:
        contact_state_measured: (4,) 1 where a foot's normal force is above `threshold`.
        foot_force_measured: (12,) force on each foot from what it touches, in W [N].
        foot_contact_position: (12,) where that force acts, in W [m]; the last place known while
            the foot touches nothing.
        foot_slip_speed: (4,) tangential speed at the contact [m/s].
        nonfoot_contact: (2,) how many contacts of anything but a foot there are, and the
            greatest normal force among them [N].
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
        # 1 % of the robot's weight: what a run's log calls bearing.
        self._threshold = 0.01 * robot.mass * 9.81 if threshold is None else threshold
        self._input = self.DeclareAbstractInputPort(
            "contact_results", AbstractValue.Make(ContactResults())
        )
        self._bearing = self.DeclareDiscreteState(4)
        self._force = self.DeclareDiscreteState(12)
        self._position = self.DeclareDiscreteState(12)
        self._slip = self.DeclareDiscreteState(4)
        self._nonfoot = self.DeclareDiscreteState(2)
        self.DeclareStateOutputPort("contact_state_measured", self._bearing)
        self.DeclareStateOutputPort("foot_force_measured", self._force)
        self.DeclareStateOutputPort("foot_contact_position", self._position)
        self.DeclareStateOutputPort("foot_slip_speed", self._slip)
        self.DeclareStateOutputPort("nonfoot_contact", self._nonfoot)
        self.DeclareInitializationDiscreteUpdateEvent(self._update)
        # Offset 0, as everywhere: k T and T + k T round apart, and the order of ticks would vary.
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        results: ContactResults = self._input.Eval(context)
        feet = self._feet
        force, moment, weight, slip = [0.0] * 12, [0.0] * 12, [0.0] * 4, [0.0] * 4
        nonfoot, worst = 0, 0.0
        for k in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(k)
            pair = info.point_pair()
            fx, fy, fz = info.contact_force().tolist()  # on body B, in W
            nx, ny, nz = pair.nhat_BA_W.tolist()
            normal = abs(fx * nx + fy * ny + fz * nz)
            row, sign = feet.get(pair.id_B), 1.0
            if row is None:
                row, sign = feet.get(pair.id_A), -1.0
            elif pair.id_A in feet:
                row = None  # two feet touching each other bear nothing
            if row is None:
                nonfoot += 1
                worst = max(worst, normal)
                continue
            px, py, pz = info.contact_point().tolist()
            i = 3 * row
            force[i] += sign * fx
            force[i + 1] += sign * fy
            force[i + 2] += sign * fz
            moment[i] += normal * px
            moment[i + 1] += normal * py
            moment[i + 2] += normal * pz
            weight[row] += normal
            slip[row] = max(slip[row], info.slip_speed())
        position = context.get_discrete_state(self._position).value().tolist()
        for row in range(4):
            if weight[row] > 1e-9:
                i = 3 * row
                position[i : i + 3] = [m / weight[row] for m in moment[i : i + 3]]
        state.set_value(self._bearing, [float(w > self._threshold) for w in weight])
        state.set_value(self._force, force)
        state.set_value(self._position, position)
        state.set_value(self._slip, slip)
        state.set_value(self._nonfoot, [nonfoot, worst])


def find_feet(
    plant: MultibodyPlant, robot: RobotModel, names: Mapping[GeometryId, str]
) -> dict[GeometryId, int]:
    """Returns the row (0 to 3) of each foot's collision geometry in a finalized plant.

    Args:
        plant: The plant that holds the robot.
        robot: The robot.
        names: Name of every geometry in the scene.

    Raises:
        KeyError: If a foot is missing.
    """
    found = {g: robot.foot_geometry.index(n) for g, n in names.items() if n in robot.foot_geometry}
    if sorted(found.values()) != [0, 1, 2, 3]:
        raise KeyError(f"feet {SHORT_NAMES} are {robot.foot_geometry}, found {found}")
    return found
