"""The exported MJCF in a process that knows nothing of this package: it moves to the same bits."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from antennate.cli import main
from antennate.control.gait import Gait
from antennate.errors import ConfigError
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams, VariationParams
from antennate.robots.spec import ROBOTS, RobotSpec
from antennate.sim.export import mjcf
from antennate.sim.export.folder import export_mjcf
from antennate.sim.export.parts import lone_robot
from antennate.sim.scenes.registry import SHIPPED
from antennate.sim.sim_robot import Disturbance, SimRobot
from antennate.sim.trial import TrialConfig, scene_of, still_trial
from antennate.types import Floats, Maneuver, joint_angles

PERIOD, STEPS = 0.01, 500
OWN = """
links = 4
mass = 2.0
[pitch]
kind = "actuated"
[antenna]
active_coils = [3.0, 5.0, 7.0, 9.0]
[antenna.sensor]
active_length = 0.09
[servos.xc430_w240]
friction = 0.02
load_friction = 0.2
"""
"""Servos at the pitch joints, gears that rub under load, another antenna."""
BARE = """
import sys
import mujoco, numpy as np
folder = sys.argv[1]
model = mujoco.MjModel.from_xml_path(folder + "/scene.xml")
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, 0)
mujoco.mj_forward(model, data)
goals, names = np.load(folder + "/goals.npy"), sys.argv[2].split()
servos = [model.actuator(name).id for name in names]
numbers = {model.numeric(i).name: model.numeric(i).data for i in range(model.nnumeric)}
gears = numbers.get("gear_friction", np.zeros(model.nu))
dofs = [int(model.jnt_dofadr[model.actuator(i).trnid[0]]) for i in range(model.nu)]
dry = model.dof_frictionloss.copy()
states = []
for goal in goals:
    data.ctrl[servos] = goal
    for _ in range(round(numbers["control_period"][0] / model.opt.timestep)):
        for i, dof in enumerate(dofs):
            motor = data.actuator_force[i] - model.dof_damping[dof] * data.qvel[dof]
            model.dof_frictionloss[dof] = dry[dof] + gears[i] * abs(motor)
        mujoco.mj_step(model, data)
    states.append(np.concatenate([data.qpos, data.qvel]))
assert not [name for name in sys.modules if name.startswith("antennate")]
np.save(folder + "/states.npy", states)
"""


WALKING = [name for name in ROBOTS if name != "bench"]
"""A bench has no walk to be written."""


def robot_of(name: str, folder: Path) -> str:
    """The name for `--robot`: one that is shipped, or the file of one's own."""
    if name in ROBOTS:
        return name
    (folder / "own.toml").write_text(OWN)
    return str(folder / "own.toml")


def simulated(robot: RobotSpec, scene: str, seed: int, gait: GaitParams) -> tuple[Floats, Floats]:
    """Goals of a walk without chance, and all coordinates and speeds in our own `SimRobot`."""
    config = TrialConfig(scene=scene, seed=seed, robot=robot)
    world, _ = still_trial(config, scene_of(config), gait)
    still = VariationParams(joint_bias=0, slip_log_sd=0)
    body = SimRobot(1, robot, PERIOD, config.physics.timestep)
    body.load(0, world, Disturbance(np.random.default_rng(0), still, robot, PERIOD))
    walker = Gait(gait, robot, 1, PERIOD)
    goals, states = [], []
    ticks = round(STEPS * config.physics.timestep / PERIOD)
    for tick in range(ticks):
        body.read()
        command = walker.step(np.array([int(Maneuver.FORWARD)]))
        goals.append(joint_angles(command, list(robot.command_shapes()))[0])
        body.write(command)
        body.sleep_until((tick + 1) * PERIOD)
        states.append(np.concatenate([world.data.qpos, world.data.qvel]))
    assert not body.failures
    return np.array(goals), np.array(states)


