"""`antennate twin`: the simulated robot behind two pseudo-terminals, or on the network."""

from __future__ import annotations

import json
import re
import secrets
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import tomlkit
from pydantic.dataclasses import dataclass

from antennate.antenna.calibration import REACH
from antennate.cli.arguments import as_typed
from antennate.cli.options import PageOptions, fields_of, flag_of, option
from antennate.cli.pages import page_of
from antennate.cli.robot import RobotFileOptions, parse_robot, usual_file
from antennate.cli.terminal import OK, stop_signals, today
from antennate.cli.twin_recording import Recording, RecordOptions, say
from antennate.errors import ConfigError, reason
from antennate.files import write_whole
from antennate.hardware.config import RobotFile
from antennate.hardware.ports.finder import read_key
from antennate.hardware.setup.zeros import measured
from antennate.host import LEVEL, urgent
from antennate.params.base import changes, paths_of
from antennate.params.toml_text import edited
from antennate.robots.antenna import SensorParams
from antennate.robots.spec import RobotSpec
from antennate.sim.world import World
from antennate.twin.board import UdpEndpoint
from antennate.twin.config import Passage, TwinConfig, watched
from antennate.twin.faults import Demand, Faults, read
from antennate.twin.orders import Orders
from antennate.twin.robot import TwinRobot
from antennate.twin.serve import ServoServer, TwinServer
from antennate.twin.servos import ServoBox, ServoEntry, read_list
from antennate.types import AntennaFrame
from dynamixel_bus.endpoints import Endpoint, TcpEndpoint

if TYPE_CHECKING:
    from antennate.telemetry.view.process import ViewProcess

_LAST_PORT = 65_534
_OF_SERVOS = (
    "duration",
    "fault",
    "push",
    "plugged",
    "config",
    "no_config",
    "servos",
    "tcp",
    "orders",
)
"""What servos alone read."""

DESCRIPTION = """\
Serve the simulated robot in a scene on two serial ports (pseudo-terminals), which carry the same
bytes as those of a real robot: one the frames of the antenna board, one a DYNAMIXEL bus with all
servos. Prints one JSON line with the paths when ready. Physics begins when the first servo gets
torque.

--touch left@2s right@5s bends the antennae of the standing robot, as the check by touch of
`antennate drive` wants it, from the beginning of each client on. left:20mm@2s holds the left one,
its tip 20 mm aside, left:10mm:60mm@2s the place 60 mm from its base. A robot that has walked is put
back to the start when a new client begins and no servo has torque.

--push yaw1=20deg@3s turns a joint whose servo has no torque.

--servos 1:xl330-m288 2:xl430-w250@1000000 1:xc430-w240x17 serves DYNAMIXEL servos alone, all else
as delivered. --orders reads lines while it runs: plug NAME, unplug NAME, only NAME, next,
push NAME=ANGLE, where a NAME is a joint, a number from 1 on, or all; touch left:20mm, to follow
the marks of `antennate record`; hang and floor, as `antennate drive --protocol` asks for it; fault
servo:7=silent.

Faults, each with @Ts for its time:
servo:ID=silent, bad_crc, truncated, late:SECONDS, doubled, wrong_id, oversized, voltage, overheat,
encoder, shock, overload, reboot, frozen or jump:TICKS (Present Position), or REGISTER:VALUE;
esp32=silent, reset, open_left, short_left, stuck_left (or right), left:COUNTS, right:COUNTS,
hum:COUNTS, drift:COUNTS_A_SECOND, plateau:COUNTS, sticky, radio_noise:COUNTS or ber:SHARE;
bus=silent, echo, loss:SHARE, latency:SECONDS, discharge:VOLTS_A_SECOND or ber:SHARE;
wire=ber:SHARE (bits wrong) or loss:SHARE (bytes lost), on both wires both ways."""


