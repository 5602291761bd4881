"""Shapes of tracked antennae: closed forms, an animal of known shapes, and what was wrong."""

from __future__ import annotations

import csv
import functools
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tracked import DWELL, NAMES, POINTS, animal, bent, classified, dwelling, write

import antennate
from antennate.antenna.shapes import Shape, held, outline, pointing
from antennate.cli import main
from antennate.experiments.sweep import experiment as sweep
from antennate.experiments.sweep.experiment import EXPERIMENT
from antennate.experiments.sweep.physics import SweepConfig
from antennate.params.scene import BenchPhysicsParams
from antennate_lab.tracks.config import TrackWallParams
from antennate_lab.tracks.experiment import EXPERIMENT as TRACKS
from antennate_lab.tracks.measures import wall_of

ERRORS = (
    Path(__file__).parents[4]
    / "shared/data/antenna_ant_labels_metrics/derived/harpegnathos_node_error_px.csv"
)


def agreement(wanted: list[str], found: list[str]) -> float:
    return float(np.mean([a == b for a, b in zip(wanted, found, strict=True)]))


@pytest.mark.parametrize("segments", [2, 4, 9])
@pytest.mark.parametrize("whole", [-80.0, 0.0, 130.0])
def test_an_arc_has_the_angles_of_its_chords(segments: int, whole: float) -> None:
    """Of an arc, cut into m equal chords that turn by c each: flex (m - 1) c, offset half, and
    curvature times length m c."""
    turn = whole / segments
    points = bent(40.0, *[turn] * (segments - 1))
    found = outline(np.array([points, 3.0 * points]))
    degrees = {
        "flex": turn * (segments - 1),
        "offset": turn * (segments - 1) / 2,
        "direction": 40.0 + turn * (segments - 1) / 2,
        "end": 40.0 + turn * (segments - 1),
    }
    for name, value in degrees.items():
        np.testing.assert_allclose(np.degrees(getattr(found, name)), value, atol=1e-9)
    np.testing.assert_allclose(np.degrees(found.curvature), segments * turn, atol=1e-9)
    np.testing.assert_allclose(found.length, (1.0, 3.0))


def test_an_antenna_that_folds_over_its_back_has_no_jump_in_its_bend() -> None:
    found = outline(bent(100.0, 60.0, 60.0)[None])
    assert math.degrees(found.flex[0]) == pytest.approx(120.0)
    assert math.degrees(found.end[0]) == pytest.approx(220.0)
    assert pointing(found.end, math.pi / 2)[0] == Shape.BACKWARD


def test_shapes_that_are_not_held_are_transitions() -> None:
    shapes = np.array([0, 0, 0, 1, 1, -1, 2, -2, 2, 2, 2])
    assert held(shapes, 3).tolist() == [0, 0, 0, 3, 3, -1, 3, -2, 2, 2, 2]
    assert held(shapes, 1).tolist() == shapes.tolist()
    assert held(shapes[:0], 3).tolist() == []


@functools.cache
def synthetic(shapes: str) -> antennate.Result:
    """Two trials of the synthetic animal."""
    return antennate.run("tracks", synthetic={"trials": 2, "frames": 1500, "shapes": shapes})


def test_the_synthetic_animal_is_classified_correctly_in_98_of_100_frames() -> None:
    result = synthetic("separated")
    assert result.summary["correct"] >= 0.98
    assert result.summary["wall"]["synthetic0"]["rms"] < 3.0  # px: the tips' errors
    for name in ("duplicated", "absent", "missing", "swapped", "outliers", "bridged"):
        assert result.summary["handled"][name] > 0


def test_continuous_shapes_without_errors_are_what_the_criteria_say() -> None:
    """What is left is the time until a running median follows a new shape."""
    clean = {"error": 0.0, "missing": 0.0, "swapped": 0.0, "repeated": 0.0}
    drawn = {"trials": 1, "frames": 1500, "shapes": "continuous"}
    for criteria in ({}, {"flex": 0.2, "offset": 0.3, "angle": 1.3}):
        found = antennate.run("tracks", synthetic=drawn | clean, criteria=criteria).summary
        assert found["correct"] >= 0.97
        assert min(shape["share"] for shape in found["shapes"].values()) > 0.05


def test_near_the_borders_criteria_matter_and_errors_of_tracking_cost_frames() -> None:
    summaries = [synthetic("separated"), synthetic("continuous")]
    apart, across = (
        max(row["change"] for row in found.summary["sensitivity"]) for found in summaries
    )
    assert across > 0.02 > apart
    assert summaries[1].summary["correct"] < 0.95
    assert "frames with continuous shapes" in summaries[1].sentence


