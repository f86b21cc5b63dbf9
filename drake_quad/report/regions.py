"""The region of balance under a run's robot, as its log has the feet."""

from functools import cached_property

import numpy as np

from drake_quad.gait.legs import FloatArray
from drake_quad.report.motion import BaseMotion, base_motion
from drake_quad.report.run_files import Run
from drake_quad.stability.kinds import FEASIBLE, FRICTION, HULL, stricter
from drake_quad.stability.level import static_region
from drake_quad.stability.measured import Gauge, Posture
from drake_quad.stability.region import Region, find_region
from drake_quad.stability.torque import joint_limits

MEASURED = {HULL: "margin", FRICTION: "margin_friction", FEASIBLE: "margin_feasible"}


class Regions:
    """Regions by sample.

    Args:
        run: The run. What it did not measure is not shown: then it is the hull of the feet.
    """

    def __init__(self, run: Run) -> None:
        self._run = run
        asked = stricter(run.scenario.monitor.margins, run.scenario.gait.margin)
        wanted = HULL if run.kinematic else asked
        self.kind = wanted if MEASURED[wanted] in run.log.columns else HULL
        self._bearing = run.log.flags("bearing")
        self._places = run.log.feet("position")

    @property
    def margin(self) -> FloatArray:
        """The margin that goes with them (N,) [m]."""
        return self._run.log.number(MEASURED[self.kind])

    def corners(self, sample: int) -> FloatArray:
        """The region's corners (k, 2) in W [m]; of the hull, its feet."""
        feet = self._places[sample, self._bearing[sample], :2]
        if self.kind == HULL or not len(feet):
            return np.asarray(feet)
        return self._region(sample).corners

    def _region(self, sample: int) -> Region:
        robot, base = self._run.robot, self._base
        posture = Posture(
            bearing=self._bearing[sample].astype(np.float64),
            places=self._places[sample],
            com=np.zeros(3),
            com_velocity=np.zeros(3),
            p_WB=base.p_WB[sample],
            R_WB=base.R_WB[sample],
            q=self._run.positions[sample, self._run.layout.q_joints].reshape(4, 3),
        )
        friction = self._run.scenario.simulation.friction
        gauge = Gauge(robot, self.kind, friction, robot.mass, robot.effort)
        contacts = gauge.contacts(posture)
        if self.kind == FRICTION:
            return static_region(contacts)
        limits = joint_limits(robot, posture.R_WB, posture.q, self._bearing[sample])
        return find_region(contacts, limits=limits)

    @cached_property
    def _base(self) -> BaseMotion:
        return base_motion(self._run)
