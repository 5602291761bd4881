"""What changes over minutes and hours of walking: resting readings, and turns of legs."""

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
        "measured: light touches and the memory of the film let 90 s in a simulated tunnel show 7 "
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


class TurnsParams(Params):
    """When and how legs forget their whole turns."""

    most: float = number(
        250.0,
        "1",
        "datasheet: XC430-W240 counts 256 turns either way; six are left, 12 s of walking",
        "turns from which on legs are made to forget them",
        ge=1,
        le=254,
    )
    calm: int = number(
        5, "1", "assumed: 50 ms at 100 Hz", "ticks without motion before the first", ge=1, le=100
    )
    calm_ticks: float = number(
        2.0,
        "ticks",
        "assumed: twice the resolution",
        "change of a position from tick to tick that is no motion",
        ge=0,
        le=50,
    )
    patience: int = number(
        100, "1", "assumed: 1 s at 100 Hz", "ticks to wait for that", ge=1, le=1000
    )
    tries: int = number(
        20,
        "1",
        "assumed: 0.2 s at 100 Hz, twice as long as a late answer is waited for",
        "ticks that one step of a leg may take",
        ge=1,
        le=100,
    )
    budget: float = number(
        0.005,
        "s",
        "assumed: one answer takes 1 ms at most at 1 Mbit/s; half a tick",
        "time for one reading",
        gt=0,
        le=0.02,
    )
    slack: float = number(
        0.25,
        "1",
        "assumed: 245:1 gears hold; far less than half a turn, which could not be told",
        "turn of a leg without torque that is put up with, in turns",
        gt=0,
        lt=0.5,
    )
