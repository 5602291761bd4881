"""How a command is told which robot it talks to: its file, its ports and the key of its board."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

import tyro

from antennate.cli.arguments import Config, FromFile, parse_with, read_file
from antennate.errors import ConfigError
from antennate.hardware.ports.finder import is_udp
from antennate.hardware.ports.keys import read_key
from antennate.hardware.robot_file import RobotFile


@dataclass(frozen=True)
class RobotOrders(FromFile):
    """The robot.

    Attributes:
        config: TOML file, the same for drive, doctor and record; flags override it
        esp32: serial port of the antenna board, tcp://HOST:PORT or udp://HOST:PORT
        key: file with the key of a board behind udp://, mode 0600; else ANTENNATE_KEY is read
        insecure_udp: the board has no key; anybody on the network can feign it
    """

    esp32: Annotated[str, tyro.conf.arg(metavar="PORT")] = ""
    key: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    insecure_udp: bool = False


Orders = TypeVar("Orders", bound=RobotOrders)


def parse_robot(
    command: str,
    description: str,
    take: Callable[[RobotFile], Config],
    argv: Sequence[str],
    orders: Orders,
) -> tuple[Config, Orders]:
    """Read the words of a command that talks to a robot.

    Args:
        command: Its name.
        description: What it does.
        take: What it takes of a robot's file.
        argv: Its words.
        orders: Its other options, by their defaults.

    Raises:
        ConfigError: A flag, the file or a value cannot be used.
        SystemExit: Help was asked for and has been printed.
    """
    model = type(take(RobotFile()))
    return parse_with(
        command, description, model, argv, orders, lambda path: take(read_file(path, RobotFile))
    )


def key_of(orders: RobotOrders) -> bytes | None:
    """The key for a board behind udp://, None if there is no such board.

    Raises:
        ConfigError: --insecure-udp beside a key.
        BadInputError: There is no key, or it cannot be used.
    """
    if not is_udp(orders.esp32):
        return None
    if not orders.insecure_udp:
        return read_key(orders.key, "or give --insecure-udp for a board without one")
    if orders.key is not None:
        raise ConfigError("--insecure-udp: expected no --key beside it, found both")
    warning = "UDP without a key: anybody on this network can feign the antenna board"
    red = "\x1b[1;31m{}\x1b[0m" if sys.stderr.isatty() else "{}"
    sys.stderr.write(red.format(warning) + "\n")
    return b""


def require_lossless(bus: str) -> None:
    """Refuse a servo bus on the network.

    Raises:
        ConfigError: It is behind udp://.
    """
    if is_udp(bus):
        raise ConfigError("--bus: expected a serial port or tcp://, found udp://; it loses packets")
