"""Drives and simulations refuse a gait that the goals of the legs cannot keep up with.

A leg that rolls turns once in a gait cycle: at f [Hz] it needs 2 pi f [rad/s]. Goals of the default
legs move 5.26 rad/s at most, which is 0.837 Hz: a servo of 1.7 N m and 65 rev/min at 11.1 V then
keeps a fifth of its torque at 10.8 V, as 10.8/11.1 - 0.837/(65/60) = 0.200.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from lockstep import BoardPort, LockstepClock

import antennate
from antennate.cli import main
from antennate.control.registry import make_controller
from antennate.errors import BadInputError, ConfigError
from antennate.hardware.config import DriveConfig, TeleopConfig
from antennate.hardware.driving.connect import prepare
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.replay import recorded_controller
from antennate.twin.config import TwinConfig, watched
from antennate.types import Controller

PORTS = ["--esp32", "/no/a", "--bus", "/no/b"]
ALLOWED = "expected at most 0.837 Hz, which robot.legs.fastest of 5.26 rad/s allows, found 1"
OWN = """
from antennate.control.registry import CONTROLLERS, make_controller

def at_one_hertz(control):
    gait = control.gait.model_copy(update={"frequency": 1.0})
    return control.model_copy(update={"gait": gait})

def quick(control, robot, batch):
    return CONTROLLERS.find("NAME")(at_one_hertz(control), robot, batch)

def made(control, robot, batch):
    return make_controller("NAME", at_one_hertz(control), robot, batch)
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
    line = said(capsys, "--controller", "own.py:made")
    assert line.endswith(f"'own.py:made': control.gait.frequency: {ALLOWED}")


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


@pytest.mark.parametrize("name", ["open", "closed"])
def test_a_body_wave_that_goals_of_the_yaw_joints_cannot_keep_up_with_is_refused(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A sine of 0.4 rad at 0.6 Hz moves 2 pi 0.6 * 0.4 = 1.508 rad/s at most."""
    words = ["--controller", name, "--control.gait.amplitude", "0.4", "--robot.yaw.fastest"]
    line = said(capsys, *words, "1.2")
    assert "control.gait.frequency: expected at most 0.477 Hz, which robot.yaw.fastest" in line
    assert line.endswith("of 1.2 rad/s allows, found 0.6")
    assert "/no/" in said(capsys, *words, "1.51")


@pytest.mark.parametrize("command", [DriveConfig, TeleopConfig])
def test_a_session_with_slow_yaw_joints_is_not_prepared(command: type[DriveConfig]) -> None:
    """By keys the gait walks, too."""
    clock = LockstepClock(twin := watched(TwinConfig())[0])
    config = command.model_validate({"robot": {"yaw": {"fastest": 0.5}}})
    with pytest.raises(BadInputError, match=r"which robot\.yaw\.fastest of 0\.5 rad/s allows"):
        prepare(config, BoardPort(twin, clock), clock, clock)


def test_legs_that_do_not_roll_keep_up_with_any_gait() -> None:
    assert RobotSpec.named("hexapod").fastest_gait == float("inf")


@pytest.mark.parametrize("command", [DriveConfig, TeleopConfig])
def test_a_session_at_such_a_pace_is_not_prepared(command: type[DriveConfig]) -> None:
    clock = LockstepClock(twin := watched(TwinConfig())[0])
    config = command.model_validate({"control": {"gait": {"frequency": 0.84}}})
    with pytest.raises(BadInputError, match=r"at most 0\.837 Hz.* found 0\.84$"):
        prepare(config, BoardPort(twin, clock), clock, clock)


# simulations


TRIAL = ["--trials", "1", "--time-limit", "0.1", "--no-figures"]
WALKS = {
    "tunnel": ["--controllers", "open", *TRIAL],
    "climb": ["--heights", "0.05", "--conditions", "level", "--sensing", "0", *TRIAL],
    "gait": ["--cycles", "2", "--sweep-points", "2"],
    "geometry": ["--gaits", "3"],
}


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line of a command that ends with exit code 2 and leaves nothing behind."""
    before = {*Path().iterdir()}
    assert main([*words]) == 2
    assert {*Path().iterdir()} <= before | {Path("__pycache__")}
    return capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize("command", WALKS)
def test_a_simulation_refuses_a_gait_that_is_too_fast(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    flag = "--gait.frequency" if command in ("gait", "geometry") else "--control.gait.frequency"
    line = refused(capsys, command, *WALKS[command], flag, "1")
    assert line == f"antennate {command}: error: {flag[2:]}: {ALLOWED}"


def test_a_data_set_refuses_walks_that_are_too_fast(capsys: pytest.CaptureFixture[str]) -> None:
    """The fastest walk of its usual speeds is 1.1 times as fast as the gait."""
    line = refused(capsys, "dataset", "--gait.frequency", "0.8")
    assert line.endswith(f"{ALLOWED[:-1]}0.88")


def test_a_controller_of_ones_own_is_refused_in_a_simulation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("own.py").write_text(OWN.replace("NAME", "geometric"))
    for word in ("quick", "made"):
        line = refused(capsys, "tunnel", "--controllers", f"own.py:{word}", *TRIAL)
        assert line.endswith(ALLOWED)
    with pytest.raises(BadInputError, match=r"own\.py:quick: expected at most 0\.837 Hz"):
        antennate.simulate("own.py:quick", time_limit=0.1)


def test_robots_with_faster_legs_walk_in_a_simulation() -> None:
    gait = {"gait": {"frequency": 1.0}}
    settings = {"controllers": ["open"], "trials": 1, "time_limit": 0.1, "control": gait}
    faster = antennate.run("tunnel", robot={"legs": {"fastest": 6.29}}, **settings)
    assert faster.rows[0].outcome == "timeout"
    lifting = antennate.run("tunnel", robot={"legs": {"kind": "lifting"}}, **settings)
    assert lifting.rows[0].outcome == "timeout"
    with pytest.raises(BadInputError, match="unloaded speed"):
        antennate.run("tunnel", robot={"legs": {"fastest": 7.0}}, **settings)


@pytest.mark.parametrize("pace", ["x", float("nan")])
def test_a_pace_that_is_no_number_is_refused(pace: object) -> None:
    def odd(control: ControlParams, robot: RobotSpec, batch: int) -> Controller:
        made = make_controller("open", control, robot, batch)
        made.fastest_gait = pace  # type: ignore[attr-defined]
        return made

    with pytest.raises(ConfigError, match="expected fastest_gait in Hz, found"):
        make_controller(odd)


def test_an_environment_refuses_a_gait_that_is_too_fast() -> None:
    pytest.importorskip("gymnasium")
    from antennate.envs.config import EnvConfig

    ours = {"interface": {"action": "gait", "frequency": (0.2, 1.0)}}
    for values, name in [
        ({"control": {"gait": {"frequency": 1.0}}}, r"control\.gait\.frequency"),
        (ours, r"interface\.frequency"),
    ]:
        with pytest.raises(ValueError, match=f"{name}: expected at most 0.837 Hz"):
            EnvConfig.model_validate(values)
        assert EnvConfig.model_validate({**values, "robot": {"legs": {"fastest": 6.29}}})
    assert EnvConfig.model_validate({"interface": {"action": "joints"}})


def test_a_log_of_a_faster_walk_is_still_replayed() -> None:
    """Logs of simulations hold such walks, from before they were refused."""
    gait = {"gait": {"frequency": 1.0}}
    header = Header(controller="closed", params=ControlParams.model_validate(gait))
    assert recorded_controller(header).maneuver.shape == (1,)
