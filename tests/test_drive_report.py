"""What a drive says of itself: one that did not walk is never called well."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lockstep import BoardPort, LockstepClock
from stated import STATED
from twin_rig import Rig, rig

from antennate.cli import main
from antennate.control.registry import CONTROLLERS
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.connect import prepare
from antennate.hardware.driving.drive import Operator, drive
from antennate.hardware.driving.report import (
    Report,
    late_sentence,
    link_heights,
    raised_links,
)
from antennate.hardware.safety.causes import Cause, what_to_do
from antennate.hardware.safety.session import Session
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.params.control import ConditioningParams
from antennate.params.safety import SupervisorParams, TouchCheckParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.feed import Feed
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from antennate.types import AntennaFrame, Contact, JointCommand, State

CONFIG = DriveConfig(dry_run=0.5, duration=1.0, touch=TouchCheckParams(patience=2.0))

Act = Callable[[Rig, float], None]


def driven(act: Act, made: Rig | None = None, config: DriveConfig = CONFIG) -> tuple[Rig, Report]:
    made = made or rig(TwinConfig())

    def on_tick(session: Session, t: float) -> None:
        act(made, t)

    return made, drive(made.session, config, arm=True, on_tick=on_tick)


def silent(begin: float, end: float = 1e9) -> Act:
    """Let the board be silent for a time [s]."""

    def act(made: Rig, t: float) -> None:
        made.robot.board_silent = begin < t < end

    return act


def nothing(made: Rig, t: float) -> None:
    pass


def test_a_walk_without_trouble_is_no_hold_although_it_waits_for_its_first_decision() -> None:
    made, report = driven(nothing)
    assert report.worst <= State.DEGRADED
    assert "HOLD" not in report.why
    assert report.refusal == ""
    assert made.session.tally.sent > 75


def test_L8_torque_that_was_refused_is_asked_for_again_and_comes_when_the_board_does() -> None:
    made, report = driven(silent(0.4, 1.4))
    assert report.refusal == ""
    assert made.session.tally.sent > 75  # all of the duration, from torque on
    assert made.clock.now() == pytest.approx(1.6 + CONFIG.duration + CONFIG.stand, abs=0.3)


def test_L8_torque_that_is_refused_for_too_long_is_given_up_with_the_reason() -> None:
    made, report = driven(silent(0.4))
    assert "HOLD STALE: no fresh sample" in report.refusal
    assert made.clock.now() == pytest.approx(0.5 + 2.0, abs=0.2)
    assert report.on is None
    assert not made.session.touched


def test_L8_a_board_that_falls_silent_before_the_first_pose_is_a_hold() -> None:
    made, report = driven(silent(0.55))
    assert made.session.tally.sent == 0
    assert report.worst is State.HOLD
    assert report.why.startswith("HOLD STALE: no fresh sample")
    assert made.session.outputs is not None
    causes = [active.cause for active in made.session.outputs.causes]
    assert causes.index(Cause.STALE) < causes.index(Cause.UNKNOWN_CONTACT)


class Unsure:
    """Never knows whether it touches anything."""

    contact = np.full((1, 2), int(Contact.UNKNOWN))

    def __init__(self, sound: object) -> None:
        self._sound = sound

    def step(self, frame: AntennaFrame) -> JointCommand:
        command = self._sound.step(frame)  # type: ignore[attr-defined]
        self.maneuver = self._sound.maneuver  # type: ignore[attr-defined]
        return command


def test_a_controller_that_never_decides_is_a_hold() -> None:
    made = rig(TwinConfig())
    made.session.control.controller = Unsure(made.session.control.controller)
    made, report = driven(nothing, made)
    assert made.session.tally.sent == 0
    assert report.worst is State.HOLD
    assert "UNKNOWN_CONTACT" in report.why
    assert report.result(made.session)["worst_s"] == 0.0  # none of a lesser state


def test_B13_torque_that_went_off_while_walking_is_the_worst() -> None:
    def drain(made: Rig, t: float) -> None:
        if t > 0.9:
            for servo in made.robot.servos:
                servo.set("present_input_voltage", 90)

    made, report = driven(drain)
    assert made.session.tally.sent > 10
    assert report.worst is State.OFF
    assert "SUPPLY_OFF" in report.why


def test_why_is_of_the_longest_time_in_the_worst_state() -> None:
    """The board is silent for 0.25 s, and later a flex sensor is shorted for 0.7 s."""

    def act(made: Rig, t: float) -> None:
        silent(1.0, 1.25)(made, t)
        made.robot.hold(0, 0.0 if 1.7 < t < 2.4 else math.nan)

    config = CONFIG.model_copy(update={"duration": 2.5})
    made, report = driven(act, config=config)
    assert report.worst is State.HOLD
    assert "SHORT_LO" in report.why
    assert "STALE" not in report.why
    assert report.result(made.session)["worst_s"] == pytest.approx(0.7, abs=0.2)


@pytest.mark.ci
def test_S14_why_tells_a_hum_as_large_as_it_was() -> None:
    """Mains of 50.2 Hz alternate by 400 sin(0.4 pi t + 1): little at 1.75 s, 400 at 2.95 s."""

    def act(made: Rig, t: float) -> None:
        made.robot.converter.mains = 50.2
        made.robot.converter.hum = 400.0 if t > 1.75 else 0.0

    _, report = driven(act, config=CONFIG.model_copy(update={"duration": 4.0}))
    assert report.worst is State.HOLD
    sizes = [float(size) for size in re.findall(r"±(\d+) counts at 50 Hz", report.why)]
    assert sizes == pytest.approx([400.0, 400.0], rel=0.05)


def test_S14_a_hum_that_is_gone_keeps_the_torque_off_for_its_time() -> None:
    """It is seen for half a second of the dry run."""

    def act(made: Rig, t: float) -> None:
        made.robot.converter.mains = 50.0
        made.robot.converter.hum = 400.0 if t < 0.5 else 0.0

    _, report = driven(act, config=CONFIG.model_copy(update={"dry_run": 2.0}))
    assert report.on is None
    assert "HOLD NOISE" in report.refusal
    made = rig(TwinConfig())
    made.session.quality = SignalQuality(
        ConditioningParams(), limits=SupervisorParams(hum_time=1.0)
    )
    _, report = driven(act, made, CONFIG.model_copy(update={"dry_run": 2.0}))
    assert report.refusal == ""
    assert report.worst <= State.DEGRADED


def test_why_is_of_a_fault_rather_than_of_a_key_that_was_let_go() -> None:
    """The board is silent for 0.3 s; later nobody holds the key for longer."""
    held = True

    def act(made: Rig, t: float) -> None:
        nonlocal held
        silent(1.0, 1.3)(made, t)
        held = not 1.8 < t < 2.6

    made = rig(TwinConfig())
    config = CONFIG.model_copy(update={"duration": 2.5})
    report = drive(
        made.session,
        config,
        arm=True,
        on_tick=lambda session, t: act(made, t),
        operator=Operator(pressed=lambda: held),
    )
    assert report.worst is State.HOLD
    assert "STALE" in report.why
    assert "RELEASED" not in report.why


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Run the command before a twin in invented time, with a fault; its exit code."""

    def run(*words: str, fault: str = "", change: Callable[[Session], object] = bool) -> int:
        @contextlib.contextmanager
        def in_process(config: DriveConfig, *addresses: object) -> Iterator[Session]:
            robot = watched(TwinConfig(), 5)[0]
            faults = Faults([read(fault)] if fault else [], config.robot.ids)
            clock = LockstepClock(robot, faults)
            session = prepare(config, BoardPort(robot, clock), clock, clock)
            change(session)
            yield session

        monkeypatch.setattr("antennate.cli.drive.connect", in_process)
        ports = ["--esp32", "board", "--bus", "bus"]
        return main(["drive", *ports, *STATED, *words, "--out", str(tmp_path), "--overwrite"])

    return run


