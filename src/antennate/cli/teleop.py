"""`antennate drive teleop`: the real robot, or its twin, by keys or a gamepad."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from pydantic.dataclasses import dataclass

from antennate.cli import drive
from antennate.cli.addresses import parse_robot
from antennate.cli.keys import END, typed_keys
from antennate.cli.options import option
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.driving.config import DriveConfig
from antennate.hardware.driving.gamepad import Gamepad
from antennate.hardware.driving.session import Session
from antennate.hardware.driving.teleop import KeyController, TeleopConfig
from antennate.hardware.host_clock import HostClock
from antennate.hardware.robot_file import RobotFile
from antennate.robots.spec import require_antennae

DESCRIPTION = """\
Walk the real robot, or its twin, by keys: the arrows (or w, a, d, s) are FORWARD, TURN_L, TURN_R
and REVERSE, the space bar stands, o lets the antennae oscillate, q ends. All else is as with
`antennate drive`: the dry run, --arm, the supervisor, the log.

Hold a key: half a second without one and the robot stands. A reading that cannot be used stops it
too.

--gamepad takes the first stick or the cross of a gamepad instead, while a shoulder button (4 or 5,
L1 or R1) is held, and any other button for o. Without the button, or two seconds without an event
of the pad (--teleop.gamepad-silence), the robot stands. A pad that is unplugged ends the drive."""


VIEW = dataclasses.replace(drive.VIEW, name="teleop", about=DESCRIPTION, config=TeleopConfig)


@dataclass(frozen=True)
class Orders(drive.Orders):
    """Whether to move, and by what."""

    gamepad: Path | None = option(None, "gamepad in place of keys, as /dev/input/js0", "FILE")


def command(argv: Sequence[str]) -> int:
    """Walk by keys until q, the duration is over or it is stopped.

    Raises:
        AntennateError: A port, a servo or the board is not what is needed, or no key can come;
            nothing moved then.
    """
    config, orders = parse_robot("teleop", DESCRIPTION, RobotFile.for_teleop, argv, Orders)
    if config.hold_to_run:
        raise ConfigError(
            "--hold-to-run: expected none with teleop, which stands without a key, found it"
        )
    require_antennae(config.robot, "teleop")
    drive.require_ports(orders)
    with _keys(orders.gamepad, config.teleop.gamepad_silence) as keys:
        return drive.walk(VIEW, config, orders, argv, _controller(config, keys))


def _controller(
    config: TeleopConfig, keys: Callable[[], list[str]]
) -> Callable[[Session, DriveConfig], KeyController]:
    def made(session: Session, calibrated: DriveConfig) -> KeyController:
        control, robot = calibrated.control, calibrated.robot
        return KeyController(control, robot, config.teleop, keys, session.clock.now)

    return made


@contextlib.contextmanager
def _keys(path: Path | None, silence: float) -> Iterator[Callable[[], list[str]]]:
    """Yield what says, without waiting, which keys have come.

    A gamepad without an event for `silence` [s] counts as released.
    """
    if path is not None:
        with contextlib.closing(Gamepad(path, HostClock().now, silence)) as pad:
            yield pad.keys
        return
    with typed_keys() as read:
        early = read(0.0)
        if END in early:
            raise BadInputError("expected keys on a terminal, found the end of the input")

        def keys() -> list[str]:
            nonlocal early
            came, early = [*early, *read(0.0)], []
            return came

        yield keys
