"""Calibrate an antenna: from a recording, or from a rig that pushes a simulated one.

On the rig a rod indents the antenna from the side, at several speeds, several times each. The bend
is the rod's way from the first touch over its whole way, which an experimenter can measure.
"""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from pydantic import model_validator

from antennate.antenna import fitting
from antennate.antenna.calibration import Calibration, Kind
from antennate.antenna.curves import Samples, plateau_of, white_noise
from antennate.antenna.sensor import reading_noise
from antennate.control.conditioning import bending_level
from antennate.errors import CalibrationError
from antennate.experiments.bench import mean_since, recorded
from antennate.experiments.calibrate.next_push import (
    Assessment,
    Pushes,
    assess,
    one_way_r2,
    sigmoid_r2,
)
from antennate.experiments.calibrate.readings import parameters_of
from antennate.experiments.calibrate.recording import Recording, RecordingParams, read, write
from antennate.experiments.calibrate.result import CalibrateResult, Curve
from antennate.experiments.calibrate.rig import Push, RigParams
from antennate.params.base import Params, number, paths_of, require_default
from antennate.params.bench import BenchVariationParams
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.studies.experiment import RunOutcome
from antennate.studies.pool import Workers, gather
from antennate.studies.trials import OnStep, no_step
from antennate.types import Floats

_BETTER = 0.2
"""How much more of the level each direction alone explains where hysteresis is asked about."""
_OF_THE_RIG = ("rig", "variation", "physics", "seed")


class CalibrateConfig(Params):
    """Everything that decides a calibration."""

    unread: ClassVar[tuple[str, ...]] = (
        "antenna.base_angle",
        "antenna.base_spacing",
        "variation.base_angle",
        "variation.friction",
        "variation.overlap",
    )
    recording: str | None = number(None, "1", "assumed: no recording")
    """CSV file to calibrate from; the rig if not given."""
    columns: RecordingParams = RecordingParams()
    rate: float | None = number(
        None, "Hz", "assumed: the recording has a column of time", gt=0, le=1e6
    )
    """Readings a second of a recording without a column of time."""
    sensor_id: str | None = number(
        None,
        "1",
        "assumed: `simulated` for the rig, `unnamed` for a recording",
        pattern=r"^[A-Za-z0-9._-]{1,64}$",
    )
    """Name of the flex sensor."""
    averaging_time: float = number(
        0.0, "s", "assumed: adds lag that grows with speed, and is no sensor's part", ge=0, le=5
    )
    """Mean over readings before fitting."""
    full_scale: bool = number(False, "1", "assumed: the paper's numbers do not tell")
    """Normalise by 0 to 4095 counts and not by the recording's ends."""
    curve: Kind = number("sigmoid", "1", "paper: one sigmoid")
    """Curve of the file: the sigmoid, a straight line, or isotonic (any that goes one way)."""
    threshold: float = number(0.5, "1", "assumed: middle of the sigmoid", gt=0, lt=1)
    """Theta of the file."""
    least_r2: float = number(0.5, "1", "assumed: half of the bend explained", ge=0, lt=1)
    """A worse fit is refused."""
    good_r2: float = number(0.9, "1", "assumed: our rig reaches 0.98", ge=0, lt=1)
    """A worse fit is warned of."""
    seed: int = number(1, "1", "assumed: any", ge=0)
    """Seed of all chance."""
    rig: RigParams = RigParams()
    antenna: AntennaSpec = AntennaSpec()
    variation: BenchVariationParams = BenchVariationParams()
    physics: BenchPhysicsParams = BenchPhysicsParams()

    @model_validator(mode="after")
    def _rig_or_recording(self) -> CalibrateConfig:
        """A recording needs no rig, and the rig no columns."""
        if self.recording is None:
            require_default(self, "without a recording it is not read", "columns", "rate")
        else:
            used = {f"antenna.sensor.{n}" for n in parameters_of(self.columns.reading_unit)}
            antenna = sorted({*paths_of(AntennaSpec, "antenna")} - used)
            require_default(self, "with a recording it is not read", *_OF_THE_RIG, *antenna)
        named = {"time_column", "time_unit"} & self.columns.model_fields_set
        if self.rate is not None and named:
            raise ValueError(
                f"rate: expected none beside columns.{min(named)}, found {self.rate:g} Hz"
            )
        return self

    @model_validator(mode="after")
    def _on_the_antenna(self) -> CalibrateConfig:
        if self.rig.place + self.rig.rod_radius > self.antenna.length:
            raise ValueError(
                f"rig.place must leave room for the rod on the antenna of {self.antenna.length:g} "
                f"m, found {self.rig.place:g} m"
            )
        if self.rig.depth > 0.9 * self.rig.place:
            raise ValueError(
                f"rig.depth must stay below 0.9 of rig.place, {0.9 * self.rig.place:g} m, found "
                f"{self.rig.depth:g} m"
            )
        return self


