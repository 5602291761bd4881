"""Builds that end early: on a full disk, and by Ctrl-C before and while files are written."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("build123d", reason="the extra `build` is not installed")

import trimesh

pytestmark = pytest.mark.ci
ONE = "active_coils = [6]\nlength = 0.025\n"
LARGEST = 200_000
"""Bytes that a file may have: the STEP files of bracket and segment are longer."""


def small_files() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, resource.RLIM_INFINITY))


def build(folder: Path, full: bool = False) -> subprocess.Popen[str]:
    (folder / "one.toml").write_text(ONE)
    return subprocess.Popen(
        [sys.executable, "-m", "antennate", "build", "one.toml", "--out", "out", "--no-figures"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},  # which a small file cuts
        preexec_fn=small_files if full else None,
    )


def files_of(out: Path) -> set[str]:
    """Files, each of which is whole and stands in the list of files."""
    found = {str(file.relative_to(out)) for file in out.rglob("*") if file.is_file()}
    listed = set((out / "files.txt").read_text().splitlines()[1:])
    assert found - {"files.txt"} == listed
    assert tomllib.loads((out / "config.toml").read_text())["what"] == "antenna"
    assert "build one.toml" in (out / "command.txt").read_text()
    for name in found:
        assert not Path(name).name.startswith(".")
        if name.endswith(".stl"):
            mesh: Any = trimesh.load(out / name)
            assert mesh.is_watertight
        if name.endswith(".step"):
            assert (out / name).read_text().rstrip().endswith("END-ISO-10303-21;")
    assert "result.json" not in found
    return found


def test_a_full_disk_is_one_line_and_keeps_what_was_written(tmp_path: Path) -> None:
    process = build(tmp_path, full=True)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 2
    lines = [line for line in err.splitlines() if line and not line.startswith("parts: ")]
    where = "out/step/bracket.step"
    assert lines == [
        f"antennate build: error: {where}: expected to write it, found: File too large"
    ]
    assert "stl/bracket.stl" in files_of(tmp_path / "out")


@pytest.mark.parametrize("when", ["config.toml", "stl/bracket.stl"])
def test_ctrl_c_ends_with_130_and_leaves_whole_files_or_none(tmp_path: Path, when: str) -> None:
    process, out = build(tmp_path), tmp_path / "out"
    end = time.monotonic() + 300.0
    while not (out / when).exists() and process.poll() is None and time.monotonic() < end:
        time.sleep(0.001)
    assert process.poll() is None, process.communicate()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "antennate build: interrupted"
    assert "Traceback" not in err
    if when == "config.toml":
        assert not out.exists()
    else:
        assert when in files_of(out)
