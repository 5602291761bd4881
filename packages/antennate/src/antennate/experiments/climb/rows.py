"""A row of trials.csv of `antennate climb`."""

from __future__ import annotations

from dataclasses import field

from antennate.studies.columns import CONDITION, column, percent, tabular
from antennate.studies.pooling import mean


@tabular
class Place:
    """Which trial a row is of."""

    seed: int
    """Seed of the trials on this ground: on a step, that of the run plus ten thousand times the
    height in metres."""
    cell: str = field(metadata=CONDITION)
    """Name of the cell: part, condition, ground and gain divisor."""
    trial: int
    part: str
    """`climbing`, `ground` or `sensing`."""
    condition: str
    """Who climbs."""
    ground: str
    """Name of the ground; in the part `ground` as on the command line."""
    height_m: float | None
    """Height of the edge; empty without one."""
    divisor: float


@tabular
class Effort:
    """Climbs begun, and the load of the pitch motors; of many the mean over the valid ones."""

    climbs: float | None = column("climbs begun, mean", pool=mean, least=0.0, default=0)
    torque_rms_n_m: float | None = column(
        "RMS torque of the worst pitch joint", "N·m", mean, least=0.0, default=None
    )
    """RMS torque of the pitch motor with the largest one."""
    torque_peak_n_m: float | None = column(
        "largest torque, mean", "N·m", mean, least=0.0, default=None
    )
    """Largest torque of any pitch motor."""
    above_half: float | None = percent(
        "over half the stall torque", "% of climb", mean, form=".1f", least=0.0, default=None
    )
    """Share of the climb in which a pitch motor gives more than half its stall torque."""
    saturated: float | None = percent(
        "drive at its limit", "% of climb", mean, form=".1f", least=0.0, default=None
    )
    """Share of the climb in which the drive of a pitch motor is at its limit."""
    current_rms_a: float | None = column(
        "RMS current of the worst pitch joint", "A", mean, least=0.0, default=None
    )
    """RMS current of the pitch motor with the largest one, on the torque-speed line."""


@tabular
class Probe:
    """The first thing that `climb` feels."""

    felt_height_m: float | None = column(
        "felt height", "cm", mean, form=".1f", scale=100.0, default=None
    )
    """Height by the probe; `null` if nothing is felt, or it is not finite."""
    ahead_m: float | None = column("ahead", "cm", mean, form=".1f", scale=100.0, default=None)
    """Distance of the edge from the middle of the head when it is felt."""
    latency_s: float | None = column("latency", "s", mean, default=None)
    """Time until it is felt, from the first touch or from when an antenna is past a drop."""


@tabular
class ClimbRow(Probe, Effort, Place):
    """One trial."""

    outcome: str
    """`success`, `timeout`, `overturned`, `left`, `fell`, `stopped` (before a drop), `felt` (it
    ended with the verdict), `walked` (the flat floor) or `invalid`."""
    time_s: float = column("time to the end", "s", form=".1f", least=0.0, most="time_limit")
    """Time to the end; the limit for `timeout`."""
    climb_time_s: float | None = None
    """Time from a link pitch before the first edge on; empty if the robot never came there."""
    speed_m_s: float | None = None
    """Speed of the middle of the robot in that time; on the flat floor over all its way."""
    walked_m: float = 0.0
    """Distance that the middle of the robot walked."""
    verdict: str | None = None
    """What `climb` takes the first thing that it feels for: `FLOOR` (it feels nothing), `STEP_UP`,
    `DROP`, `WALL` or `UNKNOWN`; empty for others."""
    plan_error_m: str = ""
    """Place of the head by the plan less the true one when the centre of a link crosses the first
    edge, as `0:-0.012 1:0.004`: links from the head; those without a plan are left out."""
    reason: str = ""
