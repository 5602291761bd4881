"""What a driver of SLURM's jobs finds of an earlier one that was killed, with jobs as processes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from study_trials import trial

import antennate
from antennate.studies import slurm
from antennate.studies.identity import environment
from antennate.studies.work import Part

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
from antennate.studies.store import Store

store = Store(Path("run/trials.store.jsonl"))
store.begin({"study": "of six trials"})
model = StudyConfig(experiment="wall", plan="sobol", points=4, seed=1, trials=2, vary={"x": [1.0]})
config = {"x": 1.0, "sleep": 0.5, "model": model}
tasks = [(config, seed) for seed in range(6)]
workers = Workers(1, make_engine("slurm-local"), store=store)
gather(trial, tasks, workers, lambda done, total: None)
"""


def driver(notes: Path, seed: int) -> subprocess.Popen[bytes]:
    """A driver of six trials in one job, in a process that may be killed.

    Its sets are in an order of their own, as those of each process are.
    """
    there = {**os.environ, "STUDY_NOTES": str(notes), "PYTHONHASHSEED": str(seed)}
    return subprocess.Popen([sys.executable, "-c", DRIVER], env=there)


def test_jobs_of_a_driver_that_was_killed_are_taken_over(tmp_path: Path) -> None:
    """No trial is run twice, though the job goes on while the next driver starts."""
    pytest.importorskip("submitit")
    notes = tmp_path / "notes.txt"
    Path("run").mkdir()
    first = driver(notes, 1)
    try:
        end = time.monotonic() + 120.0
        while not notes.exists():
            assert time.monotonic() < end
            time.sleep(0.05)
    finally:
        first.kill()
        first.wait()
    assert list(Path("run/slurm").glob("*.job"))
    assert driver(notes, 2).wait() == 0
    assert sorted(notes.read_text().split()[1::2]) == list("012345")
    assert not list(Path("run/slurm").glob("*.job"))


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
        end = time.monotonic() + 120.0
        while not notes.exists():
            assert time.monotonic() < end
            time.sleep(0.05)
        (note,) = Path("run/slurm").glob("*.job")
        job = int(json.loads(note.read_text())["job"])
        background.terminate()
        assert background.wait(60.0) != 0
    finally:
        background.kill()
    end = time.monotonic() + 15.0
    while Path(f"/proc/{job}").exists():
        assert time.monotonic() < end, "its trials take two minutes"
        time.sleep(0.05)


def test_a_job_whose_driver_was_killed_before_it_noted_it_does_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next driver does not know of it, and gives its tasks to another job."""
    pytest.importorskip("cloudpickle")
    monkeypatch.setattr("antennate.studies.slurm_job.NOTED", 0.3)
    part = Part(trial, {0: ({"x": 1.0}, 0)}, together=False, timeout=60.0)
    job = slurm.Resumable(str(tmp_path / "a.jsonl"), environment(), part, {}, noted=True)
    assert job.carry_out() == 0
    assert not (tmp_path / "a.jsonl").exists()
    (tmp_path / "a.job").touch()
    assert job.carry_out() == 1


CURED = """
from pathlib import Path


def trial(config, seed):
    with Path("notes.txt").open("a") as notes:
        notes.write(f"{seed} ")
    if seed == 1 and not Path("cured").exists():
        raise ValueError("not yet")
    return {"value": seed}
"""


def test_retry_runs_a_trial_again_that_a_job_of_an_earlier_driver_told_as_failed() -> None:
    pytest.importorskip("submitit")
    Path("run").mkdir()
    Path("own.py").write_text(CURED)
    code = DRIVER.replace("from study_trials", "from own").replace(', "sleep": 0.5', "")
    first = subprocess.Popen([sys.executable, "-c", code])
    try:
        end = time.monotonic() + 120.0
        while not list(Path("run/slurm").glob("*.job")):
            assert time.monotonic() < end
            time.sleep(0.001)
    finally:
        first.kill()
        first.wait()
    while not list(Path("run/slurm").glob("*_result.pkl")):
        assert time.monotonic() < end
        time.sleep(0.05)
    Path("cured").touch()
    code = code.replace("store=store", "store=store, retry=True")
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
    assert Path("notes.txt").read_text().split() == [*"012345", "1"]


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
