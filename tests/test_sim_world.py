"""A world refuses what is not finite and notices in the same step that it broke."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from antennate.errors import SimulationError
from antennate.params.scene import PhysicsParams, TunnelParams
from antennate.robots.spec import RobotSpec
from antennate.sim import world as world_module
from antennate.sim.scenes.tunnel import TunnelScene
from antennate.sim.world import PREFIX, World, compile_world, new_spec


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    plan = TunnelParams(segments=(1.0,), turns_deg=(), strewn=0, mirror="never")
    tunnel = TunnelScene(plan).draw(RobotSpec(), np.random.default_rng(3))
    return compile_world(PhysicsParams(), RobotSpec(), tunnel)


@pytest.fixture
def world(model: mujoco.MjModel) -> World:
    """A world that stands and has run ten sound steps."""
    fresh = World(model, RobotSpec())
    fresh.place(0.3, 0.0, 0.0, np.zeros(5), np.zeros((6, 2)))
    fresh.command(np.zeros(19))
    fresh.step(10)
    return fresh


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("index", "name"), [(0, "yaw1"), (5, "leg_l0"), (16, "leg_r5"), (18, "antenna_r_base")]
)
def test_a_command_that_is_no_number_is_refused_by_name_and_nothing_is_set(
    world: World, index: int, name: str, bad: float
) -> None:
    drive = np.full(19, 0.1)
    drive[index] = bad
    with pytest.raises(SimulationError, match=name) as caught:
        world.command(drive)
    assert caught.value.step == 10
    assert not world.data.ctrl.any()


def test_opposite_infinities_do_not_cancel(world: World) -> None:
    with pytest.raises(SimulationError, match="yaw1"):
        world.command(np.array([math.inf, -math.inf, *[0.0] * 17]))


def test_a_command_of_absurd_size_ends_the_world_with_its_own_error(world: World) -> None:
    with pytest.raises(SimulationError):  # noqa: PT012  refused at once or found by the engine
        world.command(np.full(19, 1e308))
        world.step(1)


@pytest.mark.parametrize("joint", ["root", "yaw3", "leg_l2", "antenna_l_hinge5"])
@pytest.mark.parametrize("state", ["qpos", "qvel"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e15])
def test_a_state_that_broke_is_noticed_in_the_same_call(
    world: World, joint: str, state: str, bad: float
) -> None:
    found = world.model.joint(PREFIX + joint)
    address = found.qposadr[0] if state == "qpos" else found.dofadr[0]
    getattr(world.data, state)[address] = bad
    with pytest.raises(SimulationError) as caught:
        world.step(5)
    assert caught.value.step == 15
    assert "15" in str(caught.value)


@pytest.mark.parametrize("state", ["qpos", "qvel"])
def test_a_cylinder_that_broke_in_its_sleep_is_noticed(world: World, state: str) -> None:
    world.step(500)
    getattr(world.data, state)[0] = math.nan
    with pytest.raises(SimulationError):
        world.step(1)


def test_a_blow_up_is_noticed_every_time(model: mujoco.MjModel) -> None:
    for _ in range(3):
        fresh = World(model, RobotSpec())
        fresh.data.body(PREFIX + "link2").xfrc_applied[2] = 1e14
        with pytest.raises(SimulationError):
            fresh.step(1)


def test_a_broken_world_stays_broken(world: World) -> None:
    world.data.qpos[world.model.joint(PREFIX + "yaw1").qposadr[0]] = math.nan
    for _ in range(3):
        with pytest.raises(SimulationError):
            world.step(1)


@pytest.mark.parametrize("force", [1e4, 1e6])
def test_a_robot_that_leaves_the_floor_is_noticed(world: World, force: float) -> None:
    world.data.body(PREFIX + "link0").xfrc_applied[2] = force
    with pytest.raises(SimulationError):
        world.step(10)


@pytest.mark.parametrize("joint", ["root", "yaw3"])
def test_finite_garbage_is_noticed(world: World, joint: str) -> None:
    world.data.qpos[world.model.joint(PREFIX + joint).qposadr[0]] = 1e9
    with pytest.raises(SimulationError):
        world.step(5)


def test_running_out_of_the_engines_memory_ends_the_world(monkeypatch: pytest.MonkeyPatch) -> None:
    def starved(physics: PhysicsParams) -> mujoco.MjSpec:
        spec = new_spec(physics)
        spec.memory = 60_000
        return spec

    monkeypatch.setattr(world_module, "new_spec", starved)
    world = World(compile_world(PhysicsParams(), RobotSpec()), RobotSpec())
    with pytest.raises(SimulationError):
        world.step(5)


def test_a_sound_world_counts_its_time(world: World) -> None:
    world.step(40)
    assert world.t == pytest.approx(50 * 0.002)


def test_a_robot_is_placed_where_it_is_told(model: mujoco.MjModel) -> None:
    placed = World(model, RobotSpec())
    placed.place(0.4, -0.1, 2.5, np.linspace(-0.2, 0.2, 5), np.arange(12.0).reshape(6, 2))
    assert placed.head[:2].tolist() == [0.4, -0.1]
    assert placed.heading == pytest.approx(2.5)
    assert placed.data.joint(PREFIX + "yaw5").qpos[0] == pytest.approx(0.2)
    assert placed.data.joint(PREFIX + "leg_r2").qpos[0] == pytest.approx(5.0)
    tail = placed.links()[1] - placed.links()[0]
    assert math.atan2(-tail[1], -tail[0]) == pytest.approx(2.5, abs=0.15)  # half of yaw1 and yaw2


def test_a_robot_in_the_clear_feels_no_obstacle_and_one_at_a_cylinder_does(
    model: mujoco.MjModel,
) -> None:
    clear = World(model, RobotSpec())
    clear.place(0.3, 0.0, 0.0, np.zeros(5), np.zeros((6, 2)))
    clear.step(5)
    assert clear.obstacle_force() == 0.0
    pressed = World(model, RobotSpec())
    pressed.place(0.3, 0.08, 0.5, np.zeros(5), np.zeros((6, 2)))
    pressed.step(1)
    assert pressed.obstacle_force() > 0.0


def test_leg_friction_reaches_the_engine() -> None:
    world = World(compile_world(PhysicsParams(), RobotSpec()), RobotSpec())
    world.set_leg_friction(np.linspace(0.1, 1.2, 12))
    assert world.model.geom(PREFIX + "leg_l0").friction[0] == pytest.approx(0.1)
    assert world.model.geom(PREFIX + "leg_r5").friction[0] == pytest.approx(1.2)
