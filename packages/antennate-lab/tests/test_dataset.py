"""Data sets: splits, bytes, files read back, and baselines against closed forms."""

from __future__ import annotations

import itertools
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import antennate
from antennate.antenna.sensor import counts
from antennate.cli import main
from antennate.control.gait import targets
from antennate.errors import SimulationError
from antennate.params.gaits import GaitParams
from antennate.robots.antenna import AntennaSpec
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.trial import make_world
from antennate_lab.dataset import experiment
from antennate_lab.dataset import features as looks
from antennate_lab.dataset.card import card
from antennate_lab.dataset.closed_form import closed_form, contact_places
from antennate_lab.dataset.columns import TASKS, Windows, columns_of
from antennate_lab.dataset.config import HISTORY, KINDS, SPLITS, DatasetConfig, split_of
from antennate_lab.dataset.episodes import Draw, HeadTurn, drawn, gap_windows, setting
from antennate_lab.dataset.estimates import (
    BASELINES,
    LengthErrors,
    by_episode,
    estimates,
    neighbours,
    polynomial,
    score,
)
from antennate_lab.dataset.experiment import EXPERIMENT, KindSummary, by_kind
from antennate_lab.dataset.walk import axis_of, walk_windows

SMALL: dict[str, Any] = {
    "trials": 10,
    "walk": {"time": 2.5, "windows": 2, "stride": 0.5},
    "physics": {"timestep": 0.0025, "contact_time": 0.005},
    "bench": {"timestep": 0.002, "contact_time": 0.004},
}
EXACT = {"stiffness": 0.0, "gain": 0.0, "friction": 0.0, "joint_zero": 0.0}
"""No antenna differs from another."""
SILENT = {
    "sample_noise_counts": 0.0,
    "common_noise_counts": 0.0,
    "outlier_share": 0.0,
    "hysteresis": 0.0,
    "creep": [0.0, 0.0],
}


@pytest.fixture(scope="module")
def outcome() -> Any:
    return EXPERIMENT.run(DatasetConfig.model_validate(SMALL))


def test_no_episode_is_in_two_splits_and_more_episodes_change_none(outcome: Any) -> None:
    for windows in by_kind(outcome).values():
        by_split = [set(windows["episode"][windows["split"] == name]) for name in SPLITS]
        assert sum(map(len, by_split)) == len(set(windows["episode"]))
    assert [split_of(k) for k in range(10)] == [split_of(k) for k in range(10, 20)]
    assert {split_of(k) for k in range(10)} == set(SPLITS)


def test_held_out_antennae_and_speeds_are_in_their_own_split_alone() -> None:
    config = DatasetConfig()
    for kind in KINDS:
        for episode in range(40):
            draw, split = drawn(config, kind, episode), split_of(episode)
            assert (draw.profile == config.held_out_profile) == (split == "test_antenna")
            low, high = config.held_out_speeds
            assert (low <= draw.factor <= high) == (split == "test_speed")


@pytest.mark.ci
def test_two_workers_write_the_same_bytes_and_so_does_a_run_that_goes_on(
    tmp_path: Path,
) -> None:
    pytest.importorskip("pyarrow", reason="the extra `parquet` is not installed")
    few = DatasetConfig.model_validate(SMALL | {"kinds": ["gap", "push"]})
    more = few.model_copy(update={"trials": 12})
    antennate.run(few, out=tmp_path / "grown")
    antennate.run(more, out=tmp_path / "grown", resume=True)
    antennate.run(more, workers=2, out=tmp_path / "fresh")
    for name in ("gap.parquet", "push.parquet", "README.md", "result.json", "trials.csv"):
        grown, fresh = ((tmp_path / folder / name).read_bytes() for folder in ("grown", "fresh"))
        assert grown == fresh


