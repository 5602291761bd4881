"""Batches of MuJoCo Warp beside the CPU engine; on Warp's CPU device, where it is installed."""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from antennate.cli import main
from antennate.control.loop import run_loop
from antennate.control.registry import make_controller
from antennate.errors import ConfigError, MissingPackageError, SceneError
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.experiments.tunnel.warp import run_trials_on_warp
from antennate.params.control import ControlParams
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.registry import make_scene
from antennate.sim.scenes.scene import Route
from antennate.sim.scenes.tunnel import Tunnel
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import draw_scene, draw_trial
from antennate.sim.warp.robot import PaddedTunnels, WarpRobot, is_parked
from antennate.sim.warp.worlds import Limits, require_warp
from antennate.types import AntennaFrame, Floats, JointCommand

CONTROL, PHYSICS = ControlParams(), PhysicsParams()
SHORT = TunnelConfig(time_limit=5.0, tunnel=TunnelParams(segments=(0.3,), turns_deg=(), strewn=0))
ROOM = Limits(rows=240, contacts=60)


@pytest.fixture
def warp() -> Any:
    pytest.importorskip("mujoco_warp", reason="mujoco-warp is not installed: docs/gpu.md")
    return require_warp()


def test_a_missing_package_is_named_with_its_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco_warp", None)
    with pytest.raises(MissingPackageError, match=r"no mujoco-warp.* --extra gpu .*\[gpu\]"):
        require_warp()


def test_warp_of_another_series_than_the_engine_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("mujoco_warp", reason="mujoco-warp is not installed: docs/gpu.md")
    monkeypatch.setattr("antennate.sim.warp.worlds.metadata.version", lambda _: "3.2.1")
    engine = ".".join(mujoco.__version__.split(".")[:2])
    expected = rf"mujoco-warp {engine}, as the engine mujoco is {mujoco.__version__}, found 3\.2\.1"
    with pytest.raises(ConfigError, match=expected):
        require_warp()


def test_tunnels_are_filled_up_to_one_number_of_cylinders() -> None:
    config = TunnelConfig()
    scene = make_scene(config.scene, config.tunnel)
    plain = [draw_scene(config, scene, trial) for trial in range(6)]
    padded = PaddedTunnels(scene, plain)
    for trial, alone in enumerate(plain):
        filled = draw_scene(config, padded, trial)
        assert isinstance(alone, Tunnel)
        assert isinstance(filled, Tunnel)
        drawn = len(alone.cylinders)
        assert len(filled.cylinders) == max(len(each.cylinders) for each in plain)  # type: ignore[attr-defined]
        assert (filled.cylinders[:drawn] == alone.cylinders).all()
        apart = 2 * config.tunnel.cylinder.radius
        for i, where in enumerate(filled.cylinders[drawn:]):
            others = np.delete(filled.cylinders, drawn + i, axis=0)
            assert np.hypot(*(others - where).T).min() > apart, "parked ones touch nothing"
            assert is_parked(where + np.array([[apart, apart], [-apart, -apart]]))
        assert not any(is_parked(where[None]) for where in alone.cylinders)


def test_without_a_gpu_nobody_waits_for_the_slow_device(warp: Any) -> None:
    if warp[0].is_cuda_available():
        pytest.skip("there is a GPU")
    with pytest.raises(ConfigError, match="expected a GPU"):
        run_trials_on_warp(SHORT, "open", [0], lambda _: None, limits=ROOM)


def flat(physics: PhysicsParams = PHYSICS, **robot: Any) -> TunnelConfig:
    spec = RobotSpec.model_validate(robot)
    return TunnelConfig(scene="flat", robot=spec, physics=physics)


class Wall(Route):
    """A flat floor with a wall across the way; also the scene that draws it."""

    random = False

    def __init__(self, ahead: float) -> None:
        super().__init__(np.array([[0.0, 0.0], [2.0, 0.0]]))
        self.ahead = ahead

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Wall:
        return self

    def build(self, spec: mujoco.MjSpec) -> None:
        super().build(spec)
        box = mujoco.mjtGeom.mjGEOM_BOX
        spec.worldbody.add_geom(type=box, pos=[self.ahead, 0, 0.1], size=[0.02, 0.5, 0.1])


