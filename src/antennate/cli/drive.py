"""`antennate drive`: the controller on the real robot, or on its twin."""

from __future__ import annotations

import contextlib
import dataclasses
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic.dataclasses import dataclass

from antennate.antenna.calibration import Calibration
from antennate.cli import viewer
from antennate.cli.addresses import PortOptions, at_hand, key_of, parse_robot, require_two_ports
from antennate.cli.exit_codes import BAD_INPUT, OK
from antennate.cli.keys import pressed_keys
from antennate.cli.options import option
from antennate.cli.results import ResultOptions, folder_for, tell
from antennate.cli.view_options import PageOptions, page_of
from antennate.control.readings import short_names
from antennate.errors import ConfigError, LogError, OutputError
from antennate.hardware.config import DriveConfig, RobotFile
from antennate.hardware.driving.connect import connect
from antennate.hardware.driving.drive import Operator, drive
from antennate.hardware.driving.report import MANY, Recent, late_sentence
from antennate.hardware.driving.stopping import Arrival, StopOnce
from antennate.hardware.host import Priority, urgent
from antennate.hardware.safety.causes import State, what_to_do
from antennate.hardware.safety.session import Session
from antennate.messages import typed
from antennate.robots.spec import require_antennae
from antennate.studies.formats import to_json
from antennate.studies.measures import Measure, Table
from antennate.studies.report import View
from antennate.studies.run_files import LOG, LOG_PARTS
from antennate.telemetry.feed import Feed
from antennate.telemetry.header import Header
from antennate.telemetry.parts import part, parts
from antennate.telemetry.reader import count
from antennate.telemetry.ticks import Tick
from antennate.types import Controller

if TYPE_CHECKING:
    from antennate.telemetry.view.process import ViewProcess

_LONGEST_DRAWN = 12_000
"""Most ticks of a log that is drawn for the report: it takes some four seconds."""

DESCRIPTION = """\
Let a controller walk the real robot, or its twin. First a dry run: everything is read and nothing
written. Then, with --arm only, torque comes on with every servo where it stands, and the robot
walks. Ctrl-C, Ctrl-\\, SIGTERM or a lost terminal ends it: command held, torque off,
verified.

A lost board or servo makes the robot hold; the watchdogs of the servos stop it if this program
dies. The exit code is 2 if it ended in a FAULT or without supply, if torque was refused or is not
off, if it was armed and never walked, and if its log ended before the drive did."""


@dataclass(frozen=True)
class Orders(ResultOptions, PortOptions, PageOptions):
    """Whether to move."""

    arm: bool = option(False, "torque on after the dry run")
    until: Path | None = option(
        None, "end once this file exists, as of a light gate, or of `twin --passed FILE`", "FILE"
    )


def command(argv: Sequence[str]) -> int:
    """Drive until the duration is over or it is stopped.

    Raises:
        AntennateError: A port, a servo or the board is not what is needed; nothing moved then.
    """
    config, orders = parse_robot("drive", DESCRIPTION, RobotFile.for_drive, argv, Orders)
    require_antennae(config.robot, "drive")
    return walk(VIEW, config, orders, argv)


def require_ports(orders: Orders) -> None:
    """Require both ports.

    Raises:
        ConfigError: One is not named, or they cannot be used.
    """
    for name in ("esp32", "bus"):
        if not getattr(orders, name):
            raise ConfigError(f"--{name}: expected a serial port, found none{at_hand(orders)}")
    require_two_ports(orders)


def walk(
    view: View,
    config: DriveConfig,
    orders: Orders,
    argv: Sequence[str],
    controller: Callable[[Session, DriveConfig], Controller] | None = None,
) -> int:
    """Drive by the controller that is named, or by another one: the exit code.

    Args:
        view: The command, and how its result is shown.
        config: The robot, and for how long.
        orders: Where it is, and whether it moves.
        argv: The words of the command.
        controller: Makes the controller once the session is there; None for the one that is named.

    Raises:
        AntennateError: A port, a servo or the board is not what is needed; nothing moved then.
    """
    require_ports(orders)
    given, config = config, config.calibrated()
    key = key_of(orders)
    with (
        page_of(orders, idle=True) or contextlib.nullcontext() as page,
        _operator(config, orders) as operator,
        folder_for(view, orders, config, argv) as folder,
    ):
        folder.without_trials()
        folder.claim_names(LOG_PARTS)
        with connect(config, orders.esp32, orders.bus, key) as session:
            if operator.stop is not None:
                operator.stop.closed = True  # until the first tick: from here on there is a result
            if controller is not None:
                session.control.controller = controller(session, config)
                config = config.model_copy(update={"controller": view.name})
            header = Header(
                controller=config.controller,
                params=config.control,
                robot=config.robot,
                start=max(0, time.time_ns() - round(1e9 * session.clock.now())),
                calibration=_calibration(given),
            )
            file = None if page is None else page.channel.fileno()
            record = _Record(header, folder.path / LOG, config.record_required, file)
            result = _carry_out(view.name, config, session, orders, record, operator, page)
        try:
            folder.finish(result, ())
        finally:  # the robot's state is told even if it cannot be kept
            other = "" if controller is None else " --controller open"
            log = folder.path / (result["logs"] or [LOG])[0]
            _tell(result, orders, f"{shlex.quote(str(log))}{other}")
        ticks = 0 if result["pace"] is None else result["pace"]["ticks"]
        if result["logs"] and 0 < ticks <= _LONGEST_DRAWN:
            try:
                folder.write_figures({"drive": _figure(log)})
            except (LogError, OutputError) as error:
                viewer.say(error)
    return BAD_INPUT if _failed(result) or result["log_cut"] else OK


