"""A servo of the twin robot: the physics moves its shaft, and it tells what the physics does."""

from __future__ import annotations

from antennate.hardware.dynamixel.tables import BAUD_RATES, TABLES
from antennate.robots.servos import TICKS_A_TURN, ServoParams
from antennate.robots.spec import RobotSpec
from antennate.twin.driven_motion import DrivenMotion, Pull
from antennate.twin.motion import Motion
from antennate.twin.registers import Servo


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

    def goal(self) -> float:
        """Where it pulls the shaft to now [ticks]."""
        return self.pull(self._t, 0.0).goal

    def pull(self, t: float, period: float) -> Pull:
        """How it pulls the shaft in the period [s] that ends at t [s]."""
        self._refresh()
        return self.motion.pull(t, period)

    def feed_watchdog(self, t: float) -> None:
        """An instruction packet was on the bus; all else waits for the next tick."""
        if self._trip_time() < t:
            self.advance(t)
        self._fed = t

    def _make_motion(self, position: float) -> Motion:
        return DrivenMotion(self.memory, position)


def servos_of(robot: RobotSpec) -> list[DrivenServo]:
    """The servos as the robot needs them: of its models, in its operating modes."""
    kinds = [robot.servos.of(name) for name in robot.servo_names]
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