@dataclass(frozen=True)
class CalibrateOutcome(RunOutcome):
    """A calibration and its data.

    Attributes:
        recording: The data, averaged as asked, with each push as a trial of its own.
        raw: The same before averaging.
    """

    config: CalibrateConfig
    recording: Recording
    raw: Recording
    calibration: Calibration

    @functools.cached_property
    def assessment(self) -> Assessment:
        """What is known about the next push."""
        return assess(self.recording.samples, self.calibration, self.recording.t)

    def result(self) -> CalibrateResult:
        """The calibration and what is known of it."""
        samples = self.raw.samples
        return CalibrateResult(
            seed=self.config.seed,
            source="rig" if self.config.recording is None else "recording",
            poor=self.calibration.r2 < self.config.good_r2,
            hysteretic=self._hysteretic(),
            recording=self.raw.handled,
            plateau=plateau_of(samples.counts, samples.level),
            calibration=Curve.of(self.calibration),
            assessment=self.assessment,
        )

    def _hysteretic(self) -> bool:
        """Whether the fit is poor, and loading and unloading are fitted far better on their own.

        That is: each well, or with half the variance left or less.
        """
        loop, good, r2 = self.assessment.hysteresis, self.config.good_r2, self.calibration.r2
        if loop is None or r2 >= good:
            return False
        alone = min(loop.one_way_r2)
        return alone >= good or 1.0 - alone <= (1.0 - r2) / 2.0

    def levels(self) -> Floats:
        """Bending levels that the calibration gives its own data, shape (n,)."""
        return bending_level(self.calibration.conditioning(), self.recording.samples.counts)

    def conditioning_toml(self) -> str:
        """The curve as keys of a configuration file, with what turns a simulated sensor round."""
        curve = self.calibration.conditioning()
        of_curve = ("knots", "knot_levels") if curve.knots else ("midpoint", "slope")
        keys = (*of_curve, "polarity", "counts_low", "counts_high")
        values = {key: getattr(curve, key) for key in keys}
        lines = [f"{k} = {list(v) if isinstance(v, tuple) else v!r}" for k, v in values.items()]
        here, usual = self.config.antenna.sensor, SensorParams()
        other = [n for n in ("kind", "fixed_resistor") if getattr(here, n) != getattr(usual, n)]
        if self.config.recording is None and other:
            lines += ["", "[robot.antenna.sensor]"]
            lines += [f'{name} = "{getattr(here, name)}"' for name in other]
        return "\n".join(["[control.conditioning]", *lines]) + "\n"


def push(config: CalibrateConfig, trial: int) -> Recording:
    """One push of the rig."""
    rig = config.rig
    speed = rig.speeds[trial // rig.pushes]
    rng = np.random.default_rng([config.seed, trial])
    factors = np.exp(rng.normal(0.0, config.variation.stiffness, config.antenna.hinges))
    gap = 2 * rig.start_spread * rng.uniform(0.0, 1.0)
    ways = 2 if rig.withdraw else 1
    ticks = ways * int(np.ceil((gap + rig.depth) / speed * config.antenna.sensor.rate)) + 1
    noise = reading_noise(config.antenna.sensor, rng, (ticks,))
    t, flex, way = Push(config.physics, config.antenna, rig, factors, speed, gap).run(ticks)
    counts = recorded(config.antenna.sensor, flex, noise)
    bend = way / rig.depth
    inside = (bend >= 0) & (bend <= 1)
    n = int(inside.sum())
    samples = Samples(
        counts[inside],
        bend[inside],
        np.full(n, trial, dtype=np.int64),
        np.full(n, speed),
        np.zeros(n, dtype=np.int64),
    )
    return Recording(t[inside], samples, "")


def record(
    config: CalibrateConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
) -> Recording:
    """All pushes of the rig, as one recording."""
    tasks = [(config, trial) for trial in range(len(config.rig.speeds) * config.rig.pushes)]
    parts = gather(push, tasks, workers, on_step)
    fields = ("counts", "level", "trial", "speed", "row")
    joined = [np.concatenate([getattr(p.samples, f) for p in parts]) for f in fields]
    joined[-1] = np.arange(2, len(joined[0]) + 2)
    whole = Recording(np.concatenate([p.t for p in parts]), Samples(*joined), "")
    return replace(whole, sha256=hashlib.sha256(write(whole).encode()).hexdigest())


def averaged(recording: Recording, averaging_time: float) -> Recording:
    """Readings replaced by the mean of those of the last averaging_time [s] of their push."""
    if averaging_time == 0:
        return recording
    s = recording.samples
    counts = s.counts.copy()
    for trial in np.unique(s.trial):
        rows = np.flatnonzero(s.trial == trial)
        first = np.searchsorted(recording.t[rows], recording.t[rows] - averaging_time + 1e-9)
        counts[rows] = mean_since(first, s.counts[rows])
    return replace(recording, samples=replace(s, counts=counts))


def run(
    config: CalibrateConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
) -> CalibrateOutcome:
    """Calibrate from the recording, or from the rig if there is none."""
    if config.recording is None:
        raw = record(config, workers, on_step)
    else:
        sensor = config.antenna.sensor
        raw = read(Path(config.recording), config.columns, config.rate, sensor)
    used = averaged(raw, config.averaging_time)
    pushes = Pushes.of(used.samples)
    used = replace(used, samples=replace(used.samples, trial=pushes.number))
    noise = float(white_noise(raw.samples.counts, raw.samples.trial))
    try:
        calibration = fitting.fit(
            used.samples,
            config.sensor_id or ("unnamed" if config.recording else "simulated"),
            raw.sha256,
            config.threshold,
            config.full_scale,
            config.least_r2,
            noise if np.isfinite(noise) else None,
            config.curve,
            pushes.way,
        )
    except CalibrationError as error:
        where = f"{config.recording}: " if config.recording else ""
        raise CalibrationError(f"{where}{error}{_hysteresis(used.samples, pushes)}") from None
    return CalibrateOutcome(config, used, raw, calibration)


def _hysteresis(samples: Samples, pushes: Pushes) -> str:
    """A hint at hysteresis beside a fault, if each direction alone would be fitted far better."""
    there, back = one_way_r2(samples, pushes)
    both = sigmoid_r2(samples, pushes.way != 0)
    if min(there, back) < both + _BETTER:
        return ""
    return (
        f"; or is it hysteresis? Loading alone fits with R² {there:.2f}, unloading alone with "
        f"{back:.2f}"
    )