def _figure(log: Path) -> Any:
    from antennate.telemetry.figure import drawn  # slow to import

    return drawn(log)[1]


@dataclasses.dataclass(frozen=True)
class _Record:
    """What the log begins with, its first file, whether it is required, and the file of a page."""

    header: Header
    log: Path
    required: bool
    page: int | None

    def words(self, number: int) -> list[str]:
        """The command line of the process that writes the n-th file."""
        more = [viewer.REQUIRED] if self.required else []
        more += [f"{viewer.PAGE}{file}" for file in self.files]
        return [sys.executable, "-m", viewer.__name__, str(part(self.log, number)), *more]

    @property
    def files(self) -> list[int]:
        """Files that this process needs."""
        return [] if self.page is None else [self.page]


def _calibration(config: DriveConfig) -> str:
    """The calibration files by side, as one JSON object; empty without one."""
    left = config.calibration
    files = {"left": left, "right": config.calibration_right or left} if left else {}
    found = {side: Calibration.load(Path(file)) for side, file in files.items()}
    tables = {side: each.model_dump(mode="json") for side, each in found.items()}
    return to_json(tables) if tables else ""


def _tell(result: Mapping[str, Any], orders: Orders, log: str) -> None:
    """Table and sentences; `log` are the words with which `replay` reads the log."""
    again = f"What was read and decided: {typed('replay')} {log}"
    again = again if result["logs"] else f"No log was kept: {_why(result)}."
    tell(result, orders, _tables(result), f"{_sentences(result)}\n{again}")


def _tables(result: Mapping[str, Any]) -> Sequence[Table]:
    name = result["controller"]
    return (Table.of("Drive", {short_names([name])[name]: result}, MEASURES, _note(result)),)


def _sentences(result: Mapping[str, Any]) -> str:
    held = result["worst_state"] == State.HOLD.name and result.get("worst_s", 0.0) >= _LONG
    told = f"{result['refusal']}; {result['why']}" if held or _failed(result) else ""
    cures = what_to_do(told)
    return "\n".join([_sentence(result), *late_sentence(result), *cures])


def _carry_out(
    command: str,
    config: DriveConfig,
    session: Session,
    orders: Orders,
    record: _Record,
    operator: Operator,
    page: ViewProcess | None,
) -> dict[str, Any]:
    """Drive, with the log and the status line in a process of their own, as with a page."""
    feed = Feed(record.words, record.header.pack(), files=record.files)
    log = record.log
    unlogged, recent = False, Recent()

    def keep(session: Session, t: float) -> None:
        nonlocal unlogged, page
        tick = Tick.of(session, t)
        if page is not None and (missed := recent.step(t, tick.missed)) > MANY:
            page.give_up(f"the loop missed {missed} ticks within a second; the drive goes on")
            page = None
        try:
            feed.send(tick.pack())
        except LogError as error:  # the robot walks on without this tick in its log
            feed.skip(str(error))
            if not unlogged:
                viewer.say(error)
            unlogged = True
        session.unrecorded = config.record_required and not feed.keeps

    operator = dataclasses.replace(operator, watches=lambda: feed.watched)
    with feed, urgent() as priority:
        report = drive(session, config, orders.arm, keep, operator)
    logs = [each.name for each in parts(log) if each.exists()]
    kept = feed.complete and bool(logs)
    why = feed.failure or ("" if kept else f"{log} is not there any more")
    head = {"schema": 1, "command": command, "controller": config.controller, "armed": orders.arm}
    tail = {
        "priority": priority.value,
        "unlogged": 0 if kept else feed.offered - count(log),
        "log_complete": kept,
        "log_cut": feed.failed or not logs,
        "log_failure": why,
        "logs": logs,
    }
    return head | report.result(session) | tail


