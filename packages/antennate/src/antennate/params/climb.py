"""Parameters of `climb`: what its antennae feel of the ground, and how it climbs."""

from __future__ import annotations

import math

from pydantic import model_validator

from antennate.params.base import Params, number


class FeelParams(Params):
    """How lowered antennae feel the ground. Flex is a share of the calibrated range, 0 straight."""

    elevation: float = number(
        math.radians(-20.0),
        "rad",
        "fitted: trials of seed 0; the floor then bends them by 0.21 to 0.38",
        ge=-1.5,
        le=1.5,
    )
    """Elevation of antennae that feel for the ground."""
    missing: float = number(
        0.14, "1", "fitted: trials of seed 0; over a drop 0.06, on the floor 0.21", ge=0, le=1
    )
    """Flex under which there is no ground."""
    touch: float = number(
        0.5, "1", "fitted: trials of seed 0; the floor gives 0.38 at most", ge=0, le=2
    )
    """Flex above which something stands ahead."""
    touch_time: float = number(
        0.02, "s", "assumed: the mean over averaging_time is smooth", ge=0, le=5
    )
    """How long something is to be felt."""
    missing_time: float = number(
        0.15,
        "s",
        "fitted: trials of seed 0; the bases are past the edge then, to probe it",
        ge=0,
        le=5,
    )
    """How long both antennae are to miss the ground."""
    aslant_time: float = number(
        0.35,
        "s",
        "fitted: trials of seed 0; the base is past an edge that is met aslant",
        ge=0,
        le=5,
    )
    """How long one antenna is to miss it."""
    settle_time: float = number(0.5, "s", "assumed: the antennae come down in it", ge=0, le=5)
    """Time after which lowered antennae tell something."""
    sweep_rate: float = number(1.0, "rad/s", "assumed: within the servo's speed", gt=0, le=5)
    """Speed of a probe: both antennae are raised, or lowered."""
    highest: float = number(math.radians(77.0), "rad", "assumed: nearly upright", ge=0, le=1.57)
    """Elevation at which a probe upwards ends."""
    lowest: float = number(math.radians(-75.0), "rad", "assumed: nearly down", ge=-1.57, le=0)
    """Elevation at which a probe downwards ends."""
    creep_time: float = number(
        0.4,
        "s",
        "fitted: trials of seed 0; a head before the edge cannot bow, at 0.55 s robots tip over",
        ge=0,
        le=2,
    )
    """How long it walks on before a probe downwards."""
    bow: float = number(
        -0.5, "rad", "assumed: one link down; it reaches 14 cm below the ground", ge=-1, le=0
    )
    """Pitch of the head in a probe downwards."""
    clear: float = number(
        0.3,
        "1",
        "fitted: trials of seed 0; an antenna that slips over an edge falls below",
        ge=0,
        le=2,
    )
    """Flex under which a probe upwards has passed the edge."""
    level_height: float = number(
        0.024,
        "m",
        "fitted: probes of steps, seed 5 (docs/science/climb.md)",
        ge=-0.5,
        le=0.5,
    )
    """Height of an edge that the later antenna slips over when it is level."""
    height_slope: float = number(
        0.061,
        "m/rad",
        "fitted: probes of steps, seed 5 (docs/science/climb.md)",
        ge=0,
        le=1,
    )
    """How much higher an edge is for each radian that it is raised further."""
    inwards: float = number(
        math.radians(-30.0),
        "rad",
        "assumed: straight ahead, where it reaches highest",
        ge=-0.8,
        le=0.8,
    )
    """Sweep of the bases in a probe."""
    check: float = number(
        0.15,
        "rad",
        "fitted: trials of seed 3; above a step of 15 cm in 31 of 32, below walls of 35 in 30",
        ge=-1,
        le=1.57,
    )
    """Elevation of the antennae before a raised head, from the plane of the tail."""
    check_sweep: float = number(
        math.radians(-15.0),
        "rad",
        "fitted: walls of seed 3, of 64 it knows 63; at -30 deg 26 of 32",
        ge=-0.8,
        le=0.8,
    )
    """Sweep of the bases there; an antenna that is pushed along its axis bends the other way."""
    check_time: float = number(
        0.1, "s", "fitted: trials of seed 3; one that grazes an edge lets go sooner", ge=0, le=5
    )
    """How long they are to feel something until it is a wall."""
    tread: float = number(
        -0.5, "rad", "fitted: trials of seed 3; it reaches 6 cm below the base", ge=-1.5, le=1.5
    )
    """Elevation of the antennae behind an edge, which feel for the tread while the head is up."""
    plane_sweep: float = number(
        math.radians(17.0),
        "rad",
        "assumed: 47 deg, as antennae that stay in the plane",
        ge=-0.8,
        le=0.8,
    )
    """Sweep of the bases while it steers by level antennae."""
    plane_time: float = number(4.0, "s", "assumed: over two gait cycles", gt=0, le=60)
    """Nothing felt for so long while it steers, and it feels for the ground again."""

    @model_validator(mode="after")
    def _apart(self) -> FeelParams:
        if self.missing >= self.touch:
            raise ValueError(
                f"missing: expected less than touch, {self.touch:g}, found {self.missing:g}"
            )
        return self


