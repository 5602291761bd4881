"""`servo` on the log of a drive before a twin, both as processes, with the words of the page."""

from __future__ import annotations

import math
import subprocess
from pathlib import Path

import numpy as np
import pytest
from stated import STATED
from test_drive_processes import ANTENNATE, twin

import antennate
from antennate.robots.servos import ServosParams, XL330Params
from antennate.telemetry.reader import LogReader

PAGE = Path(__file__).parents[3] / "docs/science/servo.md"
JOINT = "antenna_l_base"
PERIOD = 0.01
TICK = 2 * math.pi / 4096


def documented(command: str) -> list[str]:
    """Words of the first command of the page that is this one, from its name on."""
    lines = PAGE.read_text().replace("\\\n", "").splitlines()
    line = next(row for row in lines if row.startswith(f"uv run antennate {command} "))
    return line.split()[3:]


@pytest.mark.slow
def test_a_log_of_the_twin_is_explained_within_a_tick_and_a_period(tmp_path: Path) -> None:
    """Positions come in whole ticks, and nobody knows goals in time better than one period.

    The bound is half a tick for each of goal and position and what the goal changes in a period.
    The bases of the twin's antennae have no friction.
    """
    run = tmp_path / "run"
    words = [*documented("drive"), "--no-touch-check", "--duration", "10"]
    words += STATED
    words += ["--limits.longest-pause", "5", "--limits.repeats", "100"]  # the machine may be busy
    with twin("flat") as (places, _):
        made = subprocess.run(
            [*ANTENNATE, *words, *places, "--out", str(run)], capture_output=True, check=False
        )
    assert made.returncode == 0, made.stderr[-500:]
    log = run / "drive.mcap"
    with LogReader(log) as reader:
        place = reader.header.robot.joint_names.index(JOINT)
        goals = np.array(
            [tick.angles[place] for tick in reader if tick.state in ("OK", "DEGRADED")]
        )
    bound = TICK + float(abs(np.diff(goals[np.isfinite(goals)])).mean())
    assert bound < math.radians(0.6)
    servos = ServosParams(xl330_m288=XL330Params(friction=0.0, load_friction=0.0))
    found = antennate.run(
        "servo", recording=[str(log)], joint=JOINT, servos=servos, supply=5.0
    ).summary
    assert found["recordings"][0]["torque_share"] > 0.1
    assert found["models"][-1]["error_deg"] < math.degrees(bound)
