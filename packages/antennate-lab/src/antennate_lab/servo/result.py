"""What result.json and trials.csv of `antennate servo` hold."""

from __future__ import annotations

from antennate.studies.columns import Ends, column, percent, tabular


@tabular
class RecordingRow:
    """One recording, with the last model; its errors count while torque is on."""

    name: str
    """Name of the file; of a log with its joint."""
    p_gain: float = column("gain", form="g")
    """Gain of the position loop."""
    error_deg: float | None = column("error", "deg")
    """Mean error of position."""
    error_max_deg: float | None
    """Largest error of position."""
    full_drive: float | None
    """Share of the time with torque in which the drive is full; `null` if unknown."""
    stalled: float | None = percent("stalls")
    """Share of that time at full drive with the shaft at rest, a stall; `null` likewise."""
    error_stalled_deg: float | None = column("then", "deg", form=".1f")
    """Mean error while it stalls; `null` if it never does."""
    error_else_deg: float | None = column("else", "deg")
    """Mean error in the rest of the time."""
    supply_stalled_v: float | None
    """Mean supply while it stalls."""
    weight_stalled_n_m: float | None
    """Mean torque of the weight while it stalls."""
    lifted_n_m: float
    """Largest torque of the weight that the servo held at rest with less than 0.9 of full drive."""


@tabular
class RecordingSummary(RecordingRow):
    """A recording, with the last model; errors count while torque is on."""

    sha256: str
    """Hash of the file."""
    gain_divisor: float | None
    """Divisor of the gain as the drive tells it at rest; `null` if it does not."""
    seconds: float
    """Time from the first sample to the last [s]."""
    samples: int
    """Number of samples."""
    torque_share: float
    """Share of samples with torque."""
    supply_v: float | None
    """Mean supply; `null` where it is not known."""


@tabular
class Parameters:
    """Parameters of a servo model."""

    gain_divisor: float = column("gain divisor", form=".1f")
    """Divisor of the gain of the position loop."""
    stall_torque: float = column("stall torque", "N·m", form=".3f")
    """Stall torque at the nominal voltage."""
    no_load_speed: float = column("no-load speed", "rad/s")
    """No-load speed at the nominal voltage."""
    armature: float = column("inertia", "kg·m²", form=".5f")
    """Inertia of the motor, seen at the shaft."""
    friction: float = column("friction", "N·m", form=".3f")
    """Friction that is always there."""
    load_friction: float = column("friction of load", form=".3f")
    """Friction over the torque of the motor."""


@tabular
class ModelSummary(Parameters):
    """A servo model."""

    name: str
    """Name of the model."""
    free: list[str]
    """Parameters that were fitted."""
    error_deg: float | None = column("mean error", "deg")
    """Mean error of position while torque is on, mean over recordings."""
    held_out_deg: dict[str, float | None]
    """Error on each part that was left out of the fit; `null` where it tells nothing."""
    interval_95: dict[str, Ends]
    """Ends of the 95 % interval of each fitted parameter, by jackknife and Student's t."""


@tabular
class ServoResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "servo"
    servo: str
    """Model of the servo."""
    fitted: bool
    """Whether `--fit` was given."""
    recordings: list[RecordingSummary]
    """Each recording, in the order given."""
    interval_over: str
    """What is left out in turn for the intervals, and how many there are: whole recordings from
    five on, else up to 30 stretches of the recordings."""
    models: list[ModelSummary]
    """Each model, simple ones first; the last is the whole one."""