class HeadingParams(Params):
    """How a body that climbs keeps its heading, where the robot has an inertial sensor."""

    gain: float = number(
        1.0, "1", "fitted: trials of seed 3; an offset of a joint per turn of the body", ge=0, le=5
    )
    """Yaw offset for each radian that the body has been turned since the edge was felt; 0 lets it
    be turned."""
    largest: float = number(0.3, "rad", "assumed: as the turns of the gait", ge=0, le=1)
    """Largest such offset."""
    level_time: float = number(
        1.0, "s", "assumed: half a gait cycle, over which the head rocks", gt=0, le=60
    )
    """Time over which the vertical is drawn to the specific force."""
    rest_time: float = number(0.4, "s", "assumed: it has come to rest by then", ge=0, le=10)
    """How long it has to be at rest until what the gyroscopes tell is their error."""
    rest_rate: float = number(
        0.07, "rad/s", "assumed: four times the zero-rate level of an LSM6DSOX", gt=0, le=5
    )
    """Angular velocity under which it can be at rest."""
    memory_time: float = number(
        30.0, "s", "assumed: the error of a gyroscope drifts with its warmth", gt=0, le=3600
    )
    """Time at rest over which that error is averaged at most."""
    gap_time: float = number(
        0.05, "s", "assumed: at 1 rad/s 3 deg of turn are lost in it", ge=0, le=1
    )
    """Longest time without a reading that is taken for no turn; a longer one ends what is kept."""


