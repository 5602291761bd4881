"""Studies: plans, resuming, statuses, shards, and the same table whatever happens."""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import os
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from importlib.metadata import PathDistribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import study_killed

import antennate
from antennate import experiments
from antennate.cli import main
from antennate.errors import BadInputError, OutputError, WorkerError
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import Slope
from antennate.experiments.study.result import StudyResult, summarise
from antennate.studies.engines import NoMore
from antennate.studies.experiment import Done
from antennate.studies.identity import identity
from antennate.studies.plan import Range
from antennate.studies.pool import Workers, gather
from antennate.studies.trial_file import TRIALS, TrialFile, line, read_trials

HERE = Path(__file__).parent
TRIAL = f"{HERE / 'study_trials.py'}:trial"


pytestmark = [pytest.mark.ci, pytest.mark.usefixtures("there")]


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


def kept(folder: Path, *words: str, **settings: Any) -> str:
    """A study of `plan` in a folder of its own, in the run `run`; what it said."""
    said = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(said):
        plan(**settings)
        assert study(*words) == 0
    return said.getvalue()


@pytest.fixture(scope="module")
def _plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plain")
    kept(folder, "--no-figures")
    return folder


@pytest.fixture
def done(_plain: Path, tmp_path: Path) -> Path:
    """A study that has ended, in the run `run` of this folder; its table, kept elsewhere."""
    shutil.copytree(_plain, tmp_path, dirs_exist_ok=True)
    return _plain / "run" / "trials.csv"


