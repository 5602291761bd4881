"""Parameters of the controllers: from counts to maneuvers, and of controllers without touch."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from antennate.params.base import Params, number, require_default
from antennate.params.climb import ClimbParams
from antennate.params.gaits import GaitParams

_Angle = Annotated[float, Field(gt=0, le=math.pi)]
_Time = Annotated[float, Field(ge=0, le=30)]


class TimedParams(Params):
    """When `timed` escapes; how it escapes is `escape`."""

    walk_time: float = number(5.0, "s", "assumed: three gait cycles; not tuned", gt=0, le=300)
    """Time to walk between two escapes."""


class ScheduleParams(Params):
    """Turns of `schedule`, to one side and to the other, farther and farther."""

    walk_time: float = number(
        12.0, "s", "fitted: best of 5, 8, 12 and 18 s (docs/science/corridors.md)", gt=0, le=300
    )
    """Time to walk between two escapes."""
    headings: tuple[_Angle, ...] = number(
        (0.785, 0.785, 1.571, 1.571),
        "rad",
        "fitted: better than 60, 60, 100, 100, 130 deg (docs/science/corridors.md)",
        min_length=1,
        max_length=20,
    )
    """Headings that it turns to, from the first heading, right and left by turns."""
    reverse_times: tuple[_Time, ...] = number(
        (2.2, 3.5, 5.0),
        "s",
        "assumed: as escape.reverse_time, then room for a longer turn",
        min_length=1,
        max_length=20,
    )
    """Times to back off before each turn; the last one for all further turns."""
    turn_rate: float = number(
        math.pi / 7.5, "rad/s", "assumed: 180 deg in escape.return_time", gt=0, le=3
    )
    """Turning in free space at escape.turn_offset, by which the time of a turn is reckoned."""


class ZigzagParams(Params):
    """Turns of `zigzag`, all of one size."""

    walk_time: float = number(5.0, "s", "assumed: as timed.walk_time", gt=0, le=300)
    """Time to walk between two turns."""
    reverse_time: float = number(
        0.8, "s", "assumed: half a gait cycle, so that the head comes free", ge=0, le=30
    )
    """Time to back off before a turn."""
    turn_time: float = number(
        4.4, "s", "assumed: twice escape.turn_time, from one side to the other", gt=0, le=60
    )
    """Time of each turn; the first is half as long."""


class RandomParams(Params):
    """Chance of `random`; the same seed and gait phase at the start give the same choices."""

    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of its choices, beside the gait phase at the start."""
    walk_time: float = number(5.0, "s", "assumed: as timed.walk_time", gt=0, le=300)
    """Mean time to walk between two escapes; it is distributed exponentially."""
    reverse_time: float = number(2.2, "s", "assumed: as escape.reverse_time", ge=0, le=30)
    """Mean time to back off; it is uniform from 0 to twice that."""
    turn_time: float = number(
        4.4, "s", "assumed: its mean is that of escape.turn_time", gt=0, le=60
    )
    """Longest turn; a turn is uniform from 0 to that, to either side alike."""