def test_a_line_is_fitted_to_the_tips_of_a_long_recording() -> None:
    """A matrix of all tips against all would have 320 GB."""
    rng = np.random.default_rng(0)
    x = rng.uniform(0.0, 5000.0, 200_000)
    tips = np.stack([x, 100.0 + 0.1 * x + rng.normal(0.0, 1.0, len(x))], axis=1)
    wall = wall_of(TrackWallParams(kind="line"), "long.csv", tips, 100.0)
    x0, y0, x1, y1 = wall.numbers
    assert (y1 - y0) / (x1 - x0) == pytest.approx(0.1, abs=1e-3)
    assert wall.rms == pytest.approx(1.0 / np.hypot(1.0, 0.1), rel=0.01)


@pytest.mark.skipif(not ERRORS.exists(), reason="recordings are not here")
def test_known_shapes_with_the_errors_of_a_real_network(tmp_path: Path) -> None:
    """Each antennal point is off by an error of a real network's tips, or missing as often."""
    with ERRORS.open() as file:
        rows = list(csv.DictReader(file))
    errors = np.array(
        [float(r[n] or "nan") for r in rows for n in ("l_antenna_tip", "r_antenna_tip")]
    )
    names, rng = dwelling(1, 4000), np.random.default_rng(1)
    points = animal(names)
    for name in POINTS["left"] + POINTS["right"]:
        size, way = rng.choice(errors, len(names)), rng.uniform(0, 2 * np.pi, len(names))
        points[name] = points[name] + size[:, None] * np.stack([np.cos(way), np.sin(way)], 1)
    result, shapes = classified(write(tmp_path / "a.csv", points))
    assert agreement(names, shapes["left"]) >= 0.98
    assert agreement(names, shapes["right"]) >= 0.98
    usual = {name: row["share"] for name, row in result.summary["shapes"].items()}
    for name in DWELL:
        assert usual[name] == pytest.approx(names.count(name) / len(names), abs=0.02)
    assert max(row["change"] for row in result.summary["sensitivity"]) < 0.02


def test_defects_are_mended_and_counted_one_by_one(tmp_path: Path) -> None:
    names = dwelling(2, 600)
    points = animal(names)
    likelihood = {"l3": np.ones(600), "r3": np.ones(600)}
    likelihood["l3"][100:104] = 0.3
    points["l3"][100:104] += 60.0
    points["r2"][200:203] = np.nan
    points["r3"][300] += (80.0, 0.0)
    for k in range(4):
        for i in (400, 401):
            left = points[f"l{k}"][i].copy()
            points[f"l{k}"][i] = points[f"r{k}"][i]
            points[f"r{k}"][i] = left
    frames = np.arange(600)
    keep = np.r_[0:50, 49:500, 503:600]  # frame 49 twice, 500 to 502 absent
    points = {name: values[keep] for name, values in points.items()}
    likelihood = {name: values[keep] for name, values in likelihood.items()}
    result, shapes = classified(write(tmp_path / "a.csv", points, likelihood, frames[keep]))
    handled = result.summary["handled"]
    counts = {"duplicated": 1, "absent": 3, "low_likelihood": 4, "missing": 3, "swapped": 2}
    assert {name: handled[name] for name in counts} == counts
    assert handled["outliers"] == 1
    # 4 + 3 + 1 points, and 3 absent frames of 10 points
    assert handled["bridged"] == 4 + 3 + 1 + 3 * 10
    assert len(shapes["left"]) == 600
    assert agreement(names, shapes["left"]) > 0.985
    assert agreement(names, shapes["right"]) > 0.985
    assert result.rows[0].rate_hz == pytest.approx(100.0)


