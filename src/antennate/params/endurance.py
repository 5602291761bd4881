"""What changes over minutes and hours of walking: resting readings."""

from __future__ import annotations

from antennate.params.base import Params, number


class DriftParams(Params):
    """How the resting reading of an antenna is followed."""

    quantile: float = number(
        0.1,
        "1",
        "assumed: light touches may take nine tenths of the time; 1.3 sigma from the middle",
        "share of readings without contact that lie nearer to straight than the resting one",
        gt=0,
        lt=1,
    )
    speed: float = number(
        0.002,
        "1/s",
        "assumed: four times the fastest drift of row S7, 30 % of the span in 10 min",
        "fastest that the resting reading is taken to drift, in spans",
        gt=0,
        le=1,
    )
    band: float = number(
        0.15,
        "1",
        "measured: light touches and a sensor's memory let 90 s in a simulated tunnel show 7 "
        "%; no false contact in 24 h up to 30 % (row S7)",
        "drift from which on a side is degraded, in spans",
        gt=0,
        le=1,
    )
    rise: float = number(
        0.02,
        "1",
        "assumed: twice the noise of a reading",
        "drift below the band that ends its cause, in spans",
        ge=0,
        le=0.1,
    )