SILENT = "The robot was not armed: HOLD STALE: no fresh sample from the antenna board"


@pytest.mark.ci
@pytest.mark.parametrize(
    ("when", "check", "refused", "said"),
    [
        ("1.3s", False, True, SILENT),
        ("1.3s", True, True, SILENT),
        ("1.55s", False, False, "no command was sent; worst state HOLD for"),
    ],
)
def test_L8_a_drive_that_sent_no_pose_ends_with_2_and_says_so(
    when: str,
    check: bool,
    refused: bool,
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    shipped: Callable[..., int],
) -> None:
    monkeypatch.setattr(Feed, "watched", property(lambda feed: True))  # its time is invented
    words = f"--arm --{'' if check else 'no-'}touch-check --dry-run 0.5 --duration 1"
    assert shipped(*words.split(), "--touch.patience", "0.5", fault=f"esp32=silent@{when}") == 2
    text = " ".join(capsys.readouterr().out.split())
    assert said in text
    assert text.count("STALE") == 1
    assert "touch" not in text  # a check that could not be done is not the reason
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["worst_state"] == "HOLD"
    assert result["commands_sent"] == 0
    assert ("STALE" in result["refusal"]) == refused
    page = (tmp_path / "report.html").read_text()
    assert "<figcaption>Readings, bending level, contact, maneuver and supervisor" in page


