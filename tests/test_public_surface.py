"""`import antennate`: what it gives, that it says what it gives, and that it costs nothing."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

import antennate

ROOT = Path(__file__).parents[1]
API = (ROOT / "docs" / "api.md").read_text()
HEAVY = ("mujoco", "matplotlib", "scipy", "pydantic", "numpy", "rich", "tyro", "pandas", "serial")
ARRAYS = ("Floats", "Ints", "Bools")


def in_fresh_process(code: str) -> str:
    return subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    ).stdout


@pytest.mark.ci
def test_the_import_loads_nothing_heavy() -> None:
    code = "import json, sys, antennate; print(json.dumps(sorted(sys.modules)))"
    loaded = set(json.loads(in_fresh_process(code)))
    assert loaded.isdisjoint(HEAVY)
    assert [name for name in loaded if name.startswith("antennate.")] == []


@pytest.mark.ci
def test_the_import_is_cheaper_than_that_of_numpy() -> None:
    """Side by side in one process and the best of three, so that a busy machine does not matter."""
    code = """if True:
        import time
        start = time.perf_counter(); import antennate; ours = time.perf_counter() - start
        start = time.perf_counter(); import numpy; theirs = time.perf_counter() - start
        print(ours / theirs)"""
    assert min(float(in_fresh_process(code)) for _ in range(3)) < 0.5


@pytest.mark.ci
def test_simple_names_need_no_engine() -> None:
    names = ["AntennaFrame", "TimeSeries", "read_esp32", "spring_stiffness", "equilibrium"]
    code = f"""if True:
        import json, sys, antennate
        for name in {names}: getattr(antennate, name)
        print(json.dumps(sorted(sys.modules)))"""
    loaded = set(json.loads(in_fresh_process(code)))
    assert loaded.isdisjoint({"mujoco", "matplotlib", "scipy", "pandas", "tyro"})


def test_there_are_about_25_names_and_nothing_leaks() -> None:
    assert 15 <= len(antennate.__all__) <= 30
    assert sorted(dir(antennate)) == sorted([*antennate.__all__, "__version__"])
    with pytest.raises(AttributeError, match="no attribute 'anything'"):
        antennate.anything  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue]


def test_type_checkers_see_the_same_names() -> None:
    stub = ast.parse(Path(antennate.__file__ or "").with_suffix(".pyi").read_text())
    seen = {
        (alias.asname, node.module)
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(name or "" for name, _ in seen) == antennate.__all__
    for name, place in seen:
        there = importlib.import_module(place or "")
        assert getattr(there, name or "") is getattr(antennate, name or "")


@pytest.mark.parametrize("name", antennate.__all__)
def test_every_name_says_what_it_is(name: str) -> None:
    thing = getattr(antennate, name)
    assert f"`{name}`" in API
    text = inspect.getdoc(thing) or ""
    assert len(text.split()) >= 4
    members = [thing]
    if inspect.isclass(thing):
        members += [
            member
            for key, member in vars(thing).items()
            if not key.startswith("_")
            and (inspect.isroutine(member) or isinstance(member, property))
        ]
    for member in members:
        documented(member, text)


def documented(member: object, text: str) -> None:
    """Where arrays go in or out, shape and unit are told: in its docstring or that of its class."""
    target = member.fget if isinstance(member, property) else member
    target = inspect.unwrap(getattr(target, "__func__", target))
    hints = str(getattr(target, "__annotations__", {}))
    doc = inspect.getdoc(target) or ""
    if getattr(target, "__module__", "").startswith("antennate"):
        assert doc, target
    if any(array in hints for array in ARRAYS):
        both = doc + text
        assert re.search(r"shape|\(n,\)|\(B", both), target
    if "Floats" in hints:  # whole numbers are members of an enumeration
        both = doc + text
        assert re.search(r"\[(m|s|N|rad|counts|N·m/rad)[\],]|0 to 1|0 straight", both), target
