"""The time series of a trial: every bit comes back, and a damaged file is one line."""

from __future__ import annotations

import base64
import dataclasses
import pickle
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import antennate
from antennate import AntennateError, BadInputError, TimeSeries

ARRAYS = [f.name for f in dataclasses.fields(TimeSeries) if f.name != "meta"]
SIDES = ("left", "right")
ODD = [np.nan, np.inf, -np.inf, -0.0, 5e-324, 0.1, 1 / 3, 1.7976931348623157e308]
"""Floats that a careless writer changes."""


def made(ticks: int = 8, links: int = 6, pitch: int = 0) -> TimeSeries:
    rng = np.random.default_rng(1)
    counts = rng.normal(size=(ticks, 2))
    counts[:, 0] = np.resize(ODD, ticks)
    return TimeSeries(
        t=0.01 * np.arange(ticks),
        counts=counts,
        level=rng.random((ticks, 2)),
        contact=rng.integers(0, 3, (ticks, 2)),
        maneuver=rng.integers(0, 5, ticks),
        yaw=rng.normal(size=(ticks, links - 1)),
        leg=rng.normal(size=(ticks, links, 2)),
        antenna=rng.normal(size=(ticks, 2)),
        pitch=rng.normal(size=(ticks, pitch)),
        head=rng.normal(size=(ticks, 2)),
        meta={"controller": "closed", "seed": 3, "length_m": 0.1, "scene": None, "note": "ä\n,"},
    )


@pytest.mark.parametrize(("ticks", "links", "pitch"), [(8, 6, 0), (1, 4, 3), (30, 8, 7), (0, 6, 0)])
def test_every_bit_comes_back(tmp_path: Path, ticks: int, links: int, pitch: int) -> None:
    series, path = made(ticks, links, pitch), tmp_path / "trial.npz"
    series.save(path)
    found = TimeSeries.load(path)
    assert found.meta == series.meta
    for name in ARRAYS:
        before, after = getattr(series, name), getattr(found, name)
        assert (after.dtype, after.shape) == (before.dtype, before.shape)
        assert after.tobytes() == before.tobytes()


def test_a_file_is_read_in_the_memory_that_it_needs(tmp_path: Path) -> None:
    """A gigabyte is allowed, and not there where a batch system limits the memory."""
    series, path = made(20_000), tmp_path / "trial.npz"
    series.save(path)
    tracemalloc.start()
    found = TimeSeries.load(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10 * path.stat().st_size < 100e6
    assert found.antenna.tobytes() == series.antenna.tobytes()


def test_a_file_is_not_replaced_unasked(tmp_path: Path) -> None:
    path = tmp_path / "trial.npz"
    made().save(path)
    with pytest.raises(AntennateError, match="expected no such file"):
        made(3).save(path)
    assert len(TimeSeries.load(path)) == 8
    made(3).save(path, overwrite=True)
    assert len(TimeSeries.load(path)) == 3
    assert [p.name for p in tmp_path.iterdir()] == ["trial.npz"]


def refusal(path: Path) -> str:
    try:
        TimeSeries.load(path)
    except BadInputError as error:
        return str(error)
    return ""


def test_a_damaged_file_is_one_line(tmp_path: Path) -> None:
    """Cut anywhere or with any byte changed it loads or is refused, and nothing else is raised."""
    good = tmp_path / "good.npz"
    made().save(good)
    data, refused = good.read_bytes(), 0
    rng = np.random.default_rng(2)
    bad = tmp_path / "bad.npz"
    for place in rng.integers(0, len(data), 150).tolist():
        changed = bytearray(data)
        changed[place] ^= 1 << int(rng.integers(8))
        for content in (data[:place], bytes(changed)):
            bad.write_bytes(content)
            why = refusal(bad)
            refused += bool(why)
            assert not why or (str(bad) in why and "\n" not in why)
    assert refused > 150


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("a.npz", b"PK\x03\x04", "zip"),
        ("a.npz", pickle.dumps({"t": 1}), "zip"),
        ("a.csv", b"", "ends in .npz"),
    ],
)
def test_what_is_no_time_series_is_refused(
    tmp_path: Path, name: str, content: bytes, why: str
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(BadInputError, match=why):
        TimeSeries.load(path)


def test_pickled_objects_are_never_loaded(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, t=np.array([{"a": 1}], dtype=object))
    with pytest.raises(BadInputError, match="allow_pickle=False"):
        TimeSeries.load(path)


def test_a_bomb_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    made().save(path)
    data = bytearray(path.read_bytes())
    unpacked_size = data.index(b"PK\x01\x02") + 24  # in the zip's first directory entry
    data[unpacked_size : unpacked_size + 4] = (1 << 31).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(BadInputError, match="unpacked"):
        TimeSeries.load(path)


def test_arrays_of_unequal_length_are_refused() -> None:
    with pytest.raises(
        BadInputError, match=r"yaw: expected numbers of shape \(8, Y\), found shape \(3, 5"
    ):
        dataclasses.replace(made(), yaw=np.zeros((3, 5)))


def test_a_robot_without_antennae_comes_back(tmp_path: Path) -> None:
    bare = dataclasses.replace(made(), antenna=np.zeros((8, 0)))
    bare.save(tmp_path / "bare.npz")
    found = TimeSeries.load(tmp_path / "bare.npz")
    assert found.antenna.shape == (8, 0)
    np.testing.assert_array_equal(found.leg, bare.leg)


def test_a_data_frame_holds_every_column() -> None:
    series = made()
    frame = series.to_dataframe()
    assert len(frame) == 8
    assert (frame["leg_5_right"] == series.leg[:, 5, 1]).all()
    assert (frame["head_y"] == series.head[:, 1]).all()


def test_columns_are_named_by_side_and_axis_and_joints_are_numbered() -> None:
    pairs = [f"{name}_{side}" for name in ("counts", "level", "contact") for side in SIDES]
    legs = [f"leg_{link}_{side}" for link in range(4) for side in SIDES]
    yaw, pitch = [f"yaw_{k}" for k in range(3)], [f"pitch_{k}" for k in range(3)]
    ends = [f"antenna_{side}" for side in SIDES]
    assert list(made(links=4, pitch=3).columns()) == [
        *("t", *pairs, "maneuver", *yaw, *legs, *ends, *pitch, "head_x", "head_y")
    ]


def test_a_series_is_one_line_and_shows_itself_in_a_notebook() -> None:
    series = made(60)
    assert len(repr(series)) < 200
    assert "\n" not in repr(series)
    assert "60 ticks, 0.59 s: controller closed, seed 3" in repr(series)
    page = series._repr_html_()
    forward = 100 * float((series.maneuver == antennate.Maneuver.FORWARD).mean())
    assert f"<td>FORWARD</td><td>{forward:.1f}</td>" in re.sub(' style="[^"]*"', "", page)
    png = base64.b64decode(page.split("data:image/png;base64,")[1].split('"')[0])
    assert png.startswith(b"\x89PNG")
    assert len(page) < 200_000


def test_a_series_without_ticks_or_contact_shows_itself_too() -> None:
    empty = made(0)
    assert "0 ticks" in repr(empty)
    assert "<img" not in empty._repr_html_()
    blind = dataclasses.replace(made(), level=np.full((8, 2), np.nan))
    assert "<td>all</td>" in re.sub(' style="[^"]*"', "", blind._repr_html_())
