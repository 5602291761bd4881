"""No command accepts a parameter of the control, or of a servo, that nothing in it reads."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from recorded import act, climb_all, leaves, press, recorded

from antennate.cli import main
from antennate.control.registry import (
    KINDS,
    TELEOP,
    unread,
    unread_by_all,
)
from antennate.experiments import load
from antennate.experiments.study import run as study
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.driving.teleop import KeyController
from antennate.params.climb import HeadingParams
from antennate.params.control import ControlParams
from antennate.params.hardware import TeleopParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.view.pace import Tuning
from antennate_lab.gait.config import GaitStudyConfig

OWN = f"{Path(__file__).parents[1] / 'examples' / 'own_controller.py'}:OwnController"
LIFTING = {"legs": {"kind": "lifting"}}
RISING = {"pitch": {"kind": "actuated"}, "elevation": {"kind": "pair"}}
FEELING = {"imu": {"kind": "head"}}
CLIMBING = ("climb", "lifted", "rhythm", "edges")
SWEEP = {f"gait.antenna_{name}" for name in ("mean", "amplitude", "frequency")}
CARRY = {"climb.carry_gain", "climb.carry_rate"}
LINE = {
    f"climb.{name}"
    for name in (
        *("rise", "ramp", "before", "over", "settle", "amplitude", "amplitude_rate"),
        *("frequency", "ahead"),
    )
}
JAM = {"repetition.window_cycles", "repetition.change"}
"""What finds a jam."""
HEADING = {f"climb.heading.{name}" for name in HeadingParams.model_fields}
NO_EFFECT = {
    "climb": SWEEP,
    "lifted": SWEEP | CARRY | LINE | HEADING,
    "rhythm": SWEEP,
    "edges": SWEEP | CARRY,
}
"""What these fetch and then overwrite or never use: a change of it changes no command."""


def by_keys(control: ControlParams, robot: RobotSpec) -> None:
    """As `act`, with the controller of `teleop`."""
    press(KeyController(control, robot, TeleopParams(), lambda: ["w", "o"], lambda: 0.0), control)


ACTS: dict[str, Callable[[ControlParams, RobotSpec], None]] = {
    **{name: lambda c, r, name=name: act(name, c, r) for name in KINDS},
    TELEOP: by_keys,
    "climb": climb_all,
}


@pytest.mark.ci
@pytest.mark.parametrize(
    "robot", [FEELING, LIFTING], ids=["rolling, with inertial sensor", "lifting"]
)
@pytest.mark.parametrize("trigger", ["repetition", "contact"])
@pytest.mark.parametrize("name", ACTS)
def test_what_a_controller_is_said_not_to_read_is_that(
    name: str, trigger: str, robot: dict[str, Any]
) -> None:
    if name == "geometric" and robot == LIFTING:
        pytest.skip("it refuses lifting legs (test_geometric.py)")
    control = ControlParams.model_validate({"rate": 25.0, "escape": {"trigger": trigger}})
    spec = RobotSpec.model_validate(robot | (RISING if name in CLIMBING else {}))
    with recorded(control) as read:
        ACTS[name](control, spec)
    read -= NO_EFFECT.get(name, set())
    unread = {f"control.{leaf}" for leaf in set(leaves(ControlParams)) - read}
    assert unread == set(unread_by_all([name], control, spec))


@pytest.mark.parametrize(
    ("name", "knows", "fewer", "more"),
    [
        ("closed", "jam", {"search.patience", *JAM}, set()),
        ("geometric", "jam", {"search.patience", *JAM}, set()),
        ("closed-1", "jam", {"escape.trigger", *JAM}, set()),
        ("timed", "jam", {"timed.walk_time"}, set()),
        ("timed", "map", set(), {"escape.return_time"}),
        ("timed", "facing", set(), {"escape.return_time", "escape.lost_time"}),
        ("paper", "jam", set(), set()),
    ],
)
def test_who_is_told_reads_other_parameters(
    name: str, knows: str, fewer: set[str], more: set[str]
) -> None:
    alone, told = (unread(name, ControlParams(), each) for each in ((), (knows,)))
    assert told - alone == fewer
    assert alone - told == more


TURN = "expected a parameter that is read, such as {}control.escape.turn{}offset, found 0.2, but"
WHERE = [
    ("tunnel --controllers closed --control.gait.turn-offset 0.2", "--control.gait.turn-offset: "),
    ("drive --control.gait.turn-offset 0.2", "--control.gait.turn-offset: "),
    ("tunnel --config tunnel.toml", "tunnel.toml: control.gait.turn_offset: "),
    ("study settings.toml", "settings: tunnel: control.gait.turn_offset: "),
    ("study vary.toml", "vary: tunnel: control.gait.turn_offset: "),
    ("study design.toml", "settings: tunnel: control.gait.turn_offset: "),
]


@pytest.mark.parametrize(("words", "place"), WHERE)
def test_what_is_read_in_its_place_is_named_as_it_is_written_there(
    words: str,
    place: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    turn = "control.gait.turn_offset = 0.2\n"
    study = 'experiment = "tunnel"\n'
    closed = 'controllers = ["closed"]\n'
    varied = '"tunnel.free_width" = [0.5]\n'
    for name, text in {
        "tunnel": closed + turn,
        "settings": f"{study}[settings]\n{closed}{turn}[vary]\n{varied}",
        "design": f"{study}plan = 'optuna'\nminimize = ['time_s']\n[vary]\n{varied}"
        f"[settings]\n{closed}{turn}",
        "vary": f'{study}[settings]\n{closed}[vary]\n"control.gait.turn_offset" = [0.2]\n',
    }.items():
        (tmp_path / f"{name}.toml").write_text(text)
    assert main(words.split()) == 2
    flag = place.startswith("--")
    said = place + TURN.format(*(("--", "-") if flag else ("", "_")))
    assert f" error: {said} closed does not read it\n" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("controller", "control", "such"),
    [
        ("closed", {"rule": {"hold_time": 3.0}}, "control.rule.threshold"),
        ("open", {"escape": {"turn_time": 3.0}}, r"control\.gait\.\*"),
        ("paper", {"repetition": {"change": 0.2}}, r"control\.rule\.\*"),
    ],
)
def test_without_the_same_name_the_group_or_the_groups_that_are_read_are_named(
    controller: str, control: dict[str, Any], such: str
) -> None:
    with pytest.raises(
        ValueError, match=rf"that is read, such as .*{such}.*, found .* {controller} "
    ):
        TunnelConfig(controllers=(controller,), control=ControlParams.model_validate(control))


@pytest.mark.parametrize(
    ("controllers", "control", "robot"),
    [
        (["open", "paper"], {"rule": {"hold_time": 3.0}}, {}),
        (["closed", "paper"], {"gait": {"turn_offset": 0.2}}, {}),
        (["closed-1"], {"rule": {"strong": 0.8}, "escape": {"trigger": "contact"}}, {}),
        (["closed"], {"search": {"patience": 4.0}}, {}),
        (["closed"], {"repetition": {"change": 0.1}}, {}),
        (["open", OWN], {"rule": {"strong": 0.8}, "gait": {"lift": {"lag": 1.0}}}, {}),
        (["open"], {"gait": {"lift": {"lag": 1.0}}}, LIFTING),
        (["open"], {"rule": {"hold_time": 2.0}}, {"servos": {"xl430_w250": {"friction": 0.0}}}),
        (["open"], {}, {"servos": {"xl330_m288": {"friction": 0.05}}}),
    ],
)
def test_what_one_of_the_controllers_reads_or_is_the_default_is_taken(
    controllers: list[str], control: dict[str, Any], robot: dict[str, Any]
) -> None:
    values = {"controllers": controllers, "control": control, "robot": robot}
    assert TunnelConfig.model_validate(values)


def test_an_unknown_number_of_a_servo_that_is_not_there_is_refused() -> None:
    told = {"unknown": ["robot.servos.xl430_w250.friction=0.01:0.05"]}
    with pytest.raises(ValueError, match="no joint of the robot has this servo"):
        GaitStudyConfig.model_validate(told)


def test_the_file_of_a_robot_may_hold_what_another_controller_reads(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    file = tmp_path / "robot.toml"
    file.write_text("[control.rule]\nhold_time = 3.0\n[robot.servos.xl430_w250]\nfriction = 0.05\n")
    assert "--esp32: expected a serial port" in refused(
        "drive", "--config", str(file), "--control.gait.frequency", "0.5"
    )
    err = refused("drive", "--config", str(file), "--control.rule.hold-time", "4")
    assert "--control.rule.hold-time: expected a parameter that is read" in err
    assert "found 4.0, but closed does not read it" in err


def test_a_study_varies_assumptions_that_nothing_reads_but_only_those() -> None:
    """`rule.hold_time` is read by none of them: its effect is chance."""
    values: dict[str, Any] = {"plan": "random", "settings": {"controllers": ["open", "closed"]}}
    named = {"control.rule.hold_time": {"low": 1.0, "high": 2.0}}
    left_out = ["robot.link_pitch", "robot.leg_radius", "robot.leg_eccentricity"]
    config = StudyConfig.model_validate(values | {"assumed": 0.1, "leave_out": left_out})
    assert named.keys() < config.axes(load("tunnel").config).keys()
    study.check(config)
    with pytest.raises(ValueError, match=r"vary: .*hold_time: .* open and closed do not read it"):
        study.check(StudyConfig.model_validate(values | {"vary": named}))


@pytest.mark.parametrize(
    ("name", "places"),
    [
        ("open", {}),
        ("paper", {"hold_time": "rule", "turn_offset": "gait"}),
        ("closed", {"turn_offset": "escape"}),
        (OWN, {"hold_time": "rule", "turn_offset": "gait"}),
    ],
)
def test_a_page_changes_only_what_the_controller_reads(name: str, places: dict[str, str]) -> None:
    control = ControlParams()
    tuning = Tuning(name, control, lambda values: KINDS["open"](values, RobotSpec(), 1))
    every = {"threshold": "rule", "averaging_time": "conditioning", **places}
    assert tuning.values.keys() == every.keys()
    for field, group in every.items():
        assert tuning.set(field, 0.25) == f"control.{group}.{field} = 0.25"
