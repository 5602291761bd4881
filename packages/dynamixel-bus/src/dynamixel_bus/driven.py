"""A virtual servo whose shaft a physics engine moves: what its actuator does, and what it tells."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from dynamixel_bus.memory import Memory
from dynamixel_bus.model import (
    CURRENT_MODE,
    CURRENT_POSITION_MODE,
    FULL_DRIVE,
    POSITION_UNIT,
    PWM_MODE,
    TICKS_A_TURN,
    VELOCITY_MODE,
    VELOCITY_UNIT,
    ServoModel,
)
from dynamixel_bus.motion import Motion, steepest
from dynamixel_bus.motor import CREEP, FRICTION, LOOP
from dynamixel_bus.profile import SPEED_UNIT
from dynamixel_bus.servo import Servo


class Drive(Protocol):
    """What the engine takes for the motor of a servo; a `Rating` is one."""

    @property
    def stall_torque(self) -> float:
        """Torque at standstill [N·m]."""
        ...

    @property
    def no_load_speed(self) -> float:
        """Speed unloaded [rad/s]."""
        ...

    @property
    def armature(self) -> float:
        """Inertia at the output [kg·m²]."""
        ...

    @property
    def position_gain(self) -> float:
        """Share of the full drive per radian of position error [1/rad]."""
        ...


class Pull(NamedTuple):
    """What the actuator of a shaft does for one period.

    Attributes:
        goal: Where it pulls the shaft to [ticks].
        gain: By how much stiffer than with the Position P Gain of a new servo.
        push: Drive besides that of the distance [full drives].
        brake: Drive against the speed [full drives·s/rad].
        low: Least drive [full drives].
        high: Most drive.
    """

    goal: float
    gain: float = 1.0
    push: float = 0.0
    brake: float = 0.0
    low: float = -1.0
    high: float = 1.0

    def within(self, low: float, high: float) -> Pull:
        """The pull within narrower limits; its own limits come first."""
        if low <= self.low and high >= self.high:
            return self
        low, high = (max(self.low, min(bound, self.high)) for bound in (low, high))
        return self._replace(low=low, high=high)

    def reversed(self) -> Pull:
        """The pull on a shaft that turns the other way round; the goal stays."""
        return self._replace(push=-self.push, low=-self.high, high=-self.low)


class DrivenMotion(Motion):
    """The shaft of a servo that the physics moves.

    Attributes:
        params: Motor of the servo in the physics, by default that of its model.
        stands: Where a shaft without drive stays [ticks]; None while it is driven.
    """

    params: Drive
    stands: float | None = None

    def __init__(self, memory: Memory, position: float) -> None:
        super().__init__(memory, position)
        self.params = memory.model.rating
        self._new_gain = memory.model["position_p_gain"].default or 1

    def move(self, t: float) -> bool:
        """The physics does, and says so in `feel`."""
        return False

    def turn_to(self, ticks: float) -> None:
        """Somebody turns the shaft there [ticks]."""
        super().turn_to(ticks)
        self.stands = None if self.driven else self.shaft.position

    def pull(self, t: float, period: float) -> Pull:
        """What the actuator does until t [s], with a goal in whole ticks of the servo.

        A shaft without drive is pulled to where it stood when it was stopped or let go: a gear of
        245 to 1 does not let a leg sink.

        Args:
            t: End of the coming period.
            period: Its length [s].
        """
        wanted = self._wanted(t, period) if self.driven else None
        if wanted is None:
            if self.stands is None:
                self.stands = self.shaft.position
            return Pull(self.stands)
        self.stands = None
        return wanted if self.sign > 0 else wanted.reversed()

    def feel(self, ticks: float, speed: float, duty: float) -> None:
        """What the physics did: position [ticks], speed [ticks/s], share of the full drive."""
        shaft = self.shaft
        shaft.position, shaft.speed = ticks, speed
        shaft.duty = shaft.load = 0.0
        if self.driven:
            shaft.duty = duty
            shaft.load = duty - speed * POSITION_UNIT / self.params.no_load_speed

    def _begin(self) -> None:
        self._loops.total = 0.0

    def _wanted(self, t: float, period: float) -> Pull | None:
        """Pull that the mode asks for, as the servo counts; None if friction holds the shaft."""
        if self.mode == PWM_MODE:
            pull = Pull(self.shaft.position, 0.0, self.memory.get("goal_pwm") / FULL_DRIVE)
        elif self.mode == CURRENT_MODE:
            load = self._current()
            if self._stuck(load, period):
                return None
            turning = abs(self._speed) > CREEP
            against = math.copysign(FRICTION, self._speed if turning else load)
            pull = self._torque(load - against)
        elif self.mode == VELOCITY_MODE:
            pull = self._to_speed(t, period)
        else:
            pull = self._to_position(t, period)
            if self.mode == CURRENT_POSITION_MODE:
                if self._stuck(self._current(), period):
                    return None
                pull = self._with_current(pull, abs(self._current()), period)
        if self.mode != PWM_MODE:
            pull = pull.within(-self.limit, self.limit)
        slope, before = steepest(self.memory, period), self.sign * self.shaft.duty
        return pull.within(before - slope, before + slope) if slope < math.inf else pull

    @property
    def _speed(self) -> float:
        """Speed as the servo counts [ticks/s]."""
        return self.sign * self.shaft.speed

    def _current(self) -> float:
        """Goal Current as a share of the stall current."""
        model = self.memory.model
        stall = model.counts_per_ampere * model.rating.stall_current
        return self.memory.get("goal_current") / stall

    def _stuck(self, load: float, period: float) -> bool:
        """Friction holds the shaft against a load, or stops it within the period."""
        inertia = self.params.armature * abs(self._speed) * POSITION_UNIT
        return abs(load) <= FRICTION and inertia <= FRICTION * self.params.stall_torque * period

    def _torque(self, load: float) -> Pull:
        """A torque [stall torques] at any speed."""
        return Pull(self.shaft.position, 0.0, load, -1.0 / self.params.no_load_speed)

    def _with_current(self, pull: Pull, most: float, period: float) -> Pull:
        """A pull whose torque stays below a share of the stall torque."""
        speed = self._speed
        turning = speed * POSITION_UNIT / self.params.no_load_speed
        away = self.sign * (pull.goal - self.shaft.position) - 0.5 * period * speed
        drive = pull.gain * self.params.position_gain * away * POSITION_UNIT + pull.push
        drive -= pull.brake * speed * POSITION_UNIT
        load = max(-self.limit, min(drive, self.limit)) - turning
        if abs(load) > most:
            return self._torque(math.copysign(most, load))
        return pull.within(turning - most, turning + most)

    def _to_speed(self, t: float, period: float) -> Pull:
        """By the loop of velocity mode."""
        loops, speed = self._loops, self.plan.at(t)[1]
        loops.velocity((speed - self._speed) / SPEED_UNIT, period, self.limit)
        gain = loops.vp / 128 / FULL_DRIVE
        push = gain * speed / SPEED_UNIT + loops.total / FULL_DRIVE
        return Pull(self.shaft.position, 0.0, push, gain / VELOCITY_UNIT)

    def _to_position(self, t: float, period: float) -> Pull:
        """By the loop of the position modes."""
        loops, (wanted, speed) = self._loops, self.plan.at(t)
        goal = float(round(wanted))
        if not (loops.total or loops.i or loops.d or loops.first or loops.second):
            return Pull(self.shaft_at(goal), loops.p / self._new_gain)
        ahead = self.ahead(loops, t, speed)
        if loops.i:
            loops.position(goal - self.position, speed - self._speed, period, self.limit, ahead)
        brake = loops.d / 16 * LOOP / FULL_DRIVE
        push = (loops.total + ahead) / FULL_DRIVE + brake * speed
        return Pull(self.shaft_at(goal), loops.p / self._new_gain, push, brake / POSITION_UNIT)


class DrivenServo(Servo):
    """A servo whose shaft the physics moves.

    Args:
        model: Its model.
        servo: Its id.
        position: Where its shaft is [ticks].
        drive: Its motor in the physics, by default that of its model.
    """

    motion: DrivenMotion

    def __init__(
        self, model: ServoModel, servo: int, position: float = 2048.0, drive: Drive | None = None
    ) -> None:
        super().__init__(model, servo, position)
        self.motion.params = drive or model.rating

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
