"""How a servo turns its shaft and counts it: from registers to drive, and back to registers."""

from __future__ import annotations

import math

from dynamixel_bus.memory import Memory
from dynamixel_bus.model import (
    CURRENT_MODE,
    CURRENT_POSITION_MODE,
    FULL_DRIVE,
    POSITION_MODE,
    PWM_MODE,
    REVERSED,
    TICKS_A_TURN,
    VELOCITY_MODE,
)
from dynamixel_bus.motor import FRICTION, LOOP, STEP, Loops, Motor, Shaft
from dynamixel_bus.profile import POSITION_MODES, SPEED_UNIT, Planner

_MOST_OFFSET = 1_024
"""Largest homing offset that acts in position mode, from the manuals [ticks]."""
_STILL = 1.0
"""A slower shaft stands [ticks/s]: it needs a second for a tick."""


def steepest(memory: Memory, time: float) -> float:
    """By how much PWM Slope lets the drive change in a time [s]; infinite without that register."""
    if "pwm_slope" not in memory.model.registers:
        return math.inf
    volts = 0.1 * memory.get("present_input_voltage")
    return 1.977 * memory.get("pwm_slope") * time / volts if volts else math.inf


class Motion:
    """The shaft of a servo, counted by its encoder; what moves it is up to a subclass.

    Args:
        memory: The control table.
        position: Where the shaft is [ticks].

    Attributes:
        shaft: The shaft.
        plan: What it means to do.
        stopped: A bus watchdog has stopped it.
        frozen: Position that it tells whatever the shaft does [ticks], None to tell the true one.
        misread: By how much it tells a wrong one [ticks]. Its own loops know the true one.
    """

    def __init__(self, memory: Memory, position: float) -> None:
        self.memory = memory
        self.shaft = self._make_shaft(position)
        self.plan = Planner(memory)
        self._loops = Loops()
        self.stopped = False
        self.frozen: int | None = None
        self.misread = 0
        self.sign = 1
        self.mode, self.torque, self.limit = POSITION_MODE, False, 1.0
        self._base = self._homing = 0
        self._version = self._settings = -1
        self._t = 0.0

    @property
    def position(self) -> float:
        """Where the shaft is, as the servo counts [ticks]."""
        return self.counted(self.shaft.position)

    @property
    def driven(self) -> bool:
        """Whether the servo has torque and was not stopped."""
        return self.torque and not self.stopped

    def counted(self, ticks: float) -> float:
        """What the servo counts where its shaft is [ticks]: reversed, turns, homing offset."""
        return self.sign * ticks + self._base + self._homing

    def shaft_at(self, counted: float) -> float:
        """Where the shaft is if the servo counts this [ticks]."""
        return self.sign * (counted - self._base - self._homing)

    def place(self, position: float) -> None:
        """Somebody turns the shaft to where the servo counts this [ticks]."""
        self.turn_to(self.shaft_at(position))

    def turn_to(self, ticks: float) -> None:
        """Somebody turns the shaft there [ticks]."""
        self.shaft.position = ticks
        self.shaft.rest()
        self.memory.version += 1

    def rebase(self) -> None:
        """Count from within one turn, as the absolute encoder does."""
        self._base = -TICKS_A_TURN * math.floor(self.sign * self.shaft.position / TICKS_A_TURN)
        self.memory.version += 1

    def add_turns(self, turns: float) -> None:
        """Count some turns more; the shaft stays."""
        self._base += round(turns * TICKS_A_TURN)
        self.memory.version += 1

    def refresh(self, t: float) -> bool:
        """Take note of registers that have changed by time t [s]; whether any but goals have."""
        if self._version == self.memory.version:
            return False
        self._version = self.memory.version
        self._changed(t)
        if self._settings == self.memory.settings:
            return False
        self._settings = self.memory.settings
        self._loops.read(self.memory)
        return True

    def _changed(self, t: float) -> None:
        """Registers have changed by time t [s]."""
        get = self.memory.get
        sign = -1 if get("drive_mode") & REVERSED else 1
        if sign != self.sign:
            self.sign = sign
            self._base = -TICKS_A_TURN * math.floor(sign * self.shaft.position / TICKS_A_TURN)
        self.mode, self.torque = get("operating_mode"), get("torque_enable") == 1
        offset = get("homing_offset")
        self._homing = 0 if self.mode == POSITION_MODE and abs(offset) > _MOST_OFFSET else offset
        self.limit = abs(get("goal_pwm")) / FULL_DRIVE
        now = (self.position, self.sign * self.shaft.speed)
        if self.plan.follow(t, self.driven, now, self._base):
            self._begin()

    def move(self, t: float) -> bool:
        """Let the shaft turn until t [s]; whether there may be something to tell."""
        raise NotImplementedError

    def show(self, t: float) -> None:
        """Tell what happens in the registers that can only be read."""
        show, position, shaft = self.memory.show, self.position, self.shaft
        speed = self.sign * shaft.speed / SPEED_UNIT
        show("present_velocity", round(speed))
        told = round(position) if self.frozen is None else self.frozen
        show("present_position", told + self.misread)
        show("present_pwm", round(FULL_DRIVE * self.sign * shaft.duty))
        load = max(-1.0, min(self.sign * shaft.load, 1.0))
        model = self.memory.model
        if "present_current" in model.registers:
            show(
                "present_current",
                round(model.counts_per_ampere * load * model.rating.stall_current),
            )
        else:
            show("present_load", round(1e3 * load))
        ongoing = self.plan.show(t, position)
        show("moving", int(ongoing or abs(speed) > self.memory.get("moving_threshold")))

    def ahead(self, loops: Loops, t: float, speed: float) -> float:
        """PWM by the feedforward gains at time t [s] and a speed of the profile [ticks/s]."""
        if not (loops.first or loops.second):
            return 0.0
        return loops.ahead(speed, (self.plan.at(t + LOOP)[1] - speed) / LOOP)

    def _make_shaft(self, position: float) -> Shaft:
        return Shaft(position)

    def _begin(self) -> None:
        """Torque or mode have changed."""


