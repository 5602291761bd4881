"""What a plugged-in controller may do to the one who drives it: nothing but fail."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_bad_poses import Robot
from twin_rig import rig

from antennate.control.registry import make_controller
from antennate.errors import ConfigError, in_one_line
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.safety.causes import Active, Cause
from antennate.hardware.safety.controller import Tracebacks
from antennate.params.control import ControlParams
from antennate.params.safety import SupervisorParams
from antennate.telemetry.ticks import Tick, angles_of
from antennate.twin.config import TwinConfig
from antennate.types import JointCommand, State


class Wordless(Exception):
    """One whose text cannot be had."""

    def __str__(self) -> str:
        raise SystemExit("no words")


class NoText(Exception):
    """One whose text is none."""

    def __str__(self) -> str:
        return 3  # type: ignore[return-value]


class NoNotes(Exception):
    """One that cannot be asked for the notes of a traceback."""

    @property
    def __notes__(self) -> list[str]:
        raise SystemExit("no notes")


ANY = [SystemExit(0), GeneratorExit(), asyncio.CancelledError(), Wordless(), NoText(), NoNotes()]


class Plugin:
    """A controller around ours."""

    def __init__(self, sound: Callable[[Any], JointCommand], owner: Any) -> None:
        self._sound, self._owner = sound, owner

    @property
    def maneuver(self) -> Any:
        return self._owner.maneuver

    @property
    def contact(self) -> Any:
        return self._owner.contact

    def step(self, frame: Any) -> JointCommand:
        return self._sound(frame)


@functools.cache
def robot() -> tuple[Robot, Any]:
    """One for all, whom no repetition makes a FAULT, and its own controller."""
    made = Robot(SupervisorParams(repeats=100, repeat_time=1e-6))
    return made, made.session.control.controller


class Driven:
    """An armed robot whose controller is replaced."""

    def __init__(self, kind: type[Plugin]) -> None:
        made, own = robot()
        self.session: Any = made.session
        self.session.control.controller = Plugin(made.controller_step, own)
        self.step()
        assert self.session.outputs.state < State.HOLD
        self.session.control.tracebacks = Tracebacks()
        self.session.control.controller = kind(made.controller_step, own)

    def step(self) -> Active | None:
        """One tick: the most severe cause, None if there is none."""
        session = self.session
        begin = session.clock.now()
        session.write(session.control.step(session.read()))
        session.clock.sleep_until(begin + session.period)
        causes = session.outputs.causes
        return causes[0] if causes else None


@pytest.mark.parametrize("error", ANY, ids=lambda error: type(error).__name__)
def test_T6_whatever_a_controller_raises_is_a_failure_of_it(error: BaseException) -> None:
    class Raises(Plugin):
        def step(self, frame: Any) -> JointCommand:
            raise error

    made = Driven(Raises)
    found = made.step()
    assert found is not None
    assert found.cause is Cause.FAILED
    assert type(error).__name__ in found.detail
    assert type(error).__name__ in made.session.control.tracebacks.kept[0]
    assert np.isnan(Tick.unpack(Tick.of(made.session, 1.0).pack()).angles).all()


def test_T6_a_controller_that_leaves_the_program_gets_the_torque_off_and_a_bad_end() -> None:
    made = rig(TwinConfig())
    sound = made.session.control.controller.step

    def step(frame: Any) -> JointCommand:
        if made.session.tally.sent >= 20:
            raise SystemExit(0)
        return sound(frame)

    made.session.control.controller.step = step  # type: ignore[method-assign]
    config = DriveConfig(dry_run=0.5, duration=4.0, fault_time=0.5)
    report = drive(made.session, config, arm=True)
    assert report.worst is State.FAULT
    assert "SystemExit" in report.why
    assert report.safe


def test_ctrl_c_in_a_controller_is_no_failure_of_it() -> None:
    class Interrupted(Plugin):
        def step(self, frame: Any) -> JointCommand:
            raise KeyboardInterrupt

    made = Driven(Interrupted)
    with pytest.raises(KeyboardInterrupt):
        made.step()


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("maneuver", np.array([2**64 - 1], np.uint64)),
        ("maneuver", np.array([-(2**63)])),
        ("contact", np.array([[2**40, 1]])),
    ],
)
def test_a_decision_too_large_for_a_log_is_a_failure_of_the_controller(
    name: str, said: Any
) -> None:
    made = Driven(type("Huge", (Plugin,), {name: said}))
    found = made.step()
    assert found is not None
    assert found.cause is Cause.FAILED
    assert f"expected {name} of shape" in found.detail
    Tick.of(made.session, 1.0).pack()


@pytest.mark.parametrize("error", [RuntimeError("x"), SystemExit(1)])
def test_what_a_controller_cannot_show_is_not_known_and_ends_nothing(error: BaseException) -> None:
    class Shy(Plugin):
        @property
        def b(self) -> Any:
            raise error

        @property
        def gait(self) -> Any:
            raise error

    made = Driven(Shy)
    made.step()
    tick = Tick.of(made.session, 1.0)
    assert np.isnan([*tick.level, tick.phase]).all()
    assert np.isfinite(tick.angles).all()


@pytest.mark.parametrize("error", [RuntimeError("x"), SystemExit(1)])
def test_B14_a_pose_that_raises_is_refused_as_a_pose(error: BaseException) -> None:
    class Odd:
        @property
        def yaw(self) -> Any:
            raise error

    class Poses(Plugin):
        def step(self, frame: Any) -> JointCommand:
            self._sound(frame)
            return Odd()  # type: ignore[return-value]

    made = Driven(Poses)
    found = made.step()
    assert found is not None
    assert found.cause is Cause.BAD_COMMAND
    assert "numbers in yaw" in found.detail
    assert np.isnan(angles_of(Odd(), 19)).all()  # type: ignore[arg-type]
    assert np.isnan(Tick.of(made.session, 1.0).angles).all()


def test_a_controller_that_changes_its_frame_changes_no_log() -> None:
    class Scribbles(Plugin):
        def step(self, frame: Any) -> JointCommand:
            command = self._sound(frame)
            frame.counts[:], frame.t[:] = 1234.0, 0.0
            return command

    made = Driven(Scribbles)
    made.step()
    tick = Tick.of(made.session, 1.0)
    assert tick.counts == tick.reading
    assert 1234.0 not in tick.counts
    assert tick.t > 1.0


def test_B14_a_pose_that_a_controller_changes_later_stays_as_it_was_judged() -> None:
    given: list[JointCommand] = []

    class Keeps(Plugin):
        def step(self, frame: Any) -> JointCommand:
            given.append(self._sound(frame))
            return given[-1]

    made = Driven(Keeps)
    made.step()
    kept = angles_of(made.session.control.command)
    given[-1].leg[:] = 100.0
    assert angles_of(made.session.control.command) == kept


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("import sys; sys.exit(0)", "SystemExit: 0"),
        ("class C:\n  def __init__(self, *given): raise SystemExit('a\\nb')", "SystemExit: a b"),
        ("class C:\n  def __init__(self, *given): raise GeneratorExit", "GeneratorExit"),
    ],
)
def test_a_controller_that_leaves_the_program_at_once_is_bad_input_in_one_line(
    text: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = f"plugin_{abs(hash(text))}"
    (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError) as found:
        make_controller(f"{name}:C", ControlParams())
    assert said in str(found.value)
    assert "\n" not in str(found.value)


def test_an_exception_of_many_words_is_cut() -> None:
    error = ValueError("word " * 100_000)
    kept = Tracebacks()
    kept.keep(1.0, error)
    assert len(in_one_line(error)) == 300
    assert len(kept.kept[0]) == 20_000
