"""The sensor on its own: static curve, a slow loop, a held bend, and the divider that suits it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from antennate import figures as style
from antennate.antenna import sensor
from antennate.errors import ConfigError
from antennate.params.base import Params, number
from antennate.robots.antenna import SensorParams
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.measures import Measure, Table
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


@dataclass(frozen=True)
class SensorOutcome(Outcome):
    """What the sensor says.

    Attributes:
        flex: Bends of the static curve [rad], shape (n,).
        loop: Bend [rad] and reading without noise [counts] over one loop after one, shape (k, 2).
        hold: Time [s], reading [counts] with noise and without, bend held from 0 on, shape (m, 3).
        resistors: Resistors tried [Ohm], shape (r,), and the `spread` of each [counts].
        best: The best of them [Ohm].
    """

    config: SensorConfig
    flex: Floats
    loop: Floats
    hold: Floats
    resistors: Floats
    spread: Floats
    best: float

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        params = self.config.sensor
        ohms = sensor.resistance(params, sensor.sensed_flex(params, self.flex))
        volts = sensor.divider(params, ohms)
        readings = sensor.counts(params, self.flex)
        return {
            "schema": 1,
            "command": "sensor",
            "seed": self.config.seed,
            "kind": params.kind,
            "polarity": 1 if readings[-1] > readings[0] else -1,
            "curve": [
                {"flex_deg": math.degrees(f), "resistance_ohm": r, "voltage_v": v, "counts": c}
                for f, r, v, c in zip(
                    *(a.tolist() for a in (self.flex, ohms, volts, readings)), strict=True
                )
            ],
            "counts_span": float(abs(readings[-1] - readings[0])),
            "loop_width_share": self._loop_width(),
            "creep_counts": float(abs(self.hold[-1, 2] - self.hold[0, 2])),
            "noise_sd_counts": float(np.std(self.hold[:, 1] - self.hold[:, 2])),
            "divider_ohm": params.divider_resistance,
            "best_divider_ohm": self.best,
            "best_counts_span": float(self.spread.max()),
            "clipped": bool((volts < sensor.transfer_curve(params)[0][0]).any())
            or bool((readings >= sensor.FULL_SCALE).any()),
        }

    def _loop_width(self) -> float:
        """Gap of the loop at half the bend over the span of readings."""
        half = len(self.loop) // 2
        there, back = self.loop[:half], self.loop[half:][::-1]
        middle = self.config.largest_flex / 2
        gap = np.interp(middle, *there.T) - np.interp(middle, *back.T)
        return float(abs(gap) / np.ptp(self.loop[:, 1]))


def run(config: SensorConfig) -> SensorOutcome:
    """Measure the sensor.

    Raises:
        ConfigError: No reading changes over the whole range of bends.
    """
    params = config.sensor
    flex = np.linspace(0.0, config.largest_flex, config.points)
    if np.ptp(sensor.counts(params, flex)) == 0:
        raise ConfigError(
            "sensor: expected readings that change with bending, found "
            f"{sensor.counts(params, flex)[0]:g} counts at every bend; choose another divider"
        )
    resistors = np.array([base * 10.0**d for d in range(2, 7) for base in E24])
    best, spread = sensor.best_divider(params, config.largest_flex, resistors)
    return SensorOutcome(config, flex, _loop(config), _hold(config), resistors, spread, best)


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
CURVE = (
    Measure("resistance_ohm", "R", "kOhm", scale=1e-3),
    Measure("voltage_v", "V", form=".3f"),
    Measure("counts", "counts", form=".0f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The static curve, and what disturbs it."""
    rows = result["curve"]
    step = -(-(len(rows) - 1) // (_ROWS - 1))
    way = "rise" if result["polarity"] > 0 else "fall"
    clipped = "\nThe range is clipped by the converter." if result["clipped"] else ""
    curve = Table(
        "Static curve",
        [measure.title for measure in CURVE],
        [(f"{row['flex_deg']:.0f} deg", [m.cell(row) for m in CURVE]) for row in rows[::step]],
        f"A {result['kind']} flex sensor: counts {way} with flex, over "
        f"{result['counts_span']:.0f} counts.\n"
        f"Loop: {100 * result['loop_width_share']:.0f} % of the span wide. Creep: "
        f"{result['creep_counts']:.0f} counts. Noise: {result['noise_sd_counts']:.1f} counts."
        f"{clipped}",
    )
    return (curve,)


def sentence(result: Mapping[str, Any]) -> str:
    """How much of the converter's range the divider uses."""
    used, best = 1e-3 * result["divider_ohm"], 1e-3 * result["best_divider_ohm"]
    return (
        f"A divider of {used:g} kOhm spreads readings over {result['counts_span']:.0f} counts, the "
        f"best of E24, {best:g} kOhm, over {result['best_counts_span']:.0f}; computed from the "
        "model of the flex sensor."
    )


@style.styled
def figures(outcome: SensorOutcome) -> dict[str, Figure]:
    """Three panels of one sensor."""
    figure, result = style.canvas(style.WIDTH, 8.7), outcome.result()
    curve, held, choice = figure.subplots(3, 1)
    _draw_curve(curve, result, outcome.loop)
    _draw_hold(held, outcome.hold)
    _draw_choice(choice, result, outcome.resistors, outcome.spread)
    return {"sensor": figure}


def _draw_curve(panel: Axes, result: Mapping[str, Any], loop: Floats) -> None:
    first, second, _ = style.series(3)
    rows = result["curve"]
    panel.plot(np.degrees(loop[:, 0]), loop[:, 1], color=second, label="loop")
    panel.plot(
        [row["flex_deg"] for row in rows],
        [row["counts"] for row in rows],
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


def _draw_choice(panel: Axes, result: Mapping[str, Any], resistors: Floats, spread: Floats) -> None:
    panel.plot(1e-3 * resistors, spread, color=style.series(3)[0])
    for key, marker, label in (
        ("divider_ohm", "s", "in use"),
        ("best_divider_ohm", "D", "best of E24"),
    ):
        ohm = result[key]
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
    *(__name__, SensorConfig, lambda config, *_: run(config), tables, sentence),
    figures=figures,
    captions={
        "sensor": "Readings of one sensor over flex with the loop, a bend that is held, "
        "and the choice of the divider.",
    },
    explained="docs/results.md",
    on_workers=False,
)
