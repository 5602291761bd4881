"""Calibration: known truths come back, files hold what was found, bad data are refused by row."""

from __future__ import annotations

import csv
import functools
import json
import re
from pathlib import Path

import numpy as np
import pytest

from antennate.antenna import fitting
from antennate.antenna.calibration import Calibration
from antennate.antenna.curves import Samples
from antennate.cli import main
from antennate.errors import CalibrationError, OutputError
from antennate.experiments.calibrate.recording import Recording, RecordingParams, read, write
from antennate.experiments.calibrate.run import (
    CalibrateConfig,
    CalibrateOutcome,
    RigParams,
    averaged,
    run,
)
from antennate.types import Floats

LOW, HIGH = 1300.0, 1900.0
HASH = "0" * 64
DATA = Path(__file__).parents[2] / "shared" / "data"


def simulated(
    slope: float, midpoint: float, sign: int, seed: int, noise: float = 2.5, pushes: int = 30
) -> Samples:
    """Counts that a sigmoid of x = (counts - LOW) / (HIGH - LOW) turns into the true bend."""
    rng = np.random.default_rng(seed)
    bend = np.tile(np.linspace(0.01, 0.99, 60), pushes)
    x = midpoint + sign * np.log(bend / (1 - bend)) / slope
    counts = np.rint(LOW + x * (HIGH - LOW) + rng.normal(0, noise, len(bend)))
    n = len(bend)
    trial = np.repeat(np.arange(pushes), 60)
    return Samples(counts, bend, trial, np.full(n, np.nan), np.arange(2, n + 2))


def fit(samples: Samples, **rest: object) -> Calibration:
    return fitting.fit(samples, "left-1", HASH, **rest)  # pyright: ignore[reportArgumentType]


@functools.cache
def found_once() -> Calibration:
    """One calibration for tests of what is done with it."""
    return fit(simulated(14.0, 0.4, -1, 1))


SEEDS = [*range(3), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 20))]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_known_truth_comes_back(seed: int, sign: int) -> None:
    """Midpoint within 1 %, slope within 5 %, in counts, whatever the normalisation."""
    slope, midpoint = 18.3, 0.45
    found = fit(simulated(slope, midpoint, sign, seed))
    span = found.counts_high - found.counts_low
    assert found.polarity == sign
    true = LOW + midpoint * (HIGH - LOW)
    assert found.counts_low + found.midpoint * span == pytest.approx(true, rel=0.01)
    assert found.slope / span == pytest.approx(slope / (HIGH - LOW), rel=0.05)
    assert found.r2 > 0.98


@pytest.mark.parametrize(("sets", "least"), [(10, 7), pytest.param(20, 15, marks=pytest.mark.slow)])
def test_intervals_hold_the_truth_about_as_often_as_they_say(sets: int, least: int) -> None:
    """95 % intervals of the midpoint: of 20, 19 are expected; fewer than 15 is beyond four sigma.

    Of 10, so is fewer than 7.
    """
    hits = 0
    for seed in range(sets):
        found = fit(simulated(12.0, 0.5, 1, 100 + seed, noise=8.0, pushes=12))
        assert found.midpoint_95 is not None
        low, high = found.midpoint_95
        span = found.counts_high - found.counts_low
        true = (LOW + 0.5 * (HIGH - LOW) - found.counts_low) / span
        hits += low <= true <= high
    assert hits >= least


def test_a_line_is_preferred_where_it_is_true() -> None:
    rng = np.random.default_rng(0)
    bend = np.tile(np.linspace(0, 1, 50), 10)
    counts = np.rint(1800 - 400 * bend + rng.normal(0, 3, 500))
    trial = np.repeat(np.arange(10), 50)
    found = fit(Samples(counts, bend, trial, np.full(500, 0.1), np.arange(500) + 2))
    assert "line" in found.better_than_sigmoid
    assert found.cross_validated_rmse["line"] == pytest.approx(3 / 400, rel=0.1)


def test_a_sigmoid_is_not_beaten_by_a_line_where_it_is_true() -> None:
    assert "line" not in fit(simulated(10.0, 0.5, -1, 3)).better_than_sigmoid


def test_the_controller_gets_the_same_curve() -> None:
    samples = simulated(14.0, 0.4, -1, 1)
    found = fit(samples)
    level = found.level(samples.counts)
    assert np.sqrt(np.mean((level - samples.level) ** 2)) == pytest.approx(found.rmse, rel=1e-9)