def test_a_controller_that_does_not_exist_is_named_before_a_port_is_opened(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    ports = ["--esp32", "/no/board", "--bus", "/no/bus", "--out", str(tmp_path / "run")]
    said = refused("drive", *ports, "--controller", "clsoed")
    assert "controller: expected one of open, timed, paper, closed, closed-1, " in said
    assert "map" not in said  # which no robot can have
    assert "/no/board" not in said


@pytest.mark.ci
@pytest.mark.parametrize(
    ("fault", "cause", "skip"),
    [
        ("open_left", "OPEN", []),
        ("short_right", "SHORT_LO", ["--no-touch-check"]),
        pytest.param("open_left", "OPEN", ["--no-touch-check"], marks=pytest.mark.slow),
        pytest.param("short_right", "SHORT_LO", [], marks=pytest.mark.slow),
    ],
)
def test_S1_S2_a_wire_that_broke_before_arming_is_named_while_one_waits_and_at_the_end(
    fault: str,
    cause: str,
    skip: list[str],
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    shipped: Callable[..., int],
) -> None:
    words = "--arm --dry-run 1 --duration 1 --touch.patience 1"
    assert shipped(*words.split(), *skip, fault=f"esp32={fault}@0.3s") == 2
    said = capfd.readouterr()
    out = " ".join(said.out.split())
    last = [line for line in said.err.splitlines() if " maneuver=" in line][-1]
    assert f"OFF (NOT_ARMED: not armed yet; HOLD {cause}: " in last
    side = fault.split("_")[1]
    asked = f" | mend wire, plug or sensor of the {side} antenna, it is {cause}: "
    assert (asked in last) == (not skip)
    assert len(re.findall(rf"HOLD \(?{cause}: ", out)) == 1
    assert "--no-touch-check" not in out  # it would not help
    assert json.loads((tmp_path / "result.json").read_text())["worst_state"] == "HOLD"


@pytest.mark.ci
def test_a_drive_that_ends_before_its_first_tick_has_a_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], shipped: Callable[..., int]
) -> None:
    def interrupted() -> AntennaFrame:
        raise KeyboardInterrupt

    assert shipped("--dry-run", "0.5", change=lambda s: setattr(s, "read", interrupted)) == 0
    assert "A dry run: nothing was written to the servos" in capsys.readouterr().out
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["pace"], result["ended"]) == (None, "its controller")
    assert (tmp_path / "report.html").exists()


@pytest.mark.ci
def test_a_drive_without_a_log_says_so(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    shipped: Callable[..., int],
) -> None:
    monkeypatch.setattr("antennate.cli.viewer.MODULE", "this")  # `python -m this` keeps nothing
    assert shipped("--dry-run", "0.5") == 2
    out = " ".join(capsys.readouterr().out.split())
    assert "No log was kept" in out
    assert "antennate log replay" not in out
    result = json.loads((tmp_path / "result.json").read_text())
    assert (result["logs"], result["log_complete"]) == ([], False)
    assert result["unlogged"] == result["pace"]["ticks"] > 0


def late(every: int, pause: float = 0.012, loss: float = 0.0, duration: float = 1.0) -> Any:
    """The result of a drive: time [s] is lost in some ticks, and a share of answers on the bus."""
    made, ticks = rig(TwinConfig()), itertools.count(1)
    made.robot.bus.loss = loss

    def busy(made: Rig, t: float) -> None:
        if next(ticks) % every == 0:
            made.clock.sleep(pause)

    made, report = driven(busy, made, CONFIG.model_copy(update={"duration": duration}))
    return report.result(made.session)


@pytest.mark.parametrize(("pause", "named"), [(0.0, False), (0.012, True)])
def test_a_computer_that_is_late_is_named(pause: float, named: bool) -> None:
    """A loop that loses 12 ms in every tenth tick misses one tick or two of eleven or twelve."""
    result = late(10, pause)
    said = late_sentence(result)
    assert bool(said) == named
    if named:
        share = 100 * result["walking"]["missed_share"]
        assert 7.0 < share < 18.0
        assert (
            f"The computer was late: {share:.1f} % of ticks missed since the walk began" in said[0]
        )
    faulty = {**result, "why": "FAULT SILENT_SERVO: servos do not answer (servo 1)"}
    assert any("SILENT_SERVO may come from that" in one for one in late_sentence(faulty)) == named


