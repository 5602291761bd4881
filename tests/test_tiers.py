"""Tests of every run begin no process, and say so where one does."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TESTS = """\
import multiprocessing, os, subprocess, sys
import pytest

def program():
    subprocess.run([sys.executable, "-c", ""], check=True)

def pool():
    process = multiprocessing.get_context("spawn").Process(target=print)
    process.start()
    process.join()

def fork():
    if not (child := os.fork()):
        os.kill(os.getpid(), 9)
    os.waitpid(child, 0)

@pytest.fixture
def begun():
    program()

@pytest.mark.parametrize("begin", [program, pool, fork])
def test_found(begin):
    begin()

def test_found_in_a_fixture(begun):
    pass

def test_none():
    pass

@pytest.mark.smoke
def test_smoke():
    program()

@pytest.mark.ci
def test_ci():
    program()

@pytest.mark.slow
def test_slow():
    program()
"""


@pytest.mark.ci
def test_a_process_in_a_test_of_every_run_is_refused_unless_it_is_marked(tmp_path: Path) -> None:
    shutil.copy(ROOT / "conftest.py", tmp_path)
    (tmp_path / "tests").mkdir()
    shutil.copy(ROOT / "tests" / "antennate_fixtures.py", tmp_path / "tests")
    (tmp_path / "test_them.py").write_text(TESTS)
    words = [
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        "-m",
        "",
        "-c",
        str(ROOT / "pyproject.toml"),
    ]
    words += ["--rootdir", str(tmp_path), "test_them.py"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words], cwd=tmp_path, capture_output=True, text=True
    )
    failed = re.findall(r"^FAILED \S+::(\S+)", done.stdout, re.M)
    assert failed == [
        "test_found[program]",
        "test_found[pool]",
        "test_found[fork]",
        "test_found_in_a_fixture",
    ], done.stdout
    assert done.stdout.count("\nexpected a test of every run to begin no process, found ") == 4
    assert "4 failed, 4 passed" in done.stdout
