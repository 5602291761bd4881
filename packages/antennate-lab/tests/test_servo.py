"""Servo model and its fit: closed forms, the twin as another implementation, a real recording."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from servo_recordings import RATE, found_of, of_twin, written

from antennate.robots.servos import MODEL_NUMBERS, STEP, Course, ServosParams, XL330Params, replay
from antennate.types import Floats
from antennate_lab.servo.experiment import sentence

REAL = Path(__file__).parents[4] / "shared/data/servo_xl330_bam/raw"
GRAVITY_TORQUE = 0.4
LOAD = 0.005
HELD = {"friction": 0.0, "load_friction": 0.0}


def model(**changes: float) -> Floats:
    """A servo of round numbers, shape (1, 6)."""
    values = {
        "gain_divisor": 256.0,
        "stall_torque": 0.6,
        "no_load_speed": 10.0,
        "armature": 0.001,
        **HELD,
    }
    return np.array([[(values | changes)[name] for name in MODEL_NUMBERS]])


def course(
    seconds: float, goal: float, start: float = 0.0, torque: bool = True, gravity: float = 0.0
) -> Course:
    """One goal for one servo at rest."""
    shape = (round(seconds / STEP), 1)
    return Course(
        np.full(shape, goal),
        np.full(shape, torque),
        np.ones(shape),
        np.full(shape, start),
        np.zeros(shape),
        np.array([400.0]),
        np.array([LOAD]),
        np.array([gravity]),
    )


def test_full_drive_turns_it_at_the_no_load_speed() -> None:
    q = replay(model(), course(2.0, 1000.0))[:, 0, 0]
    assert (q[-1] - q[-101]) / (100 * STEP) == pytest.approx(10.0, rel=1e-6)


def test_it_speeds_up_with_the_time_constant_of_line_and_inertia() -> None:
    lag = (0.001 + LOAD) * 10.0 / 0.6
    q = replay(model(), course(0.3, 1000.0))[:, 0, 0]
    t = STEP * np.arange(len(q))
    assert q == pytest.approx(10.0 * (t - lag * (1.0 - np.exp(-t / lag))), abs=2e-4)


def test_a_weight_pulls_it_off_its_goal_by_torque_over_stiffness() -> None:
    q = replay(model(), course(5.0, 0.5, gravity=GRAVITY_TORQUE))[-1, 0, 0]
    gain = 400.0 / 256.0 * 4096 / (2 * math.pi) / 885
    assert 0.6 * gain * (0.5 - q) == pytest.approx(GRAVITY_TORQUE * math.sin(q), rel=1e-3)


@pytest.mark.parametrize(("ratio", "moves"), [(0.5, 1), (0.65, 0), (1.35, 0), (1.5, -1)])
def test_friction_of_the_load_holds_a_range_of_weights_and_no_more(
    ratio: float, moves: int
) -> None:
    """A motor of torque τ holds every weight from (1 - k) τ to (1 + k) τ."""
    gain = 400.0 / 256.0 * 4096 / (2 * math.pi) / 885
    weight = ratio * 0.6 * gain * (0.8 - 0.4) / math.sin(0.4)
    q = replay(model(load_friction=0.4), course(0.05, 0.8, 0.4, gravity=weight))[:, 0, 0]
    assert np.sign(q[-1] - 0.4) == moves


def test_without_torque_it_swings_as_a_pendulum_whose_friction_takes_its_share() -> None:
    """Small swings have the period of a pendulum; friction takes 2 f / (m g l) a half swing."""
    free = replay(model(), course(3.0, 0.0, 0.1, False, GRAVITY_TORQUE))[:, 0, 0]
    crossings = np.flatnonzero(np.diff(np.sign(free)) != 0) * STEP
    period = 2 * math.pi * math.sqrt((0.001 + LOAD) / GRAVITY_TORQUE)
    assert np.diff(crossings).mean() == pytest.approx(period / 2, rel=2e-3)
    assert abs(free).max() == pytest.approx(0.1, rel=1e-2)
    dry = replay(model(friction=0.002), course(3.0, 0.0, 0.1, False, GRAVITY_TORQUE))[:, 0, 0]
    turns = [
        dry[i] for i in range(1, len(dry) - 1) if (dry[i] - dry[i - 1]) * (dry[i + 1] - dry[i]) < 0
    ]
    assert abs(turns[0]) == pytest.approx(0.1 - 2 * 0.002 / GRAVITY_TORQUE, abs=3e-4)
    assert abs(turns[1]) == pytest.approx(0.1 - 4 * 0.002 / GRAVITY_TORQUE, abs=3e-4)


@pytest.mark.parametrize(
    ("number", "name"),
    [(1200, "xl330_m288"), pytest.param(1080, "xc430_w240", marks=pytest.mark.slow)],
)
@pytest.mark.slow
def test_the_twins_servo_is_identified_from_its_recording(
    number: int, name: str, tmp_path: Path
) -> None:
    """The twin's motor is another implementation, with the 128 of the manual."""
    files = [of_twin(tmp_path / f"{a}.json", number, 400, a, 4.0) for a in (0.6, 1.5)]
    found = found_of(*files, servo=name, fit=True)
    line = next(m for m in found.models if m.name == "line fitted")
    true = XL330Params() if number == 1200 else type(XL330Params()).__bases__[0]()
    assert line.gain_divisor == pytest.approx(128.0, rel=0.02)
    assert line.no_load_speed == pytest.approx(true.no_load_speed, rel=0.02)
    assert line.armature == pytest.approx(true.armature, rel=0.02)
    whole = found.models[-1]
    assert found.interval_over == "8 stretches of the recordings"  # 2 of 4 s, pieces of 1 s
    for name, fitted in (("no_load_speed", whole.no_load_speed), ("armature", whole.armature)):
        low, high = whole.interval_95[name]
        assert low < fitted < high
    assert whole.friction < 0.02 * true.stall_torque
    assert whole.load_friction < 0.02
    assert (whole.error_deg or 1.0) < 0.1


