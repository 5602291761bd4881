"""A servo of the twin robot: the physics moves its shaft, and it tells what the physics does.

The actuator of the physics follows an angle, so every mode becomes an angle: a drive becomes one so
far ahead of the shaft that the position loop asks for that drive.
"""

from __future__ import annotations

import math

from antennate.hardware.dynamixel.tables import (
    BAUD_RATES,
    CURRENT_MODE,
    PWM_MODE,
    TABLES,
    VELOCITY_MODE,
)
from antennate.robots.servos import TICKS_A_TURN, ServoParams
from antennate.robots.spec import RobotSpec
from antennate.twin.motion import Motion
from antennate.twin.motor import FULL, RATINGS
from antennate.twin.registers import Servo

_TICK = 2.0 * math.pi / TICKS_A_TURN


class DrivenMotion(Motion):
    """The shaft of a servo that the physics moves.

    Attributes:
        params: Model of the servo in the physics.
        stands: Where a shaft without drive stays [ticks]; None while it is driven.
    """

    params = ServoParams()
    stands: float | None = None

    def move(self, t: float) -> bool:
        """The physics does, and says so in `feel`."""
        return False

    def turn_to(self, ticks: float) -> None:
        """Somebody turns the shaft there [ticks]."""
        super().turn_to(ticks)
        self.stands = None if self.driven else self.shaft.position

    def target(self, t: float, lead: float) -> float:
        """Where the physics pulls the shaft to until t [s], whole ticks of the servo [ticks].

        A shaft without drive is pulled to where it stood when it was stopped or let go: a gear of
        245 to 1 does not let a leg sink.

        Args:
            t: End of the coming period.
            lead: Half of it [s]: drives are right in its middle.
        """
        if not self.driven:
            if self.stands is None:
                self.stands = self.shaft.position
            return self.stands
        self.stands = None
        if self.mode in (PWM_MODE, CURRENT_MODE):
            return self.shaft_at(self._ahead(self._duty(), lead))
        wanted = self.plan.at(t)[0]
        if self.mode == VELOCITY_MODE:
            return self.shaft_at(self._within(wanted, 1.0, lead))
        wanted = float(round(wanted))
        if self.limit < 1.0:
            wanted = self._within(wanted, self.limit, lead)
        return self.shaft_at(wanted)

    def feel(self, ticks: float, speed: float, duty: float) -> None:
        """What the physics did: position [ticks], speed [ticks/s], share of the full drive."""
        shaft = self.shaft
        shaft.position, shaft.speed = ticks, speed
        shaft.duty = shaft.load = 0.0
        if self.driven:
            shaft.duty = duty
            shaft.load = duty - speed * _TICK / self.params.no_load_speed

    def _duty(self) -> float:
        """Share of the full drive that it is told to use."""
        if self.mode == PWM_MODE:
            return self.memory.get("goal_pwm") / FULL
        stall = 1e3 * RATINGS[self.memory.table.model].stall_current
        turning = self.sign * self.shaft.speed * _TICK / self.params.no_load_speed
        duty = self.memory.get("goal_current") / stall + turning
        return max(-self.limit, min(duty, self.limit))

    def _ahead(self, duty: float, lead: float) -> float:
        """The position whose distance asks the position loop for a drive [ticks]."""
        speed = self.sign * self.shaft.speed
        return self.position + speed * lead + duty / (self.params.position_gain * _TICK)

    def _within(self, wanted: float, limit: float, lead: float) -> float:
        """A position, or the nearest one that asks for no more than a drive."""
        least, most = self._ahead(-limit, lead), self._ahead(limit, lead)
        return max(least, min(wanted, most))


class DrivenServo(Servo):
    """A servo whose shaft the physics moves."""

    motion: DrivenMotion

    def turn(self, turns: float) -> None:
        """Let it have counted some turns more, as after a long walk; the joint stays."""
        self._refresh()
        self.motion.add_turns(turns)
        self._show()

    def carry(self, ticks: float) -> None:
        """Let somebody turn the shaft there without torque; whole turns stay as counted."""
        before = self.position
        self.motion.turn_to(ticks)
        self.turn(round((before - self.position) / TICKS_A_TURN))

    def shaft(self, ticks: float, speed: float = 0.0, duty: float = 0.0) -> None:
        """What the physics has done: position [ticks], speed [ticks/s], share of the drive."""
        self._refresh()
        self.motion.feel(ticks, speed, duty)
        self._show()

    def goal(self, t: float | None = None, lead: float = 0.0) -> float:
        """Where it pulls the shaft to [ticks] until t [s], or now; `lead` is half a period [s]."""
        self._refresh()
        return self.motion.target(self._t if t is None else t, lead)

    def feed_watchdog(self, t: float) -> None:
        """An instruction packet was on the bus; all else waits for the next tick."""
        if self._trip_time() < t:
            self.advance(t)
        self._fed = t

    def _make_motion(self, position: float) -> Motion:
        return DrivenMotion(self.memory, position)


def servos_of(robot: RobotSpec) -> list[DrivenServo]:
    """The servos as the robot needs them: of its models, in its operating modes."""
    kinds = [robot.servos.of(group.servo) for _, group, count in robot.groups for _ in range(count)]
    return [
        _servo(servo, kind, robot.modes[servo], robot.baud)
        for servo, kind in zip(robot.ids, kinds, strict=True)
    ]


def factory_new(robot: RobotSpec) -> list[DrivenServo]:
    """The same servos as they come out of their boxes."""
    return [_new(servo, servo.motion.params) for servo in servos_of(robot)]


def _new(servo: DrivenServo, kind: ServoParams) -> DrivenServo:
    made = DrivenServo(servo.table, servo.table["id"].default or 1)
    made.motion.params = kind
    return made


def _servo(servo: int, kind: ServoParams, mode: int, baud: int) -> DrivenServo:
    made = DrivenServo(TABLES[kind.model_number], servo)
    made.motion.params = kind
    made.set("operating_mode", mode)
    made.set("return_delay_time", 0)
    made.set("baud_rate", BAUD_RATES.index(baud))
    made.set("present_input_voltage", round(10 * kind.voltage))
    return made