@pytest.mark.parametrize(("angle", "expected"), [(90.0, "transition"), (120.0, "forward")])
def test_bent_forward_is_forward_only_if_the_end_points_there(
    angle: float, expected: str, tmp_path: Path
) -> None:
    """Segments at 150, 130 and 110 deg: bent towards the heading, but pointing to the tail."""
    points, t = animal(["straight"] * 60, heading=0.0), np.arange(60) / 100.0
    ahead = np.stack([np.cos(0.2 * np.sin(t)), np.sin(0.2 * np.sin(t))], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    for k, (x, y) in enumerate(bent(150.0, -20.0, -20.0, length=100.0)):
        points[f"l{k}"] = points["head"] + x * ahead + (10.0 + y) * left
    criteria = {"angle": math.radians(angle)}
    _, shapes = classified(write(tmp_path / "a.csv", points), criteria=criteria)
    assert set(shapes["left"]) == {expected}


def test_a_long_gap_stays_unknown_and_counts_nowhere(tmp_path: Path) -> None:
    names = ["straight"] * 300
    points = animal(names)
    points["l1"][100:150] = np.nan
    result, shapes = classified(write(tmp_path / "a.csv", points))
    assert shapes["left"].count("unknown") == 50
    assert result.rows[0].straight == 1.0
    assert result.summary["frames"]["unknown"] == 50


def test_antennae_of_one_base_are_put_back_by_their_way(tmp_path: Path) -> None:
    names = dwelling(3, 400)
    points = animal(names)
    tips = {"l3": points["l3"].copy(), "r3": points["r3"].copy()}
    for i in (100, 250):
        tips["l3"][i], tips["r3"][i] = points["r3"][i], points["l3"][i]
    held_points = {"head": points["head"], "tail": points["tail"], **tips}
    two = {"left": ("head", "l3"), "right": ("head", "r3"), "tail": "tail", "head": "head"}
    result, shapes = classified(write(tmp_path / "a.csv", held_points), points=two)
    assert result.summary["handled"]["swapped"] == 2
    assert result.summary["classified_by"] == "direction"
    assert result.summary["shapes"]["straight"]["share"] is None
    found = agreement(["backward" if n == "backward" else "forward" for n in names], shapes["left"])
    assert found > 0.98


def test_only_contact_counts_and_a_line_is_found(tmp_path: Path) -> None:
    """An animal along y = 400 whose left tip touches in the first half and stands off after."""
    names = (["forward"] * 100 + ["backward"] * 100) * 4
    points = animal(names, heading=0.0)
    reach = points["l3"][:, 1]
    off = np.where(np.arange(800) < 400, 0.0, 60.0)
    jitter = np.random.default_rng(0).normal(0.0, 1.0, 800)
    points = {n: v + np.stack([0.0 * off, 400.0 - reach - off], 1) for n, v in points.items()}
    points["l3"][:, 1] += jitter
    result, shapes = classified(write(tmp_path / "a.csv", points), wall={"kind": "line"})
    assert result.summary["wall"][str(tmp_path / "a.csv")]["rms"] < 2.0
    _, y0, _, y1 = result.summary["wall"][str(tmp_path / "a.csv")]["numbers"]
    assert (y0, y1) == pytest.approx((400.0, 400.0), abs=2.0)
    assert agreement(names[:400] + ["free"] * 400, shapes["left"]) > 0.98
    assert set(shapes["right"]) == {"free"}
    given, again = classified(
        tmp_path / "a.csv", wall={"kind": "line", "line": (0.0, 400.0, 9.0, 400.0)}
    )
    assert agreement(shapes["left"], again["left"]) > 0.99
    assert not given.summary["wall"][str(tmp_path / "a.csv")]["fitted"]


def test_a_criterion_that_leaves_nothing_in_contact_moves_no_share(tmp_path: Path) -> None:
    """Tips never come nearer than 0.14 lengths: they touch below 0.15 and 0.18, not below 0.12."""
    points = animal(["forward"] * 300, heading=0.0)
    y = float(points["l3"][:, 1].max()) + 14.0
    line = (0.0, y, 9.0, y)
    result, _ = classified(
        write(tmp_path / "a.csv", points), wall={"kind": "line", "line": line}, out=tmp_path / "run"
    )
    less, more = result.outcome.result().sensitivity[:2]
    assert (less.criterion, less.change, set(less.share.values())) == ("gap", None, {None})
    assert more.change is not None
    assert "nan" not in result.sentence
    assert main(["report", str(tmp_path / "run")]) == 0


def test_a_circle_is_found_from_the_tips_along_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    way = np.linspace(0.0, 2 * np.pi, 900)
    radius = np.where(rng.random(900) < 0.5, 500.0, rng.uniform(300.0, 470.0, 900))
    tip = np.stack([640.0 + radius * np.cos(way), 512.0 + radius * np.sin(way)], axis=1)
    inward = np.stack([np.cos(way), np.sin(way)], axis=1)
    left = np.stack([-inward[:, 1], inward[:, 0]], axis=1)
    head = tip - 40.0 * inward - 30.0 * left
    points = {"head": head, "tail": head - 150.0 * inward, "l3": tip}
    names = {"left": ("head", "l3"), "right": ("none",), "tail": "tail", "head": "head"}
    file = write(tmp_path / "a.csv", points)
    result, _ = classified(file, points=names, wall={"kind": "circle"})
    x, y, r = result.summary["wall"][str(file)]["numbers"]
    assert (x, y, r) == pytest.approx((640.0, 512.0, 500.0), abs=2.0)
    write(file, {name: values[:200] for name, values in points.items()})
    with pytest.raises(antennate.AntennateError, match=r"tips along a circle .* --wall\.circle"):
        classified(file, points=names, wall={"kind": "circle"})


def test_few_trials_have_no_interval_and_say_so(tmp_path: Path) -> None:
    result, _ = classified(write(tmp_path / "a.csv", animal(dwelling(4, 300))))
    assert all(row["share_95"] is None for row in result.summary["shapes"].values())
    assert result.sentence.endswith(
        "Fewer than 5 trials decide nothing; their means have no interval."
    )


def test_criteria_have_the_names_of_their_flags_and_angles_are_in_degrees() -> None:
    """The defaults of docs/tracks.md: 0.15 lengths, 90, 20 and 10 degrees, 0.05 s; 20 % less."""
    result = antennate.run("tracks", synthetic={"trials": 2, "frames": 300})
    shapes, varied, _ = TRACKS.tables(result.outcome.result())
    assert shapes.title == "Shapes in contact"
    assert shapes.note.startswith("Shares of the frames in contact, the mean over 2 trials.")
    assert [name for name, _ in varied.rows][::2] == [
        *("gap [lengths] 0.12", "angle [deg] 72", "flex [deg] 16", "offset [deg] 8"),
        "duration [s] 0.04",
    ]
    assert re.search(
        r"Of all criteria the (gap|angle|flex|offset|duration) matters", result.sentence
    )


def test_one_recording_is_never_two_animals(tmp_path: Path) -> None:
    """Twice the same file, a copy, and the same points with a likelihood."""
    points = animal(dwelling(4, 300))
    first, copy = (write(tmp_path / f"{name}.csv", points) for name in ("first", "copy"))
    noted = write(tmp_path / "noted.csv", points, {"l3": np.ones(300)})
    for other in (first, copy, noted):
        message = rf"^{other}: expected another recording than {first}, found the same points;"
        with pytest.raises(antennate.BadInputError, match=message):
            classified(first, files=[str(first), str(other)])
    another = write(tmp_path / "another.csv", animal(dwelling(5, 300)))
    result, _ = classified(first, files=[str(first), str(another)])
    assert result.summary["animals"] == 2


def saved(path: Path, save: Callable[..., None] = np.savez, **arrays: object) -> bytes:
    """The content of a file that NumPy wrote."""
    with path.open("wb") as file:
        save(file, **arrays)
    return path.read_bytes()


@pytest.mark.parametrize(
    ("kind", "found"),
    [
        ("text", "found none"),
        ("npy", "found none"),
        ("empty", "found nothing"),
        ("another", "found speed, time"),
        ("objects", "found objects of Python"),
        ("damaged", "found a damaged one: "),
    ],
)
def test_an_npz_that_is_not_of_trex_is_told_so(kind: str, found: str, tmp_path: Path) -> None:
    """And nobody is advised to load it as code."""
    path = tmp_path / "a.npz"
    objects = np.array([{}, {}], object)
    poses: Any = {f"pose{axis}{name}": np.zeros(2) for name in NAMES for axis in "XY"}
    whole = saved(path, np.savez_compressed, frame=np.arange(9), **poses)
    content = {
        "text": b"hello",
        "npy": saved(path, np.save, arr=np.zeros(3)),
        "empty": b"",
        "another": saved(path, speed=np.zeros(3), time=np.zeros(3)),
        "objects": saved(path, frame=objects, **poses),
        "damaged": whole.replace(whole[70:80], 10 * b"\xff"),
    }
    path.write_bytes(content[kind])
    message = rf"^{path}: expected an npz file of TRex with poseX0, poseY0 and so on, {found}"
    with pytest.raises(antennate.BadInputError, match=message) as error:
        classified(path)
    assert "pickle" not in str(error.value)


def test_the_simulated_antenna_goes_through_the_same_classifier(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shares of `sweep` by its own angles, and of `tracks` by the points that it saved."""
    monkeypatch.setattr(sweep, "plan", lambda config: [])  # the map alone
    config = SweepConfig(
        points=True,
        profiles=("descending",),
        distances=(0.9,),
        centres=(0.8, 1.2, 1.5),
        amplitudes=(0.3, 0.8),
        sweeps=1,
        physics=BenchPhysicsParams(timestep=0.001),
    )
    outcome = sweep.run(config)
    for name, make in EXPERIMENT.files(config).items():
        (tmp_path / name).write_text(str(make(outcome)))
    cells = {f"{row.condition} {row.trial}": row for row in outcome.rows}
    result = antennate.run(
        "tracks",
        files=[str(tmp_path / "points.csv")],
        y_down=False,
        points={"left": [f"left{i}" for i in range(8)], "right": ["none"]},
        wall={"kind": "file"},
        criteria={"flex": math.radians(5.0), "offset": math.radians(2.5), "duration": 0.0},
        cleaning={"smoothing": 0.0},
    )
    assert len(result.rows) == len(cells) == 12
    names = ("forward", "backward", "straight", "transition")
    for row in result.rows:
        cell = cells[row.animal]
        assert row.free / row.frames == pytest.approx(cell.free, abs=0.006)
        for name in names:
            share = getattr(cell, name) / (1.0 - cell.free)
            assert getattr(row, name) == pytest.approx(share, abs=0.05)
    for name in names:  # each is in some cell
        assert max(getattr(cell, name) for cell in cells.values()) >= 0.02, name
