"""Swimming chains against closed forms, invariants, published figures and direct optimisation."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import minimize

from geometric_locomotion import lie
from geometric_locomotion.chain import PlanarChain, purcell
from geometric_locomotion.coordinates import minimum_perturbation, square
from geometric_locomotion.curvature import (
    corrected_integral,
    curvature,
    exterior_derivative,
    gradient,
    velocity_integral,
)
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.maps import CurvatureMap, curvature_map
from geometric_locomotion.optimal import (
    best_stroke,
    distance,
    efficiency,
    effort,
    small_stroke,
)
from geometric_locomotion.stroke import (
    FourierStroke,
    displacement,
    ellipse,
    path,
    polygon,
)
from geometric_locomotion.types import Floats

ARC, ZIGZAG = np.array([1.0, 1.0]) / math.sqrt(2), np.array([1.0, -1.0]) / math.sqrt(2)
PUBLISHED = FourierStroke(
    np.zeros(2),
    np.array([2.018 * ARC, 0 * ARC, 0 * ARC]),
    np.array([-1.353 * ZIGZAG, 0 * ARC, -0.264 * ZIGZAG]),
)
"""Of the largest displacement: `shchf_LowRe_MaxDisplacement` of OSU-LRAM/GeometricSystemPlotter."""
ARM = 1.336
"""Outer over middle link at which the best loop about the straight chain is most efficient."""
PUBLISHED_DISTANCE = 0.1035
"""Body lengths by that stroke."""


def random_stroke(joints: int, seed: int, size: float = 0.6) -> FourierStroke:
    rng = np.random.default_rng(seed)
    return FourierStroke(
        size * rng.normal(size=joints),
        size * rng.normal(size=(2, joints)),
        size * rng.normal(size=(2, joints)),
    )


def slips(chain: PlanarChain, shape: Floats, rate: Floats, places: Floats) -> Floats:
    """Velocities (N, P, 2) along and across at places along each link, by differences of poses."""
    step = 1e-6
    twist = chain.twist(shape, rate)
    ends = []
    for sign in (-1, 1):
        poses = lie.se2_pose(*chain.poses(shape + sign * step * rate).T)
        points = lie.se2_exp(sign * step * twist) @ poses
        local = np.stack([places, 0 * places, 1 + 0 * places])
        ends.append((points @ local)[:, :2])
    turned = lie.se2_pose(*chain.poses(shape).T)[:, :2, :2]
    return np.swapaxes(np.swapaxes(turned, -1, -2) @ (ends[1] - ends[0]) / (2 * step), -1, -2)


@pytest.mark.parametrize("lengths", [(1.0, 1.0, 1.0), (0.5, 1.0, 0.7, 0.2), (0.3, 0.4)])
def test_no_net_force_acts_and_the_metric_is_the_power(lengths: tuple[float, ...]) -> None:
    """Drag of points on the links, whose velocities are differences of their places."""
    chain = PlanarChain(lengths, 2.7)
    rng = np.random.default_rng(3)
    shape, rate = rng.uniform(-1.5, 1.5, (2, chain.joints))
    nodes, weights = np.polynomial.legendre.leggauss(3)
    force, power = np.zeros(3), 0.0
    for link, length in enumerate(lengths):
        velocity = slips(chain, shape, rate, length / 2 * nodes)[link]
        pull = -velocity * np.array([1.0, 2.7]) * (length / 2 * weights)[:, None]
        pose = lie.se2_pose(*chain.poses(shape)[link])
        places = pose @ np.stack([length / 2 * nodes, 0 * nodes, 1 + 0 * nodes])
        pull_first = pose[:2, :2] @ pull.T
        force[:2] += pull_first.sum(axis=1)
        force[2] += (places[0] * pull_first[1] - places[1] * pull_first[0]).sum()
        power -= (velocity * pull).sum()
    np.testing.assert_allclose(force, 0, atol=1e-8)
    assert rate @ chain.metric(shape) @ rate == pytest.approx(power, rel=1e-7)


@pytest.mark.parametrize("ratio", [1.5, 2.0, 3.0, 8.0])
def test_a_small_circle_moves_purcells_swimmer_by_the_closed_form(ratio: float) -> None:
    """X = (ratio - 1) 5/81 pi e^2 l for angles of the size e and links of the length l."""
    size, length = 0.01, 0.7
    chain = PlanarChain((length,) * 3, ratio)
    x, y, turn = displacement(chain.twist, ellipse([size, 0], [0, size]))
    expected = (ratio - 1) * 5 / 81 * math.pi * size**2 * length
    assert x == pytest.approx(expected, rel=1e-3)
    assert abs(y) < 0.02 * expected
    assert turn == pytest.approx(0, abs=1e-12)


def test_the_curvature_at_the_straight_shape_is_the_closed_form() -> None:
    form = -curvature(purcell(3.0, (1.0, 1.0, 1.0)).connection, np.zeros(2))
    assert form[0, 0, 1] == pytest.approx(10 / 81, rel=1e-9)
    np.testing.assert_allclose(form[1:], 0, atol=1e-10)


@pytest.mark.parametrize("links", [2, 3, 5])
def test_drag_alike_in_all_directions_moves_nothing(links: int) -> None:
    """The chain turns, but the place of its centre of drag stays: forces are those of its speed."""
    chain = PlanarChain.equal(links, drag_ratio=1.0)
    stroke = random_stroke(chain.joints, 5)
    poses = path(chain.twist, stroke)
    shape, _ = stroke(np.linspace(0, 1, len(poses)))
    links_at = poses[:, None] @ lie.se2_pose(*np.moveaxis(chain.poses(shape), -1, 0))
    centre = links_at[..., :2, 2].mean(axis=1)
    np.testing.assert_allclose(centre, np.broadcast_to(centre[0], centre.shape), atol=1e-6)


@pytest.mark.parametrize("links", [2, 3, 6])
def test_a_stroke_back_and_forth_moves_nothing(links: int) -> None:
    chain = PlanarChain.equal(links, drag_ratio=3.0)
    centre, way = random_stroke(chain.joints, 6).cosine
    stroke = FourierStroke(centre, way[None], 0 * way[None])
    np.testing.assert_allclose(displacement(chain.twist, stroke), 0, atol=1e-12)


def test_two_links_never_get_anywhere() -> None:
    chain = PlanarChain((0.4, 0.6), 2.0)
    stroke = FourierStroke(np.array([0.3]), np.array([[0.5], [0.2]]), np.array([[0.9], [-0.1]]))
    np.testing.assert_allclose(displacement(chain.twist, stroke), 0, atol=1e-6)


def test_all_links_agree_on_where_the_chain_goes() -> None:
    """Paths of two frames differ by the pose between them, at every time."""
    chain = PlanarChain((0.3, 0.5, 0.2, 0.4), 2.0)
    stroke = random_stroke(3, 7)
    first = path(chain.twist, stroke, 400)
    shape, _ = stroke(np.linspace(0, 1, 401))
    for link in range(1, 4):
        between = lie.se2_pose(*chain.poses(shape)[:, link].T)
        other = path(lambda a, b, link=link: chain.twist(a, b, link), stroke, 400)
        np.testing.assert_allclose(between[0] @ other, first @ between, atol=1e-6)


def test_the_pace_does_not_matter() -> None:
    chain, stroke = purcell(), random_stroke(2, 8)

    def hasty(t: Floats) -> tuple[Floats, Floats]:
        wave = 2 * np.pi * np.asarray(t)
        shape, rate = stroke(t + 0.15 * np.sin(wave))
        return shape, rate * (1 + 0.3 * np.pi * np.cos(wave))[..., None]

    even, uneven = (displacement(chain.twist, s, 600) for s in (stroke, hasty))
    np.testing.assert_allclose(uneven, even, atol=1e-8)
    assert effort(chain, hasty, 600) == pytest.approx(effort(chain, stroke, 600), rel=1e-6)


def test_the_path_converges_with_the_fourth_power_of_the_step() -> None:
    chain = purcell()
    exact = displacement(chain.twist, PUBLISHED, 1280)
    errors = [
        np.abs(displacement(chain.twist, PUBLISHED, steps) - exact).max() for steps in (40, 80)
    ]
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.1)


def test_the_best_square_stroke_is_the_published_one() -> None:
    """The square of +-1.40 rad moves Purcell's swimmer .0782 body lengths; others move it less."""
    distances = {
        angle: distance(purcell(), polygon(angle * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])))
        for angle in (1.3, 1.4, 1.5)
    }
    assert distances[1.4] == pytest.approx(0.0782, rel=1e-3)
    assert max(distances, key=lambda angle: distances[angle]) == 1.4