@pytest.mark.ci
@pytest.mark.parametrize(("loss", "named"), [(0.0, False), (0.03, True)])
def test_where_one_tick_in_a_hundred_is_missed_missed_answers_tell_a_late_computer(
    loss: float, named: bool
) -> None:
    result = late(100, loss=loss, duration=4.0)
    assert 0.005 < result["walking"]["missed_share"] < 0.02
    said = late_sentence(result)
    assert bool(said) == named
    assert all(f"{result['missed_answers']} answers of servos" in one for one in said)


@pytest.mark.ci
def test_a_servo_that_falls_silent_ends_a_drive_with_what_to_do_and_no_word_of_the_computer(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    shipped: Callable[..., int],
) -> None:
    monkeypatch.setattr(Feed, "watched", property(lambda feed: True))  # its time is invented
    words = "--arm --no-touch-check --dry-run 0.5 --duration 3 --fault-time 1"
    assert shipped(*words.split(), fault="servo:7=silent@2s") == 2
    out = " ".join(capsys.readouterr().out.split())
    assert "SILENT_SERVO: servos do not answer (servo 7)" in out
    (cures,) = re.findall(r"What to do: (.*?) See docs/causes\.md\.", out)
    assert "check cables, plugs and supply of the servos (`antennate doctor`)" in cures
    assert "The computer was late" not in out
    assert "What to do" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    ("begin", "end", "worst"),
    [(9.0, 0.06, State.OK), (0.6, 0.75, State.HOLD), (0.0, 1.5, State.HOLD)],
)
def test_B19_a_drive_that_is_stopped_before_readings_can_be_there_blames_no_wire(
    begin: float, end: float, worst: State
) -> None:
    """The board is silent from a time on, and a signal comes at another [s]; twins are healthy."""
    made = rig(TwinConfig())
    start = made.clock.now()

    def act(made: Rig, t: float) -> None:
        made.robot.board_silent = t - start >= begin
        if t - start >= end:
            raise KeyboardInterrupt

    made.robot.board_silent = begin == 0.0
    made, report = driven(act, made, CONFIG.model_copy(update={"dry_run": 5.0}))
    assert report.worst is worst
    assert ("no fresh sample" in report.why) == (worst is State.HOLD)
    assert not (report.why and worst is State.OK)


@pytest.mark.parametrize("cause", [each for each in Cause if each.severity >= State.HOLD])
def test_each_cure_ends_as_a_sentence(cause: Cause) -> None:
    (said,) = what_to_do(f"{cause.severity.name} {cause.name}: x")
    assert re.fullmatch(r"What to do: [A-Z`].*[^?.][?.] See docs/causes\.md\.", said), said


def test_cures_of_causes_that_come_together_say_each_step_once_and_arming_last() -> None:
    names = ("WATCHDOG", "DISARMED", "BUS_ERROR", "SILENT_SERVO", "PAUSE")
    (said,) = what_to_do("; ".join(f"FAULT {name}: x" for name in names))
    for words in ("lose other programs", "check cables, plugs and supply", "drive --arm"):
        assert said.lower().count(words) == 1, said
    assert said.endswith("; then start `drive --arm` again. See docs/causes.md.")


TREAD = (0.0, -0.6, 0.0, 0.6, 0.0)
"""Links 0 and 1 are on a tread, 4 and 5 on the floor, 2 and 3 on the way up."""


@pytest.mark.parametrize(
    ("pitch", "heights"),
    [
        ((), (0,)),
        ((0.0,) * 5, (0, 0, 0, 0, 0, 0)),
        ((0.35, 0.0, 0.0, 0.0, 0.0), (20.6, 0, 0, 0, 0, 0)),
        ((-0.35, 0.0, 0.0, 0.0, 0.0), (-20.6, 0, 0, 0, 0, 0)),
        ((0.0, 0.0, 0.0, 0.0, 0.3), (159.6, 124.1, 88.7, 53.2, 17.7, 0)),
        (TREAD, (135.5, 135.5, 101.6, 33.9, 0, 0)),
        ((0.3, -0.3, 0.0, 0.0, 0.0), (-35.5, -17.7, 0, 0, 0, 0)),
    ],
    ids=["one link", "level", "head up", "head down", "ramp", "tread", "head below"],
)
def test_heights_of_links_add_up_from_a_level_tail(
    pitch: tuple[float, ...], heights: tuple[float, ...]
) -> None:
    """By hand, in mm: 60 sin(0.3) = 17.73, 60 sin(0.35) = 20.57, 60 sin(0.6) = 33.88."""
    assert 1e3 * link_heights(pitch, 0.12) == pytest.approx(heights, abs=0.06)


