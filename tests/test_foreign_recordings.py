"""Recordings of other boards: other units, clocks that wrap, damaged rows; hysteresis and holds."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from test_calibrate_pushes import loops

import antennate
from antennate.cli import main
from antennate.errors import CalibrationError
from antennate.experiments.calibrate.recording import RecordingParams, read
from antennate.types import Floats

DATA = Path(__file__).parents[2] / "shared" / "data"


def written(path: Path, **columns: Floats) -> str:
    """A recording with these columns, all digits kept."""
    rows = [
        ",".join(f"{value:.17g}" for value in row) for row in zip(*columns.values(), strict=True)
    ]
    path.write_text("\n".join([",".join(columns), *rows, ""]))
    return str(path)


def ramps(pushes: int = 4) -> tuple[Floats, Floats, Floats]:
    """Counts, bends and times of pushes without hysteresis."""
    return loops(pushes, 0.0)


def said(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """What a run that succeeds prints, on one line."""
    assert main(["calibrate", "--no-figures", "--overwrite", *words]) == 0
    return " ".join(capsys.readouterr().out.split())


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line of a run that is refused."""
    assert main(["calibrate", *words]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    return error


def resistances(bend: Floats) -> Floats:
    """A flex sensor of 10 kOhm that gains as much at a full bend [Ohm]."""
    return 10e3 * (1 + bend)


def test_ohms_volts_and_counts_of_one_divider_give_one_curve(tmp_path: Path) -> None:
    """Ohm's law behind 22 kOhm at 3.0 V, and the line of the converter's datasheet up to 2880."""
    _, bend, t = ramps()
    ohm = resistances(bend)
    volts = 3.0 * 22e3 / (ohm + 22e3)
    counts = (volts - 0.142) / (196602 / 65536 / 4096 * 1.1)
    assert counts.max() < 2880
    files = {
        "ohm": written(tmp_path / "ohm.csv", time=t, r_ohm=ohm, bend=bend),
        "kohm": written(tmp_path / "kohm.csv", time=t, r_ohm=ohm / 1e3, bend=bend),
        "V": written(tmp_path / "V.csv", time=t, r_ohm=volts, bend=bend),
        "mV": written(tmp_path / "mV.csv", time=t, r_ohm=1e3 * volts, bend=bend),
        "counts": written(tmp_path / "counts.csv", time=t, r_ohm=counts, bend=bend),
    }
    found = {}
    for unit, file in files.items():
        if unit != "ohm":
            text = Path(file).read_text()
            Path(file).write_text(text.replace("r_ohm", "r", 1))
        sensor = {"divider_resistance": 22e3, "supply": 3.0} if unit in ("ohm", "kohm") else {}
        found[unit] = antennate.run(
            "calibrate",
            recording=file,
            columns={"counts_column": "r_ohm" if unit == "ohm" else "r", "reading_unit": unit},
            antenna={"sensor": sensor},
        ).found.calibration
    for unit in ("ohm", "kohm", "V", "mV"):
        for key in ("midpoint", "slope", "counts_low", "counts_high"):
            wanted = pytest.approx(getattr(found["counts"], key), rel=2e-3)
            assert getattr(found[unit], key) == wanted, unit


def test_the_divider_is_said_with_its_source_unless_it_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, bend, t = ramps()
    file = written(tmp_path / "r.csv", time=t, counts=resistances(bend) / 1e3, bend=bend)
    out = ["--recording", file, "--out", str(tmp_path / "out"), "--columns.reading-unit", "kohm"]
    told = said(capsys, *out)
    assert (
        "fixed resistor to ground (or supply) 10000 Ohm (assumed: what makers pair with it)" in told
    )
    assert "3.3 V (datasheet: ESP32 supply)" in told
    assert "Readings in kohm became counts" in told
    held = json.loads((tmp_path / "out" / "calibration.json").read_text())
    assert 0 < held["counts_low"] < held["counts_high"] < 4095
    told = said(capsys, *out, "--antenna.sensor.divider-resistance", "22000")
    assert "fixed resistor to ground (or supply) 22000 Ohm (given)" in told
    error = refused(capsys, "--recording", file, "--antenna.sensor.divider-resistance", "22000")
    assert "antenna.sensor.divider_resistance: expected the default" in error
    words = ["--columns.reading-unit", "kohm", "--antenna.length", "0.2"]
    assert "antenna.length: expected the default" in refused(capsys, "--recording", file, *words)


def test_readings_in_a_unit_that_was_not_declared_are_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, bend, t = ramps()
    ohm = resistances(bend)
    unit = "--columns.reading-unit"
    for name, values, words, why in (
        ("kohm", ohm / 1e3, (), r"found 10 to 20; are these volts or kilohms\?"),
        ("ohm", ohm, (), r"row 2: expected 0 to 4095 counts, found 10000; .*480 of 480 rows"),
        ("signed", ohm - 15e3, (), r"row 2: expected 0 to 4095 counts, found -5000"),
        ("signed ohm", ohm - 15e3, (unit, "ohm"), "expected a resistance above 0 ohm, found -5000"),
        (
            "mV as V",
            1650 - bend,
            (unit, "V"),
            r"expected voltages of 0\.142 .* from 1649 to 1650 V",
        ),
        ("V as mV", 1.65 - bend / 9, (unit, "mV"), r"from 1\.539 to 1\.65 mV"),
        ("kohm as ohm", ohm / 1e3, (unit, "ohm"), r"from 10 to 20 ohm.*divider-resistance fit"),
    ):
        file = written(tmp_path / f"{name}.csv", time=t, counts=values, bend=bend)
        error = refused(capsys, "--recording", file, *words)
        assert re.search(why, error), error
        assert unit in error
        assert "constant" not in error
    for column in ("left_kohm", "left [Ω]", "left_mV"):
        file = written(tmp_path / "named.csv", time=t, **{column: ohm / 1e3, "bend": bend})
        error = refused(capsys, "--recording", file, "--columns.counts-column", column)
        assert f"row 1: expected {column} in " in error
        assert unit in error


@pytest.mark.skipif(not (DATA / "flex_static_12bit").exists(), reason="no recordings")
def test_real_volts_that_a_sketch_computed_are_the_counts_that_it_read() -> None:
    """SOURCE.md: LSB = 3.3 V / 4095; the same recording has the counts."""
    file = DATA / "flex_static_12bit" / "derived" / "flex_static.csv"
    counts = RecordingParams(counts_column="adc12_if_3v3", bend_column="angle_deg", bend_unit="deg")
    volts = counts.model_copy(update={"counts_column": "volts", "reading_unit": "V"})
    both = [read(file, params, rate=100.0).samples.counts for params in (volts, counts)]
    assert both[0].tolist() == both[1].tolist()


def test_speeds_in_another_unit_are_converted_or_asked_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts, bend, t = ramps()
    back = np.where(np.diff(bend, append=0) < 0, -20.0, 20.0)  # a stage gives the way back a sign
    file = written(tmp_path / "a.csv", time=t, counts=counts, bend=bend, speed=back)
    words = ["--recording", file, "--columns.speed-column", "speed"]
    error = refused(capsys, *words)
    assert "row 2: expected speeds up to 1 m/s in speed, found 20; is m/s the right" in error
    assert "--columns.speed-unit" in error
    out = [*words, "--out", str(tmp_path / "out")]
    assert " 2 cm/s" in said(capsys, *out, "--columns.speed-unit", "mm/s")
    named = written(tmp_path / "b.csv", time=t, counts=counts, bend=bend, speed_mm_s=back / 100)
    error = refused(capsys, "--recording", named, "--columns.speed-column", "speed_mm_s")
    assert "row 1: expected speed_mm_s in m/s unless declared, found mm/s" in error


@pytest.mark.parametrize(
    ("column", "unit", "scale"), [("speed_m_s", "mm/s", 1.0), ("speed_mm_s", "m/s", 0.001)]
)
def test_a_unit_that_is_declared_is_believed_against_the_name_of_its_column(
    column: str, unit: str, scale: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """20 mm/s are 2 cm/s; the default name of the column says m/s, whatever it holds."""
    counts, bend, t = ramps()
    speed = {column: np.full(len(t), 20.0 * scale)}
    words = ["--recording", written(tmp_path / "a.csv", time=t, counts=counts, bend=bend, **speed)]
    words += ["--columns.speed-column", column]
    assert "--columns.speed-unit" in refused(capsys, *words)
    words += ["--columns.speed-unit", unit, "--out", str(tmp_path / "out")]
    out = said(capsys, *words)
    assert " 2 cm/s" in out
    named = column.removeprefix("speed_").replace("_", "/")
    assert f"{column} is taken in {unit} as declared, though its name says {named}." in out


def test_measured_speeds_are_those_of_their_pushes(tmp_path: Path) -> None:
    """A speed of its own for each reading made a row of the table for each."""
    counts, bend, t = ramps()
    trial = np.repeat(np.arange(4.0), 120)
    speed = 0.05 + 0.02 * trial + np.random.default_rng(0).normal(0, 0.001, len(t))
    columns = {"trial": trial, "time": t, "counts": counts, "bend": bend, "speed_m_s": speed}
    found = read(Path(written(tmp_path / "a.csv", **columns)), RecordingParams())
    assert np.unique(found.samples.speed) == pytest.approx([0.05, 0.07, 0.09, 0.11], abs=0.001)


@pytest.mark.parametrize(("bits", "unit", "scale"), [
    (32, "us", 1e6), (30, "us", 1e6), (32, "ms", 1e3), (30, "ms", 1e3), (32, "s", 1.0),
])  # fmt: skip
def test_a_clock_that_wraps_is_unwrapped_and_said(
    bits: int, unit: str, scale: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """micros() of Arduino begins at 0 after 2**32 us, ticks_us() of MicroPython after 2**30."""
    counts, bend, t = ramps()
    ticks = 1e6 if unit == "s" else scale
    wrapped = (np.round(ticks * t) + 2.0**bits - 1.5 * ticks) % 2.0**bits * (scale / ticks)
    assert (np.diff(wrapped) < 0).sum() == 1
    file = written(tmp_path / "a.csv", time=wrapped, counts=counts, bend=bend)
    found = read(Path(file), RecordingParams(time_unit=unit))  # pyright: ignore[reportArgumentType]
    assert found.t - found.t[0] == pytest.approx(t, abs=1e-3)
    out = ["--recording", file, "--columns.time-unit", unit, "--out", str(tmp_path / "out")]
    told = said(capsys, *out)
    assert f"A clock of {bits} bits in {'us' if unit == 's' else unit} wrapped in row 152." in told
    assert "a clock that wraps unwrapped" in told


def test_other_times_that_fall_are_told_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts, bend, t = ramps()
    rng = np.random.default_rng(0)
    for name, times, why, never in (
        ("anew", t % 2.4, "number pushes in a column trial", "sort"),
        ("mixed", rng.permutation(t), "sort the rows of each push", "trial"),
        ("coarse", np.floor(10 * t) / 10, "standing at 0 s; write finer times", "sort"),
    ):
        file = written(tmp_path / f"{name}.csv", time=times, counts=counts, bend=bend)
        error = refused(capsys, "--recording", file)
        assert why in error, name
        assert never not in error.split("expected", 1)[1]


def test_a_line_for_spreadsheets_is_skipped_and_rows_keep_their_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts, bend, t = ramps()
    file = Path(written(tmp_path / "a.csv", time=t, counts=counts, bend=bend))
    plain = file.read_text()
    for line in ("sep=,\n", '"sep=,"\r\n', "SEP=,\r"):
        file.write_text(line + plain)
        found = read(file, RecordingParams())
        assert found.samples.counts.tolist() == counts.tolist()
        assert found.samples.row[0] == 3
    file.write_text("sep=;\n" + plain.replace(",", ";"))
    error = refused(capsys, "--recording", str(file))
    assert "row 2: expected columns separated by commas" in error


def test_damaged_rows_are_left_out_and_counted_up_to_their_share(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Patterns of serial_esp32_glitches: merged and cut lines, boot text, a stray character."""
    counts, bend, t = ramps()
    file = Path(written(tmp_path / "a.csv", time=t, counts=counts, bend=bend))
    lines = file.read_text().splitlines()
    lines[99] += lines[100]
    lines[150] = "rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)"
    lines[200] = lines[200].replace(",", ",x", 1)
    lines[250] = lines[250].split(",")[0]
    lines[300] = "0.01,1500,0.5"
    lines[301] = lines[301].replace(",", ",NA,", 1).rsplit(",", 1)[0]
    file.write_text("\n".join([*lines, ""]))
    out = tmp_path / "out"
    told = said(capsys, "--recording", str(file), "--out", str(out))
    assert "Of 480 rows: 6 damaged left out." in told
    assert "Row 100 is damaged: expected 3 cells, found 5; is it merged with another" in told
    rows = json.loads((out / "result.json").read_text())["recording"]
    assert [row for row, _ in rows["damages"]] == [100, 151, 201, 251, 301, 302]
    assert rows["rows"] == 480
    assert antennate.run("calibrate", recording=str(file)).found.calibration.samples == 474
    error = refused(capsys, "--recording", str(file), "--columns.most-lost", "0.01")
    assert f"{file}: row 100: expected 3 cells, found 5" in error
    assert "(5 of 480 rows are like it)" in error


def test_a_reading_that_lost_digits_is_named_and_does_not_widen_the_range(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As 41 of 416 in a real log, two of four, two in a row, and where the way turns."""
    counts, bend, t = ramps()
    spoiled = counts.copy()
    for row in (60, 150, 151, 300):
        spoiled[row] = float(str(int(counts[row]))[: 2 if row == 300 else 3])
    file = written(tmp_path / "a.csv", time=t, counts=spoiled, bend=bend)
    told = said(capsys, "--recording", file, "--out", str(tmp_path / "out"))
    assert "Of 480 rows: 4 outliers left out." in told
    assert f"Row 62 is an outlier: {spoiled[60]:g} counts where others at its bend are 18" in told
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert [one["row"] for one in result["recording"]["outliers"]] == [62, 152, 153, 302]
    whole = np.delete(counts, [60, 150, 151, 300])
    assert result["calibration"]["valid_counts"] == [whole.min(), whole.max()]


def test_coarse_peaks_and_noise_are_no_outliers(tmp_path: Path) -> None:
    """A turn of few readings and a reading with noise of a tenth of the span stand as they are."""
    rng = np.random.default_rng(1)
    coarse = np.tile([0.0, 0.5, 1.0, 0.5], 20)
    fine = ramps()[1]
    for bend, noise in ((coarse, 2.0), (fine, 40.0), (fine, 100.0)):
        counts = np.round(1500 + 400 * bend + rng.normal(0, noise, len(bend)))
        t = np.arange(len(bend)) / 100
        file = written(tmp_path / "a.csv", time=t, counts=counts, bend=bend)
        handled = read(Path(file), RecordingParams()).handled
        assert handled is not None
        assert handled.outliers == () or handled.outliers_kept


@pytest.mark.skipif(not (DATA / "flex_textile_mocap").exists(), reason="no recordings")
def test_a_real_serial_log_with_times_of_day_is_read(tmp_path: Path) -> None:
    """SOURCE.md: line 290 has `41,,454`, line 293 a single field; the file has no header."""
    raw = (DATA / "flex_textile_mocap" / "raw" / "20181114-134309A.txt").read_text()
    lines = raw.splitlines()[:400]
    names = ",".join(["n", "clock", *(f"a{i}" for i in range(10))])
    file = tmp_path / "a.csv"
    file.write_text("\n".join([names, *lines, ""]))
    params = RecordingParams(
        time_column="clock", counts_column="a6", bend_column="a7", bend_unit="mm"
    )
    found = read(file, params)
    assert found.handled is not None
    assert [row for row, _ in found.handled.damages] == [291, 294]
    assert found.t[0] == pytest.approx(13 * 3600 + 43 * 60 + 9.855689)
    lines[289] = lines[289].replace("41,,", "41,397,")
    file.write_text("\n".join([names, *lines, ""]))
    handled = read(file, params).handled
    assert handled is not None
    assert [(one.row, one.counts) for one in handled.outliers] == [(291, 41.0)]


@pytest.mark.parametrize(("gap", "told"), [
    (0.5, "the rest is hysteresis, 3"), (0.38, "hysteresis, 1"), (0.0, "perhaps marks and"),
])  # fmt: skip
def test_hysteresis_is_named_under_noise_too(
    gap: float, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counts, bend, t = loops(4, gap, {0.5: 15.0, 0.38: 60.0, 0.0: 110.0}[gap])
    file = written(tmp_path / "a.csv", time=t, counts=counts, bend=bend)
    text = said(capsys, "--recording", file, "--out", str(tmp_path / "out"))
    assert told in text
    assert ("slipped" in text) == (gap == 0.0)
    assert "relaxes" not in text


def test_a_refusal_asks_about_hysteresis_where_each_way_alone_would_do(tmp_path: Path) -> None:
    counts, bend, t = loops(4, 1.3, 20.0)
    file = written(tmp_path / "a.csv", time=t, counts=counts, bend=bend)
    with pytest.raises(CalibrationError, match=r"or is it hysteresis\? Loading alone fits"):
        antennate.run("calibrate", recording=file)


@pytest.mark.parametrize("share", [0.06, -0.06])
def test_relaxation_in_holds_comes_back(share: float, tmp_path: Path) -> None:
    """Marks held for 2 s, after which a share of the span has crept: 1 - exp(-t / 0.2 s) of it.

    Over the first and the last fifth of a hold it has moved by share (0.4324 - 0): the mean of
    exp(-t / tau) over 0 to 0.4 s is tau / 0.4 s (1 - exp(-2)).
    """
    marks = [0.0, 0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25]
    t, counts, bend = [], [], []
    held = np.arange(200) / 100
    now, before = 0.0, 0.0
    for mark in [*marks * 3, 0.0]:
        way = np.sign(mark - before)
        off = 0.25 * np.sin(np.pi * mark) * way
        counts.append(1500 + 400 * (mark + off + way * share * (1 - np.exp(-held / 0.2))))
        t.append(now + held)
        bend.append(np.full(200, mark))
        now, before = now + 2.5, mark
    values = [np.concatenate(v) for v in (t, counts, bend)]
    rng = np.random.default_rng(0)
    noisy = np.round(values[1] + rng.normal(0, 2, len(values[1])))
    file = written(tmp_path / "a.csv", time=values[0], counts=noisy, bend=values[2])
    result = antennate.run("calibrate", recording=file)
    found, curve = result.found.assessment.relaxation, result.found.calibration
    span = curve.counts_high - curve.counts_low
    wanted = share * 0.5 * (1 - np.exp(-2)) * 400 / span
    assert found.mean == pytest.approx(wanted, abs=0.003)
    assert found.holds == 25 - 3  # of each push the first one follows no change
    assert result.found.poor
    way = "on" if share > 0 else "back"
    assert f"held for 2 s its readings move {way} by {100 * abs(found.mean):.0f} %" in (
        result.sentence
    )
