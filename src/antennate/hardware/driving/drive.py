"""From two ports to a walking robot, and back to one without torque."""

from __future__ import annotations

import contextlib
import importlib
import math
from collections.abc import Callable, Iterator
from typing import Any, cast

from antennate.controller import ARMS, Controller
from antennate.errors import BadInputError, ConfigError
from antennate.hardware import roster
from antennate.hardware.driving.adapter import require_quick
from antennate.hardware.driving.decider import Decider
from antennate.hardware.driving.dry_run import DryRun
from antennate.hardware.driving.report import Report
from antennate.hardware.driving.session import Session
from antennate.hardware.driving.signals import StopOnce
from antennate.hardware.dynamixel import bringup
from antennate.hardware.dynamixel.answers import Timing
from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.dynamixel.bus import Bus
from antennate.hardware.dynamixel.tables import XC430_W240
from antennate.hardware.esp32.board import BOARD_BAUD, Board
from antennate.hardware.esp32.film import require_film
from antennate.hardware.host_clock import HostClock
from antennate.hardware.joints import Joints
from antennate.hardware.ports.finder import finder
from antennate.hardware.ports.port import Port, PortError
from antennate.hardware.ports.reconnecting import Reconnecting
from antennate.hardware.ports.twin_clock import twin_clock
from antennate.hardware.robot import RobotConfig
from antennate.hardware.safety.causes import State
from antennate.hardware.safety.trust import Trust
from antennate.loop import run_loop
from antennate.params import BusParams, DoctorParams, DriftParams, TouchCheckParams, number
from antennate.params.layout import LayoutParams
from antennate.records import AntennaFrame, Pose

_WHO = DoctorParams()
_PATIENCE = 0.05
DOUBT = BusParams().doubt_walking


class DriveConfig(RobotConfig):
    """The robot, its controller, and how long it runs."""

    controller: str = number(
        "closed", "1", "assumed: our best", "open, paper, closed, or MODULE:CLASS of your own"
    )
    dry_run: float = number(
        10.0, "s", "assumed: long enough to touch both antennae", "time before torque", ge=0, le=600
    )
    duration: float | None = number(
        None, "s", "assumed: until it is stopped", "time from torque on to off", gt=0
    )
    record_required: bool = number(
        False,
        "1",
        "assumed: a robot that walks matters more than its log",
        "whether the robot holds while no log of it is kept",
    )
    touch_check: bool = number(
        True,
        "1",
        "assumed: swapped channels turn the robot towards what it touches",
        "whether it is armed only after both antennae were bent by hand in the dry run",
    )
    touch: TouchCheckParams = TouchCheckParams()
    drift: DriftParams = DriftParams()
    fault_time: float = number(
        10.0,
        "s",
        "assumed: long enough to take hold of the robot",
        "time that it stands with torque after a fault",
        ge=0,
        le=600,
    )
    bus_return: float = number(
        30.0,
        "s",
        "assumed: long enough to put a plug back",
        "time that a lost servo bus is waited for, to take the torque off",
        ge=0,
        le=600,
    )
    stand: float = number(
        0.3,
        "s",
        "assumed: a step at half a hertz comes to rest",
        "time that the robot holds its pose before the torque goes off",
        ge=0,
        le=60,
    )
    swapped: float = number(
        1.5,
        "s",
        "assumed: half of the wait for a greeting, and no servo speaks unasked",
        "silence of the board, while the bus speaks unasked, that shows the two ports swapped",
        gt=0,
        le=60,
    )


@contextlib.contextmanager
def connect(
    config: DriveConfig, esp32: str, bus: str, key: bytes | None = None, clock: str = ""
) -> Iterator[Session]:
    """Open both ports, find who is there, and close them again afterwards.

    Args:
        config: The robot.
        esp32: Address of the antenna board, as `finder` takes it.
        bus: Address of the servo bus.
        key: Of a board behind udp://; empty for one without a key.
        clock: Address of the clock of a twin in lock-step; the host's time is taken if not given.

    Raises:
        ConfigError: A clock is given, but a port can be no twin's.
        PortError: A port cannot be opened.
        BadInputError: No antenna board speaks, or it is refused.
        BringUpError: The servos are not those expected.
    """
    with contextlib.ExitStack() as stack:
        if clock:
            twin = stack.enter_context(twin_clock(esp32, bus, clock, config.layout.baud))
            yield prepare(config, twin.esp32, twin.bus, twin)
            return
        lines: list[Port] = []
        for flag, address, baud in (
            ("--esp32", esp32, BOARD_BAUD),
            ("--bus", bus, config.layout.baud),
        ):
            line = Reconnecting(finder(address, baud, flag, key, config.network))
            stack.callback(line.close)
            lines.append(line)
        yield prepare(config, lines[0], lines[1], HostClock(), bus)


def prepare(
    config: DriveConfig, esp32: Port, bus: Port, clock: Any, path: str = "the bus"
) -> Session:
    """A session before two open ports, after both sides have said who they are.

    `path` is what the bus is called, for errors.
    """
    board = Board(esp32, config.limits.stale_age)
    await_board(board, clock, bus, config.swapped)
    require_film(board.hello, config.sensor_id)
    require_quick(bus, config.layout.ids[:3], config.layout.baud, clock.now, path)
    master = Bus(bus, Timing(config.layout.baud, doubt=DOUBT), clock=clock.now)
    require_servos(master, config.layout)
    board.count_anew(clock.now())
    return Session(
        board=board,
        bus=master,
        joints=Joints(config.layout),
        clock=clock,
        decider=decider(config),
        period=config.mind.period,
        conditioning=config.mind.conditioning,
        limits=config.limits,
        trust=Trust(
            config.mind.conditioning, config.drift, config.touch if config.touch_check else None
        ),
    )


