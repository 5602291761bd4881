"""Logs of a protocol whose measurements a test gives."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import accumulate
from pathlib import Path

import numpy as np

from antennate.control.protocol import Protocol, Step, targets
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
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


SMALL = RobotSpec(links=2, mass=0.8, antennae={"kind": "none"})  # type: ignore[arg-type]
SPEED, RATE = 0.05, 0.1
"""Of the head along a circle [m/s], [rad/s]."""
WALKS = (("FORWARD", 0.5, 6.0), ("TURN_L", 0.5, 4.0), ("TURN_R", 0.8, 2.6))
PERIOD = 2.0
"""Of the first two walks [s]."""


def walk(folder: Path, *gaps: tuple[float, float], pace: float = 1.0) -> tuple[Path, Path]:
    """A log that follows its commands, and a table of its head on a circle.

    Args:
        folder: Where they are written.
        gaps: Times of the log without rows in the table [s].
        pace: Of the clock of the table.
    """
    steps = [Step(name="stand", seconds=1.0)]
    steps += [Step(name=m, maneuver=m, frequency=f, seconds=s) for m, f, s in WALKS]  # type: ignore[arg-type]
    log = write(folder / "walk.mcap", SMALL, Protocol(steps=tuple(steps)).made_for(SMALL, CONTROL))
    yaw = SMALL.places("yaw")
    with LogReader(log) as reader:
        rows = [(x.now, sum(accumulate(x.positions[yaw])) / SMALL.links) for x in reader]
    t = np.arange(0.0, rows[-1][0], 0.01)
    heading = RATE * t - np.interp(t, *np.array(rows).T)
    x, y = SPEED / RATE * np.sin(RATE * t), SPEED / RATE * (1.0 - np.cos(RATE * t))
    sound = ~np.any([(t > begin) & (t < end) for begin, end in (*gaps, (-2.0, -1.0))], axis=0)
    table = folder / "take.csv"
    cells = np.column_stack([300.0 + pace * t, x, y, heading])[sound].tolist()
    lines = (",".join(f"{value:.6f}" for value in row) for row in cells)
    table.write_text("\n".join(["time,x,y,heading", *lines, ""]))
    return log, table
