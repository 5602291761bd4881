"""What the paper's statements leave of ranges: docs/science/published.py."""

import csv
import importlib.util
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from antennate.cli import main
from antennate.experiments.study.config import StudyConfig

FOLDER = Path(__file__).parents[1] / "docs" / "science"


@pytest.fixture(scope="module")
def published():
    sys.path.insert(0, str(FOLDER))
    try:
        spec = importlib.util.spec_from_file_location("published", FOLDER / "published.py")
        module = sys.modules["published"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(FOLDER))
    return module


def part(*words):
    command = [sys.executable, str(FOLDER / "published.py"), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_likelihoods_of_statements(published):
    chance = np.array([0.6, 0.9])
    # 210 p^6 (1 - p)^4, and p^10
    assert published.Count(6, 10).likelihood(chance, 0.0) == pytest.approx([0.2508, 0.01116], 1e-3)
    assert published.Count(10, 10).likelihood(chance, 0.0)[1] == pytest.approx(0.34868, 1e-4)
    # 20 of 20 at 0.9, and a coin that shows 11 or more heads of 20: 0.41190
    assert published.AtLeast(20, 20).likelihood(chance, 0.0)[1] == pytest.approx(0.12158, 1e-4)
    assert published.AtLeast(11, 20).likelihood(np.array([0.5]), 0.0) == pytest.approx(
        [0.4119], 1e-4
    )
    # at the mean the normal density is 0.39894 over its standard deviation, here 0.25
    mean = published.Mean(0.12, 4)
    assert mean.likelihood(np.log([0.12]), 0.4) == pytest.approx([1.5958], 1e-4)
    # likewise with 0.5, and a normal is below its mean plus one standard deviation in 0.84134
    assert published.Near(1.0, 0.3).likelihood(np.array([1.0]), 0.4) == pytest.approx(
        [0.79788], 1e-4
    )
    below = published.Near(1.0, 0.3, below=True)
    assert below.likelihood(np.array([0.5, -9.0]), 0.4) == pytest.approx([0.84134, 1.0], 1e-4)


def test_a_setting_and_its_shares(published):
    unknowns = published.Unknowns(
        {
            "a.even": {"low": 2.0, "high": 4.0},
            "a.log": {"low": 0.01, "high": 1.0, "log": True},
            "a.whole": {"low": 0, "high": 3, "whole": True},
            "a.choice": [False, True],
            "a.word": ["down", "off", "up"],
            "a.pair": [[0.8, 0.8], [1.4, 0.8], [0.8, 1.0]],
        }
    )
    values = {"a.even": 3.0, "a.log": 0.1, "a.whole": 3, "a.choice": True, "a.word": "off"}
    shares = unknowns.shares(values | {"a.pair": [1.4, 0.8]}, "here")
    assert shares == pytest.approx([0.5, 0.5, 1.0, 1.0, 0.5, 1.0, 0.0])
    draws = published.prior(unknowns, 4000, 3)
    assert np.allclose(draws.x[7], unknowns.shares(draws.setting(7), "here"))
    assert np.allclose(draws.x.mean(axis=0)[:5], 0.5, atol=0.03)
    assert set(map(str, (draws.setting(k)["a.pair"] for k in range(50)))) == {
        "[0.8, 0.8]",
        "[1.4, 0.8]",
        "[0.8, 1.0]",
    }


def test_a_region_holds_nine_tenths(published):
    values = np.linspace(0.0, 1.0, 1001)
    assert published.region(values, np.full(1001, 1 / 1001)) == pytest.approx(
        [0.05, 0.95], abs=0.01
    )
    few = np.repeat([0.0, 0.5, 1.0], [5, 45, 50])
    kept = published.region(few, np.full(100, 0.01))
    assert kept == [0.5, 1.0]
    assert published.holds(kept, 0.5, few=True)
    assert not published.holds(kept, 0.7, few=True)
    assert published.holds([0.05, 0.95], 0.7, few=False)


def test_what_weights_tell(published):
    rng = np.random.default_rng(5)
    x = rng.uniform(size=(20_000, 3))
    weights = np.where((x[:, 0] < 0.5) == (x[:, 1] < 0.5), 1.0, 0.0)
    weights /= weights.sum()
    left = published.left_of(["a", "b", "c"], x, weights)
    assert all(abs(found["narrowed"]) < 0.01 for found in left.values())  # none alone
    pair, *others = published.pairs_of(["a", "b", "c"], x, weights, 3)
    assert pair["names"] == ["a", "b"]
    assert pair["nats"] > 0.4  # ln 2, less what coarse parts blur
    assert all(abs(other["nats"]) < 0.01 for other in others)


def test_what_a_measurement_would_settle(published):
    x = np.random.default_rng(7).uniform(size=(20_000, 3))
    weights = np.full(20_000, 1 / 20_000)
    shares = published.measured(["a", "b", "c"], x, weights, x[:, 0] + 2 * x[:, 1])
    assert shares == pytest.approx({"a": 0.2, "b": 0.8, "c": 0.0}, abs=0.02)  # variances 1 to 4


def test_effects_of_unknowns(published):
    rng = np.random.default_rng(6)
    x = rng.uniform(size=(400, 4))
    y = (rng.uniform(size=400) < 0.2 + 0.6 * x[:, 2]).astype(float)
    effects = published.effects_of(published.Rows(x, {"y": y}, np.arange(400)), list("abcd"))["y"]
    assert effects["c"][0] == pytest.approx(0.6, abs=0.2)
    assert effects["c"][1] > 1.0
    assert max(effects[name][1] for name in "abd") < 1.0


@pytest.mark.ci
@pytest.mark.parametrize("group", ["tunnel", "wall"])
def test_hidden_settings_are_a_study(tmp_path, group):
    run = part("hidden", group, "--count", 3, "--trials", 4)
    assert run.returncode == 0, run.stderr
    study = tomllib.loads(run.stdout)
    assert StudyConfig.model_validate(study).trials == 4
    first = tomllib.loads((FOLDER.parents[1] / f"studies/published_{group}.toml").read_text())
    assert set(study["vary"]) == set(first["vary"]) - {"seed"}
    assert all(len(values) == 3 for values in study["vary"].values())


def test_rows_are_read_as_they_were_kept(published):
    unknowns = published.Unknowns.of(published.study_file("wall"))
    rows = published.read([FOLDER / "published_wall.csv"], published.GROUPS["wall"], unknowns)
    assert rows.x.shape == (len(rows.points), len(unknowns.names))
    assert rows.x.min() > -1e-6
    assert rows.x.max() < 1 + 1e-6
    assert 0.2 < rows.outcomes["stiff jams"].mean() < 0.6


def test_ranges_that_leave_nothing_are_one_line(published, capsys):
    with pytest.raises(SystemExit) as end:
        published.weights_of({"a": np.array([0.0, 1.0]), "b": np.array([1.0, 0.0])})
    assert end.value.code == 2
    assert "expected a setting within the ranges with a likelihood above zero" in (
        capsys.readouterr().err
    )


def test_a_recording_that_was_refused_tells_that_it_was(published, tmp_path):
    """R² of 0.95 to 0.97 is just one curve; the sigmoid errs by e times its rival."""
    group = published.GROUPS["calibration"]
    columns = {f"calibration.speeds.{k}.r2": str(0.95 + 0.01 * k) for k in range(3)}
    columns |= {"calibration.slope": "18.3", "calibration.midpoint": "0.3"}
    errors = {"sigmoid": str(0.1 * np.e), "line": "0.2", "isotonic": "0.1"}
    columns |= {f"calibration.cross_validated_rmse.{n}": e for n, e in errors.items()}
    axes = {"averaging_time": {"low": 0.0, "high": 0.5}}
    table = tmp_path / "trials.csv"
    table.write_text(
        f"point,command,status,averaging_time,{','.join(columns)}\n"
        f"0,calibrate,ok,0.1,{','.join(columns.values())}\n"
        f"1,,failed,0.2{',' * len(columns)}\n"
    )
    rows = published.read([table], group, published.Unknowns(axes))
    found = {name: values.tolist() for name, values in rows.outcomes.items()}
    assert found["calibrated"] == [1.0, 0.0]
    assert found["slope"][0] == pytest.approx(np.log(18.3))
    assert found["one curve"][0] == pytest.approx(0.0, abs=1e-9)
    assert found["sigmoid"][0] == pytest.approx(1.0)
    assert np.isnan(
        [found[name][1] for name in ("slope", "midpoint", "one curve", "sigmoid")]
    ).all()


@pytest.mark.ci
def test_a_search_stays_near_the_likeliest_and_within_the_ranges(tmp_path):
    """One of 40 settings has the paper's numbers, at an end of a range."""
    columns = tomllib.loads(
        (FOLDER.parents[1] / "studies" / "published_calibration.toml").read_text()
    )
    axes = {name: axis for name, axis in columns["vary"].items() if name != "seed"}

    def middle(axis):
        if isinstance(axis, list):
            return " ".join(map(str, axis[0])) if isinstance(axis[0], list) else str(axis[0])
        return str((axis["low"] * axis["high"]) ** 0.5 if axis.get("log") else axis["high"])

    told = [f"calibration.speeds.{k}.r2" for k in range(3)]
    told += [f"calibration.cross_validated_rmse.{n}" for n in ("sigmoid", "line", "isotonic")]
    head = ["point", "command", "status", *axes, "calibration.slope", "calibration.midpoint", *told]
    lines = [",".join(head)]
    for k in range(40):
        values = {name: middle(axis) for name, axis in axes.items()}
        values["rig.place"] = "0.1" if k == 7 else "0.06"
        fitted = ("18.3", "0.305") if k == 7 else ("4.5", "0.5")
        row = [str(k), "calibrate", "ok", *values.values(), *fitted, *["0.97"] * 3, *["0.03"] * 3]
        lines.append(",".join(row))
    table = tmp_path / "trials.csv"
    table.write_text("\n".join(lines) + "\n")
    found = part("next", "calibration", table, "--near", 1, "--count", 30, "--trials", 1)
    assert found.returncode == 0, found.stderr
    vary = tomllib.loads(found.stdout)["vary"]
    assert all(0.085 <= place <= 0.1 for place in vary["rig.place"])
    assert len(set(vary["rig.place"])) > 5
    assert all(
        axes["rig.depth"]["low"] <= d <= axes["rig.depth"]["high"] for d in vary["rig.depth"]
    )


def test_the_page_tells_what_the_rows_of_the_tunnel_say(published):
    page = (FOLDER / "published.md").read_text()
    unknowns = published.Unknowns.of(published.study_file("tunnel"))
    rows = published.read([FOLDER / "published_tunnel.csv"], published.GROUPS["tunnel"], unknowns)
    assert f"{len(np.unique(rows.points))} settings were walked ({len(rows.x):,} pairs" in page
    many = [(a * n, b * n, n) for a, b, n in published.traded(rows) if n >= 12]
    without, with_rule, tunnels = (round(sum(column)) for column in zip(*many, strict=True))
    assert len(many) == 9
    assert tunnels == 36 + 108
    assert with_rule == 36 + 86  # as the page says of the first and of the later tunnels
    assert "crossed 36 of 36, and then crossed 86 of 108" in page
    assert 75 <= without <= 75 + 36
    for a, n, b, m in published.judged().values():
        assert f"{a} of {n} | {b} of {m} |" in page


@pytest.mark.ci
@pytest.mark.parametrize("controller", ["timed", "schedule", "paper"])
def test_a_controller_is_searched_in_the_setting_of_a_file(controller, tmp_path, capsys):
    slow = FOLDER / "published_tunnel_slow.toml"
    run = part("tune", "tunnel", slow, "--controller", controller, "--trials", "1")
    assert run.returncode == 0, run.stderr
    asked = tomllib.loads(run.stdout)["settings"]
    assert asked["controllers"] == [controller]
    assert asked["tunnel"]["turns_deg"] == [75.0]
    pytest.importorskip("optuna")
    file, out = tmp_path / "tune.toml", tmp_path / "run"
    file.write_text(f"{run.stdout}\ntime_limit = 1.0\n")
    words = f"study {file} --points 1 --validated 0 --no-figures --out {out}"
    assert main([*words.split(), "--workers", "1"]) in (0, 2)  # no trial ends within a second
    said = capsys.readouterr()
    assert (out / "trials.csv").exists(), said.err


@pytest.mark.ci
@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["weigh", "wall", "none"], "none: expected the rows of a study, found no such file"),
        (["best", "wall", FOLDER / "published_tunnel.csv"], "expected a column wall.base_angle"),
        (["tune", "tunnel"], "the following arguments are required: files"),
        (["tune", "wall", "x"], "argument group: invalid choice: 'wall'"),
        (["tune", "tunnel", "none.toml"], "none.toml: expected a readable file"),
        (["recover", "wall", "one"], "recover: expected a folder of hidden settings, then"),
        (["hidden", "tunnel", "--count", "0"], "argument --count: expected at least 1, found 0"),
        (["next", "wall", "--power", "-5"], "--power: expected a number above 0, at most 1000"),
        (["next", "wall", "--near", "3", "--only", "x"], "--only: expected some of stiff jams, "),
        (["best", "wall", "--only", "x"], "unrecognized arguments: --only x"),
    ],
)
def test_parts_that_lack_something_say_so(words, line):
    run = part(*words)
    assert run.returncode == 2
    assert line in run.stderr
    assert run.stderr.count("\n") == 1


