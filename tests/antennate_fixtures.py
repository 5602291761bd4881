"""What tests share where `antennate` is installed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator

import pytest

from antennate.cli import main
from antennate.lookup import ADDED
from antennate.sim.engine_setup import dropped
from antennate.studies.pool import core_count

EVERY_RUN = "not slow and not ci"
"""Marks of the tests of `uv run pytest`, as `addopts` in pyproject.toml has it."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """A worker for each core, and one more where tests wait for programs that they started."""
    return core_count() + (config.getoption("markexpr") != EVERY_RUN)


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Run a command that is refused: nothing on stdout, one line on stderr, which is returned."""

    def run(*words: object) -> str:
        capsys.readouterr()
        assert main([*map(str, words)]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.endswith("\n")
        assert err.count("\n") == 1, err
        return err

    return run


@pytest.fixture(autouse=True)
def _one_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands that are told no number run in this process; starting others takes a second each."""
    monkeypatch.setattr("antennate.cli.experiment.core_count", lambda: 1)


@pytest.fixture(autouse=True)
def _registries_stay_as_they_are() -> Iterator[None]:
    """What a test adds to a registry, or by a file of its own to the path, is known ever after."""
    before, path = {group: dict(objects) for group, objects in ADDED.items()}, [*sys.path]
    yield
    sys.path[:] = path
    for group, objects in ADDED.items():
        objects.clear()
        objects.update(before.get(group, {}))


@pytest.fixture(autouse=True)
def _the_engine_leaves_no_log() -> Iterator[None]:
    """It writes its warnings to `MUJOCO_LOG.TXT` in the working directory, that of the clone."""
    with dropped():
        yield
