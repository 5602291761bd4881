"""A calibration that is killed while it writes; S13 is a row of a fault table."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from test_bad_calibrations import GOOD

import antennate
from antennate.antenna.calibration import Calibration
from antennate.studies.run_directory import RunDirectory


@pytest.mark.ci
@pytest.mark.parametrize("kills", [24, pytest.param(500, marks=pytest.mark.slow)])
def test_S13_a_killed_calibration_leaves_the_old_file_or_the_new_one(
    tmp_path: Path, kills: int
) -> None:
    here = Path(__file__).parent
    source = Path(antennate.__file__).resolve().parents[1]
    environment = {
        **os.environ,
        "PYTHONPATH": f"{source}{os.pathsep}{here}",
        "OPENBLAS_NUM_THREADS": "1",
    }
    words = [sys.executable, str(here / "calibration_killed.py"), str(tmp_path / "run")]
    done = subprocess.run(
        [*words, str(kills), "1"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found["left"]) == kills
    assert set(found["left"]) == {"old", "new"}
    assert found["inside"] >= 10
    sys.stdout.write(f"{found['points']} places, old {found['left'].count('old')} times\n")


def test_S13_what_a_killed_program_of_the_same_number_left_is_in_nobodys_way(
    tmp_path: Path,
) -> None:
    """In a container every program may have the same number."""
    (tmp_path / f".calibration.json.{os.getpid()}").write_text("half of a calib")
    GOOD.save(tmp_path / "calibration.json")
    assert Calibration.load(tmp_path / "calibration.json") == GOOD
    with RunDirectory.create("calibrate", tmp_path / "run") as folder:
        folder.write("calibration.json", GOOD.to_json())
    (tmp_path / "run" / f".calibration.json.{os.getpid()}").write_text("half of a calib")
    with RunDirectory.create("calibrate", tmp_path / "run", overwrite=True) as folder:
        folder.write("calibration.json", GOOD.to_json())
    assert Calibration.load(tmp_path / "run" / "calibration.json") == GOOD
