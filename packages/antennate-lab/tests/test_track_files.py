"""Files of tracking software: what they mean, and one clear line for what cannot be used."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tracked import NAMES, POINTS, animal, classified, dwelling, write, write_table

import antennate

h5py = pytest.importorskip("h5py")
DATA = Path(__file__).parents[4] / "shared" / "data"
LOCUSTS = DATA / "antenna_locust_arena_trex"
BEES = DATA / "antenna_bee_swarmsight" / "derived" / "reencoded"
MOSQUITO = DATA / "pose_dlc_h5_mosquito" / "raw"
NO_ANTENNA = DATA / "pose_sleap_h5_noantenna" / "raw"
here = pytest.mark.skipif(not LOCUSTS.exists(), reason="recordings are not here")
LOCUST = {"left": ("1", "0"), "right": ("1", "2"), "tail": "4", "head": "1"}
BEE = {
    "left": ("L_base", "L_mid", "L_tip"),
    "right": ("R_base", "R_mid", "R_tip"),
    "tail": "L_eye+R_eye",
    "head": "L_mandible_base+R_mandible_base",
}
FLAGS = [
    *("--points.left", *POINTS["left"], "--points.right", *POINTS["right"]),
    *("--points.tail", "tail", "--points.head", "head", "--no-y-down"),
]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run directories land in a folder of the test."""
    monkeypatch.chdir(tmp_path)


def deeplabcut(path: Path, points: dict[str, np.ndarray], animals: tuple[str, ...] = ()) -> Path:
    """CSV as DeepLabCut writes it, each animal with the same points."""
    columns = [
        (a, n, c) for a in animals or ("",) for n in points for c in ("x", "y", "likelihood")
    ]
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["scorer", *["net"] * len(columns)])
        if animals:
            writer.writerow(["individuals", *(a for a, _, _ in columns)])
        writer.writerow(["bodyparts", *(n for _, n, _ in columns)])
        writer.writerow(["coords", *(c for _, _, c in columns)])
        for i in range(len(next(iter(points.values())))):
            cells = [
                1.0 if c == "likelihood" else points[n][i]["xy".index(c)] for _, n, c in columns
            ]
            writer.writerow([i, *cells])
    return path


def sleap(path: Path, points: dict[str, np.ndarray], turned: bool = False) -> Path:
    """Analysis HDF5 of SLEAP, (tracks, 2, nodes, frames), or turned round as MATLAB shows it."""
    tracks = np.stack(list(points.values()))[None].transpose(0, 3, 1, 2)
    with h5py.File(path, "w") as file:
        file["tracks"] = tracks.transpose() if turned else tracks
        file["node_names"] = [name.encode() for name in points]
        file["track_names"] = [b"one"]
    return path


def labels(path: Path, points: dict[str, np.ndarray]) -> Path:
    """SLEAP's own file, with predictions of one tracked animal."""
    nodes, count = list(points), len(next(iter(points.values())))
    skeleton = {"nodes": [{"id": i} for i in range(len(nodes))]}
    about = {"skeletons": [skeleton], "nodes": [{"name": name} for name in nodes]}
    starts = [(name, "<u8") for name in ("instance_id_start", "instance_id_end")]
    frames = np.zeros(count, [("video", "<u4"), ("frame_idx", "<u8"), *starts])
    ends = [(name, "<u8") for name in ("point_id_start", "point_id_end")]
    instances = np.zeros(count, [("instance_type", "u1"), ("track", "<i4"), *ends])
    number = np.arange(count)
    frames["frame_idx"] = frames["instance_id_start"] = number
    frames["instance_id_end"] = number + 1
    instances["instance_type"] = 1
    instances["point_id_start"] = len(nodes) * number
    instances["point_id_end"] = len(nodes) * (number + 1)
    place = [("x", "<f8"), ("y", "<f8"), ("visible", "?")]
    predicted = np.zeros(len(nodes) * count, [*place, ("score", "<f8")])
    every = np.stack(list(points.values()), axis=1).reshape(-1, 2)
    predicted["x"], predicted["y"] = every.T
    predicted["visible"], predicted["score"] = True, 0.5
    with h5py.File(path, "w") as file:
        file.create_group("metadata").attrs.update({"json": json.dumps(about), "format_id": 1.2})
        file["frames"], file["instances"] = frames, instances
        file["points"], file["pred_points"] = np.zeros(0, place), predicted
    return path


