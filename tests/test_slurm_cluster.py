"""`--engine slurm` on a real SLURM of one node, with all that can befall a job or its driver."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from slurm_cluster import Cluster, NoCluster, cluster

import antennate

HERE = Path(__file__).parent
TRIALS = 16
"""Trials of the study below."""
PLAN = f"""
experiment = "{HERE}/study_trials.py:trial"
trials = {TRIALS // 2}
[settings]
sleep = {{sleep}}
[vary]
x = [0.5, 1.5]
"""
PROGRESS = ("study: ", "written to ")
"""How lines on stderr begin that are there without a fault."""
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A cluster that ends with these tests."""
    pytest.importorskip("submitit")
    with contextlib.ExitStack() as stack:
        try:
            made = stack.enter_context(cluster(tmp_path_factory.mktemp("cluster")))
        except NoCluster as reason:
            pytest.skip(f"no SLURM here: {reason}")
        yield made


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table of the study without SLURM."""
    folder = tmp_path_factory.mktemp("local")
    plan, out = folder / "plan.toml", folder / "run"
    plan.write_text(PLAN.format(sleep=0))
    words = [sys.executable, "-m", "antennate", "study", str(plan), "--trust-code", "--no-figures"]
    known = {**os.environ, "PYTHONPATH": source()}
    subprocess.run([*words, "--out", str(out)], env=known, check=True, capture_output=True)
    return (out / "trials.csv").read_bytes()


def source() -> str:
    return str(Path(antennate.__file__).parents[1])


class Study:
    """One study on the cluster, whose command may be given again."""

    def __init__(self, slurm: Cluster, folder: Path) -> None:
        self.slurm, self.folder = slurm, folder
        self.notes, self.jobs = folder / "notes.txt", folder / "run" / "slurm"
        self.driver: subprocess.Popen[str] | None = None

    def start(self, *slurm: str, sleep: float = 0.4, workers: int = 2) -> None:
        (self.folder / "plan.toml").write_text(PLAN.format(sleep=sleep))
        words = ["-m", "antennate", "study", "plan.toml", "--trust-code", "--no-figures"]
        words += ["--out", "run", "--workers", str(workers), "--engine", "slurm"]
        words += ["--slurm", *slurm] if slurm else []
        known = {**self.slurm.known, "PYTHONPATH": source(), "STUDY_NOTES": str(self.notes)}
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        self.driver = subprocess.Popen(
            [sys.executable, *words], cwd=self.folder, env=known, **pipes
        )

    def ended(self) -> list[str]:
        """Trials that have ended, each as often as it has."""
        return self.notes.read_text().splitlines() if self.notes.exists() else []

    def until(self, done: Callable[[], object]) -> None:
        """Wait until something is so, while the command runs."""
        end = time.monotonic() + 60.0
        while not done():
            assert self.driver is not None
            assert self.driver.poll() is None, self.driver.communicate()[1]
            assert time.monotonic() < end
            time.sleep(0.1)

    def until_both_run(self) -> list[str]:
        """Numbers of both jobs, once each has finished a trial."""
        points = ("0.5 ", "1.5 ")
        self.until(lambda: all(any(x.startswith(p) for x in self.ended()) for p in points))
        running = self.slurm.running()
        assert len(running) == 2
        return running

    def wait(self) -> tuple[int, list[str]]:
        """The exit code, and the lines on stderr that are no progress."""
        assert self.driver is not None
        said = self.driver.communicate(timeout=100.0)[1].splitlines()
        return self.driver.returncode, [x for x in said if not x.startswith(PROGRESS)]

    def end(self) -> None:
        """Kill the driver if it still runs."""
        if self.driver is not None and self.driver.poll() is None:
            self.driver.kill()
            self.driver.communicate()

    def table(self) -> bytes:
        return (self.folder / "run" / "trials.csv").read_bytes()


@pytest.fixture
def study(slurm: Cluster, tmp_path: Path) -> Iterator[Study]:
    """A study whose driver and jobs end with the test."""
    made = Study(slurm, tmp_path)
    yield made
    made.end()
    slurm.end_jobs()


def cancelled(study: Study, number: str) -> None:
    study.slurm.say("scancel", number)


def killed(study: Study, number: str) -> None:
    """All processes of a job that SLURM began: what submitit runs, and what runs the trials."""
    processes = study.slurm.processes(f"SLURM_JOB_ID={number}", "SLURM_PROCID=0")
    assert processes
    for process in processes:
        with contextlib.suppress(OSError):
            os.kill(process, signal.SIGKILL)


def requeued(study: Study, number: str) -> None:
    study.slurm.say("scontrol", "requeue", number)


def preempted(study: Study, number: str) -> None:
    study.slurm.say("scancel", "--signal=USR2", number)


@pytest.mark.parametrize("befalls", [(cancelled, killed), (requeued, preempted)])
def test_jobs_that_end_too_early_cost_no_trial(
    study: Study, table: bytes, befalls: tuple[Callable[[Study, str], None], ...]
) -> None:
    """Another job takes the rest, or the same one that SLURM begins again."""
    study.start("timeout_min=60")
    for number, befall in zip(study.until_both_run(), befalls, strict=True):
        befall(study, number)
    assert study.wait() == (0, [])
    assert study.table() == table
    assert len(study.ended()) == len(set(study.ended())) == TRIALS
    study.slurm.until(lambda: not study.slurm.jobs())  # one that begins once more finds no work
    assert len(study.ended()) == TRIALS


def test_after_a_driver_was_killed_the_same_command_leaves_the_same_table(
    study: Study, table: bytes
) -> None:
    """Its jobs still run; there are more of them than cores, so one of them waits."""
    study.start(workers=3)
    study.until_both_run()
    assert study.driver is not None
    study.driver.kill()
    study.driver.communicate()
    study.start(workers=3)
    assert study.wait() == (0, [])
    assert study.table() == table


def test_ctrl_c_cancels_the_jobs_and_the_same_command_goes_on(study: Study, table: bytes) -> None:
    study.start()
    study.until_both_run()
    assert study.driver is not None
    study.driver.send_signal(signal.SIGINT)
    code, said = study.wait()
    assert code == 130
    assert said[0].startswith("antennate study: interrupted: kept")
    assert not study.slurm.running()
    study.start()
    assert study.wait() == (0, [])
    assert study.table() == table
    assert len(set(study.ended())) == TRIALS
    assert len(study.ended()) <= TRIALS + 2, "each job may have been at a trial"


REFUSED = {
    "slurm_partition=nowhere": "invalid partition specified: nowhere",
    "slurm_colour=red": "Unknown argument 'colour' for executor 'slurm'",
    "timeout_min=soon": "timeout_min: expected a number above 0, found soon",
    "tasks_per_node=2": "tasks_per_node: expected 1, as jobs have one task, found 2",
    'slurm_setup=["exit 1"]': "found 3 in a row that ended before: FAILED",
}
"""What SLURM cannot give, and the reason that is told."""


def test_what_slurm_cannot_give_is_one_line(study: Study) -> None:
    """The last is a time limit that is too short.

    SLURM counts in minutes, so the end of a job that runs is brought forward. It looks at that
    every 30 s; the others run meanwhile.
    """
    study.start("timeout_min=60", "slurm_signal_delay_s=0", sleep=300.0, workers=1)
    study.until(lambda: any(file.stat().st_size for file in study.jobs.glob("*.jsonl")))
    (number,) = study.slurm.running()
    study.slurm.say("scontrol", "update", f"JobId={number}", "EndTime=now+1")
    others = [Study(study.slurm, study.folder / str(place)) for place in range(len(REFUSED))]
    with contextlib.ExitStack() as stack:
        for other, asked in zip(others, REFUSED, strict=True):
            other.folder.mkdir()
            other.start(asked)
            stack.callback(other.end)
        for other, found in zip(others, REFUSED.values(), strict=True):
            code, said = other.wait()
            assert (code, len(said)) == (2, 1), said
            assert said[0].startswith("antennate study: error: ")
            assert found in said[0]
    assert study.wait() == (
        2,
        [
            "antennate study: error: slurm: expected a job to end a trial within its time limit, "
            "found none; ask for more with --slurm timeout_min=MINUTES, or for less with "
            "--trial-timeout"
        ],
    )


def test_a_controller_that_is_not_there_is_one_line(study: Study) -> None:
    study.slurm.stop_controller()
    try:
        study.start()
        code, said = study.wait()
    finally:
        study.slurm.start_controller()
    assert code == 2
    assert said[-1].startswith("antennate study: error: slurm: expected a job to be taken, found: ")
