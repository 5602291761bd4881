"""Several animals in one file: each is a trial, or named with a count, or the file is refused."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tracked import NAMES, POINTS, animal, classified, dwelling, write, write_table

GIVEN = (
    Path(__file__).parents[4] / "shared" / "data" / "inputs_turn4" / "three_animals_no_track.csv"
)
FRAMES = 40
FLAGS = [
    *("--points.left", *POINTS["left"], "--points.right", *POINTS["right"]),
    *("--points.tail", "tail", "--points.head", "head", "--no-y-down", "--rate", "100"),
]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run directories land in a folder of the test."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def three() -> list[dict[str, np.ndarray]]:
    """Points of three animals that stand 500 apart."""
    points = animal(dwelling(7, FRAMES))
    return [{n: v + np.array([500.0 * k, 0.0]) for n, v in points.items()} for k in range(3)]


def sleap_csv(path: Path, animals: list[dict[str, np.ndarray]], tracks: list[str]) -> Path:
    """SLEAP's analysis CSV: a row for each animal in each frame."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        names = [f"{n}.{part}" for n in NAMES for part in ("x", "y", "score")]
        writer.writerow(["track", "frame_idx", "instance.score", *names])
        for i in range(FRAMES):
            for points, track in zip(animals, tracks, strict=True):
                cells = [v for n in NAMES for v in (*points[n][i].round(3), 0.4)]
                writer.writerow([track, i, 0.9, *cells])
    return path


def test_animals_without_a_name_never_become_one(
    three: list[dict[str, np.ndarray]], tmp_path: Path, refused: Callable[..., str]
) -> None:
    """SLEAP writes no track where nothing was tracked; one row a frame alone is one animal."""
    path = sleap_csv(tmp_path / "a.csv", three, ["", "", ""])
    said = f"found more in {FRAMES} frames, the first of them 0; if these are several animals"
    assert said in refused("tracks", "--files", path, *FLAGS)
    path = sleap_csv(tmp_path / "b.csv", three, ["one", "two", "two"])
    assert f"{FRAMES} frames of two, the first" in refused("tracks", "--files", path, *FLAGS)
    path = sleap_csv(tmp_path / "c.csv", three, ["one", "two", "three"])
    result, _ = classified(path, rate=100.0)
    assert [row.animal for row in result.rows[::2]] == ["one", "two", "three"]
    assert result.summary["handled"]["low_likelihood"] == 0  # peaks of 0.4 count, as in SLEAP
    result, _ = classified(sleap_csv(tmp_path / "d.csv", three[:1], [""]), rate=100.0)
    assert result.summary["animals"] == 1


@pytest.mark.skipif(not GIVEN.exists(), reason="the file is not here")
def test_the_given_file_is_refused(refused: Callable[..., str]) -> None:
    """40 rows of each of three animals, in 40 frames."""
    points = ["--points.left", "lb", "lt", "--points.right", "rb", "rt", "--rate", 100]
    plain = ["--columns.x", "{}.x", "--columns.y", "{}.y", "--columns.frame", "frame_idx"]
    for words in (points, [*points, *plain]):
        err = refused("tracks", "--files", GIVEN, *words)
        assert "expected one place for each point in a frame, found more in 40 frames" in err


def test_a_frame_that_stands_twice_alike_is_counted(tmp_path: Path) -> None:
    """In any order: the same row again is no other animal, nor is one without a value."""
    keep = [*range(FRAMES), 5, 6]
    points = {n: v[keep] for n, v in animal(dwelling(7, FRAMES)).items()}
    for name in NAMES:
        points[name][-1] = np.nan
    result, _ = classified(write(tmp_path / "a.csv", points, frames=np.array(keep)))
    assert {n: result.summary["handled"][n] for n in ("unsorted", "duplicated")} == {
        "unsorted": 2,
        "duplicated": 2,
    }


def deeplabcut(path: Path, animals: dict[str, dict[str, np.ndarray]]) -> Path:
    """CSV or HDF5 (pandas, format `table`) of DeepLabCut with individuals."""
    keys = [(a, n, c) for a, points in animals.items() for n in points for c in "xy"]
    values = np.stack([animals[a][n][:, "xy".index(c)] for a, n, c in keys], axis=1)
    if path.suffix == ".csv":
        heads = zip(("individuals", "bodyparts", "coords"), zip(*keys, strict=True), strict=True)
        lines = [["scorer", *["net"] * len(keys)], *([name, *cells] for name, cells in heads)]
        lines += [[str(i), *map(str, row)] for i, row in enumerate(values.tolist())]
        path.write_text("".join(",".join(line) + "\n" for line in lines))
        return path
    return write_table(path, [("net", *key) for key in keys], values)


@pytest.mark.parametrize("name", ["a.csv", "a.h5"])
def test_an_individual_without_the_points_is_named_with_a_count(
    name: str,
    three: list[dict[str, np.ndarray]],
    tmp_path: Path,
    refused: Callable[..., str],
) -> None:
    """DeepLabCut calls `single` what belongs to no animal, such as corners of the arena."""
    corner = {"corner": np.ones((FRAMES, 2))}
    path = deeplabcut(
        tmp_path / name, {"one": three[0], "two": three[1], "bare": corner, "single": corner}
    )
    result, _ = classified(path, rate=100.0)
    assert (result.summary["animals"], result.summary["skipped"]) == (2, 2)
    gone = [(one["animal"], one["known"], one["left_out"]) for one in result.summary["unseen"]]
    assert gone == [(a, 0, True) for a in ("bare", "bare", "single", "single")]
    assert "Of 4 animals 2 left out: bare, single." in result.sentence
    half = {"one": three[0], "two": {n: three[1][n] for n in NAMES[:3]}}
    path = deeplabcut(tmp_path / f"half_{name}", half)
    assert "two: expected x and y of " in refused("tracks", "--files", path, *FLAGS)


