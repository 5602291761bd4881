"""Whether joints do as they are told, judged by the model of their servos.

A joint may be behind its goal for a good reason: something holds it, and its servo pushes with all
it has. So a joint that is behind is asked for its drive, Present PWM. The position loop gives
gain · error up to the bound of the drive; a servo that gives much less is not driven, or tells a
wrong position. A joint that is behind and does not move at all for a gait cycle is stuck, or its
gear, its encoder or a wire of its motor is broken, which no register tells. Only time in which its
goal moves counts: while a robot stands, no wave frees a joint that leans on something.

The goal of a joint is within its limit. Beyond it by more than the error of full drive, a joint is
overpowered, as a body that pushes in a corner may be for a moment. It is named if its servo gives
less than that, too, or if it stays there for a gait cycle in which its goal moves.

The goal is as near as any of the last few ticks was: goals take time to arrive and may get lost.
Nothing here reads a clock or a port.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping

import numpy as np

from antennate.hardware.actuators import JointFaults, Margins
from antennate.hardware.joints import Joints
from antennate.hardware.safety.deadlines import WATCHDOG
from antennate.params.safety import FollowingParams
from antennate.types import Floats
from dynamixel_bus.model import FULL_DRIVE, POSITION_UNIT

_GOALS = 3
"""Last ticks whose nearest goal counts: one on its way, one lost (assumed)."""
_READINGS = 3
"""Readings of the drive in a row that must all be wrong: chance spoils single ones (assumed)."""


class Following:
    """Watches all joints of one robot from the moment that torque comes on.

    Args:
        joints: The joints.
        params: When a joint does not follow.
        well: Whether the servo of an id has its torque, its watchdog and its mode, asked before its
            joint is named as one that does not follow.

    Attributes:
        faults: What is wrong.
        margins: How near it came to that, over all arm events.
        suspects: Places in the robot's order of joints whose drive should be read.
    """

    def __init__(
        self,
        joints: Joints,
        params: FollowingParams,
        well: Callable[[int], bool] = lambda servo: True,
    ) -> None:
        robot = joints.robot
        kinds = robot.joint_servos
        self._ids, self._names, self._well = joints.ids, robot.joint_names, well
        self._share, self._shortfall = params.share, params.shortfall
        self._time, self._stuck_time = params.time, params.stuck_time
        self._still = params.still / POSITION_UNIT
        self._gain: Floats = np.array([kind.position_gain * POSITION_UNIT for kind in kinds])
        fastest = np.array([kind.no_load_speed for kind in kinds])
        self._fastest: Floats = params.overspeed * fastest / POSITION_UNIT
        zero, reach = np.array(robot.zeros, float), np.array(robot.limits) / POSITION_UNIT
        self._low: Floats = zero - reach
        self._high: Floats = zero + reach
        self.margins = Margins()
        self.disarm()

    def arm(self, stood: Floats, pwm: Mapping[int, int]) -> None:
        """Torque came on with the joints there [ticks] and these bounds of the drive by id."""
        self.disarm()
        self._most: Floats = np.array([pwm[servo] for servo in self._ids]) / FULL_DRIVE
        self._least = np.minimum(self._low, stood), np.maximum(self._high, stood)

    def disarm(self) -> None:
        """Torque is off, or about to come on anew."""
        self.faults = JointFaults()
        self.rest()

    def rest(self) -> None:
        """Joints may be anywhere from now on, as while legs forget their turns."""
        count = len(self._ids)
        self.suspects: list[int] = []
        self._goals: deque[Floats] = deque(maxlen=_GOALS)
        self._wrong = [0] * count
        self._since: Floats = np.full(count, math.nan)
        self._place: Floats = np.full(count, math.nan)
        self._rested: Floats = np.full(count, math.nan)
        self._within: Floats = np.full(count, math.nan)
        self._beyond: Floats = np.zeros(count)
        self._before: Floats = np.full(count, math.nan)
        self._read: Floats = np.full(count, math.nan)
        self._judged = math.nan

    def step(self, span: tuple[float, float], goals: Floats, positions: Floats) -> None:
        """Judge the positions of a tick.

        Args:
            span: Times before and after they were read [s].
            goals: The goals last sent [ticks], shape (n,).
            positions: Of the joints [ticks], NaN for one that did not answer, shape (n,).
        """
        self._wait(span[1], goals)
        self._goals.append(goals.copy())
        self._leap(span, positions)
        self.leave(span[1], positions)
        near, far = np.min(self._goals, axis=0), np.max(self._goals, axis=0)
        with np.errstate(invalid="ignore"):
            behind = np.clip(positions, near, far) - positions
            due = self._due(behind) > self._shortfall
            moved = ~(abs(positions - self._place) <= self._still)
        known = np.isfinite(positions)
        self._place = np.where(known & (moved | ~due), positions, self._place)
        self._rested = np.where(known & (moved | ~due), span[1], self._rested)
        self.suspects = np.flatnonzero(due).tolist()
        for at in np.flatnonzero(known & ~due).tolist():
            self._wrong[at] = 0
        self._stick(span[1], behind)

    def drive(self, now: float, at: int, pwm: int, position: int) -> None:
        """Judge the drive of a joint that is behind.

        Args:
            now: When it was read [s].
            at: Place of the joint in the robot's order.
            pwm: Present PWM [counts].
            position: Its position then [ticks].
        """
        goals = [goal[at] for goal in self._goals]
        behind = min(max(position, min(goals)), max(goals)) - position
        due = min(self._share * float(self._gain[at]) * abs(behind), float(self._most[at]))
        given = math.copysign(1.0, behind) * pwm / FULL_DRIVE
        if due - given <= self._shortfall:
            self._wrong[at] = 0
            return
        if not self._wrong[at]:
            self._since[at] = now
        self._wrong[at] += 1
        share = (now - float(self._since[at])) / self._time
        self.margins.behind = max(self.margins.behind, share)
        if share >= 1.0 and self._wrong[at] >= _READINGS and self._follows_not(at):
            self._tell(
                self.faults.behind,
                at,
                f"is {self._radians(behind)} behind and drives with {given:.0%} of {due:.0%}",
            )
            if self._beyond[at] * self._gain[at] >= 1.0:
                self._tell_beyond(at)

    def _wait(self, now: float, goals: Floats) -> None:
        """Times of joints whose goal stands still since the last tick do not go on."""
        if self._goals:
            pause = np.where(goals == self._goals[-1], now - self._judged, 0.0)
            self._rested += pause
            self._within += pause
        self._judged = now

    def _due(self, behind: Floats) -> Floats:
        """Least drive for these errors [full drives], shape (n,)."""
        return np.minimum(self._share * self._gain * abs(behind), self._most)

    def _stick(self, now: float, behind: Floats) -> None:
        for at in self.suspects:
            stuck = (now - float(self._rested[at])) / self._stuck_time
            self.margins.stuck = max(self.margins.stuck, stuck)
            if stuck >= 1.0 and self._follows_not(at):
                away, time = self._radians(behind[at]), f"{self._stuck_time:g} s"
                text = f"is {away} behind and has not moved for {time} of moving goals"
                self._tell(self.faults.behind, at, text)

    def _follows_not(self, at: int) -> bool:
        """Whether the servo of a joint is named already, or has all that it needs to follow."""
        servo = self._ids[at]
        return servo in self.faults.behind or self._well(servo)

    def leave(self, now: float, positions: Floats) -> None:
        """Whether joints are beyond their limits by more than the error of full drive."""
        low, high = self._least
        with np.errstate(invalid="ignore"):
            self._beyond = np.maximum(low - positions, positions - high)
            inside = self._beyond * self._gain < 1.0
        self._within = np.where(inside | np.isnan(self._within), now, self._within)
        for at in np.flatnonzero(np.isfinite(positions) & ~inside).tolist():
            share = (now - float(self._within[at])) / self._stuck_time
            self.margins.outside = max(self.margins.outside, share)
            if share >= 1.0:
                self._tell_beyond(at)

    def _tell_beyond(self, at: int) -> None:
        text = f"is {self._radians(self._beyond[at])} beyond its limit"
        self._tell(self.faults.outside, at, text)

    def _leap(self, span: tuple[float, float], positions: Floats) -> None:
        began, ended = span
        way = abs(positions - self._before)
        time = ended - self._read + WATCHDOG  # its packet may be as old
        leap = way / (self._fastest * time)
        self.margins.speed = max(self.margins.speed, float(np.nanmax(leap, initial=0.0)))
        for at in np.flatnonzero(leap >= 1.0).tolist():
            text = f"has gone {self._radians(way[at])} in {1e3 * (ended - self._read[at]):.0f} ms"
            self._tell(self.faults.leaps, at, text)
        known = np.isfinite(positions)
        self._before = np.where(known, positions, self._before)
        self._read = np.where(known, began, self._read)

    def _tell(self, faults: dict[int, str], at: int, text: str) -> None:
        faults.setdefault(self._ids[at], f"{self._names[at]} {text}")

    @staticmethod
    def _radians(ticks: float) -> str:
        return f"{abs(ticks) * POSITION_UNIT:.2f} rad"