def pandas_table(path: Path, points: dict[str, np.ndarray], names: bytes | None = None) -> Path:
    """HDF5 as pandas writes it in format `table`, which DeepLabCut uses."""
    columns = [("net", n, c) for n in points for c in ("x", "y")]
    return write_table(path, columns, np.hstack(list(points.values())), names)


@pytest.mark.parametrize("kind", ["csv", "turned", "sleap", "labels", "pandas"])
def test_every_container_holds_the_same_animal(kind: str, tmp_path: Path) -> None:
    points = animal(dwelling(5, 200))
    plain, wanted = classified(write(tmp_path / "plain.csv", points))
    path = {
        "csv": lambda: deeplabcut(tmp_path / "a.csv", points),
        "turned": lambda: sleap(tmp_path / "a.h5", points, turned=True),
        "sleap": lambda: sleap(tmp_path / "a.h5", points),
        "labels": lambda: labels(tmp_path / "a.slp", points),
        "pandas": lambda: pandas_table(tmp_path / "a.h5", points),
    }[kind]()
    result, found = classified(path, rate=100.0)
    assert found == wanted
    assert result.rows[0].angle_median_rad == pytest.approx(
        plain.rows[0].angle_median_rad, abs=1e-4
    )


def test_each_individual_of_a_file_is_a_trial(tmp_path: Path) -> None:
    path = deeplabcut(tmp_path / "a.csv", animal(dwelling(6, 150)), ("one", "two"))
    result, _ = classified(path, rate=100.0)
    assert [(row.trial, row.animal, row.side) for row in result.rows] == [
        (0, "one", "left"),
        (0, "one", "right"),
        (1, "two", "left"),
        (1, "two", "right"),
    ]
    assert result.summary["trials_in_contact"] == 2


@here
def test_locusts_have_the_angles_that_others_computed() -> None:
    """Angle of each tip off the body axis, against the table beside the recording."""
    with (LOCUSTS / "derived" / "locust_id0.csv").open() as file:
        theirs = list(csv.DictReader(file))
    path = LOCUSTS / "raw" / "locusts-noqr_20250117_5_id0.npz"
    arena = {"kind": "circle"}
    result = antennate.run(
        "tracks", files=[str(path)], points=LOCUST, rate=5.0, playback_rate=30.0, wall=arena
    )
    text = result.experiment.files(result.config)["frames.csv"](result.outcome)
    ours = list(csv.DictReader(text.splitlines()))
    for side, column in (("left", "L_angle_deg"), ("right", "R_angle_deg")):
        found = {row["frame"]: row["angle_rad"] for row in ours if row["side"] == side}
        pairs = [
            (abs(float(row[column])), abs(np.degrees(float(found[row["frame"]]))))
            for row in theirs
            if row[column] and found.get(row["frame"])
        ]
        assert len(pairs) > 2500
        a, b = np.array(pairs).T
        assert np.percentile(abs(a - b), 99) < 0.1
    (wall,) = result.summary["wall"].values()
    assert wall["numbers"][2] * 0.02619 == pytest.approx(30.0, rel=0.06)  # 60 cm across
    assert result.rows[0].rate_hz == 5.0


@here
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--rate", "5"], "expected the frame rate 5 Hz, found 30 Hz in the file"),
        (["--rate", "5", "--playback-rate", "25"], "expected the frame rate 25 Hz, found 30 Hz"),
        (["--playback-rate", "30"], "playback_rate: expected a rate beside it, found none"),
    ],
)
def test_a_wrong_frame_rate_is_one_line(
    words: list[str], expected: str, refused: Callable[..., str]
) -> None:
    file = LOCUSTS / "raw" / "locusts-noqr_20250117_5_id1.npz"
    names = [
        "--points.left",
        "1",
        "0",
        "--points.right",
        "1",
        "2",
        "--points.tail",
        "4",
        "--points.head",
        "1",
    ]
    assert expected in refused("tracks", "--files", file, *names, *words)


