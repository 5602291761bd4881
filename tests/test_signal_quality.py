"""S8: a session is armed only after both antennae were bent by hand, each on its own channel."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from twin_rig import Rig, rig

from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.report import Report
from antennate.hardware.safety.causes import Cause
from antennate.hardware.safety.session import Session
from antennate.params.safety import TouchCheckParams
from antennate.robots.antenna import AntennaSpec
from antennate.twin.board import TouchStimulus
from antennate.twin.config import TwinConfig
from antennate.types import Floats, State

TOUCHED = TwinConfig(touch=("left@0.5s", "right@2s"))
CONFIG = DriveConfig(dry_run=1.0, duration=1.0)
SHORT = TouchCheckParams(patience=4.0)


def driven(
    config: TwinConfig = TOUCHED,
    touch: TouchCheckParams | None = SHORT,
    arm: bool = True,
    spoil: Callable[[Rig], object] = lambda rig: None,
) -> tuple[Rig, Report, list[str]]:
    """A drive, how it went, and what was said on the way."""
    made = rig(config, touch=touch)
    spoil(made)
    for servo in made.robot.servos:
        servo.feed_watchdog(0.001)  # as bring-up does
    said: list[str] = []
    drive_config = CONFIG.model_copy(update={"touch": touch or SHORT})
    report = drive(made.session, drive_config, arm, lambda s, t: said.append(s.quality.status))
    return made, report, said


def swapped(made: Rig) -> None:
    """Let the board send each channel as the other."""
    board = made.session.board
    read = board.newest

    def exchange(now: float):
        timed = read(now)
        if timed is not None:
            from dataclasses import replace

            s = timed.sample
            timed = replace(timed, sample=replace(s, left=s.right, right=s.left))
        return timed

    board.newest = exchange  # type: ignore[method-assign]


class Inverted(TouchStimulus):
    def change(self, t: float, begun: float) -> Floats:
        return super().change(t, begun) * (-1, 1)


def inverted(made: Rig) -> None:
    """Let the left reading rise where it should fall."""
    made.robot.touch = Inverted(TOUCHED.touch, AntennaSpec())


def test_S8_a_robot_whose_antennae_were_bent_by_hand_is_armed() -> None:
    made, report, said = driven()
    assert report.refusal == ""
    assert report.safe
    assert made.session.tally.sent > 50
    asked = list(dict.fromkeys(line.split(" drift")[0] for line in said))
    assert asked == [
        "touch=(let go of both antennae)",
        "touch=(bend the left antenna towards the tail)",
        "touch=(let go of both antennae)",
        "touch=(bend the right antenna towards the tail)",
        "touch=passed",
    ] or asked == [
        "touch=(let go of both antennae)",
        "touch=(bend the left antenna towards the tail)",
        "touch=(bend the right antenna towards the tail)",
        "touch=passed",
    ]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (swapped, "the left antenna was asked for and the right channel answered"),
        (inverted, "the reading of the left antenna runs against its calibration"),
    ],
)
def test_S8_swapped_and_inverted_channels_are_refused_and_nothing_gets_torque(
    spoil: Callable[[Rig], object], said: str
) -> None:
    made, report, _ = driven(spoil=spoil)
    assert said in report.refusal
    assert made.clock.now() < 1.5  # at once
    assert made.session.tally.sent == 0
    assert not any(servo.torque for servo in made.robot.servos)


def test_S8_antennae_that_nobody_bends_are_refused_after_the_dry_run_was_extended() -> None:
    made, report, _ = driven(TwinConfig(touch=("left@0.5s",)))
    assert "no bend felt: bend the right antenna" in report.refusal
    assert made.clock.now() == pytest.approx(5.0, abs=0.1)
    assert made.session.tally.sent == 0


def test_S8_without_arm_the_dry_run_ends_on_time_and_refuses_nothing() -> None:
    made, report, _ = driven(TwinConfig(), arm=False)
    assert report.refusal == ""
    assert made.clock.now() == pytest.approx(1.0, abs=0.1)


def test_S8_a_check_that_is_skipped_is_shown() -> None:
    made, report, said = driven(TwinConfig(), touch=None)
    assert report.refusal == ""
    assert made.session.tally.sent > 50
    assert all(line.startswith("touch=skipped") for line in said)


def test_S8_an_arm_event_before_the_check_has_passed_is_not_accepted() -> None:
    made = rig(TwinConfig(), touch=SHORT)
    seen: list[tuple[Cause, ...]] = []

    def ask(session: Session, t: float) -> None:
        session.orders.arm = t > 0.5
        assert session.outputs is not None
        seen.append(session.outputs.refusal)

    drive(made.session, CONFIG, arm=False, on_tick=ask)
    assert (Cause.NOT_READY,) in seen
    assert made.session.outputs is not None
    assert made.session.outputs.state is State.OFF


@pytest.mark.parametrize("order", ["left", "left@2", "middle@2s", "left@-1s", "left@1es"])
def test_touches_that_do_not_exist_are_refused(order: str) -> None:
    with pytest.raises(BadInputError, match="--touch: expected left or right"):
        TouchStimulus([order], AntennaSpec())