def test_a_saved_file_is_read_back_and_never_replaced_unasked(tmp_path: Path) -> None:
    found, path = found_once(), tmp_path / "left.json"
    found.save(path)
    assert Calibration.load(path) == found
    other = found.model_copy(update={"slope": 1.0})
    with pytest.raises(OutputError, match="expected no such file"):
        other.save(path)
    assert Calibration.load(path) == found
    other.save(path, overwrite=True)
    assert Calibration.load(path).slope == 1.0
    assert [file.name for file in tmp_path.iterdir()] == ["left.json"]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"slope": 0.0}, "slope"),
        ({"slope": 1e9}, "slope"),
        ({"polarity": 0}, "polarity"),
        ({"counts_low": 1900.0, "counts_high": 1900.0}, "counts_high"),
        ({"counts_high": 5000.0}, "counts_high"),
        ({"schema_version": 2}, "schema_version"),
        ({"threshold": 1.5}, "threshold"),
        ({"sensor_id": "../left"}, "sensor_id"),
        ({"extra": 1}, "extra"),
        ({"midpoint": "0.3"}, "midpoint"),
    ],
)
def test_a_bad_file_is_refused_with_its_field(
    tmp_path: Path, change: dict[str, object], word: str
) -> None:
    content = found_once().model_dump(mode="json") | change
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(content))
    with pytest.raises(CalibrationError, match=word):
        Calibration.load(path)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"slope": NaN}', '{"slope": 1e999}', "\x00"])
def test_what_is_no_calibration_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(CalibrationError):
        Calibration.load(path)


def table(counts: Floats, bend: Floats) -> str:
    lines = [
        f"{0.01 * i:.2f},{c:g},{b:.6f}" for i, (c, b) in enumerate(zip(counts, bend, strict=True))
    ]
    return "\n".join(["time,counts,bend", *lines]) + "\n"


BEND = np.linspace(0, 1, 100)
GOOD = 1800 - 400 * BEND


def spoiled(row: int, cell: str) -> str:
    lines = table(GOOD, BEND).splitlines()
    lines[row - 1] = cell
    return "\n".join(lines) + "\n"


