"""`calibrate --curve`: a line or an isotonic curve is saved and driven with; what a fit misses."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

import antennate
from antennate.antenna.calibration import Calibration
from antennate.cli import main
from antennate.control.conditioning import bending_level, curves
from antennate.errors import BadInputError, CalibrationError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import RobotFile
from antennate.hardware.safety.channel import Band
from antennate.params.base import read_file
from antennate.params.control import ConditioningParams, ControlParams, CurveParams
from antennate.types import Floats

BENT, STRAIGHT = 1400.0, 1800.0
"""Readings of the true line at levels of 1 and 0 [counts]."""
POINTS = 60


def truth(counts: Floats) -> Floats:
    """The true line, in closed form."""
    return np.clip((STRAIGHT - counts) / (STRAIGHT - BENT), 0.0, 1.0)


def pushes(
    number: int = 6, noise: float = 1.0, apart: float = 0.0
) -> tuple[Floats, Floats, Floats]:
    """Bends, readings of the true line with noise and an offset of each push, and their pushes."""
    rng = np.random.default_rng(3)
    bend, trial = np.tile(np.linspace(0, 1, POINTS), number), np.repeat(np.arange(number), POINTS)
    counts = STRAIGHT - (STRAIGHT - BENT) * bend + rng.normal(0, noise, len(bend))
    return bend, counts + rng.normal(0, apart, number)[trial], trial


def recorded(path: Path) -> Path:
    """A recording of the line, each push there and back."""
    bend = np.tile(np.concatenate([np.linspace(0, 1, POINTS), np.linspace(1, 0, POINTS)]), 4)
    noise = np.random.default_rng(2).normal(0, 1, len(bend))
    counts = STRAIGHT - (STRAIGHT - BENT) * bend + noise
    rows = [f"{i / 100},{c:.3f},{b:.6f}" for i, (c, b) in enumerate(zip(counts, bend, strict=True))]
    path.write_text("\n".join(["time,counts,bend", *rows, ""]))
    return path


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of `calibrate` on that recording, with the sigmoid and with the line beside it."""
    folder = tmp_path_factory.mktemp("line")
    words = ["calibrate", "--recording", str(recorded(folder / "a.csv")), "--no-figures"]
    for kind in ("sigmoid", "line"):
        assert main([*words, "--curve", kind, "--out", str(folder / kind)]) == 0
    return folder / "line"


