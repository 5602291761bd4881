"""`antennate calibrate`: pushes counted one way, hysteresis told from bad data, bad columns."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import antennate
from antennate.cli import main
from antennate.types import Floats

POINTS = 60
UP = np.linspace(0.0, 1.0, POINTS)


def written(
    path: Path, counts: Floats, bend: Floats, t: Floats, trial: Floats | None = None
) -> str:
    """A recording as a file."""
    names, columns = ["time", "counts", "bend"], [t, counts, bend]
    if trial is not None:
        names, columns = ["trial", *names], [trial, *columns]
    rows = [",".join(f"{value:.17g}" for value in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([",".join(names), *rows, ""]))
    return str(path)


def loops(pushes: int, gap: float, noise: float = 2.0) -> tuple[Floats, Floats, Floats]:
    """Readings, bends and times of pushes there and back; both ways are `gap` of the span apart."""
    bend = np.tile(np.concatenate([UP, UP[::-1]]), pushes)
    way = np.tile(np.repeat([1.0, -1.0], POINTS), pushes)
    off = np.random.default_rng(0).normal(0.0, noise, len(bend))
    counts = 1500 + 400 * (bend + gap / 2 * way * np.sin(np.pi * bend)) + off
    return np.round(counts), bend, np.arange(len(bend)) / 100.0


def test_one_long_recording_is_as_many_pushes_everywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path / "long.csv", *loops(4, 0.05))
    found = antennate.run("calibrate", recording=file).found
    assert found.calibration.trials == found.assessment.pushes == 4
    assert main(["calibrate", "--recording", file, "--no-figures"]) == 0
    told = capsys.readouterr().out
    assert "pushes: 4" in told
    assert "of 4 pushes" in told


def test_a_long_recording_has_the_intervals_of_its_pushes(tmp_path: Path) -> None:
    """Readings of one push err together: what is drawn anew is the push."""
    counts, bend, t = loops(6, 0.0)
    counts = counts + 20 * np.repeat([1, -1, 2, -2, 1, -1], 2 * POINTS)
    trial = np.repeat(np.arange(6.0), 2 * POINTS)
    files = [
        written(tmp_path / "long.csv", counts, bend, t),
        written(tmp_path / "trials.csv", counts, bend, t, trial),
    ]
    ends = [antennate.run("calibrate", recording=f).found.calibration.midpoint_95 for f in files]
    assert ends[0] == pytest.approx(ends[1], rel=0.002)  # one reading lies between two pushes


@pytest.mark.slow
def test_intervals_over_four_pushes_hold_the_truth_as_often_as_they_say() -> None:
    """Pushes with offsets of their own about the true curve: of 60 sets, 52 is beyond three sigma.

    A bootstrap over the four pushes holds it in 47.
    """
    rng, hits = np.random.default_rng(4), 0
    bend = np.linspace(0.01, 0.99, POINTS)
    for _ in range(60):
        counts = 1600 + 50 * np.log(bend / (1 - bend)) + rng.normal(0, 20, (4, 1))
        counts = np.rint(counts + rng.normal(0, 2.5, counts.shape)).ravel()
        found = antennate.fit_calibration(counts, np.tile(bend, 4), np.repeat(np.arange(4), POINTS))
        assert found.midpoint_95 is not None
        low, high = found.midpoint_95
        span = found.counts_high - found.counts_low
        hits += low <= (1600 - found.counts_low) / span <= high
    assert hits > 52


def test_the_text_says_what_the_intervals_are_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for pushes, told in (
        (1, "No interval: one push; it takes 3 or more."),
        (1, "(no interval: one push; it takes 3 or more)"),
        (2, "(no interval: 2 pushes; it takes 3 or more)"),
        (3, "No interval: the curve errs by 0.02"),  # of a line, test_calibrate_curves.py
    ):
        file, out = written(tmp_path / f"{pushes}.csv", *loops(pushes, 0.0)), tmp_path / "run"
        words = ["calibrate", "--recording", file, "--no-figures", "--overwrite"]
        assert main([*words, "--out", str(out)]) == 0
        assert told in " ".join(capsys.readouterr().out.split())
        held = [json.loads((out / f"{n}.json").read_text()) for n in ("calibration", "result")]
        for ends in (held[0]["slope_95"], held[1]["calibration"]["midpoint_95"]):
            assert (ends is None) == (pushes < 3)
        assert held[0] == held[1]["calibration"]
        assert main(["report", str(out)]) == 0
        capsys.readouterr()


def test_pushes_that_are_alike_have_no_interval_and_the_file_is_taken(tmp_path: Path) -> None:
    """Three times the same readings, or one push: neither tells anything of the next."""
    counts, bend, _ = loops(1, 0.0)
    thrice = np.repeat(np.arange(3), len(bend))
    for found in (
        antennate.fit_calibration(np.tile(counts, 3), np.tile(bend, 3), thrice),
        antennate.fit_calibration(counts, bend),
    ):
        assert found.slope_95 is None
        assert found.midpoint_95 is None
        found.save(tmp_path / "left.json", overwrite=True)
        assert antennate.Calibration.load(tmp_path / "left.json") == found


@pytest.mark.parametrize(
    ("gap", "noise", "told"),
    [(0.5, 2.0, "the rest is hysteresis"), (0.0, 110.0, "perhaps marks and readings do not match")],
)
def test_hysteresis_is_told_from_data_that_do_not_match(
    gap: float, noise: float, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path / "loop.csv", *loops(4, gap, noise))
    assert main(["calibrate", "--recording", file, "--no-figures"]) == 0
    assert told in " ".join(capsys.readouterr().out.split())


def test_hysteresis_is_a_share_of_the_span_in_the_table(tmp_path: Path) -> None:
    """By hand: ways 0.5 * 400 sin(pi b) counts apart, so 200 where b is 0.5."""
    result = antennate.run("calibrate", recording=written(tmp_path / "loop.csv", *loops(4, 0.5)))
    curve = result.found.calibration
    cells = dict(result.experiment.tables(result.found)[-1].rows)
    share = 100 * 200 / (curve.counts_high - curve.counts_low)
    (largest,), (bend,) = cells["  largest gap [% of the span]"], cells["  at a bend of"]
    assert float(largest) == pytest.approx(share, rel=0.02)
    assert float(bend) == pytest.approx(0.5, abs=0.05)
    assert cells["relaxation in a hold [% of the span]"] == ["-"]


@pytest.mark.parametrize(
    ("factor", "offset", "row", "found"), [(0.25, 0.0, 122, "0.25"), (1.0, 1e17, 2, "1e+17")]
)
def test_trials_are_numbered_in_whole_numbers(
    factor: float,
    offset: float,
    row: int,
    found: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    trial = offset + factor * np.repeat(np.arange(4.0), 2 * POINTS)
    file = written(tmp_path / "trials.csv", *loops(4, 0.05), trial)
    assert main(["calibrate", "--recording", file]) == 2
    error = capsys.readouterr().err
    assert f"row {row}: expected a whole number" in error
    assert f"in trial, found {found};" in error


def test_milliseconds_declared_as_seconds_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """100 Hz, so exactly 10 s apart if it were seconds."""
    counts, bend, t = loops(4, 0.05)
    file = written(tmp_path / "ms.csv", counts, bend, np.round(1000 * t))
    assert main(["calibrate", "--recording", file]) == 2
    assert "is s the right --columns.time-unit?" in capsys.readouterr().err
    words = ["--columns.time-unit", "ms", "--no-figures"]
    assert main(["calibrate", "--recording", file, *words]) == 0