@pytest.fixture(scope="module")
def of_nan(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A run whose seed one gives nan, and what it said."""
    folder = tmp_path_factory.mktemp("nan")
    said = kept(folder, mode="nan")
    return folder / "run", said


def table(run: str | Path = "run") -> list[dict[str, str]]:
    return list(csv.DictReader(Path(run, "trials.csv").read_text().splitlines()))


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(list(words)) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert "Traceback" not in "".join(said)
    return said[-1]


def test_W6_a_study_is_a_table_with_a_status_for_each_trial(of_nan: tuple[Path, str]) -> None:
    run, out = of_nan
    rows = table(run)
    assert len(rows) == 12
    assert [row["deep.y"] for row in rows[::3]] == ["1 2", "3", "1 2", "3"]
    assert [row["status"] for row in rows[:3]] == ["ok", "nan", "ok"]
    assert rows[1]["reason"] == "not finite: value"
    assert float(rows[2]["value"]) == pytest.approx(0.6)
    result = json.loads((run / "result.json").read_text())
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
    text = Path(plan(mode=mode)).read_text()
    Path("plan.toml").write_text(
        text.replace("[0.5, 1.5]", "[0.5]").replace("[[1, 2], [3]]", "[1]")
    )
    assert study("--no-figures") == 0
    assert [row["status"] for row in table()] == ["ok", status, "ok"]
    assert reason in table()[1]["reason"]
    before = Path("run/trials.csv").read_bytes()
    assert study("--no-figures") == 0  # nothing is left to do
    assert Path("run/trials.csv").read_bytes() == before


def test_odd_letters_and_long_text_are_kept_and_read_again() -> None:
    mode = "\N{SNAIL} talks\x7f"
    file = Path(plan())
    text = file.read_text().replace('mode = ""', 'mode = "\\U0001F40C talks\\u007f"')
    file.write_text(text.replace("[0.5, 1.5]", "[0.5]"))
    assert study("--no-figures") == 0
    kept_text = Path("run/config.toml").read_text(encoding="utf-8")
    assert tomllib.loads(kept_text)["settings"]["mode"] == mode
    assert [len(row["said"]) for row in antennate.RunDirectory.open("run").rows()] == [150_000] * 6


def test_W3_changes_are_refused_and_named(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_shards_together_are_the_same_bytes(
    of_nan: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    run, _ = of_nan
    plan(mode="nan")
    for number in "12":
        assert study("--shard", f"{number}/2", out=f"part{number}") == 0
        assert json.loads(Path(f"part{number}/shard.json").read_text())["trials"] == 6
    assert "a shard is missing" in refusal(capsys, "study", "merge", "part1", "--out", "all")
    assert not Path("all").exists()
    assert main(["study", "merge", "part1", "part2", "--out", "all"]) == 0
    for name in ("trials.csv", "result.json", "config.toml", "figures/map.svg"):
        assert Path("all", name).read_bytes() == (run / name).read_bytes()
    plan("other.toml", mode="raise")
    assert study("--shard", "2/2", out="other", file="other.toml") == 0
    line = refusal(capsys, "study", "merge", "part1", "other", "--out", "none")
    assert 'other: expected a shard of the same run as part1, found settings.mode "nan"' in line
    assert "found no shard.json" in refusal(capsys, "study", "merge", str(run), "--out", "none")
    for name in ("shard.json", "versions.json"):
        whole = Path("part2", name).read_bytes()
        for length in (0, 1, len(whole) // 2, len(whole.rstrip()) - 1):
            Path("part2", name).write_bytes(whole[:length])
            line = refusal(capsys, "study", "merge", "part1", "part2", "--out", "none")
            assert f"part2/{name}: expected a whole file of this kind, found: " in line
        Path("part2", name).write_bytes(whole)
    assert not Path("none").exists()


def test_W2_a_second_driver_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan()
    code = (
        "import time; from antennate.studies.run_directory import RunDirectory;"
        "run = RunDirectory.create('study', 'run'); print('ready', flush=True); time.sleep(60)"
    )
    words = [sys.executable, "-c", code]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "ready\n"
        for more in ([], ["--overwrite"]):
            words = ["study", "plan.toml", "--trust-code", "--out", "run", *more]
            assert "found another process at it" in refusal(capsys, *words)
        other.kill()
    assert study("--no-figures") == 0  # the lock went with its process


def test_a_finished_study_that_is_repeated_leaves_its_files_alone(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is missing is written again, and then the report, which tells of all."""
    del done

    def said() -> str:
        return capsys.readouterr().err.splitlines()[-1]

    assert study() == 0  # with figures
    assert said() == "written to run"

    def written() -> dict[Path, int]:
        return {path: path.stat().st_mtime_ns for path in Path("run").rglob("*") if path.is_file()}

    before, content = written(), Path("run/trials.csv").read_bytes()
    assert study() == 0
    assert said() == "complete already; nothing was run: run"
    assert written() == before
    Path("run/trials.csv").unlink()
    assert study() == 0
    assert said() == "written to run"
    assert Path("run/trials.csv").read_bytes() == content
    after = written()
    assert {path.name for path in after if after[path] != before[path]} == {
        *("trials.csv", "report.html"),
    }
    assert study("--retry") == 0
    assert written()[Path("run/result.json")] != before[Path("run/result.json")]


def test_W7_damaged_and_torn_lines_are_run_again(done: Path, tmp_path: Path) -> None:
    before = Path("run/trials.csv").read_bytes()
    path = Path("run", TRIALS)
    lines = path.read_bytes().splitlines(keepends=True)
    assert len(lines) == 14  # what is run, the processor, twelve trials
    flipped = lines[4].replace(b"value", b"velue")
    path.write_bytes(
        b"".join([*lines[:4], flipped, b"junk\n", b"\n", *lines[5:10], lines[10][:40]])
    )
    notes = tmp_path / "notes.txt"
    os.environ["STUDY_NOTES"] = str(notes)
    try:
        assert study("--no-figures") == 0
    finally:
        del os.environ["STUDY_NOTES"]
    assert Path("run/trials.csv").read_bytes() == before
    assert len(notes.read_text().splitlines()) == 5  # one was flipped, one torn, three are missing


def on_another_processor(run: str) -> None:
    """Let the trials of a run look as if they ran elsewhere."""
    path = Path(run, TRIALS)
    here = processor_of(run)
    kept = [each for each in path.read_bytes().splitlines(keepends=True) if b'"key"' in each]
    first = {"identity": read_trials(path).identity}
    path.write_bytes(b"".join([line(first), line({"processor": f"Not {here}"}), *kept]))


def processor_of(run: str) -> str:
    return json.loads(Path(run, "versions.json").read_text())["processor"]


def test_other_processors_are_recorded_and_the_table_stays(done: Path) -> None:
    here = processor_of("run")
    assert here in Path("run/report.html").read_text()
    on_another_processor("run")
    path = Path("run", TRIALS)
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1]))
    Path("run/result.json").unlink()  # as if it had been killed before its last trial
    assert study("--no-figures") == 0
    assert processor_of("run") == f"Not {here} and {here}"
    assert f"Not {here} and {here}" in Path("run/report.html").read_text()
    assert Path("run/trials.csv").read_bytes() == done.read_bytes()


