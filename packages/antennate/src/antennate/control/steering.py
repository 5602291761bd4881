"""`follow` and `centre`: PD steering by what the antennae feel, without a plan.

Both command the yaw offset of the gait in every tick, in place of a maneuver that is held. They
never back off: what steering alone can do, and what it cannot.

`follow` is wall following by one antenna. Cowan, Lee and Full (2006, Journal of Experimental
Biology 209, 1617-1629) find that cockroaches which run along a wall turn by a PD law of the
distance that an antenna feels, and that P alone does not explain them. Lee, Sponberg, Loh,
Lamperski, Full and Cowan (2008, IEEE Transactions on Robotics 24, 130-143) give the same law to a
wheeled robot with a flexible antenna, whose bend stands for the distance; so it is here. Their
gains are published up to a scale alone.

`centre` keeps between two walls by steering towards the side that is felt less, as bees do by what
they see (Srinivasan, Lehrer, Kirchner and Zhang 1991, Visual Neuroscience 6, 519-535).

The flex is taken in place of the bending level: that is nearly zero up to a flex of 1 rad, which no
wall gives that is only grazed (docs/science/touch.md). Both antennae touch in a dead end, and then
neither law has a way out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from antennate.control.gait import Gait
from antennate.control.kind import ControllerKind
from antennate.control.rule_controller import RuleController
from antennate.params.control import CentreParams, ControlParams, FollowParams
from antennate.robots.spec import RobotSpec
from antennate.types import LEFT, RIGHT, Bools, Floats, Ints, JointCommand, Maneuver

STRAIGHT = 0.1
"""Share of the largest offset up to which steering is told as FORWARD, not as a turn."""


class SteeredGait(Gait):
    """The gait by a yaw offset that has a sign, positive to the right, in place of a maneuver's."""

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> JointCommand:
        """Advance one control period; the offset goes to `turn_offset` [rad], shape (B,)."""
        return self.steer(maneuver, np.asarray(turn_offset, float))


class SteeringRule:
    """PD control of an error of the readings.

    Args:
        error: error(flex) of shape (B, 2) -> (B,): positive where it has to turn right.
        own: Gains and the time constant.
        most: Largest yaw offset [rad].
        batch: Number of rows B.
        period: Control period [s].

    Attributes:
        turn_offset: Yaw offset that is wanted [rad], positive to the right, shape (B,).
    """

    def __init__(
        self,
        error: Callable[[Floats], Floats],
        own: FollowParams | CentreParams,
        most: float,
        batch: int,
        period: float,
    ) -> None:
        self._error, self._most = error, most
        self._gain, self._rate_gain, self._time = own.gain, own.rate_gain, own.smoothing_time
        self._share = min(1.0, period / own.smoothing_time)
        self._mean: Floats = np.zeros(batch)
        self._begun: Bools = np.zeros(batch, dtype=bool)
        self.turn_offset: Floats = np.zeros(batch)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew, straight, with no memory."""
        self._begun[rows] = False
        self._mean[rows] = self.turn_offset[rows] = 0.0

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick; a row with an UNKNOWN antenna holds and keeps its state."""
        known = ~np.isnan(flex[:, LEFT] + flex[:, RIGHT])
        error = np.where(known, self._error(flex), self._mean)
        self._mean = np.where(known & ~self._begun, error, self._mean)
        self._begun |= known
        rate = (error - self._mean) / self._time  # of the low-pass: its input less its output
        self._mean = self._mean + self._share * (error - self._mean)
        goal = np.clip(self._gain * self._mean + self._rate_gain * rate, -self._most, self._most)
        self.turn_offset = np.where(known, goal, self.turn_offset)
        turn = np.where(goal > 0.0, int(Maneuver.TURN_R), int(Maneuver.TURN_L))
        ahead = np.abs(goal) <= STRAIGHT * self._most
        maneuver = np.where(ahead, int(Maneuver.FORWARD), turn)
        return np.where(known, maneuver, int(Maneuver.HOLD))


def follow(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`follow`: PD wall following by one antenna."""
    own = control.follow
    side, sign = (LEFT, 1.0) if own.side == "left" else (RIGHT, -1.0)
    return _steered(lambda flex: sign * (flex[:, side] - own.bend), own, control, robot, batch)


def centre(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`centre`: steers by the difference of both antennae, away from the one that is bent more."""
    own = control.centre
    return _steered(lambda flex: flex[:, LEFT] - flex[:, RIGHT], own, control, robot, batch)


def _steered(
    error: Callable[[Floats], Floats],
    own: FollowParams | CentreParams,
    control: ControlParams,
    robot: RobotSpec,
    batch: int,
) -> RuleController:
    rule = SteeringRule(error, own, control.escape.turn_offset, batch, control.period)
    gait = SteeredGait(control.gait, robot, batch, control.period)
    return RuleController(rule, control, robot, batch, gait)


KINDS = (
    ControllerKind(
        name="follow",
        about="steers along a wall that one antenna feels, by PD control; it never backs off",
        make=follow,
        reads=("follow", "escape.turn_offset"),
        colour="#0072B2",
        line=(0, (3, 1, 1, 1, 1, 1)),
    ),
    ControllerKind(
        name="centre",
        about="steers away from the antenna that is bent more, by as much; it never backs off",
        make=centre,
        reads=("centre", "escape.turn_offset"),
        colour="#AA4499",
        line=(0, (10, 1.5, 3, 1.5)),
    ),
)
