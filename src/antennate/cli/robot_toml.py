"""Commands that write robot.toml: which file, and which ports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from pydantic.dataclasses import dataclass

from antennate.cli.addresses import USUAL, parse_robot, refuse_udp
from antennate.cli.arguments import FromFile
from antennate.cli.options import option
from antennate.errors import ConfigError
from antennate.hardware.robot_file import RobotFile
from antennate.messages import typed
from antennate.params.reading import Config


@dataclass(frozen=True)
class BusOptions(FromFile):
    """Where the servos are."""

    bus: str = option("", "servo bus: a serial port, or tcp://HOST:PORT", "PORT")


Chosen = TypeVar("Chosen", bound=FromFile)


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
    words = list(argv)
    given = _given(words)
    path = given or USUAL
    if given is None and path.exists():
        words = ["--config", str(path), *words]
    elif may_make and not path.exists():
        words = _without_config(words)
    config, chosen = parse_robot(command, description, take, words, options)
    return config, chosen, path


def require_bus(bus: str) -> None:
    """Refuse a bus that is not named, or on a network that loses packets.

    Raises:
        ConfigError: It is.
    """
    if not bus:
        raise ConfigError(f"--bus: expected a serial port, found none; `{typed('setup')}` finds it")
    refuse_udp(bus)


def _given(words: Sequence[str]) -> Path | None:
    """The file that --config names."""
    for word, following in zip(words, [*words[1:], ""], strict=False):
        name, _, value = word.partition("=")
        if name == "--config" and (value or following):
            return Path(value or following)
    return None


def _without_config(words: Sequence[str]) -> list[str]:
    """The words without --config and its file."""
    before = ["", *words[:-1]]
    return [
        word
        for word, last in zip(words, before, strict=False)
        if last != "--config" and word.partition("=")[0] != "--config"
    ]
