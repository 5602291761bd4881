"""The simulated robot as two streams of bytes: a bus of servos and an antenna board.

Time is an argument. Servos do not move by themselves: every control period the physics takes their
goals and gives back their positions. Physics begins when the first servo has torque; until then the
robot stands and the board repeats its first reading.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from antennate.errors import SimulationError
from antennate.hardware.esp32 import frame
from antennate.hardware.joints import Joints
from antennate.params.hardware import BatteryParams
from antennate.robots.imu import in_counts
from antennate.robots.spec import RobotSpec
from antennate.sim.sim_robot import SimRobot
from antennate.sim.world import World
from antennate.twin.board import Converter, ImuReadings, TouchStimulus
from antennate.twin.hands import Hands
from antennate.twin.orders import Plugging, Pushes
from antennate.twin.servos import Battery, DrivenServo, Visit, servos_of
from antennate.types import AntennaFrame, Floats
from dynamixel_bus.faults import Noise
from dynamixel_bus.model import POSITION_UNIT
from dynamixel_bus.servo_bus import ServoBus

GREETING_PERIOD = 1.0
"""Time between greetings of the board [s], as firmware/main.py."""
BOARD_SETTINGS = (15, 34, 35)
"""Burst and pins of firmware/config.py."""
IMU_SETTINGS = (21, 22, 0x6A, 1, 2, 3)
"""Pins, address and axes of an inertial sensor, as docs/firmware.md wires it."""
BOOT_TICKS = 50
"""Samples that a starting board does not send: half a second at 100 Hz."""
_STANDING_NOISE = 2.5
"""Standard deviation of the readings of a resting antenna [counts], about that while walking."""
_DEVICE = b"twin\0\0\0\0"
ROUNDING = 1e-9


class TwinRobot:
    """One robot in row 0 of a simulated body, served as bytes.

    When a client begins or an antenna is touched by an order, no servo has torque and the robot has
    walked, it is put back to where it stood first, so that one twin serves many drives.

    Args:
        body: Holds one world.
        robot: Its description: servos, directions, zeros and bus speed.
        period: Control period of the board and the physics [s].
        boot_id: Random number of the board's boot.
        standing_noise: Whether readings are noisy before the physics begins, as real ones are.
        touch: Bends the antennae of the standing robot; no touches by default.
        watch: Told the world after each tick of the physics.
        battery: Numbers of its supply.
        servos: Its servos in the order of its joints, set up for it by default.
        pushes: Joints without torque that somebody turns, as `orders.Pushes` reads them.
        mains: Frequency of a hum on its readings [Hz].

    Attributes:
        converter: Makes the board's codes of readings, and breaks them on demand.
        imu: The same of its inertial sensor, None without one.
        bus: The servos on their wire.
        plugging: Plugs servos in and turns shafts, by orders.
        t: Time up to which everything has happened [s].
        command: Goals of the servos in the last tick of the physics, as angles of the joints.
        touch: Bends the antennae of the standing robot, None for no touches.
        board_silent: The board sends nothing.
        on_return: Called when the robot is carried back to the start, for another drive.
        noise: What the board's wire does to bytes, both ways.
        battery: What feeds the servos.
        hands: What presses and holds the robot while the physics runs.
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
        servos: Sequence[DrivenServo] | None = None,
        pushes: Sequence[str] = (),
        mains: float = 50.0,
    ) -> None:
        self._body = body
        self._watch = watch
        self._joints = Joints(robot)
        self.command = self._joints.command(np.array(robot.zeros, float))
        self._sign: Floats = np.array(robot.directions, float)
        self._stall: Floats = np.array([servo.stall_torque for servo in robot.joint_servos])
        self._bias: Floats = np.zeros(len(robot.joint_names))
        self._bias[: robot.yaw_count] = body.joint_bias(0)
        self._period = period
        self._encoder = frame.SampleEncoder(boot_id, robot.has_imu)
        self._boot_id = boot_id
        self._stream = bytearray()
        self._buffer = bytearray(self._encoder.size)
        self._ticks = self._walked = self._booted = 0
        self.converter = Converter(boot_id, mains)
        self._chance = np.random.default_rng(boot_id) if standing_noise else None
        self._imu_params = robot.imu
        self.imu: ImuReadings | None = None
        if robot.has_imu:
            self.imu = ImuReadings(robot.imu, period, boot_id if standing_noise else None)
        gain = robot.antennae.right_gain
        self.touch = touch or TouchStimulus((), robot.antenna, robot.right_antenna, gain)
        self.hands = Hands(body.world(0))
        self.on_return: Callable[[], None] = lambda: None
        self.t = 0.0
        self.board_silent = False
        self.noise = Noise(seed=0)
        self.battery = Battery(battery or BatteryParams())
        self.servos = list(servos or servos_of(robot))
        self.bus = ServoBus(self.servos, robot.baud)
        self._pushes = Pushes(pushes, robot.joint_names, self._ticks_at)
        self.plugging = Plugging(self.servos, self._pushes)
        self._visit, self._touched = Visit(), False
        self._standing, self._start = True, body.world(0).state()
        self._show(self._shafts())
        self._read()
        self._sample()

    def _read(self) -> None:
        """Let the sensors of the body measure once."""
        self._frame = self._body.read()
        self._counts = self._frame.counts[0]

    @property
    def sample_size(self) -> int:
        """Bytes of a frame with a sample of its board."""
        return self._encoder.size

    @property
    def frame(self) -> AntennaFrame:
        """What the body felt last, at the twin's time, before faults of the board."""
        return replace(self._frame, t=np.array([self.t]))

    @property
    def failure(self) -> SimulationError | None:
        """What ended the physics, if anything did."""
        return self._body.failures.get(0)

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
        """A tick begins: pulls of the servos, and which have a drive, shape (n, 7).

        None before any has torque.
        """
        self._ticks += 1
        self.bus.advance(self._ticks * self._period)
        self.t = max(self.t, self._ticks * self._period)
        self.battery.feed(self.servos, self._ticks * self._period)
        if self._pushes.busy:
            self._push()
        torque = any(servo.torque for servo in self.servos)
        wanted = self._visit.step(self.t, self.servos) or self._touched
        if wanted and not (torque or self._standing):
            self._carry_back()
        self._touched = False
        if self._standing and not torque:
            return None
        self._standing = False
        self.hands.presses = self.touch.presses(self.t, self._visit.begun)
        end = (self._ticks + 1) * self._period
        pulls = [servo.pull(end, self._period) for servo in self.servos]
        driven = [servo.motion.driven for servo in self.servos]
        return np.column_stack([pulls, driven])

    def move(self, pulls: Floats | None) -> Floats | None:
        """The physics of a tick: position, speed and drive of the shafts then, shape (3, n).

        Touches nothing that the bus does, so that another thread may do it meanwhile.
        """
        if pulls is None:
            return None
        goals, gain, push, brake, low, high, driven = pulls.T
        self.command = self._joints.command(goals)
        self._body.write(self.command)
        self._body.world(0).skip_delay(driven == 0.0)  # friction holds, not a goal
        bounds = np.sort(self._sign * np.stack([low, high]), axis=0)
        drives = np.vstack([gain, self._sign * push, brake, bounds])
        self._body.world(0).servo_drives.set(drives)
        self._walked += 1
        self._body.clock.sleep_until(self._walked * self._period)
        self._read()
        self._watch(self._body.world(0))
        return self._shafts()

    def end_tick(self, shafts: Floats | None) -> None:
        """A tick ends: servos learn where their shafts are, and the board sends a sample."""
        if shafts is not None:
            self._show(shafts)
        self._sample()

    @property
    def world(self) -> World:
        """The world that it is in."""
        return self._body.world(0)

    @property
    def counts(self) -> Floats:
        """Readings of the antennae, before faults of wires [counts], shape (2,)."""
        return self._counts

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
        """Let the board fall silent or speak again, or start anew after BOOT_TICKS."""
        if what != "reset":
            self.board_silent = what == "silent"
        else:
            self._boot_id = (self._boot_id * 1_103_515_245 + 12_345) & 0xFFFFFFFF
            self._encoder = frame.SampleEncoder(self._boot_id, self.imu is not None)
            self._booted = self._ticks + BOOT_TICKS

    def order_touch(self, text: str) -> None:
        """Touch an antenna at once; a robot that has walked and has no torque is put back first."""
        self.touch.order(text)
        self._touched = True

    def hold(self, side: int, counts: float) -> None:
        """Hold the reading of antenna 0 (left) or 1 at a value [counts]; NaN releases it."""
        self.converter.held[side] = counts

    @property
    def _used(self) -> bool:
        """A packet has been on the bus."""
        return any(servo.last_fed > 0.0 for servo in self.servos)

    def _ticks_at(self, place: int, angle: float) -> float:
        """Where a shaft is at an angle of its joint [ticks]."""
        return float(self._joints.positions(np.full(len(self.servos), angle))[place])

    def _push(self) -> None:
        """Turn shafts that are pushed; before the physics begins the joints follow at once."""
        moved = self._pushes.apply(self._ticks * self._period, self._used, self.servos)
        for place, ticks in moved:
            self.servos[place].push(ticks)
        if moved and self._standing:
            ticks = np.array([servo.motion.shaft.position for servo in self.servos])
            self._body.world(0).place_drives(self._joints.angles(ticks) + self._bias)

    def _carry_back(self) -> None:
        """Put the robot where the trial began, as a person does between two drives."""
        self._body.put_back(0, self._start)
        self.hands.clear()
        self._standing = True
        for servo, ticks in zip(self.servos, self._positions().tolist(), strict=True):
            servo.carry(ticks)
        self._read()
        self.on_return()

    def _positions(self) -> Floats:
        """Positions of the shafts, about their own zeros [ticks], shape (n,)."""
        return self._joints.positions(self._body.world(0).drives() - self._bias)

    def _shafts(self) -> Floats:
        """Positions [ticks], speeds [ticks/s] and shares of the full drive, shape (3, n)."""
        world = self._body.world(0)
        return np.stack(
            [
                self._positions(),
                self._sign * world.drive_speeds() / POSITION_UNIT,
                self._sign * world.drive_torques() / self._stall,
            ]
        )

    def _show(self, shafts: Floats) -> None:
        """Let the servos know what their shafts do."""
        for servo, done in zip(self.servos, shafts.T.tolist(), strict=True):
            servo.shaft(*done)

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
        now = self._ticks * self._period
        if self._standing:
            noise = noise + np.rint(self.touch.change(now, self._visit.begun))
        left, right = self.converter.codes(now, self._counts, noise)
        flags = _rail(left, frame.FLAG_LEFT_RAIL) | _rail(right, frame.FLAG_RIGHT_RAIL)
        ticks = round(1e6 * since * self._period) & frame.TICK_MASK
        imu = self._inertial()
        misses = 0 if self.imu is None else self.imu.misses
        size = self._encoder.encode_sample_into(
            self._buffer, since, ticks, left, right, flags, 0, imu, misses
        )
        self._stream += self._buffer[:size]

    def _inertial(self) -> tuple[int, ...]:
        """What the board sends of its inertial sensor; nothing without one."""
        if self.imu is None:
            return ()
        felt = self._frame
        counts = in_counts(self._imu_params, felt.angular_velocity, felt.linear_acceleration)[0]
        return self.imu.sample(counts, self._standing)

    def _greet(self) -> None:
        rate = round(1 / self._period)
        imu = () if self.imu is None else IMU_SETTINGS
        settings = frame.config_hash(rate, *BOARD_SETTINGS, imu)
        reset = frame.RESET_HARD if self._booted else frame.RESET_POWER_ON
        self._stream += frame.encode_hello(self._boot_id, reset, settings, _DEVICE, rate)


def _rail(counts: int, flag: int) -> int:
    return flag if counts in (0, frame.FULL_SCALE) else 0
