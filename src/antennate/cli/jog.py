"""`antennate jog`: one joint by small steps."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence

from pydantic.dataclasses import dataclass

from antennate.cli.exit_codes import BAD_INPUT, OK
from antennate.cli.keys import END, ReadKeys, typed_keys
from antennate.cli.options import option
from antennate.cli.robot_toml import BusOptions, parse_writer, require_bus
from antennate.cli.status import StatusLine
from antennate.errors import ConfigError
from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.ports import opener_of
from antennate.hardware.driving.signals import StopOnce
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.host_clock import HostClock
from antennate.hardware.robot_file import RobotFile
from antennate.hardware.setup.config import JogConfig
from antennate.hardware.setup.jog import Jog, JogState
from antennate.hardware.setup.servos import joints_of
from antennate.messages import nearest, shortened

DESCRIPTION = """\
Move one joint by small steps, slowly and with little force: + or the right arrow turns it in its
positive sense, - or the left arrow back, n and p go to the next and the previous joint, q ends.

Torque is on that joint alone and off at the end, verified. If the program dies, the joint stops
within 0.2 s by its own watchdog."""
_PERIOD = 0.04
"""Time between two readings [s]: a fifth of the watchdog's."""
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
    config, orders, _ = parse_writer("jog", DESCRIPTION, RobotFile.for_jog, argv, Orders)
    names = config.robot.joint_names
    if orders.joint and orders.joint not in names:
        raise ConfigError(
            f"--joint: expected a joint of the robot{nearest(orders.joint, names)}, one of "
            f"{', '.join(names)}, found {shortened(orders.joint)}"
        )
    require_bus(orders.bus)
    at, clock = names.index(orders.joint or names[0]), HostClock()
    with opener_of(orders.bus, "--bus")(config.robot.baud) as port, typed_keys() as keys:
        bus = master(port, config.robot.baud, clock.now)
        left, last = list[int](), ""
        while not left and last not in ("q", END):
            left, last = _move(bus, config, at, keys, clock)
            at = (at + _OTHERS.get(last, 0)) % len(names)
    if left:
        sys.stderr.write(f"torque is NOT confirmed off: servos {left}; switch their supply off\n")
        return BAD_INPUT
    sys.stderr.write("torque is off, verified\n")
    return OK


def _move(
    bus: Bus, config: JogConfig, at: int, keys: ReadKeys, clock: HostClock
) -> tuple[list[int], str]:
    """One joint until another is wanted: ids that did not confirm torque off, and the last key."""
    joint, status = joints_of(config.robot)[at], StatusLine()
    jog, last = None, ""
    with StopOnce() as stop:
        try:
            jog = Jog(bus, config.robot, joint, config.jog)
            arrives = math.inf
            while last not in (*_OTHERS, "q") and clock.now() < arrives:
                last = _carry_out(jog, keys(_PERIOD if last != END else 0.0)) or last
                now = jog.look()
                if last != END:
                    arrives = clock.now() + abs(now.goal - now.angle) / config.jog.speed + _REST
                else:
                    clock.sleep_until(clock.now() + _PERIOD)
                if status.due(clock.now()):
                    status.show(_line(now, joint.name))
        except KeyboardInterrupt:
            last = "q"
        finally:
            stop.closed = True
            left = [] if jog is None else jog.end()
            status.close()
    return left, "q" if stop.received else last


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
