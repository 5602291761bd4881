"""Films of one antenna on the bench: what their experiments share."""

from __future__ import annotations

import math
from collections import deque
from typing import Any

import numpy as np

from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Bench
from antennate.telemetry import film
from antennate.telemetry.film import Film, FilmRecorder

_LAST = 0.05
"""Time over which force is averaged and contact is held [s] (assumed)."""


class BenchRecorder:
    """Watches a bench, and makes its film.

    A contact that lasts is not on in every physics step. So a picture shows the mean force of what
    was seen in the last 50 ms, and contact if there was any.

    Args:
        antenna: The antenna of the bench.
        speed: How many times faster than real time the film is.
    """

    def __init__(self, antenna: AntennaSpec, speed: float = 1.0) -> None:
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
