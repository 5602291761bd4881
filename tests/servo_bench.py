"""One servo on a wire, spoken to in bytes at the addresses of the manual, in invented time."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from manual_tables import Page

from antennate.dxl import packets
from antennate.dxl.driven import DrivenServo
from antennate.dxl.models import MODELS_BY_NUMBER
from antennate.dxl.packets import Status
from antennate.dxl.parser import Parser
from antennate.dxl.servo import Servo
from antennate.dxl.servo_bus import ServoBus
from antennate.robots.servos import ServoParams, XL330Params
from antennate.sim.places import ServoDrives

NONE, RESULT_FAIL, INSTRUCTION, CRC, RANGE, LENGTH, LIMIT, ACCESS = range(8)
"""Numbers of the errors of a status packet, from the manual."""

DRIVEN: dict[int, ServoParams] = {1080: ServoParams(), 1200: XL330Params()}
"""Models that the walking twin has, by number."""
_TICK = 2 * math.pi / 4096
_PERIOD = 0.001


class Bench:
    """A new servo of a page, at position 2048 unless said otherwise.

    Attributes:
        servo: The servo.
        bus: Its wire.
        t: The time [s].
        divisor: What Position P Gain is divided by, in PWM a pulse.
    """

    divisor = 128.0

    def __init__(self, page: Page, position: float = 2048.0, others: int = 0) -> None:
        self.page = page
        table = MODELS_BY_NUMBER[page.model]
        self.servo = self.make(1, position)
        more = [Servo(table, 2 + n, position) for n in range(others)]
        self.bus = self.wire([self.servo, *more])
        self.t = 0.0

    def make(self, servo: int, position: float) -> Servo:
        """The servo that is looked at."""
        return Servo(MODELS_BY_NUMBER[self.page.model], servo, position)

    def wire(self, servos: list[Servo]) -> ServoBus:
        """What the servos are on."""
        return ServoBus(servos, baud=1_000_000)

    def ask(self, instruction: int, params: bytes = b"", to: int = 1) -> list[Status]:
        """What comes back within 50 ms."""
        self.bus.receive(self.t, packets.encode(to, instruction, params))
        self.wait(0.05)
        found = Parser().feed(self.bus.transmit(self.t))
        return [status for packet in found if (status := packets.as_status(packet))]

    def put(self, name: str, value: int, to: int = 1) -> int:
        """Write a register; the number of the error, 0 for none."""
        row = self.page.row(name)
        data = value.to_bytes(row.size, "little", signed=value < 0)
        (said,) = self.ask(3, row.address.to_bytes(2, "little") + data, to)
        return said.error

    def get(self, name: str, to: int = 1) -> int:
        """Read a register."""
        row = self.page.row(name)
        (said,) = self.ask(2, row.address.to_bytes(2, "little") + bytes([row.size, 0]), to)
        assert said.error == NONE
        assert len(said.data) == row.size
        return int.from_bytes(said.data, "little", signed=row.signed)

    def wait(self, seconds: float) -> None:
        """Let time pass, in steps of a millisecond as a busy bus would."""
        end = self.t + seconds
        while self.t < end - 1e-9:
            self.t = min(self.t + 0.001, end)
            self.bus.advance(self.t)

    def mode(self, mode: int) -> None:
        """Change the operating mode and bring torque."""
        assert self.put("torque_enable", 0) == NONE
        assert self.put("operating_mode", mode) == NONE
        assert self.put("torque_enable", 1) == NONE


class DrivenBus(ServoBus):
    """A wire whose first servo turns one hinge of the physics, as those of the walking twin do.

    The hinge has the inertia of the servo and its torque-speed line; nothing else hangs on it.
    """

    def __init__(self, servos: list[Servo], kind: ServoParams) -> None:
        super().__init__(servos, baud=1_000_000)
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        spec.option.timestep = 0.5 * _PERIOD
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        body = spec.worldbody.add_body(name="horn", mass=1e-9, inertia=[1e-12] * 3)
        hinge = mujoco.mjtJoint.mjJNT_HINGE
        body.add_joint(name="horn", type=hinge, damping=kind.damping, armature=kind.armature)
        actuator = spec.add_actuator(name="horn", target="horn")
        actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
        actuator.set_to_position(kp=kind.stiffness)
        actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.forcerange = [-kind.stall_torque, kind.stall_torque]
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.stall = kind.stall_torque
        self.drives = ServoDrives(self.model, ["horn"], np.array([kind.stall_torque]))
        self.periods = 0

    def advance(self, t: float) -> None:
        """Let the physics turn the horn as well."""
        while (end := (self.periods + 1) * _PERIOD) <= t + 1e-9:
            super().advance(self.periods * _PERIOD)
            self.turn(end)
            self.periods += 1
        super().advance(t)

    def turn(self, end: float) -> None:
        """One period of the physics."""
        servo, data = self.servos[0], self.data
        assert isinstance(servo, DrivenServo)
        if abs(servo.motion.shaft.position * _TICK - data.qpos[0]) > 1e-9:  # somebody turned it
            data.qpos[0] = servo.motion.shaft.position * _TICK
        goal, *drive = servo.pull(end, _PERIOD)
        self.drives.set(np.array(drive)[:, None])
        data.ctrl[0] = goal * _TICK
        mujoco.mj_step(self.model, data, 2)
        done = data.qpos[0] / _TICK, data.qvel[0] / _TICK, data.actuator_force[0] / self.stall
        servo.shaft(*(float(value) for value in done))


class DrivenBench(Bench):
    """The same for a servo of the walking twin."""

    def make(self, servo: int, position: float) -> Servo:
        """A servo whose shaft the physics moves."""
        made = DrivenServo(MODELS_BY_NUMBER[self.page.model], servo, position)
        made.motion.params = DRIVEN[self.page.model]
        self.divisor = made.motion.params.gain_divisor
        return made

    def wire(self, servos: list[Servo]) -> ServoBus:
        """With the physics behind it."""
        return DrivenBus(servos, DRIVEN[self.page.model])