class CurveParams(Params):
    """From the mean counts of an antenna to its bending level b."""

    midpoint: float = number(0.305, "1", "paper: midpoint of the sigmoid", gt=-1, lt=2)
    """Reading at which b is one half."""
    slope: float = number(18.3, "1", "paper: slope of the sigmoid", gt=0, le=1000)
    """Slope of the sigmoid."""
    polarity: Literal[-1, 1] = number(
        -1, "1", "paper: called a decreasing sigmoid; counts fall when the flex sensor bends"
    )
    """+1 if the reading rises with bending."""
    counts_low: float = number(
        1399.0,
        "counts",
        "fitted: antennate.antenna.sensor at a flex of 90 deg, without noise",
        ge=0,
        le=4095,
    )
    """Reading that normalises to 0."""
    counts_high: float = number(
        1872.0,
        "counts",
        "fitted: antennate.antenna.sensor, straight antenna, without noise",
        ge=0,
        le=4095,
    )
    """Reading that normalises to 1."""

    knots: tuple[float, ...] = number((), "counts", "paper: a sigmoid, no knots", max_length=4096)
    """Rising readings of a curve of straight lines in place of the sigmoid, such as a line."""
    knot_levels: tuple[Annotated[float, Field(ge=0, le=1)], ...] = number(
        (), "1", "assumed: as knots", max_length=4096
    )
    """Bending level at each of the knots; beyond the outer ones it stays."""

    @model_validator(mode="after")
    def _knots(self) -> CurveParams:
        rises = all(b > a for a, b in pairwise(self.knots))
        one_way = all((b - a) * self.polarity >= 0 for a, b in pairwise(self.knot_levels))
        pairs = len(self.knots) == len(self.knot_levels) != 1
        if not (rises and one_way and pairs):
            raise ValueError(
                "knots: expected two rising readings or more, and as many knot_levels that go one "
                f"way, by polarity {self.polarity}, found {len(self.knots)} and "
                f"{len(self.knot_levels)}{', in order' if rises and one_way else ', out of order'}"
            )
        if self.knots:
            require_default(self, "with knots it is not read", "midpoint", "slope")
        return self

    @model_validator(mode="after")
    def _span(self) -> CurveParams:
        if self.counts_high - self.counts_low < 1:
            raise ValueError(
                f"counts_high must exceed counts_low by at least 1 count, found {self.counts_low} "
                f"and {self.counts_high}"
            )
        return self


class ConditioningParams(CurveParams):
    """From counts to the bending level b."""

    averaging_time: float = number(0.1, "s", "assumed: ten samples", gt=0, le=5)
    """T_avg, length of the running mean."""


class RuleParams(Params):
    """The paper's rule: when an antenna touches, and what to do then."""

    threshold: float = number(0.5, "1", "assumed: middle of the sigmoid", gt=0, lt=1)
    """Theta: bending level that is contact."""
    hysteresis: float = number(0.1, "1", "assumed: above twice the noise in b", ge=0, lt=1)
    """Contact ends this far below the threshold."""
    strong: float = number(0.7, "1", "assumed: unpublished", gt=0, le=1)
    """Both sides at this level or above count as strong."""
    similar: float = number(0.15, "1", "assumed: unpublished", ge=0, le=1)
    """Levels that differ by less are similar."""
    hold_time: float = number(2.0, "s", "assumed: over a gait cycle; all turns alike", gt=0, le=30)
    """T_hold, how long a maneuver is kept."""
    hold_forward: bool = number(False, "1", "assumed: a touch is answered at once")
    """Whether FORWARD is kept for T_hold, too, whatever touches meanwhile."""


class RepetitionParams(Params):
    """When readings that repeat themselves mean that a robot is stuck; fitted without feedback."""

    window_cycles: float = number(
        0.5,
        "1",
        "fitted: without feedback, 96 tunnels: sooner than a whole cycle, with as few errors",
        gt=0,
        le=10,
    )
    """Window of both means below, in gait cycles."""
    change: float = number(
        0.06, "1", "fitted: without feedback, 96 tunnels: 59 jams found, 8 false alarms", gt=0, le=1
    )
    """Mean change of flex from cycle to cycle under which it repeats."""
    pressure: float = number(
        0.2,
        "1",
        "fitted: without feedback, 12 tunnels: free antennae stay below, stuck ones above",
        ge=0,
        le=1,
    )
    """Mean flex above which an antenna is pressed."""