@pytest.mark.parametrize(
    ("pitch", "said"),
    [
        ((), ""),
        ((0.0,) * 5, ""),
        ((math.nan,) * 5, ""),
        ((0.33, 0.0, 0.0, 0.0, 0.0), ""),  # 19.4 mm
        ((0.35, 0.0, 0.0, 0.0, 0.0), "link 0 is raised: hold it"),
        ((0.0, 0.35, 0.0, 0.0, 0.0), "links 0 and 1 are raised: hold them"),
        ((0.0, -0.35, 0.35, 0.0, 0.0), "links 0, 1 and 2 are raised: hold them"),
        ((0.0, 0.0, 0.0, 0.0, 0.3), "links 0, 1, 2 and 3 are raised: hold them"),
        (TREAD, "links 0, 1, 2 and 3 are raised: hold them"),
        ((0.3, -0.3, 0.0, 0.0, 0.0), "links 2, 3, 4 and 5 are raised: hold them"),
    ],
)
def test_links_that_are_higher_than_the_lowest_are_to_be_held(
    pitch: tuple[float, ...], said: str
) -> None:
    assert raised_links(pitch, 0.12) == said


@pytest.mark.parametrize(("link_pitch", "said"), [(0.11, ""), (0.13, "link 0 is raised: hold it")])
def test_links_that_are_longer_rise_higher(link_pitch: float, said: str) -> None:
    """55 sin(0.34) = 18.3 mm, 65 sin(0.34) = 21.7 mm."""
    assert raised_links((0.34, 0.0, 0.0, 0.0, 0.0), link_pitch) == said


def raising(angle: float) -> type:
    """A controller that stands and raises both first links by an angle [rad]."""

    class Raising:
        def __init__(self, control: object, robot: RobotSpec, batch: int) -> None:
            shapes = robot.command_shapes(batch).items()
            self._command = JointCommand(**{name: np.zeros(shape) for name, shape in shapes})
            self._command.pitch[:, 1] = angle
            self.maneuver = np.zeros(batch, dtype=int)
            self.contact = np.zeros((batch, 2), dtype=int)
            self.level = np.zeros((batch, 2))

        def reset(self, rows: object, phase: float = 0.0) -> None:
            pass

        def step(self, frame: AntennaFrame) -> JointCommand:
            return self._command

    return Raising


@pytest.mark.parametrize(("angle", "warned"), [(0.35, True), (0.05, False)])
def test_links_in_the_air_are_told_before_torque_goes_off(
    angle: float, warned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(CONTROLLERS.added, "raising", raising(angle))
    made = rig(TwinConfig(robot=RobotSpec.named("scuttle3d")), "raising")
    told: list[tuple[str, bool, float]] = []

    def warn(text: str) -> None:
        torque = all(servo.torque for servo in made.robot.servos)
        told.append((text, torque, made.clock.now()))

    report = drive(made.session, CONFIG, arm=True, operator=Operator(warn=warn))
    assert report.on == []
    assert not any(servo.torque for servo in made.robot.servos)
    assert report.result(made.session)["held"] == report.held
    if not warned:
        assert (told, report.held) == ([], "")
        return
    [(text, torque, at)] = told
    assert (text, torque) == (report.held, True)
    assert text == "links 0 and 1 are raised: hold them"
    assert made.clock.now() - at >= CONFIG.stand - 0.02


def test_a_warning_that_fails_does_not_keep_torque_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTROLLERS.added, "raising", raising(0.35))
    made = rig(TwinConfig(robot=RobotSpec.named("scuttle3d")), "raising")

    def warn(text: str) -> None:
        raise RuntimeError(text)

    with pytest.raises(RuntimeError, match="links 0 and 1"):
        drive(made.session, CONFIG, arm=True, operator=Operator(warn=warn))
    assert not any(servo.torque for servo in made.robot.servos)
