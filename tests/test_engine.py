"""An engine that is another one, or two over one another: one line before anything is simulated."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from antennate.sim.engine_setup import ENGINES, engines

pytestmark = pytest.mark.ci

PACKAGE = Path(__file__).parents[1] / "packages" / "antennate"
PYPROJECT = tomllib.loads((PACKAGE / "pyproject.toml").read_text())
(PIN,) = (each for each in PYPROJECT["project"]["dependencies"] if each.startswith("mujoco"))
TUNNEL = ["tunnel", "--trials", "1", "--time-limit", "1", "--no-figures", "--out", "run"]
BROKEN = "libmujoco.so.3.17.0: cannot open shared object file"


def python(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """A Python of its own that looks for packages in a folder first."""
    found = {**os.environ, "PYTHONPATH": str(folder)}
    command = [sys.executable, *words]
    return subprocess.run(
        command, cwd=folder, env=found, capture_output=True, text=True, timeout=120, check=False
    )


def distribution(folder: Path, version: str, name: str = "mujoco-core") -> None:
    """What pip leaves of an installed package."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")


def both_installed(folder: Path) -> str:
    """Beside the installed engine another version under its other name; what the refusal says."""
    ((name, version),) = engines().items()
    other = next(each for each in ENGINES if each != name)
    distribution(folder, "4.0.9", other)
    installed = {name: version, other: "4.0.9"}
    return "found " + " and ".join(f"{each} {installed[each]}" for each in ENGINES) + ";"


def module(folder: Path, source: str) -> None:
    (folder / "mujoco").mkdir()
    (folder / "mujoco" / "__init__.py").write_text(source)


def refusal(folder: Path, *words: str) -> str:
    """The one line with which a command ends before it has written anything."""
    done = python(folder, "-m", "antennate", *words)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1), done.stderr
    assert not (folder / "run").exists()
    assert f'uninstall mujoco and mujoco-core, then install "{PIN}"' in done.stderr
    return done.stderr


@pytest.mark.parametrize("words", [TUNNEL, [*TUNNEL, "--engine", "warp"], ["gait"]])
def test_two_versions_over_one_another_are_refused(tmp_path: Path, words: list[str]) -> None:
    assert both_installed(tmp_path) in refusal(tmp_path, *words)


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("__version__ = '4.0.0'", "found 4.0.0;"),
        ("__version__ = '3.16.1'", "found 3.16.1;"),
        ("__version__ = '5.0.0'", "found 5.0.0;"),
        ("", "found a folder without an engine;"),
        (f"raise OSError('{BROKEN}')", f"found OSError: {BROKEN};"),
        ("from mujoco import _structs", "found ImportError: cannot import name '_structs'"),
    ],
)
def test_an_engine_that_is_another_one_or_broken_is_refused(
    tmp_path: Path, source: str, found: str
) -> None:
    module(tmp_path, source)
    assert found in refusal(tmp_path, *TUNNEL)


@pytest.mark.parametrize(
    "words", [["tunnel", "--help"], ["twin", "--help-all"], ["log", "view", "-h"]]
)
def test_help_is_printed_beside_two_versions_or_an_old_one(
    tmp_path: Path, words: list[str]
) -> None:
    both_installed(tmp_path)
    # Only in the command itself: the engine's packages start Python processes, and each would
    # start more.
    old = """if True:
        import os
        if os.environ.setdefault("AGED", str(os.getpid())) == str(os.getpid()):
            import mujoco
            mujoco.__version__ = "3.16.0"
    """
    (tmp_path / "sitecustomize.py").write_text(old)
    done = python(tmp_path, "-m", "antennate", *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"usage: antennate {words[0]} ")


def test_python_gets_the_same_line(tmp_path: Path) -> None:
    both_installed(tmp_path)
    source = """if True:
        import antennate
        try:
            antennate.simulate()
        except antennate.BadInputError as error:
            print(error)
    """
    done = python(tmp_path, "-c", source)
    assert done.stderr == ""
    assert done.stdout.startswith(f"expected the engine {PIN.split('>')[0]} ")
    assert done.stdout.count("\n") == 1


def test_both_names_of_one_version_are_one_engine(tmp_path: Path) -> None:
    ((name, version),) = engines().items()
    distribution(tmp_path, version, next(each for each in ENGINES if each != name))
    source = "import antennate; antennate.simulate(time_limit=0.1)"
    done = python(tmp_path, "-c", source)
    assert (done.returncode, done.stderr) == (0, "")


def test_what_needs_no_engine_runs_beside_two(tmp_path: Path) -> None:
    both_installed(tmp_path)
    source = "import antennate; antennate.make_controller('closed'); antennate.RobotSpec()"
    done = python(tmp_path, "-c", source)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_way_to_draw_that_is_missing_is_no_other_engine(tmp_path: Path) -> None:
    module(tmp_path, "raise ModuleNotFoundError('No module named OpenGL', name='OpenGL')")
    done = python(tmp_path, "-c", "import antennate; antennate.simulate()")
    assert done.stderr.splitlines()[-1] == "ModuleNotFoundError: No module named OpenGL"