def paths(
    body: Any, configs: list[TunnelConfig], seconds: float, walls: list[Wall] | None = None
) -> Floats:
    """Heads on a flat floor at each tick [m], shape (ticks, B, 3)."""
    phases = []
    for row, config in enumerate(configs):
        scene = walls[row] if walls else make_scene(config.scene)
        start = draw_trial(config, scene, row, CONTROL.gait, CONTROL.period)
        body.load(row, start.world, start.chance)
        phases.append(start.phase)
    control = make_controller("open", CONTROL, configs[0].robot, len(configs))
    control.reset(np.arange(len(configs)), np.array(phases))
    heads: list[Floats] = []

    def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
        heads.append(np.array([body.world(row).head for row in range(len(configs))]))
        return len(heads) * CONTROL.period <= seconds

    run_loop(body, control, CONTROL.period, go_on)
    return np.array(heads)


def on_both(
    configs: list[TunnelConfig], seconds: float, walls: list[Wall] | None = None
) -> tuple[Floats, Floats]:
    """Heads on the CPU engine and on Warp."""
    how = (len(configs), configs[0].robot, CONTROL.period, PHYSICS.timestep)
    return (
        paths(SimRobot(*how), configs, seconds, walls),
        paths(WarpRobot(*how, ROOM, "cpu"), configs, seconds, walls),
    )


@pytest.mark.slow
@pytest.mark.parametrize("gear", [{}, {"friction": 0.02, "load_friction": 0.3}])
def test_a_robot_walks_the_path_of_the_cpu_engine(warp: Any, gear: dict[str, float]) -> None:
    """Single precision alone lets paths part; two seconds are a whole step of every leg."""
    cpu, gpu = on_both([flat(servos={"xc430_w240": gear})], 2.0)
    assert np.hypot(*(cpu[-1, 0] - cpu[0, 0])[:2]) > 0.1, "it walked"
    assert np.abs(gpu - cpu).max() < 1e-4


@pytest.mark.slow
def test_an_inertial_sensor_feels_what_it_feels_on_the_cpu_engine(warp: Any) -> None:
    """Its chance is the same; single precision alone tells the worlds apart."""
    config, felt = flat(imu={"kind": "head"}), list[Floats]()
    for body in (
        SimRobot(2, config.robot, CONTROL.period, PHYSICS.timestep),
        WarpRobot(2, config.robot, CONTROL.period, PHYSICS.timestep, ROOM, "cpu"),
    ):
        for row in range(2):
            start = draw_trial(config, make_scene("flat"), row, CONTROL.gait, CONTROL.period)
            body.load(row, start.world, start.chance)
        control = make_controller("open", CONTROL, config.robot, 2)
        control.reset(np.arange(2), np.zeros(2))
        frames: list[Floats] = []

        def go_on(frame: AntennaFrame, command: JointCommand, frames: Any = frames) -> bool:
            frames.append(np.hstack([frame.angular_velocity, frame.linear_acceleration]))
            return len(frames) < 40

        run_loop(body, control, CONTROL.period, go_on)
        felt.append(np.array(frames))
    cpu, gpu = felt
    assert cpu.shape == (40, 2, 6)
    assert cpu[:, :, 2].std() > 0.05, "it turns"
    np.testing.assert_allclose(gpu[:, :, :3], cpu[:, :, :3], atol=0.01)
    np.testing.assert_allclose(gpu[:, :, 3:], cpu[:, :, 3:], atol=0.3)


@pytest.mark.slow
def test_each_world_has_parameters_of_its_own(warp: Any) -> None:
    soft = {"active_coils": (9.0,) * 6, "link_mass": 0.0012}
    cpu, gpu = on_both([flat(), flat(mass=3.0, leg_friction=0.3, antenna=soft)], 0.6)
    assert np.abs(gpu - cpu).max() < 1e-4
    same, _ = on_both([flat(), flat()], 0.6)
    assert np.abs(same[-1, 1] - cpu[-1, 1]).max() > 2e-3, "the parameters matter"


