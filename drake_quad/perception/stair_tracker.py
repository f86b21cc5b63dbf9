"""Stairs kept in view: a search where none are known, then a fit from the last belief per image."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from drake_quad.common import FloatArray, read_only
from drake_quad.perception.calibration import deviation_factors, kind_of_stairs
from drake_quad.perception.camera_model import CameraModel
from drake_quad.perception.depth_frame import DepthAccuracy, DepthFrame, keep_pixels, prepare_frame
from drake_quad.perception.stair_belief import StairBelief
from drake_quad.perception.stair_evidence import (
    count_evidence,
    crop,
    denied,
    support,
    supported,
    told_apart,
    wall_from,
)
from drake_quad.perception.stair_fit import (
    StairFit,
    StairPriors,
    StairShape,
    first_guess,
    fit_stairs,
    with_steps,
)
from drake_quad.perception.stair_profile import MOST_STEPS, OVERHANG, RUN, YAW
from drake_quad.perception.stair_search import FoundStairs, find_stairs
from drake_quad.perception.touchdown import FootContact, refine_by_touchdown, tread_under

LEAST_PLACE = 0.12  # [m] nearer than this a nosing is below the camera and out of its view
TRACKING = (8.0, 6.0)
RENEWED = (60.0, 40.0, 25.0, 15.0, 8.0, 6.0)  # of a flight that has not been in view for long
HELD = 3  # of these
TRACKED = 2  # of so many pixels a tracking frame takes one: what they share is what errs
SEED = 20260  # chooses the points that a search looks at: the same image gives the same stairs
FOOT_SIGMA = 0.005  # [m] deviation of a foot's height over the camera, from the legs' kinematics
FOOT_PLACE_SIGMA = 0.01  # [m] the same of its place along the climb
CONTRADICTED = 4.0  # deviations between a foot's height and what was believed
LIKE_BEFORE = 0.005  # [m] deviation of rise, run and overhang of a flight's further steps
LAST_STEPS = 2  # that a search has to see of a flight that is known to be there
KNOWN_STEP = 0.002  # [m] deviation of a known flight's rise, run and overhang
KNOWN = read_only(np.zeros(3))  # deviations of what is known without error


@dataclass(frozen=True)
class CameraPose:
    """Where the camera is believed to be when the image is taken.

    Attributes:
        R_WC: Attitude of the camera frame in W, (3, 3).
        p_WC: Place of the camera in W, (3,) [m].
        turn_sigmas: Deviations of the attitude about W's axes, as whoever estimates the robot's
            state has them, (3,) [rad]. The mounting's error is the camera's, see DepthAccuracy.
        place_sigmas: Deviations of the place along W's axes, (3,) [m].
    """

    R_WC: FloatArray
    p_WC: FloatArray
    turn_sigmas: FloatArray = field(default_factory=lambda: KNOWN)
    place_sigmas: FloatArray = field(default_factory=lambda: KNOWN)

    @property
    def tilt_sigma(self) -> float:
        """Deviation of the attitude about level axes [rad]: of the worse one."""
        return float(np.max(self.turn_sigmas[:2]))

    @property
    def heading(self) -> float:
        """Yaw of the optical axis in W [rad], or of the image's upward side."""
        axis, up = self.R_WC[:, 2], -self.R_WC[:, 1]
        flat = axis + up if np.hypot(axis[0], axis[1]) > 0.1 else up
        return float(np.arctan2(flat[1], flat[0]))

    @property
    def R_LC(self) -> FloatArray:
        """Attitude in the level frame of this pose, (3, 3)."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.asarray(np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) @ self.R_WC)


def make_belief(
    found: FoundStairs,
    pose: CameraPose,
    *,
    stamp: float,
    tilt: float,
    passed: int = 0,
    factors: dict[str, float] | None = None,
) -> StairBelief:
    """The belief in W of stairs that were fitted in L.

    What the pose's heading and place may be off by, no image of stairs can tell: it is added. Its
    tilt is not, for the fit has allowed for it.

    Args:
        found: The stairs.
        pose: Pose of the camera.
        stamp: Time of the image [s].
        tilt: Deviation of the camera's heading on the robot [rad].
        passed: How many steps lie before those that were fitted.
        factors: What deviations are multiplied by, by quantity; unless told, those that
            `calibration` has for such stairs.
    """
    fit, n = found.fit, found.fit.shape.steps
    base = 2 * n + 1
    # Rise and run are the means of the steps that are told, not those of an endless flight that
    # these steps are drawn from: of uneven stairs the two differ.
    M = np.zeros((base + 4, len(fit.theta)))
    M[:base, :base] = np.eye(base)
    M[base, base + YAW], M[base + 1, base + OVERHANG] = 1.0, 1.0
    M[base + 2, 2 * n], M[base + 2, n] = 1.0 / n, -1.0 / n
    if n > 1:
        M[base + 3, n - 1], M[base + 3, 0] = 1.0 / (n - 1), -1.0 / (n - 1)
    else:
        M[base + 3, base + RUN] = 1.0
    rise, run = (float(x) for x in (M @ fit.theta)[base + 2 :])
    covariance = (M @ fit.covariance @ M.T) * max(1.0, fit.spread) ** 2
    covariance[base, base] += tilt**2 + float(pose.turn_sigmas[2]) ** 2
    scale = factors_of(fit) if factors is None else factors
    by = np.array(
        [scale["place"]] * n
        + [scale["height"]] * (n + 1)
        + [scale[name] for name in ("yaw", "overhang", "rise", "run")]
    )
    at_most = None if found.at_most is None else passed + found.at_most
    yaw = float(np.remainder(fit.other(YAW) + pose.heading + np.pi, 2.0 * np.pi) - np.pi)
    covariance *= np.outer(by, by)
    x, y, _ = pose.place_sigmas
    covariance[:n, :n] += (np.cos(yaw) * x) ** 2 + (np.sin(yaw) * y) ** 2
    return StairBelief(
        stamp=stamp,
        origin=pose.p_WC[:2],
        passed=passed,
        places=fit.places,
        heights=fit.heights + pose.p_WC[2],
        yaw=yaw,
        overhang=fit.other(OVERHANG),
        rise=rise,
        run=run,
        covariance=covariance,
        count_least=passed + n,
        count_most=at_most,
        is_open=fit.shape.is_open,
        right=found.right,
        left=found.left,
    )


def factors_of(fit: StairFit) -> dict[str, float]:
    """What the deviations of a fit in L are multiplied by."""
    kind = kind_of_stairs(
        fit.places, fit.heights, overhang=fit.other(OVERHANG), is_open=fit.shape.is_open
    )
    return deviation_factors(kind, camera_height=-float(fit.heights[0]))


def in_world(belief: StairBelief, pose: CameraPose) -> StairBelief:
    """The belief with the error of the camera's own height in W, which all of its heights share.

    Feet have the same error: so they refine heights before it is added, and say nothing of it.
    """
    heights = slice(len(belief.places), 2 * len(belief.places) + 1)
    covariance = np.array(belief.covariance)
    covariance[heights, heights] += pose.place_sigmas[2] ** 2
    return replace(belief, covariance=covariance)


def felt(belief: StairBelief, feet: FloatArray | None) -> StairBelief:
    """The belief refined by feet that stand on its treads.

    Feet before the first nosing told are left out: the fit has had the floor's height from them. A
    foot that is far off what is believed is left out too; it may stand on something else.

    Args:
        belief: The stairs.
        feet: Points in W where feet stand, (k, 3) [m]; None for none.
    """
    for foot in [] if feet is None else feet:
        touchdown = FootContact(
            along=float((foot[:2] - belief.origin) @ belief.direction),
            height=float(foot[2]),
            place_sigma=FOOT_PLACE_SIGMA,
            height_sigma=FOOT_SIGMA,
        )
        if not tread_under(belief, touchdown):
            continue
        refined = refine_by_touchdown(belief, touchdown)
        if refined is not None and abs(refined[1]) < CONTRADICTED:
            belief = refined[0]
    return belief


class StairTracker:
    """Estimates stairs from one depth image after the other.

    Errors of one image's estimate are mostly the camera's own, which stay, so images are not
    averaged: each belief is of one image, begun from the one before.

    Args:
        model: Intrinsics of the images.
        accuracy: How well depths are known.
        priors: What is known of stairs; the floor's height is taken from the feet.
        rows: About how many rows are fitted.
    """

    def __init__(
        self,
        *,
        model: CameraModel,
        accuracy: DepthAccuracy,
        priors: StairPriors | None = None,
        rows: int = 120,
    ) -> None:
        self._model, self._accuracy, self._rows = model, accuracy, rows
        self._priors = StairPriors() if priors is None else priors

    def update(
        self,
        depth: NDArray[np.floating],
        pose: CameraPose,
        *,
        stamp: float = 0.0,
        last: StairBelief | None = None,
        feet: FloatArray | None = None,
        of: StairBelief | None = None,
    ) -> StairBelief | None:
        """The stairs that an image shows.

        Args:
            depth: Distances along the optical axis [m], (height, width); 0, inf or nan where none.
            pose: Pose of the camera when the image was taken, and how well it is known.
            stamp: That time [s].
            last: The belief before; without one the stairs are searched for.
            feet: Points in W where feet stand, (k, 3) [m]; those farthest ahead tell the floor, and
                those on treads that are told refine their heights.
            of: A flight that the robot is known to be on. Its heading, rise, run, kind of risers,
                and an overhang if it has one, are believed, and its last two steps may be all that
                is left to see. Without one a search has to see LEAST_STEPS steps up.

        Returns:
            The belief; None where nothing speaks for stairs.
        """
        # The fit is free to tilt the camera by what its mounting and the robot's attitude allow.
        tilt = float(np.hypot(self._accuracy.tilt, pose.tilt_sigma))
        accuracy = replace(self._accuracy, tilt=tilt)
        frame = prepare_frame(depth, self._model, pose.R_LC, accuracy, rows=self._rows)
        priors = replace(self._priors, floor=self._floor(pose, feet))
        if of is not None:
            turn = (self._accuracy.tilt, float(pose.turn_sigmas[2]), of.sigma("yaw"))
            priors = replace(
                priors,
                rise=(abs(of.rise), LIKE_BEFORE),
                run=(of.run, LIKE_BEFORE),
                overhang=(of.overhang, LIKE_BEFORE) if of.overhang > 0.0 else priors.overhang,
                yaw=(of.yaw - pose.heading, float(np.linalg.norm(turn))),
            )
        if last is not None:
            # A guess that is centimetres off would bend the camera's errors: they stay at first.
            cutoffs, held = (TRACKING, 0) if of is None else (RENEWED, HELD)
            tracked = self._track(frame, priors, pose, last, feet, cutoffs=cutoffs, held=held)
            if tracked is not None:
                found, passed = tracked
                belief = make_belief(
                    found, pose, stamp=stamp, tilt=self._accuracy.tilt, passed=passed
                )
                return in_world(felt(belief, feet), pose)
        generator = np.random.default_rng(SEED)
        if of is None:
            searched = find_stairs(frame, priors, generator)
        else:
            searched = find_stairs(
                frame, priors, generator, ways=(of.going_up,), opens=(of.is_open,), least=LAST_STEPS
            )
        if searched is None:
            return None
        belief = make_belief(searched, pose, stamp=stamp, tilt=self._accuracy.tilt)
        return in_world(felt(belief, feet), pose)

    def follow(
        self, depth: NDArray[np.floating], pose: CameraPose, known: StairBelief, *, stamp: float
    ) -> StairBelief | None:
        """The stairs of a known flight, as an image shows them.

        Rises, runs and overhang are as they are known, but for an unevenness of single steps.

        Args:
            depth: The image.
            pose: Pose of the camera when it was taken.
            known: The flight, told from there.
            stamp: The time of the image [s].

        Returns:
            The belief, without the error of the camera's heading on the robot; None if the image
            does not show them.
        """
        tilt = float(np.hypot(self._accuracy.tilt, pose.tilt_sigma))
        frame = prepare_frame(
            depth, self._model, pose.R_LC, replace(self._accuracy, tilt=tilt), rows=self._rows
        )
        priors = replace(
            self._priors,
            rise=(abs(known.rise), KNOWN_STEP),
            run=(known.run, KNOWN_STEP),
            overhang=(known.overhang, KNOWN_STEP),
        )
        found = self._track(frame, priors, pose, known, None)
        if found is None:
            return None
        return make_belief(found[0], pose, stamp=stamp, tilt=0.0, passed=found[1])

    def _floor(self, pose: CameraPose, feet: FloatArray | None) -> tuple[float, float]:
        if feet is None or len(feet) == 0:
            return self._priors.floor
        ahead = feet[:, 0] * np.cos(pose.heading) + feet[:, 1] * np.sin(pose.heading)
        front = feet[ahead > ahead.max() - 0.1, 2]
        return float(front.mean() - pose.p_WC[2]), FOOT_SIGMA

    def _track(
        self,
        frame: DepthFrame,
        priors: StairPriors,
        pose: CameraPose,
        last: StairBelief,
        feet: FloatArray | None,
        *,
        cutoffs: tuple[float, ...] = TRACKING,
        held: int = 0,
    ) -> tuple[FoundStairs, int] | None:
        moved = float((pose.p_WC[:2] - last.origin) @ last.direction)
        aside = np.array([-last.direction[1], last.direction[0]])
        aside_moved = float((pose.p_WC[:2] - last.origin) @ aside)
        right, left = last.right - aside_moved, last.left - aside_moved
        places, heights = last.places - moved, last.heights - pose.p_WC[2]
        gone = int(np.count_nonzero(places < LEAST_PLACE))
        places, heights, passed = places[gone:], heights[gone:], last.passed + gone
        n = len(places)
        if n < 1:
            return None
        shape = StairShape(n, last.going_up, last.is_open)
        theta = first_guess(
            shape, first=float(places[0]), floor=float(heights[0]), rise=last.rise, run=last.run,
            yaw=last.yaw - pose.heading, priors=priors, nodes=frame.grid[0] * frame.grid[1],
        )  # fmt: skip
        theta[:n], theta[n : 2 * n + 1] = places, heights
        theta[2 * n + 1 + OVERHANG] = last.overhang
        if feet is None or len(feet) == 0 or abs(priors.floor[0] - heights[0]) > 0.06:
            # No foot is known to stand before the first step in view: the last belief tells.
            sigma = float(last.height_sigmas[gone]) + 0.003
            priors = replace(priors, floor=(float(heights[0]), sigma))
        guess = StairFit(shape, theta, np.eye(len(theta)), 0.0, 1.0)
        inner = crop(frame, guess, (right - 0.03, left + 0.03))
        inner = keep_pixels(inner, np.arange(len(inner.rho)) % TRACKED == 0)
        fit = fit_stairs(inner, shape, theta, priors, cutoffs, held=held)
        if fit is None:
            return None
        table, _ = count_evidence(inner, fit, priors)
        seen = [i for i in range(1, n + 1) if table[:, i, 0].sum() >= 25.0]
        if not seen or not all(supported(table, i, fit) for i in seen[:2]):
            return None
        most = None if last.count_most is None else last.count_most - passed
        if most is None and n < MOST_STEPS:
            fit, most = self._one_more(inner, fit, priors)
        return FoundStairs(fit, most, right, left), passed

    def _one_more(
        self, frame: DepthFrame, fit: StairFit, priors: StairPriors
    ) -> tuple[StairFit, int | None]:
        """The fit with a step more if pixels speak for it, and how many steps there are at most."""
        thin = keep_pixels(frame, np.arange(len(frame.rho)) % 2 == 0)
        more = fit_stairs(thin, *with_steps(fit, fit.shape.steps + 1), priors, (15.0, 8.0))
        if more is None:
            return fit, None
        table, _ = count_evidence(frame, more, priors)
        n = more.shape.steps
        # A step too many bends the others to make room for it, and more pixels are lost than won.
        gained = support(frame, more, priors) > support(frame, fit, priors)
        if (
            gained
            and supported(table, n, more)
            and told_apart(frame, more, priors)
            and wall_from(frame, more, priors) is None
        ):
            return more, None
        return fit, fit.shape.steps if denied(frame, fit, more, priors) else None