@here
def test_bees_are_the_same_in_every_container() -> None:
    stem = "bee_B1-Feb22-0.2M-heptanol_TWO"
    found = [
        antennate.run("tracks", files=[str(BEES / f"{stem}{end}")], points=BEE, rate=30.0).summary
        for end in ("_dlc.csv", ".analysis.h5", ".slp")
    ]
    for other in found[1:]:
        assert other["shapes"] == found[0]["shapes"]
        assert other["sensitivity"] == found[0]["sensitivity"]
    assert max(row["change"] for row in found[0]["sensitivity"]) < 0.15


@here
@pytest.mark.parametrize(
    "file", ["CollectedData_felix.csv", "CollectedData_felix.h5", "*1030000.h5"]
)
def test_labels_are_no_recording(file: str, refused: Callable[..., str]) -> None:
    (path,) = MOSQUITO.glob(file)
    names = [
        "--points.left",
        "head",
        "proboscis",
        "--points.right",
        "none",
        "--points.tail",
        "abdomen",
    ]
    err = refused("tracks", "--files", path, *names, "--rate", 30)
    assert "expected numbers of frames, found an image" in err
    assert "these are labels" in err


@here
def test_files_without_antennae_are_refused_politely(refused: Callable[..., str]) -> None:
    files = sorted(NO_ANTENNA.glob("*.h5")) + sorted(NO_ANTENNA.glob("*.slp"))
    for path in files:
        err = refused("tracks", "--files", path, "--rate", 30)
        assert "expected a point left_base, found " in err
        assert "--points." in err


@here
def test_real_axes_of_sleap_agree_with_its_own_file() -> None:
    """Termites: as many frames as the file has, each with the points that stand there."""
    path = next(NO_ANTENNA.glob("1_*.h5"))
    names = {"left": ("head", "wingpad"), "right": ("none",), "tail": "tail", "head": "head"}
    with h5py.File(path) as file:
        nodes = [name.decode() for name in file["node_names"]]
        tail, head, pad = (
            file["tracks"][0, :, nodes.index(n)] for n in ("tail", "head", "wingpad")
        )
    (ahead_x, ahead_y), (x, y) = head - tail, pad - head
    wanted = abs(np.arctan2(ahead_x * y - ahead_y * x, ahead_x * x + ahead_y * y))
    clean = {"likelihood": 0.0, "smoothing": 0.0, "longest_gap": 0.0, "stretch": 10.0}
    result = antennate.run("tracks", files=[str(path)], points=names, rate=30.0, cleaning=clean)
    rows = list(
        csv.DictReader(
            result.experiment.files(result.config)["frames.csv"](result.outcome).splitlines()
        )
    )
    found = np.array([abs(float(row["angle_rad"] or "nan")) for row in rows])
    np.testing.assert_allclose(found, wanted, atol=1e-4)


