"""Hidden robots that `antennate fit` has to find: `python docs/science/identified.py FOLDER`.

Ten robots are drawn from a seed. Each goes through the protocol `identify` on the twin's plant in
virtual time, with the noise of its sensors, and leaves a log; `fit` gets the log and the default
robot. FOLDER/identified.csv has a row for each parameter of each robot.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from antennate.control.protocol import Protocol, Step, lead, targets
from antennate.params.control import ControlParams
from antennate.params.scene import VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter
from antennate.types import Floats
from antennate_lab.fit.simulated import PHYSICS, command, world_of
from dynamixel_bus.model import POSITION_UNIT

CONTROL = ControlParams()
_NOISY = VariationParams(joint_bias=0.0, slip_log_sd=0.0)
_NEITHER = (math.nan, math.nan)


def record(robot: RobotSpec, protocol: Protocol, path: Path, seed: int) -> None:
    """Write the log of a robot that goes through a protocol.

    Args:
        robot: The robot as it is.
        protocol: Made for it.
        path: The log, new.
        seed: Of the noise of its sensors.
    """
    header = Header(
        controller="protocol",
        params=CONTROL,
        robot=RobotSpec(imu=robot.imu),
        protocol=protocol.model_dump(mode="json"),
    )
    rng = np.random.default_rng(seed)
    with LogWriter(path, header) as log:
        for tick in _ticks(robot, protocol, rng):
            log.write(tick)


def _ticks(robot: RobotSpec, protocol: Protocol, rng: np.random.Generator) -> Iterator[Tick]:
    """Ticks of the whole protocol; hanging steps and those on the floor in a world each."""
    period, number = CONTROL.period, 0
    for hanging in (True, False):
        steps = [step for step in protocol.steps if (step.place == "hanging") == hanging]
        sim = SimRobot(1, robot, period, PHYSICS.timestep)
        chance = Disturbance(rng, _NOISY, robot, period)
        sim.load(0, world_of(robot, hanging), chance)
        for at, (angles, events) in enumerate(_courses(steps, robot), 1):
            frame, number = sim.read(), number + 1
            sim.write(command(robot, angles))
            sim.sleep_until(at * period)
            yield Tick(
                number=number,
                t=(number - 1) * period,
                now=(number - 1) * period,
                counts=(float(frame.counts[0, 0]), float(frame.counts[0, 1])),
                reading=(float(frame.counts[0, 0]), float(frame.counts[0, 1])),
                level=_NEITHER,
                contact=(2, 2),
                maneuver=4,
                phase=math.nan,
                angles=tuple(angles.tolist()),
                state="OK",
                sent=number,
                positions=tuple(
                    (np.rint(frame.positions[0] / POSITION_UNIT) * POSITION_UNIT).tolist()
                ),
                angular_velocity=tuple(frame.angular_velocity[0].tolist()),
                linear_acceleration=tuple(frame.linear_acceleration[0].tolist()),
                events=events,
            )


def _courses(steps: list[Step], robot: RobotSpec) -> Iterator[tuple[Floats, tuple[str, ...]]]:
    """Joint targets of each tick, and what begins or ends with it."""
    last, after = np.zeros(len(robot.joint_names)), ()
    for step in steps:
        wanted = targets(step, robot, CONTROL)
        for angles in lead(last, wanted[0], robot, CONTROL.period, 1.0):
            yield angles, after
            last, after = angles, ()
        turns = np.rint((last - wanted[0]) / (2.0 * math.pi)) * 2.0 * math.pi
        begin = (f"begin {step.called}",)
        for angles in wanted + turns * np.isinf(robot.limits):
            yield angles, begin
            last, begin = angles, ()
        after = (f"end {step.called}",)
    yield last, after