@pytest.mark.ci
@pytest.mark.parametrize(
    ("name", "scene", "seed", "gait"),
    [
        ("scuttle", "tunnel", 3, "swift"),
        *(
            pytest.param("scuttle", scene, seed, "serpenoid", marks=pytest.mark.slow)
            for scene, seed in (("flat", 0), ("corridors", 3), ("wall", 0))
        ),
        ("hexapod", "flat", 0, "b11bl0"),
        ("scuttle3d", "stairs", 2, "serpenoid"),
        ("own", "tunnel", 5, "serpenoid"),
    ],
)
def test_the_file_moves_as_our_robot_does_to_the_bit(
    name: str, scene: str, seed: int, gait: str, tmp_path: Path
) -> None:
    folder, given = tmp_path / "export", robot_of(name, tmp_path)
    words = ["robot", given, "--export", "mjcf", "--out", str(folder), "--gait", gait]
    assert main([*words, "--scene", scene, *(["--seed", str(seed)] if seed else [])]) == 0
    robot = RobotSpec.named(given)
    goals, states = simulated(robot, scene, seed, GaitParams.named(gait))
    np.save(folder / "goals.npy", goals)
    bare = [sys.executable, "-I", "-c", BARE, str(folder), " ".join(robot.joint_names)]
    subprocess.run(bare, check=True, timeout=120)
    there = np.load(folder / "states.npy")
    assert there.tobytes() == states.tobytes()
    assert abs(states[-1] - states[0]).max() > 0.1  # it moved
    result = json.loads((folder / "result.json").read_text())
    assert result["walk_difference_m"] == 0.0
    assert result["model_difference"] == {}
    example = [sys.executable, "-I", str(folder / "walk.py")]
    told = subprocess.run(example, check=True, timeout=120, capture_output=True, text=True).stdout
    assert "largest difference 0.0 m" in told


KEPT = ("tunnel", "uturn", "stairs", "rubble")


@pytest.mark.parametrize(
    "scene",
    [*KEPT, *(pytest.param(name, marks=pytest.mark.slow) for name in SHIPPED if name not in KEPT)],
)
def test_no_number_of_a_shipped_scene_is_rounded(scene: str) -> None:
    result = export_mjcf(RobotSpec(), scene, seed=13).result
    assert result["model_difference"] == {}
    assert result["walk_difference_m"] == 0.0


@pytest.mark.parametrize("name", WALKING)
def test_no_number_of_a_shipped_robot_is_rounded(name: str) -> None:
    spec = lone_robot(PhysicsParams(), RobotSpec.named(name), PERIOD)
    assert mjcf.to_mjcf(spec, "alone").difference == {}


def test_a_digit_that_is_lost_is_noticed() -> None:
    text = str(export_mjcf(RobotSpec()).files["scene.xml"])
    model = mujoco.MjModel.from_xml_string(text)
    assert mjcf.difference(model, mujoco.MjModel.from_xml_string(text)) == {}
    gain = float(model.actuator("yaw1").gainprm[0])
    lost = mujoco.MjModel.from_xml_string(text.replace(repr(gain), f"{gain:.15g}"))
    differs = mjcf.difference(model, lost)
    assert set(differs) == {"actuator_gainprm", "actuator_biasprm"}
    assert 0.0 < differs["actuator_gainprm"] < 1e-14
    wet = mujoco.MjModel.from_xml_string(text.replace("<option ", '<option density="1" '))
    assert mjcf.difference(model, wet) == {"opt.density": 1.0}


def test_the_file_keeps_the_digits_of_the_engine_s_own_writer_as_they_were() -> None:
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(size=[1 / 3, 0, 0])
    before = spec.to_xml() if spec.compile() else ""
    export_mjcf(RobotSpec())
    assert "0.333333 " in before.replace('"', " ")
    assert spec.to_xml() == before


