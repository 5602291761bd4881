"""One joint moved by small steps: slowly, with little force, and only while somebody is there.

A profile and Goal PWM bound speed and force in position modes alone, so a servo that is set
otherwise gets no torque. It gets a slow profile and a limit of its PWM, and its bus watchdog stops
it when the program dies. Torque is on that joint alone and goes off at the end.
"""

from __future__ import annotations

import contextlib
import math
from typing import NamedTuple

from antennate.hardware.dynamixel import bringup
from antennate.hardware.joints import settings, settings_of
from antennate.hardware.safety import torque
from antennate.hardware.safety.deadlines import JOG_WATCHDOG_COUNTS
from antennate.hardware.setup.person import SetupError
from antennate.hardware.setup.servos import Joint
from antennate.params.hardware import JogParams
from antennate.robots.spec import RobotSpec
from dynamixel_bus import inquiry
from dynamixel_bus.answers import Answer, Refused, Span, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.model import (
    TICKS_A_TURN,
    VELOCITY_UNIT,
    WATCHDOG_UNIT,
    Register,
    angle_at,
    hardware_errors,
    position_at,
)
from dynamixel_bus.models import MODELS_BY_NUMBER
from dynamixel_bus.port import PortError

_LOST = 10
"""Readings in a row that may fail (assumed)."""


class JogState(NamedTuple):
    """What a joint does.

    Attributes:
        angle: Where it is [rad].
        goal: Where it is to be [rad].
        ticks: Where its servo is [ticks].
        load: Load [0.1 %] or current [mA], as the model tells.
    """

    angle: float
    goal: float
    ticks: int
    load: int


class Jog:
    """A joint that has torque from `begin` to `end`.

    Args:
        bus: The bus.
        robot: The robot, for modes, zeros, directions and limits.
        joint: The joint.
        params: How slowly, how strong, how far.
        measured: Whether zero and direction are known; else angles count from where it stands.
    """

    def __init__(
        self, bus: Bus, robot: RobotSpec, joint: Joint, params: JogParams, measured: bool
    ) -> None:
        at = robot.joint_names.index(joint.name)
        self.joint, self._bus, self._params = joint, bus, params
        self._table = MODELS_BY_NUMBER[joint.model]
        self._rules = settings_of(settings(robot), joint.servo)
        self._sign, self._limit = robot.directions[at], robot.limits[at]
        self._zero, self._lost = float(robot.zeros[at]), 0
        self._full, self._measured = 0, measured
        self.stood: int | None = None  # of one that is not measured, when it was first moved
        self._newest = JogState(0.0, 0.0, 0, 0)

    def begin(self) -> None:
        """Torque on where it stands: slow, weak and watched. Call `end` even if this fails."""
        servo, bus = self.joint.servo, self._bus
        if (seen := inquiry.look(bus, servo)) and seen.state != "ok":
            raise SetupError(
                f"expected {self.joint} to answer, found: {inquiry.FOUND[seen.state]}; "
                f"{bringup.CURE[seen.state]}"
            )
        bringup.require_models(bus, {servo: self.joint.model})
        self._require_settings()
        self._full = self._read("pwm_limit")
        torque.arm_watchdogs(bus, [servo], JOG_WATCHDOG_COUNTS)
        torque.limit_speed(bus, {servo: max(1, round(self._params.speed / VELOCITY_UNIT))})
        torque.limit_pwm(bus, {servo: max(1, round(self._params.pwm * self._full))})
        stands = torque.enable(bus, [servo])[servo]
        if not self._measured:
            reach = min(self._params.reach, self._limit)
            self.stood = stands if self.stood is None else self.stood
            self._zero, self._sign, self._limit = float(self.stood), 1, reach
        elif math.isinf(self._limit):  # a leg counts its turns from where it stands
            self._zero += TICKS_A_TURN * round((stands - self._zero) / TICKS_A_TURN)
        angle = self._angle(stands)
        self._newest = JogState(angle, angle, stands, 0)

    def _require_settings(self) -> None:
        """All that a servo needs before it gets torque, as `drive` and `doctor` know it."""
        for name, rule in self._rules.items():
            if not rule.allows(value := self._read(name)):
                raise SetupError(
                    f"expected {name.replace('_', ' ')} {rule} of {self.joint}, found {value}; "
                    f"`antennate setup --only {self.joint.name}` or `antennate doctor --fix` sets "
                    "it"
                )

    def step(self, steps: int) -> None:
        """Set the goal some steps further, within the limit of the joint.

        A joint that stands outside its limit goes inwards, step by step, and no further out.
        """
        before = self._newest.goal
        wanted = before + steps * self._params.step
        goal = min(max(wanted, min(-self._limit, before)), max(self._limit, before))
        ticks = round(position_at(goal, self._zero, self._sign))
        reply = torque.ask_goal(self._bus, self.joint.servo, ticks)
        if not isinstance(reply, Value):
            raise SetupError(
                f"expected {self.joint} to take goal position {ticks}, found {self._reason(reply)}"
            )
        self._newest = self._newest._replace(goal=goal)

    def look(self) -> JogState:
        """What the joint does; call it at least every 0.2 s, or its watchdog stops it."""
        reply = self._bus.read(self.joint.servo, Span(126, 10))
        if not isinstance(reply, Value):
            self._lost += 1
            if self._lost >= _LOST:
                raise SetupError(f"expected an answer of {self.joint}, found none")
            return self._newest
        self._lost = 0
        if reply.alert:
            words = ", ".join(hardware_errors(self._read("hardware_error_status")))
            raise SetupError(
                f"expected {self.joint} without an error, found: {words}; take the load off, then "
                "switch its supply off and on"
            )
        ticks = self._register("present_position").decode(reply.data[6:])
        load = int.from_bytes(reply.data[:2], "little", signed=True)
        self._newest = JogState(self._angle(ticks), self._newest.goal, ticks, load)
        return self._newest

    def end(self) -> list[int]:
        """Torque off, verified, and the servo as it was: ids that did not confirm it.

        A servo that may have torque stays slow and weak.
        """
        left = torque.disable(self._bus, [self.joint.servo])
        if left or not self._full:
            return left
        with contextlib.suppress(PortError, bringup.BringUpError):
            torque.limit_pwm(self._bus, {self.joint.servo: self._full})
            torque.limit_speed(self._bus, {self.joint.servo: 0})
        return left

    def _angle(self, ticks: float) -> float:
        return angle_at(ticks, self._zero, self._sign)

    def _register(self, name: str) -> Register:
        return self._table[name]

    def _read(self, name: str) -> int:
        servo = self.joint.servo
        return bringup.read_register(self._bus, [servo], self._register(name))[servo]

    def _reason(self, reply: Answer) -> str:
        """Why a servo did not take a value, in words."""
        if not isinstance(reply, Refused):
            return "no answer; check its cable and its supply"
        if self._read("bus_watchdog") < 0:
            pause = WATCHDOG_UNIT * JOG_WATCHDOG_COUNTS
            return f"that its watchdog stopped it: nothing came for {pause:g} s; start jog again"
        return f"that it refused ({reply.error.name.lower().replace('_', ' ')})"