BAD = {
    "non-monotonic": (
        table(1800 - 400 * np.sin(3 * BEND), BEND),
        r"row \d+.*non-monotonic.*sensor",
    ),
    "constant": (table(np.full(100, 1500.0), BEND), r"row 2.*constant.*wiring"),
    "saturated": (table(np.where(BEND > 0.5, 0, GOOD), BEND), r"row 52.*saturated.*resistor"),
    "nan": (spoiled(7, "0.05,nan,0.05"), r"row 7.*finite.*delete the row"),
    "word": (spoiled(9, "0.07,wet,0.07"), r"row 9.*'wet'"),
    "volts": (table(GOOD / 4095 * 3.3, BEND), r"row 2.*volts"),
    "beyond 12 bits": (spoiled(5, "0.03,5000,0.03"), r"row 5.*0 to 4095"),
    "degrees as a share": (table(GOOD, 90 * BEND), r"row 4.*bend-unit"),
    "truncated": (table(GOOD, BEND)[:-5], r"row 101.*truncated"),
    "short row": (spoiled(101, "0.99,1400"), r"row 101.*expected 3 cells, found 2.*truncated"),
    "time goes back": (spoiled(50, "0.01,1600,0.5"), r"row 50.*time to rise"),
    "milliseconds as seconds": (
        "time,counts,bend\n" + "".join(f"{20 * i},{GOOD[i]},{BEND[i]}\n" for i in range(100)),
        r"row 3.*time-unit",
    ),
    "too few": (table(GOOD[:5], BEND[:5]), r"row 6.*at least 20 readings"),
    "no bend": (table(GOOD, np.full(100, 0.5)), r"row 2.*a tenth of the full"),
    "no column": (table(GOOD, BEND).replace("counts", "adc"), r"row 1.*column counts.*time, adc"),
    "twice": (
        table(GOOD, BEND).replace("time,counts,bend", "time,counts,bend,bend"),
        r"row 1.*one column bend",
    ),
    "no sense": (
        table(1500 + 30 * np.random.default_rng(0).normal(size=100), BEND),
        r"row \d+.*non-monotonic|explains",
    ),
    "empty": ("", r"row 1.*expected a"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_recording_is_refused_in_one_line_and_nothing_is_written(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, word = BAD[name]
    file, out = tmp_path / "bad.csv", tmp_path / "out"
    file.write_text(text)
    words = ["--columns.most-lost", "0", "--out", str(out)]
    assert main(["calibrate", "--recording", str(file), *words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert re.search(word, said), said
    assert not out.exists()


def test_a_recording_with_units_is_what_it_says(tmp_path: Path) -> None:
    file = tmp_path / "r.csv"
    rows = [f"{10 * i},{1800 - 4 * i},{0.9 * i}" for i in range(100)]
    file.write_text("\n".join(["ms,adc,angle", *rows]) + "\n")
    columns = RecordingParams(
        time_column="ms",
        time_unit="ms",
        counts_column="adc",
        bend_column="angle",
        bend_unit="deg",
        bend_zero=0.0,
        bend_full=90.0,
    )
    found = read(file, columns)
    assert found.t[50] == pytest.approx(0.5)
    assert found.samples.level[50] == pytest.approx(0.5)
    assert found.samples.row[0] == 2


def test_averaging_takes_the_mean_of_the_last_readings_of_a_push() -> None:
    counts = np.array([1.0, 2.0, 3.0, 10.0, 20.0])
    trial = np.array([0, 0, 0, 1, 1])
    s = Samples(counts, counts, trial, counts, trial)
    t = np.array([0.0, 0.01, 0.02, 0.0, 0.01])
    assert averaged(Recording(t, s, ""), 0.02).samples.counts.tolist() == [1, 1.5, 2.5, 10, 15]


RIG = CalibrateConfig(rig=RigParams(pushes=2))


@pytest.fixture(scope="module")
def one() -> CalibrateOutcome:
    """What the rig finds with one worker."""
    return run(RIG, 1)


@pytest.mark.ci
def test_the_rig_gives_the_same_on_one_and_two_workers_and_from_its_own_recording(
    one: CalibrateOutcome, tmp_path: Path
) -> None:
    two = run(RIG, 2)
    assert one.result() == two.result()
    file = tmp_path / "recording.csv"
    file.write_text(write(one.raw))
    again = run(RIG.model_copy(update={"recording": str(file), "sensor_id": "simulated"}))
    assert again.calibration == one.calibration
    unnamed = run(RIG.model_copy(update={"recording": str(file)}))
    assert unnamed.calibration.sensor_id == "unnamed"


@pytest.mark.parametrize("noise", [0.02, 0.25])
def test_a_poor_curve_is_warned_of(
    noise: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Noise of a quarter of the range leaves much of the bend unexplained."""
    rng = np.random.default_rng(3)
    bend = np.tile(np.linspace(0.0, 1.0, 200), 2)
    counts = 1500.0 - 400.0 * bend + rng.normal(0.0, 400.0 * noise, len(bend))
    file = tmp_path / "poor.csv"
    rows = [f"{n},{c:.1f},{b:.4f}" for n, (c, b) in enumerate(zip(counts, bend, strict=True))]
    file.write_text("\n".join(["time,counts,bend", *rows]) + "\n")
    words = ["--out", str(tmp_path / "out")]
    words += [] if noise > 0.1 else ["--no-figures"]
    assert main(["calibrate", "--recording", str(file), *words]) == 0
    assert ("record again" in capsys.readouterr().out) == (noise > 0.1)


def test_the_rig_sees_readings_fall_as_the_rod_goes_in(one: CalibrateOutcome) -> None:
    assert one.calibration.polarity == -1
    assert {speed.speed_m_s for speed in one.calibration.speeds} == {0.05, 0.10, 0.15}
    fsr = RIG.model_dump()
    fsr["antenna"]["sensor"]["kind"] = "fsr"
    assert run(CalibrateConfig.model_validate(fsr)).calibration.polarity == 1


@pytest.mark.skipif(not (DATA / "flex_static_12bit").exists(), reason="recordings not present")
def test_a_real_flex_sensor_in_static_holds(tmp_path: Path) -> None:
    """SOURCE.md of the recording: slope 129.8, midpoint 0.0640 in x = counts / 4095, sign +."""
    source = next((DATA / "flex_static_12bit" / "derived").glob("*.csv"))
    with source.open() as file:
        rows = list(csv.DictReader(file))
    counts = np.array([float(r["adc12_if_3v3"]) for r in rows])
    angle = np.array([float(r["angle_deg"]) for r in rows])
    trial = np.unique(angle, return_inverse=True)[1]
    samples = Samples(
        counts, angle / 90.0, trial, np.full(len(angle), np.nan), np.arange(len(angle))
    )
    found = fit(samples, full_scale=True)
    assert found.polarity == 1
    assert found.midpoint == pytest.approx(0.0640, rel=0.02)
    assert found.slope == pytest.approx(129.8, rel=0.1)


@pytest.mark.skipif(not (DATA / "whisker_straingauge_bend").exists(), reason="no recordings")
def test_a_real_strain_gauge_is_served_better_by_a_line() -> None:
    """A strain gauge answers bending in proportion; counts are its millivolts times 400."""
    source = DATA / "whisker_straingauge_bend" / "derived" / "inc50_plateaus.csv"
    with source.open() as file:
        rows = list(csv.DictReader(file))
    counts = 400.0 * np.array([float(r["ch1_mV"]) for r in rows])
    bend = np.array([float(r["tip_lever_mm_inferred"]) for r in rows])
    repeat = np.array([int(r["rep"]) for r in rows])
    n = len(rows)
    found = fit(Samples(counts, bend / bend.max(), repeat, np.full(n, np.nan), np.arange(n)))
    assert "line" in found.better_than_sigmoid
    assert found.cross_validated_rmse["line"] < 0.03


@pytest.mark.skipif(not (DATA / "flex_textile_mocap").exists(), reason="no recordings")
def test_a_real_textile_film_is_explained_as_far_as_it_correlates() -> None:
    """No curve of one reading explains much more than the correlation: R² near r²."""
    source = DATA / "flex_textile_mocap" / "derived" / "rotacionzAll.csv"
    with source.open() as file:
        rows = list(csv.DictReader(file))
    volts = np.array([float(r["A11"]) for r in rows])
    angle = np.array([float(r["angBrazoX"]) for r in rows])
    n = len(rows)
    bend = (angle - angle.min()) / np.ptp(angle)
    counts = np.round(volts / 5.0 * 4095)
    found = fit(Samples(counts, bend, np.arange(n) // 500, np.full(n, np.nan), np.arange(n)))
    assert found.r2 == pytest.approx(np.corrcoef(volts, angle)[0, 1] ** 2, abs=0.05)
