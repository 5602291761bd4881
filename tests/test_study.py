"""Studies: plans, resuming, statuses, shards, and the same table whatever happens."""

from __future__ import annotations

import csv
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from antennate import experiments
from antennate.cli import main
from antennate.errors import BadInputError, ConfigError, OutputError, WorkerError
from antennate.studies.identity import identity
from antennate.studies.plan import Range, elementary_effects, make_points, trajectories
from antennate.studies.pool import Workers, gather
from antennate.studies.store import STORE, Store, line, read_store

HERE = Path(__file__).parent
TRIAL = f"{HERE / 'study_trials.py'}:trial"


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def plan(name: str = "plan.toml", **more: Any) -> str:
    """A small study of a function, as a file."""
    settings = {"mode": "", **more}
    lines = [f"{key} = {json.dumps(value)}" for key, value in settings.items()]
    Path(name).write_text(
        f'experiment = "{TRIAL}"\ntrials = 3\n[settings]\n' + "\n".join(lines) + "\n"
        '[vary]\nx = [0.5, 1.5]\n"deep.y" = [[1, 2], [3]]\n'
    )
    return name


def study(*words: str, out: str = "run", file: str = "plan.toml") -> int:
    return main(["study", file, "--trust-code", "--out", out, "--workers", "1", *words])


def table(run: str = "run") -> list[dict[str, str]]:
    return list(csv.DictReader(Path(run, "trials.csv").read_text().splitlines()))


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(list(words)) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert "Traceback" not in "".join(said)
    return said[-1]


def test_a_grid_is_every_combination_and_a_list_goes_in_step() -> None:
    axes = {"a": [1, 2], "b": ["x", "y", "z"]}
    assert len(make_points("grid", axes, 1, 0)) == 6
    assert make_points("grid", axes, 1, 0)[1] == {"a": 1, "b": "y"}
    assert make_points("list", {"a": [1, 2], "b": [3, 4]}, 1, 0) == [
        {"a": 1, "b": 3},
        {"a": 2, "b": 4},
    ]
    with pytest.raises(ConfigError, match="lists of one length, found lengths 2, 3"):
        make_points("list", axes, 1, 0)
    with pytest.raises(ConfigError, match="found a range"):
        make_points("grid", {"a": Range(low=0, high=1)}, 1, 0)
    for empty in ({}, {"a": []}):
        with pytest.raises(ConfigError, match="the grid is empty"):
            make_points("grid", empty, 1, 0)


def test_drawn_points_fill_their_ranges() -> None:
    axes = {
        "a": Range(low=2.0, high=4.0),
        "b": Range(low=1, high=100, log=True),
        "c": Range(low=1, high=3, whole=True),
    }
    for kind in ("random", "sobol"):
        points = make_points(kind, axes, 64, 3)
        assert points == make_points(kind, axes, 64, 3)
        a, b, c = (np.array([point[name] for point in points]) for name in "abc")
        assert 2.0 <= a.min() < 2.2
        assert 3.8 < a.max() <= 4.0
        assert 0.35 < np.mean(b < 10) < 0.65  # half of the decades
        assert set(c.tolist()) == {1, 2, 3}
    halves = np.array([p["a"] for p in make_points("sobol", {"a": axes["a"]}, 64, 3)]) < 3.0
    assert halves.sum() == 32  # what Sobol's points are made for


def test_morris_finds_the_slopes_of_a_plane_and_moves_one_parameter_at_a_time() -> None:
    shares = trajectories(4, 5, np.random.default_rng(1)).reshape(5, 5, 4)
    moved = np.abs(np.diff(shares, axis=1)) > 1e-9
    assert (moved.sum(axis=2) == 1).all()
    assert (moved.sum(axis=1) == 1).all()
    assert set(np.round(shares.ravel() * 3).tolist()) == {0, 1, 2, 3}
    slopes = np.array([3.0, 0.0, -2.0, 0.5])
    response = (shares @ slopes).ravel().tolist()
    effects = elementary_effects(4, 5, 1, response)
    assert np.allclose(np.mean(effects, axis=1), slopes)


