"""What experiments with one antenna on the bench share: readings of its sensor, and films."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate.antenna import sensor as flex_sensor
from antennate.params.control import ConditioningParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim.bench import Bench
from antennate.types import Floats, Ints

if TYPE_CHECKING:
    from antennate.telemetry.film import Film

_LAST = 0.05
"""Time over which force is averaged and contact is held [s] (assumed)."""


def recorded(sensor: SensorParams, flex: Floats, noise: Floats) -> Floats:
    """Readings [counts] of flex sensors that remember, for their flex over time [rad].

    Args:
        sensor: The chain; its rate is that of the rows.
        flex: Shape (n,) or (n, B).
        noise: Added before rounding [counts], same shape.
    """
    chain = flex_sensor.SensorChain(sensor, flex.shape[1:], 1.0 / sensor.rate)
    readings = [chain.step(f, n) for f, n in zip(flex, noise, strict=True)]
    return np.array(readings).reshape(flex.shape)


def mean_since(first: Ints, values: Floats) -> Floats:
    """Mean along the last axis (n,) from the index `first` (n,) of each to itself, same shape."""
    total = np.cumsum(np.pad(values, [(0, 0)] * (values.ndim - 1) + [(1, 0)]), axis=-1)
    end = np.arange(1, values.shape[-1] + 1)
    return (total[..., end] - total[..., first]) / (end - first)


def running_mean(values: Floats, length: int) -> Floats:
    """Mean of the last values along the last axis, same shape; fewer where there are fewer."""
    return mean_since(np.maximum(np.arange(1, values.shape[-1] + 1) - length, 0), values)


def averaged(conditioning: ConditioningParams, values: Floats, rate: float) -> Floats:
    """Running mean over the last T_avg of one record, shape (n,), at `rate` [Hz].

    While the window fills it is the mean of what there is.
    """
    return running_mean(values, max(1, round(conditioning.averaging_time * rate)))


def flex_of(sensor: SensorParams, counts: Floats) -> Floats:
    """Size of the flex [rad] that gives these readings without noise, same shape, never below 0.

    The reading does not tell the side of the bend: its sign has to be known from elsewhere.
    """
    volts, readings = flex_sensor.transfer_curve(sensor)
    voltage = np.interp(counts, readings, volts)
    odds = sensor.supply / voltage - 1.0  # upper half of the divider over the lower one
    resistance = sensor.divider_resistance * odds ** (
        1 if sensor.fixed_resistor == "ground" else -1
    )
    return np.maximum((resistance / sensor.flat_resistance - 1.0) / sensor.bend_gain, 0.0)


def between(grid: Floats, table: Floats, at: Floats) -> Floats:
    """Values between the rows of a table, straight from row to row.

    Args:
        grid: What each row stands for, rising, shape (r,).
        table: Shape (r, n).
        at: Where to look in each column, within the grid, shape (n,).
    """
    below = np.clip(np.searchsorted(grid, at, "right") - 1, 0, len(grid) - 2)
    share = (at - grid[below]) / (grid[below + 1] - grid[below])
    column = np.arange(len(at))
    return (1.0 - share) * table[below, column] + share * table[below + 1, column]


class BenchRecorder:
    """Watches a bench, and makes its film.

    A contact that lasts is not on in every physics step. So a picture shows the mean force of what
    was seen in the last 50 ms, and contact if there was any.

    Args:
        antenna: The antenna of the bench.
        speed: How many times faster than real time the film is.
    """

    def __init__(self, antenna: AntennaSpec, speed: float = 1.0) -> None:
        from antennate.telemetry.film import FilmRecorder  # slow to import

        self._antenna, self._recorder = antenna, FilmRecorder(speed)
        self._model: Any = None
        self._start = 0.0
        self._forces: deque[tuple[float, float, bool]] = deque()

    def watch(self, bench: Bench) -> None:
        """Offer a moment; the film begins with the first."""
        if self._model is None:
            self._model, self._start = bench.model, bench.t
        t = bench.t - self._start
        self._forces.append((t, math.hypot(*bench.contact_force()), bench.touching()))
        while self._forces[0][0] < t - _LAST:
            self._forces.popleft()
        if not self._recorder.due(t):
            return
        self._recorder.take(
            t,
            bench.data.qpos,
            bench.joints().mean(axis=0),
            flex=[math.degrees(bench.flex())],
            force=[float(np.mean([force for _, force, _ in self._forces]))],
            touching=int(any(touching for *_, touching in self._forces)),
        )

    def film(self, title: str, obstacle: str | None, form: str = ".0f") -> Film:
        """The film: flex, and force and contact if there is an obstacle.

        Args:
            title: What it shows.
            obstacle: What the antenna touches, None for nothing.
            form: Format of the flex [deg].

        Raises:
            BadInputError: Nothing was seen.
        """
        from antennate.telemetry import film

        if not len(self._recorder):
            raise film.nothing(title)
        traces = [film.trace("flex [deg]", self._recorder.values("flex"), form)]
        bands = []
        if obstacle is not None:
            traces.append(film.trace("force [N]", self._recorder.values("force")))
            touching = np.array(self._recorder.values("touching"))[:, np.newaxis]
            bands = film.contact_bands(touching, (obstacle,))
        shot = film.bench_shot(self._antenna)
        return self._recorder.film(title, self._model, shot, traces, bands)


def bench_films(
    conditions: Callable[[Any], Iterable[str]],
    trial: Callable[..., str],
    obstacle: str | None,
    speed: float = 1.0,
    form: str = ".0f",
) -> Callable[[Any, int], Mapping[str, Callable[[], Film]]]:
    """The `films` of an experiment on the bench: of each condition a trial, run once more.

    Args:
        conditions: conditions(config): their names.
        trial: trial(config, condition, number, watch): runs one; the title of its film.
        obstacle: What the antenna touches, None for nothing.
        speed: Speed of the film over that of the antenna.
        form: Format of the flex [deg].
    """

    def record(config: Any, condition: str, number: int) -> Film:
        recorder = BenchRecorder(config.antenna, speed)
        return recorder.film(trial(config, condition, number, recorder.watch), obstacle, form)

    return lambda config, number: {
        condition: partial(record, config, condition, number) for condition in conditions(config)
    }
