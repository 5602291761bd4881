"""What `calibrate` writes is taken as it is: by `tunnel --config`, and by a robot's file."""

from __future__ import annotations

from pathlib import Path

import pytest

from antennate.cli import main
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import RobotFile
from antennate.params.base import read_file


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The directory of a small calibration."""
    folder = tmp_path_factory.mktemp("calibrate") / "run"
    words = ["--rig.pushes", "2", "--rig.speeds", "0.1", "0.2", "--no-figures"]
    assert main(["calibrate", *words, "--workers", "1", "--out", str(folder)]) == 0
    return folder


def test_the_tunnel_and_a_robot_take_the_same_curve(run: Path) -> None:
    file = run / "conditioning.toml"
    tunnel, robot = read_file(file, TunnelConfig), read_file(file, RobotFile)
    assert tunnel.control.conditioning == robot.control.conditioning
    assert tunnel.control.conditioning != TunnelConfig().control.conditioning


def test_the_command_walks_with_it(run: Path, tmp_path: Path) -> None:
    words = ["--trials", "1", "--controllers", "closed", "--time-limit", "0.2", "--no-figures"]
    config = ["--config", str(run / "conditioning.toml")]
    assert main(["tunnel", *config, *words, "--out", str(tmp_path / "run")]) == 0
    kept = read_file(tmp_path / "run" / "config.toml", TunnelConfig)
    assert kept.control == read_file(run / "conditioning.toml", TunnelConfig).control