@pytest.mark.ci
@pytest.mark.parametrize(
    ("column", "cell", "line"),
    [
        ("hinge_max_deg", "nan", "hinge_max_deg: expected a finite number, found 'nan'"),
        ("outcome", "jammed", "outcome: expected one of success, jam, slip, invalid, found 'jam"),
        ("antenna.range", "99", "antenna.range: expected 0.5 to 1.6, found 99"),
        ("antenna.link_mass", "", "antenna.link_mass: expected a finite number, found ''"),
        ("wall.gravity", "sideways", "wall.gravity: expected one of ['down', 'off', 'up']"),
    ],
)
def test_a_cell_that_cannot_be_is_told_with_its_line(column, cell, line, tmp_path):
    with (FOLDER / "published_wall.csv").open(newline="") as file:
        rows = [row for _, row in zip(range(6), csv.DictReader(file), strict=False)]
    rows[2][column] = cell  # of the descending antenna
    rows[0][column] = cell if column != "hinge_max_deg" else rows[0][column]
    rows[1] |= {column: rows[0][column]} if column in list(rows[0])[2:13] else {}
    table = tmp_path / "rows.csv"
    with table.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    run = part("best", "wall", table)
    assert run.returncode == 2
    assert line in run.stderr
    assert ", line " in run.stderr
    assert run.stderr.count("\n") == 1
