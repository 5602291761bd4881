"""Opens both ports and makes a session, once board and servos are identified."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from statistics import median
from typing import Any

from antennate.control.gait import Gait
from antennate.control.knowledge import require_own_senses
from antennate.control.registry import GOALS, PROTOCOL, make_controller
from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.doctor.check import latency_row
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.actuators import DynamixelActuators
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.esp32.board import BOARD_BAUD, Board
from antennate.hardware.esp32.wire import require_sensor
from antennate.hardware.joints import Joints, settings, wrong_settings, zeros_lack
from antennate.hardware.ports.finder import Reconnecting, finder
from antennate.hardware.safety.deadlines import ANSWER
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.host import HostClock
from antennate.messages import typed
from antennate.params.hardware import DoctorParams
from antennate.robots.spec import RobotSpec
from antennate.types import Controller
from dynamixel_bus.answers import Timing, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.model import hardware_errors
from dynamixel_bus.models import XC430_W240
from dynamixel_bus.port import Port, PortError

_PINGS = 5
"""Number of pings that are timed: two late ones do not move their median (assumed)."""
_SLOW = 0.008
"""Median time to an answer from which on an adapter is refused [s]: half the 16 ms of an FTDI
adapter's default (AN232B-04), which a busy computer does not reach (assumed)."""
_PING_PATIENCE = 0.05
"""Longest wait for the answer to such a ping [s]: three times those 16 ms (assumed)."""


def require_quick(
    port: Port, ids: Sequence[int], baud: int, clock: Callable[[], float], path: str
) -> float | None:
    """Ping the first servo that answers; the median time to its answers [s], None without any.

    `path` is the port's name for the error message.
    """
    bus = Bus(port, Timing(baud, gap=_PING_PATIENCE, latest=_PING_PATIENCE), clock=clock)
    times: list[float] = []
    for servo in ids:
        begin = clock()
        while len(times) < _PINGS and isinstance(bus.ping(servo), Value):
            times.append(clock() - begin)
            begin = clock()
        if times:
            break
    if not times:
        return None
    if (time := median(times)) > _SLOW:
        cure = latency_row(path, True, DoctorParams()).cure
        raise BringUpError(
            f"--bus: expected answers within {1e3 * _SLOW:g} ms, found {1e3 * time:.1f} ms; {cure}"
        )
    return time


_GREETING = DoctorParams().greeting
_SILENCE = 1.9
"""Silence of a port after which no board is there [s] (assumed: a board sends every 10 ms)."""
_QUIET = 0.1
"""Time for which the bus is listened to before a servo is asked [s] (assumed: ten samples)."""
_UNASKED = 32
"""Bytes in that time from which on servos are not alone on the bus (assumed: a plug gives less)."""
_PATIENCE = 0.05


@contextlib.contextmanager
def connect(
    config: DriveConfig, esp32: str, bus: str, key: bytes | None = None
) -> Iterator[Session]:
    """Open both ports, identify board and servos, and close the ports afterwards.

    Args:
        config: The robot.
        esp32: Address of the antenna board, as `finder` takes it.
        bus: Address of the servo bus.
        key: Of a board behind udp://; empty for one without a key.
    """
    controller = _controller(config)
    require_own_senses(controller, config.controller, "a drive")
    with contextlib.ExitStack() as stack:
        ports = ("--esp32", esp32, BOARD_BAUD), ("--bus", bus, config.robot.baud)
        board, servos = (
            stack.enter_context(
                contextlib.closing(Reconnecting(finder(address, baud, flag, key, config.network)))
            )
            for flag, address, baud in ports
        )
        yield prepare(config, board, servos, HostClock(), bus, controller)


def _controller(config: DriveConfig) -> Controller:
    """The controller that is named; by keys it does not walk, but the gait does."""
    if config.reader == PROTOCOL:  # each step has its own frequency
        return make_controller(config.controller, config.control, config.robot, walks=False)
    walks, gait = config.reader == config.controller, config.control.gait
    made = make_controller(config.controller, config.control, config.robot, walks=walks)
    if not walks or isinstance(getattr(made, "gait", None), Gait):
        swing = 0.0 if config.reader == GOALS else gait.amplitude
        config.robot.require_pace("control.gait.frequency", gait.frequency, swing)
    return made


