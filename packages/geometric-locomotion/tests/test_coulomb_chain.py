"""Chains on dry ground against closed forms, force balance, invariants and scipy's optimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from geometric_locomotion import lie
from geometric_locomotion.chain import PlanarChain
from geometric_locomotion.friction import coulomb_power, coulomb_twist
from geometric_locomotion.stroke import FourierStroke, displacement, path
from geometric_locomotion.types import Floats


def shapes_and_rates(chain: PlanarChain, count: int, seed: int) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, (count, chain.joints)), rng.normal(size=(count, chain.joints))


@pytest.mark.parametrize("lengths", [(0.5, 0.4), (1.0, 1.0), (0.4, 0.9)])
@pytest.mark.parametrize("rate", [1.0, -0.3])
def test_a_straight_pair_turns_about_points_in_closed_form(
    lengths: tuple[float, float], rate: float
) -> None:
    """Points at rest lie (3a - b)/4 and (3b - a)/4 from the joint: force and moment balance."""
    front, rear = lengths
    rest_front, rest_rear = (3 * front - rear) / 4, (3 * rear - front) / 4
    speed = -rate * rest_front * rest_rear / (rest_front + rest_rear)
    turn = speed / rest_front
    twist = coulomb_twist(PlanarChain(lengths, 2.0), np.zeros(1), np.array([rate]))
    expected = [0.0, -speed + turn * front / 2, turn]
    np.testing.assert_allclose(twist, expected, atol=1e-5 * abs(rate))


@pytest.mark.parametrize(("links", "ratio"), [(2, 1.0), (3, 2.0), (6, 4.0)])
def test_no_twist_dissipates_less(links: int, ratio: float) -> None:
    chain = PlanarChain.equal(links, drag_ratio=ratio)
    shapes, rates = shapes_and_rates(chain, 8, links)
    twists = coulomb_twist(chain, shapes, rates)
    for shape, rate, twist in zip(shapes, rates, twists, strict=True):

        def power(x: Floats, shape: Floats = shape, rate: Floats = rate) -> float:
            return float(coulomb_power(chain, shape, rate, x))

        rival = minimize(power, np.zeros(3), method="Nelder-Mead", options={"fatol": 1e-12})
        assert power(twist) <= rival.fun * (1 + 1e-5)


def test_the_power_is_that_of_points_along_the_links() -> None:
    chain = PlanarChain((0.5, 0.3, 0.8), 3.0)
    shapes, rates = shapes_and_rates(chain, 5, 1)
    twists = np.random.default_rng(2).normal(size=(5, 3))
    motion = np.concatenate([twists, rates], axis=-1)[:, None, :, None]
    slip = (chain.jacobians(shapes) @ motion)[..., 0]
    place = (np.arange(4000) + 0.5) / 4000 - 0.5
    length = np.array(chain.lengths)
    across = slip[..., 1, None] + slip[..., 2, None] * place * length[:, None]
    size = np.hypot(slip[..., 0, None], 3.0 * across)
    expected = (size.mean(axis=-1) * length).sum(axis=-1)
    np.testing.assert_allclose(coulomb_power(chain, shapes, rates, twists), expected, rtol=1e-6)


def test_the_twist_grows_with_the_rate_and_turns_with_its_sign() -> None:
    chain = PlanarChain.equal(5, drag_ratio=3.0)
    shapes, rates = shapes_and_rates(chain, 20, 4)
    twist = coulomb_twist(chain, shapes, rates)
    for factor in (1e-6, 7.0, -1.0):
        np.testing.assert_allclose(
            coulomb_twist(chain, shapes, factor * rates), factor * twist, atol=1e-5 * abs(factor)
        )
    assert (coulomb_twist(chain, shapes, 0 * rates) == 0).all()
    parts = coulomb_twist(chain, shapes, rates[::-1])
    both = coulomb_twist(chain, shapes, rates + rates[::-1])
    assert np.abs(both - twist - parts).max() > 0.01  # no local connection


def test_all_links_agree_and_strokes_back_and_forth_move_nothing() -> None:
    chain = PlanarChain((0.4, 0.3, 0.5), 2.0)
    rng = np.random.default_rng(5)
    way = rng.normal(size=(1, 2))
    back = FourierStroke(np.array([0.3, -0.6]), way, 0 * way)
    moved = displacement(lambda a, b: coulomb_twist(chain, a, b), back, 60)
    np.testing.assert_allclose(moved, 0, atol=1e-5)
    loop = FourierStroke(np.zeros(2), way, rng.normal(size=(1, 2)))
    first = path(lambda a, b: coulomb_twist(chain, a, b), loop, 60)
    last = path(lambda a, b: coulomb_twist(chain, a, b, 2), loop, 60)
    between = lie.se2_pose(*chain.poses(loop(np.linspace(0, 1, 61))[0])[:, 2].T)
    np.testing.assert_allclose(between[0] @ last, first @ between, atol=2e-4)


def test_a_scallop_gets_nowhere_and_three_links_do() -> None:
    pair, three = PlanarChain((0.4, 0.6), 2.0), PlanarChain.equal(3)
    stroke = FourierStroke(np.array([0.3]), np.array([[0.5]]), np.array([[0.9]]))
    moved = displacement(lambda a, b: coulomb_twist(pair, a, b), stroke, 60)
    np.testing.assert_allclose(moved, 0, atol=1e-4)
    loop = FourierStroke(np.zeros(2), np.array([[1.0, 0]]), np.array([[0, 1.0]]))
    moved = displacement(lambda a, b: coulomb_twist(three, a, b), loop, 60)
    assert np.hypot(*moved[:2]) > 0.02
