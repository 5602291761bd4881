"""Which robot a command talks to: its file, its ports and the key of its board.

`antennate robot` says what a robot's file describes, and how to build and wire that robot.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, ClassVar, Literal, TypeVar

from pydantic.dataclasses import dataclass

from antennate.cli import export
from antennate.cli.arguments import FromFile, parse
from antennate.cli.options import option
from antennate.cli.results import ResultOptions, folder_for, show_result
from antennate.cli.terminal import OK, write
from antennate.errors import ConfigError
from antennate.hardware.config import RobotFile
from antennate.hardware.doctor.check import same
from antennate.hardware.joints import unmeasured
from antennate.hardware.ports.finder import is_udp, read_key
from antennate.messages import typed
from antennate.params.base import Config, Params, read_file
from antennate.params.hardware import ZerosParams
from antennate.robots.parts import Rail, Supply, bill, supply
from antennate.robots.spec import RobotSpec
from antennate.studies.columns import NONE, Column
from antennate.studies.formats import to_csv
from antennate.studies.report import View
from antennate.studies.tables import Table
from dynamixel_bus.model import EXTENDED_MODE

USUAL = Path("robot.toml")
"""The robot's file if --config names no other."""


@dataclass(frozen=True)
class RobotFileOptions(FromFile):
    """Which file describes the robot."""

    no_config: bool = option(False, f"leave {USUAL} of this folder, which else is read")


@dataclass(frozen=True)
class RobotOptions(RobotFileOptions):
    """Where the robot is."""

    esp32: str = option("", "antenna board: serial port, tcp:// or udp://HOST:PORT", "PORT")
    key: Path | None = option(
        None, "file with the key of a board behind udp://, mode 0600; else ANTENNATE_KEY", "FILE"
    )
    insecure_udp: bool = option(
        False, "a board without a key; anybody on the network can then send frames in its place"
    )


@dataclass(frozen=True)
class BusOptions(RobotFileOptions):
    """Where the servos are."""

    bus: str = option("", "servo bus: a serial port, or tcp://HOST:PORT", "PORT")


@dataclass(frozen=True)
class PortOptions(BusOptions, RobotOptions):
    """Where both are."""


Chosen = TypeVar("Chosen", bound=RobotFileOptions)


def usual_file(options: RobotFileOptions) -> Path | None:
    """The file to read: the one of --config, else robot.toml of this folder, which is said."""
    if options.config is not None and options.no_config:
        raise ConfigError("--no-config: expected no --config beside it, found both")
    if options.config is not None or options.no_config or not USUAL.exists():
        return options.config
    write(f"{USUAL} of this folder is read; --no-config leaves it\n")
    return USUAL


def parse_robot(
    command: str,
    description: str,
    model: type[Config],
    argv: Sequence[str],
    options: type[Chosen],
    file_of: Callable[[Chosen], Path | None] = usual_file,
    without: Sequence[str] = (),
    named: type[Config] | None = None,
    take: Callable[[RobotFile], Config] | None = None,
) -> tuple[Config, Chosen]:
    """Read the words of a command that talks to a robot.

    Args:
        command: Its name.
        description: What it does.
        model: Its configuration.
        argv: Its words.
        options: Its other options; ports that no flag names are those of the file.
        file_of: Which file is read.
        without: Fields of the other options that this command has not.
        named: What the file of --config holds, if it is no robot's file.
        take: What it takes of a robot's file, if not all that both have.
    """
    robot = RobotFile()

    def read(path: Path) -> Config:
        nonlocal robot
        if named is not None and path is not USUAL:
            return read_file(path, named)
        robot = read_file(path, RobotFile)
        return take(robot) if take else robot.part(model)

    config, chosen = parse(command, description, model, argv, options, read, without, file_of)
    ports = {
        name: getattr(robot.ports, name)
        for name in type(robot.ports).model_fields
        if getattr(chosen, name, None) == ""
    }
    return config, replace(chosen, **ports)


def parse_writer(
    command: str,
    description: str,
    model: type[Config],
    argv: Sequence[str],
    options: type[Chosen],
    may_make: bool = False,
) -> tuple[Config, Chosen, Path]:
    """Read the words of a command that writes a robot's file, and say which file that is.

    Without --config it is robot.toml in this folder, which need not exist; with `may_make` that of
    --config need not either.
    """

    def file_of(chosen: Chosen) -> Path | None:
        path = chosen.config or USUAL
        if not path.exists() and (chosen.config is None or may_make):
            return None
        if chosen.config is None:
            write(f"{USUAL} of this folder is read\n")
        return path

    without = ["no_config"]
    config, chosen = parse_robot(command, description, model, argv, options, file_of, without)
    return config, chosen, chosen.config or USUAL