def test_every_assumed_number_of_the_tunnel_can_vary() -> None:
    from antennate.experiments.study.config import assumed_fields, assumed_ranges

    model = experiments.load("tunnel").config
    ranges = dict(assumed_ranges(model, 0.2))
    assert "control.rule.threshold" in ranges
    assert (mass := ranges["tunnel.cylinder.mass"]).low == pytest.approx(0.08)
    assert mass.high == pytest.approx(0.12)
    assert "tunnel.free_width" not in ranges  # it is the paper's
    assert "robot.baud" not in ranges  # it is not read
    told = {name for name, *_ in assumed_fields(model())}
    assert set(ranges) < told


def test_a_study_is_a_table_with_a_status_for_each_trial(
    capsys: pytest.CaptureFixture[str],
) -> None:
    plan(mode="nan")
    assert study() == 0
    out = capsys.readouterr().out
    rows = table()
    assert len(rows) == 12
    assert [row["deep.y"] for row in rows[::3]] == ["1 2", "3", "1 2", "3"]
    assert [row["status"] for row in rows[:3]] == ["ok", "nan", "ok"]
    assert rows[1]["reason"] == "not finite: value"
    assert float(rows[2]["value"]) == pytest.approx(0.6)
    result = json.loads(Path("run/result.json").read_text())
    assert result["statuses"] == {"nan": 4, "ok": 8}
    assert [cell["successes"] for cell in result["points"]] == [1, 1, 1, 1]
    assert "Trials that say nothing: 4 nan" in " ".join(out.split())


