"""When a reading is not believed, and when the robot must stand still."""

from __future__ import annotations

from pydantic import model_validator

from antennate.params.base import Params, number


class TouchCheckParams(Params):
    """The check by hand that left is left and that bending reads as bending."""

    level: float = number(0.3, "1", "assumed: above noise and creep, easily done", gt=0, le=1)
    """Change of the reading that is a touch, in calibrated spans."""
    still: float = number(0.15, "1", "assumed: half a touch", gt=0, le=1)
    """Change below which an antenna is at rest, in calibrated spans."""
    readings: int = number(10, "1", "assumed: 100 ms at 100 Hz", ge=1, le=1000)
    """Readings in a row that count."""
    patience: float = number(60.0, "s", "assumed: time to walk there and bend both", ge=0, le=3600)
    """Time by which the dry run is extended for the check, and then while torque is refused."""

    @model_validator(mode="after")
    def _order(self) -> TouchCheckParams:
        if self.still >= self.level:
            raise ValueError(f"still must be below level, found {self.still} and {self.level}")
        return self


class FollowingParams(Params):
    """When a joint does not follow its goals, by the model of its servo."""

    share: float = number(
        0.5,
        "1",
        "assumed: how a gain register acts is known within a factor of two (XL330: 256 measured, "
        "128 in the manual)",
        gt=0,
        le=1,
    )
    """Share of the modelled gain that a position loop must have."""
    shortfall: float = number(
        0.25, "1", "assumed: half of what a leg drives with at its pace", gt=0, lt=1
    )
    """Drive that may be missing, in full drives."""
    time: float = number(0.1, "s", "assumed: ten ticks; noise loses single answers", gt=0, le=10)
    """Time in a row for which a drive must be too small."""
    stuck_time: float = number(
        2.0, "s", "assumed: a gait cycle at half a hertz; its wave frees a joint", gt=0, le=60
    )
    """Time with moving goals for which a joint is behind without motion, or beyond its limit."""
    still: float = number(
        0.02, "rad", "assumed: four times the backlash of 0.25 degrees (datasheet)", gt=0, le=1
    )
    """Motion that is none."""
    overspeed: float = number(
        1.5,
        "1",
        "datasheet: an XC430 takes 14.8 V at most, 1.33 of 11.1 V; rest assumed",
        ge=1,
        le=10,
    )
    """Fastest that a joint can turn, in unloaded speeds."""


class SupervisorParams(Params):
    """Limits at which the robot is slowed, held, or switched off."""

    stale_age: float = number(
        0.05,
        "s",
        "measured: with a tick of 10 ms HOLD is decided 60 ms after the last valid sample, which "
        "leaves 40 ms of 100 ms for the bus",
        gt=0,
        le=0.06,
    )
    """Age of a sample from which on it is not acted upon."""
    recovery: int = number(10, "1", "assumed: 100 ms, as the running mean", ge=1, le=1000)
    """Fresh valid samples in a row that end a loss of data."""
    covered: float = number(
        0.0, "1", "assumed: a curve holds as far as it was recorded", ge=0, le=200
    )
    """How far beyond the bent end of its range a curve holds, in calibrated spans; beyond that a
    reading is OUT_OF_CAL."""
    hum_time: float = number(
        30.0,
        "s",
        "assumed: mains 0.02 Hz off half the rate beat with it and hide a hum for up to 25 s; "
        "Europe's mains wander by 0.05 Hz (EU 2017/1485)",
        gt=0,
        le=3600,
    )
    """Time for which a hum that was seen stays in force."""
    repeats: int = number(3, "1", "assumed: once is chance, three times is a defect", ge=1, le=100)
    """Holds, failures of the controller or reboots of the board that become a fault."""
    repeat_time: float = number(10.0, "s", "assumed: five gait cycles", gt=0, le=600)
    """Time within which they count."""
    late_answers: int = number(2, "1", "assumed: noise loses single ones", ge=1, le=100)
    """Answers missed in a row that degrade."""
    silent_answers: int = number(5, "1", "assumed: at 1 % loss once in 10^10", ge=1, le=100)
    """Answers missed in a row that mean a silent servo."""
    supply_warn: float = number(
        10.8, "V", "assumed: three lithium cells at 3.6 V, near empty", gt=0, le=100
    )
    """Supply below which is warned."""
    slow_rate: float = number(
        0.5,
        "1",
        "assumed: about half the current; never less, or more than one tick in a row would pass "
        "without a decision",
        ge=0.5,
        le=1,
    )
    """How fast the gait goes below supply_warn."""
    supply_hold: float = number(10.2, "V", "assumed: three cells at 3.4 V", gt=0, le=100)
    """Supply below which to stand still."""
    supply_off: float = number(9.6, "V", "assumed: three cells at 3.2 V", gt=0, le=100)
    """Supply below which to switch off."""
    supply_rise: float = number(0.3, "V", "assumed: it recovers by less at rest", ge=0, le=10)
    """Rise above a level that ends its cause."""
    rate: float = number(100.0, "Hz", "paper: about 100 Hz over serial", gt=0, le=1000)
    """Samples per second expected."""
    rate_error: float = number(0.2, "1", "assumed: far beyond any crystal", gt=0, lt=1)
    """Relative error of the rate allowed."""
    rate_time: float = number(1.0, "s", "assumed: a hundred samples", gt=0, le=60)
    """Window of the rate, and patience."""
    approach: float = number(1.0, "rad/s", "assumed: a hand can follow", gt=0, le=20)
    """Fastest that goals move until the first command after torque came on is reached; as much as
    `fastest` of the joints is no approach."""
    longest_arming: float = number(1.0, "s", "measured: 0.14 s on the twin", gt=0, le=10)
    """Longest time from an arm event to the next tick."""
    longest_pause: float = number(0.12, "s", "assumed: servo watchdogs act before it", gt=0, le=10)
    """Time between ticks from which on a restart needs a person."""
    following: FollowingParams = FollowingParams()

    @model_validator(mode="after")
    def _levels(self) -> SupervisorParams:
        if not self.supply_off < self.supply_hold < self.supply_warn:
            raise ValueError(
                f"supply levels must fall from warn over hold to off, found {self.supply_warn}, "
                f"{self.supply_hold} and {self.supply_off} V"
            )
        return self


class DriftParams(Params):
    """How the resting reading of an antenna is followed."""

    quantile: float = number(0.1, "1", "assumed: touches may take nine tenths", gt=0, lt=1)
    """Share of readings without contact that lie nearer to straight than the resting one."""
    speed: float = number(
        0.002,
        "1/s",
        "assumed: four times the fastest drift of row S7 of reliability, 30 % in 10 min",
        gt=0,
        le=1,
    )
    """Fastest that the resting reading is taken to drift, in spans."""
    band: float = number(
        0.15,
        "1",
        "measured: light touches and a sensor's memory let 90 s in a simulated tunnel show 7 %; "
        "no false contact in 24 h up to 30 % (row S7)",
        gt=0,
        le=1,
    )
    """Drift from which on a side is degraded, in spans."""
    rise: float = number(0.02, "1", "assumed: twice the noise of a reading", ge=0, le=0.1)
    """Drift below the band that ends its cause, in spans."""
    together: float = number(
        20.0,
        "s",
        "measured: 9.4 s at most in 24 simulated tunnels, with three controllers",
        ge=2,
        le=600,
    )
    """Time for which both antennae read as bent beyond the band, and from then on as drifted."""