def test_other_processors_of_shards_are_recorded() -> None:
    plan()
    for number in "12":
        assert study("--shard", f"{number}/2", out=f"part{number}") == 0
    here = processor_of("part1")
    on_another_processor("part2")
    assert main(["study", "merge", "part1", "part2", "--out", "all", "--no-figures"]) == 0
    assert processor_of("all") == f"{here} and Not {here}"


def test_W7_a_line_cut_anywhere_is_noticed(tmp_path: Path) -> None:
    store = TrialFile(tmp_path / "s")
    store.begin({"command": "x"})
    store.append("0.0", {"result": [1, math.nan]})
    store.close()
    data = (tmp_path / "s").read_bytes()
    head = len(line({"identity": {"command": "x"}}))
    for end in range(len(data)):
        (tmp_path / "s").write_bytes(data[:end])
        again = TrialFile(tmp_path / "s")
        assert again.records == {} or end == len(data) - 1
        assert (again.identity is None) == (end < head - 1)
        again.begin({"command": "x"})
        again.append("0.1", {"result": 2})
        again.close()
        whole = TrialFile(tmp_path / "s")
        assert whole.records["0.1"]["result"] == 2
        whole.close()


def test_W8_a_full_disk_is_one_line_and_loses_nothing(
    done: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.rmtree("run")
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
    assert (
        len(Path("run", TRIALS).read_bytes().splitlines()) == 7
    )  # five trials and the first two lines
    assert study("--no-figures") == 0
    assert Path("run/trials.csv").read_bytes() == done.read_bytes()


def test_W7_a_damaged_first_line_is_refused_and_costs_no_trial(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The trials are sound, so a person may mend the line, or copy them elsewhere."""
    plan()
    assert study("--no-figures") == 0
    Path("run/result.json").unlink()  # as if it was killed
    store = Path("run", TRIALS)
    damaged = bytearray(store.read_bytes())
    damaged[30] ^= 1
    store.write_bytes(damaged)
    capsys.readouterr()
    said = refusal(capsys, "study", "plan.toml", "--trust-code", "--out", "run")
    assert "expected what is run in its first line, found that damaged, and" in said
    assert store.read_bytes() == damaged


def test_the_packages_that_are_installed_are_not_read_for_each_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That takes longer than a short one."""
    site = tmp_path / "site"
    (site / "theirs-1.0.dist-info").mkdir(parents=True)
    monkeypatch.syspath_prepend(str(site))
    read: list[str] = []
    text = PathDistribution.read_text

    def noted(self: PathDistribution, name: str) -> str | None:
        if Path(str(self.locate_file(""))) == site:
            read.append(name)
        return text(self, name)

    monkeypatch.setattr(PathDistribution, "read_text", noted)
    plan()
    assert study("--no-figures") == 0
    assert len(table()) == 12
    assert read.count("entry_points.txt") <= 2  # another package may ask once too


def squares(number: int) -> int:
    return number * number


def test_W9_ten_thousand_finished_trials_are_known_at_once(tmp_path: Path) -> None:
    """The bound of two seconds is for the whole command; here for the part that grows."""
    import time

    store = TrialFile(tmp_path / TRIALS)
    store.begin({"command": "x"})
    row = {"point": 1, "value": 0.25, "outcome": "success", **{f"column_{i}": i for i in range(12)}}
    for place in range(10_000):
        store.append(f"0.{place}", {"result": [place, [row]]})
    store.close()
    best = math.inf
    for _ in range(3):
        begin = time.perf_counter()
        again = TrialFile(tmp_path / TRIALS)
        tasks = [(i,) for i in range(10_000)]
        found = gather(squares, tasks, Workers(1, NoMore(), trials=again), lambda *_: None)
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
    store = TrialFile(tmp_path / "s")
    with pytest.raises(OutputError, match="another process"):
        TrialFile(tmp_path / "s")
    with pytest.raises(WorkerError, match="expected 1 finished trials, found 0"):
        gather(squares, [(1,)], Workers(1, NoMore(), trials=store), lambda *_: None)
    store.close()
    with pytest.raises(BadInputError, match="expected a readable file"):
        read_trials(tmp_path / "no")


def test_W1_killed_studies_end_with_the_same_table(tmp_path: Path) -> None:
    """A few kills; by hand `tests/study_killed.py FOLDER 200 SEED` kills 200 times."""
    found = study_killed.all_of(tmp_path, count=2, seed=1, trials=40)
    kills = found["drivers"] + found["workers"]
    assert kills == 2
    assert found["tables that differ"] == found["lost"] == found["twice"] == 0
    assert 0 <= found["again"] <= 2 * kills


@pytest.mark.slow
def test_W5_a_study_that_is_told_to_end_keeps_what_is_done(tmp_path: Path) -> None:
    """SIGTERM, as a cluster sends it."""
    plan(sleep=0.1)
    text = Path("plan.toml").read_text()
    Path("plan.toml").write_text(text.replace("trials = 3", "trials = 4"))
    driver = study_killed.start(tmp_path, "run")
    store = Path("run") / TRIALS
    end = time.monotonic() + 120.0
    while not store.exists() or store.read_bytes().count(b"\n") < 3:
        assert driver.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    driver.terminate()
    said = driver.communicate(timeout=60)[1].decode()  # 2 s where little else runs
    assert driver.returncode == 130
    assert "Traceback" not in said
    assert "to go on: " in said
    done = store.read_bytes()
    assert study("--no-figures") == 0
    assert store.read_bytes().startswith(done)
    values = [float(row["value"]) for row in table()]
    expected = [(x + 0.1) * (seed + 1) / 3 for x in (0.5, 0.5, 1.5, 1.5) for seed in range(4)]
    assert values == pytest.approx(expected, rel=1e-12)


def study_of(shares: Callable[[dict[str, Any]], dict[str, float]], seed: int) -> StudyResult:
    """A Morris study of eight parameters whose trials succeed by chance; some seeds are easy."""
    names = "abcdefgh"
    config = StudyConfig(
        plan="morris", points=6, trials=10, vary={name: Range(low=0.0, high=1.0) for name in names}
    )
    points, rng = config.points_of(None), np.random.default_rng(seed)
    easy = rng.uniform(-0.15, 0.15, 10)
    rows = [
        {
            "point": number,
            "controller": name,
            "trial": trial,
            "status": "ok",
            "outcome": "success" if rng.random() < share + easy[trial] else "timeout",
        }
        for number, point in enumerate(points)
        for name, share in shares(point).items()
        for trial in range(10)
    ]
    return summarise(config, points, config.vary, "controller", rows, len(rows), len(rows))


def test_where_nothing_has_an_effect_none_is_found() -> None:
    """Over its three targets one study in twenty may err, so of the difference one in sixty."""
    say = experiments.load("study").sentence
    sentences = [
        say(study_of(lambda point: {"open": 0.25, "closed": 0.6}, seed)) for seed in range(20)
    ]
    nothing = (
        "Of 8 parameters nothing moves the share of successes of closed minus open above the "
        "noise of 10 trials a point"
    )
    assert sum(nothing in sentence for sentence in sentences) >= 19


def test_a_cause_that_is_there_is_found_alone() -> None:
    result = study_of(lambda point: {"open": 0.25, "closed": point["d"]}, 1)
    found = [(each.of, each.parameter) for each in result.effects if each.above_noise]
    assert found == [("closed", "d"), ("closed minus open", "d")]
    study = experiments.load("study")
    said = study.sentence(result)
    assert "a point, the share of successes of closed minus open depends on d." in said
    table = study.tables(result)[0]
    cells = dict(table.rows)
    assert cells["d"][-1] == "closed, closed minus open"
    assert {cells[name][-1] for name in "abcefgh"} == {"-"}
    assert cells["noise of 10 trials a point"][-1] == ""


def test_one_trial_a_point_tells_no_noise() -> None:
    def slope(config: dict[str, Any], seed: int) -> dict[str, float]:
        noise = np.random.default_rng([seed, *(round(1e6 * v) for v in config.values())]).normal()
        return {"length_mm": 9.0 * config["a"] + noise}

    vary = {name: {"low": 0.0, "high": 1.0} for name in "abcd"}
    many = antennate.study(slope, vary=vary, plan="morris", points=6, trials=8, workers=1)
    assert "of 8 trials a point, the length depends on a." in many.sentence
    one = antennate.study(slope, vary=vary, plan="morris", points=6, trials=1, workers=1)
    assert "Of 1 trial a point no noise is known" in one.sentence


def of_the_point(config: dict[str, Any], seed: int) -> dict[str, float]:
    """A length that is known but for noise of 0.3; of `d` it does not depend."""
    numbers = [abs(round(1e6 * v)) for v in config.values() if not isinstance(v, str)]
    noise = 0.3 * np.random.default_rng([seed, *numbers]).normal()
    of_k = {"x": 0.0, "y": 3.0, "z": 0.0}[config["k"]]
    line = 2.0 * config["a"] - 5.0 * config["b"] + 0.5 * np.log10(config["l"])
    return {"length_mm": line + of_k + 0.1 * config["w"] + noise}


@pytest.mark.parametrize("kind", ["random", "sobol"])
def test_slopes_of_a_random_plan_are_those_of_the_function(kind: str, tmp_path: Path) -> None:
    """Slopes times width of the ranges, by hand; a choice against the first one."""
    vary = {
        "a": {"low": 0.0, "high": 1.0},
        "b": {"low": 0.0, "high": 2.0},
        "l": {"low": 0.01, "high": 1.0, "log": True},
        "w": {"low": 1, "high": 6, "whole": True},
        "k": ["x", "y", "z"],
        "d": {"low": -1.0, "high": 1.0},
    }
    result = antennate.study(
        of_the_point, vary, plan=kind, points=256, trials=1, workers=1, out=tmp_path / "run"
    )
    effects = {effect["parameter"]: effect for effect in result.summary["effects"]}
    expected = {"a": 2.0, "b": -10.0, "l": 1.0, "w": 0.5, "k = y": 3.0, "k = z": 0.0, "d": 0.0}
    assert {name: e["slope"] for name, e in effects.items()} == pytest.approx(expected, abs=0.25)
    above = {name for name, effect in effects.items() if effect["above_noise"]}
    assert above == {"a", "b", "l", "w", "k = y"}
    assert "Above the noise of 256 points, the length depends on b, k = y, a and 2 more" in (
        result.sentence
    )
    assert (tmp_path / "run" / "figures" / "effects.png").is_file()


def test_slopes_and_intervals_are_those_of_least_squares_and_hc3() -> None:
    """Against NumPy's least squares; HC3 is the jackknife but for the factor (n - 1) / n."""
    rng = np.random.default_rng(3)
    axes = {"a": Range(low=0.0, high=1.0), "b": Range(low=0.0, high=1.0)}
    config = StudyConfig(plan="random", points=30, trials=1, vary=axes)
    points = config.points_of(None)
    design = np.array([[1.0, point["a"], point["b"]] for point in points])
    response = design @ [0.5, 2.0, 0.0] + design[:, 1] * rng.normal(size=30)
    rows = [
        {"point": n, "trial": 0, "status": "ok", "length_mm": value}
        for n, value in enumerate(response.tolist())
    ]
    first, second = summarise(config, points, axes, "", rows, 30, 30).effects
    assert isinstance(first, Slope)
    assert isinstance(second, Slope)

    def solved(keep: Any) -> Any:
        return np.linalg.lstsq(design[keep], response[keep], rcond=None)[0]

    whole = solved(slice(None))
    assert (first.slope, second.slope) == pytest.approx(tuple(whole[1:]), rel=1e-9)
    without = np.array([solved(np.arange(30) != left_out) for left_out in range(30)])
    half = 2.0518 * np.sqrt(((without - whole) ** 2).sum(axis=0))  # Student's t of 27, 97.5 %
    assert first.slope95 == pytest.approx((whole[1] - half[1], whole[1] + half[1]), rel=1e-4)
    assert second.slope95 == pytest.approx((whole[2] - half[2], whole[2] + half[2]), rel=1e-4)


def test_as_many_points_as_parameters_tell_nothing(tmp_path: Path) -> None:
    vary = {name: {"low": 0.0, "high": 1.0} for name in "abcdefghij"}
    result = antennate.study(
        lambda config, seed: {"value": config["a"]}, vary, plan="random", points=11, trials=1
    )
    assert "Of 11 points no noise is known" in result.sentence
    assert len(experiments.load("study").tables(result.outcome.result())[0].columns) == 1


def test_figures_stand_in_one_column_and_tell_counts_and_noise() -> None:
    from antennate.experiments.study.figure import figures

    found = study_of(lambda point: {"open": 0.25, "closed": point["d"]}, 1)
    drawn = figures(Done([], found))["effects"]
    assert drawn.get_figwidth() <= 5.0  # 8 points are then 8 pixels on a phone of 375
    assert [panel.get_title(loc="left") for panel in drawn.axes] == [
        "open",
        "closed",
        "closed minus open",
    ]
    assert "noise of 10 trials a point" in {t.get_text() for t in drawn.legends[0].get_texts()}
    assert all(panel.get_xlim()[1] > 90.0 for panel in drawn.axes)  # d changes nearly all
    config = StudyConfig(vary={"tunnel.free_width": (0.4, 0.5), "tunnel.strewn": (0, 4)}, trials=4)
    points = config.points_of(None)
    rows = [
        {"point": number, "controller": name, "trial": trial, "status": "ok", "outcome": outcome}
        for number in range(4)
        for name in ("open", "closed")
        for trial, outcome in enumerate(["success", "timeout", "left", "timeout"])
    ]
    found = summarise(config, points, config.vary, "controller", rows, len(rows), len(rows))
    drawn = figures(Done([], found))["map"]
    assert drawn.get_figwidth() <= 5.0
    *maps, bar = drawn.axes
    assert [panel.get_title(loc="left") for panel in maps] == ["open", "closed"]
    assert len({round(panel.get_position().x0, 6) for panel in maps}) == 1
    assert maps[1].get_xlabel() == "free width [m]"
    assert "share of successes [%]" in bar.get_xlabel()
    assert [text.get_text() for text in maps[0].texts] == ["25\n5–70\n1 of 4"] * 4  # Wilson's
