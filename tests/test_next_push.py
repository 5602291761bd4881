"""What a calibration is worth on the next push: known hysteresis, coverage, rivals, recordings."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from antennate.antenna import fitting
from antennate.antenna.curves import Samples, with_divider
from antennate.cli import main
from antennate.errors import CalibrationError
from antennate.experiments.calibrate.next_push import Assessment, Pushes, assess
from antennate.experiments.calibrate.recording import RecordingParams, read
from antennate.types import Floats, Ints

DATA = Path(__file__).parents[2] / "shared" / "data"


def samples(counts: Floats, level: Floats, trial: Ints | None = None) -> Samples:
    n = len(counts)
    trial = np.zeros(n, np.int64) if trial is None else trial
    return Samples(counts, level, trial, np.full(n, np.nan), np.arange(2, n + 2))


def assessed(given: Samples) -> Assessment:
    return assess(given, fitting.fit(given, "left", "0" * 64, least_r2=0.1))


def cycles(count: int, points: int = 60) -> Floats:
    """Straight to bent and back, `count` times."""
    up = np.linspace(0.0, 1.0, points)
    return np.tile(np.concatenate([up, up[-2:0:-1]]), count)


def play(level: Floats, width: float) -> Floats:
    """Backlash: what follows a bend with a dead zone of this width."""
    at, found = float(level[0]), []
    for value in level.tolist():
        at = min(max(at, value - width / 2), value + width / 2)
        found.append(at)
    return np.array(found)


def test_pushes_and_ways_are_found_by_turns_in_spite_of_noise() -> None:
    clean = cycles(5)
    noisy = clean + np.random.default_rng(0).normal(0, 0.01, len(clean))
    found = Pushes.of(samples(clean, noisy))
    assert found.count == 5
    true = np.sign(np.gradient(clean))
    assert (found.way == true)[true != 0].mean() > 0.97
    assert (found.number == np.arange(len(clean)) // 118)[true != 0].mean() > 0.97


def test_trials_are_pushes_of_their_own_and_a_held_one_has_no_way() -> None:
    level = np.concatenate([np.linspace(0, 1, 30), np.full(30, 0.5), np.linspace(0, 1, 30)])
    found = Pushes.of(samples(level, level, np.repeat(np.arange(3), 30)))
    assert found.count == 3
    assert [set(found.way[i : i + 30].tolist()) for i in (0, 30, 60)] == [{1}, {0}, {1}]


def test_a_known_hysteresis_comes_back() -> None:
    """Backlash of width w on readings in proportion to the bend: a gap of w of their range."""
    level, rng = cycles(6), np.random.default_rng(1)
    counts = 1500 + 400 * play(level, 0.12) + rng.normal(0, 2, len(level))
    found = assessed(samples(counts, level)).hysteresis
    assert found is not None
    low, high = np.percentile(counts, [0.5, 99.5])
    assert found.largest == pytest.approx(-0.12 * 400 / (high - low), rel=0.05)
    assert found.mean_95 is not None
    assert found.pushes == 6
    none = assessed(samples(1500 + 400 * level + rng.normal(0, 2, len(level)), level)).hysteresis
    assert none is not None
    assert abs(none.largest) < 0.01


def test_pushes_alone_tell_nothing_of_hysteresis() -> None:
    level = np.tile(np.linspace(0, 1, 40), 5)
    found = assessed(samples(1500 + 400 * level, level, np.repeat(np.arange(5), 40)))
    assert found.hysteresis is None
    assert "loading alone" not in found.rivals["line"]


LEVEL = np.linspace(0.02, 0.98, 25)


def unlike_pushes(rng: np.random.Generator, pushes: int) -> tuple[Samples, Floats]:
    """A recording whose pushes differ in gain and offset, and the counts of one more push."""
    count = pushes + 1
    gain, offset = rng.normal(1, 0.05, count), rng.normal(0, 15, count)
    x = 0.5 + np.log(LEVEL / (1 - LEVEL)) / 10
    counts = 1500 + offset[:, None] + gain[:, None] * 400 * x + rng.normal(0, 2, (count, 25))
    number = np.repeat(np.arange(pushes), 25)
    return samples(counts[:pushes].ravel(), np.tile(LEVEL, pushes), number), counts[pushes]


@pytest.mark.parametrize(
    ("pushes", "sets", "least"),
    [
        (3, 12, 20),
        (5, 12, 20),
        pytest.param(3, 100, 182, marks=pytest.mark.slow),
        pytest.param(4, 100, 182, marks=pytest.mark.slow),
    ],
)
def test_the_interval_holds_new_pushes_as_often_as_it_says(
    pushes: int, sets: int, least: int
) -> None:
    """Either end of the next push lies within in 97.5 %: below `least` is beyond four sigma."""
    rng, hits = np.random.default_rng(2), 0
    for _ in range(sets):
        seen, counts = unlike_pushes(rng, pushes)
        fitted = fitting.fit(seen, "left", "0" * 64)
        known = assess(seen, fitted).new_push
        assert known is not None
        assert known.error_95 is not None
        low, high = np.percentile(fitted.level(counts) - LEVEL, [2.5, 97.5])
        hits += int(known.error_95[0] <= low) + int(high <= known.error_95[1])
    assert hits >= least


def test_two_pushes_give_no_interval_of_the_next() -> None:
    """Each is judged by the other: their difference with both signs, whose ends agree by form.

    An interval from these ends, which are as far apart as the pushes are from being alike up and
    down, held 63 % of the readings of a third one.
    """
    seen, _ = unlike_pushes(np.random.default_rng(2), 2)
    known = assessed(seen).new_push
    assert known is not None
    assert known.error_95 is None
    assert known.rmse > 0
    assert known.pushes == 2


@pytest.mark.skipif(not (DATA / "flex_textile_mocap").exists(), reason="no recordings")
@pytest.mark.parametrize("pushes", [3, 5])
def test_of_real_sweeps_that_were_left_out_most_readings_lie_within(pushes: int) -> None:
    """A textile sensor, arms up and down: fitted to some sweeps, asked of all others."""
    given = textile()
    number = Pushes.of(given).number
    sizes = np.bincount(number)
    sweeps = np.flatnonzero(sizes > 20)
    rng, shares = np.random.default_rng(0), list[float]()
    for _ in range(6):
        picked = rng.choice(sweeps, pushes, replace=False)
        rows = np.isin(number, picked)
        part = Samples(
            given.counts[rows], given.level[rows], number[rows], given.speed[rows], given.row[rows]
        )
        try:
            fitted = fitting.fit(part, "left", "0" * 64, least_r2=0.0)
        except CalibrationError:  # few sweeps of this sensor may turn back
            continue
        known = assess(part, fitted).new_push
        assert known is not None
        assert known.error_95 is not None
        low, high = known.error_95
        for other in np.setdiff1d(sweeps, picked):
            error = fitted.level(given.counts[number == other]) - given.level[number == other]
            shares.append(float(((low <= error) & (error <= high)).mean()))
    assert np.mean(shares) > 0.95


@pytest.mark.slow
def test_the_interval_of_the_curve_is_another_thing() -> None:
    """Over 30 pushes it is 31 ** 0.5 times narrower than that of a push: it holds 28 % of them."""
    rng, hits = np.random.default_rng(2), 0
    for _ in range(20):
        seen, counts = unlike_pushes(rng, 30)
        fitted = fitting.fit(seen, "left", "0" * 64)
        low, high = np.percentile(fitted.level(counts) - LEVEL, [2.5, 97.5])
        assert fitted.midpoint_95 is not None
        width = fitted.slope / 4 * (fitted.midpoint_95[1] - fitted.midpoint_95[0]) / 2
        hits += -width <= low and high <= width
    assert hits <= 10


def test_a_rival_is_named_only_where_it_wins_under_every_check() -> None:
    rng, level = np.random.default_rng(3), np.tile(np.linspace(0, 1, 40), 8)
    trial = np.repeat(np.arange(8), 40)
    straight = assessed(samples(1500 + 200 * level + rng.normal(0, 2, 320), level, trial))
    assert "line" in straight.named
    bent = level.clip(0.01, 0.99)
    sigmoid = 1500 + 30 * np.log(bent / (1 - bent)) + rng.normal(0, 2, 320)
    assert assessed(samples(sigmoid, level, trial)).named == ()


def test_a_rival_that_wins_by_the_divider_alone_is_not_named() -> None:
    """A sensor whose conductance rises by a factor of 100: straight behind one resistor only."""
    rng, level = np.random.default_rng(4), np.tile(np.linspace(0, 1, 40), 8)
    share = 0.1 + 0.8 * level  # odds from 1/9 to 9: with another resistor the line is bent
    found = assessed(
        samples(4095 * share + rng.normal(0, 2, 320), level, np.repeat(np.arange(8), 40))
    )
    gains = found.rivals["line"]
    assert gains["as recorded"].wins
    assert gains["twice the divider"].mean < gains["as recorded"].mean / 2
    assert gains["half the divider"].mean < gains["as recorded"].mean / 2


def test_a_rival_that_wins_in_one_direction_alone_is_not_named() -> None:
    """Bent along a line and released along a sigmoid."""
    level, rng = cycles(8), np.random.default_rng(5)
    inner = level.clip(0.01, 0.99)
    bent = 1500 + 400 * level
    released = 1700 + 40 * np.log(inner / (1 - inner))
    counts = np.where(np.gradient(level) >= 0, bent, released) + rng.normal(0, 2, len(level))
    found = assessed(samples(counts, level))
    gains = found.rivals["line"]
    assert gains["loading alone"].wins
    assert not gains["unloading alone"].wins
    assert "line" not in found.named


def test_another_divider_is_what_ohms_law_says() -> None:
    sensor, fixed = np.linspace(8e3, 25e3, 30), 10e3
    level = np.linspace(0, 1, 30)
    found = with_divider(samples(4095 * fixed / (fixed + sensor), level), 2.0)
    assert found.counts == pytest.approx(4095 * 2 * fixed / (2 * fixed + sensor))


def rows(level: Floats, counts: Floats) -> str:
    return "".join(f"{c:.1f},{b:.4f}\n" for c, b in zip(counts, level, strict=True))


def test_one_push_says_that_nothing_is_known_about_the_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    level = np.linspace(0, 1, 60)
    file = tmp_path / "one.csv"
    file.write_text("counts,bend\n" + rows(level, 1500 + 300 * level))
    words = ["--rate", "100", "--no-figures", "--out", str(tmp_path / "out")]
    assert main(["calibrate", "--recording", str(file), *words]) == 0
    said = capsys.readouterr().out
    assert "One push only: nothing is known about the next one" in said
    assert "nothing is known about the next push" in said.splitlines()[0]
    assert "better than the sigmoid" not in said


HEADERS = {
    "mark": "\ufefftime,counts,bend",
    "case": "Time,Counts,BEND",
    "units": "time [s],counts (ADC),bend [1]",
    "quotes": '"time", \'counts\' ,"bend"',
    "index": ",time,counts,bend",
}


@pytest.mark.parametrize("name", HEADERS)
def test_headers_of_other_programs_are_taken(name: str, tmp_path: Path) -> None:
    first = "0," if name == "index" else ""
    text = "".join(f"{first}{0.01 * i:.2f},{1800 - 4 * i},{i / 100}\n" for i in range(100))
    file = tmp_path / "theirs.csv"
    file.write_text(f"{HEADERS[name]}\n{text}", encoding="utf-8")
    found = read(file, RecordingParams())
    assert found.t[50] == pytest.approx(0.5)
    assert found.samples.counts[50] == 1600
    assert found.samples.level[50] == pytest.approx(0.5)


def test_readings_at_a_rate_need_no_time(tmp_path: Path) -> None:
    file = tmp_path / "theirs.csv"
    file.write_text(
        "trial,counts,bend\n" + "".join(f"{i // 30},{1500 + i},0.5\n" for i in range(90))
    )
    found = read(file, RecordingParams(), rate=50.0)
    assert found.t[[0, 29, 30, 61]] == pytest.approx([0.0, 0.58, 0.0, 0.02])


@pytest.mark.parametrize(
    ("header", "words", "why"),
    [
        ("time [ms],counts,bend", [], "expected time [ms] in s unless declared, found ms; declare"),
        ("time,counts,bend (deg)", [], "expected bend (deg) in 1 unless declared, found deg"),
        ("time,counts,bend", ["--rate", "100"], "expected no column time beside --rate"),
        ("stamp,counts,bend", [], "column time, found stamp, counts, bend; name yours"),
        ("stamp,counts,bend", ["--rate", "0"], "--rate"),
        ("Time,TIME,bend", [], "expected a column time, found Time, TIME, bend"),
    ],
)
def test_bad_headers_and_rates_are_one_line(
    header: str, words: list[str], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "theirs.csv"
    file.write_text(f"{header}\n" + "".join(f"{i},{1500 + i},{i / 99}\n" for i in range(100)))
    words = ["--recording", str(file), *words, "--out", str(tmp_path / "out")]
    assert main(["calibrate", *words]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert why in said
    assert not (tmp_path / "out").exists()


def test_the_rig_that_withdraws_shows_the_hysteresis_of_its_sensor(tmp_path: Path) -> None:
    """A sensor that remembers gives a wider loop than one that does not."""
    from antennate.experiments.calibrate.run import CalibrateConfig, run

    sizes = []
    for share in (0.0, 0.1):
        rig = {"pushes": 2, "speeds": [0.05], "withdraw": True}
        sensor = {"hysteresis": share, "creep": (0.0, 0.0)}
        values = {"rig": rig, "antenna": {"sensor": sensor}}
        found = run(CalibrateConfig.model_validate(values)).assessment.hysteresis
        assert found is not None
        sizes.append(abs(found.mean))
    assert sizes[1] > sizes[0] + 0.03


def column(rows: list[dict[str, str]], name: str) -> Floats:
    return np.array([float(row[name]) for row in rows])


def textile() -> Samples:
    """A textile flex sensor on a shoulder against optical tracking, tests of their own numbered."""
    source = DATA / "flex_textile_mocap" / "derived" / "rotacionzAll.csv"
    with source.open() as file:
        table = list(csv.DictReader(file))
    angle, t = column(table, "angBrazoX"), column(table, "realTime")
    trial = np.cumsum(np.diff(t, prepend=t[0]) > 0.5).astype(np.int64)
    level = (angle - angle.min()) / np.ptp(angle)
    return samples(np.round(column(table, "A11") / 5 * 4095), level, trial)


@pytest.mark.skipif(not (DATA / "flex_textile_mocap").exists(), reason="no recordings")
def test_a_real_textile_sensor_errs_far_more_than_its_curve_and_has_hysteresis() -> None:
    """SOURCE.md: several tests in one table, with gaps; arms go up and down."""
    given = textile()
    found = assessed(given)
    assert found.pushes > 20
    assert found.new_push is not None
    residual = np.sqrt(1 - np.corrcoef(given.counts, given.level)[0, 1] ** 2) * given.level.std()
    assert found.new_push.rmse == pytest.approx(residual, rel=0.1)  # no curve of one reading helps
    assert found.new_push.error_95 is not None
    assert found.new_push.error_95[1] > residual
    assert found.hysteresis is not None
    assert found.named == ()


@pytest.mark.skipif(not (DATA / "whisker_straingauge_bend").exists(), reason="no recordings")
def test_a_real_strain_gauge_repeats_and_goes_up_only() -> None:
    """SOURCE.md: repeats differ by 0.2 to 1.6 % of the span; a line serves it under any check."""
    source = DATA / "whisker_straingauge_bend" / "derived" / "inc50_plateaus.csv"
    with source.open() as file:
        table = [row for row in csv.DictReader(file) if row["rep"] != "3"]
    bend, repeat = column(table, "tip_lever_mm_inferred"), column(table, "rep").astype(np.int64)
    found = assessed(samples(400 * column(table, "ch1_mV"), bend / bend.max(), repeat))
    assert found.pushes == 3
    assert found.hysteresis is None
    assert set(found.named) == {"line", "isotonic"}
    assert found.new_push is not None
    assert found.new_push.worst_rmse - found.new_push.rmse < 0.016


@pytest.mark.skipif(not (DATA / "flex_static_12bit").exists(), reason="no recordings")
def test_real_static_holds_in_one_row_tell_nothing_about_the_next_push() -> None:
    source = DATA / "flex_static_12bit" / "derived" / "flex_static.csv"
    with source.open() as file:
        table = list(csv.DictReader(file))
    angle = column(table, "angle_deg")
    found = assessed(samples(column(table, "adc12_if_3v3"), angle / 90))
    assert (found.pushes, found.new_push, found.hysteresis, found.named) == (1, None, None, ())


@pytest.mark.skipif(not (DATA / "flex_bend_dynamixel_bags").exists(), reason="no recordings")
def test_a_real_sensor_that_does_not_follow_its_gripper_is_refused() -> None:
    """Closing on nothing the sensor moves by 10 deg only, at times back: correlation below 0.65."""
    folder = DATA / "flex_bend_dynamixel_bags" / "derived"
    counts, bend, trial = [], [], []
    for number, path in enumerate(sorted(folder.glob("itemless*_flex.csv"))):
        with path.open() as file, path.with_name(path.name.replace("flex", "dxl")).open() as other:
            flex, servo = list(csv.DictReader(file)), list(csv.DictReader(other))
        t = column(flex, "t")
        counts.append(2000 + 20 * (column(flex, "x") + 60))
        bend.append(np.interp(t, column(servo, "t"), column(servo, "pos")))
        trial.append(np.full(len(t), number))
    way = np.concatenate(bend)
    given = samples(np.concatenate(counts), (way - way.min()) / np.ptp(way), np.concatenate(trial))
    with pytest.raises(CalibrationError, match=r"row \d+: expected readings that go one way"):
        assessed(given)
