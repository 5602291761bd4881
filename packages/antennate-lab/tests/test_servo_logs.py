"""`servo` on the log of `drive`: the same error as on the same numbers in JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from servo_recordings import found_of, of_twin, written

from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter

JOINT = "antenna_r_base"
ROBOT = RobotSpec()
PLACE = ROBOT.joint_names.index(JOINT)
NOWHERE = (math.nan,) * len(ROBOT.joint_names)
STANDING = 100
"""Ticks before torque is on."""


def put(angle: float) -> tuple[float, ...]:
    """The angles of all joints, of which one is known."""
    return (*NOWHERE[:PLACE], angle, *NOWHERE[PLACE + 1 :])


def tick(number: int, now: float, goal: float, position: float, on: bool) -> Tick:
    """A tick of a drive."""
    return Tick(
        number=number,
        t=now,
        now=now,
        counts=(2000.0, 2000.0),
        reading=(2000.0, 2000.0),
        level=(0.0, 0.0),
        contact=(0, 0),
        maneuver=0,
        phase=0.0,
        angles=put(goal),
        positions=put(position),
        state="OK" if on else "OFF",
        sent=number if on else 0,
    )


def as_log(recording: Path, path: Path) -> Path:
    """A recording as the log of a drive that stood without torque at first, far from its goal."""
    entries = json.loads(recording.read_text())["entries"]
    pairs = [(e["timestamp"], e["goal_position"], e["position"]) for e in entries]
    standing = [(0.01 * (i - STANDING), 1.0, pairs[0][2]) for i in range(STANDING)]
    with LogWriter(path, Header(controller="open", params=ControlParams(), robot=ROBOT)) as log:
        for i, (t, goal, position) in enumerate([*standing, *pairs], 1):
            log.write(tick(i, 5.0 + t, goal, position, i > STANDING))
    return path


def test_a_log_says_what_the_same_numbers_say_as_json(tmp_path: Path) -> None:
    file = of_twin(tmp_path / "a.json", 1200, 400, 0.8)
    log = as_log(file, tmp_path / "drive.mcap")
    whole, told = found_of(file), found_of(log, joint=JOINT)
    assert [each.error_deg for each in told.models] == pytest.approx(
        [each.error_deg for each in whole.models], rel=1e-3
    )
    (row,) = told.recordings
    assert row.p_gain == 400.0
    assert row.torque_share == pytest.approx(1500 / 1600)
    assert row.supply_v is None


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "a log needs --joint, one of yaw1"),
        (["--joint", "antenna_r"], "(did you mean antenna_r_base?)"),
        (["--joint", "leg_l0"], "a log needs --joint, one of yaw1"),
        (["--joint", "yaw1"], "expected --servo xc430_w240, the servo of yaw1, found xl330_m288"),
        (["--joint", "antenna_l_base"], "at least 50 ticks with a measured position"),
    ],
)
def test_a_log_that_cannot_serve_is_refused_in_one_line(
    words: list[str], says: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    log = as_log(of_twin(tmp_path / "a.json", 1200, 400, 0.8, 1.2), tmp_path / "drive.mcap")
    err = refused("servo", "--recording", str(log), *words)
    assert says in err


def test_a_joint_without_a_log_is_refused(tmp_path: Path, refused: Callable[..., str]) -> None:
    file = of_twin(tmp_path / "a.json", 1200, 400, 0.8, 1.2)
    assert "--joint: expected a log among the recordings" in refused(
        "servo", "--recording", str(file), "--joint", JOINT
    )


def as_drive(path: Path, ticks: list[Tick]) -> Path:
    """Ticks as a log."""
    with LogWriter(path, Header(controller="open", params=ControlParams(), robot=ROBOT)) as log:
        for each in ticks:
            log.write(each)
    return path


def following(count: int, first: int = 1, away: float = 0.0, **more: Any) -> list[Tick]:
    """Ticks of a shaft that creeps three ticks behind its goal, or that and some more [rad]."""
    step = 2 * math.pi / 4096
    made = [
        tick(i, 0.01 * i, (i + 3) * step + away, i * step, True)
        for i in range(first, first + count)
    ]
    return [replace(each, **more) for each in made]


def torque_share(ticks: list[Tick], tmp_path: Path) -> float:
    """In how much of a log goals counted."""
    log = as_drive(tmp_path / "drive.mcap", ticks)
    (row,) = found_of(log, joint=JOINT).recordings
    return row.torque_share


def test_a_joint_that_never_follows_is_refused(tmp_path: Path, refused: Callable[..., str]) -> None:
    log = as_drive(tmp_path / "drive.mcap", following(200, away=0.5))
    assert "expected a joint that follows its goals" in refused(
        "servo", "--recording", str(log), "--joint", JOINT
    )


def test_torque_stays_on_in_a_fault(tmp_path: Path) -> None:
    """causes.py: FAULT is a HOLD that only an arm event ends, and a HOLD keeps torque on."""
    ticks = following(200) + following(200, 201, state="FAULT", sent=200)
    assert torque_share(ticks, tmp_path) == 1.0


def test_a_fault_holds_the_last_goal_that_was_sent(tmp_path: Path) -> None:
    """What the controller decides meanwhile reaches no servo."""
    held = following(200) + [
        replace(each, angles=put(3.0), positions=put(203 * 2 * math.pi / 4096))
        for each in following(200, 201, state="FAULT", sent=200)
    ]
    log = as_drive(tmp_path / "drive.mcap", held)
    assert (found_of(log, joint=JOINT).models[-1].error_deg or 90.0) < 10.0


def test_a_servo_that_has_lost_its_torque_does_not_follow(tmp_path: Path) -> None:
    cause = "FAULT DISARMED: servos have lost their torque or their watchdog (servo 11)"
    lost = following(200, 201, state="FAULT", sent=200, causes=(cause,))
    assert torque_share(following(200) + lost, tmp_path) == 0.5


@pytest.mark.parametrize("state", ["OFF", "FAULT"])
def test_each_arming_begins_with_a_slow_approach(state: str, tmp_path: Path) -> None:
    """After an arm event goals come near slowly again, however far the joint is from them."""
    stopped = following(100, 201, state=state, sent=200)
    far = following(100, 301, 0.5, sent=300)
    far = [replace(each, sent=each.number) for each in far]
    ticks = following(200) + stopped + far + following(100, 401)
    counted = 300 if state == "OFF" else 400
    assert torque_share(ticks, tmp_path) == counted / 500


@pytest.mark.slow
def test_an_approach_does_not_count_in_a_fit(tmp_path: Path) -> None:
    """Nobody knows what the servo was told meanwhile; as a free shaft it would have to coast."""
    file = of_twin(tmp_path / "a.json", 1200, 400, 0.8, 3.0)
    entries = json.loads(file.read_text())["entries"]
    step = 2 * math.pi / 4096
    driven = [
        tick(i, 0.004 * i, e["goal_position"], e["position"], True)
        for i, e in enumerate(entries, 500)
    ]
    stands = [tick(i, 0.004 * i, 0.0, 0.0, False) for i in range(1, 500)]
    coming = [tick(i, 0.004 * i, 0.0, (500 - i) * 3 * step, True) for i in range(100, 450)]
    approached = [*stands[:99], *coming, *stands[449:]]
    found = list[tuple[float, float, float]]()
    for name, before in (("a", stands), ("b", approached)):
        log = as_drive(tmp_path / f"{name}.mcap", [*before, *driven])
        whole = found_of(log, joint=JOINT, fit=True, supply=5.0).models[-1]
        found.append((whole.gain_divisor, whole.no_load_speed, whole.armature))
    assert found[1] == pytest.approx(found[0], rel=0.01)


def test_a_fit_of_a_log_needs_the_supply(tmp_path: Path, refused: Callable[..., str]) -> None:
    log = as_drive(tmp_path / "drive.mcap", following(300))
    words = ["servo", "--recording", str(log), "--joint", JOINT]
    err = refused(*words, "--fit")
    assert "a fit needs the supply" in err
    assert "--supply: expected 2.5 to 10 V, found 50" in refused(*words, "--supply", "50")


def test_a_supply_that_is_given_says_what_a_supply_that_is_told_says(tmp_path: Path) -> None:
    file = of_twin(tmp_path / "told.json", 1200, 400, 0.8, 3.0)
    table = json.loads(file.read_text())
    for volts in (None, 6.0):
        for entry in table["entries"]:
            entry["input_volts"] = volts
        written(tmp_path / f"{volts}.json", table["entries"], 400)
    said = found_of(tmp_path / "None.json", supply=6.0)
    told = found_of(tmp_path / "6.0.json")
    nominal = found_of(tmp_path / "None.json")
    assert said.models == told.models
    assert said.recordings[0].supply_v == 6.0
    assert nominal.models[-1].error_deg != told.models[-1].error_deg


def test_a_supply_that_nothing_needs_is_refused(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    file = of_twin(tmp_path / "a.json", 1200, 400, 0.8, 1.2)
    assert "--supply: expected a recording that tells none" in refused(
        "servo", "--recording", str(file), "--supply", "5"
    )