@pytest.mark.slow
def test_delay_backlash_and_unequal_legs_are_those_of_the_cpu_engine(warp: Any) -> None:
    plays = [{"yaw": {"backlash": (0.0, 0.0175, 0.0, play, 0.0)}} for play in (0.01, 0.03)]
    more = {
        "servos": {"xc430_w240": {"delay": 0.013}, "xl330_m288": {"delay": 0.02}},
        "legs": {"friction_factors": (0.5, 1.0) * 6},
    }
    cpu, gpu = on_both([flat(**more, **play) for play in plays], 0.6)
    assert np.abs(gpu - cpu).max() < 1e-4
    prompt, _ = on_both([flat(), flat()], 0.6)
    assert np.abs(prompt[-1] - cpu[-1]).max() > 2e-3, "they matter"


@pytest.mark.slow
def test_each_world_has_walls_of_its_own(warp: Any) -> None:
    near = [Wall(0.6), Wall(0.2)]
    cpu, gpu = on_both([flat(), flat()], 1.0, near)
    free, _ = on_both([flat(), flat()], 1.0)
    assert np.abs(free[-1, 0] - cpu[-1, 0]).max() == 0.0, "the first has not come to its wall"
    assert free[-1, 1, 0] - cpu[-1, 1, 0] > 0.02, "the second is stopped by its own"
    assert np.abs(gpu - cpu).max() < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("other", "found"),
    [
        (flat(links=7), "expected 43 coordinates"),
        (flat(PhysicsParams(timestep=0.001)), r"another opt\.timestep"),
    ],
)
def test_worlds_of_another_structure_are_refused(
    warp: Any, other: TunnelConfig, found: str
) -> None:
    body = WarpRobot(2, flat().robot, CONTROL.period, PHYSICS.timestep, ROOM, "cpu")
    with pytest.raises(SceneError, match=found):
        paths(body, [flat(), other], 0.1)


def rows_of(run: Callable[..., None], *arguments: Any, **more: Any) -> list[TrialResult]:
    rows: list[TrialResult] = []
    run(SHORT, "closed", *arguments, lambda found: rows.append(found[0]), **more)
    return sorted(rows, key=lambda row: row.trial)


@pytest.mark.slow
def test_easy_tunnels_end_as_on_the_cpu_engine(warp: Any) -> None:
    cpu = rows_of(run_trials, range(4))
    gpu = rows_of(run_trials_on_warp, range(4), batch=3, limits=ROOM, device="cpu")
    assert [row.outcome for row in cpu] == ["success"] * 4
    assert [row.outcome for row in gpu] == ["success"] * 4
    for ours, theirs in zip(gpu, cpu, strict=True):
        assert math.isclose(ours.time_s, theirs.time_s, abs_tol=0.101), "one look apart at most"


@pytest.mark.slow
def test_lost_contacts_are_said_and_make_trials_invalid(warp: Any) -> None:
    tight = Limits(rows=20, contacts=60)
    rows = rows_of(run_trials_on_warp, range(2), batch=2, limits=tight, device="cpu")
    assert [row.outcome for row in rows] == ["invalid"] * 2
    assert all("dropped contacts (NEFC): limits of 20 rows" in row.reason for row in rows)


def test_a_study_of_another_experiment_has_no_batches(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    study = tmp_path / "springs.toml"
    study.write_text('experiment = "antenna"\n[vary]\nwire_mm = [0.4, 0.5]\n')
    assert "study of it; antenna has none" in refused(
        "study", str(study), "--engine", "warp", "--out", str(tmp_path / "run")
    )


@pytest.mark.slow
def test_a_study_runs_in_batches_and_goes_on(
    warp: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = tmp_path / "widths.toml", tmp_path / "run"
    study.write_text(
        'experiment = "tunnel"\ntrials = 1\n[vary]\n"tunnel.free_width" = [0.4, 0.5]\n'
        '[settings]\ncontrollers = ["open"]\ntime_limit = 0.3\n'
        "[settings.tunnel]\nsegments = [0.3]\nturns_deg = []\nstrewn = 0\n"
    )
    told = ["study", str(study), "--engine", "warp:cpu", "--out", str(out), "--no-figures"]
    assert main(told) == 0
    with (out / "trials.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["point"], row["status"]) for row in rows] == [("0", "ok"), ("1", "ok")]
    before = (out / "trials.csv").read_bytes()
    assert main(told) == 0
    assert (out / "trials.csv").read_bytes() == before
    assert main([*told[:2], "--out", str(out), "--no-figures"]) == 2, "another engine goes not on"
    capsys.readouterr()