def test_the_published_stroke_goes_as_far_as_published() -> None:
    assert distance(purcell(), PUBLISHED) == pytest.approx(PUBLISHED_DISTANCE, rel=1e-3)


def test_the_search_finds_the_published_stroke() -> None:
    stroke = best_stroke(purcell(), "distance")
    assert distance(purcell(), stroke) == pytest.approx(PUBLISHED_DISTANCE, rel=0.01)
    assert abs(stroke.cosine[0] @ ZIGZAG) == pytest.approx(1.353, rel=0.02)
    assert abs(stroke.sine[0] @ ARC) == pytest.approx(2.018, rel=0.02)
    assert abs(stroke.cosine[2] @ ZIGZAG) == pytest.approx(0.264, rel=0.05)
    metres = best_stroke(PlanarChain.equal(3, 0.02), "distance")  # the unit of length is free
    np.testing.assert_allclose(metres.cosine, stroke.cosine, atol=1e-3)


@pytest.mark.slow
def test_the_corrected_integral_is_good_in_minimum_perturbation_coordinates_alone() -> None:
    chain = purcell()
    for link in range(3):

        def connection(shape: Floats, link: int = link) -> Floats:
            return chain.connection(shape, link)

        far = math.hypot(*corrected_integral(connection, PUBLISHED)[:2])
        assert far > 1.3 * PUBLISHED_DISTANCE
        frame = minimum_perturbation(connection, square(2.2))
        near = math.hypot(*corrected_integral(frame.change(connection), PUBLISHED)[:2])
        assert near == pytest.approx(PUBLISHED_DISTANCE, rel=0.01)