class MotorMotion(Motion):
    """The shaft of a servo that stands alone: its own motor turns it.

    Attributes:
        resting: It stands and nothing will move it, which costs no time.
    """

    shaft: Motor

    def __init__(self, memory: Memory, position: float) -> None:
        self.resting = False
        super().__init__(memory, position)

    def move(self, t: float) -> bool:
        """Let the motor turn the shaft until t [s]."""
        if self.resting:
            self._t = t
            return False
        self._settle()
        if self.resting:
            self._t = t
            return True
        motor = self.shaft
        supply = 0.1 * self.memory.get("present_input_voltage") / motor.rating.voltage
        while (left := t - self._t) > 1e-9:
            dt = min(left, STEP)
            self._t += dt
            if not self.torque:
                motor.free(dt)
            else:
                motor.drive(self._sloped(self._duty(dt, supply), dt), dt, supply)
        self._t = t
        self._settle()
        return True

    def _make_shaft(self, position: float) -> Shaft:
        return Motor(position, self.memory.model.rating)

    def _changed(self, t: float) -> None:
        super()._changed(t)
        self.resting = False

    def _begin(self) -> None:
        self._loops.total = 0.0

    def _duty(self, dt: float, supply: float) -> float:
        """Share of the supply that the motor gets now."""
        motor, sign, get = self.shaft, self.sign, self.memory.get
        if self.stopped:
            return 0.0
        if self.mode == PWM_MODE:
            return sign * get("goal_pwm") / FULL_DRIVE
        if self.mode == CURRENT_MODE:
            load = (
                sign
                * get("goal_current")
                / self.memory.model.counts_per_ampere
                / motor.rating.stall_current
            )
            duty = motor.needed(motor.after_friction(load), supply)
            return max(-self.limit, min(duty, self.limit))
        wanted, speed = self.plan.at(self._t)
        behind = speed - sign * motor.speed
        if self.mode == VELOCITY_MODE:
            return sign * self._loops.velocity(behind / SPEED_UNIT, dt, self.limit)
        ahead = self.ahead(self._loops, self._t, speed)
        duty = sign * self._loops.position(wanted - self.position, behind, dt, self.limit, ahead)
        if self.mode == CURRENT_POSITION_MODE:
            most = (
                abs(get("goal_current"))
                / self.memory.model.counts_per_ampere
                / motor.rating.stall_current
            )
            if most <= FRICTION:
                duty = motor.needed(motor.after_friction(0.0), supply)
                return max(-self.limit, min(duty, self.limit))
            duty = max(motor.needed(-most, supply), min(duty, motor.needed(most, supply)))
        return duty

    def _sloped(self, duty: float, dt: float) -> float:
        """The drive changes no faster than PWM Slope says, where there is one."""
        most, before = steepest(self.memory, dt), self.shaft.duty
        return max(before - most, min(duty, before + most))

    def _settle(self) -> None:
        """A shaft that has come to rest stays there."""
        if abs(self.shaft.speed) > _STILL:
            return
        if self.driven:
            if self._t < self.plan.end:
                return
            wanted, speed = self.plan.at(self._t)
            if self.mode in POSITION_MODES:
                away = wanted - self.position
                if abs(away) > 0.5 or self._loops.i:
                    return
                self.shaft.position += self.sign * away
            elif self.mode == VELOCITY_MODE:
                if speed or abs(self._loops.total) > 1.0:
                    return
            elif self.memory.get("goal_pwm" if self.mode == PWM_MODE else "goal_current"):
                return
        self.shaft.rest()
        self._loops.total = 0.0
        self.resting = True
