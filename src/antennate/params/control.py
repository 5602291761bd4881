"""Parameters of the controllers: from counts to joint targets."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import model_validator

from antennate.params.base import Params, number


class GaitParams(Params):
    """The serpenoid body wave and the stepping O-legs."""

    frequency: float = number(
        0.5,
        "Hz",
        "assumed: unpublished; legs then turn at 46 % of the servo's no-load speed",
        "cycles per second",
        gt=0,
        le=1.0,
    )
    wave_number: float = number(
        1.0,
        "1",
        "assumed: unpublished; one wave on the body, as in related robots",
        "waves along the body",
        gt=0,
        le=3,
    )
    amplitude: float = number(
        math.radians(25.0),
        "rad",
        "assumed: unpublished; 15 to 35 deg is usual",
        "amplitude of a yaw joint",
        ge=0,
        le=1.2,
    )
    body_phase: float = number(
        math.radians(200.0),
        "rad",
        "fitted: antennate gait, sweep of the leg phase; left feet are down where the body bends "
        "to the left",
        "lead of the body wave over the legs",
        ge=-2 * math.pi,
        le=2 * math.pi,
    )
    turn_offset: float = number(
        math.radians(20.0),
        "rad",
        "assumed: unpublished; antennate gait measures 66 deg of yaw a cycle",
        "yaw offset while turning",
        ge=0,
        le=1.0,
    )
    offset_rate: float = number(
        1.5,
        "rad/s",
        "assumed: a full change of turn in half a second, within the servo's speed",
        "largest change of the offset",
        gt=0,
    )
    antenna_mean: float = number(
        0.0,
        "rad",
        "assumed: the mounting angle",
        "angle about which the antenna bases sweep, or at which they are held",
        ge=-0.8,
        le=0.8,
    )
    antenna_amplitude: float = number(
        0.0,
        "rad",
        "assumed: held; the paper's robot does not sweep while it walks",
        "amplitude of the sweep of the antenna bases",
        ge=0,
        le=0.7,
    )
    antenna_frequency: float = number(
        0.5,
        "Hz",
        "assumed: that of the gait; the largest sweep then stays below the servos' speed",
        "sweeps of the antenna bases per second",
        gt=0,
        le=1.0,
    )


class ConditioningParams(Params):
    """From counts to the bending level b."""

    averaging_time: float = number(
        0.1,
        "s",
        "assumed: unpublished; ten samples",
        "T_avg, length of the running mean",
        gt=0,
        le=5,
    )
    midpoint: float = number(
        0.305,
        "1",
        "paper: midpoint of the sigmoid, in normalised reading",
        "reading at which b is one half",
        gt=-1,
        lt=2,
    )
    slope: float = number(
        18.3, "1", "paper: slope of the sigmoid", "slope of the sigmoid", gt=0, le=1000
    )
    polarity: Literal[-1, 1] = number(
        -1,
        "1",
        "paper: called a decreasing sigmoid; counts fall when the flex sensor bends",
        "+1 if the reading rises with bending",
    )
    counts_low: float = number(
        1399.0,
        "counts",
        "fitted: antennate.antenna.sensor, flex of a right angle without noise",
        "reading that normalises to 0",
        ge=0,
        le=4095,
    )
    counts_high: float = number(
        1872.0,
        "counts",
        "fitted: antennate.antenna.sensor, straight antenna without noise",
        "reading that normalises to 1",
        ge=0,
        le=4095,
    )

    @model_validator(mode="after")
    def _span(self) -> ConditioningParams:
        if self.counts_high - self.counts_low < 1:
            raise ValueError(
                f"counts_high must exceed counts_low by at least 1 count, got {self.counts_low} "
                f"and {self.counts_high}"
            )
        return self


class RuleParams(Params):
    """The paper's rule: when an antenna touches, and what to do then."""

    threshold: float = number(
        0.5,
        "1",
        "assumed: unpublished; middle of the sigmoid",
        "theta: bending level that is contact",
        gt=0,
        lt=1,
    )
    hysteresis: float = number(
        0.1,
        "1",
        "assumed: unpublished; above twice the noise in b",
        "contact ends this far below the threshold",
        ge=0,
        lt=1,
    )
    strong: float = number(
        0.7,
        "1",
        "assumed: unpublished",
        "both sides at this level or above count as strong",
        gt=0,
        le=1,
    )
    similar: float = number(
        0.15, "1", "assumed: unpublished", "levels that differ by less are similar", ge=0, le=1
    )
    hold_time: float = number(
        2.0,
        "s",
        "assumed: unpublished; one gait cycle, so that every command turns by the same angle",
        "T_hold, how long a maneuver is kept",
        gt=0,
        le=30,
    )