@pytest.mark.skipif(not REAL.is_dir(), reason="the recordings are not here")
@pytest.mark.slow
def test_a_real_servo_is_tracked_at_a_gain_that_was_not_fitted() -> None:
    found = found_of(*sorted(REAL.glob("*.json")), fit=True)
    models = {each.name: each for each in found.models}
    assert (models["data sheet, /128"].error_deg or 0.0) > 10.0
    assert models["data sheet, /256"].error_deg == pytest.approx(5.2, abs=0.5)
    assert all(abs(r.gain_divisor - 256) < 2 for r in found.recordings if r.gain_divisor)
    for name in ("whole model", "data sheet + friction"):
        held = models[name].held_out_deg.values()
        assert [error for error in held if error is None or error > 3.5] == []
        assert len(held) == 2


@pytest.mark.skipif(not REAL.is_dir(), reason="the recordings are not here")
def test_a_replay_of_the_real_servo_shows_that_its_divisor_is_256() -> None:
    found = found_of(*sorted(REAL.glob("*.json")))
    manual, sheet = (each.error_deg for each in found.models[:2])
    assert manual == pytest.approx(13.3, abs=0.5)
    assert sheet == pytest.approx(5.2, abs=0.5)


@pytest.mark.skipif(not REAL.is_dir(), reason="the recordings are not here")
def test_the_one_real_recording_that_stalls_is_named_with_its_error() -> None:
    """Its drive is 885 counts, all of it, while its position stays within a tick."""
    found = found_of(*sorted(REAL.glob("*.json")))
    stalls = [row for row in found.recordings if row.stalled]
    assert [row.name for row in stalls] == ["2026-01-15_10h29m21.json"]
    (row,) = stalls
    assert row.error_deg == max(each.error_deg or 0.0 for each in found.recordings)
    assert (row.error_stalled_deg or 0.0) > 3 * (row.error_else_deg or math.inf)
    assert row.lifted_n_m > (row.weight_stalled_n_m or math.inf)
    said = sentence(found)
    assert said.count("stalls: ") == 1
    assert f"{row.name} stalls: " in said


def test_stalls_are_times_at_rest_at_full_drive(tmp_path: Path) -> None:
    """Of 4 s: 1 s at rest with 500 counts, 1 s at rest at full drive, 2 s at full drive moving."""
    made = []
    for i in range(1000):
        t = i / RATE
        moving = max(0.0, t - 2.0)
        drive = 500 if t < 1.0 else 885
        made.append(
            {
                "timestamp": t,
                "position": 0.3 + moving,
                "goal_position": 1.5 + moving,
                "load": drive,
                "input_volts": 5.0,
                "torque_enable": True,
            }
        )
    still = written(tmp_path / "a.json", made, 400, mass=0.5, length=0.1)
    free = [entry | {"load": 100} for entry in made]
    other = written(tmp_path / "b.json", free, 400, mass=0.5, length=0.1)
    found = found_of(still, other)
    stall, rest = found.recordings
    assert stall.full_drive == pytest.approx(0.75, abs=0.01)
    assert stall.stalled == pytest.approx(0.25, abs=0.02)
    assert stall.supply_stalled_v == pytest.approx(5.0)
    assert stall.weight_stalled_n_m == pytest.approx(0.5 * 9.80665 * 0.1 * math.sin(0.3))
    assert (rest.full_drive, rest.stalled) == (0.0, 0.0)
    assert (rest.error_stalled_deg, rest.supply_stalled_v) == (None, None)
    always = replace(stall, stalled=1.0, error_else_deg=None)
    assert "° off then and -° else" in sentence(replace(found, recordings=[always]))


def entries(count: int = 300) -> list[dict[str, Any]]:
    """A shaft that creeps after its goal, a tick a sample."""
    step = 2 * math.pi / 4096
    return [
        {
            "timestamp": i / RATE,
            "position": i * step,
            "goal_position": (i + 3) * step,
            "torque_enable": True,
        }
        for i in range(count)
    ]


