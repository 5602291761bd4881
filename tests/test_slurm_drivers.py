"""What becomes of trials whose job or driver ends too early, with jobs as processes."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import antennate
from antennate.studies.trial_file import read_trials

pytestmark = pytest.mark.ci

HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = os.pathsep.join([str(Path(antennate.__file__).parents[1]), str(HERE)])
    monkeypatch.setenv("PYTHONPATH", path)


DRIVER = """
from pathlib import Path
from study_trials import trial
from antennate.experiments.study.config import StudyConfig
from antennate.studies.engines import make_engine
from antennate.studies.pool import Workers, gather
from antennate.studies.trial_file import TrialFile

store = TrialFile(Path("run/trials.jsonl"))
store.begin({"study": "of six trials"})
model = StudyConfig(experiment="wall", plan="sobol", points=4, seed=1, trials=2, vary={"x": [1.0]})
config = {"x": 1.0, "sleep": 0.5, "model": model}
tasks = [(config, seed) for seed in range(6)]
workers = Workers(1, make_engine("slurm-local"), trials=store)
gather(trial, tasks, workers, lambda done, total: None)
"""


def driver(notes: Path) -> subprocess.Popen[bytes]:
    """A driver of six trials in one job, in a process that may be killed."""
    known = {**os.environ, "STUDY_NOTES": str(notes)}
    return subprocess.Popen([sys.executable, "-c", DRIVER], env=known)


def until(done: Callable[[], object]) -> None:
    """Wait until something is so."""
    end = time.monotonic() + 120.0
    while not done():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_the_next_driver_runs_again_what_jobs_finish_after_theirs_was_killed(
    tmp_path: Path,
) -> None:
    """The first one's job still runs then: what it finishes changes nothing."""
    pytest.importorskip("submitit")
    notes = tmp_path / "notes.txt"
    Path("run").mkdir()
    first = driver(notes)
    try:
        until(notes.exists)
    finally:
        first.kill()
        first.wait()
    assert driver(notes).wait() == 0
    assert sorted(set(notes.read_text().split()[1::2])) == list("012345")
    assert sorted(read_trials(Path("run/trials.jsonl")).records) == [
        f"0.{seed}" for seed in range(6)
    ]
    assert not list(Path("run/slurm").glob("*.jsonl"))
    until(lambda: len(list(Path("run/slurm").glob("*_result.pkl"))) == 2)


def test_jobs_of_a_driver_in_the_background_end_with_it(tmp_path: Path) -> None:
    """A shell lets what it starts with `&` ignore Ctrl-C, by which submitit ends jobs."""
    pytest.importorskip("submitit")
    notes = tmp_path / "notes.txt"
    Path("run").mkdir()
    Path("driver.py").write_text(
        "import signal\nsignal.signal(signal.SIGTERM, signal.default_int_handler)\n"
        + DRIVER.replace('"sleep": 0.5', '"sleep": 20.0')
    )
    script = f"trap '' INT; exec {sys.executable} driver.py"
    there = {**os.environ, "STUDY_NOTES": str(notes)}
    background = subprocess.Popen(["bash", "-c", script], env=there)
    try:
        until(notes.exists)
        (submitted,) = Path("run/slurm").glob("*_submitted.pkl")
        job = int(submitted.name.partition("_")[0])
        background.terminate()
        assert background.wait(60.0) != 0
    finally:
        background.kill()
    end = time.monotonic() + 15.0
    while Path(f"/proc/{job}").exists():
        assert time.monotonic() < end, "its trials take two minutes"
        time.sleep(0.05)


KILLS_ITS_JOB = """
import os
import signal
from pathlib import Path


def trial(config, seed):
    if seed == 1 and not Path("killed").exists():
        Path("killed").touch()
        os.kill(os.getppid(), signal.SIGKILL)
    return {"value": seed}
"""


def own_study(text: str, out: str, *slurm: str) -> subprocess.CompletedProcess[str]:
    """A study of a function of its own on jobs of this machine."""
    Path("own.py").write_text(text)
    Path("plan.toml").write_text('experiment = "own.py:trial"\ntrials = 3\n[vary]\nx = [1.0]\n')
    words = ["study", "plan.toml", "--trust-code", "--no-figures", "--workers", "1", "--out", out]
    words += ["--engine", "slurm-local", *(["--slurm", *slurm] if slurm else [])]
    command = [sys.executable, "-m", "antennate", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_no_word_in_what_a_killed_job_leaves_tells_why_it_ended() -> None:
    """submitit names the folder when it says that a job has left nothing."""
    pytest.importorskip("submitit")
    done = own_study(KILLS_ITS_JOB, "WorkerError: timed-out too many times")
    assert done.returncode == 0, done.stderr
    assert Path("killed").exists()
    table = Path("WorkerError: timed-out too many times/trials.csv").read_text()
    assert table.count(",ok,") == 3


TOLD_OF_THE_END = """
import os
import signal
import time


def trial(config, seed):
    os.kill(os.getppid(), signal.SIGUSR2)
    time.sleep(60)
"""


def test_a_job_that_is_told_of_its_time_limit_once_too_often_ends_the_run() -> None:
    """submitit begins it again three times."""
    pytest.importorskip("submitit")
    done = own_study(TOLD_OF_THE_END, "run")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == (
        "antennate study: error: slurm: expected a job to end a trial within its time limit, found "
        "none; ask for more with --slurm timeout_min=MINUTES, or for less with --trial-timeout"
    )
