"""The bench: what was asked for is what the engine received, and forces balance."""

from __future__ import annotations

import numpy as np
import pytest

from antennate.antenna.statics import Chain, shape
from antennate.errors import SimulationError
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Ball, Bar, Bench, compile_bench

ANTENNA = AntennaSpec()


def bench(*obstacles: Ball | Bar, gravity: tuple[float, float] = (0.0, 0.0)) -> Bench:
    physics = BenchPhysicsParams()
    return Bench(compile_bench(physics, ANTENNA, obstacles, gravity), ANTENNA)


def rest(held: Bench, seconds: float = 1.5) -> None:
    held.step(round(seconds / held.model.opt.timestep))


def test_the_model_holds_the_declared_numbers() -> None:
    model = bench(Ball(1.0, 0.0, 0.1)).model
    assert model.opt.timestep == 5e-4
    assert model.opt.impratio == 10
    assert (model.geom_solref[:, 0] == 1e-3).all()
    stiffness = [model.joint(f"antenna/hinge{i}").stiffness[0] for i in range(6)]
    assert stiffness == pytest.approx(list(Chain.of(ANTENNA).stiffness))
    assert (model.opt.gravity == 0).all()


def test_an_antenna_left_alone_stays_straight() -> None:
    held = bench()
    held.place(0.0, 0.0, 0.0)
    rest(held, 0.2)
    assert abs(held.hinges()).max() < 1e-9
    assert held.tip() == pytest.approx([ANTENNA.length, 0.0], abs=1e-9)
    assert not held.touching()


def test_the_carriage_follows_its_target() -> None:
    held = bench()
    held.place(0.0, 0.0, 0.0)
    speed, period = 0.05, 0.001
    for i in range(1000):
        held.command(0.0, speed * (i + 1) * period, 0.0, speed, 0.0)
        held.step(2)
    assert held.carriage.position == pytest.approx([0.0, 0.05], abs=2e-4)


def test_weight_bends_by_the_sum_of_its_levers() -> None:
    """Small angles: hinge i carries all links beyond it at their middles."""
    held = bench(gravity=(0.0, -1.0))
    held.place(0.0, 0.0, 0.0)
    rest(held)
    link, mass = ANTENNA.link_length, ANTENNA.link_mass
    stiffness = Chain.of(ANTENNA).stiffness
    expected = [
        -sum(mass * 1.0 * (j + 0.5 - i) * link for j in range(i, 6)) / stiffness[i]
        for i in range(6)
    ]
    assert held.hinges() == pytest.approx(expected, rel=5e-3)


def test_springs_balance_the_force_of_a_ball() -> None:
    """The base spring's torque is the moment of the contact force, whatever the engine solved."""
    ball = Ball(0.1, -0.02, 0.01)
    held = bench(ball)
    held.place(0.0, 0.0, 0.0)
    for i in range(1000):
        held.command(0.0, -2e-5 * (i + 1), 0.0, -0.02, 0.0)
        held.step(2)
    held.command(0.0, -0.02, 0.0, 0.0, 0.0)
    rest(held)
    assert held.touching()
    force = held.contact_force()
    assert force[1] > 0
    hinge, middle = held.joints()[0], np.array([ball.x, ball.y])
    to_middle = middle - hinge
    moment = to_middle[0] * force[1] - to_middle[1] * force[0]  # through the middle: no friction
    torque = Chain.of(ANTENNA).stiffness[0] * held.hinges()[0]
    friction_arm = ball.radius * ANTENNA.friction * np.linalg.norm(force)
    assert torque == pytest.approx(moment, abs=friction_arm + 1e-5)
    assert held.hinges()[0] > 0.01


def test_joints_are_where_the_chain_says() -> None:
    held = bench(gravity=(0.0, -3.0))
    held.place(0.1, 0.2, 0.0)
    rest(held)
    angles = held.hinges()[None, :].copy()
    angles[0, 0] += held.base_angle()
    expected = shape(Chain.of(ANTENNA), angles)[0] + held.carriage.position
    assert held.joints() == pytest.approx(expected, abs=1e-6)
    assert held.flex() == pytest.approx(held.hinges()[: ANTENNA.sensed_hinges].sum())


def test_a_bar_stops_what_a_gap_lets_through() -> None:
    bars = (Bar(0.1, -0.05, 0.1, -0.01, 0.003), Bar(0.1, 0.01, 0.1, 0.05, 0.003))
    for y, touches in ((0.0, False), (-0.03, True)):
        held = bench(*bars)
        held.place(-0.05, y, 0.0)
        for i in range(400):
            held.command(-0.05 + 1e-4 * (i + 1), y, 0.1, 0.0, 0.0)
            held.step(2)
        assert held.touching() is touches


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.8])
def test_it_slides_on_the_edge_of_the_friction_cone_and_sticks_inside(friction: float) -> None:
    antenna, physics, period = AntennaSpec(friction=friction), BenchPhysicsParams(), 0.002
    held = Bench(compile_bench(physics, antenna, [Bar(-1.0, 0.08, 1.0, 0.08, 0.01)]), antenna)
    held.place(0.0, 0.0, 0.5)

    def pressed(way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Forces of contact and places of the tip along the bar, in the last half second."""
        seen: list[tuple[float, float, float]] = []

        for (x, y), (u, v) in zip(way, np.gradient(way, period, axis=0), strict=True):
            held.command(x, y, u, v, 0.5)
            for _ in range(round(period / physics.timestep)):
                held.step()
                seen.append((*held.contact_force(), held.tip()[0]))
        last = np.array(seen[-1000:])
        forces = last[:, :2]
        return forces[np.hypot(*forces.T) > 0], last[:, 2]  # it is not on in every step

    def line(x0: float, x1: float, y0: float, y1: float, count: int) -> np.ndarray:
        return np.column_stack([np.linspace(x0, x1, count), np.linspace(y0, y1, count)])

    pressed(line(0.0, 0.0, 0.0, 0.02, 500))
    force, tips = pressed(line(0.0, -0.05, 0.02, 0.02, 2000))
    assert len(force) > 10
    assert abs(np.diff(tips)).min() > 0.5 * 0.05 / 8000
    assert force[:, 0] / -force[:, 1] == pytest.approx(friction, rel=1e-4)
    pressed(line(-0.05, -0.049, 0.02, 0.02, 200))  # unloads the contact along the wall
    force, tips = pressed(line(-0.049, -0.049, 0.02, 0.02, 800))
    assert len(force) > 10
    assert (abs(force[:, 0]) < 0.98 * friction * -force[:, 1]).all()
    assert np.ptp(tips) < 1e-5


def test_a_command_that_is_no_number_ends_the_bench() -> None:
    held = bench()
    held.place(0.0, 0.0, 0.0)
    held.command(float("nan"), 0.0, 0.0, 0.0, 0.0)
    with pytest.raises(SimulationError, match="not finite"):
        held.step()


def test_a_blow_up_ends_the_bench() -> None:
    held = bench()
    held.place(0.0, 0.0, 0.0)
    held.data.qvel[-1] = 1e9
    with pytest.raises(SimulationError):
        held.step(5)
