"""One log for many signals: every logger of its own would be asked for its time at every step."""

from collections.abc import Mapping
from dataclasses import dataclass

from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import LogVectorOutput, Multiplexer, VectorLog, VectorLogSink

from drake_quad.gait.legs import FloatArray


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
