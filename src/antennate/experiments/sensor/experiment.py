"""The sensor on its own: static curve, a slow loop, a held bend, and the divider that suits it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from antennate import figures as style
from antennate.antenna import sensor
from antennate.errors import ConfigError
from antennate.params.base import Params, number
from antennate.robots.antenna import SensorParams
from antennate.studies.columns import column, columns, tabular
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.tables import Table
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

E24 = (
    *(1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0),
    *(3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1),
)
"""Resistors to be had in each decade (IEC 60063, series E24)."""


class SensorConfig(Params):
    """A flex sensor under a given range of flex."""

    unread: ClassVar[tuple[str, ...]] = ("sensor.active_length",)
    largest_flex: float = number(
        math.pi / 2, "rad", "assumed: antenna bent to a right angle", gt=0.01, le=6
    )
    """Largest bend."""
    points: int = number(19, "1", "assumed: every five degrees of a right angle", ge=3, le=1000)
    """Bends of the table."""
    loop_time: float = number(
        4.0, "s", "assumed: slow against the flex sensor's rise", gt=0.1, le=1000
    )
    """Time of a loop."""
    hold_time: float = number(30.0, "s", "assumed: three slow time constants", gt=0.1, le=10000)
    """Time of the held bend."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of the noise."""
    sensor: SensorParams = SensorParams()


@tabular
class Point:
    """The sensor at one bend, without memory and noise."""

    flex_deg: float
    """Flex."""
    resistance_ohm: float = column("R", "kOhm", scale=1e-3)
    """Resistance of the flex sensor."""
    voltage_v: float = column("V", form=".3f")
    """Voltage at the converter."""
    counts: float = column("counts", form=".0f")
    """Reading [counts]."""


@tabular
class SensorResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "sensor"
    seed: int
    """Seed of the noise."""
    kind: str
    """Kind of flex sensor."""
    polarity: int
    """1 if readings rise with bending, -1 if they fall."""
    curve: list[Point]
    """Static curve, from straight to the largest bend."""
    counts_span: float
    """Change of the reading from straight to the largest bend."""
    loop_width_share: float
    """Gap between loading and unloading at half the bend, over the span of readings."""
    creep_counts: float
    """Drift of the reading under a held bend."""
    noise_sd_counts: float
    """Standard deviation of the noise."""
    divider_ohm: float
    """Fixed resistor in use."""
    best_divider_ohm: float
    """Fixed resistor of series E24 that spreads readings farthest."""
    best_counts_span: float
    """Spread of readings with the best resistor [counts]."""
    clipped: bool
    """Whether a bend lies outside what the converter can tell."""


@dataclass(frozen=True)
class SensorOutcome(Outcome):
    """What the sensor says.

    Attributes:
        found: The result.
        loop: Bend [rad] and reading without noise [counts] over one loop after one, shape (k, 2).
        hold: Time [s], reading [counts] with noise and without, bend held from 0 on, shape (m, 3).
        resistors: Resistors tried [Ohm], shape (r,), and the `spread` of each [counts].
    """

    found: SensorResult
    loop: Floats
    hold: Floats
    resistors: Floats
    spread: Floats

    def result(self) -> SensorResult:
        """The static curve, and what disturbs it."""
        return self.found


def run(config: SensorConfig) -> SensorOutcome:
    """Try the sensor.

    Raises:
        ConfigError: No reading changes over the whole range of bends.
    """
    params = config.sensor
    flex = np.linspace(0.0, config.largest_flex, config.points)
    readings = sensor.counts(params, flex)
    if np.ptp(readings) == 0:
        raise ConfigError(
            "sensor: expected readings that change with bending, found "
            f"{readings[0]:g} counts at every bend; choose another divider"
        )
    resistors = np.array([base * 10.0**d for d in range(2, 7) for base in E24])
    best, spread = sensor.best_divider(params, config.largest_flex, resistors)
    loop, hold = _loop(config), _hold(config)
    ohms = sensor.resistance(params, sensor.sensed_flex(params, flex))
    volts = sensor.divider(params, ohms)
    table = np.stack([np.degrees(flex), ohms, volts, readings], axis=1).tolist()
    found = SensorResult(
        seed=config.seed,
        kind=params.kind,
        polarity=1 if readings[-1] > readings[0] else -1,
        curve=[
            Point(flex_deg=deg, resistance_ohm=ohm, voltage_v=volt, counts=counts)
            for deg, ohm, volt, counts in table
        ],
        counts_span=float(abs(readings[-1] - readings[0])),
        loop_width_share=_width(loop, config.largest_flex / 2),
        creep_counts=float(abs(hold[-1, 2] - hold[0, 2])),
        noise_sd_counts=float(np.std(hold[:, 1] - hold[:, 2])),
        divider_ohm=params.divider_resistance,
        best_divider_ohm=best,
        best_counts_span=float(spread.max()),
        clipped=bool((volts < sensor.transfer_curve(params)[0][0]).any())
        or bool((readings >= sensor.FULL_SCALE).any()),
    )
    return SensorOutcome(found=found, loop=loop, hold=hold, resistors=resistors, spread=spread)


def _width(loop: Floats, middle: float) -> float:
    """Gap of a loop at a bend [rad] over its span of readings."""
    half = len(loop) // 2
    there, back = loop[:half], loop[half:][::-1]
    gap = np.interp(middle, *there.T) - np.interp(middle, *back.T)
    return float(abs(gap) / np.ptp(loop[:, 1]))


