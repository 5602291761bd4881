"""The simulated robot behind real bytes: a bus of servos and the stream of an antenna board.

Time is an argument. Servos do not move by themselves: every control period the physics takes their
goals and gives back their positions. Physics begins when the first servo has torque; until then the
robot stands and the board repeats its first reading.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from antennate.errors import SimulationError
from antennate.hardware.dynamixel.packets import StatusError
from antennate.hardware.dynamixel.tables import (
    BAUD_RATES,
    TABLES,
)
from antennate.hardware.esp32 import frame
from antennate.hardware.joints import Joints
from antennate.params.twin import BatteryParams
from antennate.robots.servos import TICKS_A_TURN, ServoParams
from antennate.robots.spec import RobotSpec
from antennate.sim.sim_robot import SimRobot
from antennate.sim.world import World
from antennate.twin.battery import Battery
from antennate.twin.bus import ServoBus
from antennate.twin.noise import Noise
from antennate.twin.registers import Servo
from antennate.twin.touch import TouchStimulus
from antennate.twin.visit import Visit
from antennate.types import Floats

GREETING_PERIOD = 1.0
"""Time between greetings of the board [s], as firmware/main.py."""
BOARD_SETTINGS = (15, 34, 35)
"""Burst and pins of firmware/config.py."""
BOOT_TICKS = 50
"""Samples that a starting board does not send: half a second at 100 Hz."""
_STANDING_NOISE = 2.5
"""Standard deviation of the readings of a resting antenna [counts], about that while walking."""
_DEVICE = b"twin\0\0\0\0"
ROUNDING = 1e-9
_REVERSED = 1
"""Bit of Drive Mode."""


class DrivenServo(Servo):
    """A servo whose shaft the physics moves."""

    _stood: float | None = None
    _ahead = 0.0
    """Ticks that it counts more than the shaft has turned."""

    def turn(self, turns: float) -> None:
        """Let it have counted some turns more, as after a long walk.

        The joint stays where it is.
        """
        self._ahead += turns * TICKS_A_TURN
        self.place(self.position + turns * TICKS_A_TURN)

    def shaft(self, ticks: float) -> None:
        """Where the physics has turned the shaft [ticks]."""
        self.place(self._mirrored(ticks) + self._ahead)

    def carry(self, ticks: float) -> None:
        """Let somebody turn the shaft there without torque; whole turns stay as counted."""
        before, self._stood = self.position, None
        self.shaft(ticks)
        self.turn(round((before - self.position) / TICKS_A_TURN))

    def clear_turns(self) -> StatusError:
        """Forget whole turns; the shaft stays."""
        before = self.position
        error = super().clear_turns()
        self._ahead += self.position - before
        self._stood = None
        return error

    def goal(self) -> float:
        """Where it pulls the shaft to [ticks]; where that stood when it was stopped or let go.

        A gear of 245 to 1 does not let a leg sink.
        """
        if self.torque and not self._stopped:
            self._stood = None
            return self._mirrored(self.get("goal_position") - self._ahead)
        if self._stood is None:
            self._stood = self._mirrored(self.position - self._ahead)
        return self._stood

    def _mirrored(self, ticks: float) -> float:
        """From the shaft to what it counts, and back: Drive Mode may reverse it."""
        return TICKS_A_TURN - ticks if self.get("drive_mode") & _REVERSED else ticks

    def feed_watchdog(self, t: float) -> None:
        """An instruction packet was on the bus; all else waits for the next tick."""
        if self._trip_time() < t:
            self.advance(t)
        self._fed = t

    def _speed(self) -> float:
        return 0.0


class TwinRobot:
    """One robot in row 0 of a simulated body, served as bytes.

    When a client begins, no servo has torque and the robot has walked, it is put back to where it
    stood first, so that one twin serves many drives.

    Args:
        body: Holds one world.
        robot: Its description: servos, directions, zeros and bus speed.
        period: Control period of the board and the physics [s].
        boot_id: Random number of the board's boot.
        standing_noise: Whether readings are noisy before the physics begins, as real ones are.
        touch: Bends the antennae of the standing robot, None for no touches.
        watch: Told the world after each tick of the physics.
        battery: Numbers of its supply.

    Attributes:
        bus: The servos on their wire.
        t: Time up to which everything has happened [s].
        touch: Bends the antennae of the standing robot, None for no touches.
        board_silent: The board sends nothing.
        on_return: Called when the robot is carried back to the start, for another drive.
        noise: What the board's wire does to bytes, both ways.
        battery: What feeds the servos.
    """

    def __init__(
        self,
        body: SimRobot,
        robot: RobotSpec,
        period: float,
        boot_id: int,
        standing_noise: bool = False,
        touch: TouchStimulus | None = None,
        watch: Callable[[World], None] = lambda world: None,
        battery: BatteryParams | None = None,
    ) -> None:
        self._body = body
        self._watch = watch
        self._joints = Joints(robot)
        self._period = period
        self._encoder = frame.SampleEncoder(boot_id)
        self._boot_id = boot_id
        self._stream = bytearray()
        self._buffer = bytearray(frame.SAMPLE_FRAME_SIZE)
        self._ticks = self._walked = self._booted = 0
        self._wires = ["", ""]
        self._floating = np.random.default_rng(boot_id)
        self._held = [math.nan, math.nan]
        self._chance = np.random.default_rng(boot_id) if standing_noise else None
        self.touch = touch
        self.on_return: Callable[[], None] = lambda: None
        self.t = 0.0
        self.board_silent = False
        self.noise = Noise(seed=0)
        self.battery = Battery(battery or BatteryParams())
        self.servos = _servos(robot)
        self.bus = ServoBus(self.servos, robot.baud)
        self._visit = Visit()
        self._standing, self._start = True, body.world(0).state()
        self._show(self._shafts())
        self._counts = body.read().counts[0]
        self._sample()

    @property
    def failure(self) -> SimulationError | None:
        """What ended the physics, if anything did."""
        return self._body.failure(0)

    @property
    def stood(self) -> int:
        """Ticks before the physics began, or so far."""
        return self._ticks - self._walked

    def advance(self, t: float) -> None:
        """Let everything happen until t."""
        while self.due <= t + ROUNDING:
            self.end_tick(self.move(self.begin_tick()))
        self.t = max(self.t, t)

    @property
    def due(self) -> float:
        """When the next tick of the physics and the board begins [s]."""
        return (self._ticks + 1) * self._period

    def begin_tick(self) -> Floats | None:
        """A tick begins: where the servos pull to [ticks], None before any of them has torque."""
        self._ticks += 1
        self.bus.advance(self._ticks * self._period)
        self.t = max(self.t, self._ticks * self._period)
        self.battery.feed(self.servos, self._ticks * self._period)
        torque = any(servo.torque for servo in self.servos)
        if self._visit.step(self.t, self.servos) and not (torque or self._standing):
            self._carry_back()
        if self._standing and not torque:
            return None
        self._standing = False
        return np.array([servo.goal() for servo in self.servos])

    def move(self, goals: Floats | None) -> Floats | None:
        """The physics of a tick: where the shafts are then [ticks].

        Touches nothing that the bus does, so that another thread may do it meanwhile.
        """
        if goals is None:
            return None
        self._body.write(self._joints.command(goals))
        self._walked += 1
        self._body.clock.sleep_until(self._walked * self._period)
        self._counts = self._body.read().counts[0]
        self._watch(self._body.world(0))
        return self._shafts()

    def end_tick(self, shafts: Floats | None) -> None:
        """A tick ends: servos learn where their shafts are, and the board sends a sample."""
        if shafts is not None:
            self._show(shafts)
        self._sample()

    def next_time(self) -> float:
        """When something happens next without anybody asking [s]."""
        due = self.bus.next_time()
        return self.due if due is None else min(due, self.due)

    def take(self) -> bytes:
        """What the board has sent since the last call."""
        data, self._stream = bytes(self._stream), bytearray()
        return self.noise(data)

    def receive(self, data: bytes) -> None:
        """Let the board take bytes from the host: it greets if it is asked to."""
        asked = frame.encode_request() in self.noise(data)
        if asked and not self.board_silent and self._ticks >= self._booted:
            self._greet()

    def break_board(self, what: str) -> None:
        """Let the board fall silent, start anew after BOOT_TICKS, or break an antenna's wire.

        An open wire leaves the converter's pin unconnected: it reads anything. A short reads 0.
        """
        if what == "silent":
            self.board_silent = True
        elif what == "reset":
            self._boot_id = (self._boot_id * 1_103_515_245 + 12_345) & 0xFFFFFFFF
            self._encoder = frame.SampleEncoder(self._boot_id)
            self._booted = self._ticks + BOOT_TICKS
        else:
            kind, side = what.split("_")
            self._wires[side == "right"] = kind

    def hold(self, side: int, counts: float) -> None:
        """Hold the reading of antenna 0 (left) or 1 at a value [counts]; NaN releases it."""
        self._held[side] = counts

    def _carry_back(self) -> None:
        """To where the trial began, as a person does between two drives."""
        self._body.put_back(0, self._start)
        self._standing = True
        for servo, ticks in zip(self.servos, self._shafts().tolist(), strict=True):
            servo.carry(ticks)
        self._counts = self._body.read().counts[0]
        self.on_return()

    def _shafts(self) -> Floats:
        return self._joints.positions(self._body.world(0).drives())

    def _show(self, shafts: Floats) -> None:
        """Let the servos know where their shafts are [ticks]."""
        for servo, ticks in zip(self.servos, shafts.tolist(), strict=True):
            servo.shaft(ticks)

    def _sample(self) -> None:
        """One sample of the board, and a greeting now and then."""
        since = self._ticks - self._booted
        if self.board_silent or since < 0:
            return
        if since % round(GREETING_PERIOD / self._period) == 0:
            self._greet()
        noise = np.zeros(2)
        if self._chance is not None and self._standing:
            noise = np.rint(self._chance.normal(0.0, _STANDING_NOISE, 2))
        if self.touch is not None and self._standing:
            now = self._ticks * self._period
            noise = noise + np.rint(self.touch.change(now, self._visit.begun))
        read = np.where(np.isnan(self._held), self._counts, self._held)
        left, right = (
            self._converted(counts, wire)
            for counts, wire in zip(read + noise, self._wires, strict=True)
        )
        flags = _rail(left, frame.FLAG_LEFT_RAIL) | _rail(right, frame.FLAG_RIGHT_RAIL)
        ticks = round(1e6 * since * self._period) & frame.TICK_MASK
        size = self._encoder.encode_sample_into(self._buffer, since, ticks, left, right, flags, 0)
        self._stream += self._buffer[:size]

    def _converted(self, counts: float, wire: str) -> int:
        """What the converter gives for a reading behind a wire that may be broken."""
        if wire == "open":
            return int(self._floating.integers(frame.FULL_SCALE + 1))
        shorted = wire == "short" or math.isnan(counts)
        return 0 if shorted else min(max(int(counts), 0), frame.FULL_SCALE)

    def _greet(self) -> None:
        rate = round(1 / self._period)
        settings = frame.config_hash(rate, *BOARD_SETTINGS)
        reset = frame.RESET_HARD if self._booted else frame.RESET_POWER_ON
        self._stream += frame.encode_hello(self._boot_id, reset, settings, _DEVICE, rate)


def _rail(counts: int, flag: int) -> int:
    return flag if counts in (0, frame.FULL_SCALE) else 0


def _servos(robot: RobotSpec) -> list[DrivenServo]:
    """The servos as the robot needs them: of its models, in its operating modes."""
    kinds = [robot.servos.of(group.servo) for _, group, count in robot.groups for _ in range(count)]
    return [
        _servo(servo, kind, robot.modes[servo], robot.baud)
        for servo, kind in zip(robot.ids, kinds, strict=True)
    ]


def _servo(servo: int, kind: ServoParams, mode: int, baud: int) -> DrivenServo:
    made = DrivenServo(TABLES[kind.model_number], servo)
    made.set("operating_mode", mode)
    made.set("return_delay_time", 0)
    made.set("baud_rate", BAUD_RATES.index(baud))
    made.set("present_input_voltage", round(10 * kind.voltage))
    return made
