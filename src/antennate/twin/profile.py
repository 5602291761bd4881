"""The path that a servo plans to its goal: a step, or a rectangle, triangle or trapezoid of speed.

Positions in ticks, speeds in ticks/s. Source: "What is the Profile" in the manuals of all models.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

STEP, RECTANGULAR, TRIANGULAR, TRAPEZOIDAL = 0x00, 0x10, 0x20, 0x30
"""Kinds, as they stand in Moving Status."""


@dataclass(frozen=True, slots=True)
class _Phase:
    """A time of constant acceleration, until `end` [s]."""

    end: float
    start: float
    position: float
    speed: float
    acceleration: float

    def at(self, t: float) -> tuple[float, float]:
        dt = t - self.start
        moved = self.speed * dt + 0.5 * self.acceleration * dt * dt
        return self.position + moved, self.speed + self.acceleration * dt


class Profile:
    """Where a servo means to be at a time.

    Attributes:
        kind: One of the kinds above.
        end: When the plan is carried out [s].
    """

    def __init__(self) -> None:
        self.kind = STEP
        self.end = -math.inf
        self._phases: list[_Phase] = []
        self._last = _Phase(math.inf, 0.0, 0.0, 0.0, 0.0)

    def at(self, t: float) -> tuple[float, float]:
        """Position [ticks] and speed [ticks/s] at time t [s], which is not before the plan."""
        for phase in self._phases:
            if t < phase.end:
                return phase.at(t)
        return self._last.at(max(t, self._last.start))

    def step(self, t: float, position: float) -> None:
        """Be at a position at once."""
        self.kind, self.end, self._phases = STEP, t, []
        self._last = _Phase(math.inf, t, position, 0.0, 0.0)

    def go(
        self, t: float, start: tuple[float, float], goal: float, fastest: float, rate: float
    ) -> None:
        """Go to a goal and stop there.

        Args:
            t: Now [s].
            start: Position [ticks] and speed [ticks/s] from which it begins.
            goal: Where it ends [ticks].
            fastest: Largest speed [ticks/s].
            rate: Acceleration [ticks/s²], inf for none.
        """
        self._phases = []
        if math.isinf(rate):
            self.kind = RECTANGULAR
            away = goal - start[0]
            self._add(t, abs(away) / fastest, (start[0], math.copysign(fastest, away)), 0.0)
        else:
            self._trapezoid(t, start, goal, fastest, rate)
        self.end = self._phases[-1].end if self._phases else t
        self._last = _Phase(math.inf, self.end, goal, 0.0, 0.0)

    def speed_up(self, t: float, start: tuple[float, float], speed: float, rate: float) -> None:
        """Reach a speed [ticks/s] and keep it; an acceleration [ticks/s²] of inf is a step."""
        self.kind = STEP if math.isinf(rate) else TRAPEZOIDAL
        self._phases = []
        change = speed - start[1]
        if math.isfinite(rate):
            self._add(t, abs(change) / rate, start, math.copysign(rate, change))
        self.end = self._phases[-1].end if self._phases else t
        position = self._phases[-1].at(self.end)[0] if self._phases else start[0]
        self._last = _Phase(math.inf, self.end, position, speed, 0.0)

    def _trapezoid(
        self, t: float, start: tuple[float, float], goal: float, fastest: float, rate: float
    ) -> None:
        """Speed up or down to a cruise, cruise, slow down; the speed has no jumps."""
        position, speed = start
        stop = position + speed * abs(speed) / (2.0 * rate)
        sign = 1.0 if goal >= stop else -1.0
        first, away = sign * speed, sign * (goal - position)
        peak = math.sqrt(max(rate * away + 0.5 * first * first, 0.0))
        cruise = min(peak, fastest)
        self.kind = TRAPEZOIDAL if peak > fastest else TRIANGULAR
        change = math.copysign(rate, cruise - first)
        changing = abs(cruise - first) / rate
        path = 0.5 * (first + cruise) * changing + 0.5 * cruise * cruise / rate
        cruising = max(away - path, 0.0) / cruise if cruise else 0.0
        for length, acceleration in ((changing, change), (cruising, 0.0), (cruise / rate, -rate)):
            start = self._add(t, length, start, sign * acceleration)
            t += length

    def _add(
        self, t: float, length: float, start: tuple[float, float], acceleration: float
    ) -> tuple[float, float]:
        phase = _Phase(t + length, t, start[0], start[1], acceleration)
        if length > 0.0:
            self._phases.append(phase)
        return phase.at(t + length)
