"""What an interrupted run says: the whole command that goes on with it."""

import errno
import json
import os
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from antennate.cli import main
from antennate.errors import OutputError
from antennate.messages import command_words
from antennate.sim.world import World
from antennate.studies.run_directory import RunDirectory
from antennate.studies.trial_file import TrialFile
from antennate.telemetry.reader import LogReader

TUNNEL = ["tunnel", "--controllers", "open", "--time-limit", "0.2", "--trials", "3"]


def interrupted(capsys, monkeypatch, *words):
    """Interrupt a run after its first trial; the words of the command that it names."""
    kept = RunDirectory.append

    def append(self, row):
        kept(self, row)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(RunDirectory, "append", append)
        assert main([*words]) == 130
    (line,) = [a for a in capsys.readouterr().err.splitlines() if a.startswith("to go on: ")]
    return shlex.split(line.removeprefix("to go on: "))


def test_nothing_stays_of_a_run_that_is_interrupted_before_its_first_trial(
    capsys, tmp_path, monkeypatch
):
    """So the same command runs again, with --resume as well."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()

    def advance(self, count):
        raise KeyboardInterrupt

    words = [*TUNNEL, "--log", "--workers", "1", "--no-figures", "--out"]
    for folder in ("new", "there"):
        with monkeypatch.context() as patched:
            patched.setattr(World, "advance", advance)
            assert main([*words, folder]) == 130
    assert [path.name for path in tmp_path.rglob("*")] == ["there"]
    (tmp_path / "there" / "logs").mkdir()
    (tmp_path / "there" / "logs" / "open-0.mcap").write_bytes(b"of somebody")
    capsys.readouterr()
    assert main([*words, "there", "--resume"]) == 2
    assert "expected no file logs/open-0.mcap but of this run" in capsys.readouterr().err
    assert (tmp_path / "there" / "logs" / "open-0.mcap").read_bytes() == b"of somebody"


@pytest.mark.parametrize(("moment", "stays"), [("describe", False), ("write_figures", True)])
def test_a_run_that_is_stopped_before_or_after_its_trials_ends_as_by_ctrl_c(
    capsys, tmp_path, monkeypatch, moment, stays
):
    """Batch systems and `docker stop` send SIGTERM, whatever the run does at that time."""
    done = getattr(RunDirectory, moment)

    def stopped(*given):
        done(*given)
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(RunDirectory, moment, stopped)
    before = signal.signal(signal.SIGTERM, lambda *_: pytest.fail("SIGTERM ended the program"))
    try:
        assert main([*TUNNEL, "--workers", "1", "--out", str(tmp_path / "run")]) == 130
    finally:
        signal.signal(signal.SIGTERM, before)
    assert capsys.readouterr().err.endswith("antennate tunnel: interrupted\n")
    assert (tmp_path / "run" / "result.json").exists() == (tmp_path / "run").exists() == stays


@pytest.mark.parametrize(
    ("out", "folder"),
    [(["--out", "a run", "--overwrite"], "a run"), (["--out=mine"], "mine"), ([], "runs/tunnel-1")],
)
def test_an_interrupted_run_names_the_whole_command_that_goes_on(
    capsys, tmp_path, monkeypatch, out, folder
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("UV", raising=False)
    told = interrupted(capsys, monkeypatch, *TUNNEL, *out, "--workers", "1", "--no-figures")
    assert told[0] == "antennate"
    assert told[-3:] == ["--out", folder, "--resume"]
    assert "--overwrite" not in told
    assert main(told[1:]) == 0
    result = json.loads((tmp_path / folder / "result.json").read_text())
    assert result["controllers"]["open"]["trials"] == 3


@pytest.mark.ci
def test_an_interrupted_gait_goes_on_after_the_walks_that_had_ended(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("UV", raising=False)
    words = ["gait", "--sweep-points", "2", "--cycles", "2", "--settling-cycles", "0"]
    kept = TrialFile.append

    def append(self, *given):
        kept(self, *given)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(TrialFile, "append", append)
        assert main([*words, "--out", "run", "--workers", "1", "--no-figures"]) == 130
    said = capsys.readouterr().err
    (line,) = [a for a in said.splitlines() if a.startswith("to go on: ")]
    told = shlex.split(line.removeprefix("to go on: "))
    assert told[:2] == ["antennate", "gait"]
    assert main(told[1:]) == 0
    assert (tmp_path / "run" / "result.json").exists()


def test_an_interrupted_run_within_uv_names_the_command_of_uv(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("UV", "/usr/bin/uv")
    told = interrupted(capsys, monkeypatch, *TUNNEL, "--out", "run", "--workers", "1")
    assert told[:4] == ["uv", "run", "antennate", "tunnel"]
    assert told[4:10] == TUNNEL[1:]


def test_an_interrupted_shard_is_no_bad_input_and_goes_on(capsys, tmp_path, monkeypatch):
    """It leaves no result, as that is of all shards."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("UV", raising=False)
    words = [*TUNNEL, "--out", "part", "--workers", "1", "--no-figures", "--shard", "1/2"]
    told = interrupted(capsys, monkeypatch, *words)
    assert told[-5:] == ["--shard", "1/2", "--out", "part", "--resume"]
    assert not (tmp_path / "part" / "result.json").exists()
    assert main(told[1:]) == 0
    assert json.loads((tmp_path / "part" / "shard.json").read_text())["trials"] == 2


