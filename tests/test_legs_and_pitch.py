"""Actuated pitch joints and lifting legs: what our gait does with them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from driven_rig import driven

from antennate.cli import main
from antennate.cli.terminal import BAD_INPUT, OK
from antennate.control.gait import Gait
from antennate.control.registry import BUILT_IN, CONTROLLERS, make_controller
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.params.control import ControlParams, GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.joints import YawParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import make_world, place_at_start
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand, Maneuver
from antennate_lab.gait.experiment import GaitStudyConfig, walk_flat

NODDING = RobotSpec.model_validate({"pitch": {"kind": "actuated"}})
LIFTING = RobotSpec.model_validate({"links": 3, "legs": {"kind": "lifting"}})


PLANAR = [name for name in BUILT_IN if name not in ("geometric", "climb", "lifted", "rhythm")]
"""Controllers of ours for such legs without pitch servos."""


class Lift:
    """Presses all legs down by 0.3 rad and commands the pitch joints, where there are any."""

    pitch = 0.0

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int) -> None:
        self._command = JointCommand(
            yaw=np.zeros((batch, robot.yaw_count)),
            leg=np.full((batch, robot.links, 2), -0.3),
            antenna=np.zeros((batch, 2)),
            pitch=np.full((batch, robot.pitch_count), self.pitch),
        )
        self.maneuver = np.zeros(batch, dtype=int)
        self.contact = np.zeros((batch, 2), dtype=int)
        self.level = np.zeros((batch, 2))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Nothing is remembered."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        """Always the same command."""
        self.maneuver = np.where(np.isnan(frame.t), int(Maneuver.HOLD), int(Maneuver.FORWARD))
        return self._command


def speed(walk: Any) -> float:
    """Speed of the middle of the robot over the last gait cycle [m/s]."""
    last = walk.t >= walk.t[-1] - 1.0 / walk.gait.frequency
    there, here = walk.centre[last][-1], walk.centre[last][0]
    return float(np.linalg.norm(there - here) / np.ptp(walk.t[last]))


def test_actuated_pitch_joints_are_commanded_level_in_every_maneuver() -> None:
    gait = Gait(GaitParams(), NODDING, 3, 0.01)
    for maneuver in Maneuver:
        command = gait.step(np.full(3, int(maneuver)))
        assert command.pitch.shape == (3, 5)
        assert not command.pitch.any()


@pytest.mark.parametrize("maneuver", list(Maneuver))
def test_the_wave_of_the_yaw_joints_is_there_without_the_legs(maneuver: Maneuver) -> None:
    """For lifting legs it is the wave of the same robot with rolling ones, within one limit."""
    lifting = LIFTING.model_copy(update={"yaw": YawParams(limit=0.5)})
    rolling = lifting.model_copy(update={"legs": RobotSpec().legs})
    alone = [Gait(GaitParams(), robot, 2, 0.01, legs=False) for robot in (lifting, rolling)]
    whole = Gait(GaitParams(), rolling, 2, 0.01)
    for _ in range(30):
        wanted = whole.step(np.full(2, int(maneuver)))
        for gait in alone:
            command = gait.step(np.full(2, int(maneuver)))
            assert command.leg.shape == (2, 3, 2)
            assert not command.leg.any()
            np.testing.assert_array_equal(command.yaw, wanted.yaw)
            np.testing.assert_array_equal(command.antenna, wanted.antenna)
    assert wanted.yaw.any()


def test_a_robot_with_actuated_pitch_walks_level_and_as_fast_as_a_locked_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    config = GaitStudyConfig(cycles=2, settling_cycles=1)
    locked = walk_flat(config, "locked", config.gait, Maneuver.FORWARD)
    pitch: list[Floats] = []
    write = SimRobot.write

    def watched(robot: SimRobot, command: JointCommand) -> None:
        pitch.append(robot.world(0).drives()[-NODDING.pitch_count :].copy())
        write(robot, command)

    monkeypatch.setattr(SimRobot, "write", watched)
    config = GaitStudyConfig(cycles=2, settling_cycles=1, robot=NODDING)
    moved = walk_flat(config, "actuated", config.gait, Maneuver.FORWARD)
    angles = np.array(pitch)
    assert angles.shape[1] == 5
    assert np.abs(angles).max() < 0.1  # they give way a little under the legs' load
    assert np.ptp(angles, axis=0).min() > 1e-6  # each one is free to
    assert speed(moved) == pytest.approx(speed(locked), rel=0.1)


@pytest.mark.parametrize("name", PLANAR)
def test_our_controllers_step_with_lifting_legs_and_stand_in_hold(name: str) -> None:
    """A leg is up or down, half of them each; a reading that is missing moves nothing."""
    controller = make_controller(name, robot=LIFTING)
    free = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), 1872.0))
    lift = GaitParams().lift
    seen = [controller.step(free).leg.copy() for _ in range(300)]
    assert {float(angle) for leg in seen for angle in leg.ravel()} == {lift.stance, lift.lifted}
    assert all((leg == lift.lifted).sum() == 3 for leg in seen)
    lost = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), np.nan))
    held = [controller.step(lost).leg.copy() for _ in range(20)]
    np.testing.assert_array_equal(held, [held[0]] * 20)


def test_a_controller_of_ones_own_stands_on_lifting_legs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(CONTROLLERS.added, "lift", Lift)
    words = ["--robot.links", "3", "--robot.legs.kind", "lifting", "--time-limit", "1"]
    words += ["--trials", "2", "--workers", "1", "--no-figures", "--out", str(tmp_path / "run")]
    assert main(["tunnel", "--controllers", "lift", *words]) == OK
    assert "lift 0 of 2" in capsys.readouterr().out
    one = driven(TunnelConfig(robot=LIFTING), "lift", 0, 60)
    assert len(one.walk.commands) == 60  # it was armed, and obeyed
    ticks = round(-0.3 * 4096 / math.tau)
    assert one.walk.goals[-1][2:8] == pytest.approx((2048 + ticks,) * 6, abs=1)


class Nod(Lift):
    """Commands all pitch joints to 0.2 rad."""

    pitch = 0.2


def test_actuated_pitch_joints_move_to_where_they_are_commanded() -> None:
    robot = NODDING.model_copy(update={"link_pitch": 0.1})  # arms at which a servo lifts its share
    scene = FlatScene().draw(robot, np.random.default_rng(0))
    world = make_world(PhysicsParams(), robot, scene)
    place_at_start(world, scene, GaitParams())
    before = world.drives()[-5:].copy()
    nod = Nod(ControlParams(), robot, 1)
    command = nod.step(AntennaFrame(t=np.zeros(1), counts=np.zeros((1, 2))))
    world.command(np.concatenate([getattr(command, n).ravel() for n in robot.command_shapes()]))
    world.step(1000)
    assert before == pytest.approx(np.zeros(5))
    assert (world.drives()[-5:] > 0.04).all()  # the weight of the robot keeps them from 0.2


def test_pitch_joints_get_their_commands_through_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONTROLLERS.added, "nod", Nod)
    one = driven(TunnelConfig(robot=NODDING), "nod", 0, 60)
    assert one.walk.goals[-1][-5:] == pytest.approx((2048 + 130,) * 5, abs=1)


class Broken(Lift):
    """Answers what is no angle."""

    def step(self, frame: AntennaFrame) -> JointCommand:
        """NaN for the first joint."""
        command = super().step(frame)
        command.yaw[:, 0] = np.nan
        return command


def test_a_controller_without_a_valid_trial_ends_the_command_with_exit_code_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(CONTROLLERS.added, "broken", Broken)
    words = ["--trials", "2", "--workers", "1", "--time-limit", "0.2", "--no-figures"]
    out = tmp_path / "run"
    found = main(["tunnel", "--controllers", "broken", "open", *words, "--out", str(out)])
    assert found == BAD_INPUT
    told = capsys.readouterr().out.splitlines()[0]
    assert "open 0 of 2" in told
    assert "broken 0 of 0" not in told
    assert "No trial of broken is valid: controller: expected finite angles in yaw" in told
    assert len((out / "trials.csv").read_text().splitlines()) == 5
    assert (out / "result.json").exists()
