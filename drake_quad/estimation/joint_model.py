"""The errors of the joints' encoders, drawn once for a run."""

from dataclasses import dataclass

import numpy as np

from drake_quad.gait.legs import FloatArray

ROWS = 2**15  # 65 s at 500 Hz before the same noise comes again


@dataclass(frozen=True, kw_only=True)
class JointNoise:
    """Figures of a joint's drive; all zero is the ideal one.

    Attributes:
        name: The drive.
        counts: Of the encoder in a revolution of the joint; 0 for no quantisation.
        angle: White noise of the angle [rad].
        speed: White noise of the speed [rad/s].
        zero: Deviation of where each joint's zero is taken to be [rad].
    """

    name: str = "ideal"
    counts: int = 0
    angle: float = 0.0
    speed: float = 0.0
    zero: float = 0.0


IDEAL_JOINTS = JointNoise()

# Open Dynamic Robot Initiative, "Brushless Actuator Module Core": Broadcom AEDT-9810, 5000 pulses a
# channel, 20000 counts a motor revolution, belts 9:1: 180000 counts a revolution of the joint (17.5
# bits). Noise of the angle is about a count's, that of the speed what remains of differenced counts
# after the drive's filter, and the zero that of a careful calibration: assumptions.
ODRI_DRIVE = JointNoise(
    name="ODRI actuator module",
    counts=180_000,
    angle=3.5e-5,
    speed=0.015,
    zero=5.0e-4,
)


@dataclass(frozen=True, eq=False)
class JointErrors:
    """The errors of twelve drives in one run.

    Attributes:
        white: (ROWS, 24) of angles, then speeds, used in a circle.
        zero: (12,) [rad].
        count: What the encoder resolves [rad]; 0 for all.
    """

    white: FloatArray
    zero: FloatArray
    count: float

    def apply(self, ideal: FloatArray, tick: int) -> FloatArray:
        """What the drives show (24,) at a tick where they ought to show `ideal` (24,)."""
        shown = ideal + self.white[tick % ROWS]
        shown[:12] += self.zero
        if self.count > 0.0:
            shown[:12] = np.floor(shown[:12] / self.count + 0.5) * self.count
        return shown


def draw_joint_errors(noise: JointNoise, generator: np.random.Generator) -> JointErrors:
    """Draws all that is random of twelve drives."""
    white = generator.standard_normal((ROWS, 24)) * np.repeat([noise.angle, noise.speed], 12)
    zero = generator.standard_normal(12) * noise.zero
    for table in (white, zero):
        table.setflags(write=False)
    return JointErrors(white, zero, 2.0 * np.pi / noise.counts if noise.counts else 0.0)
