"""The boulder wall: definitions of jam and slip on made passages, and the command."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate.cli import main
from antennate.errors import SimulationError
from antennate.experiments.wall import experiment as wall
from antennate.experiments.wall.experiment import EXPERIMENT, Border, summarise
from antennate.experiments.wall.physics import (
    Traverse,
    WallConfig,
    WallTrial,
    classify,
    least_advance,
    longest_gap,
    longest_stick,
    passage,
)
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import compile_bench
from antennate.studies.pooling import frame

PERIOD = 0.01
SHORT = {"wall": {"travel": 0.03, "start": 0.005, "speed": 0.02}, "trials": 2}
STILL = {"stiffness": 0.0, "friction": 0.0, "base_angle": 0.0, "overlap": 0.0}


def passed(tip_mm: list[float], touching: list[bool]) -> Traverse:
    """A passage whose base moves 1 mm a sample."""
    n = len(tip_mm)
    zero = np.zeros(n)
    base = 1e-3 * np.arange(1, n + 1)
    touch = np.array(touching, float)
    return Traverse(
        base,
        1e-3 * np.array(tip_mm),
        touch,
        zero,
        zero,
        np.zeros((n, 6)),
        np.zeros((11, 7, 2)),
        np.zeros((3, 3)),
    )


def outcome_of(tip_mm: list[float], touching: list[bool], **rest: float) -> tuple[str, str]:
    config = WallConfig.model_validate({"wall": {"travel": 0.1, "start": 0.04, **rest}})
    row = classify(config.wall, 1, 0, "stiff", passed(tip_mm, touching))
    return row.outcome, row.outcome_after_start


def test_least_advance_is_over_windows_of_the_travel() -> None:
    base = np.array([0.0, 0.01, 0.02, 0.03, 0.04])
    tip = np.array([0.0, 0.01, 0.011, 0.012, 0.03])
    assert least_advance(base, tip, 0.02) == pytest.approx(0.002)
    assert least_advance(base, tip, 0.04) == pytest.approx(0.03)


def test_longest_stick_ends_where_the_tip_has_got_ahead() -> None:
    base = 1e-3 * np.arange(10)
    tip = 1e-3 * np.array([0.0, 1.0, 2.0, 2.1, 1.5, 2.2, 4.0, 5.0, 6.0, 7.0])
    assert longest_stick(base, tip, 1e-3) == pytest.approx(0.004)  # 2 mm to 6 mm
    assert longest_stick(base, np.zeros(10), 1e-3) == pytest.approx(0.009)
    assert longest_stick(base, 2 * base, 1e-3) == pytest.approx(0.001)


@pytest.mark.parametrize(
    ("touching", "from_start", "samples"),
    [
        ("..##..#...", False, 3),
        ("..##..#...", True, 3),
        ("....##..##", False, 2),
        ("....##..##", True, 4),
        ("..........", False, 10),
        ("##########", False, 0),
    ],
)
def test_longest_gap_counts_from_the_first_touch(
    touching: str, from_start: bool, samples: int
) -> None:
    touch = np.array([c == "#" for c in touching], float)
    assert longest_gap(touch, PERIOD, from_start) == pytest.approx(samples * PERIOD)


def test_a_tip_that_follows_and_touches_succeeds() -> None:
    assert outcome_of(list(range(100)), [True] * 100) == ("success", "success")


def test_a_tip_that_stands_for_over_19_mm_jams_and_early_jams_are_told_apart() -> None:
    early = [0.0] * 25 + [float(i) for i in range(75)]
    late = [float(i) for i in range(60)] + [60.0] * 25 + [60.0 + i for i in range(15)]
    short = [float(i) for i in range(60)] + [60.0] * 18 + [60.0 + i for i in range(1, 23)]
    assert outcome_of(early, [True] * 100) == ("jam", "success")
    assert outcome_of(late, [True] * 100) == ("jam", "jam")
    assert outcome_of(short, [True] * 100) == ("success", "success")


def test_the_largest_angle_of_a_hinge_is_over_all_hinges_and_to_both_sides() -> None:
    """The flex sensor ends before the sixth hinge, so its flex does not hold that angle."""
    seen = passed(list(range(100)), [True] * 100)
    seen.hinges[40] = np.radians([20.0, 20.0, 5.0, 5.0, 5.0, -31.0])
    seen.flex[40] = np.radians(55.0)
    row = classify(WallConfig().wall, 1, 0, "stiff", seen)
    assert (row.flex_max_deg, row.hinge_max_deg) == (pytest.approx(55.0), pytest.approx(31.0))


def test_contact_lost_for_over_800_ms_is_a_slip_and_a_jam_counts_before_it() -> None:
    tip = [float(i) for i in range(200)]
    lost = [True] * 90 + [False] * 85 + [True] * 25
    found = [True] * 90 + [False] * 79 + [True] * 31
    assert outcome_of(tip, lost, travel=0.2) == ("slip", "slip")
    assert outcome_of(tip, found, travel=0.2) == ("success", "success")
    assert outcome_of([0.0] * 200, lost, travel=0.2) == ("jam", "jam")


def test_uniform_chains_take_the_same_shapes_and_forces_scale() -> None:
    """No second force scale: no gravity, no film, no variation. Stiff is 3 times compliant."""
    config = WallConfig.model_validate(
        {
            **SHORT,
            "wall": {**SHORT["wall"], "gravity": "off", "speed": 0.004},
            "variation": STILL,
            "antenna": {"sensor_stiffness_n_mm_per_deg": 0.0},
        }
    )
    stiff, soft = (passage(config, arm, 0) for arm in ("stiff", "compliant"))
    assert np.degrees(abs(stiff.flex).max()) > 5.0
    assert np.median(np.degrees(abs(stiff.hinges - soft.hinges))) < 0.3
    both = (stiff.force > 0) & (soft.force > 0)
    assert np.median(stiff.force[both]) / np.median(soft.force[both]) == pytest.approx(3.0, rel=0.2)


def test_trials_share_their_chance_across_arms_and_differ_among_each_other() -> None:
    config = WallConfig.model_validate(SHORT)
    one, again, other = (
        passage(config, "descending", 0),
        passage(config, "descending", 0),
        passage(config, "descending", 1),
    )
    np.testing.assert_array_equal(one.tip, again.tip)
    assert abs(one.tip - other.tip).max() > 1e-5


def test_trouble_in_the_physics_is_an_invalid_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = wall.passage

    def burst(config: WallConfig, arm: str, trial: int, *watch: Any) -> Traverse:
        if trial == 1:
            raise SimulationError(7, "engine warning")
        return sound(config, arm, trial, *watch)

    monkeypatch.setattr(wall, "passage", burst)
    outcome = EXPERIMENT.run(
        WallConfig.model_validate({**SHORT, "profiles": ["stiff", "descending"]})
    )
    summary = outcome.result().profiles["stiff"]
    assert (summary.trials, summary.invalid) == (2, 1)
    assert summary.successes + summary.jams + summary.slips == 1
    assert "engine warning" in outcome.rows[1].reason
    assert outcome.result().paired["descending-stiff"].trials == 1


def test_command_writes_its_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "run"
    flags = ["--wall.travel", "0.03", "--wall.start", "0.005", "--wall.speed", "0.02"]
    flags += ["--trials", "1", "--profiles", "descending", "--workers", "1", "--out", str(out)]
    code = main(["bench", "wall", "--json", *flags])
    assert code == 0
    result = json.loads(capsys.readouterr().out)
    assert result == json.loads((out / "result.json").read_text())
    arm = result["profiles"]["descending"]
    assert arm["trials"] == 1
    assert arm["successes"] + arm["jams"] + arm["slips"] == 1
    ends = (0.2065, 1.0) if arm["successes"] else (0.0, 0.7935)  # Wilson's for one trial
    assert arm["wilson95"] == pytest.approx(ends, abs=1e-4)
    assert (out / "figures" / "wall.png").stat().st_size > 10_000
    assert (out / "figures" / "sticks.png").stat().st_size > 10_000


def test_the_configuration_of_a_run_with_a_solver_is_refused_with_what_to_do(
    there: Path, refused: Callable[..., str]
) -> None:
    """`config.toml` of each run of 0.1.0 names one, `mujoco` unless told otherwise."""
    (there / "config.toml").write_text('trials = 1\nsolver = "mujoco"\n')
    (there / "plan.toml").write_text(
        'experiment = "wall"\nvary = { solver = ["mujoco", "chain"] }\n'
    )
    for words in (["bench", "wall", "--config", "config.toml"], ["study", "plan.toml"]):
        assert "(it is gone: leave it out), found 'solver'" in refused(*words)


@pytest.mark.parametrize("words", [["bench", "wall"], ["bench", "touch"]])
def test_an_antenna_too_light_for_the_physics_is_refused_in_one_line(
    words: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    for flag, value in (("link-mass", "1e-16"), ("base-mass", "1e-16"), ("radius", "1e-200")):
        assert main([*words, f"--antenna.{flag}", value]) == 2
        said = capsys.readouterr().err
        assert "expected at least" in said
        assert "as the physics takes no body with less inertia" in said
        assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_lightest_antenna_that_is_taken_is_one_for_the_engine() -> None:
    """Inertia of a ball of 3 mm: 0.4 m r^2; the engine takes none below 1e-15."""
    least = 2e-15 / (0.4 * 0.003**2)
    light = AntennaSpec(link_mass=1.01 * least, base_mass=1.01 * least)
    assert compile_bench(WallConfig().physics, light).body_inertia[1:].min() > 1e-15
    with pytest.raises(ValueError, match=r"base_mass: expected at least 5\.56e-10 kg"):
        AntennaSpec(base_mass=0.99 * least)


def made(trial: int, outcome: Any, stick: float) -> WallTrial:
    """A trial with this outcome and a longest stick [mm]."""
    how: Any = {"outcome": outcome, "outcome_after_start": outcome, "longest_stick_mm": stick}
    return WallTrial(seed=1, trial=trial, profile="stiff", **how)


def test_the_border_of_a_jam_lies_between_the_sticks_beside_it() -> None:
    """Made trials with sticks of 17, 18 and 24 mm; an invalid one of 20 mm does not count."""
    sticks = {17.0: "success", 24.0: "jam", 18.0: "slip", 20.0: "invalid"}
    rows = [made(k, outcome, stick) for k, (stick, outcome) in enumerate(sticks.items())]
    result = summarise(WallConfig(), frame(rows))
    assert result.border == Border(at_mm=19.0, below_mm=18.0, above_mm=24.0)
    said = EXPERIMENT.sentence(result)
    assert "a jam if the base moves 19 mm" in said
    assert "1.0 mm below and 5.0 mm above" in said


def test_sticks_all_on_one_side_of_the_border_are_said_to_be() -> None:
    for said, outcome, stick, side in (
        ("In every trial the tip lagged more than 19 mm", "jam", 30.0, "below_mm"),
        ("In no trial did the tip lag more than 19 mm", "success", 10.0, "above_mm"),
    ):
        result = summarise(WallConfig(profiles=("stiff",)), frame([made(0, outcome, stick)]))
        assert getattr(result.border, side) is None
        assert said in EXPERIMENT.sentence(result)
