"""A calibration is taken as it is, by all that feel; and one for each antenna."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from test_bad_calibrations import GOOD

from antennate.cli import main
from antennate.control.registry import make_controller
from antennate.errors import ConfigError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import DoctorConfig, DriveConfig, RobotFile
from antennate.hardware.safety.channel import Finding
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.params.base import read_file
from antennate.params.control import ControlParams
from antennate.studies.formats import to_toml
from antennate.types import AntennaFrame, Contact

RIGHT = GOOD.model_copy(
    update={
        "sensor_id": "right-1",
        "polarity": 1,
        "slope": 6.0,
        "midpoint": 0.4,
        "counts_low": 2500.0,
        "counts_high": 3000.0,
        "valid_counts": (2500.0, 3000.0),
    }
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    GOOD.save(tmp_path / "left.json")
    RIGHT.save(tmp_path / "right.json")
    path = tmp_path / "robot.toml"
    left, right = tmp_path / "left.json", tmp_path / "right.json"
    path.write_text(f'calibration = "{left}"\ncalibration_right = "{right}"\n')
    return path


def level(counts: float, curve) -> float:
    """The sigmoid as docs/science/calibration.md gives it."""
    x = (counts - curve.counts_low) / (curve.counts_high - curve.counts_low)
    return 1 / (1 + math.exp(-curve.polarity * curve.slope * (x - curve.midpoint)))


def test_each_antenna_has_its_own_level(file: Path) -> None:
    config = read_file(file, RobotFile).part(DriveConfig).calibrated()
    assert (config.sensor_id, config.sensor_id_right) == ("left-1", "right-1")
    control = make_controller("closed", config.control, config.robot)
    for _ in range(20):
        control.step(AntennaFrame(t=np.zeros(1), counts=np.array([[1700.0, 2600.0]])))
    expected = [level(1700.0, GOOD), level(2600.0, RIGHT)]
    assert control.level[0].tolist() == pytest.approx(expected, abs=1e-12)
    for _ in range(20):
        control.step(AntennaFrame(t=np.zeros(1), counts=np.array([[1870.0, 2990.0]])))
    assert control.contact[0].tolist() == [Contact.FREE, Contact.CONTACT]


def test_each_channel_is_judged_by_its_own_range(file: Path) -> None:
    config = read_file(file, RobotFile).part(DoctorConfig).calibrated()
    control = config.control
    quality = SignalQuality(control.conditioning, right=control.conditioning_right)
    for tick in range(20):
        quality.step(0.01 * tick, [1870.0 + tick % 2, 2505.0 + tick % 2], [0, 0])
    assert quality.findings == (Finding.OK, Finding.OK)
    alike = SignalQuality(control.conditioning)
    for tick in range(20):
        alike.step(0.01 * tick, [1870.0 + tick % 2, 2505.0 + tick % 2], [0, 0])
    assert alike.findings[1] is not Finding.OK


def test_the_right_curve_is_kept_in_files_and_equal_curves_change_nothing(tmp_path: Path) -> None:
    control = ControlParams(conditioning_right=RIGHT.curve())
    path = tmp_path / "control.toml"
    path.write_text(to_toml(control))
    assert read_file(path, ControlParams) == control
    one, two = ControlParams(), ControlParams(conditioning=GOOD.conditioning())
    assert one.conditioning_right is None
    same = two.model_copy(update={"conditioning_right": GOOD.curve()})
    chance = np.random.default_rng(0)
    frames = [chance.uniform(1500.0, 1900.0, (1, 2)) for _ in range(300)]
    levels = []
    for params in (two, same):
        control_ = make_controller("paper", params)
        levels.append([])
        for tick, counts in enumerate(frames):
            control_.step(AntennaFrame(t=np.array([0.01 * tick]), counts=counts))
            levels[-1].append(control_.level.tobytes())
    assert levels[0] == levels[1]


def test_one_file_goes_on_serving_both(file: Path) -> None:
    file.write_text(file.read_text().splitlines()[0])
    config = read_file(file, RobotFile).part(DriveConfig).calibrated()
    assert config.control.conditioning_right is None
    assert config.control.conditioning == GOOD.conditioning()


@pytest.mark.parametrize(
    ("line", "reaches"),
    [
        ("", (1.5, 1.8)),
        ("reach = 1.2", (1.2, 1.2)),
        ("reach_right = 1.2", (1.5, 1.2)),
        ("reach = 1.0\nreach_right = 1.2", (1.0, 1.2)),
    ],
)
def test_each_antenna_has_its_own_reach(
    tmp_path: Path, line: str, reaches: tuple[float, float]
) -> None:
    """Bent readings are believed up to so many spans beyond the range, on each side its own."""
    left, right = GOOD.model_copy(update={"reach": 1.5}), RIGHT.model_copy(update={"reach": 1.8})
    words = [line]
    for name, each in (("calibration", left), ("calibration_right", right)):
        each.save(tmp_path / f"{name}.json")
        words.append(f'{name} = "{tmp_path / name}.json"')
    (file := tmp_path / "robot.toml").write_text("\n".join(words))
    config = read_file(file, RobotFile).part(DriveConfig).calibrated()
    curves = config.control.conditioning, config.control.conditioning_right
    for extra, believed in ((-0.1, True), (0.1, False)):
        quality = SignalQuality(curves[0], reaches=config.reaches, right=curves[1])
        bent = (
            1616.0 - (reaches[0] + extra) * (1874.0 - 1616.0),
            3000.0 + (reaches[1] + extra) * (3000.0 - 2500.0),
        )
        for tick in range(20):
            quality.step(0.01 * tick, [counts + tick % 2 for counts in bent], [0, 0])
        assert [finding.usable for finding in quality.findings] == [believed, believed]


def test_the_name_of_a_flex_sensor_without_its_file_is_refused(file: Path) -> None:
    for line in ('sensor_id = "left-1"', 'sensor_id_right = "right-1"'):
        file.write_text(line)
        with pytest.raises(ConfigError, match=r"^sensor_id\w*: expected calibration\w* = FILE"):
            read_file(file, RobotFile).part(DriveConfig).calibrated()
    file.write_text('sensor_id = "0123456789abcdef"')
    read_file(file, RobotFile).part(DriveConfig).calibrated()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("calibration = ", "# "), r"calibration_right: expected calibration = FILE of the left"),
        (("calibration = ", "[control.conditioning]\nslope = 9.0\n# "), "calibration_right"),
        (
            ("calibration = ", 'sensor_id_right = "left-1"\ncalibration = '),
            "expected left-1, found",
        ),
    ],
)
def test_what_contradicts_is_refused(file: Path, change: tuple[str, str], said: str) -> None:
    file.write_text(file.read_text().replace(*change, 1))
    with pytest.raises(ConfigError if "sensor" not in change[1] else Exception, match=said):
        read_file(file, RobotFile).part(DriveConfig).calibrated()


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