@pytest.mark.ci
@pytest.mark.parametrize("workers", [pytest.param(1, marks=pytest.mark.slow), 2])
def test_a_disk_that_is_full_before_a_trial_has_ended_keeps_the_logs(tmp_path, workers):
    """Several trials run in lockstep. A chunk that was taken in part holds more whole ticks."""
    words = ["tunnel", "--controllers", "open", "--scene", "flat", "--time-limit", "5"]
    words += ["--trials", "4", "--log", "--no-figures"]
    words = [sys.executable, "-m", "antennate", *words, "--workers", str(workers), "--out", "run"]

    def small_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, resource.RLIM_INFINITY))

    done = subprocess.run(
        words,
        cwd=tmp_path,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=small_disk,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    found = re.fullmatch(
        r"antennate tunnel: error: (?:a worker failed: )?expected to write (run/logs/open-\d.mcap),"
        r" found: (?:only \d+ of \d+ bytes were taken; the disk is full|File too large);"
        r" the log ends after (\d+) ticks\n",
        done.stderr,
    )
    assert found, done.stderr
    with LogReader(tmp_path / found[1]) as log:
        assert 20 < int(found[2]) <= sum(1 for _ in log) < 500
    assert main([*words[3:-1], str(tmp_path / "run"), "--resume"]) == 0
    assert len(list((tmp_path / "run" / "logs").iterdir())) == 4


def test_a_disk_that_is_full_before_a_log_begins_leaves_nothing(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda place: SimpleNamespace(free=2.5e4))
    words = [*TUNNEL, "--log", "--workers", "1", "--out", str(tmp_path / "run")]
    assert main(words) == 2
    place = tmp_path / "run" / "logs" / "open-0.mcap"
    assert capsys.readouterr().err.endswith(
        f"error: expected 100 MB free for {place}, found 25 kB\n"
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kept", [0, 2])
def test_a_disk_that_takes_no_trial_does_not_promise_more_than_it_holds(
    capsys, tmp_path, monkeypatch, kept
):
    """What is said to be kept is there."""
    write, taken = os.write, iter([True] * (kept + 1) + [False] * 100)

    def full(file, data):
        if data.startswith(b'{"crc"') and not next(taken):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(file, data)

    monkeypatch.setattr(os, "write", full)
    assert main([*TUNNEL, "--workers", "1", "--out", str(tmp_path / "run")]) == 2
    (line,) = [a for a in capsys.readouterr().err.splitlines() if "error:" in a]
    store = tmp_path / "run" / "trials.jsonl"
    assert f"expected to write {store}, found: No space left on device" in line
    assert ("what was finished is kept, and the run can be resumed" in line) == bool(kept)
    assert store.exists() == bool(kept)


@pytest.mark.ci
def test_a_refused_command_leaves_a_finished_run_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["antenna", "--out", str(run)]) == 0
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    refused = ["--shard 1/2", "--engine slurm-local", "--workers 3", "--retry"]
    for words in map(str.split, [*refused, "--trial-timeout 3", "--trial-timeout 3600"]):
        capsys.readouterr()
        assert main(["antenna", "--out", str(run), "--overwrite", *words]) == 2
        assert f"expected a known flag, found '{words[0]}'" in capsys.readouterr().err
        assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before


def test_a_finished_run_that_cannot_grow_takes_no_more_trials_and_says_so(tmp_path: Path) -> None:
    run = tmp_path / "run"
    with RunDirectory.create("touch", run, identity={"versions": {}, "trials": 1}) as folder:
        folder.finish({"schema": 1})
    with pytest.raises(OutputError, match="expected an unfinished run of this version"):
        RunDirectory.create("touch", run, identity={"versions": {}, "trials": 2}, resume=True)


IN_THIS_PROCESS = ["antenna", "servo", "tracks"]
OF_WORKERS = {"workers", "engine", "slurm", "shard", "resume", "retry", "trial-timeout"}


@pytest.mark.parametrize(
    ("name", "missing"),
    [
        *((name, OF_WORKERS) for name in IN_THIS_PROCESS),
        ("tunnel", set[str]()),
    ],
)
def test_help_lists_no_option_that_is_always_refused(
    name: str, missing: set[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*command_words(name).split(), "--help-all"]) == 0
    listed = set(re.findall(r"^  --([a-z-]+)", capsys.readouterr().out, re.MULTILINE))
    assert OF_WORKERS - listed == missing


@pytest.mark.ci
@pytest.mark.parametrize("workers", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_walls_of_which_none_is_valid_end_with_2(
    workers: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One worker gives a trial up too, in a process of its own."""
    words = ["bench", "wall", "--trials", "2", "--profiles", "stiff", "--trial-timeout", "0.01"]
    more = ["--workers", workers, "--no-figures", "--out", str(tmp_path / "run")]
    assert main([*words, *more]) == 2
    assert "no result within 0.01 s" in (tmp_path / "run" / "trials.csv").read_text()
    assert "No trial is valid" in capsys.readouterr().out


@pytest.mark.ci
def test_a_shard_of_a_finished_study_leaves_it_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan, run = tmp_path / "plan.toml", tmp_path / "run"
    plan.write_text('experiment = "antenna"\nplan = "grid"\n[vary]\ncoil_mm = [3.0, 4.0]\n')
    assert main(["study", str(plan), "--out", str(run), "--workers", "1"]) == 0
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    capsys.readouterr()
    assert main(["study", str(plan), "--out", str(run), "--shard", "1/2"]) == 2
    assert "--shard: expected a folder without a finished run" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
