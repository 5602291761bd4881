"""`antennate drive`: a controller, or by `drive teleop` a person, on the real robot or its twin."""

from __future__ import annotations

import contextlib
import dataclasses
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic.dataclasses import dataclass

from antennate.antenna.calibration import Calibration
from antennate.cli import viewer
from antennate.cli.keys import END, pressed_keys, typed_keys
from antennate.cli.options import PageOptions, option
from antennate.cli.pages import page_of
from antennate.cli.recordings import NAME, Recordings, recordings
from antennate.cli.results import ResultOptions, folder_for, show_result
from antennate.cli.robot import PortOptions, at_hand, key_of, parse_robot, require_two_ports
from antennate.cli.terminal import BAD_INPUT, OK
from antennate.control.registry import BUILT_IN
from antennate.errors import BadInputError, ConfigError, LogError, OutputError
from antennate.hardware.config import DriveConfig, GoalsConfig, TeleopConfig
from antennate.hardware.driving.connect import connect
from antennate.hardware.driving.drive import Operator, drive
from antennate.hardware.driving.goals import GoalController
from antennate.hardware.driving.report import MANY, Recent
from antennate.hardware.driving.stopping import Arrival
from antennate.hardware.driving.teleop import Gamepad, KeyController
from antennate.hardware.joints import zeros_lack
from antennate.hardware.safety.session import Session
from antennate.host import HostClock, StopOnce, urgent
from antennate.messages import typed
from antennate.robots.spec import require_antennae
from antennate.studies.formats import to_json
from antennate.studies.report import View
from antennate.studies.run_files import LOG, LOG_PARTS
from antennate.telemetry.feed import Feed
from antennate.telemetry.header import Header, part, parts
from antennate.telemetry.reader import count
from antennate.telemetry.ticks import Tick
from antennate.telemetry.view.goals import ReceivedGoals
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

--protocol NAME|FILE makes recordings in place of a walk, step by step: joints alone while the robot
hangs, walks, pushes of the antennae. It says what you are to do; the space bar confirms it, or time
where there is no terminal. A HOLD or a FAULT ends it. Given again with --out of its folder, it goes
on with the step that was broken off.

A lost board or servo makes the robot hold; the watchdogs of the servos stop it if this program
dies. The exit code is 2 if it ended in a FAULT or without supply, if torque was refused or is not
off, if it was armed and never walked, if its log ended before the drive did, and if steps of a
protocol are left."""
TELEOP_DESCRIPTION = """\
Walk the real robot, or its twin, by keys: the arrows (or w, a, d, s) are FORWARD, TURN_L, TURN_R
and REVERSE, the space bar stands, o lets the antennae oscillate, q ends. All else is as with
`antennate drive`: the dry run, --arm, the supervisor, the log.

Hold a key: half a second without one and the robot stands. A reading that cannot be used stops it
too.

