"""Signals that ask a drive to end, whatever a plugged-in controller makes of them."""

from __future__ import annotations

import contextlib
import signal
import threading
from typing import Any

import pytest
from twin_rig import Rig, rig

from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import Operator, drive
from antennate.host import STOPS, StopOnce
from antennate.twin.config import TwinConfig

CONFIG = DriveConfig(dry_run=0.5, duration=4.0)


@pytest.mark.parametrize("number", STOPS)
def test_B19_each_signal_that_ends_a_program_is_heard_until_nobody_shall_hear(number: int) -> None:
    before = [signal.getsignal(other) for other in STOPS]
    with StopOnce() as stop:
        assert not stop.received
        for other in (number, *STOPS):
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(other)
        assert stop.received
        stop.closed = True
        for other in STOPS:
            signal.raise_signal(other)
    assert [signal.getsignal(other) for other in STOPS] == before


def test_signals_are_left_alone_outside_the_main_thread() -> None:
    before, inside = [signal.getsignal(number) for number in STOPS], list[Any]()

    def look() -> None:
        with StopOnce():
            inside.extend(signal.getsignal(number) for number in STOPS)

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    assert inside == before


def walk_until(made: Rig, said: Any) -> None:
    """Replace what the controller does in one tick, the 50th of the walk and all after it."""
    session = made.session
    sound = session.control.controller.step

    def step(frame: Any) -> Any:
        if session.tally.sent >= 50:
            said()
        return sound(frame)

    session.control.controller.step = step  # type: ignore[method-assign]


@pytest.mark.parametrize("number", STOPS)
def test_B19_a_signal_that_a_controller_swallows_ends_the_walk_all_the_same(number: int) -> None:
    made = rig(TwinConfig())

    def swallow() -> None:
        with contextlib.suppress(BaseException):  # as a bare except does
            signal.raise_signal(number)

    walk_until(made, swallow)
    report = drive(made.session, CONFIG, arm=True)
    assert made.session.tally.sent <= 51
    assert report.safe
    assert not any(servo.torque for servo in made.robot.servos)


def test_B19_a_controller_that_swallows_a_signal_and_hangs_hears_the_next_one() -> None:
    made, tried = rig(TwinConfig()), list[int]()

    def hang() -> None:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            tried.append(1)
        signal.raise_signal(signal.SIGTERM)
        tried.append(2)

    walk_until(made, hang)
    report = drive(made.session, CONFIG, arm=True)
    assert tried == [1]
    assert report.safe


@pytest.mark.parametrize("during", ["stand", "release"])
def test_B19_no_signal_is_heard_once_the_walk_is_over_of_itself(during: str) -> None:
    made = rig(TwinConfig())
    sound = getattr(made.session, during)

    def again(*words: Any) -> Any:
        for number in STOPS:
            signal.raise_signal(number)
        return sound(*words)

    setattr(made.session, during, again)
    report = drive(made.session, CONFIG.model_copy(update={"duration": 0.5}), arm=True)
    assert made.session.tally.sent > 20
    assert report.on == []
    assert report.timing is not None
    assert not any(servo.torque for servo in made.robot.servos)


def test_B19_of_several_signals_none_interrupts_what_the_first_has_begun() -> None:
    def work() -> None:
        signal.raise_signal(signal.SIGTERM)

    with StopOnce() as stop:
        stop.within = work
        signal.raise_signal(signal.SIGTERM)
        assert stop.received
        with pytest.raises(KeyboardInterrupt):
            work()
        for number in STOPS:
            signal.raise_signal(number)


def test_B19_a_signal_that_came_before_the_first_tick_ends_the_drive_with_a_report() -> None:
    made, before = rig(TwinConfig()), [signal.getsignal(number) for number in STOPS]
    with StopOnce(last=True) as stop:
        stop.closed = True
        signal.raise_signal(signal.SIGHUP)
        report = drive(made.session, CONFIG, arm=True, operator=Operator(stop))
        assert signal.getsignal(signal.SIGHUP) == stop.receive
    for number, handler in zip(STOPS, before, strict=True):
        signal.signal(number, handler)
    assert report.ended == "a signal"
    assert report.timing is not None
    assert made.session.tally.sent == 0


@pytest.mark.parametrize("where", ["before", "within"])
def test_B19_a_tick_that_a_signal_ends_is_told_once_and_whole(where: str) -> None:
    """As a log is told of it, which is complete."""
    made, begun, told = rig(TwinConfig()), list[float](), list[float]()

    def strike(at: str) -> None:
        if at == where and len(begun) == 30:
            signal.raise_signal(signal.SIGINT)

    def watches() -> bool:
        strike("before")
        return True

    def on_tick(_: Any, t: float) -> None:
        begun.append(t)
        strike("within")
        told.append(t)

    report = drive(made.session, CONFIG, True, on_tick, Operator(watches=watches))
    assert (report.ended, report.safe) == ("a signal", True)
    assert report.timing is not None
    assert len(begun) == len(told) == report.timing.ticks == (31 if where == "before" else 30)


def test_torque_waits_until_somebody_sees_the_robot() -> None:
    made, asked = rig(TwinConfig()), [0]

    def watches() -> bool:
        asked[0] += 1
        if asked[0] < 300:  # 3 s, the dry run is over after 0.5
            assert not any(servo.torque for servo in made.robot.servos)
        return asked[0] >= 300

    config = CONFIG.model_copy(update={"duration": 1.0})
    report = drive(made.session, config, arm=True, operator=Operator(watches=watches))
    assert made.session.tally.sent > 50
    assert (report.ended, report.safe) == ("the end of its time", True)
