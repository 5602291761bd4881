"""`antennate setup zero`: zeros and directions of all joints, by hand."""

from __future__ import annotations

import sys
from collections.abc import Collection, Sequence
from pathlib import Path

from pydantic.dataclasses import dataclass

from antennate.cli.addresses import BusOptions, parse_writer, require_bus
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.cli.person import TerminalPerson
from antennate.cli.progress import stop_signals
from antennate.cli.results import print_table
from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.ports import opener_of
from antennate.hardware.driving.connect import require_servos
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.host_clock import HostClock
from antennate.hardware.robot_file import RobotFile
from antennate.hardware.safety import torque
from antennate.hardware.setup.config import ZeroConfig
from antennate.hardware.setup.person import Quit
from antennate.hardware.setup.robot_toml import change, require_changeable
from antennate.hardware.setup.zeros import Positions, Zeroing, by_group
from antennate.messages import typed
from antennate.robots.spec import RobotSpec
from antennate.studies.measures import Table

DESCRIPTION = """\
Measure zeros and directions of all joints. Torque goes off; you hold the robot straight, legs at
mid-stance, antennae at their mounting angle, and press Enter. Then you move each joint in turn as
you are told, and the sign of its motion becomes its direction. Live numbers show what is read.

A horn that sits a tooth off is told. robot.toml (--config names another file) gets zeros and
directions at the end; all else in it stays. Nothing moves by itself."""


@dataclass(frozen=True)
class Orders(BusOptions):
    """What to measure."""

    keep_directions: bool = option(False, "measure zeros alone")


def command(argv: Sequence[str]) -> int:
    """Measure, show, write.

    Raises:
        AntennateError: Something given cannot be used, the servos are not fit, or no answer can
            come; nothing was written then.
    """
    config, orders, path = parse_writer("zero", DESCRIPTION, RobotFile.for_zero, argv, Orders)
    require_bus(orders.bus)
    person = TerminalPerson()
    try:
        with stop_signals():
            return _measure(person, config, orders, path)
    except Quit:
        sys.stderr.write("ended; nothing was written\n")
        return OK
    finally:
        person.close()


def _measure(person: TerminalPerson, config: ZeroConfig, orders: Orders, path: Path) -> int:
    robot, clock = config.robot, HostClock()
    present = by_group(robot, "zeros", robot.zeros)
    require_changeable(path, present | by_group(robot, "directions", robot.directions))
    with master(opener_of(orders.bus, "--bus"), robot.baud, clock.now) as bus:
        require_servos(bus, robot)
        if left := torque.disable(bus, robot.ids):
            raise BringUpError(f"expected torque off, servos {left} did not confirm it")
        positions = Positions(bus, robot, lambda time: clock.sleep_until(clock.now() + time))
        zeroing = Zeroing(robot, config.setup, positions)
        zeros = zeroing.zeros(person)
        for horn in zeroing.horns(zeros):
            person.say(str(horn))
        keep = orders.keep_directions
        directions = list(robot.directions) if keep else zeroing.directions(person)
    change(path, by_group(robot, "zeros", zeros) | by_group(robot, "directions", directions))
    person.close()
    _show(robot, zeros, directions, zeroing.measured)
    sys.stderr.write(f"{path} is written. Next: {typed('doctor', '--config', str(path))}\n")
    return OK


def _show(
    robot: RobotSpec, zeros: Sequence[int], directions: Sequence[int], measured: Collection[str]
) -> None:

    def note(name: str, turned: bool) -> str:
        if name not in measured:
            return "direction not measured"
        return "reversed" if turned else ""

    before = zip(robot.zeros, robot.directions, strict=True)
    after = zip(zeros, directions, strict=True)
    rows = [
        (name, [str(zero), f"{zero - old:+d}", f"{sign:+d}", note(name, sign != kept)])
        for name, (old, kept), (zero, sign) in zip(robot.joint_names, before, after, strict=True)
    ]
    print_table(Table("Joints", ["zero", "change", "direction", "note"], rows, ""))