class ClimbParams(Params):
    """How the body is raised over an edge.

    The centre line rises over `ramp`, ends `before` the edge, is `over` higher than the step and
    settles to it behind the edge. Each link takes the slope of the line where the plan says that it
    is: the lift travels down the body. The plan advances with `pace`, which is slower than the legs
    walk: a robot that is ahead of its plan is held by the edge until the plan comes after it.
    """

    feel: FeelParams = FeelParams()
    heading: HeadingParams = HeadingParams()
    rise: float = number(
        0.17,
        "m",
        "fitted: trials of seed 0; 0.15 is to be climbed, and the body sags",
        gt=0,
        le=0.3,
    )
    """Step for which it is raised where the probe does not say that it is a low one."""
    low: float = number(
        0.065,
        "m",
        "fitted: probes of seeds 5, 6; 14 of 128 steps of 12 and 15 cm read less",
        ge=0,
        le=0.5,
    )
    """Height by the probe under which a step is a low one."""
    spare: float = number(
        0.06, "m", "assumed: twice what a probe is wrong by, and the body sags", ge=0, le=0.3
    )
    """How much higher than a low step it is raised."""
    ramp: float = number(0.24, "m", "fitted: trials of seed 0, true position", gt=0.05, le=1)
    """Length over which the line rises."""
    before: float = number(0.03, "m", "fitted: trials of seed 0, true position", ge=0, le=0.3)
    """How far before the edge it has risen."""
    over: float = number(0.03, "m", "fitted: trials of seed 0, true position", ge=0, le=0.1)
    """How much higher than the step it is there."""
    settle: float = number(0.15, "m", "assumed: over a link", gt=0, le=1)
    """Length over which it comes down to the step."""
    amplitude: float = number(
        math.radians(15.0),
        "rad",
        "fitted: trials of seed 3; bent less, it turns less aside",
        ge=0,
        le=1,
    )
    """Amplitude of the yaw joints while it climbs, at most that of the gait."""
    amplitude_rate: float = number(
        0.2, "rad/s", "assumed: half a second for the change", gt=0, le=10
    )
    """Largest change of that amplitude."""
    frequency: float = number(
        0.3,
        "Hz",
        "fitted: trials of seed 3; legs that push less turn it less aside",
        gt=0,
        le=5,
    )
    """Frequency of the gait while the plan goes on, at most that of the gait."""
    pace: float = number(
        0.035,
        "m/s",
        "fitted: trials of seed 0; at 0.05 a robot that slips back loses the edge",
        gt=0,
        le=0.5,
    )
    """Speed of the plan along the way."""
    ahead: float = number(
        0.10,
        "m",
        "fitted: trials of seed 0; felt at 0.14, less what it walks on at once",
        gt=0,
        le=1,
    )
    """Distance of the edge from the middle of the head when it is felt."""
    approach_time: float = number(
        1.0, "s", "fitted: trials of seed 0; the robot comes up to the edge in it", ge=0, le=10
    )
    """Time that `climb` walks with its head raised before the plan goes on."""
    sink_rate: float = number(
        0.025, "m/s", "fitted: trials of seed 3; at 0.05 it lies on its belly at 15 cm", gt=0, le=1
    )
    """Speed at which it comes down behind an edge until the antennae feel the floor."""
    least: float = number(0.05, "m", "assumed: lower ones need no line", ge=0, le=0.3)
    """Rise under which no line is lowered while the head is up."""
    lift_time: float = number(1.5, "s", "assumed: the head is up before it walks", ge=0, le=10)
    """Time to stand while the head is raised."""
    carry_gain: float = number(3.0, "1/s", "assumed: a third of a second", ge=0, le=20)
    """Rate at which a raised head is brought to its target in spite of its load."""
    rate: float = number(2.0, "rad/s", "assumed: less than half the servo's speed", gt=0, le=6)
    """Largest speed of a pitch joint."""
    carry_rate: float = number(0.5, "rad/s", "assumed: as slow as a link comes down", gt=0, le=6)
    """Speed at which a joint gives up what it added against its load."""
    lowest: float = number(0.03, "m", "assumed: legs walk over it by themselves", ge=0, le=0.2)
    """Height under which it walks on."""
    step_time: float = number(1.0, "s", "assumed: as long as it walks over it", ge=0, le=30)
    """Time for which it feels nothing new after so low a step."""
    over_time: float = number(3.0, "s", "assumed: it walks into it within", ge=0, le=30)
    """Time within which something new means that the step was not so low."""
    drop_time: float = number(4.0, "s", "assumed: its length at the usual speed", ge=0, le=30)
    """Time for which it feels nothing new after a drop whose ground it has felt."""
    attempts: int = number(3, "1", "assumed: thrice the same place is a wall", ge=1, le=20)
    """Climbs one after the other that make a wall."""
    retreat_time: float = number(1.0, "s", "assumed: a link and a half", gt=0, le=30)
    """Time to back off from a step: of `climb` one that was not climbed, of `rhythm` each."""
    back_time: float = number(3.0, "s", "assumed: as search.reverse_time and a little", gt=0, le=30)
    """Time to back off from ground that is missing."""
    turn_time: float = number(6.5, "s", "assumed: it then walks away from the edge", gt=0, le=30)
    """Time to turn after that."""
    lift: float = number(0.35, "rad", "assumed: above it the head costs speed", ge=0, le=1)
    """Lift of the head of `lifted`."""
    walk_time: float = number(
        4.0, "s", "fitted: trials of seeds 3, 4; 4, 5 and 6 s (docs/science/climb.md)", ge=0, le=60
    )
    """Time that `rhythm` walks between two climbs."""
    come_time: float = number(2.0, "s", "fitted: as walk_time; 0.3, 1 and 2 s", ge=0, le=10)
    """Time that `rhythm` walks with its head raised before its plan goes on."""

    @model_validator(mode="after")
    def _low_is_low(self) -> ClimbParams:
        if self.low > self.rise:
            raise ValueError(f"low: expected at most rise, {self.rise:g} m, found {self.low:g}")
        return self
