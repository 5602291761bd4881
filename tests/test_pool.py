"""Tasks over processes: all results, whatever the workers, and a clear word when one dies."""

from __future__ import annotations

import subprocess
import sys
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
