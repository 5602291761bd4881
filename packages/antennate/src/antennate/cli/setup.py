"""`antennate setup`, `setup zero` and `setup jog`: from a box of servos to a robot, by hand."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.dataclasses import dataclass

from antennate.cli.keys import END, ReadKeys, TerminalPerson, typed_keys
from antennate.cli.options import option
from antennate.cli.results import print_table
from antennate.cli.robot import USUAL, BusOptions, parse_robot, parse_writer, require_bus
from antennate.cli.terminal import BAD_INPUT, OK, StatusLine, stop_signals, today, write
from antennate.errors import ConfigError
from antennate.hardware.config import JogConfig, SetupConfig, ZeroConfig
from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.check import opener_of
from antennate.hardware.driving.connect import require_servos
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.joints import unmeasured
from antennate.hardware.safety import torque
from antennate.hardware.safety.deadlines import JOG_PERIOD
from antennate.hardware.setup.jog import Jog, JogState
from antennate.hardware.setup.person import Quit, all_ports, confirm, find_port, ports_like
from antennate.hardware.setup.robot_toml import change, require_changeable
from antennate.hardware.setup.servos import Assembly, Joint, JointState, ServoSetup, joints_of
from antennate.hardware.setup.zeros import Positions, Zeroing, by_group, forgotten, measured
from antennate.host import HostClock, StopOnce
from antennate.messages import nearest, shortened, typed
from antennate.params.toml_text import Key, Value
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate.studies.tables import Table
from dynamixel_bus.bus import Bus
from dynamixel_bus.models import model_name

DESCRIPTION = """\
Set up the servos of a new robot. First the two ports are found by unplugging one adapter after the
other; --bus and --esp32 name them instead. Then you connect one servo at a time, in the order of
the robot, whatever its id and speed: it gets the id, speed, mode, limits and return delay of its
joint, each written and read back. Torque never comes on.

What is done is kept in robot.toml (--config names another file), so that you may stop and go on
later. Two servos on the bus and a servo of another model are refused. For one that is done you are
asked whether it is a spare, to become the servo of this joint."""
ZERO_DESCRIPTION = """\
Measure zeros and directions of all joints. Torque goes off; you hold the robot straight, legs at
mid-stance, antennae at their mounting angle (of a bench these alone), and press Enter. Then you
move each joint in turn as you are told, and the sign of its motion becomes its direction. Live
numbers show what is read.

A horn that sits a tooth off is told. robot.toml (--config names another file) gets zeros and
directions at the end; all else in it stays. Nothing moves by itself."""
JOG_DESCRIPTION = """\
Move one joint by small steps, slowly and with little force: + or the right arrow turns it in its
positive sense, - or the left arrow back, n and p go to the next and the previous joint, q ends.