@pytest.mark.parametrize(
    ("mode", "status", "reason"),
    [("raise", "failed", "ValueError: seed one"), ("die", "crashed", "ended with code 7")],
)
def test_a_trial_that_fails_is_a_row_and_can_be_run_again(
    mode: str, status: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    plan(mode=mode)
    assert study() == 0
    bad = [row for row in table() if row["status"] != "ok"]
    assert {row["status"] for row in bad} == {status}
    assert len(bad) == 4
    assert reason in bad[0]["reason"]
    before = Path("run/trials.csv").read_bytes()
    assert study() == 0  # nothing is left to do
    assert Path("run/trials.csv").read_bytes() == before


def test_a_trial_that_never_ends_is_given_up() -> None:
    plan(mode="hang")
    text = (
        Path("plan.toml").read_text().replace("[0.5, 1.5]", "[0.5]").replace("[[1, 2], [3]]", "[1]")
    )
    Path("plan.toml").write_text(text)
    assert study("--trial-timeout", "4") == 0
    assert [row["status"] for row in table()] == ["ok", "hung", "ok"]


def test_changes_are_refused_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    plan()
    assert study("--no-figures") == 0
    before = Path("run/trials.csv").read_bytes()
    plan(mode="nan")
    words = ("study", "plan.toml", "--trust-code", "--out", "run")
    assert 'settings.mode "", now "nan"' in refusal(capsys, *words)
    own = Path("own.py")
    own.write_text("def trial(config, seed):\n    return {'a': config['x']}\n")
    Path("own.toml").write_text('experiment = "own.py:trial"\n[vary]\nx = [1, 2]\n')
    assert study("--no-figures", file="own.toml", out="own") == 0
    own.write_text("def trial(config, seed):\n    return {'a': 2 * config['x']}\n")
    words = ("study", "own.toml", "--trust-code", "--out", "own")
    assert "the file own.py changed" in refusal(capsys, *words)
    assert Path("run/trials.csv").read_bytes() == before


def test_bad_studies_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    def said(text: str, *words: str) -> str:
        Path("bad.toml").write_text(text)
        return refusal(capsys, "study", "bad.toml", *words)

    grid = '[vary]\n"tunnel.free_widht" = [0.4]\n'
    assert "did you mean free_width?" in said(grid)
    assert "the grid is empty" in said("")
    assert "the grid is empty" in said('[vary]\n"tunnel.strewn" = []\n')
    assert "expected an experiment (" in said('experiment = "tunel"\n[vary]\nx = [1]\n')
    assert "a number above 0" in said('[vary]\n"tunnel.free_width" = [-1.0]\n')
    code = '[settings]\ncontrollers = ["own.py:Mine"]\n[vary]\n"tunnel.strewn" = [1]\n'
    assert "add --trust-code" in said(code)
    assert "add --experiment own.py:f" in said('experiment = "own.py:f"\n[vary]\nx = [1]\n')
    good = '[vary]\n"tunnel.strewn" = [1]\n'
    assert "--shard: expected I/N" in said(good, "--shard", "3/2")
    assert "engine: expected one of local" in said(good, "--engine", "rya")
    assert not Path("runs").exists()


def test_shards_together_are_the_same_bytes(capsys: pytest.CaptureFixture[str]) -> None:
    plan(mode="nan")
    assert study() == 0
    for number in "12":
        assert study("--shard", f"{number}/2", out=f"part{number}") == 0
        assert json.loads(Path(f"part{number}/shard.json").read_text())["trials"] == 6
    assert "a shard is missing" in refusal(capsys, "merge", "--shards", "part1", "--out", "all")
    assert not Path("all").exists()
    assert main(["merge", "--shards", "part1", "part2", "--out", "all"]) == 0
    for name in ("trials.csv", "result.json", "config.toml", "figures/map.svg"):
        assert Path("all", name).read_bytes() == Path("run", name).read_bytes()
    plan("other.toml", mode="raise")
    assert study("--shard", "2/2", out="other", file="other.toml") == 0
    line = refusal(capsys, "merge", "--shards", "part1", "other", "--out", "none")
    assert 'other: expected a shard of the same run as part1, found settings.mode "nan"' in line
    assert "found no shard.json" in refusal(capsys, "merge", "--shards", "run", "--out", "none")


def test_a_second_driver_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan()
    code = (
        "import sys, time; from pathlib import Path; from antennate.studies.store import Store;"
        "Store(Path(sys.argv[1])); print('ready', flush=True); time.sleep(60)"
    )
    Path("run").mkdir()
    words = [sys.executable, "-c", code, f"run/{STORE}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "ready\n"
        for more in ([], ["--overwrite"]):
            words = ["study", "plan.toml", "--trust-code", "--out", "run", *more]
            assert "found another process at it" in refusal(capsys, *words)
        other.kill()
    assert study("--no-figures") == 0  # the lock went with its process


def test_damaged_and_torn_lines_are_run_again(tmp_path: Path) -> None:
    plan()
    assert study("--no-figures") == 0
    before = Path("run/trials.csv").read_bytes()
    path = Path("run", STORE)
    lines = path.read_bytes().splitlines(keepends=True)
    assert len(lines) == 13
    flipped = lines[3].replace(b"value", b"velue")
    path.write_bytes(b"".join([*lines[:3], flipped, b"junk\n", b"\n", *lines[4:9], lines[9][:40]]))
    notes = tmp_path / "notes.txt"
    os.environ["STUDY_NOTES"] = str(notes)
    try:
        assert study("--no-figures") == 0
    finally:
        del os.environ["STUDY_NOTES"]
    assert Path("run/trials.csv").read_bytes() == before
    assert len(notes.read_text().splitlines()) == 5  # one was flipped, one torn, three are missing


def test_a_line_cut_anywhere_is_noticed(tmp_path: Path) -> None:
    store = Store(tmp_path / "s")
    store.begin({"command": "x"})
    store.append("0.0", {"result": [1, math.nan]})
    store.close()
    data = (tmp_path / "s").read_bytes()
    head = len(line({"identity": {"command": "x"}}))
    for end in range(len(data)):
        (tmp_path / "s").write_bytes(data[:end])
        again = Store(tmp_path / "s")
        assert again.records == {} or end == len(data) - 1
        assert (again.identity is None) == (end < head - 1)
        again.begin({"command": "x"})
        again.append("0.1", {"result": 2})
        again.close()
        whole = Store(tmp_path / "s")
        assert whole.records["0.1"]["result"] == 2
        whole.close()


def test_a_full_disk_is_one_line_and_loses_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plan()
    assert study("--no-figures", out="whole") == 0
    write, full = os.write, False

    def partly(handle: int, data: bytes) -> int:
        nonlocal full
        if full:
            raise OSError(28, "No space left on device")
        full = b'"key":"0.5"' in data
        return write(handle, data[:20] if full else data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", partly)
        words = ["study", "plan.toml", "--trust-code", "--out", "run", "--workers", "1"]
        assert "No space left on device; what was finished is kept" in refusal(capsys, *words)
    assert len(Path("run", STORE).read_bytes().splitlines()) == 6  # five trials and the first line
    assert study("--no-figures") == 0
    assert Path("run/trials.csv").read_bytes() == Path("whole/trials.csv").read_bytes()


def squares(number: int) -> int:
    return number * number


def test_ten_thousand_finished_trials_are_known_at_once(tmp_path: Path) -> None:
    """The bound of two seconds is for the whole command; here for the part that grows."""
    import time

    store = Store(tmp_path / STORE)
    store.begin({"command": "x"})
    row = {"point": 1, "value": 0.25, "outcome": "success", **{f"column_{i}": i for i in range(12)}}
    for place in range(10_000):
        store.append(f"0.{place}", {"result": [place, [row]]})
    store.close()
    best = math.inf
    for _ in range(3):
        begin = time.perf_counter()
        again = Store(tmp_path / STORE)
        tasks = [(i,) for i in range(10_000)]
        found = gather(squares, tasks, Workers(1, store=again, closed=True), lambda *_: None)
        best = min(best, time.perf_counter() - begin)
        again.close()
    assert len(found) == 10_000
    assert found[7] == [7, [row]]
    assert best < 2.0


def test_the_identity_follows_what_decides_the_numbers() -> None:
    wall = experiments.load("wall").config
    same = identity("wall", wall(trials=3))
    assert same == identity("wall", wall(trials=3))
    assert same != identity("wall", wall(trials=4))
    assert "antennate/sim/world.py" in same["code"]
    assert not any(name.startswith("antennate/cli") for name in same["code"])


def test_what_is_missing_is_an_error_of_ours(tmp_path: Path) -> None:
    store = Store(tmp_path / "s")
    with pytest.raises(OutputError, match="another process"):
        Store(tmp_path / "s")
    with pytest.raises(WorkerError, match="expected 1 finished trials, found 0"):
        gather(squares, [(1,)], Workers(1, store=store, closed=True), lambda *_: None)
    store.close()
    with pytest.raises(BadInputError, match="expected a readable file"):
        read_store(tmp_path / "no")


def test_killed_studies_end_with_the_same_table(tmp_path: Path) -> None:
    """A few kills; by hand `tests/study_killed.py FOLDER 200 SEED` kills 200 times."""
    source = Path(experiments.__file__).parents[2]
    known = {**os.environ, "PYTHONPATH": f"{source}{os.pathsep}{HERE}"}
    words = [sys.executable, str(HERE / "study_killed.py"), str(tmp_path), "2", "1"]
    done = subprocess.run(words, capture_output=True, text=True, env=known, check=True)
    found = json.loads(done.stdout)
    kills = found["drivers"] + found["workers"]
    assert kills == 2
    assert found["tables that differ"] == found["lost"] == found["twice"] == 0
    assert 0 <= found["again"] <= 2 * kills