def test_files_are_read_back_with_units_and_roles(outcome: Any, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `parquet` is missing")
    for name, make in EXPERIMENT.files(outcome.config).items():
        content = make(outcome)
        data = content.encode() if isinstance(content, str) else content
        assert data is not None
        (tmp_path / name).write_bytes(data)
    for kind in KINDS:
        table = parquet.read_table(tmp_path / f"{kind}.parquet")
        about = json.loads(table.schema.metadata[b"antennate.dataset"])
        assert (about["kind"], about["rate_hz"], about["history"]) == (kind, 100.0, HISTORY)
        fields = {field.name: field.metadata for field in table.schema}
        assert fields["counts_left"] == {
            b"unit": b"count",
            b"role": b"input",
            b"meaning": b"readings of the left antenna",
        }
        assert {f[b"unit"] for f in fields.values() if f[b"role"] == b"label"} <= {b"m", b"rad"}
        frame = table.to_pandas()
        windows = by_kind(outcome)[kind]
        assert (np.stack(frame["counts_right"]) == windows["counts_right"]).all()
        assert frame["split"].tolist() == windows["split"].tolist()
    text = (tmp_path / "README.md").read_text()
    every = {c.name for kind in KINDS for c in columns_of(kind, RobotSpec())}
    assert all(f"`{name}`" in text for name in every)


def test_labels_are_never_inputs_and_inputs_are_what_a_robot_reads() -> None:
    robot = RobotSpec()
    for kind in KINDS:
        inputs = {c.name for c in columns_of(kind, robot) if c.role == "input"}
        assert inputs <= {"counts_left", "counts_right", *robot.joint_names}
        labels = {c.name for c in columns_of(kind, robot) if c.role == "label"}
        assert labels == {task.label for task in TASKS if task.kind == kind}


@pytest.mark.ci
def test_estimates_do_not_see_labels_of_tests_nor_truth(outcome: Any) -> None:
    """Estimates stay when all that a robot does not have is changed where nothing is learned."""
    config = outcome.config
    for task in TASKS[:4]:
        windows = by_kind(outcome)[task.kind]
        hidden = dict(windows)
        known = np.isin(windows["split"], ("train", "validation"))
        for column in columns_of(task.kind, config.robot):
            if column.role in ("label", "truth") and column.dtype != "str":
                hidden[column.name] = np.where(known, windows[column.name], 77.0)
        before, after = (estimates(config, task, w)[0] for w in (windows, hidden))
        for name, values in before.items():
            np.testing.assert_array_equal(values, after[name])


def test_the_width_of_a_gap_is_that_of_its_two_distances() -> None:
    config = DatasetConfig.model_validate({"gap": {"tilt": 0.3}})
    for episode in range(3):
        windows = gap_windows(config, drawn(config, "gap", episode))
        between = config.robot.antenna.base_spacing * math.cos(windows["tilt_rad"][0])
        wide = windows["distance_left_m"] + windows["distance_right_m"] + between
        assert windows["gap_m"] == pytest.approx(wide, abs=1e-12)


def test_without_noise_the_closed_form_tells_a_gap() -> None:
    """Statics of a frictionless tip against the engine, where nothing else is in the way."""
    config = DatasetConfig.model_validate(
        {
            "antennae": EXACT,
            "gap": {"tilt": 0.0, "frequency": 0.2, "distance": [0.6, 0.85]},
            "robot": {"antenna": {"friction": 0.0, "sensor": SILENT}},
        }
    )
    for episode in range(3):
        windows = gap_windows(config, drawn(config, "gap", episode))
        guess = closed_form(config, "gap", {**setting(drawn(config, "gap", 0), 0, 1), **windows})
        assert guess == pytest.approx(windows["gap_m"], rel=0.002)


@pytest.mark.ci
@pytest.mark.parametrize("depth", [0.1, 0.2])
@pytest.mark.parametrize("place", [0.08, 0.1])
def test_without_noise_the_closed_form_tells_the_place(place: float, depth: float) -> None:
    """Statics against the engine, slowly: the damping of a hinge lags by 0.04 s, 6 mrad here."""
    config = DatasetConfig.model_validate({"robot": {"antenna": {"friction": 0.0}}})
    antenna = config.robot.antenna
    turn = HeadTurn(config, antenna, 0.15)
    seen = turn.against(turn.post(place, depth, 0.003))
    flex = abs(seen.flex)
    first = int(np.argmax(flex >= 0.05))
    guess = contact_places(
        *(antenna, config.robot.link_pitch, antenna.radius + 0.003, float(flex[first])),
        *(seen.turn[[first]], seen.turn[[-1]], flex[[-1]]),
    )
    assert guess[0] == pytest.approx(seen.place, abs=0.001)
    assert seen.place < place  # the antenna bends round the post


def test_the_head_turns_as_a_rigid_body_about_its_yaw_joint() -> None:
    turn = HeadTurn(DatasetConfig(), AntennaSpec(), 0.4)
    reach = math.hypot(0.12, 0.02)
    for angle in (-0.3, 0.0, 0.5):
        assert np.hypot(*turn.base(angle)) == pytest.approx(reach)
    assert turn.angle(0.0) == pytest.approx(-turn.angle(2.0))


def test_the_pose_of_the_head_is_that_of_the_engine() -> None:
    """By the yaw joints alone, against the links that the engine has moved."""
    config = DatasetConfig.model_validate({"antennae": EXACT})
    robot = config.robot
    yaw = np.array([0.2, -0.1, 0.3, 0.1, -0.2])
    windows = {
        name: np.full((1, 1), angle) for name, angle in zip(robot.yaw_names, yaw, strict=True)
    }
    world = make_world(config.physics, robot, FlatScene().draw(robot, np.random.default_rng(0)))
    legs = targets(GaitParams(), robot, np.zeros(1), np.zeros(1), lifting=False).leg[0]
    world.place(0.3, 0.2, 0.7, yaw, legs)
    x, y, angle = (float(part[0, 0]) for part in looks.head_pose(config, windows))
    axis = float(axis_of(world.links()))
    off = world.links()[0] - world.links().mean(axis=0)
    assert angle == pytest.approx(0.7 - axis, abs=1e-6)
    assert x == pytest.approx(off @ [math.cos(axis), math.sin(axis)], abs=1e-6)
    assert y == pytest.approx(off @ [-math.sin(axis), math.cos(axis)], abs=1e-6)


@pytest.mark.ci
def test_walls_on_both_sides_are_walked_and_told_apart() -> None:
    config = DatasetConfig.model_validate({"walk": {"distance": [0.14, 0.17], "angle": [0.1, 0.2]}})
    sides = set()
    for episode in range(6):
        windows = walk_windows(config, drawn(config, "walk", episode))
        for row, side in enumerate(windows["side"]):
            pair = {k: v[[row]] for k, v in windows.items() if isinstance(v, np.ndarray)}
            left = bool(looks.near_left(looks.felt(config, "walk", pair))[0])
            assert left == (side == "left")
            sides.add(side)
        assert (windows["distance_m"] > 0.05).all()
        assert (windows["antenna_touch"] > 0).all()
    assert sides == {"left", "right"}


def test_the_curve_of_the_sensor_is_read_back() -> None:
    for kind in ("flex", "fsr"):
        sensor = AntennaSpec.model_validate({"sensor": {"kind": kind}}).sensor
        flex = np.array([0.2, 0.7, 1.2])
        back = looks.flex_from(sensor, counts(sensor, flex))
        assert back == pytest.approx(flex, abs=0.01)


def test_a_running_mean_is_that_of_the_last_values() -> None:
    values = np.arange(6.0)[None]
    expected = [[0.0, 0.5, 1.0, 2.0, 3.0, 4.0]]
    assert looks.running_mean(values, 3).tolist() == expected


def test_a_polynomial_finds_a_polynomial_and_the_nearest_is_itself() -> None:
    rng = np.random.default_rng(3)
    known = rng.normal(size=(60, 2))
    truth = 1.0 + known[:, 0] - 2.0 * known[:, 0] * known[:, 1] + 0.5 * known[:, 1] ** 2
    fresh = rng.normal(size=(5, 2))
    wanted = 1.0 + fresh[:, 0] - 2.0 * fresh[:, 0] * fresh[:, 1] + 0.5 * fresh[:, 1] ** 2
    assert polynomial(known, truth, 1e-9)(fresh) == pytest.approx(wanted, abs=1e-6)
    assert neighbours(known, truth, 1)(known) == pytest.approx(truth)
    assert neighbours(known, truth, 60)(fresh) == pytest.approx([truth.mean()] * 5)


def test_errors_are_means_over_episodes_with_their_interval() -> None:
    """Five episodes of mean error 1 to 5: Student's t with four degrees of freedom, 2.776."""
    task = TASKS[0]
    episode = np.array([0, 0, 1, 2, 2, 2, 3, 4])
    truth = np.full(8, 10.0)
    guess = truth + np.array([0.5, -1.5, 2.0, 3.0, 3.0, np.nan, -4.0, 5.0])
    windows = {"distance_m": truth, "episode": episode}
    told = {"mean": truth + 4.0, "x": guess}
    entry = score(task, windows, told, np.ones(8, bool))["x"]
    half = 2.7764 * math.sqrt(2.5 / 5)
    assert isinstance(entry, LengthErrors)
    assert (entry.episodes, entry.windows, entry.untold) == (5, 7, 1)
    assert entry.mae_m == pytest.approx(3.0)
    assert entry.mae_m_95 == pytest.approx((3.0 - half, 3.0 + half), abs=1e-3)
    assert entry.gain_m == pytest.approx(1.0)
    assert entry.gain_m_95 == pytest.approx((1.0 - half, 1.0 + half), abs=1e-3)
    assert entry.mape_percent == pytest.approx(30.0)
    assert by_episode(np.array([1.0, 3.0, 5.0]), np.array([7, 7, 9])).tolist() == [2.0, 5.0]


def test_the_command_writes_a_run_and_says_what_it_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow", reason="the extra `parquet` is not installed")
    monkeypatch.chdir(tmp_path)
    words = ["--trials", "10", "--kinds", "push", "--bench.timestep", "0.002"]
    words += ["--bench.contact_time", "0.004", "--out", "run", "--no-figures"]
    assert main(["dataset", *words]) == 0
    shown = capsys.readouterr().out
    assert "place" in shown
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["schema"], result["command"], result["format"]) == (1, "dataset", 1)
    assert list(result["tasks"]) == ["place"]
    assert set(result["tasks"]["place"]["tests"]["test"]) == set(BASELINES)
    assert (tmp_path / "run" / "push.parquet").exists()