def test_a_change_of_frame_changes_neither_motion_nor_curvature() -> None:
    """Both are conjugated by the pose of the new frame in the old one."""
    chain = PlanarChain.equal(3, drag_ratio=2.5)
    frame = minimum_perturbation(chain.connection, square(2.0), 5)
    new = frame.change(chain.connection)
    shape = np.array([0.7, -1.1])
    back = lie.se2_adjoint(frame.pose(shape))
    np.testing.assert_allclose(
        back @ curvature(new, shape).reshape(3, 4),
        curvature(chain.connection, shape).reshape(3, 4),
        atol=1e-8,
    )
    stroke = random_stroke(2, 9)
    start = frame.pose(stroke(np.zeros(1))[0][0])
    here = path(lambda a, b: -(new(a) @ b[..., None])[..., 0], stroke, 400)[-1]
    there = path(chain.twist, stroke, 400)[-1]
    np.testing.assert_allclose(start @ here, there @ start, atol=1e-6)


@pytest.mark.parametrize("links", [3, 4, 5])
def test_the_connection_is_smallest_in_the_best_frame(links: int) -> None:
    """It beats every link, and the centre of mass with the mean heading, on fresh shapes."""
    chain = PlanarChain.equal(links)
    rng = np.random.default_rng(11)
    shapes, fresh = rng.uniform(-1, 1, (2, 1500, chain.joints))
    frame = minimum_perturbation(chain.connection, shapes, 4)

    def centred(shape: Floats) -> Floats:
        """Frame at the mean place and heading of the links: A - what its own motion takes away."""

        def place(a: Floats) -> Floats:
            return chain.poses(a).mean(axis=-2)

        pose = lie.se2_pose(*np.moveaxis(place(shape), -1, 0))
        motion = gradient(place, shape)
        motion[..., :2, :] = np.swapaxes(pose[..., :2, :2], -1, -2) @ motion[..., :2, :]
        return lie.se2_adjoint(lie.se2_inverse(pose)) @ chain.connection(shape) - motion

    def size(matrices: Floats) -> float:
        return float((matrices**2).sum(axis=(1, 2)).mean())

    rivals = [size(chain.connection(fresh, link)) for link in range(links)]
    best = size(frame.change(chain.connection)(fresh))
    assert best < 0.5 * min(rivals)
    assert best < 1.001 * size(centred(fresh))


