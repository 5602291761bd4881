"""What the examination of a robot at rest calls good."""

from __future__ import annotations

from antennate.params.base import Params, number


class DoctorParams(Params):
    """How long is looked, and from where on something is not good."""

    listen: float = number(2.0, "s", "assumed: 200 readings", gt=0, le=60)
    """Time over which the board is listened to."""
    greeting: float = number(3.0, "s", "assumed: boots in 2 s, greets every second", gt=0, le=60)
    """Longest wait for a greeting."""
    reads: int = number(20, "1", "assumed: enough for a median", ge=3, le=1000)
    """Reads of all servos that are timed."""
    answer_time: float = number(0.002, "s", "assumed: the bus gives up then", gt=0, le=0.1)
    """Longest time to a servo's answer beyond the wire and its return delay."""
    read_time: float = number(0.007, "s", "assumed: what a tick leaves for reading", gt=0, le=0.1)
    """Longest time of one read of all servos."""
    latency_timer: int = number(
        1, "ms", "datasheet: FTDI's AN232B-04, 1 ms is the lowest, 16 ms the default", ge=1, le=255
    )
    """Highest latency timer of a USB adapter."""
    heat_margin: float = number(10.0, "degC", "assumed: minutes of walking", ge=0, le=50)
    """Distance from a servo's own limit at which its temperature is warned of."""
    noise: float = number(10.0, "counts", "assumed: four times a resting sensor's", gt=0, le=1000)
    """Highest standard deviation of the readings at rest."""
    noise_ratio: float = number(
        3.0, "1", "assumed: far beyond what chance and another day do", ge=1, le=1000
    )
    """Highest noise in units of that when it was calibrated."""
    calibrated_noise: float | None = number(
        None, "counts", "assumed: that of the calibration file", ge=0, le=4095
    )
    """Noise of the left antenna when it was calibrated, of both without another calibration."""
    calibrated_noise_right: float | None = number(
        None, "counts", "assumed: that of its calibration file", ge=0, le=4095
    )
    """The same of the right antenna."""