def test_an_engine_without_all_digits_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mjcf.ctypes, "CDLL", lambda path: object())
    with pytest.raises(
        ConfigError, match=r"expected an engine that writes numbers with all digits"
    ):
        export_mjcf(RobotSpec())


@pytest.mark.parametrize("name", [*WALKING, "own"])
def test_names_are_plain_and_sensors_tell_the_state(name: str, tmp_path: Path) -> None:
    robot = RobotSpec.named(robot_of(name, tmp_path))
    files = export_mjcf(robot).files
    for file in ("robot.xml", "scene.xml"):
        model = mujoco.MjModel.from_xml_string(str(files[file]))
        names = model.names.decode().split("\0")
        assert not [each for each in names if "/" in each or " " in each]
        assert {model.actuator(i).name for i in range(model.nu)} == set(robot.joint_names)
        assert model.body_mass.sum() == pytest.approx(robot.mass, abs=1e-9)
        data = mujoco.MjData(model)
        rng = np.random.default_rng(1)
        hinges = {n: float(rng.uniform(-0.4, 0.4)) for n in joints_of(model)}
        for joint, angle in hinges.items():
            data.joint(joint).qpos[0] = angle
        data.joint("root").qpos[:3] = 0.3, -0.2, 0.5
        mujoco.mj_forward(model, data)
        for joint in robot.joint_names:
            assert data.sensor("_".join((joint, "angle"))).data[0] == hinges[joint]
            assert data.sensor("_".join((joint, "torque"))).data[0] == data.actuator(joint).force[0]
        assert data.sensor("head_position").data == pytest.approx([0.3, -0.2, 0.5])
        for prefix in ("antenna_l_", "antenna_r_")[: robot.antenna_count]:
            under = [hinges[f"{prefix}hinge{i}"] for i in range(robot.antenna.sensed_hinges)]
            assert data.sensor(f"{prefix}flex").data[0] == pytest.approx(sum(under), abs=1e-15)


def joints_of(model: mujoco.MjModel) -> list[str]:
    names = [model.joint(i).name for i in range(model.njnt)]
    return [name for name in names if name != "root"]


def test_limits_of_goals_are_told_and_not_enforced() -> None:
    model = mujoco.MjModel.from_xml_string(str(export_mjcf(RobotSpec()).files["robot.xml"]))
    assert not model.actuator_ctrllimited.any()
    limits = dict(zip(RobotSpec().joint_names, RobotSpec().limits, strict=True))
    assert model.actuator("yaw3").ctrlrange == pytest.approx([-limits["yaw3"], limits["yaw3"]])
    assert not model.actuator("leg_l2").ctrlrange.any()  # it turns without end


def test_the_lone_robot_stands_on_the_floor_of_another_world() -> None:
    """A plane with MuJoCo's default collision bits: the legs meet it, no more than the legs."""
    robot = RobotSpec()
    world = mujoco.MjSpec.from_string(
        '<mujoco><option integrator="implicitfast" cone="elliptic"/><worldbody>'
        '<geom name="ground" type="plane" size="5 5 0.1"/></worldbody></mujoco>'
    )
    part = mujoco.MjSpec.from_string(str(export_mjcf(robot).files["robot.xml"]))
    world.attach(part, frame=world.worldbody.add_frame(pos=[1, 2, 0.01]), prefix="mine/")
    model = world.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    assert data.body("mine/link0").xpos[:2] == pytest.approx([1, 2], abs=0.02)
    height = robot.leg_radius + robot.leg_eccentricity
    assert data.body("mine/link3").xpos[2] == pytest.approx(height, abs=2e-3)
    touching = {model.geom(g).name for pair in data.contact.geom for g in pair}
    assert touching == {"ground", *(f"mine/{leg}" for leg in robot.leg_names)}


