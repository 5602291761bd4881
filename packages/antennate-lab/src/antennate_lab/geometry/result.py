"""The gaits of `antennate geometry`, and what they come to: its trials.csv and its result.json."""

from __future__ import annotations

import math

from antennate.studies.columns import Ends, column, tabular


@tabular
class Walked:
    """A gait by model and engine, a row of trials.csv."""

    part: str
    """Why it is walked: `random`, `lead`, `front`, `named` or `turn`."""
    trial: int
    """Number of the gait within its part."""
    name: str
    """Name of a gait that is known by one, else empty."""
    amplitude_rad: float = column("amplitude", "deg", form=".1f", scale=math.degrees(1.0))
    """Amplitude of the body wave."""
    wave_number: float = column("wave number")
    """Waves along the body."""
    lead_rad: float = column("lead", "deg", form=".0f", scale=math.degrees(1.0))
    """Lead of the body wave over the legs."""
    offset_rad: float
    """Offset of the yaw joints; positive turns right."""
    frequency_hz: float
    """Gait cycles per second."""
    speed_m_s: float = column("speed", "m/s", form=".3f", interval="speed_m_s_95", default=math.nan)
    """Mean speed of the centre along the body's mean axis, by the engine."""
    model_speed_m_s: float = column("  by the model", "m/s", form=".3f")
    """Mean speed by the model."""
    yaw_deg_per_cycle: float = math.nan
    """Turn of the body per gait cycle, by the engine; positive is to the left."""
    model_yaw_deg_per_cycle: float
    """Turn of the body per gait cycle, by the model; positive is to the left."""
    cost_of_transport: float | None = column(
        "cost of transport", form=".3f", interval="cost_of_transport_95", default=None
    )
    """Positive mechanical work of all servos over weight times distance, by the engine; `null` near
    standstill."""
    model_cost: float = column("  friction alone, model", form=".3f")
    """Work against friction over weight times distance, by the model."""
    model_torque_n_m: float = column("torque of a yaw servo, model", "N·m")
    """Largest torque of a yaw servo, by the model."""
    wanted_m_s: float | None = None
    """Speed that the twist map was asked for; `null` for all gaits but turns."""
    wanted_per_m: float | None = None
    """Curvature that the twist map was asked for; `null` for all gaits but turns."""


@tabular
class Gait(Walked):
    """A gait with its speeds in body lengths."""

    body_lengths_per_cycle: float = column("body lengths a cycle")
    """Body lengths per gait cycle, by the engine."""
    model_body_lengths_per_cycle: float = column("  by the model")
    """Body lengths per gait cycle, by the model."""


@tabular
class NamedGait(Gait):
    """A gait that is walked again and again: means over its walks, with intervals by Student's t.

    All else is that of its middle walk.
    """

    speed_m_s_95: Ends | None
    cost_of_transport_95: Ends | None
    body_lengths_per_cycle_95: Ends | None
    """Interval of `body_lengths_per_cycle`."""


@tabular
class Estimate:
    """A number of `agreement` with its interval, by bootstrap over gaits."""

    value: float
    """Number over all random gaits."""
    interval95: Ends
    """Percentiles 2.5 and 97.5 of the number over resampled gaits."""


@tabular
class AimsReached:
    """Which aims the model reaches; all were set before the first run."""

    speed_r: bool
    """Whether `speed_r` is high enough."""
    speed_rmse_m_s: bool
    """Whether `speed_rmse_m_s` is low enough."""
    yaw_r: bool
    """Whether `yaw_r` is high enough."""
    better_than_rival: bool
    """Whether the interval of `rival_less_model_m_s` lies above 0."""


