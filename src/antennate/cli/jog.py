"""`antennate setup jog`: one joint by small steps."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pydantic.dataclasses import dataclass

from antennate.cli.addresses import BusOptions, parse_robot, require_bus
from antennate.cli.exit_codes import BAD_INPUT, OK
from antennate.cli.keys import END, ReadKeys, typed_keys
from antennate.cli.options import option
from antennate.cli.status import StatusLine, write
from antennate.dxl.bus import Bus
from antennate.errors import ConfigError
from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.ports import opener_of
from antennate.hardware.driving.signals import StopOnce
from antennate.hardware.host_clock import HostClock
from antennate.hardware.robot_file import RobotFile
from antennate.hardware.safety.deadlines import JOG_PERIOD
from antennate.hardware.setup.config import JogConfig
from antennate.hardware.setup.jog import Jog, JogState
from antennate.hardware.setup.servos import joints_of
from antennate.messages import nearest, shortened

DESCRIPTION = """\
Move one joint by small steps, slowly and with little force: + or the right arrow turns it in its
positive sense, - or the left arrow back, n and p go to the next and the previous joint, q ends.

Torque is on that joint alone and off at the end, verified. If the program dies, the joint stops
within 0.2 s by its own watchdog. A servo that is not set up for its joint gets no torque."""
_REST = 0.3
"""Time for a joint to come to rest once the keys have ended [s] (assumed)."""
_STEPS = {"+": 1, "=": 1, "right": 1, "up": 1, "-": -1, "left": -1, "down": -1}
_OTHERS = {"n": 1, "p": -1}


@dataclass(frozen=True)
class Orders(BusOptions):
    """Which joint."""

    joint: str = option("", "name of the joint, such as yaw1; else the first", "JOINT")


def command(argv: Sequence[str]) -> int:
    """Move joints until q or the end of the input.

    Raises:
        AntennateError: Something given cannot be used, or a servo is not fit; no torque is on then.
    """
    config, orders = parse_robot("jog", DESCRIPTION, RobotFile.for_jog, argv, Orders)
    names = config.robot.joint_names
    if orders.joint and orders.joint not in names:
        raise ConfigError(
            f"--joint: expected a joint of the robot{nearest(orders.joint, names)}, one of "
            f"{', '.join(names)}, found {shortened(orders.joint)}"
        )
    require_bus(orders.bus)
    at, clock = names.index(orders.joint or names[0]), HostClock()
    opener = opener_of(orders.bus, "--bus")
    with (
        master(opener, config.robot.baud, clock.now) as bus,
        typed_keys() as keys,
        StopOnce(last=True) as stop,
    ):
        stop.within = _move  # no signal keeps the torque from going off
        off, last = True, ""
        while off and last not in ("q", END) and not stop.received:
            off, last = _one_joint(bus, config, at, keys, clock)
            at = (at + _OTHERS.get(last, 0)) % len(names)
    return OK if off else BAD_INPUT


def _one_joint(
    bus: Bus, config: JogConfig, at: int, keys: ReadKeys, clock: HostClock
) -> tuple[bool, str]:
    """One joint until another is wanted: whether its torque is off, and the last key.

    What became of the torque is written in any case, above the error if there is one.
    """
    status, last, left = StatusLine(), "q", list[int]()
    jog = Jog(bus, config.robot, joints_of(config.robot)[at], config.jog)
    try:
        last = _move(jog, config.jog.speed, keys, clock, status)
    except KeyboardInterrupt:
        pass
    finally:
        left = jog.end()
        status.close()
        write(
            f"torque is NOT confirmed off: servos {left}; switch their supply off\n"
            if left
            else f"{jog.joint.name}: torque is off, verified\n"
        )
    return not left, last


def _move(jog: Jog, speed: float, keys: ReadKeys, clock: HostClock, status: StatusLine) -> str:
    """Torque on, and what the keys ask for: the key that ends it."""
    last, arrives = "", math.inf
    jog.begin()
    while last not in (*_OTHERS, "q") and clock.now() < arrives:
        last = _carry_out(jog, keys(JOG_PERIOD if last != END else 0.0)) or last
        now = jog.look()
        if last != END:
            arrives = clock.now() + abs(now.goal - now.angle) / speed + _REST
        else:
            clock.sleep_until(clock.now() + JOG_PERIOD)
        if status.due(clock.now()):
            status.show(_line(now, jog.joint.name))
    return last


def _carry_out(jog: Jog, keys: Sequence[str]) -> str:
    """Steps up to a key that is none, which is returned; empty if there is none."""
    for key in keys:
        if key in (*_OTHERS, "q", END):
            return key
        if key in _STEPS:
            jog.step(_STEPS[key])
    return ""


def _line(now: JogState, name: str) -> str:
    angle, goal = math.degrees(now.angle), math.degrees(now.goal)
    return f"{name}: {angle:+7.1f} deg, goal {goal:+7.1f} deg, {now.ticks} ticks, load {now.load}"
