"""Tracks as other people have them: gaps by other names, walls in other units, files that swell."""

from __future__ import annotations

import csv
import tracemalloc
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tracked import NAMES, POINTS, animal, classified, dwelling, write

import antennate
from antennate.cli import main
from antennate_lab.tracks.config import ColumnsParams
from antennate_lab.tracks.readers import read

DATA = Path(__file__).parents[4] / "shared" / "data"
BEES = DATA / "antenna_bee_swarmsight"
here = pytest.mark.skipif(not BEES.exists(), reason="recordings are not here")
HAND = {
    "columns": {"x": "{}X", "y": "{}Y"},
    "points": {
        "left": ["Left Scape", "Left Flagellum Base", "Left Flagellum Tip"],
        "right": ["Right Scape", "Right Flagellum Base", "Right Flagellum Tip"],
        "tail": "Dorsal Edge of the Left Eye+Dorsal Edge of the Right Eye",
        "head": "Left Mandible Base+Right Mandible Base",
    },
}
"""The names in files that people annotated; in those of the tracker the flagella alone."""
TRACKER = {
    "columns": {"x": "{}-X", "y": "{}-Y"},
    "points": {
        "left": ["LeftFlagellumBase", "LeftFlagellumTip"],
        "right": ["RightFlagellumBase", "RightFlagellumTip"],
        "tail": "LeftFlagellumBase+RightFlagellumBase",
        "head": "LeftFlagellumTip+RightFlagellumTip",
    },
}


@pytest.fixture
def points() -> dict[str, np.ndarray]:
    """800 frames of an animal with y up."""
    return animal(dwelling(0, 800))


@here
@pytest.mark.parametrize("end", ["\n", "\r", "\r\n"])
def test_a_bee_by_hand_is_read_as_it_is_and_agrees_with_its_other_containers(
    end: str, tmp_path: Path
) -> None:
    """NA where nothing was seen, whatever ends a line; the same numbers stand in the .slp."""
    stem = "B1-Feb22-0.2M-heptanol"
    (source,) = (BEES / "raw" / "hand_vs_tracker").glob(f"{stem}.mov_HandAnnotated*TWO.csv")
    path = tmp_path / "hand.csv"
    path.write_bytes(source.read_bytes().replace(b"\n", end.encode()))
    found = antennate.run("tracks", files=[str(path)], rate=30.0, **HAND).summary
    parts = {"left": ("L_base", "L_mid", "L_tip"), "right": ("R_base", "R_mid", "R_tip")}
    axis = {"tail": "L_eye+R_eye", "head": "L_mandible_base+R_mandible_base"}
    slp = BEES / "derived" / "reencoded" / f"bee_{stem}_TWO.slp"
    other = antennate.run("tracks", files=[str(slp)], rate=30.0, points={**parts, **axis}).summary
    for name, row in found["shapes"].items():
        assert row["share"] == pytest.approx(other["shapes"][name]["share"], abs=0.005)


@here
def test_files_of_a_tracker_are_read_and_its_frames_are_counted() -> None:
    """SOURCE.md: more fields than the header, and numbers of frames that skip."""
    files = sorted((BEES / "raw" / "hand_vs_tracker").glob("*Tracker*.csv"))
    assert len(files) == 4
    for path in files:
        rows = list(csv.reader(path.read_text().splitlines()))
        assert len(rows[1]) > len(rows[0])
        numbers = [int(row[0]) for row in rows[1:]]
        result = antennate.run("tracks", files=[str(path)], rate=30.0, **TRACKER).summary
        assert result["handled"]["absent"] == numbers[-1] - numbers[0] + 1 - len(set(numbers))


