"""`antennate setup`: from a box of servos to a robot, one servo at a time."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pydantic.dataclasses import dataclass

from antennate.cli.addresses import BusOptions, parse_writer
from antennate.cli.exit_codes import OK
from antennate.cli.options import option
from antennate.cli.person import TerminalPerson
from antennate.cli.progress import stop_signals
from antennate.cli.results import print_table
from antennate.dxl.models import model_name
from antennate.errors import ConfigError
from antennate.hardware.config import RobotFile, SetupConfig
from antennate.hardware.doctor.check import opener_of
from antennate.hardware.host import HostClock
from antennate.hardware.setup.person import Quit, all_ports, confirm, find_port, ports_like
from antennate.hardware.setup.robot_toml import change
from antennate.hardware.setup.servos import Assembly, JointState, ServoSetup
from antennate.hardware.setup.zeros import by_group
from antennate.messages import nearest, shortened, typed
from antennate.studies.measures import Table

DESCRIPTION = """\
Set up the servos of a new robot. First the two ports are found by unplugging one adapter after the
other; --bus and --esp32 name them instead. Then you connect one servo at a time, in the order of
the robot, whatever its id and speed: it gets the id, speed, mode, limits and return delay of its
joint, each written and read back. Torque never comes on.

What is done is kept in robot.toml (--config names another file), so that you may stop and go on
later. Two servos on the bus and a servo of another model are refused. For one that is done you are
asked whether it is a spare, to become the servo of this joint."""


@dataclass(frozen=True)
class Orders(BusOptions):
    """What to set up."""

    esp32: str = option("", "antenna board: a serial port, tcp:// or udp://", "PORT")
    only: tuple[str, ...] = option((), "set up these joints alone, done or not", "JOINT")
    among: str = option("", "choose ports from these device files, such as /dev/ttyACM*", "PATTERN")


def command(argv: Sequence[str]) -> int:
    """Set up what is not, and show what is done.

    Raises:
        AntennateError: Something given cannot be used, or no answer can come.
    """
    config, orders, path = parse_writer(
        "setup", DESCRIPTION, RobotFile.for_setup, argv, Orders, may_make=True
    )
    _check(config, orders)
    person = TerminalPerson()
    try:
        with stop_signals():
            bus = _ports(person, config, orders, path)
            return _servos(person, config, orders, path, bus)
    except Quit:
        sys.stderr.write(f"ended; what is done is in {path}, run `{typed('setup')}` to go on\n")
        return OK
    finally:
        person.close()


def _check(config: SetupConfig, orders: Orders) -> None:
    if orders.among and orders.bus and orders.esp32:
        raise ConfigError(
            f"--among: expected a port that is to be found, found both known, bus {orders.bus} and "
            f"esp32 {orders.esp32}; leave it out"
        )
    known = config.robot.joint_names
    for name in orders.only:
        if name not in known:
            raise ConfigError(
                f"--only: expected joints of the robot{nearest(name, known)}, one of "
                f"{', '.join(known)}, found {shortened(name)}"
            )


def _ports(person: TerminalPerson, config: SetupConfig, orders: Orders, path: Path) -> str:
    """The bus; both ports are kept in the file. One that is given is opened before any question."""
    if orders.bus:
        with opener_of(orders.bus, "--bus")(config.robot.baud):
            pass
    listing = ports_like(orders.among) if orders.among else all_ports
    clock, found = HostClock(), {"bus": orders.bus, "esp32": orders.esp32}
    for name, what in (("bus", "adapter of the servo bus"), ("esp32", "antenna board")):
        if not found[name]:
            found[name] = find_port(
                person,
                what,
                listing,
                lambda time: clock.sleep_until(clock.now() + time),
                config.setup.port_time,
            )
    if not found["bus"]:
        raise ConfigError("--bus: expected a serial port, found none; nothing can be set up")
    change(path, {("ports", name): port for name, port in found.items() if port})
    return found["bus"]


def _servos(
    person: TerminalPerson, config: SetupConfig, orders: Orders, path: Path, bus: str
) -> int:
    robot = config.robot
    ids = by_group(robot, "ids", robot.ids)
    servos = ServoSetup(opener_of(bus, "--bus"), robot, config.setup.scan, HostClock().now)
    assembly = Assembly(
        servos, config.setup.done, lambda done: change(path, {**ids, ("setup", "done"): done})
    )
    states = assembly.look()
    _show(states)
    try:
        assembly.run(person, states, orders.only)
        if len(assembly.done) < len(states):
            raise Quit
        _whole(person, assembly)
    except Quit:
        done = len(assembly.done)
        person.say(f"{done} of {len(states)} servos are set up; this is kept in {path}")
        return OK
    person.say(f"all servos answer; {path} is written. Next: {typed('zero')}")
    return OK


def _whole(person: TerminalPerson, assembly: Assembly) -> None:
    """Ask for the whole robot until all servos answer."""
    while confirm(person, "connect all servos as they are in the robot"):
        states = assembly.look()
        missing = [state.joint.name for state in states if state.note != "answers"]
        if not missing:
            _show(states)
            return
        person.say(
            f"expected all servos to answer, found none of {', '.join(missing)}; check the plugs "
            "along the chain, and the supply"
        )
    raise Quit


def _show(states: Sequence[JointState]) -> None:
    rows = [
        (s.joint.name, [str(s.joint.servo), model_name(s.joint.model), s.state, s.note])
        for s in states
    ]
    done = sum(state.state == "set up" for state in states)
    note = f"{done} of {len(states)} servos are set up."
    print_table(Table("Servos", ["id", "model", "state", "note"], rows, note))
    sys.stdout.flush()