@contextlib.contextmanager
def _operator(config: DriveConfig, orders: Orders) -> Iterator[Operator]:
    """Who may stop the drive: signals, a key that is let go, a file that comes."""
    with contextlib.ExitStack() as stack:
        stop = stack.enter_context(StopOnce(last=True))
        pressed = arrived = None
        if config.hold_to_run:
            pressed = stack.enter_context(pressed_keys("--hold-to-run"))
        if orders.until is not None:
            if orders.until.exists():
                raise ConfigError(
                    f"--until: expected no such file yet, found {orders.until} of an earlier "
                    "drive; remove it"
                )
            arrived = stack.enter_context(Arrival(orders.until))
        yield Operator(stop, pressed, arrived or (lambda: False))


_LONG = 1.0
"""Time in HOLD from which on somebody should look at its cause [s] (assumed)."""


def _failed(result: Mapping[str, Any]) -> bool:
    fault = result["worst_state"] in (State.FAULT.name, State.OFF.name)
    return fault or result["torque_off"] is False or bool(result["refusal"]) or _idle(result)


def _idle(result: Mapping[str, Any]) -> bool:
    """It was to walk, and never did."""
    return result["armed"] and not result["commands_sent"]


def _note(result: Mapping[str, Any]) -> str:
    lines: list[str] = []
    if result["priority"] == Priority.ORDINARY.value:
        lines.append("Real-time priority was not allowed; a busy machine will make it miss ticks.")
    if result.get("echoes"):  # results of older versions have none
        lines.append(
            "The adapter of the servo bus sends back what it gets (an echo); that was dropped."
        )
    if not result["log_complete"] and result["logs"]:
        files = f"Its files: {', '.join(result['logs'])}."
        lines.append(f"The log is not complete: {_why(result)}. {files}")
    return "\n".join(lines)


def _why(result: Mapping[str, Any]) -> str:
    """Why the log is not complete; results of older versions do not tell."""
    return result.get("log_failure") or "nothing is known of the reason"


def _sentence(result: Mapping[str, Any]) -> str:
    """What came out, in one sentence."""
    state = result["worst_state"]
    causes = [cause.removeprefix(f"{state} ") for cause in result["why"].split("; ")]
    why = f" ({'; '.join(causes)})" if result["why"] else ""
    time = result.get("worst_s")  # results of older versions have none
    worst = f"worst state {state}{f' for {time:.1f} s' if time else ''}{why}"
    torque, ended = _torque(result), f"ended by {result['ended']}"
    if result["refusal"]:
        more = f"; {worst}" if result["why"] and result["why"] not in result["refusal"] else ""
        return f"The robot was not armed: {result['refusal']}{more}; {torque}."
    if not result["armed"]:
        dry = "A dry run: nothing was written to the servos"
        return f"{dry}, {worst}; {ended}; --arm lets the robot walk."
    if _idle(result):
        return f"The robot never walked, no command was sent; {worst}; {ended}; {torque}."
    sent = f"{result['commands_sent']} commands of `{result['controller']}` were sent"
    shares = ", ".join(f"{name} {100 * s:.0f} %" for name, s in result["shares"].items() if s)
    walked = f"The robot walked for {result['walked_s']:.1f} s ({shares}): {sent}"
    return f"{walked}, {worst}; {ended}; {torque}."


def _torque(result: Mapping[str, Any]) -> str:
    if result["torque_off"] is None:
        return "torque never came on"
    if not result["servos_on"]:
        return "torque is off, verified"
    names = ", ".join(map(str, result["servos_on"]))
    return f"torque is NOT confirmed off: servos {names}; switch their supply off"


MEASURES = (
    Measure("pace.ticks", "ticks", form="d"),
    Measure("pace.missed_cycles", "missed ticks", form="d"),
    Measure("pace.missed_share", "missed", "%", scale=100.0),
    Measure("walking.missed_share", "missed since the walk began", "%", scale=100.0),
    Measure("pace.worst_lateness_s", "worst lateness", "ms", form=".1f", scale=1e3),
    Measure("pace.worst_tick_s", "worst tick", "ms", form=".1f", scale=1e3),
    Measure("frames", "frames", form="d"),
    Measure("crc_errors", "crc errors", form="d"),
    Measure("lost_samples", "lost samples", form="d"),
    Measure("resets", "resets", form="d"),
    Measure("missed_answers", "missed answers", form="d"),
    Measure("stale_answers", "stale answers", form="d"),
    Measure("unlogged", "unlogged ticks", form="d"),
    Measure("commands_sent", "commands sent", form="d"),
    Measure("commands_refused", "commands refused", form="d"),
    Measure("priority", "priority"),
)

_CAPTIONS = {"drive": "Readings, bending level, contact, maneuver and supervisor over time."}
VIEW = View("drive", DESCRIPTION, DriveConfig, _tables, _sentences, captions=_CAPTIONS)
