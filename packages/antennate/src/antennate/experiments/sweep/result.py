"""Sweeps beside walls and what they come to: trials.csv and result.json of `bench sweep`."""

from __future__ import annotations

from typing import Literal

from antennate.studies.columns import Ends, column, column_of, tabular, tabular_row

Spread = tuple[float | None, float | None, float | None]
"""Mean over cells, and both ends of its spread."""


@tabular
class Swept:
    """One sweep and its shapes; shares of time add up to 1."""

    centre_rad: float
    """Centre of the sweep."""
    amplitude_rad: float
    """Amplitude of the sweep."""
    forward: float | None = column("forward", default=None)
    """Share of time in touch with the tip leading."""
    backward: float | None = column("backward", default=None)
    """Share of time in touch with the tip trailing."""
    straight: float | None = column("straight", default=None)
    """Share of time in touch and straight."""
    transition: float | None = column("transition", default=None)
    """Share of time in touch in any other shape."""
    free: float | None = column("free", default=None)
    """Share of time out of touch."""


@tabular_row
class SweepRow(Swept):
    """One sweep, a row of trials.csv: a cell of the map, or a trial of the estimates.

    Only cells have shares of time.
    """

    seed: int
    trial: int
    """Number of the cell in its map, or of the trial."""
    kind: Literal["map", "estimate"]
    """`map` or `estimate`."""
    profile: str
    condition: str
    """Motion of the base, or condition of the estimates."""
    side: str
    """Side of the antenna, `l` or `r`, in the estimates after the split: `calibration-l`."""
    status: Literal["valid", "missed", "invalid"]
    """`valid`, `missed` if nothing was felt, or `invalid`."""
    distance_m: float
    """Distance from the base to the wall."""
    peak_flex_rad: float | None = None
    """Largest flex: true in the map, felt in the estimates."""
    reason: str = ""


@tabular
class Cell(Swept):
    """A valid cell of the map: one deterministic run."""

    distance: float
    """Distance of the wall over the length of the antenna."""


@tabular
class ShapeMap:
    """The map of a profile with the base fixed or moving."""

    cells: int
    """Cells run."""
    invalid: int
    """Cells whose physics became invalid."""
    share: dict[str, Spread]
    """Share of time of each shape and out of touch, over valid cells: `[mean, low, high]`, a spread
    by Student's t; `null` where it does not exist."""
    map: list[Cell]
    """Valid cells."""


@tabular
class CueErrors:
    """Errors of a cue over test trials, for any quantity, each in % of the true value."""

    n: int
    """Trials estimated."""
    untold: int
    """Trials in which the cue could not tell."""
    mape_percent: float | None = column("mean absolute error", "%", interval="mape_95")
    """Mean absolute error; its interval is by Student's t and not below 0."""
    mape_95: Ends | None
    rmse_percent: float | None = column(interval="rmse_95")
    """Root mean square error."""
    rmse_95: Ends | None
    bias_percent: float | None
    """Mean signed error."""


ERROR = column_of(CueErrors, "mape_percent")
"""The error that tables and figures show."""


@tabular
class Estimates:
    """What the test sweeps of a condition told, with noise or without.

    Cues that had too few sweeps to be calibrated are missing.
    """

    sweeps: int
    """Test sweeps."""
    missed: int
    """Test sweeps in which nothing was felt."""
    invalid: int
    """Sweeps whose physics became invalid, those of the calibration among them."""
    distance: dict[str, CueErrors]
    """Distance of the left wall, by cue."""
    gap: dict[str, CueErrors]
    """Width of the gap, by cue, where both antennae felt something."""
    base_to_tip: dict[str, CueErrors]
    """Distance from base to tip at the largest flex, by cue."""


@tabular
class ByNoise:
    """Estimates of a condition, with and without sensor noise."""

    noisy: Estimates
    """Estimates from readings of the sensor."""
    exact: Estimates
    """Estimates from the true flex."""


@tabular
class Published:
    """Errors that were published of CITRAS, in % of the true value."""

    base_to_tip: float = 7.75
    """Error of the distance from base to tip."""
    gap: float = 6.73
    """Error of the width of a gap."""


@tabular
class SweepResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "sweep"
    seed: int
    length_m: float
    """Length of the antenna."""
    frequency_hz: float
    """Sweeps per second."""
    profile: str
    """Profile of the estimates."""
    shapes: dict[str, dict[str, ShapeMap]]
    """The map of each profile, with the base `fixed` and `moving`."""
    estimates: dict[str, ByNoise]
    """Each condition: `same`, `varied` where sweeps differ, `tilted` where walls are not parallel
    to the heading, and `moving` where the base moves along."""
    published_percent: Published = Published()
    """Published errors of CITRAS."""