def _loop(config: SensorConfig) -> Floats:
    """The second of two loops from straight to bent and back."""
    params, period = config.sensor, 1.0 / config.sensor.rate
    chain = sensor.SensorChain(params, (), period)
    ticks = max(4, 2 * round(config.loop_time * params.rate / 2))
    up = np.linspace(0.0, config.largest_flex, ticks // 2 + 1)
    bends = np.tile(np.concatenate([up[:-1], up[:0:-1]]), 2)
    readings = [float(chain.step(np.array(f))) for f in bends]
    return np.stack([bends, readings], axis=1)[ticks:]


def _hold(config: SensorConfig) -> Floats:
    params, period = config.sensor, 1.0 / config.sensor.rate
    ticks = max(2, round(config.hold_time * params.rate))
    noise = sensor.reading_noise(params, np.random.default_rng(config.seed), (ticks,))
    noisy, clean = (sensor.SensorChain(params, (), period) for _ in range(2))
    bent = np.array(config.largest_flex)
    rows = [
        (i * period, float(noisy.step(bent, noise[i])), float(clean.step(bent)))
        for i in range(ticks)
    ]
    return np.array(rows)


_ROWS = 10
"""Most lines of the table."""


def tables(result: SensorResult) -> Sequence[Table]:
    """The static curve, and what disturbs it."""
    step = -(-(len(result.curve) - 1) // (_ROWS - 1))
    way = "rise" if result.polarity > 0 else "fall"
    clipped = "\nThe range is clipped by the converter." if result.clipped else ""
    measures = columns(Point)
    curve = Table(
        "Static curve",
        [measure.title for measure in measures],
        [(f"{p.flex_deg:.0f} deg", [m.cell(p) for m in measures]) for p in result.curve[::step]],
        f"A {result.kind} flex sensor: counts {way} with flex, over {result.counts_span:.0f} "
        f"counts.\nLoop: {100 * result.loop_width_share:.0f} % of the span wide. Creep: "
        f"{result.creep_counts:.0f} counts. Noise: {result.noise_sd_counts:.1f} counts.{clipped}",
    )
    return (curve,)


def sentence(result: SensorResult) -> str:
    """How much of the converter's range the divider uses."""
    used, best = 1e-3 * result.divider_ohm, 1e-3 * result.best_divider_ohm
    return (
        f"A divider of {used:g} kOhm spreads readings over {result.counts_span:.0f} counts, the "
        f"best of E24, {best:g} kOhm, over {result.best_counts_span:.0f}; computed from the "
        "model of the flex sensor."
    )


@style.styled
def figures(outcome: SensorOutcome) -> dict[str, Figure]:
    """Three panels of one sensor."""
    figure, result = style.canvas(style.WIDTH, 8.7), outcome.result()
    curve, held, choice = figure.subplots(3, 1)
    _draw_curve(curve, result.curve, outcome.loop)
    _draw_hold(held, outcome.hold)
    _draw_choice(choice, result, outcome.resistors, outcome.spread)
    return {"sensor": figure}


def _draw_curve(panel: Axes, points: Sequence[Point], loop: Floats) -> None:
    first, second, _ = style.series(3)
    panel.plot(np.degrees(loop[:, 0]), loop[:, 1], color=second, label="loop")
    panel.plot(
        [point.flex_deg for point in points],
        [point.counts for point in points],
        color=first,
        linestyle=(0, (4, 1.5)),
        label="static",
    )
    panel.set(xlabel="flex [deg]", ylabel="reading [counts]", title="Static curve and loop")
    panel.legend()


def _draw_hold(panel: Axes, hold: Floats) -> None:
    panel.plot(hold[:, 0], hold[:, 1], color=style.FAINT, linewidth=0.6, label="with noise")
    panel.plot(hold[:, 0], hold[:, 2], color=style.series(3)[0], label="without")
    panel.set(xlabel="time [s]", ylabel="reading [counts]", title="Bend held from 0 s on")
    panel.legend()


def _draw_choice(panel: Axes, result: SensorResult, resistors: Floats, spread: Floats) -> None:
    panel.plot(1e-3 * resistors, spread, color=style.series(3)[0])
    for ohm, marker, label in (
        (result.divider_ohm, "s", "in use"),
        (result.best_divider_ohm, "D", "best of E24"),
    ):
        panel.plot(
            1e-3 * ohm,
            np.interp(ohm, resistors, spread),
            color=style.INK,
            marker=marker,
            linestyle="",
            label=f"{label}: {1e-3 * ohm:g} kOhm",
        )
    panel.set_xscale("log")
    panel.set(xlabel="fixed resistor [kOhm]", ylabel="spread of readings [counts]", title="Divider")
    panel.set_ylim(0, 1.35 * float(spread.max()))
    panel.legend(loc="upper right")


EXPERIMENT = Experiment.of_folder(
    __name__,
    SensorConfig,
    lambda config, *_: run(config),
    tables,
    sentence,
    result=SensorResult,
    figures=figures,
    captions={
        "sensor": "Readings of one sensor over flex with the loop, a bend that is held, "
        "and the choice of the divider.",
    },
    workers="none",
)