def await_board(
    board: Board, clock: Any, bus: Port | None = None, swapped: float = math.inf
) -> None:
    """Wait for a greeting and samples; what the bus says unasked is read, and nothing written.

    A silent port is given up earlier than one on which a board may be starting.

    Raises:
        BadInputError: None came, and says what came instead; or the bus speaks unasked.
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
        patience = _WHO.silence if silent else _WHO.greeting
        if clock.now() > begin + patience:
            came = board.decoder.counters
            why = (
                board.refusals[-1]
                if board.refusals
                else (
                    f"{came.received} bytes and {came.good} frames; is it the right port, with the "
                    "firmware on the board? Perhaps --esp32 and --bus are swapped; over UDP a "
                    "board does not answer to a wrong key"
                )
            )
            raise BadInputError(
                f"--esp32: expected an antenna board within {patience:g} s, found {why}"
            )
        clock.sleep_until(clock.now() + _PATIENCE)
        board.poll(clock.now())
    if bus is not None:
        _require_quiet(bus, clock)


def _require_quiet(bus: Port, clock: Any) -> None:
    """No servo speaks unasked; an antenna board does."""
    _unasked(bus)
    clock.sleep_until(clock.now() + _WHO.quiet)
    if (count := _unasked(bus)) >= _WHO.unasked:
        raise BadInputError(
            f"--bus: expected servos, which speak only if asked, found {count} bytes in "
            f"{_WHO.quiet:g} s that nobody asked for; is it the port of another antenna board, or "
            "has the bus another master?"
        )


def _unasked(bus: Port) -> int:
    with contextlib.suppress(PortError):  # the bus has its own check
        return bus.drain()
    return 0


def require_servos(bus: Bus, layout: LayoutParams) -> None:
    """All servos are there, of the right model and in the right mode.

    Raises:
        BringUpError: Otherwise; names each id that is not, and the cure.
    """
    try:
        bringup.require(bus, roster.models(layout))
    except BringUpError as error:
        raise BringUpError(
            f"--bus: {error}; check power, wiring, ids and baud {layout.baud}, or whether --esp32 "
            "and --bus are swapped; `antennate doctor` tells more, slow adapters too"
        ) from None
    modes = bringup.read_register(bus, layout.ids, XC430_W240["operating_mode"])
    wanted = roster.modes(layout)
    if wrong := [i for i in layout.ids if modes[i] != wanted[i]]:
        raise BringUpError(
            f"--bus: expected operating mode 4 (extended position) of legs and 3 (position) of the "
            f"others, found another in servos {wrong}; set register 11 with torque off"
        )


def decider(config: DriveConfig) -> Decider:
    """The controller that the configuration names.

    Raises:
        ConfigError: There is none of that name.
    """
    name = config.controller
    if name in ARMS:
        return Controller(config.mind, name)
    module, _, made = name.partition(":")
    if not made:
        raise ConfigError(
            f"--controller: expected one of {', '.join(ARMS)} or MODULE:CLASS, found {name!r}"
        )
    try:
        return cast(Decider, getattr(importlib.import_module(module), made)(config.mind))
    except (ImportError, AttributeError, TypeError) as error:
        raise ConfigError(
            f"--controller: expected a class that takes ControllerParams, found {name!r}: {error}"
        ) from None


def drive(
    session: Session,
    config: DriveConfig,
    arm: bool,
    on_tick: Callable[[Session, float], None] = lambda session, t: None,
) -> Report:
    """A dry run, then, if `arm`, a walk; torque is off at the end whatever happens.

    After a FAULT it stands for `fault_time`, then ends; longer if the bus is gone and may return.

    Args:
        session: As from `connect`.
        config: For how long.
        arm: Whether torque may come on.
        on_tick: Called after every tick with the session and the time [s].

    Returns:
        How it went. After Ctrl-C the report is that of the way so far.
    """
    report, clock = Report(), session.clock
    start = clock.now()
    dry = DryRun(
        session.trust, config.dry_run, config.touch.patience, arm, config.duration or math.inf
    )
    failed_at = math.inf

    def failed(t: float) -> bool:
        """After a fault and a time to look at it: torque can be taken off now, or never."""
        nonlocal failed_at
        out = session.outputs
        if (
            out is not None
            and t > dry.over + config.limits.longest_arming
            and out.state >= State.FAULT
        ):
            failed_at = min(failed_at, t)
        if out is not None and out.state is State.OFF and t > failed_at:
            return True
        wait = max(config.fault_time, config.bus_return if session.mute else 0.0)
        return t >= failed_at + wait

    def go_on(frame: AntennaFrame, pose: Pose) -> bool:
        t = clock.now() - start
        dry.step(t)
        session.orders.arm = t >= dry.over
        report.refusal = dry.refusal
        report.watch(session)
        on_tick(session, clock.now())
        return t < dry.end and not failed(t)

    with StopOnce() as stop:
        try:
            try:
                run_loop(session, session, session.period, go_on)
            except KeyboardInterrupt:
                pass
            finally:
                stop.deaf = True
        finally:
            report.timing = None if session.timing is None else session.timing.report()
            report.on = _off(session, config.stand)
    return report


def _off(session: Session, stand: float) -> list[int] | None:
    """Stand for a moment, then torque off: ids that did not confirm it, None if it never was on."""
    if not session.touched:
        return None
    with contextlib.suppress(PortError):
        session.stand(stand)
    try:
        return session.release()
    except PortError:
        return list(session.joints.ids)
