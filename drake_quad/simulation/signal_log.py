"""What is logged, in one log: every logger of its own would be asked for its time at every step."""

from collections.abc import Mapping
from dataclasses import dataclass

from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput, Multiplexer, VectorLog, VectorLogSink

from drake_quad.common import FloatArray
from drake_quad.stability.equilibrium_region import HULL

# What is logged: name of the log, system, port. All at the log period. What is measured is of the
# row's own instant; what is commanded is in force then.
LOGS = (
    ("state", "plant", "state"),
    ("torque", "plant", "net_actuation"),
    ("gait_phase", "controller", "gait_phase"),
    ("standing", "controller", "contact_state_desired"),
    ("body_desired", "controller", "body_desired"),
    ("feet_desired", "controller", "feet_desired"),
    ("bearing", "contact_monitor", "contact_state"),
    ("force", "contact_monitor", "foot_force_measured"),
    ("contact_position", "contact_monitor", "foot_contact_position"),
    ("slip_speed", "contact_monitor", "foot_slip_speed"),
    ("nonfoot", "contact_monitor", "nonfoot_contact"),
    ("margin", "stability_monitor", "stability_margin"),
    ("zmp_margin", "stability_monitor", "zmp_margin"),
    ("least_margins", "stability_monitor", "least_margins"),
    ("com", "stability_monitor", "com_position"),
    ("push_force", "push_source", "push_force"),
    ("catch", "controller", "catch"),
)
ESTIMATE_LOGS = (
    ("state_estimated", "controller", "robot_state_estimated"),
    ("deviation", "controller", "estimator_deviation"),
    ("slip_estimated", "controller", "foot_slip_estimated"),
    ("healthy", "controller", "estimator_healthy"),
)
MARGIN_LOGS = (("further_margins", "stability_monitor", "further_margins"),)
WHOLE_BODY_LOGS = (
    ("qp_state", "controller", "qp_state"),
    ("carried", "controller", "carried_estimated"),
    ("friction", "controller", "friction_estimated"),
)


def logs_of(kind: str, *, estimated: bool, margins: str) -> tuple[tuple[str, str, str], ...]:
    """What is logged of a run: the log's name, the system, its port.

    Args:
        kind: Of the controller.
        estimated: Whether it estimates its state.
        margins: Which are measured, one of `drake_quad.stability.equilibrium_region.KINDS`.
    """
    return (
        *LOGS,
        *(ESTIMATE_LOGS if estimated else ()),
        *(WHOLE_BODY_LOGS if kind == "whole_body" else ()),
        *(MARGIN_LOGS if margins != HULL else ()),
    )


@dataclass(frozen=True, eq=False)
class PartLog:
    """The samples of one signal, by the names that Drake's VectorLog has."""

    log: VectorLog
    rows: slice

    def num_samples(self) -> int:
        """How many there are."""
        return int(self.log.num_samples())

    def sample_times(self) -> FloatArray:
        """When they were taken (n,) [s]."""
        return self.log.sample_times()

    def data(self) -> FloatArray:
        """The samples as columns (size, n)."""
        return self.log.data()[self.rows]


@dataclass(frozen=True, eq=False)
class PartLogger:
    """What logs one signal; a VectorLogSink of which other signals are other rows."""

    sink: VectorLogSink
    rows: slice

    def FindLog(self, context: Context) -> PartLog:
        """The samples so far, in a root context."""
        return PartLog(self.sink.FindLog(context), self.rows)


def AddLoggers(
    builder: DiagramBuilder, signals: Mapping[str, OutputPort], period: float
) -> dict[str, PartLogger]:
    """Logs vector signals together.

    Args:
        builder: That holds their systems.
        signals: By the names of their logs.
        period: Between samples, the first at time 0 [s].
    """
    sizes = [port.size() for port in signals.values()]
    together = builder.AddNamedSystem("logged", Multiplexer(sizes))
    for k, port in enumerate(signals.values()):
        builder.Connect(port, together.get_input_port(k))
    sink = LogVectorOutput(together.get_output_port(), builder, period)
    sink.set_name("log")
    loggers, begin = {}, 0
    for name, size in zip(signals, sizes, strict=True):
        loggers[name] = PartLogger(sink, slice(begin, begin + size))
        begin += size
    return loggers