def key_of(options: RobotOptions) -> bytes | None:
    """The key for a board behind udp://, None if there is no such board."""
    if not is_udp(options.esp32):
        for flag, given in (("--key", options.key), ("--insecure-udp", options.insecure_udp)):
            if given:
                raise ConfigError(f"{flag}: expected a board behind udp:// beside it, found none")
        return None
    if not options.insecure_udp:
        return read_key(options.key, "or give --insecure-udp for a board without one")
    if options.key is not None:
        raise ConfigError("--insecure-udp: expected no --key beside it, found both")
    warning = (
        "UDP without a key: anybody on this network can send frames in place of the antenna board"
    )
    red = "\x1b[1;31m{}\x1b[0m" if sys.stderr.isatty() else "{}"
    sys.stderr.write(red.format(warning) + "\n")
    return b""


def at_hand(options: RobotFileOptions) -> str:
    """A hint at the robot's file in this folder, else at the commands that find or make a port."""
    if options.no_config and USUAL.is_file():
        return f"; {USUAL} is here, without --no-config its ports are taken"
    return f"; `{typed('setup')}` finds it, `{typed('twin')}` simulates a robot"


def require_two_ports(options: PortOptions) -> None:
    """Refuse one port for both, and a servo bus on a network that loses packets."""
    bus = options.bus
    if bus and options.esp32 and same(options.esp32, bus):
        raise ConfigError(f"--esp32 and --bus: expected two ports, found {bus} twice")
    _refuse_udp(bus)


def require_bus(bus: str) -> None:
    """Refuse a bus that is not named, or on a network that loses packets."""
    if not bus:
        raise ConfigError(f"--bus: expected a serial port, found none; `{typed('setup')}` finds it")
    _refuse_udp(bus)


def _refuse_udp(bus: str) -> None:
    if is_udp(bus):
        raise ConfigError("--bus: expected a serial port or tcp://, found udp://; it loses packets")


DESCRIPTION = """\
Say what a robot consists of: joints with their ids and servos, what its supply has to give, a
wiring diagram and a bill of materials. Nothing is sent to any port.

The folder holds figures/wiring.svg and .png, bom.csv and result.json.

--export writes the robot for other programs instead. mjcf: robot.xml, scene.xml with a scene around
it, a walk (gait.csv) and walk.py, which drives scene.xml by it in MuJoCo alone, to the same bits.
urdf: robot.urdf. README.txt tells what the files cannot hold."""
_COLUMNS = ("id", "servo", "mode", "zero", "direction")
_RAIL = (
    Column("servos", "servos", form="d"),
    Column("standby", "standby", "A"),
    Column("walking", "walking, mean", "A"),
    Column("peak", "walking, most", "A"),
    Column("stall", "all stalled", "A"),
)


class DescribedRobot(Params):
    """The robot that is described."""

    unread: ClassVar[tuple[str, ...]] = ("zeros.measured",)
    shared: ClassVar[bool] = True
    robot: RobotSpec = option(RobotSpec(), "", positional=True, optional=True)
    zeros: ZerosParams = ZerosParams()


_MJCF = ("--export mjcf",)


@dataclass(frozen=True)
class Options(ResultOptions, RobotFileOptions):
    """Where the results go, which file describes the robot, and what is exported."""

    export: Literal["mjcf", "urdf"] | None = option(
        None, "write the robot for other programs instead"
    )
    scene: str = option("", "scene around the robot, else a flat floor", "NAME", _MJCF)
    seed: int = option(0, "seed of that scene; it is that of trial 0", needs=["--scene"], ge=0)
    gait: str = option("", "gait of the walk that is written beside it", "NAME|FILE", _MJCF)


