"""Supervisor and session together, whatever happens in whatever order: who may write torque."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from servo_rig import servos
from soak_rig import SHORTEST, Source
from torque_writes import GOAL, Written, watch

from antennate.hardware.dynamixel.actuators import DynamixelActuators
from antennate.hardware.esp32.board import Board
from antennate.hardware.joints import Joints
from antennate.hardware.safety.deadlines import ANSWER
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.hardware.safety.supervisor import Outputs
from antennate.params.control import ConditioningParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Contact, JointCommand, Maneuver, State
from dynamixel_bus.answers import Timing
from dynamixel_bus.bus import Bus
from dynamixel_bus.port import PortError
from dynamixel_bus.servo_bus import Fault, ServoBus, Trouble
from dynamixel_bus.simulated_wire import SimulatedWire

PERIOD = 0.01
ROBOT = RobotSpec()
LONGEST_STAND = 2.0
"""As asked for: no longer without the supervisor, and no longer at all."""
MOVES = set(range(100, 120))


class Wire(SimulatedWire):
    """The wire to the servos, which may be gone, and the clock of everything."""

    gone = False

    def sleep_until(self, t: float) -> None:
        self.sleep(max(t - self.now(), 0.0))

    def write(self, data: bytes) -> None:
        if self.gone:
            raise PortError("the wire is gone")
        super().write(data)

    def read(self, most: int, timeout: float) -> bytes:
        if self.gone:
            raise PortError("the wire is gone")
        return super().read(most, timeout)


class Stream:
    """A board that samples every 10 ms of that clock, unless it is silent."""

    def __init__(self, wire: Wire) -> None:
        self._wire, self._source = wire, Source(np.random.default_rng(5))
        self._due, self.silent = 0.0, False

    def read(self, most: int, timeout: float) -> bytes:
        while self._due + SHORTEST <= self._wire.now():
            sample = self._source.sample(self._due, floating=False)
            self._source.came += b"" if self.silent else sample
            self._due += PERIOD
        return self._source.read(most, timeout)

    def write(self, data: bytes) -> None: ...
    def drain(self) -> int:
        return 0


class Mind:
    """A controller in one of several moods; notes when it gave an answer."""

    def __init__(self) -> None:
        self.mood, self.answered, self.n = "well", False, 0
        self.maneuver, self.contact = np.array([0]), np.full((1, 2), int(Contact.FREE))

    def step(self, frame: AntennaFrame) -> JointCommand:
        if self.mood == "raises":
            raise RuntimeError("a bug")
        self.answered, self.n = True, self.n + 1
        unknown = self.mood == "unknown" or not np.isfinite(frame.counts).all()
        self.contact[:] = int(Contact.UNKNOWN if unknown else Contact.FREE)
        self.maneuver[:] = int(Maneuver.HOLD if unknown else Maneuver.FORWARD)
        angle = math.nan if self.mood == "nan" else 0.01 * (self.n % 7)
        shapes = ROBOT.command_shapes().items()
        return JointCommand(**{name: np.full(shape, angle) for name, shape in shapes})


class Robot(RuleBasedStateMachine):
    """Every write is judged when it is made."""

    def __init__(self) -> None:
        super().__init__()
        self.patch = pytest.MonkeyPatch()
        self.seen = watch(self.patch)
        self.twin = ServoBus(servos())
        for servo in self.twin.servos[5:17]:
            servo.set("operating_mode", 4)
        self.wire = Wire(self.twin)
        self.board, self.mind = Stream(self.wire), Mind()
        bus = Bus(self.wire, Timing(latest=ANSWER), clock=self.wire.now)
        self.session = Session(
            board=Board(self.board, 0.05),
            actuators=DynamixelActuators(bus, Joints(ROBOT), self.wire.now),
            clock=self.wire,
            controller=self.mind,
            period=PERIOD,
            quality=SignalQuality(ConditioningParams()),
        )
        self.decided: Outputs | None = None
        self.sent = b""
        self.armed = self.pressed = self.standing = self.decided_before = False
        step = self.session.supervisor.step

        def decide(now: float, inputs: Any) -> Outputs:
            self.judge()  # what was written before this decision belongs to none
            self.decided = step(now, inputs)
            return self.decided

        self.session.supervisor.step = decide  # type: ignore[method-assign]

    def teardown(self) -> None:
        self.patch.undo()

    def judge(self) -> None:
        """Look at what was written since the last look, in the light of the last decision."""
        written, self.seen[:] = list(self.seen), []
        for one in written:
            if one.torque_on or one.address in MOVES:
                self.move(one)
        self.decided = None

    def move(self, one: Written) -> None:
        """A write that moves a servo, or may."""
        out, session = self.decided, self.session
        assert out is not None, one
        assert out.torque, one
        assert out.arming or out.feed_watchdog, "the decision of this tick lets it"
        changed = self.changed(one)
        if out.arming:
            assert self.pressed, "torque by an arm event alone"
            self.armed = True
            return
        assert one.address == GOAL, one
        assert self.armed, one
        assert out.move or not changed, "a goal that is new only if the supervisor lets it move"
        held = session.control.standing or self.standing
        slow = session.control.rate < 1.0 and self.decided_before  # every second tick, no more
        assert self.mind.answered or held or slow, "a goal without a decision of this tick"

    def changed(self, one: Written) -> bool:
        """Whether goals for all servos differ from those of the last such write."""
        if one.address != GOAL:
            return False
        before, self.sent = self.sent, one.data
        return self.sent != before

    def tick(self, asked: bool = True) -> None:
        """One tick of the loop; `asked` is whether the loop reaches the controller."""
        session, begin = self.session, self.wire.now()
        self.decided_before = self.mind.answered or session.control.standing
        self.mind.answered = False
        frame = session.read()
        command = session.control.command
        if asked:
            command = session.control.step(frame)
        before = session.tally.sent
        session.write(command)
        self.judge()
        assert session.outputs is not None
        if session.tally.sent > before:
            assert session.outputs.state <= State.DEGRADED
        self.armed = self.armed and session.actuators.enabled
        self.wire.sleep_until(begin + PERIOD)

    @initialize()
    def begin(self) -> None:
        """It walks."""
        self.walk(20)  # until the board's clock is known
        self.mend(arm=True)
        assert self.session.tally.sent

    @rule(arm=st.sampled_from([True, True, False]))
    def mend(self, arm: bool) -> None:
        """All is well again, and stays so for a while."""
        session = self.session
        session.orders.stop = session.orders.released = False
        self.board.silent = self.wire.gone = False
        self.twin.trouble.pop(7, None)
        self.twin.servos[0].set("present_input_voltage", 120)
        self.mind.mood = "well"
        self.walk(15)
        if arm:
            self.arm(False)

    def walk(self, count: int) -> None:
        for _ in range(count):
            self.tick()

    @rule(again=st.booleans())
    def arm(self, again: bool) -> None:
        """Press, and perhaps keep it pressed."""
        self.pressed = self.session.orders.arm = True
        self.tick()
        self.pressed, self.session.orders.arm = False, again
        self.walk(5)

    @rule(mood=st.sampled_from(["raises", "nan", "unknown"]))
    def think(self, mood: str) -> None:
        """The controller fails once, or is not asked at all; then goes on."""
        self.mind.mood = mood
        self.tick()
        self.tick(asked=False)
        self.mind.mood = "well"
        self.walk(2)

    @rule(stop=st.booleans(), released=st.booleans())
    def order(self, stop: bool, released: bool) -> None:
        self.session.orders.stop, self.session.orders.released = stop, released
        self.walk(3)

    @rule(time=st.sampled_from([0.05, 0.15, 1.5]))
    def pause(self, time: float) -> None:
        self.wire.sleep(time)
        self.walk(2)

    @rule(what=st.sampled_from(["board", "wire", "servo"]), count=st.integers(1, 12))
    def lose(self, what: str, count: int) -> None:
        """One of them is gone from now on."""
        self.board.silent |= what == "board"
        self.wire.gone |= what == "wire"
        if what == "servo":
            self.twin.trouble[7] = Trouble(Fault.SILENT)
        self.walk(count)

    @rule(volts=st.sampled_from([10.5, 10.0, 9.0]))
    def sag(self, volts: float) -> None:
        self.twin.servos[0].set("present_input_voltage", round(10 * volts))
        self.walk(5)

    @rule(time=st.sampled_from([0.03, 0.2, 60.0]))
    def end(self, time: float) -> None:
        """As `drive` ends: the command is held, then the torque goes off."""
        begin, goals = self.wire.now(), self.goals()
        self.standing = True
        self.session.stand(time)
        self.judge()
        self.standing = False
        assert self.wire.now() - begin <= LONGEST_STAND + 0.1
        assert self.goals() == goals
        self.session.release()
        self.judge()
        self.armed = False

    def goals(self) -> list[int]:
        return [servo.get("goal_position") for servo in self.twin.servos]

    @invariant()
    def no_torque_without_arming(self) -> None:
        with_torque = [servo.get("id") for servo in self.twin.servos if servo.torque]
        left_on = set(self.session.actuators.left_on)
        assert self.armed or set(with_torque) <= left_on, with_torque


class LongRobot(Robot):
    """The same, longer."""


Robot.TestCase.settings = settings(max_examples=10, stateful_step_count=8, deadline=None)
LongRobot.TestCase.settings = settings(max_examples=60, stateful_step_count=30, deadline=None)
test_no_torque_without_arming_and_no_goal_without_a_decision = Robot.TestCase
test_no_torque_without_arming_60_times = pytest.mark.slow(LongRobot.TestCase)