@pytest.mark.ci
def test_the_network_of_the_examples_learns_from_it(outcome: Any, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow", reason="the extra `parquet` is not installed")
    data = EXPERIMENT.files(outcome.config)["push.parquet"](outcome)
    assert isinstance(data, bytes)
    (tmp_path / "push.parquet").write_bytes(data)
    path = Path(__file__).parents[3] / "examples" / "touch_network.py"
    words = [sys.executable, "-W", "error", str(path), str(tmp_path), "place"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=300)
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[:2] for line in lines] == [
        ["place", split] for split in ("test", "test_antenna", "test_speed")
    ]
    assert all(0.0 < float(line[2]) < 0.12 for line in lines)  # within the length of an antenna


def test_out_of_reach_of_all_walls_there_is_a_card_and_nothing_is_learned() -> None:
    far = SMALL["walk"] | {"distance": [0.5, 0.6], "angle": [-0.1, 0.1]}
    outcome: Any = EXPERIMENT.run(
        DatasetConfig.model_validate(SMALL | {"kinds": ["walk"], "walk": far})
    )
    result = outcome.result()
    walks = KindSummary(trials=10, invalid=0, windows=0, untouched=20, splits={})
    assert result.kinds == {"walk": walks}
    assert EXPERIMENT.sentence(result) == "Too few windows to learn from."
    assert [table.title[:5] for table in EXPERIMENT.tables(result)] == ["Windo", "dista", "angle"]
    assert set(EXPERIMENT.figures(outcome)) == {"dataset"}
    assert "0 windows" in card(outcome.config, by_kind(outcome))


