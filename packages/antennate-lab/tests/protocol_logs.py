"""Logs of a protocol whose measurements a test gives."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from antennate.control.protocol import Protocol, Step, targets
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter
from antennate.types import Floats

CONTROL = ControlParams()
Measured = Callable[[Step, Floats], Floats]


def sweeps(robot: RobotSpec, *joints: str, seconds: float = 2.0) -> Protocol:
    """A protocol that sweeps some joints in the air."""
    steps = tuple(Step(place="hanging", joint=joint, seconds=seconds) for joint in joints)
    return Protocol(steps=steps).made_for(robot, CONTROL)


def write(
    path: Path,
    robot: RobotSpec,
    protocol: Protocol,
    measured: Measured = lambda step, goals: goals,
    ticks: int | None = None,
    loop: float = 1.0,
    board: float = 1.0,
) -> Path:
    """Write a log.

    Args:
        path: The log.
        robot: What its header says.
        protocol: Made for it.
        measured: Angles of joints, of the step and its commands, shape (n, joints).
        ticks: The log ends after so many.
        loop, board: Pace of the clocks of the loop and of the antenna board.
    """
    header = Header(
        controller="protocol",
        params=CONTROL,
        robot=robot,
        protocol=protocol.model_dump(mode="json"),
    )
    number = 0
    with LogWriter(path, header, least_free=0.0) as log:
        for step in protocol.steps:
            goals = targets(step, robot, CONTROL)
            events = [f"begin {step.called}", *[""] * (len(goals) - 1)]
            for angles, positions, event in zip(goals, measured(step, goals), events, strict=True):
                number += 1
                if ticks is not None and number > ticks:
                    return path
                log.write(_tick(number, angles, positions, event, loop, board))
            number += 1
            log.write(_tick(number, goals[-1], goals[-1], f"end {step.called}", loop, board))
    return path


def _tick(
    number: int, angles: Floats, positions: Floats, event: str, loop: float, board: float
) -> Tick:
    t = number * CONTROL.period * loop
    return Tick(
        number=number,
        t=t * board,
        now=t,
        counts=(2000.0, 2000.0),
        reading=(2000.0, 2000.0),
        level=(math.nan, math.nan),
        contact=(2, 2),
        maneuver=4,
        phase=math.nan,
        angles=tuple(np.asarray(angles).tolist()),
        positions=tuple(np.asarray(positions).tolist()),
        events=(event,) if event else (),
    )