class RepetitionParams(Params):
    """When readings that repeat themselves mean that the robot is stuck."""

    window_cycles: float = number(
        0.5,
        "1",
        "fitted: open loop, 96 tunnels: half a cycle tells sooner than a whole one, at as few "
        "errors",
        "window of both means below, in gait cycles",
        gt=0,
        le=10,
    )
    change: float = number(
        0.06,
        "1",
        "fitted: open loop, 96 tunnels: 59 jams found, 8 alarms while still getting on",
        "mean change of deflection from cycle to cycle under which it repeats",
        gt=0,
        le=1,
    )
    pressure: float = number(
        0.2,
        "1",
        "fitted: open loop, 12 tunnels: free antennae stay below, stuck ones above",
        "mean deflection above which an antenna is pressed",
        ge=0,
        le=1,
    )


class EscapeParams(Params):
    """Backing off and turning when stuck."""

    trigger: Literal["repetition", "contact"] = number(
        "repetition",
        "1",
        "fitted: open loop; readings that repeat tell stuck from moving, both sides strong does "
        "not",
        "what counts as stuck: repeated readings, or the paper's both strong and similar",
    )
    reverse_time: float = number(
        2.2,
        "s",
        "fitted: study of the `closed` on 60 tuning tunnels; two thirds of the body length",
        "time to back off",
        gt=0,
        le=30,
    )
    turn_time: float = number(
        1.3,
        "s",
        "fitted: study of the `closed` on 60 tuning tunnels; about 60 deg at the offset below",
        "time of the first turn",
        gt=0,
        le=30,
    )
    turn_offset: float = number(
        0.52,
        "rad",
        "assumed: a tight turn, nearly on the spot",
        "yaw offset of turns",
        gt=0,
        le=1.0,
    )
    first_turn: Literal["memory", "right"] = number(
        "memory",
        "1",
        "assumed: the side touched more is the blocked one",
        "side of the first turn: away from what was touched more, or always right",
    )
    alternate: bool = number(
        True,
        "1",
        "assumed: searching both sides",
        "whether a second turn goes the other way, second_turn times as far",
    )
    second_turn: float = number(
        1.5,
        "1",
        "fitted: `closed` on 200 tuning tunnels (seeds 31 and 32): 192 successes, 188 with 2.0",
        "length of a turn the other way, in first turns",
        gt=0,
        le=5,
    )
    retry_time: float = number(
        12.0,
        "s",
        "assumed: six gait cycles",
        "stuck again within this time, it turns the other way",
        gt=0,
        le=300,
    )
    memory_time: float = number(
        4.0, "s", "assumed: two gait cycles", "time constant of the memory of touch", gt=0, le=300
    )
    memory_delay: float = number(
        3.0,
        "s",
        "fitted: open loop, 96 tunnels, 57 jams: the first turn is right in 61 % with it, 56 % "
        "without",
        "how long before the jam was noticed the memory is read",
        ge=0,
        le=60,
    )
    lost_time: float = number(
        2.0,
        "s",
        "fitted: open loop, 96 tunnels: ten times in 30 s nothing is felt for longer",
        "nothing felt for so long after a turn means that the walls are lost",
        gt=0,
        le=3600,
    )
    return_time: float = number(
        3.8, "s", "assumed: about 180 deg at the offset above", "time to turn round", gt=0, le=60
    )


class ControlParams(Params):
    """Conditioning, contact rule, maneuvers and gait of the controllers."""

    rate: float = number(
        100.0, "Hz", "paper: about 100 Hz over serial", "control ticks per second", gt=0, le=1000
    )
    gait: GaitParams = GaitParams()
    conditioning: ConditioningParams = ConditioningParams()
    rule: RuleParams = RuleParams()
    repetition: RepetitionParams = RepetitionParams()
    escape: EscapeParams = EscapeParams()

    @property
    def period(self) -> float:
        """Control period [s]."""
        return 1.0 / self.rate
