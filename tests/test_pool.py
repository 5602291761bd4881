"""Tasks over processes: all results, whatever the workers, and a clear word when one dies."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from pool_tasks import die, divmod_task

from antennate.errors import WorkerError
from antennate.studies.pool import core_count, run_tasks


@pytest.mark.parametrize("workers", [1, 2])
def test_every_result_arrives_once(workers: int) -> None:
    found: list[int] = []
    run_tasks(divmod_task, [(7, 2), (9, 4), (5, 5)], workers, found.append)
    assert sorted(found) == [0, 1, 1, 1, 2, 3]


def test_a_failing_task_is_named() -> None:
    with pytest.raises(WorkerError, match="ZeroDivisionError"):
        run_tasks(divmod_task, [(1, 0), (2, 0)], 2, lambda result: None)


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


def test_a_worker_that_dies_is_noticed() -> None:
    with pytest.raises(WorkerError, match="ended with code 3"):
        run_tasks(die, [1, 2], 2, lambda result: None)


def test_there_is_at_least_one_core() -> None:
    assert core_count() >= 1


KILLED = """
from pool_tasks import tell_and_wait
from antennate.studies.pool import run_tasks

if __name__ == "__main__":
    run_tasks(tell_and_wait, [1, 2], 2, print)
"""


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks for processes in /proc")
def test_workers_end_when_the_program_is_killed(tmp_path: Path) -> None:
    (tmp_path / "killed.py").write_text(KILLED)
    path = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    command = [sys.executable, str(tmp_path / "killed.py")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=path) as program:
        assert program.stdout is not None
        workers = [int(program.stdout.readline()) for _ in range(2)]
        assert all(Path(f"/proc/{worker}").exists() for worker in workers)
        program.kill()
    limit = time.monotonic() + 60.0
    while any(Path(f"/proc/{worker}").exists() for worker in workers):
        assert time.monotonic() < limit, "workers go on without their program"
        time.sleep(0.05)