class EscapeParams(Params):
    """Backing off and turning when stuck, as `closed-1` does.

    Fitted: times without feedback on 96 tunnels, turns with `closed-1` on 60 and then 200 tuning
    tunnels.
    """

    trigger: Literal["repetition", "contact"] = number(
        "repetition",
        "1",
        "fitted: without feedback; repetition tells stuck from moving, contact does not",
    )
    """What counts as stuck: repeated readings, or the paper's both strong and similar."""
    reverse_time: float = number(
        2.2,
        "s",
        "fitted: `closed-1` on 60 tuning tunnels (docs/science/study.py); 2/3 of the body",
        gt=0,
        le=30,
    )
    """Time to back off."""
    turn_time: float = number(
        2.2, "s", "fitted: `closed-1` on 60 tuning tunnels; about 50 deg", gt=0, le=30
    )
    """Time of the first turn."""
    turn_offset: float = number(0.52, "rad", "assumed: a turn nearly on the spot", gt=0, le=1.0)
    """Yaw offset of turns."""
    first_turn: Literal["memory", "right"] = number("memory", "1", "assumed: it is blocked there")
    """Side of the first turn: away from what was touched more, or always right."""
    alternate: bool = number(True, "1", "assumed: searching both sides")
    """Whether a second turn goes the other way, second_turn times as far."""
    second_turn: float = number(
        1.5,
        "1",
        "fitted: `closed-1` on 200 tuning tunnels (seeds 31, 32): 192 successes, 188 with 2.0",
        gt=0,
        le=5,
    )
    """Length of a turn the other way, in first turns."""
    retry_time: float = number(12.0, "s", "assumed: seven gait cycles", gt=0, le=300)
    """Stuck again within this time, it turns the other way."""
    memory_time: float = number(4.0, "s", "assumed: over two gait cycles", gt=0, le=300)
    """Time constant of the memory of touch."""
    memory_delay: float = number(
        3.0,
        "s",
        "fitted: without feedback, 96 tunnels, 57 jams: first turn right in 61 %, 56 % with 0",
        ge=0,
        le=60,
    )
    """How long before the jam was noticed the memory is read."""
    lost_time: float = number(
        2.0,
        "s",
        "fitted: without feedback, 96 tunnels: ten times in 30 s nothing is felt for longer",
        gt=0,
        le=3600,
    )
    """Nothing felt for so long after a turn means that the walls are lost."""
    return_time: float = number(7.5, "s", "assumed: about 180 deg at the offset above", gt=0, le=60)
    """Time to turn round."""


class SearchParams(Params):
    """How `closed` looks for the way on when stuck: with patience, and with turns that grow.

    Set by reasoning, and tried on tuning draws alone (seed 410001, docs/science/tunnel.md).
    """

    patience: float = number(
        3.0,
        "s",
        "fitted: 3, 5 and 8 s were tried on few draws (docs/science/corridors.md)",
        ge=0,
        le=60,
    )
    """Shortest walk between two escapes."""
    reverse_time: float = number(2.2, "s", "assumed: as escape.reverse_time", gt=0, le=30)
    """Time to back off at first."""
    reverse_most: float = number(5.0, "s", "assumed: more than the body", gt=0, le=30)
    """Longest time to back off."""
    turn_time: float = number(2.6, "s", "assumed: about 60 deg in free space", gt=0, le=30)
    """Time of the first turn."""
    growth: float = number(
        1.2, "1", "assumed: the fifth turn is twice the first from the first heading", ge=1, le=3
    )
    """Factor of each further turn from the first heading, and of backing off."""
    free_time: float = number(
        1.0, "s", "assumed: over half a gait cycle, in which a wall is touched", gt=0, le=60
    )
    """Nothing felt for so long proves that the robot gets on."""
    proof_time: float = number(8.0, "s", "assumed: five gait cycles", gt=0, le=300)
    """A walk of so long proves that the robot gets on."""
    lost_turn: float = number(
        3.5, "s", "assumed: about 80 deg; after less it cannot face where it came from", gt=0, le=60
    )
    """Turn from the first heading after which the robot can have turned round."""
    lost_time: float = number(
        3.0, "s", "fitted: with 2 s it turned round in wide corridors, once", gt=0, le=3600
    )
    """Nothing felt for so long after such a turn means that the walls are lost."""
    return_time: float = number(7.5, "s", "assumed: about 180 deg in free space", gt=0, le=60)
    """Time to turn round; no heading is farther than that from the first one."""


