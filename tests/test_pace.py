"""Drives and simulations refuse a gait that the goals of the legs cannot keep up with.

A leg that rolls turns once in a gait cycle: at f [Hz] it needs 2 pi f [rad/s]. Goals of the default
legs move 5.26 rad/s at most, which is 0.837 Hz: a servo of 1.7 N m and 65 rev/min at 11.1 V then
keeps a fifth of its torque at 10.8 V, as 10.8/11.1 - 0.837/(65/60) = 0.200.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from lockstep import BoardPort, LockstepClock

from antennate.cli import main
from antennate.errors import BadInputError
from antennate.hardware.config import DriveConfig, TeleopConfig
from antennate.hardware.driving.connect import prepare
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig, watched

PORTS = ["--esp32", "/no/a", "--bus", "/no/b"]
ALLOWED = "expected at most 0.837 Hz, which robot.legs.fastest of 5.26 rad/s allows, found 1"
OWN = """
from antennate.control.registry import make_controller

def quick(control, robot, batch):
    gait = control.gait.model_copy(update={"frequency": 1.0})
    return make_controller("NAME", control.model_copy(update={"gait": gait}), robot, batch)
"""


def said(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The last line of a drive that ends with exit code 2 and leaves nothing behind."""
    before = {*Path().iterdir()}
    assert main(["drive", *words, *PORTS]) == 2
    assert {*Path().iterdir()} <= before | {Path("__pycache__")}  # of a controller's own file
    return capsys.readouterr().err.splitlines()[-1]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ["open", "timed", "closed", "geometric", "follow"])
def test_a_gait_that_is_too_fast_is_refused(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = said(capsys, "--controller", name, "--control.gait.frequency", "1")
    assert line.endswith(f"control.gait.frequency: {ALLOWED}")


@pytest.mark.parametrize("name", ["closed", "geometric", "follow"])
def test_a_controller_that_sets_its_own_pace_is_refused(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("own.py").write_text(OWN.replace("NAME", name))
    assert said(capsys, "--controller", "own.py:quick").endswith(f"gait of own.py:quick: {ALLOWED}")


def test_a_policy_is_refused_by_the_fastest_gait_that_it_may_choose(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for package in ("onnx", "onnxruntime"):
        pytest.importorskip(package)
    from policy_files import constant, contract

    for high in (1.0, 0.7):
        made = contract(action="gait", frequency=(0.2, high))
        constant(Path(f"{high}.onnx"), (0.5,) * 4, made)
    line = said(capsys, "--controller", "1.0.onnx")
    assert line.endswith(f"gait of 1.0.onnx: {ALLOWED}")
    clock = LockstepClock(twin := watched(TwinConfig())[0])
    by_keys = TeleopConfig(controller="1.0.onnx")  # which then does not walk
    assert prepare(by_keys, BoardPort(twin, clock), clock, clock)
    assert "/no/" in said(capsys, "--controller", "0.7.onnx")
    made = contract(action="joints")
    constant(Path("joints.onnx"), (0.5,) * len(made.actions), made)
    assert "/no/" in said(capsys, "--controller", "joints.onnx")


@pytest.mark.parametrize(
    "words",
    [
        ["--control.gait.frequency", "0.837"],
        ["--control.gait.frequency", "1", "--robot.legs.fastest", "6.29"],
    ],
)
def test_a_gait_that_legs_keep_up_with_goes_on_to_the_ports(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert "/no/" in said(capsys, *words)


def test_legs_that_do_not_roll_keep_up_with_any_gait() -> None:
    assert RobotSpec.named("hexapod").fastest_gait == float("inf")


@pytest.mark.parametrize("command", [DriveConfig, TeleopConfig])
def test_a_session_at_such_a_pace_is_not_prepared(command: type[DriveConfig]) -> None:
    clock = LockstepClock(twin := watched(TwinConfig())[0])
    config = command.model_validate({"control": {"gait": {"frequency": 0.84}}})
    with pytest.raises(BadInputError, match=r"at most 0\.837 Hz.* found 0\.84$"):
        prepare(config, BoardPort(twin, clock), clock, clock)
