"""The engine prints its warnings: those of a user's own models, and none in our commands."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

WARNING = "Nan, Inf or huge value in QVEL at DOF 0"
"""What the engine says of such a speed, by its `mju_warningText`."""
LOG = "MUJOCO_LOG.TXT"
OWN_MODEL = """
import math
import mujoco
from antennate import AntennaSpec, attach_antenna, simulate

simulate(time_limit=0.1)
spec = mujoco.MjSpec()
head = spec.worldbody.add_body(name="head")
head.add_freejoint()
head.add_geom(size=[0.02, 0, 0])
attach_antenna(spec, "head", AntennaSpec())
model = spec.compile()
data = mujoco.MjData(model)
data.qvel[0] = math.nan
mujoco.mj_step(model, data)
"""
BREAKS_THE_WORLD = """
import math
from antennate.control.registry import make_controller
from antennate.sim.world import World

sound = World.advance

def broken(self, count):
    self.data.qvel[:] = math.nan
    sound(self, count)

World.advance = broken

def mine(control, robot, rows):
    return make_controller("open", control, robot, rows)
"""


def python(folder: Path, *words: str) -> str:
    """What a Python of its own prints that runs in a folder."""
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, check=False
    )
    return done.stdout + done.stderr


@pytest.mark.ci
def test_a_model_of_ones_own_keeps_its_warnings(tmp_path: Path) -> None:
    assert WARNING in python(tmp_path, "-c", OWN_MODEL)
    assert WARNING in (tmp_path / LOG).read_text()


@pytest.mark.ci
@pytest.mark.parametrize("workers", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_commands_and_their_workers_leave_no_log_of_the_engine(
    tmp_path: Path, workers: str
) -> None:
    (tmp_path / "mine.py").write_text(BREAKS_THE_WORLD)
    words = ("--controllers", "mine.py:mine", "--workers", workers, "--trials", "2", "--no-figures")
    said = python(tmp_path, "-m", "antennate", "tunnel", *words, "--out", "run")
    assert "engine warning" in (tmp_path / "run" / "trials.csv").read_text()
    assert WARNING not in said
    assert not (tmp_path / LOG).exists()


def test_tests_that_break_a_model_in_their_own_process_leave_no_log_either(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.qvel[0] = math.nan
    mujoco.mj_step(model, data)
    assert data.warning[mujoco.mjtWarning.mjWARN_BADQVEL].number == 1
    assert not (tmp_path / LOG).exists()