@tabular
class Agreement:
    """Model against engine on the random gaits."""

    gaits: int
    """Number of random gaits."""
    speed_r: Estimate
    """Correlation of speeds."""
    speed_rmse_m_s: Estimate
    """Root mean square difference of speeds."""
    yaw_r: Estimate
    """Correlation of turns per gait cycle."""
    yaw_rmse_deg: Estimate
    """Root mean square difference of turns per gait cycle."""
    cost_rank_r: Estimate
    """Correlation of ranks of `model_cost` and `cost_of_transport`."""
    rival_speed_m_s: float
    """The one speed that the rival predicts: that of legs that roll on their longest radius, or
    where legs lift the mean of these gaits."""
    rival_rmse_m_s: Estimate
    """Root mean square difference of speeds of the rival and the engine."""
    rival_less_model_m_s: Estimate
    """Root mean square difference of the rival less that of the model."""
    reached: AimsReached
    """Which aims are reached."""


@tabular
class BestLead:
    """Lead that walks fastest at a wave number."""

    wave_number: float
    engine_deg: float = column("engine", "deg", form=".0f")
    """Best lead by the engine."""
    model_deg: float = column("model", "deg", form=".0f")
    """Best lead by the model."""
    law_deg: float | None = column("law of stiff servos", "deg", form=".0f", default=None)
    """Best lead by the law of stiff servos; `null` for lifting legs."""
    model_less_engine_deg: float = column("model less engine", "deg", form="+.1f")
    """Best lead by the model less that by the engine."""
    law_less_engine_deg: float | None = column("law less engine", "deg", form="+.1f", default=None)
    """Best lead by the law less that by the engine; `null` for lifting legs."""
    stiff_less_law_deg: float | None = column(
        "model on stiff servos less law", "deg", form="+.2f", default=None
    )
    """Best lead of a small wave on stiff servos, by the model, less that by the law; `null` for
    lifting legs."""
    engine_speed_m_s: float
    """Speed at the best lead, by the engine."""
    reached: bool
    """Whether model and engine agree as closely as was aimed for."""


@tabular
class Fastest:
    """The fastest gait that costs no more transport than the configured one, at its frequency."""

    gait: NamedGait | Gait
    """That gait, of `named` or of `front`."""
    speed_over_default: float
    """Speed over that of the configured gait."""
    reached: bool
    """Whether it is as much faster as was aimed for."""


@tabular
class TorusFit:
    """Curvature over body and leg phase, against whole cycles of a robot with stiff servos."""

    cells: int
    """Cells of the map, each way."""
    gain_r: float
    """Correlation of what a step gains with its lead, by the curvature and by whole cycles."""
    step_rmse_m: float
    """Root mean square difference of steps, by the map and by whole cycles."""
    best_lead_deg: float
    """Lead of the longest step by the map."""
    law_deg: float
    """Best lead by the law of stiff servos."""


@tabular
class Turns:
    """Twists that were asked of the map, as the engine walks them; lists have one entry a turn."""

    turns: int
    """Number of turns."""
    speed_rmse_m_s: float
    """Root mean square difference of speeds walked and wanted."""
    curvature_rmse_per_m: float
    """Root mean square difference of curvatures walked and wanted."""
    curvature_r: float | None
    """Correlation of curvatures walked and wanted; `null` with one turn."""
    wanted_per_m: list[float]
    """Curvatures wanted."""
    curvature_per_m: list[float]
    """Curvatures walked."""
    wanted_m_s: list[float]
    """Speeds wanted."""
    speed_m_s: list[float]
    """Speeds walked."""


@tabular
class GeometryResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "geometry"
    frequency_hz: float
    body_length_m: float
    """Body length: `--body-length`, or the length of the robot without antennae."""
    measured_body_lengths_per_cycle: float | None
    """Body lengths per gait cycle of a real robot, as given by `--measured`; `null` without."""
    agreement: Agreement
    """Model against engine."""
    leads: list[BestLead]
    """Best lead of each wave number."""
    named: list[NamedGait]
    """The gait of the run, gaits known by name, and the gait in more haste."""
    front: list[Gait]
    """Gaits of the largest amplitude over wave numbers and leads, each walked once and without
    intervals, else as `named`."""
    fastest_at_no_more_cost: Fastest
    """The fastest gait at no more cost of transport."""
    torus: TorusFit | None
    """The map over body and leg phase; `null` for lifting legs."""
    turns: Turns | None
    """Twists of the map; `null` for lifting legs, and without turns."""