class GeometricParams(Params):
    """What `geometric` does otherwise than `closed`: its way forward, and escapes by their size."""

    forward: Literal["swift", "thrifty", "gait"] = number(
        "swift", "1", "fitted: antennate geometry; the fastest at no more cost of transport"
    )
    """Gait of FORWARD and REVERSE: a named one, or `gait` as the turns."""
    reverse_distance: float = number(
        0.5, "m", "assumed: as search.reverse_time by the default gait", gt=0, le=5
    )
    """How far to back off at first."""
    reverse_most: float = number(1.2, "m", "assumed: as search.reverse_most", gt=0, le=5)
    """Farthest to back off."""
    turn_angle: float = number(
        math.radians(60.0), "rad", "assumed: as search.turn_time", gt=0, le=math.pi
    )
    """Angle of the first turn."""
    lost_angle: float = number(
        math.radians(80.0), "rad", "assumed: as search.lost_turn", gt=0, le=math.pi
    )
    """Turn from the first heading after which the robot can have turned round."""
    return_angle: float = number(
        math.radians(175.0), "rad", "assumed: as search.return_time", gt=0, le=2 * math.pi
    )
    """Angle to turn round."""
    soften: float = number(0.0, "1", "assumed: off (docs/science/geometry.md)", ge=0, le=1)
    """Share of the amplitude that is given up where an antenna is fully bent."""


class FollowParams(Params):
    """How `follow` keeps one antenna at a wall: PD control of its flex."""

    side: Literal["left", "right"] = number(
        "right", "1", "assumed: scenes are mirrored by chance, so neither side is better"
    )
    """Antenna that follows a wall."""
    bend: float = number(0.15, "1", "assumed: half of what a grazed wall gives", ge=0, le=1)
    """Flex that it keeps, as a share of the calibrated range."""
    gain: float = number(
        2.0,
        "rad",
        "fitted: least time of 7 pairs on 18 public draws, within chance (docs/controllers.md)",
        ge=0,
        le=20,
    )
    """Yaw offset for a flex that is off by the whole range (P)."""
    rate_gain: float = number(1.0, "rad*s", "fitted: as gain, with it", ge=0, le=20)
    """Yaw offset for a flex that changes by the whole range in a second (D)."""
    smoothing_time: float = number(
        0.8, "s", "assumed: half a gait cycle, as the head swings with the gait", gt=0, le=10
    )
    """Time constant of the low-pass that both terms are taken behind."""


class CentreParams(Params):
    """How `centre` keeps between two walls: PD control of the difference of both flexes."""

    gain: float = number(
        1.0,
        "rad",
        "fitted: less time than 2 on 18 public draws, within chance (docs/controllers.md)",
        ge=0,
        le=20,
    )
    """Yaw offset for flexes that differ by the whole range (P)."""
    rate_gain: float = number(0.0, "rad*s", "assumed: off; not tried", ge=0, le=20)
    """Yaw offset for a difference that changes by the whole range in a second (D)."""
    smoothing_time: float = number(0.8, "s", "assumed: as follow.smoothing_time", gt=0, le=10)
    """Time constant of the low-pass that both terms are taken behind."""


class ControlParams(Params):
    """Conditioning, contact rule, maneuvers and gait of the controllers."""

    rate: float = number(100.0, "Hz", "paper: about 100 Hz over serial", gt=0, le=1000)
    """Control ticks per second."""
    gait: GaitParams = GaitParams()
    conditioning: ConditioningParams = ConditioningParams()
    conditioning_right: CurveParams | None = number(None, "1", "assumed: both antennae are alike")
    """Curve of the right antenna, where it has its own."""
    rule: RuleParams = RuleParams()
    repetition: RepetitionParams = RepetitionParams()
    escape: EscapeParams = EscapeParams()
    search: SearchParams = SearchParams()
    geometric: GeometricParams = GeometricParams()
    follow: FollowParams = FollowParams()
    centre: CentreParams = CentreParams()
    timed: TimedParams = TimedParams()
    schedule: ScheduleParams = ScheduleParams()
    zigzag: ZigzagParams = ZigzagParams()
    random: RandomParams = RandomParams()
    climb: ClimbParams = ClimbParams()

    @property
    def period(self) -> float:
        """Control period [s]."""
        return 1.0 / self.rate
