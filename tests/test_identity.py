"""The identity of a run: trials of other code are not put beside it."""

from __future__ import annotations

from pathlib import Path

import pytest

import dynamixel_bus
import geometric_locomotion
from antennate.studies.identity import code


@pytest.mark.parametrize(
    ("room", "file"), [(geometric_locomotion, "legged.py"), (dynamixel_bus, "model.py")]
)
def test_the_code_of_a_run_is_that_of_the_distributions_below_too(
    room: object, file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = Path(str(getattr(room, "__file__", ""))).parent
    copy = tmp_path / root.name
    copy.mkdir()
    for path in root.glob("*.py"):
        (copy / path.name).write_bytes(path.read_bytes())
    monkeypatch.setattr(room, "__file__", str(copy / "__init__.py"))
    code.cache_clear()
    before = code()
    (copy / file).write_bytes((copy / file).read_bytes() + b"\n# changed\n")
    code.cache_clear()
    changed = [name for name, sum_ in code().items() if before[name] != sum_]
    code.cache_clear()
    assert changed == [f"{root.name}/{file}"]