@dataclass(frozen=True)
class Places(RobotFileOptions, RecordOptions, PageOptions):
    """Where to serve; two pseudo-terminals if no port is given."""

    tcp: str | None = option(
        None, "TCP: the board on PORT, the bus on PORT+1; 0 takes any", "[HOST:]PORT"
    )
    udp: str | None = option(None, "the board on a UDP port instead, likewise", "[HOST:]PORT")
    key: Path | None = option(
        None,
        "file with the key for --udp, mode 0600; else ANTENNATE_KEY",
        "FILE",
        needs=["--udp"],
    )
    servos: tuple[str, ...] = option(
        (), "these servos alone, without a robot; or a TOML file", "ID:MODEL[@BAUD][xCOUNT]"
    )
    orders: Path | None = option(
        None, "take orders from a file, a named pipe or - for stdin", "FILE"
    )
    passed: Path | None = option(
        None, "make this file when the head passes the exit, for `drive --until FILE`", "FILE"
    )
    robot_toml: Path | None = option(
        None, "write the robot's file, with ports, zeros and directions, for `--config`", "FILE"
    )
    pace: Literal["real", "lockstep"] = option(
        "real", "real time, or a control period with each sync write of all goals"
    )


@stop_signals(last=True)
def command(argv: Sequence[str]) -> int:
    """Serve until the duration is over, Ctrl-C or SIGTERM."""

    def take(file: RobotFile) -> TwinConfig:
        return TwinConfig(robot=file.robot)

    def file_of(places: Places) -> Path | None:
        return places.config if places.servos else usual_file(places)  # servos have no robot

    config, places = parse_robot(
        "twin", DESCRIPTION, TwinConfig, argv, Places, file_of, named=TwinConfig, take=take
    )
    orders = None if places.orders is None else Orders(str(places.orders), say)
    if not places.servos:
        return _serve_robot(config, places, orders)
    return _serve_servos(config, places, read_list(places.servos), orders)


def _serve_robot(config: TwinConfig, places: Places, orders: Orders | None) -> int:
    demands = [read(text) for text in config.fault]
    faults = Faults(demands, config.robot.ids, has_imu=config.robot.has_imu)
    real = places.pace == "real"
    robot, passage = watched(config, boot_id=secrets.randbits(32) if real else None)
    with (
        Recording(places, robot) as recording,
        page_of(places, idle=True) or nullcontext() as page,
        TwinServer(robot, faults, *_endpoints(places, robot), orders) as server,
    ):
        _watch(robot, passage, faults, recording, places.passed)
        if places.robot_toml is not None:
            _write_robot(places.robot_toml, config.robot, server.paths)
        if page is not None:
            recording.watchers.append(_shown(page, robot, config, every=places.ros))
        recording.begin(passage, config)
        try:
            with urgent(LEVEL + 1) if real else nullcontext():
                serve = server.run if real else server.run_lockstep
                serve(_until(config, server.paths, lambda: robot.failure is None))
        finally:
            invalid = f"physics became invalid: {robot.failure}; " if robot.failure else ""
            late = f"its latest tick was {1e3 * server.late:.1f} ms late"
            came = passage.summary if config.robot.leg_count else "the bench stood where it was"
            say(f"The twin has ended: {invalid}{came}; {late}.")
    return OK


_HEAD = "# Written by `antennate twin`, whose robot this is; it writes it anew.\n"


def _write_robot(path: Path, robot: RobotSpec, paths: dict[str, str]) -> None:
    """Write what a builder measures on a robot and the twin knows of its own."""
    if path.exists() and not path.read_bytes().startswith(_HEAD.encode()):
        raise ConfigError(
            f"--robot-toml: expected no file yet, or one of a twin, found another in {path}; "
            "name another file"
        )
    own = robot.model_dump(mode="json", exclude_defaults=True)
    known = {("ports", name): port for name, port in paths.items()}
    known |= measured(robot, robot.zeros, robot.directions, (), today())
    sensor = robot.antenna.sensor
    if sensor == SensorParams(directions=sensor.directions):
        known[("limits", "covered")] = REACH
    text = edited(_HEAD + tomlkit.dumps({"robot": own}), known)
    write_whole(path, text.encode(), overwrite=True)


