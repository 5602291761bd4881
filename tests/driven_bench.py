"""One servo of the walking twin on a wire, whose shaft the physics turns."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from servo_bench import Bench

from antennate.robots.servos import ServoParams, XL330Params
from antennate.sim.places import ServoDrives
from dynamixel_bus.driven import DrivenServo
from dynamixel_bus.models import MODELS_BY_NUMBER
from dynamixel_bus.servo import Servo
from dynamixel_bus.servo_bus import ServoBus

DRIVEN: dict[int, ServoParams] = {1080: ServoParams(), 1200: XL330Params()}
"""Models that the walking twin has, by number."""
_TICK = 2 * math.pi / 4096
_PERIOD = 0.001


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
