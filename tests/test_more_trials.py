"""More trials of a run that is finished: those that it has stay, and all else is as at once."""

from __future__ import annotations

from pathlib import Path

import pytest

import antennate
from antennate.cli import main
from antennate.studies.trial_file import TRIALS, read_trials

NOTED = """
from pathlib import Path
def trial(config, seed):
    with Path("noted").open("a") as file:
        file.write(f"{config['x']} {seed}\\n")
    return {"value": config["x"] * (seed + 1) / 3}
"""
TUNNEL = ["tunnel", "--controllers", "open", "closed", "--time-limit", "0.2", "--scene", "flat"]


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("code.py").write_text(NOTED)
    Path("plan.toml").write_text(
        'experiment = "code.py:trial"\nplan = "random"\npoints = 3\ntrials = 2\n'
        "[vary]\nx = { low = 0.0, high = 1.0 }\n"
    )


def same(one: str, other: str) -> bool:
    """Whether two runs have the same table, result and figures."""
    names = [*("trials.csv", "result.json", "config.toml")]
    names += [str(path.relative_to(one)) for path in sorted(Path(one, "figures").glob("*"))]
    assert [path.name for path in sorted(Path(other, "figures").glob("*"))] == [
        Path(name).name for name in names[3:]
    ]
    return all(Path(one, name).read_bytes() == Path(other, name).read_bytes() for name in names)


def study(out: str, trials: int) -> int:
    words = ["study", "plan.toml", "--trust-code", "--workers", "1", "--no-figures"]
    return main([*words, "--out", out, "--trials", str(trials)])


def noted() -> list[str]:
    """The trials that were run since the last call."""
    lines = Path("noted").read_text().splitlines()
    Path("noted").unlink()
    return lines


@pytest.mark.ci
def test_a_tunnel_takes_more_trials_and_is_the_same_as_at_once() -> None:
    words = [*TUNNEL, "--workers", "1", "--log"]
    assert main([*words, "--trials", "1", "--out", "run"]) == 0
    first = Path("run/logs/closed-0.mcap").stat().st_mtime_ns
    assert main([*words, "--trials", "3", "--out", "run", "--resume"]) == 0
    assert main([*words, "--trials", "3", "--out", "once"]) == 0
    assert same("run", "once")
    assert Path("run/logs/closed-0.mcap").stat().st_mtime_ns == first, "it was run again"
    logs = [path.name for path in sorted(Path("once/logs").iterdir())]
    assert [path.name for path in sorted(Path("run/logs").iterdir())] == logs
    assert "--trials 3" in Path("run/report.html").read_text()
    for _ in range(2):  # the second one removes the logs, if all are in the list
        assert main([*TUNNEL, "--trials", "1", "--out", "run", "--overwrite", "--no-figures"]) == 0


@pytest.mark.slow
def test_a_study_runs_those_alone_that_it_has_not() -> None:
    assert study("run", 2) == 0
    assert len(noted()) == 6
    assert study("run", 4) == 0
    assert sorted(int(line.split()[1]) for line in noted()) == [2, 2, 2, 3, 3, 3]
    assert study("run", 4) == 0
    assert not Path("noted").exists()
    assert study("once", 4) == 0
    assert same("run", "once")
    assert study("run", 5) == 0
    assert study("five", 5) == 0
    assert same("run", "five")


@pytest.mark.ci
def test_fewer_trials_are_refused_and_nothing_changes(capsys: pytest.CaptureFixture[str]) -> None:
    assert study("run", 3) == 0
    before = {path: path.read_bytes() for path in Path("run").rglob("*") if path.is_file()}
    capsys.readouterr()
    assert study("run", 2) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "or more trials of it, found another: trials 3, now 2" in line
    Path("plan.toml").write_text(Path("plan.toml").read_text().replace("high = 1.0", "high = 2.0"))
    assert study("run", 4) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "found another: trials 3, now 4, vary.x.high 1.0, now 2.0" in line
    assert before == {path: path.read_bytes() for path in before}


@pytest.mark.ci
@pytest.mark.parametrize("cut", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 30))])
def test_a_run_that_was_killed_as_it_took_more_goes_on(cut: int) -> None:
    """At the line that says so: whole, or torn; with the result of before still there."""
    assert study("run", 2) == 0
    result = Path("run/result.json").read_bytes()
    begun = Path("run", TRIALS).stat().st_size
    assert study("run", 3) == 0
    lines = Path("run", TRIALS).read_bytes()
    end = lines.index(b"\n", begun) + 1
    Path("run", TRIALS).write_bytes(lines[: end - cut])
    Path("run/result.json").write_bytes(result)
    noted()
    assert len(read_trials(Path("run", TRIALS)).records) == 6
    assert study("run", 3) == 0
    assert sorted(int(line.split()[1]) for line in noted()) == [2, 2, 2]
    assert study("once", 3) == 0
    assert same("run", "once")


@pytest.mark.ci
def test_from_python_it_goes_on_as_well() -> None:
    settings = {"controllers": ["open"], "scene": "flat", "time_limit": 0.2}
    antennate.run("tunnel", trials=1, out="run", **settings)
    more = antennate.run("tunnel", trials=2, out="run", resume=True, **settings)
    assert more.rows == antennate.run("tunnel", trials=2, **settings).rows