def test_an_episode_whose_physics_fails_is_counted_and_gives_no_window(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every third of ten pushes fails: 0, 3, 6 and 9."""
    sound = experiment.push_windows

    def burst(config: DatasetConfig, draw: Draw) -> Windows:
        if next(count) % 3 == 0:
            raise SimulationError(0, "burst")
        return sound(config, draw)

    count = itertools.count()
    monkeypatch.setitem(experiment.MAKE, "push", burst)
    outcome: Any = EXPERIMENT.run(DatasetConfig.model_validate(SMALL | {"kinds": ["push"]}))
    pushes = outcome.result().kinds["push"]
    assert (pushes.trials, pushes.invalid) == (10, 4)
    assert pushes.windows + pushes.untouched == 6
    assert sum(pushes.splits.values()) == pushes.windows == len(by_kind(outcome)["push"]["episode"])
    assert ["burst" in row.reason for row in outcome.rows[:4]] == [True, False, False, True]
    assert not outcome.result().failed


def test_without_pyarrow_it_ends_before_it_begins(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    assert main(["dataset", "--out", "run"]) == 2
    assert "expected the package pyarrow, found none" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_the_card_counts_the_windows_of_each_split(outcome: Any) -> None:
    text = card(outcome.config, by_kind(outcome))
    for split in SPLITS:
        line = next(line for line in text.splitlines() if line.startswith(f"| {split} |"))
        counts = [int(cell) for cell in line.strip("| ").split(" | ")[2:]]
        assert counts == [int((w["split"] == split).sum()) for w in by_kind(outcome).values()]
    assert "Apache-2.0" in text