def test_what_is_truncated_or_no_such_file_is_one_line(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    points = animal(dwelling(7, 60))
    whole = {
        "a.h5": sleap(tmp_path / "a.h5", points),
        "a.csv": deeplabcut(tmp_path / "a.csv", points),
        "b.csv": write(tmp_path / "b.csv", points),
    }
    np.savez(tmp_path / "a.npz", frame=np.arange(60.0), poseX0=np.zeros(60))
    whole["a.npz"] = tmp_path / "a.npz"
    for name, path in whole.items():
        data = path.read_bytes()
        for share in (0.0, 0.3, 0.97):
            path.write_bytes(data[: int(share * len(data))])
            assert name in refused("tracks", "--files", path, "--rate", 100, *FLAGS)
    assert "expected a readable file" in refused("tracks", "--files", tmp_path / "no.csv")
    assert "expected a file in .csv, .h5" in refused("tracks", "--files", tmp_path / "a.mp4")


def test_no_column_of_the_other_antenna_is_hinted_at(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    """Where the left base is missing, R_base is not meant; what is spelt otherwise may be."""
    names = [*BEE["left"], *BEE["right"], "tail", "head"]
    flags = [*("--points.left", *BEE["left"]), *("--points.right", *BEE["right"])]
    flags += ["--points.tail", "tail", "--points.head", "head"]
    path = tmp_path / "a.csv"
    for base, hint in (("stem", ""), ("L_bases", " (did you mean L_bases_x?)")):
        header = [f"{base if name == 'L_base' else name}_{axis}" for name in names for axis in "xy"]
        path.write_text(",".join(["frame", *header]) + "\n")
        assert f"expected a column L_base_x{hint}, found" in refused(
            "tracks", "--files", path, *flags
        )
    points = {base: np.zeros((3, 2)) for base in names if base != "L_base"}
    deeplabcut(path, points)
    assert "expected a point L_base, found" in refused("tracks", "--files", path, *flags)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("frame,head_x\n1,2\n", "expected a column l0_x"),
        ("{header}\n0,{row}\n", "expected a frame rate, found none in the file; give --rate"),
        (
            "{header}\n1,{row}\n0,{row}\n1,2{row}\n",
            "one place for each point in a frame, found more",
        ),
        ("{header}\n0.5,{row}\n", "expected whole numbers of frames"),
        ("{header}\n0,{row}\n1,2\n", "row 3: expected 21 cells, found 2"),
        ("{header}\n0,{word}\n", "row 2: expected a number or nothing in l0_x, found here"),
        ("{header}\n", "expected rows of frames, found none"),
    ],
)
def test_bad_csv_is_one_line(
    text: str, expected: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    header = "frame," + ",".join(f"{n}_{a}" for n in NAMES for a in "xy")
    cells = ["1.5"] * 20
    text = text.format(header=header, row=",".join(cells), word=",".join(["here", *cells[1:]]))
    (tmp_path / "a.csv").write_text(text)
    assert expected in refused("tracks", "--files", tmp_path / "a.csv", *FLAGS)


@pytest.mark.parametrize(
    ("last", "expected"),
    [
        (300_000_000, "expected frames without large gaps, found 3 rows from frame 0 to 300000000"),
        (10**18, "expected numbers of frames up to 9.0072e+15, found 1e+18"),
    ],
)
def test_a_wrong_number_of_a_frame_does_not_fill_the_memory(
    last: int, expected: str, tmp_path: Path, refused: Callable[..., str]
) -> None:
    header = "frame," + ",".join(f"{n}_{a}" for n in NAMES for a in "xy")
    rows = [f"{frame}," + ",".join(["1.5"] * 20) for frame in (0, 1, last)]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows, ""]))
    words = ("--files", tmp_path / "a.csv", "--rate", 100, *FLAGS)
    assert expected in refused("tracks", *words)


def test_mirrored_coordinates_are_noticed(tmp_path: Path, refused: Callable[..., str]) -> None:
    path = write(tmp_path / "a.csv", animal(dwelling(8, 100)))
    err = refused("tracks", "--files", path, *FLAGS[:-1])
    assert "expected left antennae on the left of the body axis, found 100 % on the right" in err
    assert "--no-y-down" in err


def test_names_of_columns_that_would_run_code_are_refused(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    mark = tmp_path / "mark"
    harmful = f"cbuiltins\nopen\n(V{mark}\nVw\ntR.".encode()
    path = pandas_table(tmp_path / "a.h5", animal(dwelling(9, 20)), harmful)
    err = refused("tracks", "--files", path, "--rate", 100, *FLAGS)
    assert "save it as CSV" in err
    assert not mark.exists()


def test_without_h5py_the_extra_is_named(
    tmp_path: Path, refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = sleap(tmp_path / "a.h5", animal(dwelling(10, 20)))
    monkeypatch.setitem(sys.modules, "h5py", None)
    err = refused("tracks", "--files", path, "--rate", 100, *FLAGS)
    assert "./antennate/packages/* './antennate/packages/antennate-lab[tracks]'" in err
