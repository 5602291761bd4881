"""What holds for all tests."""

from __future__ import annotations

import atexit
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

pytest_plugins = ["antennate_fixtures"] if find_spec("antennate") else []
"""Those of `tests/`; the distributions below `antennate` are tested without it, too."""

settings.register_profile("any machine", deadline=None)  # how long an example takes says nothing
settings.load_profile("any machine")

# Programs that the tests start inherit what is ignored, and `nohup` or a script that runs the tests
# in the background ignores these: a test that ends a program by them would wait for ever.
for number in (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(
            number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
        )

# Where Python is told to keep no bytecode, as in many containers, each of the programs that the
# tests start compiles all that it imports, which takes seconds. So it is kept here, in a folder
# that is removed at the end.
if os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):
    kept = tempfile.mkdtemp(prefix="bytecode-")
    os.environ["PYTHONPYCACHEPREFIX"] = kept
    atexit.register(shutil.rmtree, kept, ignore_errors=True)


HERE = tempfile.mkdtemp(prefix="tests-")
"""An empty folder to run in, so that no robot.toml that a user left in the clone is read."""
atexit.register(shutil.rmtree, HERE, ignore_errors=True)


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Commands look into the working directory while tests are collected, too."""
    if session.config.getoption("dist") == "no":  # it collects, and starts no workers that do
        os.chdir(HERE)


BEGUN: list[str] = []
"""Processes that the test that runs now has begun."""
_BEGINNINGS = ("subprocess.Popen", "os.fork", "os.forkpty", "os.posix_spawn", "os.system")


def _note_beginning(event: str, args: tuple[Any, ...]) -> None:
    if event in _BEGINNINGS and "glfwGetVersion" not in str(args):  # the first import of mujoco
        BEGUN.append(f"{event}{args[1:2] or args}")


def _noted_start(self: BaseProcess, start: Callable[[Any], None] = BaseProcess.start) -> None:
    BEGUN.append(f"multiprocessing {self.name}")
    start(self)


sys.addaudithook(_note_beginning)
BaseProcess.start = _noted_start  # type: ignore[method-assign]  # its spawn tells no audit hook


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup() -> None:
    """No process has begun."""
    BEGUN.clear()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Refuse a test of every run that begins a process, in its fixtures or by itself."""
    yield
    if BEGUN and not any(map(item.get_closest_marker, ("ci", "slow", "smoke"))):
        pytest.fail(
            f"expected a test of every run to begin no process, found {BEGUN[0]}; "
            "mark it with @pytest.mark.ci, and `.ci/run` runs it",
            pytrace=False,
        )


@pytest.fixture(autouse=True)
def _signals_stay_as_they_are() -> Iterator[None]:
    """A program that was asked to end ignores what asks again; here others begin after it."""
    asks = (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTERM)
    before = {number: signal.getsignal(number) for number in asks}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder, which is the working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


OPTIONAL = {
    "tests/test_design.py": "optuna",
    "tests/test_design_measures.py": "optuna",
    "tests/test_design_resume.py": "optuna",
    "tests/test_envs.py": "gymnasium",
    "tests/test_foxglove.py": "foxglove",
    "tests/test_pages.py": "websockets",
    "tests/test_policies.py": "onnx",
    "tests/test_ros.py": "cyclonedds",
    "tests/test_training.py": "gymnasium",
    "tests/test_view.py": "viser",
    "tests/test_view_charts.py": "viser",
    "tests/test_view_end.py": "viser",
    "tests/test_view_gate.py": "viser",
    "tests/test_view_program.py": "viser",
}
"""What tests of optional parts need: `uv run --group optional pytest` installs it."""
collect_ignore = [name for name, package in OPTIONAL.items() if find_spec(package) is None]


def pytest_report_header() -> str:
    """Say what is left out."""
    left = [f"{name} ({OPTIONAL[name]} is not installed)" for name in collect_ignore]
    return f"left out: {', '.join(left)}" if left else "nothing is left out"


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--pictures`: tests that look at a page also make the pictures of the docs."""
    parser.addoption("--pictures", action="store_true", help="make docs/images/view-*.webp anew")