@pytest.mark.ci
def test_a_scene_of_a_file_takes_its_meshes_along(tmp_path: Path) -> None:
    """A mesh is moved to its centre anew each time it is read; here that rounds otherwise."""
    (tmp_path / "m").mkdir()
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.13 0\nv 0 0 0.17\n"
    (tmp_path / "m" / "t.obj").write_text(f"{corners}f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    scene = tmp_path / "s.xml"
    scene.write_text(
        '<mujoco><compiler meshdir="m"/><default><default class="red"><geom rgba="1 0 0 1"/>'
        '</default></default><asset><mesh name="t" file="t.obj"/></asset><worldbody>'
        '<body name="b/c" pos="0.5 0.4 0.2"><freejoint/><geom type="mesh" mesh="t" class="red"/>'
        '</body><site name="start"/><site name="exit" pos="2 0 0"/></worldbody></mujoco>'
    )
    folder = tmp_path / "export"
    words = ["robot", "--export", "mjcf", "--out", str(folder)]
    assert main([*words, "--scene", str(scene)]) == 0
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    assert model.body("scene_b_c").pos == pytest.approx([0.5, 0.4, 0.2])
    assert model.geom(model.body("scene_b_c").geomadr[0]).rgba == pytest.approx([1, 0, 0, 1])
    result: dict[str, Any] = json.loads((folder / "result.json").read_text())
    assert any(name.endswith(".obj") for name in result["files"])
    assert result["walk_difference_m"] < 1e-9
    assert max(result["model_difference"].values(), default=0.0) < 1e-9
    assert all(name in (folder / "README.txt").read_text() for name in result["model_difference"])


def test_a_folder_with_a_run_is_left_alone_unless_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, words = tmp_path / "export", ["robot", "--export", "urdf", "--out"]
    assert main([*words, str(folder)]) == 0
    before = (folder / "robot.urdf").read_bytes()
    capsys.readouterr()
    assert main([*words, str(folder), "--robot", "hexapod"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "expected a folder without a run" in error
    assert (folder / "robot.urdf").read_bytes() == before
    assert main([*words, str(folder), "--overwrite", "--robot", "hexapod"]) == 0
    assert (tmp_path / "export.old" / "robot.urdf").read_bytes() == before
    assert (folder / "robot.urdf").read_bytes() != before
    own = tmp_path / "mine"
    own.mkdir()
    (own / "README.txt").write_text("mine")
    assert main([*words, str(own)]) == 2
    assert [path.read_text() for path in own.iterdir() if path.name == "README.txt"] == ["mine"]


@pytest.mark.slow
def test_dm_control_reads_it(tmp_path: Path) -> None:
    module = pytest.importorskip("dm_control.mjcf", reason="dm_control is not installed")
    for name, text in export_mjcf(RobotSpec(), "tunnel").files.items():
        (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    for name in ("robot.xml", "scene.xml"):
        root = module.from_path(str(tmp_path / name))
        physics = module.Physics.from_mjcf_model(root)
        assert physics.model.nu == len(RobotSpec().joint_names)
        assert root.find("joint", "yaw1") is not None


MJLAB = """
import sys
import mujoco
from mjlab.entity import Entity, EntityCfg
entity = Entity(EntityCfg(spec_fn=lambda: mujoco.MjSpec.from_file(sys.argv[1])))
assert not entity.is_fixed_base
print(*entity.actuator_names)
"""


@pytest.mark.slow
def test_mjlab_reads_it(tmp_path: Path) -> None:
    """In an environment of its own: mjlab 1.6.0 wants an older engine than ours."""
    python = os.environ.get("MJLAB_PYTHON")
    if not python:
        pytest.skip("MJLAB_PYTHON names no Python with mjlab")
    file = tmp_path / "robot.xml"
    file.write_text(str(export_mjcf(RobotSpec()).files["robot.xml"]))
    words = [python, "-I", "-W", "ignore", "-c", MJLAB, str(file)]
    names = subprocess.run(words, check=True, timeout=300, capture_output=True, text=True).stdout
    assert set(names.split()) == set(RobotSpec().joint_names)