def command(argv: Sequence[str]) -> int:
    """Describe the robot, and write the diagram and the bill, or export it."""
    try:
        config, options = parse_robot("robot", DESCRIPTION, DescribedRobot, argv, Options)
    except ConfigError as error:
        raise ConfigError(_with_folder(str(error), argv)) from None
    robot = config.robot
    files, result = None, {}
    if options.export is not None:
        wishes = options.scene, options.seed, options.gait
        files, result = export.exported(robot, options.export, *wishes)
    with folder_for(VIEW, options, config, argv) as folder:
        folder.keep_room()
        if files is None:
            files, result = _description(robot, config.zeros)
            from antennate.robots.wiring import wiring  # slow to import

            folder.write_figures({"wiring": wiring(robot)})
        for name, content in files.items():
            folder.write(name, content)
        folder.finish(result)
        show_result(result, options, VIEW.tables(result), VIEW.sentence(result))
    return OK


def _with_folder(why: str, argv: Sequence[str]) -> str:
    """Why words are refused, without a flag that nobody typed; perhaps one of them is a folder."""
    if why.startswith(("--robot: ", "--export: ", "expected flags only")):
        why += "; a folder for the results is given as --out FOLDER"
    typed_flags = {word.partition("=")[0] for word in argv}
    return why if "--robot" in typed_flags else why.removeprefix("--robot: ")


def _description(robot: RobotSpec, zeros: ZerosParams) -> tuple[dict[str, str], dict[str, Any]]:
    """The bill as a file, and the result."""
    parts = [asdict(part) for part in bill(robot)]
    result = {
        "schema": 1,
        "command": "robot",
        "joints": dict(_joints(robot, zeros)),
        "supply": asdict(supply(robot)),
        "bom": parts,
    }
    return {"bom.csv": to_csv(parts)}, result


def _joints(robot: RobotSpec, zeros: ZerosParams) -> Iterator[tuple[str, dict[str, Any]]]:
    """What is known of each joint; a zero or direction that is not measured is None."""
    lists = {"zero": robot.zeros, "direction": robot.directions}
    lacking = {what: unmeasured(robot, zeros, [f"{what}s"]) for what in lists}
    for at, (name, number, servo) in enumerate(
        zip(robot.joint_names, robot.ids, robot.joint_servos, strict=True)
    ):
        mode = "extended position" if robot.modes[number] == EXTENDED_MODE else "position"
        known = {w: None if name in lacking[w] else values[at] for w, values in lists.items()}
        yield name, {"id": number, "servo": servo.product, "mode": mode, **known}


def _supply(result: Mapping[str, Any]) -> Supply:
    table = result["supply"]
    return Supply(**{**table, "rails": tuple(Rail(**rail) for rail in table["rails"])})


def _tables(result: Mapping[str, Any]) -> Sequence[Table]:
    if "export" in result:
        return export.tables(result)
    power, joints = _supply(result), result["joints"]
    rails = {
        f"{rail.voltage:g} V": {**asdict(rail), "servos": len(rail.ids)} for rail in power.rails
    }
    note = (
        f"A plug of a servo's cable carries at most 3 A, so feed power into the chain for every "
        f"{power.per_feed} servos: {power.feeds} feeds."
    )
    rows = [
        (name, [NONE if row[key] is None else str(row[key]) for key in _COLUMNS])
        for name, row in joints.items()
    ]
    lack = any(NONE in cells for _, cells in rows)
    cure = f"{NONE} is not measured; `{typed('zero')}` measures it." if lack else ""
    return Table("Joints", _COLUMNS, rows, cure), Table.of("Supply", rails, _RAIL, note)


def _sentence(result: Mapping[str, Any]) -> str:
    if "export" in result:
        return export.sentence(result)
    power = _supply(result)
    if not any(name.startswith("leg_") for name in result["joints"]):
        return (
            f"Servos draw at most {power.peak:.1f} A, and {power.stall:.1f} A if they stall; fuse "
            f"{power.fuse:g} A; it does not walk."
        )
    drawn = f"{power.walking:.1f} A while walking, at most {power.peak:.1f} A"
    return (
        f"{len(result['joints'])} servos draw {drawn}, and {power.stall:.1f} A if all of them "
        f"stall; fuse {power.fuse:g} A; a battery of 2.2 Ah lasts {60 * power.hours(2.2):.0f} min "
        "of walking."
    )


_CAPTIONS = {
    "wiring": "Servos in plan on their bus, head to the left, what feeds them, and the board."
}
VIEW = View("robot", DESCRIPTION, DescribedRobot, _tables, _sentence, captions=_CAPTIONS)
