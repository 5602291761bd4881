"""What a calibration comes to: the curve, what was done to its file, and what is known of it."""

from __future__ import annotations

from typing import Literal

from antennate.antenna.calibration import Calibration, Kind
from antennate.antenna.curves import Plateau
from antennate.experiments.calibrate.next_push import Assessment
from antennate.experiments.calibrate.recording import Handled
from antennate.studies.columns import Ends, column, tabular


@tabular
class Sigmoid:
    """Numbers that a sigmoid alone has."""

    slope: float = column("slope", form=".3f", interval="slope_95")
    """Slope over x; the interval is over pushes, by jackknife and Student's t, `null` with fewer
    than three pushes, or where all are alike. Where there is a `misfit`, it is of noise alone."""
    slope_95: Ends | None
    midpoint: float = column("midpoint", form=".4f", interval="midpoint_95")
    """x at which b is 0.5; its interval is like that of the slope."""
    midpoint_95: Ends | None


@tabular
class Speed:
    """How well the curve fits the pushes of one speed."""

    speed_m_s: float | None
    """Speed; `null` where it is not known."""
    samples: int = column("readings", form="d")
    """Readings at this speed."""
    r2: float = column("R²", form=".3f")
    """Share of the variance of b that the curve explains."""
    rmse: float = column("RMSE of b", form=".4f")
    """Root mean square error of b."""


@tabular
class Curve(Sigmoid):
    """The content of `calibration.json`, the file to keep."""

    polarity: int = column("polarity", form="+d")
    """1 if readings rise with the flex, -1 if they fall."""
    counts_low: float = column("reading at x = 0", "counts", form=".0f")
    counts_high: float = column("reading at x = 1", "counts", form=".0f")
    threshold: float = column("theta")
    """θ, the level from which on there is contact."""
    r2: float = column("R²", form=".3f")
    """Share of the variance of b that the curve explains, over all readings."""
    rmse: float = column("RMSE of b", form=".4f")
    """Root mean square error of b over all readings."""
    misfit: float | None = column("  alike in all pushes", form=".4f", default=None)
    """Root mean square error of b that is alike in all pushes; `null` if no more than noise."""
    noise_counts: float | None = column("noise", "counts", form=".1f", default=None)
    """Standard deviation of single readings, with which `doctor` compares; `null` if not known."""
    valid_counts: Ends = column("valid for", "counts", form=".0f")
    """Lowest and highest reading; beyond them the curve is a guess."""
    valid_bend: Ends = column("valid for levels")
    """Lowest and highest bend of the recording."""
    schema_version: int
    """Version of the file's format."""
    made_by: str
    """Version of antennate that wrote it."""
    sensor_id: str
    """Name of the flex sensor."""
    data_sha256: str
    """Hash of the recording's bytes."""
    samples: int
    """Readings used."""
    trials: int
    """Pushes used."""
    speeds: tuple[Speed, ...]
    """Each pushing speed."""
    cross_validated_rmse: dict[str, float]
    """Root mean square error of b on pushes left out, with fewer than three on tenths of the
    recording, of `sigmoid`, `line` and `isotonic`."""
    better_than_sigmoid: tuple[str, ...]
    """Rivals that win on these readings beyond noise; empty with a single push."""
    reach: float | None = None
    """Spans beyond the bent end up to which readings are still taken for those of the sensor."""
    kind: Kind = "sigmoid"
    """Kind of the curve: `sigmoid`, `line` or `isotonic`."""
    knots: tuple[float, ...] = ()
    """Rising readings between which a line or an isotonic curve is straight [counts]."""
    knot_levels: tuple[float, ...] = ()
    """Levels at the knots."""

    @classmethod
    def of(cls, found: Calibration) -> Curve:
        """The content of a calibration."""
        speeds = tuple(Speed(**speed.model_dump()) for speed in found.speeds)
        return cls(**{**found.model_dump(), "speeds": speeds})


@tabular
class CalibrateResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "calibrate"
    seed: int
    source: Literal["rig", "recording"]
    """`rig` or `recording`."""
    poor: bool
    """Whether R² is below `good_r2`."""
    hysteretic: bool = False
    """Whether it is poor although loading and unloading are each fitted well."""
    recording: Handled | None = None
    """File of the recording; `null` for the rig."""
    plateau: Plateau | None = None
    """Readings at which the converter saturates; `null` if it does not."""
    calibration: Curve
    """Curve from readings to b."""
    assessment: Assessment
    """Worth of the curve on the next push."""
