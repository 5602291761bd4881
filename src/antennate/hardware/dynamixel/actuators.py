"""DYNAMIXEL servos as the actuators of a robot: angles [rad] to goals [ticks], and torque."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from antennate.dxl.bus import Bus
from antennate.errors import AntennateError
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.following import Following
from antennate.hardware.dynamixel.leg_turns import LegTurns
from antennate.hardware.dynamixel.monitor import ServoMonitor
from antennate.hardware.joints import Joints
from antennate.hardware.safety import torque
from antennate.hardware.safety.deadlines import READ_ALL
from antennate.params.safety import FollowingParams
from antennate.types import Floats, JointCommand


class DynamixelActuators:
    """All servos of one robot on one bus, as `Actuators`; for one thread.

    Any packet feeds the watchdogs of the servos: nothing is sent but by the calls below.
    """

    def __init__(
        self,
        bus: Bus,
        joints: Joints,
        clock: Callable[[], float],
        following: FollowingParams | None = None,
    ) -> None:
        self.bus, self.joints = bus, joints
        self.tally, self.robot = bus.tally, joints.robot
        self.state = ServoMonitor(bus, joints.ids, clock, modes=self.robot.modes)
        self.turns = LegTurns(bus, joints)
        self.following = Following(joints, following or FollowingParams(), self.state.well)
        self.left_on: list[int] = []
        self._now = clock
        self._goals: Floats | None = None

    @property
    def enabled(self) -> bool:
        """Whether torque was given and not taken."""
        return self._goals is not None

    @property
    def resting(self) -> bool:
        """Whether the robot has to stand still, as while a leg forgets its turns."""
        return self.turns.standing

    def check(self, command: JointCommand) -> JointCommand:
        """A copy of a command that can be sent; CommandError if it cannot."""
        command = self.joints.plain(command)
        self.joints.ticks(command)
        return command

    def enable(self, command: JointCommand) -> None:
        """Torque on where everything stands, for all servos or for none.

        Legs count their turns from where they stand, so that `command` is near.

        Raises:
            BringUpError: A servo is not fit, or did not take it.
            PortError: The bus is gone.
        """
        try:
            self._goals = self._enable(command)
        except AntennateError:
            self.disable()
            raise
        self.left_on = []
        self.state.arm(True)

    def _enable(self, command: JointCommand) -> Floats:
        """Where everything stands [ticks]."""
        bus, ids = self.bus, self.joints.ids
        self.turns.reset()
        self.following.disarm()
        bringup.require_models(bus, self.joints.models)
        bringup.require_modes(bus, self.robot.modes)
        torque.arm_watchdogs(bus, ids)
        torque.limit_speed(bus, self.joints.profiles)
        limits = torque.allow_full_pwm(bus, ids)
        stood = torque.hold_here(bus, ids)
        self.joints.align(np.array([stood[servo] for servo in ids], float), command)
        present = torque.enable(bus, ids)
        place = np.array([present[servo] for servo in ids], float)
        self.following.arm(place, limits)
        return place

    def disable(self, again: bool = False) -> list[int]:
        """Torque off, group by group, verified: ids that did not confirm it.

        Raises:
            PortError: Only with `again`: the bus is gone.
        """
        if again:
            self.left_on = torque.disable(self.bus, self.left_on, 1, READ_ALL)
            return list(self.left_on)
        self._goals = None
        self.turns.reset()
        self.following.rest()
        self.state.arm(False)
        self.left_on = []
        for group in self.joints.in_order_of_release:
            try:
                self.left_on += torque.disable(self.bus, group)
            except Exception as error:  # noqa: BLE001 the next group has its turn whatever happens
                self.left_on += group
                self.state.tracebacks.keep(self._now(), error)
        return list(self.left_on)

    def command(self, command: JointCommand | None, time: float = math.inf) -> int:
        """Send goals a time [s] nearer to a command, or as they are; joints too slow for it.

        Raises:
            CommandError: The command cannot be sent; nothing is.
            PortError: The bus is gone.
        """
        goals, slow = self._goals, 0
        if command is not None:
            wanted: Floats = self.joints.ticks(command).astype(float)
            if goals is not None and math.isfinite(time):
                slow, reach = self.away(command, time), self.joints.reach(time)
                wanted = goals + np.clip(wanted - goals, -reach, reach)
            goals = wanted
        if goals is None:
            return 0
        pairs = zip(self.joints.ids, np.rint(goals).astype(int).tolist(), strict=True)
        torque.send_goals(self.bus, dict(pairs))
        if self._goals is not None:
            self._goals = goals
        return slow

    def away(self, command: JointCommand, time: float) -> int:
        """How many joints a time [s] is too short for, on their way to a command.

        Raises:
            CommandError: The command cannot be sent.
        """
        if self._goals is None:
            return 0
        way = abs(self.joints.ticks(command) - self._goals)
        return int((way > self.joints.reach(time)).sum())

    def maintain(self, may_begin: bool) -> None:
        """Let legs that have turned far forget their turns, a step a tick.

        Raises:
            BringUpError: A leg did not do its part; it has no torque then.
            PortError: The bus is gone.
        """
        if self._goals is None:
            return
        if may_begin:
            self.turns.begin(self._goals)
        self.turns.step(self._goals, self.state.positions, may_begin)

    def look(self) -> None:
        """Read all positions, and a little more in turn; judge whether joints follow."""
        state, ids, began = self.state, self.joints.ids, self._now()
        state.loose = self.turns.loose
        state.step(tuple(ids[at] for at in self.following.suspects))
        ticks = np.array([state.positions.get(servo, math.nan) for servo in ids])
        state.angles = tuple(self.joints.angles(ticks).tolist())
        if self._goals is not None:
            idle = {*state.watchdogs, *state.disarmed, *state.modes}  # why they do not follow
            unknown = np.array([state.missed[servo] > 0 or servo in idle for servo in ids])
            self._judge((began, state.read_at), np.where(unknown, math.nan, ticks))

    def _judge(self, span: tuple[float, float], ticks: Floats) -> None:
        """Whether joints follow, unless they stand for legs that forget their turns."""
        state, following = self.state, self.following
        if self._goals is None or self.turns.standing:
            following.rest()
            return
        following.step(span, self._goals, ticks)
        if state.drive is not None:
            servo, pwm, position = state.drive
            following.drive(self._now(), self.joints.ids.index(servo), pwm, position)
        state.joints, state.margins = following.faults, following.margins