def _watch(
    robot: TwinRobot, passage: Passage, faults: Faults, recording: Recording, file: Path | None
) -> None:
    """Tell what happens, and keep it."""

    def began(demand: Demand, t: float) -> None:
        say(f"{t:.1f} s after the addresses: {demand}")
        recording.event(f"fault: {demand}")

    def passed() -> None:
        say(passage.summary)
        if file is not None:
            try:
                file.touch()
            except OSError as error:
                say(f"--passed: expected to make {file}, found: {reason(error)}")
        recording.event(passage.summary)

    def returned() -> None:
        passage.reset()
        recording.event("carried back to the start")

    def tick(world: World) -> None:
        for watcher in recording.watchers:
            watcher(world)

    faults.on_begin, passage.on_pass = began, passed
    robot.on_return, passage.on_tick = returned, tick


def _shown(
    page: ViewProcess, robot: TwinRobot, config: TwinConfig, every: bool
) -> Callable[[World], None]:
    """What shows the twin after each tick; it serves in real time, so a page cannot stop it."""
    from antennate.telemetry.view.simulation import SimulationView  # imports much

    view = SimulationView(page.channel, steered=False, every=every)
    view.begin(f"twin, trial {config.trial}")

    def show(world: World) -> None:
        frame = AntennaFrame(t=np.array([world.t]), counts=robot.counts[None])
        view.tick(world.model, world.data, frame)

    show(robot.world)
    return show


def _serve_servos(
    config: TwinConfig, places: Places, entries: Sequence[ServoEntry], orders: Orders | None
) -> int:
    """Servos without a robot."""
    _require_of_servos(config, places)
    demands = [read(text) for text in config.fault]
    faults = Faults(demands, [entry.id for entry in entries], alone=True)
    box = ServoBox(entries, config.plugged, config.push)
    bus = None if places.tcp is None else TcpEndpoint(*_place("--tcp", places.tcp))
    with ServoServer(box, faults, bus, orders) as server, urgent(LEVEL + 1):
        server.run(_until(config, server.paths, lambda: True))
    return OK


def _require_of_servos(config: TwinConfig, places: Places) -> None:
    """Refuse what is for a robot."""
    options = [(name, getattr(places, name), field) for name, field in fields_of(Places).items()]
    given = [(name, value) for name, value, field in options if value != field.default]
    given += list(changes(config, paths_of(TwinConfig)))
    for path, value in given:
        if path not in _OF_SERVOS:
            raise ConfigError(
                f"{flag_of(path.split('.'))}: expected none beside --servos, as it is for a robot, "
                f"found {as_typed(value)}"
            )


def _until(
    config: TwinConfig, paths: dict[str, str], sound: Callable[[], bool]
) -> Callable[[float], bool]:
    """Whether to go on at a time [s]; the first time it also says that the twin is ready.

    Only then does it answer at once: what takes a while to begin has begun.
    """
    end = float("inf") if config.duration is None else config.duration
    ready = False

    def go_on(t: float) -> bool:
        nonlocal ready
        if not ready:
            ready = True
            sys.stdout.write(json.dumps(paths) + "\n")
            sys.stdout.flush()
        return t < end and sound()

    return go_on


def _endpoints(places: Places, robot: TwinRobot) -> tuple[Endpoint | None, Endpoint | None]:
    """Endpoints of the board and the bus, None for a pseudo-terminal."""
    board: Endpoint | None = None
    bus: Endpoint | None = None
    if places.tcp is not None:
        host, port = _place("--tcp", places.tcp)
        if places.udp is None:
            board = TcpEndpoint(host, port)
        bus = TcpEndpoint(host, port and port + 1)
    if places.udp is not None:
        board = UdpEndpoint(
            *_place("--udp", places.udp), read_key(places.key), size=robot.sample_size
        )
    return board, bus


def _place(flag: str, text: str) -> tuple[str, int]:
    """Host and port; without a host nobody beyond this computer can connect."""
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[0-9]{1,5}", port) or int(port) > _LAST_PORT:
        raise ConfigError(
            f"{flag}: expected [HOST:]PORT with a port of 0 to {_LAST_PORT}, found {text!r}"
        )
    return host or "127.0.0.1", int(port)
