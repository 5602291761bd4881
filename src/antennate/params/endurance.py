"""What changes over minutes and hours of walking: resting readings."""

from __future__ import annotations

from antennate.params.base import Params, number


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
