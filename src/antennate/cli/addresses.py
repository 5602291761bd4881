"""How a command is told which robot it talks to: its file, its ports and the key of its board."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from pydantic.dataclasses import dataclass

from antennate.cli.arguments import FromFile, parse
from antennate.cli.options import option
from antennate.cli.status import write
from antennate.errors import ConfigError
from antennate.hardware.doctor.ports import same
from antennate.hardware.ports.finder import is_udp
from antennate.hardware.ports.keys import read_key
from antennate.hardware.robot_file import RobotFile
from antennate.messages import typed
from antennate.params.base import Config, read_file
from antennate.params.hardware import PortsParams

USUAL = Path("robot.toml")
"""The robot's file if --config names no other."""


@dataclass(frozen=True)
class RobotFileOptions(FromFile):
    """Which file describes the robot."""

    no_config: bool = option(False, f"leave {USUAL} of this folder, which else is read")


@dataclass(frozen=True)
class RobotOptions(RobotFileOptions):
    """Where the robot is."""

    esp32: str = option(
        "", "antenna board: a serial port, tcp://HOST:PORT, udp://HOST:PORT", "PORT"
    )
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


def usual_file(chosen: RobotFileOptions) -> Path | None:
    """The file to read: the one of --config, else robot.toml of this folder, which is said.

    Raises:
        ConfigError: One is named, and none is to be read.
    """
    if chosen.config is not None and chosen.no_config:
        raise ConfigError("--no-config: expected no --config beside it, found both")
    if chosen.config is not None or chosen.no_config or not USUAL.exists():
        return chosen.config
    write(f"{USUAL} of this folder is read; --no-config leaves it\n")
    return USUAL


def parse_robot(
    command: str,
    description: str,
    take: Callable[[RobotFile], Config],
    argv: Sequence[str],
    options: type[Chosen],
    file_of: Callable[[Chosen], Path | None] = usual_file,
    without: Sequence[str] = (),
    named: type[Config] | None = None,
) -> tuple[Config, Chosen]:
    """Read the words of a command that talks to a robot.

    Args:
        command: Its name.
        description: What it does.
        take: What it takes of a robot's file.
        argv: Its words.
        options: Its other options.
        file_of: Which file is read.
        without: Fields of the other options that this command has not.
        named: What the file of --config holds, if it is no robot's file.

    Raises:
        ConfigError: A flag, the file or a value cannot be used.
        HelpRequest: Help was asked for.
    """
    known = RobotFile()

    def read(path: Path) -> Config:
        nonlocal known
        if named is not None and path is not USUAL:
            return read_file(path, named)
        known = read_file(path, RobotFile)
        return take(known)

    model = type(take(known))
    config, chosen = parse(command, description, model, argv, options, read, without, file_of)
    return config, _with_ports(chosen, known.ports)


def parse_writer(
    command: str,
    description: str,
    take: Callable[[RobotFile], Config],
    argv: Sequence[str],
    options: type[Chosen],
    may_make: bool = False,
) -> tuple[Config, Chosen, Path]:
    """Read the words of a command that writes a robot's file, and say which file that is.

    Without --config it is robot.toml in this folder, which need not exist; with `may_make` that of
    --config need not either.

    Raises:
        ConfigError: A flag, the file or a value cannot be used.
        HelpRequest: Help was asked for.
    """

    def file_of(chosen: Chosen) -> Path | None:
        path = chosen.config or USUAL
        if not path.exists() and (chosen.config is None or may_make):
            return None
        if chosen.config is None:
            write(f"{USUAL} of this folder is read\n")
        return path

    without = ["no_config"]
    config, chosen = parse_robot(command, description, take, argv, options, file_of, without)
    return config, chosen, chosen.config or USUAL


def _with_ports(chosen: Chosen, ports: PortsParams) -> Chosen:
    """Options with the ports of the robot's file where no flag names one."""
    missing = {
        name: getattr(ports, name)
        for name in type(ports).model_fields
        if getattr(chosen, name, None) == ""
    }
    return replace(chosen, **missing) if missing else chosen


def key_of(options: RobotOptions) -> bytes | None:
    """The key for a board behind udp://, None if there is no such board.

    Raises:
        ConfigError: --insecure-udp beside a key, or either without such a board.
        BadInputError: There is no key, or it cannot be used.
    """
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
    """Refuse one port for both, and a servo bus on a network that loses packets.

    Raises:
        ConfigError: They are the same, or the bus is behind udp://.
    """
    bus = options.bus
    if bus and options.esp32 and same(options.esp32, bus):
        raise ConfigError(f"--esp32 and --bus: expected two ports, found {bus} twice")
    _refuse_udp(bus)


def require_bus(bus: str) -> None:
    """Refuse a bus that is not named, or on a network that loses packets.

    Raises:
        ConfigError: It is.
    """
    if not bus:
        raise ConfigError(f"--bus: expected a serial port, found none; `{typed('setup')}` finds it")
    _refuse_udp(bus)


def _refuse_udp(bus: str) -> None:
    """Refuse a servo bus on a network that loses packets."""
    if is_udp(bus):
        raise ConfigError("--bus: expected a serial port or tcp://, found udp://; it loses packets")
