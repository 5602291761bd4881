"""The identity of a run: trials of other code are not put beside it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import antennate_lab
import dynamixel_bus
import geometric_locomotion
from antennate.experiments import load
from antennate.studies.identity import code, differences, environment, environment_here, identity


@pytest.fixture(autouse=True)
def _files_are_read_again() -> Iterator[None]:
    code.cache_clear()
    yield
    code.cache_clear()


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """Copies of the sources of distributions, which are found in their place; by name."""
    copies = {}
    for room in (antennate_lab, dynamixel_bus, geometric_locomotion):
        root = Path(room.__file__ or "").parent
        copies[room.__name__] = tmp_path / root.name
        for path in root.rglob("*.py"):
            copy = tmp_path / root.name / path.relative_to(root)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(path.read_bytes())
        monkeypatch.setattr(room, "__file__", str(tmp_path / root.name / "__init__.py"))
    return copies


@pytest.mark.parametrize(
    ("command", "room", "file"),
    [
        ("tunnel", "geometric_locomotion", "legged.py"),
        ("tunnel", "dynamixel_bus", "model.py"),
        ("gait", "dynamixel_bus", "model.py"),
        ("gait", "antennate_lab", "gait/physics.py"),
        ("geometry", "antennate_lab", "gait/physics.py"),
    ],
)
def test_the_code_of_a_run_is_that_of_all_distributions_that_it_needs(
    command: str, room: str, file: str, copied: dict[str, Path], tmp_path: Path
) -> None:
    config = load(command).config()
    before, shared = identity(command, config), environment(command, config)
    assert environment_here(shared, tmp_path) == shared
    path = copied[room] / file
    path.write_bytes(path.read_bytes() + b"\n# changed\n")
    code.cache_clear()
    assert differences(before, identity(command, config)) == f"the file {room}/{file} changed"
    here = environment_here(shared, tmp_path)
    assert differences(shared, here) == f"the file {room}/{file} changed"


def test_a_run_that_needs_no_laboratory_is_the_same_whatever_it_holds(
    copied: dict[str, Path],
) -> None:
    config = load("tunnel").config()
    before = identity("tunnel", config)
    (copied["antennate_lab"] / "__init__.py").write_text("# another\n")
    assert identity("tunnel", config) == before