def test_plain_and_corrected_integrals_are_those_of_their_curvatures() -> None:
    """Stokes: around a small loop, of -dA and -DA times the area."""
    chain, size = PlanarChain((0.4, 0.3, 0.5), 2.0), 0.01
    centre = np.array([0.8, -0.5])
    loop = ellipse([size, 0], [0, size], centre)
    for integral, form in (
        (velocity_integral, exterior_derivative),
        (corrected_integral, curvature),
    ):
        expected = -form(chain.connection, centre)[:, 0, 1] * math.pi * size**2
        np.testing.assert_allclose(
            integral(chain.connection, loop), expected, atol=2e-3 * np.abs(expected).max()
        )
    start = lie.se2_pose(*displacement(chain.twist, loop))
    exact = lie.se2_log(start)
    estimate = corrected_integral(chain.connection, loop)
    assert np.abs(estimate - exact).max() < 0.05 * np.abs(exact).max()


@pytest.mark.parametrize(
    "links", [3, 4, 5, 6, *(pytest.param(n, marks=pytest.mark.slow) for n in range(7, 11))]
)
def test_small_strokes_of_least_energy_are_the_ellipse_of_the_largest_eigenvalue(
    links: int,
) -> None:
    """A direct search over two harmonics, from a random start, finds that ellipse."""
    chain = PlanarChain.equal(links)
    small = small_stroke(chain)
    stroke = small.stroke(0.01)
    assert distance(chain, stroke) / effort(chain, stroke) ** 2 == pytest.approx(
        small.economy, rel=1e-3
    )

    root = np.linalg.cholesky(chain.metric(np.zeros(chain.joints)))
    size = np.linalg.norm(root.T @ small.stroke(0.03).cosine[0]) * math.sqrt(2)

    def of_norm_one(x: Floats) -> FourierStroke:
        scaled = size * np.linalg.solve(root.T, (x / np.linalg.norm(x)).reshape(4, -1).T).T
        return FourierStroke(0 * scaled[0], scaled[:2], scaled[2:])

    def cost(x: Floats) -> float:
        """Minus displacement over energy in unit time, at the pace of the stroke itself."""
        one = of_norm_one(x)
        shape, rate = one(np.arange(12) / 12)
        energy = np.einsum("ti,tij,tj->", rate, chain.metric(shape), rate) / 12
        return -displacement(chain.twist, one, 12)[0] / energy

    start = np.random.default_rng(links).normal(size=4 * chain.joints)
    found = minimize(cost, start, method="L-BFGS-B", options={"eps": 1e-6, "ftol": 1e-10})
    assert -found.fun == pytest.approx(small.economy, rel=0.01)
    direct = of_norm_one(found.x)
    plane = root.T @ np.stack([small.first, small.second], axis=1)
    for axis in (direct.cosine[0], direct.sine[0]):
        along = root.T @ axis
        inside = plane @ np.linalg.lstsq(plane, along, rcond=None)[0]
        assert np.linalg.norm(inside) > 0.99 * np.linalg.norm(along)
    for second in (direct.cosine[1], direct.sine[1]):
        assert np.linalg.norm(root.T @ second) < 0.05 * np.linalg.norm(root.T @ direct.cosine[0])


def test_many_links_swim_best_by_a_wave_three_links_long() -> None:
    """It travels from head to tail (1801.04687, version 1: the shortest wave there can be)."""
    chain = PlanarChain.equal(10)
    small = small_stroke(chain)
    assert displacement(chain.twist, small.stroke(0.05))[0] > 0
    steps = np.diff(np.unwrap(np.angle(small.first + 1j * small.second)))
    np.testing.assert_allclose(np.degrees(steps), 120, atol=5)


def test_the_published_efficient_ellipse_is_as_efficient_as_ours() -> None:
    """Half-axes 1.495 and 1.327 rad: of OSU-LRAM/GeometricSystemPlotter, by another search."""
    published = efficiency(purcell(), ellipse(-1.327 * ZIGZAG, 1.495 * ARC))
    best = efficiency(purcell(), best_stroke(purcell(), "efficiency", harmonics=1))
    assert 0.99 * best < published < best


@pytest.fixture(scope="module")
def maps() -> CurvatureMap:
    return curvature_map(purcell(), count=5)