Torque is on that joint alone and off at the end, verified. If the program dies, the joint stops
within 0.2 s by its own watchdog. A servo that is not set up for its joint gets no torque."""


@dataclass(frozen=True)
class SetupOptions(BusOptions):
    """What to set up."""

    esp32: str = option("", "antenna board: a serial port, tcp:// or udp://", "PORT")
    only: tuple[str, ...] = option((), "set up these joints alone, done or not", "JOINT")
    among: str = option("", "choose ports from these device files, such as /dev/ttyACM*", "PATTERN")


def command(argv: Sequence[str]) -> int:
    """Set up what is not, and show what is done."""
    config, options, path = parse_writer(
        "setup", DESCRIPTION, SetupConfig, argv, SetupOptions, may_make=True
    )
    if options.among and options.bus and options.esp32:
        raise ConfigError(
            "--among: expected a port that is to be found, found both known, bus "
            f"{options.bus} and esp32 {options.esp32}; leave it out"
        )
    for name in options.only:
        _require_joint("--only: expected joints", name, config.robot)
    person = TerminalPerson()
    try:
        with stop_signals():
            bus = _ports(person, config, options, path)
            return _servos(person, config, options, path, bus)
    except Quit:
        sys.stderr.write(f"ended; what is done is in {path}, run `{typed('setup')}` to go on\n")
        return OK
    finally:
        person.close()


def _require_joint(expected: str, name: str, robot: RobotSpec) -> None:
    known = robot.joint_names
    if name not in known:
        raise ConfigError(
            f"{expected} of the robot{nearest(name, known)}, one of {', '.join(known)}, found "
            f"{shortened(name)}"
        )


def _ports(person: TerminalPerson, config: SetupConfig, options: SetupOptions, path: Path) -> str:
    """The bus; both ports are kept in the file. One that is given is opened before any question."""
    if options.bus:
        with opener_of(options.bus, "--bus")(config.robot.baud):
            pass
    listing = ports_like(options.among) if options.among else all_ports
    clock, known = HostClock(), {"bus": options.bus, "esp32": options.esp32}
    base = _base(config.robot, path)
    for name, what in (("bus", "adapter of the servo bus"), ("esp32", "antenna board")):
        if not known[name]:
            known[name] = find_port(
                person,
                what,
                listing,
                lambda time: clock.sleep_until(clock.now() + time),
                config.setup.port_time,
            )
    if not known["bus"]:
        raise ConfigError("--bus: expected a serial port, found none; nothing can be set up")
    change(path, base | {("ports", n): p for n, p in known.items() if p})
    return known["bus"]


def _base(robot: RobotSpec, path: Path) -> dict[Key, Value]:
    """What a new file says of a robot that is not the default, so that later commands read it."""
    if path.exists():
        return {}
    apart = {name: dict(_apart(RobotSpec.named(name), robot)) for name in ROBOTS}
    name = min(ROBOTS, key=lambda name: len(apart[name]))
    base: dict[Key, Value] = {} if name == ROBOTS[0] else {("robot", "base"): name}
    return base | apart[name]


def _apart(base: BaseModel, own: BaseModel, *groups: str) -> Iterator[tuple[Key, Any]]:
    """Keys of a robot that differ from those of another, and their values."""
    for name, value in own:
        other = getattr(base, name)
        if isinstance(value, BaseModel):
            yield from _apart(other, value, *groups, name)
        elif value != other:
            tables = isinstance(value, tuple) and any(isinstance(v, BaseModel) for v in value)
            whole = [each.model_dump(mode="json") for each in value] if tables else value
            yield ("robot", *groups, name), whole


def _servos(
    person: TerminalPerson, config: SetupConfig, options: SetupOptions, path: Path, bus: str
) -> int:
    robot = config.robot
    ids, zeros = by_group(robot, "ids", robot.ids), config.zeros
    servos = ServoSetup(opener_of(bus, "--bus"), robot, config.setup.scan, HostClock().now)

    def forget(joint: Joint) -> None:
        nonlocal zeros
        zeros = forgotten(robot, zeros, joint.servo, path)

    assembly = Assembly(
        servos,
        config.setup.done,
        lambda done: change(path, {**ids, ("setup", "done"): done}),
        forget,
    )
    states = assembly.look()
    _show_servos(states)
    try:
        assembly.run(person, states, options.only)
        if len(assembly.done) < len(states):
            raise Quit
        _connect_all(person, assembly)
    except Quit:
        done = len(assembly.done)
        person.say(f"{done} of {len(states)} servos are set up; this is kept in {path}")
        return OK
    person.say(f"all servos answer; {path} is written. Next: {typed('zero')}")
    return OK


def _connect_all(person: TerminalPerson, assembly: Assembly) -> None:
    """Ask for the whole robot until all servos answer."""
    while confirm(person, "connect all servos as they are in the robot"):
        states = assembly.look()
        missing = [state.joint.name for state in states if state.note != "answers"]
        if not missing:
            _show_servos(states)
            return
        person.say(
            f"expected all servos to answer, found none of {', '.join(missing)}; check the plugs "
            "along the chain, and the supply"
        )
    raise Quit


def _show_servos(states: Sequence[JointState]) -> None:
    rows = [
        (s.joint.name, [str(s.joint.servo), model_name(s.joint.model), s.state, s.note])
        for s in states
    ]
    done = sum(state.state == "set up" for state in states)
    note = f"{done} of {len(states)} servos are set up."
    print_table(Table("Servos", ["id", "model", "state", "note"], rows, note))
    sys.stdout.flush()


@dataclass(frozen=True)
class ZeroOptions(BusOptions):
    """What to measure."""

    keep_directions: bool = option(False, "measure zeros alone")


def zero(argv: Sequence[str]) -> int:
    """Measure zeros and directions, show them, write them."""
    config, options, path = parse_writer("zero", ZERO_DESCRIPTION, ZeroConfig, argv, ZeroOptions)
    require_bus(options.bus)
    person = TerminalPerson()
    try:
        with stop_signals():
            return _measure(person, config, options, path)
    except Quit:
        sys.stderr.write("ended; nothing was written\n")
        return OK
    finally:
        person.close()


def _measure(person: TerminalPerson, config: ZeroConfig, options: ZeroOptions, path: Path) -> int:
    robot, clock = config.robot, HostClock()
    base = _base(robot, path)
    unknown = {*robot.unstated("directions"), *config.zeros.missing}
    require_changeable(path, measured(robot, robot.zeros, robot.directions, (), today()))
    with master(opener_of(options.bus, "--bus"), robot.baud, clock.now) as bus:
        require_servos(bus, robot)
        if left := torque.disable(bus, robot.ids):
            raise BringUpError(f"expected torque off, servos {left} did not confirm it")
        positions = Positions(bus, robot, lambda time: clock.sleep_until(clock.now() + time))
        zeroing = Zeroing(robot, config.setup, positions)
        zeros = zeroing.zeros(person)
        for horn in zeroing.horns(zeros):
            person.say(str(horn))
        keep = options.keep_directions
        directions = list(robot.directions) if keep else zeroing.directions(person)
    missing = [name for name in robot.joint_names if name in unknown - zeroing.measured]
    done = measured(robot, zeros, directions, missing, today())
    change(path, base | done)
    person.close()
    _show_zeros(robot, zeros, directions, zeroing.measured)
    named = () if path == USUAL else ("--config", str(path))
    sys.stderr.write(f"{path} is written. Next: {typed('zero' if missing else 'doctor', *named)}\n")
    return OK


def _show_zeros(
    robot: RobotSpec, zeros: Sequence[int], directions: Sequence[int], moved: Collection[str]
) -> None:
    before = zip(robot.zeros, robot.directions, strict=True)
    after = zip(zeros, directions, strict=True)
    rows: list[tuple[str, list[str]]] = []
    for name, (old, sense), (zero, sign) in zip(robot.joint_names, before, after, strict=True):
        note = "reversed" if sign != sense else ""
        note = note if name in moved else "direction not measured"
        rows.append((name, [str(zero), f"{zero - old:+d}", f"{sign:+d}", note]))
    print_table(Table("Joints", ["zero", "change", "direction", "note"], rows, ""))


_REST = 0.3
"""Time for a joint to come to rest once the keys have ended [s] (assumed)."""
_STEPS = {"+": 1, "=": 1, "right": 1, "up": 1, "-": -1, "left": -1, "down": -1}
_OTHERS = {"n": 1, "p": -1}


@dataclass(frozen=True)
class JogOptions(BusOptions):
    """Which joint."""

    joint: str = option("", "name of the joint, such as yaw1; else the first", "JOINT")


def jog(argv: Sequence[str]) -> int:
    """Move joints until q or the end of the input."""
    config, options = parse_robot("jog", JOG_DESCRIPTION, JogConfig, argv, JogOptions)
    names = config.robot.joint_names
    if options.joint:
        _require_joint("--joint: expected a joint", options.joint, config.robot)
    require_bus(options.bus)
    at, clock = names.index(options.joint or names[0]), HostClock()
    opener = opener_of(options.bus, "--bus")
    with (
        master(opener, config.robot.baud, clock.now) as bus,
        typed_keys() as keys,
        StopOnce(last=True) as stop,
    ):
        stop.within = _move  # no signal keeps the torque from going off
        off, last, stood = True, "", dict[int, int | None]()
        while off and last not in ("q", END) and not stop.received:
            off, last = _one_joint(bus, config, at, keys, clock, stood)
            at = (at + _OTHERS.get(last, 0)) % len(names)
    return OK if off else BAD_INPUT


def _one_joint(
    bus: Bus,
    config: JogConfig,
    at: int,
    keys: ReadKeys,
    clock: HostClock,
    stood: dict[int, int | None],
) -> tuple[bool, str]:
    """One joint until another is wanted: whether its torque is off, and the last key.

    `stood` keeps where joints without a zero stood at first, so that visits do not add up.
    What became of the torque is written in any case, above the error if there is one.
    """
    status, last, left = StatusLine(), "q", list[int]()
    robot, one = config.robot, joints_of(config.robot)[at]
    known = one.name not in unmeasured(robot, config.zeros)
    if not known:
        way = f"at most {math.degrees(config.jog.reach):.0f} deg from where it stands, + adds ticks"
        write(f"{one.name}: its zero or direction is not measured: {way}\n")
    joint = Jog(bus, robot, one, config.jog, known)
    joint.stood = stood.get(at)
    try:
        last = _move(joint, config.jog.speed, keys, clock, status)
    except KeyboardInterrupt:
        pass
    finally:
        left = joint.end()
        stood[at] = joint.stood
        status.close()
        write(
            f"torque is NOT confirmed off: servos {left}; switch their supply off\n"
            if left
            else f"{joint.joint.name}: torque is off, verified\n"
        )
    return not left, last


def _move(joint: Jog, speed: float, keys: ReadKeys, clock: HostClock, status: StatusLine) -> str:
    """Torque on, and what the keys ask for: the key that ends it."""
    last, arrives = "", math.inf
    joint.begin()
    while last not in (*_OTHERS, "q") and clock.now() < arrives:
        last = _take_steps(joint, keys(JOG_PERIOD if last != END else 0.0)) or last
        now = joint.look()
        if last != END:
            arrives = clock.now() + abs(now.goal - now.angle) / speed + _REST
        else:
            clock.sleep_until(clock.now() + JOG_PERIOD)
        if status.due(clock.now()):
            status.show(_line(now, joint.joint.name))
    return last


def _take_steps(joint: Jog, keys: Sequence[str]) -> str:
    """Steps up to a key that is none, which is returned; empty if there is none."""
    for key in keys:
        if key in (*_OTHERS, "q", END):
            return key
        if key in _STEPS:
            joint.step(_STEPS[key])
    return ""


def _line(now: JogState, name: str) -> str:
    angle, goal = math.degrees(now.angle), math.degrees(now.goal)
    return f"{name}: {angle:+7.1f} deg, goal {goal:+7.1f} deg, {now.ticks} ticks, load {now.load}"