@pytest.mark.parametrize("kind", ["plain", "sleap", "deeplabcut"])
@pytest.mark.parametrize("comma", [",", "."])
def test_semicolons_are_told_from_names_of_columns(
    kind: str,
    comma: str,
    three: list[dict[str, np.ndarray]],
    tmp_path: Path,
    refused: Callable[..., str],
) -> None:
    """As a spreadsheet writes where commas are decimal marks; what is said mends the file."""
    path = tmp_path / "a.csv"
    if kind == "plain":
        write(path, three[0])
    elif kind == "sleap":
        sleap_csv(path, three[:1], ["one"])
    else:
        deeplabcut(path, {"one": three[0]})
    good, heads = path.read_text(), 4 if kind == "deeplabcut" else 1
    lines = good.replace(",", ";").splitlines(keepends=True)
    path.write_text("".join(lines[:heads]) + "".join(lines[heads:]).replace(".", comma))
    err = refused("tracks", "--files", path, *FLAGS)
    assert "row 1: expected columns separated by commas, and points as decimal marks, found " in err
    how = " and decimal commas; replace commas by points, then semicolons by commas\n"
    assert ("found semicolons" + (how if comma == "," else "\n")) in err
    mended = path.read_text().replace(",", ".").replace(";", ",")
    assert mended == good


def corrected(path: Path, points: dict[str, np.ndarray], origin: int) -> Path:
    """SLEAP's own file of untracked predictions, and one more in frame 3 that a person moved."""
    h5py = pytest.importorskip("h5py")
    count, size = FRAMES + 1, len(NAMES)
    about = {
        "skeletons": [{"nodes": [{"id": i} for i in range(size)]}],
        "nodes": [{"name": name} for name in NAMES],
    }
    number = np.arange(FRAMES)
    frames = np.zeros(
        FRAMES,
        [(n, "<u8") for n in ("video", "frame_idx", "instance_id_start", "instance_id_end")],
    )
    frames["frame_idx"], frames["instance_id_start"] = number, number + (number > 3)
    frames["instance_id_end"] = number + 1 + (number >= 3)
    integers = ("instance_type", "track", "from_predicted", "point_id_start", "point_id_end")
    instances = np.zeros(count, [(n, "<i8") for n in integers])
    instances["track"] = instances["from_predicted"] = -1
    instances["instance_type"] = 1
    rank = np.delete(np.arange(count), 4)  # of the predictions
    instances["point_id_start"][rank] = size * number
    instances["point_id_end"] = instances["point_id_start"] + size
    instances[4] = (0, -1, origin, 0, size)
    place = [("x", "<f8"), ("y", "<f8"), ("visible", "?")]
    predicted = np.zeros(size * FRAMES, [*place, ("score", "<f8")])
    every = np.stack([points[n] for n in NAMES], axis=1).reshape(-1, 2)
    predicted["x"], predicted["y"] = every.T
    predicted["visible"], predicted["score"] = True, 0.5
    user = np.zeros(size, place)
    user["x"], user["y"] = every[3 * size : 4 * size].T
    user["visible"] = True
    with h5py.File(path, "w") as file:
        file.create_group("metadata").attrs.update({"json": json.dumps(about)})
        file["metadata"].attrs["format_id"] = 1.2
        file["frames"], file["instances"] = frames, instances
        file["points"], file["pred_points"] = user, predicted
    return path


def test_a_prediction_that_was_corrected_by_hand_is_no_second_animal(
    three: list[dict[str, np.ndarray]], tmp_path: Path, refused: Callable[..., str]
) -> None:
    """SLEAP keeps it in the file: it is counted, and only another instance is another animal."""
    result, _ = classified(corrected(tmp_path / "a.slp", three[0], origin=3), rate=100.0)
    assert result.summary["handled"]["duplicated"] == 1
    assert result.summary["frames"]["contact"] == 2 * FRAMES
    path = corrected(tmp_path / "b.slp", three[0], origin=-1)
    err = refused("tracks", "--files", path, *FLAGS)
    assert "found several without a track in frame 3; track them in SLEAP" in err


def test_scores_of_another_shape_are_not_passed_over(
    three: list[dict[str, np.ndarray]], tmp_path: Path, refused: Callable[..., str]
) -> None:
    h5py = pytest.importorskip("h5py")
    tracks = np.stack(list(three[0].values()))[None].transpose(0, 3, 1, 2)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["tracks"], file["node_names"] = tracks, [name.encode() for name in three[0]]
        file["point_scores"] = np.ones((1, len(NAMES), FRAMES - 1))
    err = refused("tracks", "--files", tmp_path / "a.h5", *FLAGS)
    assert "expected point_scores of shape (1, 10, 40), found (1, 10, 39)" in err