CHANGES: dict[str, Callable[[int, dict[str, Any]], Any]] = {
    "flag": lambda i, entry: i == 5 and entry.pop("torque_enable"),
    "time": lambda i, entry: i == 7 and entry.update(timestamp=6 / RATE),
    "degrees": lambda i, entry: entry.update(position=math.degrees(entry["position"])),
    "goals": lambda i, entry: entry.update(goal_position=2048.0),
    "nan": lambda i, entry: i == 9 and entry.update(position=math.nan),
    "off": lambda i, entry: entry.update(torque_enable=False),
    "still": lambda i, entry: entry.update(position=0.5),
    "gap": lambda i, entry: entry.update(timestamp=1000.0 * entry["timestamp"]),
    "short": lambda i, entry: None,
    "fine degrees": lambda i, entry: entry.update(
        position=math.degrees(0.3 * math.sin(i / 30)), goal_position=math.degrees(0.3)
    ),
    "once": lambda i, entry: entry.update(torque_enable=i == 0),
    "no supply": lambda i, entry: entry.update(input_volts=0),
    "tenths": lambda i, entry: entry.update(input_volts=50),
}
"""What is done to every entry."""


def broken(change: str) -> list[dict[str, Any]]:
    """Entries with one fault."""
    made = entries(10 if change == "short" else 300)
    for i, entry in enumerate(made):
        CHANGES[change](i, entry)
    return made


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("flag", "entry 5: expected torque_enable, true or false, found None"),
        ("time", "entry 7: expected timestamp to rise"),
        ("degrees", "are these degrees or ticks?"),
        ("goals", "are goals in degrees or ticks?"),
        ("nan", "entry 9: expected a finite number position"),
        ("off", "expected torque_enable to be true once"),
        ("still", "expected a shaft that moves"),
        ("short", "expected at least 50, found 10"),
        ("gap", "are times in seconds?"),
        ("fine degrees", "are these degrees or ticks?"),
        ("once", "expected torque for 1 s or longer"),
        ("no supply", "input_volts: expected 2.5 to 10 V, found 0"),
        ("tenths", "input_volts: expected 2.5 to 10 V, found 50"),
    ],
)
def test_a_recording_that_cannot_be_used_is_refused_in_one_line(
    change: str, says: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    path = written(tmp_path / "log.json", broken(change), 400)
    err = refused("servo", "--recording", str(path))
    assert says in err


@pytest.mark.parametrize(
    ("kp", "mass", "length", "says"),
    [
        (0, 0, 0, "expected a gain kp above 0, found 0"),
        (400, 490, 0.1, "is the mass in grams or the length in millimetres?"),
        (400, 0.49, 100, "is the mass in grams or the length in millimetres?"),
    ],
)
def test_a_gain_or_a_weight_that_cannot_be_is_refused_in_one_line(
    kp: float, mass: float, length: float, says: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    path = written(tmp_path / "log.json", entries(), kp, mass=mass, length=length)
    err = refused("servo", "--recording", str(path))
    assert says in err


def test_positions_that_are_finer_than_ticks_are_taken(tmp_path: Path) -> None:
    """As another encoder tells them, or a filter."""
    made = entries()
    for i, entry in enumerate(made):
        entry.update(position=0.3 * math.sin(i / 30), goal_position=0.3 * math.sin((i + 3) / 30))
    path = written(tmp_path / "log.json", made, 400)
    assert (found_of(path).models[-1].error_deg or 90.0) < 10.0


@pytest.mark.slow
def test_a_fit_does_not_depend_on_the_parameters_that_it_replaces(tmp_path: Path) -> None:
    """Nor does it leave them out: the model as given stands beside it."""
    file = of_twin(tmp_path / "a.json", 1200, 400, 1.0, 2.0)
    runs = [
        found_of(file, servos=servos, fit=True)
        for servos in (ServosParams(), ServosParams(xl330_m288=XL330Params(armature=0.02)))
    ]
    found = [{each.name: each for each in run.models} for run in runs]
    assert found[0]["whole model"] == found[1]["whole model"]
    assert found[0]["as given"].error_deg != found[1]["as given"].error_deg

    # halves that tell nothing, as where one has no motion
    whole = found[0]["whole model"]
    none = replace(whole, held_out_deg=dict.fromkeys(whole.held_out_deg))
    said = sentence(replace(runs[0], models=[none]))
    assert "where it was fitted; of no part of the recordings" in said


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (json.dumps({"kp": 400, "entries": entries()})[:-200], "is the file truncated?"),
        ("[]", "expected an object with a list `entries`"),
        (json.dumps({"mass": 0, "length": 0, "entries": entries()}), "a number kp beside entries"),
        (json.dumps({"kp": 400, "length": 0, "entries": entries()}), "a number mass"),
        ("[" * 100_000, "expected JSON"),
        ("", "expected JSON"),
    ],
)
def test_a_file_that_is_no_recording_is_refused_in_one_line(
    text: str, says: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    (tmp_path / "log.json").write_text(text)
    err = refused("servo", "--recording", str(tmp_path / "log.json"))
    assert says in err
