"""Tasks over processes: all results, whatever the workers, and a clear word when one dies."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing import current_process, get_context
from pathlib import Path
from typing import Any

import pytest
from pool_tasks import beside, die, halves, trouble, trouble_together

from antennate.errors import WorkerError
from antennate.studies.engines import make_engine
from antennate.studies.pool import Workers, core_count, gather
from antennate.studies.work import Failure, Together


def no_step(done: int, total: int) -> None:
    pass


@pytest.mark.smoke
@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_the_order_of_the_tasks(workers: int) -> None:
    steps: list[tuple[int, int]] = []
    tasks = [(7, 2), (9, 4), (5, 5)]
    found = gather(halves, tasks, workers, lambda done, total: steps.append((done, total)))
    assert found == [(3, 1), (2, 1), (1, 0)]
    assert steps == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.ci
def test_a_failing_task_is_named() -> None:
    with pytest.raises(WorkerError, match="ZeroDivisionError"):
        gather(halves, [(1, 0), (2, 0)], 2, no_step)
    with pytest.raises(ZeroDivisionError):
        gather(halves, [(1, 0), (2, 0)], 1, no_step)


def test_a_process_that_may_begin_no_other_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(current_process(), "daemon", True)  # as in a pool of multiprocessing
    with pytest.raises(WorkerError, match="found a daemonic one"):
        gather(halves, [(1, 2)], Workers(1, timeout=9.0), no_step)
    monkeypatch.undo()
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    with pytest.raises(WorkerError, match="expected a working directory, found: No such file"):
        gather(halves, [(1, 2)], Workers(1, timeout=9.0), no_step)


@pytest.mark.ci
def test_one_worker_with_any_time_limit_is_a_process_of_its_own() -> None:
    """Also with the usual hour: only such a process can be given up."""
    for workers, own in ((Workers(1), True), (Workers(1, timeout=3600.0), False)):
        found = gather(os.getpid, [()], workers, no_step)
        assert (found == [os.getpid()]) == own


@pytest.mark.ci
def test_groups_share_no_chunk() -> None:
    tasks = [*zip("aaabb", range(5), strict=True)]
    found = gather(Together(beside, 2, lambda group, number: group), tasks, 1, no_step)
    assert found == [[0], [1, 2], [1, 2], [3, 4], [3, 4]]


def lost(place: int, failure: Failure) -> Any:
    return (failure.status, failure.reason)


@pytest.mark.ci
@pytest.mark.parametrize(
    ("function", "most"),
    [(trouble, 3), (Together(trouble_together, 5), 4)],
    ids=["one by one", "together"],
)
def test_W4_what_dies_hangs_or_raises_is_found_and_the_others_end(
    tmp_path: Path, function: Any, most: int, capfd: pytest.CaptureFixture[str]
) -> None:
    """A task that kills its worker has three chances alone; one that never ends has one."""
    tasks = [(number, str(tmp_path)) for number in range(9)]
    workers = Workers(2, timeout=2.0)
    found = gather(function, tasks, workers, no_step, lost=lost)
    statuses = [each[0] if isinstance(each, tuple) else each for each in found]
    assert statuses == [0, 1, 4, "crashed", 16, "hung", "failed", 49, "failed"]
    assert "ended with code 9" in found[3][1]
    assert "2 s" in found[5][1]
    assert "ValueError: six" in found[6][1]
    assert "RuntimeError: eight" in found[8][1]
    assert "Traceback" not in capfd.readouterr().err
    tries = {number: len((tmp_path / str(number)).read_text()) for number in range(8)}
    assert tries[3] == most


@pytest.mark.ci
def test_a_script_without_the_main_guard_is_told_of_it(tmp_path: Path) -> None:
    script = tmp_path / "careless.py"
    script.write_text(
        "import antennate\n"
        "antennate.run('tunnel', trials=2, time_limit=0.1, controllers=['open'], workers=2)\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 1
    assert 'needs `if __name__ == "__main__":`' in done.stderr


@pytest.mark.ci
def test_a_program_that_workers_cannot_import_is_told_so(tmp_path: Path) -> None:
    """It has the guard, but came through standard input."""
    program = (
        "import antennate\n"
        "if __name__ == '__main__':\n"
        "    antennate.run('tunnel', trials=2, time_limit=0.1, controllers=['open'], workers=2)\n"
    )
    done = subprocess.run(
        [sys.executable], input=program, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == (
        "antennate.errors.WorkerError: expected a program in a file, which workers import, found "
        "<stdin>; save it, or use one worker"
    )
    assert "Process SpawnProcess" not in done.stderr


@pytest.mark.ci
def test_too_few_open_files_for_workers_are_one_line(tmp_path: Path) -> None:
    """Three are standard; each worker takes some."""

    def few_files() -> None:
        resource.setrlimit(resource.RLIMIT_NOFILE, (14, 14))

    words = ["tunnel", "--trials", "2", "--controllers", "open", "--time-limit", "0.2"]
    done = subprocess.run(
        [sys.executable, "-m", "antennate", *words, "--workers", "2", "--no-figures"],
        cwd=tmp_path,
        preexec_fn=few_files,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert "error: expected to start a worker process, found: Too many open files; use " in line
    assert not list(tmp_path.iterdir())


@pytest.mark.ci
def test_a_worker_that_dies_is_noticed() -> None:
    with pytest.raises(WorkerError, match="ended with code 3"):
        gather(die, [(1,), (2,)], 2, no_step)


def test_there_is_at_least_one_core() -> None:
    assert core_count() >= 1


@pytest.mark.ci
def test_any_executor_can_be_the_engine() -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        workers = Workers(2, make_engine(executor))
        assert gather(halves, [(7, 2), (9, 4)], workers, no_step) == [(3, 1), (2, 1)]
        answer = gather(halves, [(7, 0), (9, 4)], workers, no_step, lost=lost)
        assert answer[0][0] == "failed"
        assert answer[1] == (2, 1)


class Old(Executor):
    """An executor whose workers have another version."""

    def submit(self, fn: Any, /, *arguments: Any, **more: Any) -> Any:
        from concurrent.futures import Future

        part, theirs, added = arguments
        changed = {**theirs, "versions": {**theirs["versions"], "numpy": "1.0"}}
        future: Future[Any] = Future()
        try:
            future.set_result(fn(part, changed, added))
        except WorkerError as error:
            future.set_exception(error)
        return future


def test_workers_of_another_version_are_refused_in_one_line() -> None:
    with pytest.raises(WorkerError, match=r'numpy "1\.0", now') as error:
        gather(halves, [(7, 2)], Workers(2, make_engine(Old())), no_step, lost=lost)
    assert "\n" not in str(error.value)


KILLED = """
from pool_tasks import tell_and_wait
from antennate.studies.pool import gather

if __name__ == "__main__":
    gather(tell_and_wait, [(1,), (2,)], 2, print)
"""


@pytest.mark.ci
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks for processes in /proc")
def test_workers_end_when_the_program_is_killed(tmp_path: Path) -> None:
    (tmp_path / "killed.py").write_text(KILLED)
    path = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    path["PYTHONPATH"] += os.pathsep + os.environ.get("PYTHONPATH", "")
    command = [sys.executable, str(tmp_path / "killed.py")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=path) as program:
        assert program.stderr is not None  # to which workers print
        workers = [int(program.stderr.readline()) for _ in range(2)]
        assert all(Path(f"/proc/{worker}").exists() for worker in workers)
        program.kill()
    limit = time.monotonic() + 60.0
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < limit, "workers go on without their program"
        time.sleep(0.05)