def prepare(
    config: DriveConfig,
    esp32: Port,
    bus: Port,
    clock: Any,
    path: str = "the bus",
    controller: Controller | None = None,
) -> Session:
    """A session on two open ports, once board and servos are identified.

    Without measured zeros and directions it gets no torque. `path` names the bus in error messages.
    """
    controller = controller or _controller(config)
    board = Board(esp32, config.limits.stale_age)
    await_board(board, clock, bus, config.swapped)
    require_sensor(board.hello, config.sensor_id)
    require_sensor(board.hello, config.sensor_id_right)
    require_quick(bus, config.robot.ids[:3], config.robot.baud, clock.now, path)
    master = Bus(bus, Timing(config.robot.baud, latest=ANSWER), clock=clock.now)
    require_servos(master, config.robot)
    board.count_anew(clock.now)
    session = Session(
        board=board,
        actuators=DynamixelActuators(
            master, Joints(config.robot), clock.now, config.limits.following
        ),
        clock=clock,
        controller=controller,
        period=config.control.period,
        quality=SignalQuality(
            config.control.conditioning,
            drift=config.drift,
            touch=config.touch if config.touch_check else None,
            reaches=config.reaches,
            right=config.control.conditioning_right,
            limits=config.limits,
        ),
        limits=config.limits,
    )
    session.unfit = zeros_lack(config.robot, config.zeros)
    return session


def await_board(
    board: Board, clock: Any, bus: Port | None = None, swapped: float = math.inf
) -> None:
    """Wait for a greeting and samples of the board. The bus is read only; nothing is written to it.

    A port without any byte is given up earlier than one on which a board may be starting.
    """
    begin, unasked = clock.now(), 0
    while board.clock.newest is None:
        unasked += 0 if bus is None else _unasked(bus)
        silent = not board.decoder.counters.received
        if silent and unasked and clock.now() > begin + swapped:
            raise BadInputError(
                f"--esp32: expected an antenna board, found silence, and {unasked} bytes on --bus "
                "that no servo was asked for; --esp32 and --bus are swapped"
            )
        patience = _SILENCE if silent else _GREETING
        if clock.now() > begin + patience:
            came = board.decoder.counters
            why = (
                f"{came.received} bytes and {came.good} frames; is it the right port, with the "
                "firmware on the board? Perhaps --esp32 and --bus are swapped; over UDP a board "
                "does not answer to a wrong key"
            )
            why = board.refusals[-1] if board.refusals else why
            raise BadInputError(
                f"--esp32: expected an antenna board within {patience:g} s, found {why}"
            )
        clock.sleep_until(clock.now() + _PATIENCE)
        board.poll(clock.now)
    if bus is not None:
        _require_quiet(bus, clock)


def _require_quiet(bus: Port, clock: Any) -> None:
    """Check that the bus sends nothing unasked: servos do not, an antenna board does."""
    _unasked(bus)
    clock.sleep_until(clock.now() + _QUIET)
    if (count := _unasked(bus)) >= _UNASKED:
        raise BadInputError(
            f"--bus: expected servos, which speak only if asked, found {count} bytes in "
            f"{_QUIET:g} s without a request; is it the port of another antenna board, or "
            "has the bus another master?"
        )


def _unasked(bus: Port) -> int:
    with contextlib.suppress(PortError):  # the bus has its own check
        return bus.drain()
    return 0


def require_servos(bus: Bus, robot: RobotSpec) -> None:
    """Check that all servos answer, are of the right model, well, and have the right settings."""
    try:
        bringup.require(bus, robot.models)
    except BringUpError as error:
        check = (
            f"check power, wiring, ids and baud {robot.baud}, or whether --esp32 and --bus are "
            "swapped"
        )
        more = f"`{typed('doctor')}` tells more, slow adapters too"
        cure = more if error.cure else f"{check}; {more}"
        echo = "; the adapter works, as it sends back what it gets" if bus.tally.echoes else ""
        raise BringUpError(f"--bus: {error}{echo}", cure) from None
    status = bringup.read_register(bus, robot.ids, XC430_W240["hardware_error_status"])
    if ill := [f"{', '.join(hardware_errors(b))} in servo {i}" for i, b in status.items() if b]:
        raise BringUpError(
            f"--bus: expected servos without a hardware error, found {'; '.join(ill)}; remove the "
            "cause (load, heat, supply), then reboot: switch the supply off and on"
        )
    rules = settings(robot)
    known = {
        name: bringup.read_register(bus, list(of), XC430_W240[name]) for name, of in rules.items()
    }
    if wrong := wrong_settings(known, robot):
        raise BringUpError(
            f"--bus: expected servos set for this robot, found {'; '.join(wrong)}; "
            f"`{typed('doctor', '--fix')}` puts it right"
        )