def test_a_line_that_predicts_better_is_offered_and_saved(
    line: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sigmoid stays the default; each says which curve it is."""
    content = json.loads((line / "calibration.json").read_text())
    assert content["kind"] == "line"
    assert content["knots"] == pytest.approx([BENT, STRAIGHT], abs=0.5)
    assert content["knot_levels"] == [1.0, 0.0]
    assert content["misfit"] is None
    assert content["rmse"] == pytest.approx(1.0 / (STRAIGHT - BENT), rel=0.1)  # noise of a count
    words = ["calibrate", "--recording", str(line.parent / "a.csv"), "--no-figures"]
    assert main([*words, "--curve", "line", "--out", str(tmp_path / "line")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "One line explains R² 1.00 of 4 pushes; in a new push b errs by" in said
    assert "Curve: line, straight between 2 knots, from b = 1.00 at 1400 counts to 0.00 at" in said
    assert "slope" not in said
    assert main([*words, "--out", str(tmp_path / "plain")]) == 0
    assert "--curve line saves that curve." in " ".join(capsys.readouterr().out.split())
    assert Calibration.load(tmp_path / "plain" / "calibration.json").kind == "sigmoid"


def test_every_consumer_has_the_levels_of_the_closed_form(line: Path, tmp_path: Path) -> None:
    """A robot's file, a simulated walk and the replay of its log."""
    probe = np.array([[np.nan, 1300.0], [1400.0, 1500.0], [1650.0, 1800.0], [1900.0, 1234.5]])
    (tmp_path / "robot.toml").write_text(
        f'calibration = "{line / "calibration.json"}"\n'
        f'calibration_right = "{line.parent / "sigmoid" / "calibration.json"}"\n'
    )
    own = read_file(tmp_path / "robot.toml", RobotFile).calibrated().control
    level = bending_level(curves(own), probe)
    assert level[:, 0] == pytest.approx(truth(probe[:, 0]), abs=0.005, nan_ok=True)
    right = own.conditioning_right
    assert right is not None
    x = (probe[:, 1] - right.counts_low) / (right.counts_high - right.counts_low)
    assert level[:, 1] == pytest.approx(1 / (1 + np.exp(right.slope * (x - right.midpoint))))

    control = read_file(line / "conditioning.toml", TunnelConfig).control
    once = control.conditioning.model_copy(update={"averaging_time": 0.01})  # one reading
    control = control.model_copy(update={"conditioning": once})
    log = tmp_path / "walk.mcap"
    series = antennate.simulate(time_limit=1.0, control=control, log=log)
    usable = np.isfinite(series.level)
    assert series.level[usable] == pytest.approx(truth(series.counts[usable]), abs=0.005)
    assert np.ptp(series.level[usable]) > 0.1  # it did touch
    assert main(["log", "replay", str(log)]) == 0


def test_readings_out_of_range_are_judged_as_before(line: Path) -> None:
    """OUT_OF_CAL goes by the ends of the recording, whatever the curve."""
    found = Calibration.load(line / "calibration.json")
    band = Band.of(found.conditioning(), found.reach)
    assert (band.low, band.high) == (found.counts_low, found.counts_high)
    assert band.low == pytest.approx(BENT, abs=5)
    assert found.level(np.array([0.0, 4000.0])).tolist() == [1.0, 0.0]


def test_an_isotonic_curve_runs_straight_between_the_middles_of_its_steps() -> None:
    """By hand: of levels 0, 0.2, 0.7 and 0.5 pooled to 0.6, 1; a reading at each, 8 times."""
    counts = np.array([1000.0, 1100.0, 1230.0, 1270.0, 1400.0])
    level = np.array([0.0, 0.2, 0.7, 0.5, 1.0])
    trial = np.repeat(np.arange(8), 5)
    found = antennate.fit_calibration(np.tile(counts, 8), np.tile(level, 8), trial, kind="isotonic")
    assert found.knots == (1000.0, 1100.0, 1250.0, 1400.0)
    assert found.knot_levels == pytest.approx((0.0, 0.2, 0.6, 1.0))
    assert found.level(np.array([1175.0, 1325.0, 900.0])) == pytest.approx([0.4, 0.8, 0.0])


@pytest.mark.parametrize(
    ("counts", "level", "threshold", "half"),
    [
        # bent to 0.18 of the full flex, so that a sigmoid has its half far outside the readings
        (np.linspace(1700.0, 1400.0, 60), np.linspace(0.05, 0.18, 60), 0.1, 1550.0),
        # a jump within 12 of 4000 counts: the slope of a sigmoid is 4.39 * 4000 / 12 at least
        (
            np.r_[
                np.linspace(30, 1999, 30), np.linspace(2000, 2014, 15), np.linspace(2015, 4030, 30)
            ],
            np.r_[np.zeros(30), np.linspace(0, 1, 15), np.ones(30)],
            0.5,
            2007.0,
        ),
    ],
)
def test_a_recording_that_no_sigmoid_describes_has_another_curve(
    counts: Floats, level: Floats, threshold: float, half: float, tmp_path: Path
) -> None:
    given = {"counts": counts, "level": level, "threshold": threshold}
    with pytest.raises(CalibrationError, match=r"expected a curve \(sigmoid\)"):
        antennate.fit_calibration(**given)
    for kind in ("line", "isotonic"):
        antennate.fit_calibration(**given, kind=kind).save(path := tmp_path / f"{kind}.json")
        found = Calibration.load(path)
        middle = (level[0] + level[-1]) / 2
        assert found.level(np.array([half])) == pytest.approx([middle], abs=0.01)


def test_a_curve_of_the_wrong_shape_has_its_size_and_no_interval(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The best sigmoid of a line errs by 0.029 (rms), by quadrature, however little noise is."""
    x = (np.arange(4000) + 0.5) / 4000
    wrong = minimize(lambda k: np.mean((1 / (1 + np.exp(-k[0] * (x - 0.5))) - x) ** 2), [4.0])
    bend, counts, trial = pushes()
    found = antennate.fit_calibration(counts, bend, trial)
    assert found.misfit == pytest.approx(math.sqrt(wrong.fun), rel=0.15)
    path = recorded(tmp_path / "a.csv")
    words = ["--recording", str(path), "--no-figures", "--out", str(tmp_path / "run")]
    assert main(["calibrate", *words]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "(no interval: the curve errs by 0.029 in b alike in all pushes" in said
    assert "slope 4.9" in said
    assert "midpoint 0.499" in said
    assert "95 % - polarity" in said
    assert "error of the curve at b = 0.5, 95 % -" in said


@pytest.mark.parametrize(("noise", "apart"), [(4.0, 0.0), (1.0, 15.0)])
def test_what_differs_from_push_to_push_is_no_misfit(noise: float, apart: float) -> None:
    """Readings of a push err together, but not alike: the curve that is true has none."""
    bend, counts, trial = pushes(8, noise, apart)
    found = antennate.fit_calibration(counts, bend, trial, kind="line")
    assert found.misfit is None
    sigmoid = 1600 + 50 * np.log(np.clip(bend, 0.01, 0.99) / (1 - np.clip(bend, 0.01, 0.99)))
    offset = np.random.default_rng(5).normal(0, apart, 8)[trial]
    noisy = sigmoid + offset + np.random.default_rng(6).normal(0, noise, len(bend))
    found = antennate.fit_calibration(noisy, np.clip(bend, 0.01, 0.99), trial)
    assert found.misfit is None
    assert found.slope_95 is not None


def test_hysteresis_that_every_push_has_is_a_misfit(tmp_path: Path) -> None:
    """Ways apart by 5 % of the span at b = 1/2, as sin: of rms 0.025 / sqrt(2) in b, by hand."""
    bend = np.tile(np.concatenate([np.linspace(0, 1, POINTS), np.linspace(1, 0, POINTS)]), 5)
    way = np.tile(np.repeat([1.0, -1.0], POINTS), 5)
    noise = np.random.default_rng(1).normal(0, 1, len(bend))
    counts = 1400 + 400 * (bend + 0.025 * way * np.sin(np.pi * bend)) + noise
    rows = [f"{i / 100},{c:.3f},{b:.6f}" for i, (c, b) in enumerate(zip(counts, bend, strict=True))]
    (tmp_path / "a.csv").write_text("\n".join(["time,counts,bend", *rows, ""]))
    found = antennate.run("calibrate", recording=str(tmp_path / "a.csv"), curve="line").found
    assert found.calibration.misfit == pytest.approx(0.025 / math.sqrt(2), rel=0.15)


def test_a_file_of_an_older_version_is_a_sigmoid(line: Path, tmp_path: Path) -> None:
    content = json.loads((line / "calibration.json").read_text())
    for key in ("kind", "knots", "knot_levels", "misfit"):
        del content[key]
    (tmp_path / "old.json").write_text(json.dumps(content))
    found = Calibration.load(tmp_path / "old.json")
    assert (found.kind, found.knots) == ("sigmoid", ())
    x = (1600 - found.counts_low) / (found.counts_high - found.counts_low)
    b = 1 / (1 + math.exp(found.slope * (x - found.midpoint)))
    assert found.level(np.array([1600.0]))[0] == pytest.approx(b)


def test_a_result_of_an_older_version_is_reported(line: Path, tmp_path: Path) -> None:
    """Without what they did not know yet."""
    shutil.copytree(line.parent / "sigmoid", tmp_path / "run")
    file = tmp_path / "run" / "result.json"
    content = json.loads(file.read_text())
    for part, keys in (
        (content, ("hysteretic", "plateau")),
        (content["recording"], ("units",)),
        (content["calibration"], ("kind", "knots", "knot_levels", "misfit", "noise_counts")),
        (content["assessment"], ("relaxation",)),
    ):
        for key in keys:
            del part[key]
    file.write_text(json.dumps(content))
    assert main(["report", str(tmp_path / "run")]) == 0
    assert "One sigmoid explains" in (tmp_path / "run" / "report.html").read_text()


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"kind": "line", "knots": [], "knot_levels": []}, "kind: expected sigmoid without knots"),
        ({"kind": "sigmoid"}, "kind: expected sigmoid without knots, or another with, found"),
        ({"kind": "spline"}, "kind: expected"),
        ({"knots": [1800.0, 1400.0]}, "knots: expected two rising readings or more"),
        ({"knots": [1400.0]}, "knots: expected two rising readings or more"),
        ({"knot_levels": [0.0, 1.0]}, "that go one way, by polarity -1, found 2 and 2, out of"),
        ({"knot_levels": [1.5, 0.0]}, "knot_levels"),
        ({"knots": [1599.0, 1603.0]}, "over 10 counts or more, found 3.2"),
    ],
)
def test_a_curve_that_no_sensor_has_is_refused(
    changed: dict[str, object], why: str, line: Path, tmp_path: Path
) -> None:
    content = json.loads((line / "calibration.json").read_text()) | changed
    (tmp_path / "bad.json").write_text(json.dumps(content))
    with pytest.raises(BadInputError, match=why):
        Calibration.load(tmp_path / "bad.json")


def test_knots_and_a_sigmoid_are_one_or_the_other() -> None:
    with pytest.raises(BadInputError, match="slope: expected the default, as with knots"):
        ConditioningParams(slope=5.0, knots=(1400.0, 1800.0), knot_levels=(1.0, 0.0))
    own = CurveParams(knots=(1400.0, 1800.0), knot_levels=(1.0, 0.0))
    control = ControlParams(conditioning_right=own)
    level = bending_level(curves(control), np.array([[1600.0, 1600.0]]))
    assert level[0, 1] == 0.5
    assert level[0, 0] == bending_level(ConditioningParams(), np.array(1600.0))


def test_volts_beyond_the_converter_are_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three of 120 readings lie above what it tells apart; they are held there, and it is said."""
    bend = np.linspace(0, 1, 120)
    volts = 0.5 + 1.5 * bend
    volts[-3:] = 3.29
    rows = [f"{i / 100},{v:.5f},{b:.4f}" for i, (v, b) in enumerate(zip(volts, bend, strict=True))]
    (tmp_path / "a.csv").write_text("\n".join(["time,volts,bend", *rows, ""]))
    words = ["--columns.counts-column", "volts", "--columns.reading-unit", "V", "--no-figures"]
    words += ["--columns.most-lost", "0.1", "--out", str(tmp_path / "run")]
    assert main(["calibrate", "--recording", str(tmp_path / "a.csv"), *words]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "became counts by the board's converter, 3 of them held at an end of its range" in said