@pytest.mark.parametrize("word", ["NA", "n/a", "NaN", "#N/A", "null", "None", ""])
def test_no_value_has_many_names(word: str, points: dict[str, np.ndarray], tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", points)
    lines = path.read_text().splitlines()
    cells = lines[5].split(",")
    lines[5] = ",".join([*cells[:2], *[word] * (len(cells) - 2)])
    path.write_text("\n".join(["sep=,", *lines, ""]))
    result, _ = classified(path)
    assert result.summary["handled"]["missing"] == len(NAMES)


def test_a_column_without_a_name_is_called_by_its_place(
    points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    """As pandas and R write their row numbers, and as a tracker writes a list at the end."""
    path = write(tmp_path / "a.csv", points)
    first, *rows = path.read_text().splitlines()
    lines = [first.replace("frame", "", 1), *(f"{row},0.5,0.25" for row in rows)]
    path.write_text("\n".join([*lines, ""]))
    result, _ = classified(path, columns={"frame": "column 1"})
    assert result.summary["handled"]["absent"] == 0
    with pytest.raises(antennate.BadInputError, match=r"found column 1, time, .*--columns.frame"):
        classified(path, columns={"frame": "frame"})
    last = len(lines[0].split(",")) + 1
    lines[3] = lines[3].removesuffix(",0.5,0.25") + ",wet,0.25"
    path.write_text("\n".join([*lines, ""]))
    with pytest.raises(antennate.BadInputError, match=rf"row 4: .* in column {last}, found wet"):
        classified(path, columns={"time": f"column {last}"})


def test_a_name_that_is_missing_in_the_header_is_asked_for(
    points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    """R names its row names not at all (`write.table`): every other name is one place too early."""
    path = write(tmp_path / "a.csv", points)
    whole, names = path.read_text(), path.read_text().split("\n")[0]
    width = names.count(",") + 1
    path.write_text(whole.replace("frame,", "", 1))
    said = rf"row 2: expected {width - 1} cells, found {width}; does row 1 lack .* --columns.frame$"
    with pytest.raises(antennate.BadInputError, match=said):
        classified(path)
    path.write_text(whole.replace("frame,", "row,", 1))
    result, _ = classified(path, columns={"frame": "row"})
    assert result.summary["handled"]["absent"] == 0
    path.write_text(f"{names}\n0{',1,2' * (width // 2 + 1)}\n")
    with pytest.raises(antennate.BadInputError, match=r"decimal commas\? write points$"):
        classified(path)
    path.write_text(f"{names}\n1,2\n")
    with pytest.raises(antennate.BadInputError, match=r"found 2 \(truncated\); delete the row$"):
        classified(path)


@pytest.mark.parametrize("inner", [(), ("1", "2")])
def test_a_tip_that_is_never_seen_is_said_and_the_other_antenna_still_tells_the_sides(
    inner: tuple[str, ...], points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    points["r3"] = np.full_like(points["r3"], np.nan)
    path = write(tmp_path / "a.csv", points)
    names = {side: [side[0] + k for k in ("0", *inner, "3")] for side in ("left", "right")}
    wanted = {**names, "tail": "tail", "head": "head"}
    with pytest.raises(antennate.BadInputError, match="expected left antennae on the left"):
        classified(path, points=wanted, y_down=True)
    result, shapes = classified(path, points=wanted)
    assert set(shapes["right"]) == {"unknown"}
    (one,) = result.summary["unseen"]
    assert (one["side"], one["known"], one["frames"], one["empty"]) == ("right", 0, 800, ("r3",))
    assert f"The right antenna in {path} is known in 0 of 800 frames, as r3 never has a value" in (
        result.sentence
    )


def test_an_animal_without_a_body_axis_is_said_beside_others(
    points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    whole = write(tmp_path / "a.csv", points)
    path = write(tmp_path / "b.csv", {**points, "tail": np.full_like(points["tail"], np.nan)})
    with pytest.raises(antennate.BadInputError, match="found none; tail has no value in "):
        classified(path)
    names = [str(whole), str(path)]
    result = antennate.run("tracks", files=names, points=POINTS, y_down=False)
    assert result.summary["skipped"] == 1
    assert f"in {path} is known in 0 of 800 frames, as tail never has a value" in result.sentence


CENTRE = (450.0, 240.0)


@pytest.mark.parametrize("unit", [0.01, 0.02619])
def test_a_circle_in_another_unit_than_the_tracks_is_refused(
    unit: float, points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    """Given in cm or m where the file has px: no animal would be inside, all would touch."""
    path = write(tmp_path / "a.csv", points)
    wall = {"kind": "circle", "circle": [unit * v for v in (*CENTRE, 400.0)]}
    with pytest.raises(antennate.BadInputError, match=r"found 100 % .* outside.*--wall\.circle"):
        classified(path, wall=wall)


def test_a_wall_that_is_far_or_within_reach_of_many_is_said(
    points: dict[str, np.ndarray], tmp_path: Path
) -> None:
    path = write(tmp_path / "a.csv", points)
    far = {"kind": "circle", "circle": [*CENTRE, 40000.0]}
    result, _ = classified(path, wall=far)
    reach = max(np.hypot(*(points[name] - CENTRE).T).max() for name in NAMES[:8])
    nearest = result.summary["wall"][str(path)]["nearest"]
    assert nearest == pytest.approx((40000.0 - reach) / 100.0, rel=0.001)
    assert f"lay {nearest:.2g} lengths of an antenna from the wall; is the wall given in the" in (
        result.sentence
    )
    small = {"kind": "circle", "circle": [*CENTRE, 150.0]}
    result, _ = classified(path, wall=small)
    assert "an antenna reaches beyond the wall: is it where the file has it?" in result.sentence


AXES = [f"pose{axis}{k}" for k in range(3) for axis in "XY"]


def npz(path: Path, length: int, names: Iterable[str] = ("frame", *AXES), rest: int = -1) -> None:
    """A file of TRex whose arrays say that they are so long; little of them is there.

    Those after the first are `rest` long, if that is given.
    """
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        for place, name in enumerate(names):
            with packed.open(f"{name}.npy", "w") as file:
                shape = (rest if place and rest >= 0 else length,)
                about = {"descr": "<f8", "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_1_0(file, about)
                file.write(bytes(8000))


def analysis(path: Path, length: int) -> None:
    """A file of SLEAP with an array that long; none of it is written."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["node_names"] = [b"0", b"1", b"2"]
        file.create_dataset("tracks", (1, 2, 3, length), "f8", chunks=(1, 2, 3, 1000))


@pytest.mark.parametrize(("make", "name"), [(npz, "a.npz"), (analysis, "a.h5")])
def test_what_a_file_unpacks_to_is_judged_before_it_is_unpacked(
    make, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """3.2 GB in a file of kilobytes: one line, and no more memory than the file takes."""
    path = tmp_path / name
    make(path, 57_142_857)
    words = ["--points.left", "0", "1", "--points.right", "none", "--points.tail", "2"]
    words += ["--points.head", "1", "--rate", "30", "--out", str(tmp_path / "out")]
    assert main(["tracks", "--files", str(path), *words]) == 2
    error = capsys.readouterr().err
    assert f"{path}: expected at most 200 MB once unpacked, found " in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
    tracemalloc.start()
    with pytest.raises(antennate.BadInputError):
        read(path, ("0", "1", "2"), ColumnsParams())
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10e6


def header_of(size: int) -> bytes:
    """The begin of an array of NumPy whose header says that it is so long."""
    return b"\x93NUMPY\x02\x00" + size.to_bytes(4, "little") + bytes(size)


@pytest.mark.parametrize(
    ("names", "length", "rest", "said"),
    [
        (("frame", "poseX", "speed"), 10**7, -1, "expected a point 0"),
        (("frame", "speed"), 10**7, -1, "expected an npz file of TRex with poseX0"),
        (AXES, 10**7, -1, "expected an array frame, found none"),
        (("frame", *AXES[:5]), 10**6, -1, "expected an array poseY2, found none"),
        (("frame", *AXES), 10**6, 10, "expected 1000000 values of "),
        (("frame", *AXES, "missing"), 10, 10**6, "expected 10 values of "),
        (("frame", *AXES, "frame_rate"), 10**6, -1, "expected 1 values of frame_rate, found 1000"),
        (("frame", *AXES, "missing", "frame_rate"), 57_142_857, 10, "expected at most 200 MB"),
        (("frame", "frame", *AXES), 10, -1, "frame is there twice"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_names_and_lengths_are_judged_before_an_array_is_unpacked(
    names: tuple[str, ...], length: int, rest: int, said: str, tmp_path: Path
) -> None:
    npz(tmp_path / "a.npz", length, names, rest)
    refused_in_little_memory(tmp_path / "a.npz", said)


def refused_in_little_memory(path: Path, said: str) -> None:
    tracemalloc.start()
    with pytest.raises(antennate.BadInputError) as caught:
        read(path, ("0", "1", "2"), ColumnsParams())
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert f"{path}: expected" in str(caught.value)
    assert said in str(caught.value)
    assert peak < 2e6


def test_hostile_headers_and_texts_of_arrays_are_refused_in_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    npz(path, 10, AXES)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("frame.npy", header_of(50_000_000))
    refused_in_little_memory(path, "found a damaged one")
    arrays: dict[str, Any] = {name: np.zeros(3) for name in AXES}
    np.savez(path, **arrays, frame=np.array(["0", "1", "2"]))
    refused_in_little_memory(path, "frame is no array of numbers")


def test_a_blank_file_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.csv").write_text("\n\n")
    assert main(["tracks", "--files", str(tmp_path / "a.csv"), "--rate", "30"]) == 2
    assert "row 1: expected the names of the columns, found a blank line" in capsys.readouterr().err
