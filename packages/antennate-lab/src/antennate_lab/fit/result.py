"""What result.json and trials.csv of `antennate fit` hold."""

from __future__ import annotations

from antennate.studies.columns import column, tabular


@tabular
class ParameterRow:
    """One parameter of the robot."""

    name: str
    """Path in the robot's file, and its place if it stands in a list."""
    unit: str
    """Unit."""
    before: float = column("before", form=".4g")
    """Value in the robot's file."""
    value: float = column("fitted", form=".4g")
    """Value that predicts the logs best; the one before where they do not tell it."""
    low: float = column("90 % from", form=".4g")
    """Lower end of the 90 % interval."""
    high: float = column("to", form=".4g")
    """Upper end."""
    told: bool
    """Whether that is narrower than half of what was known before."""
    by: str = column("by")
    """What tells it: `air`, `floor` or `bench`, a servo on its own; empty if nothing."""
    record: str
    """What to record so that it is told; empty if it is."""


@tabular
class StepRow:
    """One step of a log, with the robot before the fit and with the fitted one."""

    log: str
    """Name of the log, or how many recordings of a servo."""
    step: str
    """Name of the step; of recordings the part that was left out, as of `servo`."""
    fitted: bool
    """Whether the fit saw it."""
    error_before_deg: float = column("error before", "deg", form=".2f")
    """Root mean square error of the moving joints' angles, the robot before; mean error of a part
    of recordings."""
    error_deg: float = column("after", "deg", form=".2f")
    """Likewise, the fitted robot."""
    lag_ms: float | None = column("lag", "ms", form=".1f", default=None)
    """Mean time by which moving joints follow late, measured; `null` for recordings."""
    lag_before_ms: float | None = column("before", "ms", form=".1f", default=None)
    """Likewise, the robot before."""
    lag_after_ms: float | None = column("after", "ms", form=".1f", default=None)
    """Likewise, the fitted robot."""
    turn_deg: float | None = column("turn", "deg/cycle", form=".1f", default=None)
    """Turn of the head in a cycle of the gait, measured; `null` without."""
    turn_before_deg: float | None = column("before", "deg/cycle", form=".1f", default=None)
    """Likewise, the robot before."""
    turn_after_deg: float | None = column("after", "deg/cycle", form=".1f", default=None)
    """Likewise, the fitted robot."""
    speed_mm: float | None = column("speed", "mm/cycle", form=".0f", default=None)
    """Speed of the head in a cycle of the gait by motion capture; `null` without."""
    speed_before_mm: float | None = column("before", "mm/cycle", form=".0f", default=None)
    """Likewise, the robot before."""
    speed_after_mm: float | None = column("after", "mm/cycle", form=".0f", default=None)
    """Likewise, the fitted robot."""


@tabular
class LogSummary:
    """A log that was read."""

    name: str
    """Name of its file."""
    sha256: str
    """Hash of all its files."""
    steps: list[str]
    """Steps that could be compared."""
    left_out: dict[str, str]
    """Steps that could not, and why."""
    warnings: list[str]
    """What is wrong with it."""


@tabular
class Correlation:
    """Two parameters that the logs hardly tell apart."""

    one: str
    """Name of the first."""
    other: str
    """Name of the second."""
    correlation: float
    """Of their errors."""


@tabular
class FitResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "fit"
    logs: list[LogSummary]
    """Each log, in the order given."""
    parameters: list[ParameterRow]
    """Each parameter that was searched."""
    steps: list[StepRow]
    """Each step, with the robot before and after."""
    correlations: list[Correlation]
    """Pairs of told parameters whose errors go together most, by size."""
    noise: dict[str, float]
    """Noise of the sensors at rest: `counts` of readings, `gyro` [rad/s]; and `gyro_zero`, the zero
    of the gyroscope about the vertical axis [rad/s]."""
    warnings: list[str]
    """What is wrong with the logs, or with the robot."""
    simulate: str
    """Command that simulates with the fitted robot."""