def test_the_farthest_stroke_follows_the_line_of_no_curvature(maps: CurvatureMap) -> None:
    """Beyond it, in good coordinates, the chain would go back."""
    assert maps.forward[2, 2] == pytest.approx(5 / 243, rel=0.02)
    assert maps.middle[2, 2] == pytest.approx(5 / 243, rel=1e-6)
    np.testing.assert_allclose(maps.corrected, maps.exact, rtol=0.03)
    assert maps.corrected_middle[-1] > 1.5 * maps.exact[-1]

    frame = minimum_perturbation(purcell().connection, square(2.2))
    loop = maps.loops["distance"].shape
    values = curvature(frame.change(purcell().connection), loop)[:, 0, 0, 1]
    assert np.abs(values).max() < 0.15 * 5 / 243
    assert np.abs(curvature(purcell().connection, loop)[:, 0, 0, 1]).max() > 0.5 * 5 / 243


@functools.cache
def centred(arm: float) -> float:
    """Efficiency of the best loop about the straight chain, for outer over middle link."""
    chain = purcell(2.0, (arm, 1.0, arm))
    return efficiency(chain, best_stroke(chain, "efficiency"))


def gain(bound: float) -> float:
    """Efficiency of the best zigzag oval over the best loop about the straight chain."""
    chain = purcell(2.0, (ARM, 1.0, ARM))
    oval = best_stroke(chain, "efficiency", bound=bound, centre=1.6, harmonics=4)
    assert abs(oval.centre[0]) > 1
    return efficiency(chain, oval) / centred(ARM)


@pytest.mark.slow
def test_large_strokes_gain_for_slender_links_alone() -> None:
    """Raz and Avron (arXiv 0706.3906) found 1.53 times where links may nearly fold, else none.

    The thicker the links, the farther from folded resistive force theory holds.
    """
    assert gain(2.3) < 1
    assert gain(2.8) < 1.53 < gain(2.9)


def lobe(bound: float) -> Floats:
    """Where a loop about a zigzag takes the straight chain, with the way there and back."""
    chain = purcell(2.0, (ARM, 1.0, ARM))
    stroke = best_stroke(chain, "distance", bound=bound, centre=1.6)
    start = stroke(np.zeros(1))[0][0]

    def way(t: Floats) -> tuple[Floats, Floats]:
        return np.multiply.outer(t, start), np.broadcast_to(start, (len(t), 2))

    there = path(chain.twist, way)[-1]
    moved = there @ path(chain.twist, stroke)[-1] @ lie.se2_inverse(there)
    return lie.se2_log(moved) / chain.length


def test_two_mirrored_lobes_go_farther_the_other_way() -> None:
    """Raz and Avron (arXiv 0706.3906): 1.14 times as far as the best loop about the straight chain.

    A lobe about the opposite zigzag moves as far forward and the opposite way to the side.
    """
    chain = purcell(2.0, (ARM, 1.0, ARM))
    centred = best_stroke(chain, "distance")
    assert displacement(chain.twist, centred)[0] > 0
    least, most = (lobe(bound) for bound in (2.2, 2.4))
    once = distance(chain, centred) / chain.length
    assert -2 * least[0] < 1.14 * once < -2 * most[0]
    np.testing.assert_allclose([least[2], most[2]], 0, atol=1e-4)


@pytest.mark.slow
def test_the_links_are_those_at_which_the_centred_loop_is_best() -> None:
    assert max((1.2, ARM, 1.5), key=centred) == ARM


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PlanarChain((1.0,)), "2 links or more, found 1"),
        (
            lambda: PlanarChain((1.0, 0.0)),
            "each length of a chain: expected finite numbers above 0",
        ),
        (lambda: PlanarChain((1.0, 1.0), math.nan), "drag ratio of a chain: .* above 0, found nan"),
        (lambda: FourierStroke(np.zeros(2), np.zeros((1, 3)), np.zeros((1, 3))), "found"),
        (lambda: best_stroke(PlanarChain((1.0, 2.0, 3.0))), "alike from both ends"),
        (lambda: best_stroke(PlanarChain((1.0, 1.0))), "3 links or more"),
        (lambda: best_stroke(purcell(), bound=1.0, centre=-1.2), "centre -1.2 and the bound 1 rad"),
        (lambda: best_stroke(purcell(), harmonics=0), "1 harmonic or more"),
        (lambda: curvature_map(PlanarChain.equal(4)), "3 links, found 4"),
        (lambda: best_stroke(purcell(), bound=2.6, centre=1.6), "lower the bound"),
        (
            lambda: minimum_perturbation(purcell().connection, square(1.0, 2), 8),
            "more shapes or a lower degree",
        ),
    ],
)
def test_bad_input_is_named(make: Callable[[], object], message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        make()