--gamepad takes the first stick or the cross of a gamepad instead, while a shoulder button (4 or 5,
L1 or R1) is held, and any other button for o. Without the button, or two seconds without an event
of the pad (--teleop.gamepad-silence), the robot stands. A pad that is unplugged ends the drive."""
_CAPTIONS = {"drive": "Readings, bending level, contact, maneuver and supervisor over time."}
VIEW = View("drive", DESCRIPTION, DriveConfig, viewer.tables, viewer.sentences, captions=_CAPTIONS)
TELEOP_VIEW = dataclasses.replace(
    VIEW, name="teleop", about=TELEOP_DESCRIPTION, config=TeleopConfig
)


@dataclass(frozen=True)
class DriveOptions(ResultOptions, PortOptions, PageOptions):
    """Whether to move."""

    arm: bool = option(False, "torque on after the dry run")
    until: Path | None = option(None, "end once this file exists, as of a light gate", "FILE")
    accept: bool = option(
        False, "walk by goals of joints from ROS 2, in place of a controller", needs=["--ros"]
    )
    tell: Path | None = option(
        None,
        "file or pipe for what a person is to do, such as the --orders of a twin; time confirms it",
        "FILE",
    )


def command(argv: Sequence[str]) -> int:
    """Drive until the duration is over or it is stopped."""
    model = GoalsConfig if "--accept" in argv else DriveConfig
    config, options = parse_robot("drive", DESCRIPTION, model, argv, DriveOptions)
    require_antennae(config.robot, "drive")
    if not config.protocol:
        if options.tell is not None:
            raise ConfigError("--tell: expected --protocol beside it, found none")
        return _walk(VIEW, config, options, argv)
    with recordings(config, options.tell) as course:
        return _walk(VIEW, config, options, argv, course.controller, course)


def _require_robot(config: DriveConfig, options: DriveOptions) -> None:
    """Refuse to arm a robot whose zeros are not known, and ports that are none."""
    if options.arm and (lack := zeros_lack(config.robot, config.zeros)):
        raise ConfigError(f"--arm: {lack}")
    for name in ("esp32", "bus"):
        if not getattr(options, name):
            raise ConfigError(f"--{name}: expected a serial port, found none{at_hand(options)}")
    require_two_ports(options)


def _walk(
    view: View,
    config: DriveConfig,
    options: DriveOptions,
    argv: Sequence[str],
    controller: Callable[[Session, DriveConfig], Controller] | None = None,
    course: Recordings | None = None,
) -> int:
    """Drive by the controller that is named, or by another one: the exit code.

    Args:
        view: The command, and how its result is shown.
        config: The robot, and for how long.
        options: Where it is, and whether it moves.
        argv: The words of the command.
        controller: Makes the controller once the session is there; None for the one that is named.
        course: The recordings that it makes, if any.
    """
    _require_robot(config, options)
    given, config = config, config.calibrated()
    name = config.controller if controller is None else NAME if course else view.name
    header = Header(
        controller=name,
        params=config.control,
        robot=config.robot,
        calibration=_calibration(given),
        protocol=course.protocol.model_dump(mode="json") if course else {},
    )
    identity = course.identity(header) if course else None
    key = key_of(options)
    with (
        page_of(options, idle=not options.accept, accept=options.accept)
        or contextlib.nullcontext() as page,
        _operator(config, options) as operator,
        folder_for(view, options, config, argv, identity, resume=bool(course)) as folder,
    ):
        folder.require_free(view.figures)
        if course is not None:
            course.go_on(folder)
        folder.keep_room()
        folder.claim_names(LOG_PARTS)
        with connect(config, options.esp32, options.bus, key) as session:
            if operator.stop is not None:
                operator.stop.closed = True  # until the first tick: from here on there is a result
            goals = ReceivedGoals(page.channel) if page is not None and options.accept else None
            if goals is not None:
                control, robot, now = config.control, config.robot, session.clock.now
                made = GoalController(control, robot, config.goals, goals.newest, now)
                session.control.controller = made
                config = config.model_copy(update={"controller": "goals"})
            elif controller is not None:
                session.control.controller = controller(session, config)
                config = config.model_copy(update={"controller": name})
            start = max(0, time.time_ns() - round(1e9 * session.clock.now()))
            header = header.model_copy(update={"start": start})
            file = None if page is None else page.channel.fileno()
            log = folder.path / LOG
            record = _Record(header, log, config.record_required, file, options.ros, course)
            result = _carry_out(view.name, config, session, options, record, operator, page)
            if goals is not None:
                result["goals"] = goals.counts
        if course is not None:
            result |= course.result(folder.path)
        try:
            folder.finish(result, ())
        finally:  # the robot's state is told even if it cannot be kept
            log = folder.path / (result["logs"] or [LOG])[0]
            own = controller is not None or goals is not None
            words = ["--controller", "open"] if own else []
            if config.controller not in BUILT_IN and not own:
                words = ["--controller", config.controller]
            more = [] if options.out else ["--out", str(folder.path)]
            again = typed("drive", *(word for word in argv if word != "--overwrite"), *more)
            _show(result, options, typed("replay", str(log), *words), again)
        ticks = 0 if result["pace"] is None else result["pace"]["ticks"]
        if result["logs"] and 0 < ticks <= _LONGEST_DRAWN:
            from antennate.telemetry.figure import drawn  # slow to import

            try:
                folder.write_figures({"drive": drawn(log)[1]})
            except (LogError, OutputError) as error:
                viewer.say(error)
    return BAD_INPUT if viewer.failed(result) or result["log_cut"] else OK


def _show(result: Mapping[str, Any], options: DriveOptions, replay: str, again: str) -> None:
    """Table and sentences; `replay` is the command that reads the log, `again` goes on."""
    told = f"What was read and decided: {replay}"
    if not result["logs"]:
        told = f"No log was kept: {viewer.log_failure(result)}."
    if result["armed"] and result.get("interrupted"):
        told = f"It goes on with {result['protocol']['left'][0]}: {again}\n{told}"
    show_result(result, options, viewer.tables(result), f"{viewer.sentences(result)}\n{told}")


@dataclasses.dataclass(frozen=True)
class _Record:
    """What the log begins with, its first file, whether it is required, and the file of a page.

    `every` says whether that gets each tick. A course may have a log already, and goes on with it.
    """

    header: Header
    log: Path
    required: bool
    page: int | None
    every: bool
    course: Recordings | None

    def words(self, number: int) -> list[str]:
        """The command line of the process that writes the n-th file."""
        more = [viewer.REQUIRED] if self.required else []
        more += [viewer.EVERY] if self.every else []
        more += [f"{viewer.PAGE}{file}" for file in self.files]
        file = part(self.log, number + (self.course.files if self.course else 0))
        return [sys.executable, "-m", viewer.MODULE, str(file), *more]

    @property
    def files(self) -> list[int]:
        """Files that this process needs."""
        return [] if self.page is None else [self.page]


def _calibration(config: DriveConfig) -> str:
    """The calibration files by side, as one JSON object; empty without one."""
    left = config.calibration
    files = {"left": left, "right": config.calibration_right or left} if left else {}
    tables = {
        side: Calibration.load(Path(file)).model_dump(mode="json") for side, file in files.items()
    }
    return to_json(tables) if tables else ""


def _carry_out(
    command: str,
    config: DriveConfig,
    session: Session,
    options: DriveOptions,
    record: _Record,
    operator: Operator,
    page: ViewProcess | None,
) -> dict[str, Any]:
    """Drive, with the log and the status line in a process of their own, as with a page."""
    course = record.course
    header = (course and course.header) or record.header
    feed = Feed(record.words, header.pack(), files=record.files)
    log = record.log
    unlogged, recent = False, Recent()

    def keep(session: Session, t: float) -> None:
        nonlocal unlogged, page
        tick = Tick.of(session, t)
        tick = course.continued(tick, record.header.start) if course else tick
        missed, out = recent.step(t, tick.missed), session.outputs
        late = missed > MANY and out is not None and out.torque
        if page is not None and late and not options.accept:  # else the goals would end, too
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
        report = drive(session, config, options.arm, keep, operator)
    report.refusal = report.refusal or session.unfit
    logs = [file.name for file in parts(log) if file.exists()]
    complete = feed.complete and bool(logs)
    why = feed.failure or ("" if complete else f"{log} is not there any more")
    head = {"schema": 1, "command": command, "controller": config.controller, "armed": options.arm}
    tail = {
        "priority": priority.value,
        "unlogged": 0 if complete else feed.offered - count(log) + (course.ticks if course else 0),
        "log_complete": complete,
        "log_cut": feed.failed or not logs,
        "log_failure": why,
        "logs": logs,
    }
    return head | report.result(session) | tail


@contextlib.contextmanager
def _operator(config: DriveConfig, options: DriveOptions) -> Iterator[Operator]:
    """Who may stop the drive: signals, a key that is let go, a file that comes."""
    with contextlib.ExitStack() as stack:
        stop = stack.enter_context(StopOnce(last=True))
        pressed = arrived = None
        if config.hold_to_run:
            pressed = stack.enter_context(pressed_keys("--hold-to-run"))
        if options.until is not None:
            if options.until.exists():
                raise ConfigError(
                    f"--until: expected no such file yet, found {options.until} of an earlier "
                    "drive; remove it"
                )
            arrived = stack.enter_context(Arrival(options.until))
        yield Operator(stop, pressed, arrived or (lambda: False), warn=viewer.warn)


@dataclass(frozen=True)
class TeleopOptions(DriveOptions):
    """Whether to move, and by what."""

    gamepad: Path | None = option(None, "gamepad in place of keys, as /dev/input/js0", "FILE")


def teleop(argv: Sequence[str]) -> int:
    """Walk by keys until q, the duration is over or it is stopped."""
    config, options = parse_robot(
        "teleop", TELEOP_DESCRIPTION, TeleopConfig, argv, TeleopOptions, without=("accept", "tell")
    )
    if config.hold_to_run:
        raise ConfigError(
            "--hold-to-run: expected none with teleop, which stands without a key, found it"
        )
    require_antennae(config.robot, "teleop")
    _require_robot(config, options)
    with _keys(options.gamepad, config.teleop.gamepad_silence) as keys:

        def controller(session: Session, calibrated: DriveConfig) -> KeyController:
            control, robot = calibrated.control, calibrated.robot
            return KeyController(control, robot, config.teleop, keys, session.clock.now)

        return _walk(TELEOP_VIEW, config, options, argv, controller)


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
