"""The profile of a servo to its goal, from its registers, and the registers that report it.

A profile is a step, or a rectangle, triangle or trapezoid of speed. Positions in ticks, speeds in
ticks/s. Source: "What is the Profile" in the manuals of all models.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dynamixel_bus.memory import Memory, time_based
from dynamixel_bus.model import (
    ACCELERATION_UNIT,
    CURRENT_POSITION_MODE,
    EXTENDED_MODE,
    POSITION_MODE,
    POSITION_UNIT,
    VELOCITY_MODE,
    VELOCITY_UNIT,
)

POSITION_MODES = (POSITION_MODE, EXTENDED_MODE, CURRENT_POSITION_MODE)
SPEED_UNIT = VELOCITY_UNIT / POSITION_UNIT
"""One count of a velocity [ticks/s]."""
_RATE_UNIT = ACCELERATION_UNIT / POSITION_UNIT
"""One count of an acceleration [ticks/s²]."""
_ARRIVED, _ONGOING, _NOT_FOLLOWING = 0x01, 0x02, 0x08
"""Bits of Moving Status."""
_NEAR, _FAR = 20, 200
"""Distance at which it has arrived, and at which it does not follow [ticks] (assumed)."""
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


class Planner:
    """Plans a profile when torque, mode or goal have changed.

    Args:
        memory: The control table.
    """

    def __init__(self, memory: Memory) -> None:
        self._memory = memory
        self._profile = Profile()
        self._planned: tuple[bool, int, int, int] | None = None

    @property
    def end(self) -> float:
        """When the plan is carried out [s]."""
        return self._profile.end

    def at(self, t: float) -> tuple[float, float]:
        """Where it means to be [ticks] and how fast [ticks/s] at time t [s]."""
        return self._profile.at(t)

    def follow(self, t: float, driven: bool, now: tuple[float, float], base: int) -> bool:
        """Plan anew if anything has changed; whether torque or mode have.

        Args:
            t: The time [s].
            driven: It has torque and was not stopped.
            now: Where it is [ticks] and how fast it turns [ticks/s].
            base: What it adds to the turns of its shaft [ticks].
        """
        mode = self._memory.get("operating_mode")
        in_position = mode in POSITION_MODES
        goal = self._memory.get("goal_position" if in_position else "goal_velocity")
        plan, before = (driven, mode, base, goal), self._planned
        if plan == before:
            return False
        self._planned = plan
        same = before is not None and before[:3] == plan[:3]
        start = self._profile.at(t) if same else now
        if not driven:
            self._profile.step(t, now[0])
        elif in_position:
            self._to_position(t, start, goal)
        elif mode == VELOCITY_MODE:
            self._to_speed(t, start, SPEED_UNIT * goal)
        return not same

    def show(self, t: float, position: float) -> bool:
        """Tell trajectory and Moving Status; whether a profile to a position is going on.

        Args:
            t: The time [s].
            position: Where it is [ticks].
        """
        driven, mode, _, goal = self._planned or (False, 0, 0, 0)
        wanted, speed = self._profile.at(t)
        bits, ongoing = 0, False
        if driven and mode in POSITION_MODES:
            ongoing = self._profile.kind != STEP and t < self._profile.end
            bits = self._profile.kind | _ONGOING * ongoing
            bits |= _NOT_FOLLOWING * (abs(wanted - position) > _FAR)
            bits |= _ARRIVED * (not ongoing and abs(goal - position) <= _NEAR)
        elif not (driven and mode == VELOCITY_MODE):
            wanted, speed = position, 0.0
        self._memory.show("velocity_trajectory", round(speed / SPEED_UNIT))
        self._memory.show("position_trajectory", round(wanted))
        self._memory.show("moving_status", int(bits))
        return ongoing

    def _to_position(self, t: float, start: tuple[float, float], goal: float) -> None:
        """By Profile Velocity and Acceleration: their counts, or times of the whole and a ramp."""
        velocity = self._memory.get("profile_velocity")
        acceleration = self._memory.get("profile_acceleration")
        if not velocity or goal == start[0]:
            self._profile.step(t, goal)
        elif time_based(self._memory):
            whole = 1e-3 * velocity
            ramp = min(1e-3 * acceleration, 0.5 * whole)
            speed = abs(goal - start[0]) / (whole - ramp)
            self._profile.go(t, start, goal, speed, speed / ramp if ramp else math.inf)
        else:
            rate = _RATE_UNIT * acceleration if acceleration else math.inf
            self._profile.go(t, start, goal, SPEED_UNIT * velocity, rate)

    def _to_speed(self, t: float, start: tuple[float, float], speed: float) -> None:
        """By Profile Acceleration alone."""
        acceleration = self._memory.get("profile_acceleration")
        rate = _RATE_UNIT * acceleration if acceleration else math.inf
        if acceleration and time_based(self._memory) and speed != start[1]:
            rate = abs(speed - start[1]) / (1e-3 * acceleration)
        self._profile.speed_up(t, start, speed, rate)
