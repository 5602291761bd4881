"""What `jog` says of the torque, however it ends; before twin servos in invented time."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Callable

import pytest
from setup_rig import ROBOT, Box
from stated import STATED
from test_jog import Ready

from antennate.cli import main, setup
from antennate.hardware.setup.jog import Jog
from antennate.hardware.setup.servos import ServoSetup, joints_of
from dynamixel_bus.port import PortError

Typed = Callable[[], list[str]]


class HostTime:
    """The time of a wire as a host's clock."""

    def __init__(self, box: Box) -> None:
        self._wire, self.now = box.wire, box.wire.now

    def sleep_until(self, t: float) -> None:
        self._wire.sleep(t - self._wire.now())


class Typist:
    """`antennate setup jog` before yaw1, with keys from a function."""

    def __init__(self, patch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self.box = Ready().box
        self.servo = self.box.servos["yaw1"]
        self._patch, self._capsys = patch, capsys
        patch.setattr(setup, "opener_of", lambda *_: self.box.opener)
        patch.setattr(setup, "HostClock", lambda: HostTime(self.box))

    def ran(self, typed: Typed, *words: str) -> tuple[int, list[str]]:
        """Exit code and lines of stderr; without words zeros and directions are known."""

        def keys(wait: float) -> list[str]:
            self.box.wire.sleep(wait)
            return typed()

        self._patch.setattr(setup, "typed_keys", lambda: contextlib.nullcontext(keys))
        told = ["--bus", "the bus", "--robot.baud", str(ROBOT.baud), *(words or STATED)]
        code = main(["setup", "jog", *told])
        return code, self._capsys.readouterr().err.strip().splitlines()


@pytest.fixture
def typist(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Typist:
    return Typist(monkeypatch, capsys)


def test_it_ends_with_the_torque_off_and_says_so(typist: Typist) -> None:
    keys = iter("++q")
    code, lines = typist.ran(lambda: [next(keys)])
    assert (code, lines[-1]) == (0, "yaw1: torque is off, verified")


@pytest.mark.parametrize("way", [1, -1])
def test_a_joint_without_a_zero_goes_no_farther_on_a_later_visit(typist: Typist, way: int) -> None:
    """0.35 rad are 228 ticks from where it stood at first, however often one comes back to it."""
    box, yaw2 = typist.box, joints_of(ROBOT)[1]
    box.plug("yaw2")
    ServoSetup(box.opener, ROBOT, 0.02, box.wire.now).set_up(yaw2, ())
    box.plug("yaw1", "yaw2")
    typist.servo.place(2500.0)
    visit = [["+" if way > 0 else "-"] * 9, *[[]] * 60]
    keys = iter([*visit, ["n"], ["p"], *visit, ["n"], ["p"], *visit, ["q"]])
    code, lines = typist.ran(lambda: next(keys), "--jog.reach", "0.35")
    assert code == 0
    assert sum("yaw1: its zero or direction is not measured" in line for line in lines) == 3
    assert typist.servo.position == pytest.approx(2500 + way * 228, abs=12)


def test_a_servo_in_pwm_mode_is_refused_without_torque(typist: Typist) -> None:
    typist.servo.set("operating_mode", 16)
    keys = iter("++q")
    code, lines = typist.ran(lambda: [next(keys)])
    assert code == 2
    assert lines[0] == "yaw1: torque is off, verified"
    assert lines[1].startswith(
        "antennate setup jog: error: expected operating mode 3 of yaw1 (id 1, "
    )
    assert len(lines) == 2


def test_a_servo_that_falls_silent_is_named_beside_the_error(typist: Typist) -> None:
    def typed() -> list[str]:
        typist.box.plug()
        return ["+"]

    code, lines = typist.ran(typed)
    assert code == 2
    assert "torque is NOT confirmed off: servos [1]; switch their supply off" in lines
    assert "to take goal position" in lines[-1]
    assert lines[-1].endswith("found no answer; check its cable and its supply")


def test_a_bus_that_is_gone_is_no_torque_that_is_off(
    typist: Typist, monkeypatch: pytest.MonkeyPatch
) -> None:
    def gone(*_: object) -> bytes:
        raise PortError("the bus is gone")

    def typed() -> list[str]:
        monkeypatch.setattr(typist.box.wire, "write", gone)
        monkeypatch.setattr(typist.box.wire, "read", gone)
        return ["+"]

    code, lines = typist.ran(typed)
    assert code == 2
    assert lines[-2:] == [
        "torque is NOT confirmed off: servos [1]; switch their supply off",
        "antennate setup jog: error: the bus is gone",
    ]


def test_a_program_that_was_stopped_says_what_the_watchdog_did(typist: Typist) -> None:
    def typed() -> list[str]:
        typist.box.wire.sleep(1.0)
        return ["+"]

    code, lines = typist.ran(typed)
    assert code == 2
    assert "yaw1: torque is off, verified" in lines
    assert "its watchdog stopped it" in lines[-1]
    assert "Refused" not in lines[-1]


@pytest.mark.parametrize("moment", ["begin", "keys", "end"])
def test_signals_do_not_keep_the_torque_on(
    moment: str, typist: Typist, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin, end = Jog.begin, Jog.end

    def interrupted_begin(one: Jog) -> None:
        begin(one)
        if moment == "begin":
            signal.raise_signal(signal.SIGINT)

    def interrupted_end(one: Jog) -> list[int]:
        signal.raise_signal(signal.SIGINT)
        left = end(one)
        signal.raise_signal(signal.SIGTERM)
        return left

    def typed() -> list[str]:
        assert typist.servo.torque
        if moment == "keys":
            signal.raise_signal(signal.SIGINT)
        return ["q"]

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(Jog, "begin", interrupted_begin)
    monkeypatch.setattr(Jog, "end", interrupted_end)
    try:
        code, lines = typist.ran(typed)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert (code, lines[-1]) == (0, "yaw1: torque is off, verified")
    assert not typist.servo.torque
