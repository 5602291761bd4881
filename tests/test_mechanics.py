"""Statics against closed forms, the elastica, and the engine."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from beams import uniform_beam
from scipy.optimize import brentq

from antennate.antenna.statics import (
    PROFILES,
    Chain,
    equilibrium,
    shape,
    tip_compliance,
    with_profile,
)
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.sim.bench import Bench, compile_bench
from antennate.types import Floats

ANTENNA, SENSOR = AntennaSpec(), SensorParams()
BARE = AntennaSpec(length=0.1, sensor_stiffness_n_mm_per_deg=0.0)
"""The springs alone on 100 mm, as in the table of facts that the expected stiffnesses come from."""


def chain() -> Chain:
    return Chain.of(ANTENNA)


def loads(count: int, seed: int) -> tuple[Floats, Floats]:
    """Places [m] and loads [N] all around; those that push along stay clear of buckling."""
    rng = np.random.default_rng(seed)
    angle, size = rng.uniform(-np.pi, np.pi, count), rng.uniform(0.002, 0.06, count)
    force = size[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    force *= np.minimum(1.0, 0.02 / np.maximum(-force[:, :1], 1e-9))
    return rng.uniform(0.1, 1.0, count) * ANTENNA.length, force


def test_no_load_no_bend() -> None:
    rest = equilibrium(chain(), np.array([0.1]), np.zeros((1, 2)))
    assert (rest.angles == 0).all()
    assert rest.solved.all()
    assert rest.stable.all()


@pytest.mark.parametrize("load", [0.01, 0.1, 1.0])
def test_one_hinge_balances_the_lever_of_its_load(load: float) -> None:
    one, k, length = Chain(np.array([0.1]), np.array([0.01])), 0.01, 0.1
    rest = equilibrium(one, np.array([length]), np.array([[0.0, load]]))
    expected = brentq(lambda q: k * q - load * length * math.cos(q), 0, math.pi / 2)
    assert rest.angles[0, 0] == pytest.approx(expected, rel=1e-9)


def test_a_follower_keeps_its_lever() -> None:
    one = Chain(np.array([0.1]), np.array([0.01]))
    rest = equilibrium(one, np.array([0.1]), np.array([[0.0, 0.15]]), follower=True)
    assert rest.angles[0, 0] == pytest.approx(1.5, rel=1e-9)
    assert rest.force[0] == pytest.approx([-0.15 * math.sin(1.5), 0.15 * math.cos(1.5)], rel=1e-9)


@pytest.mark.parametrize(
    ("profile", "expected"), [("descending", 0.353), ("stiff", 0.621), ("compliant", 0.206)]
)
def test_tip_stiffness_of_bare_springs_on_100_mm(profile: str, expected: float) -> None:
    bare = with_profile(BARE, profile)
    assert 1 / tip_compliance(Chain.of(bare)) == pytest.approx(expected, rel=6e-3)


def test_a_small_load_gives_what_tip_compliance_says() -> None:
    small = 1e-6
    rest = equilibrium(chain(), np.array([ANTENNA.length]), np.array([[0.0, small]]))
    tip = shape(chain(), rest.angles)[0, -1]
    assert tip[1] / small == pytest.approx(tip_compliance(chain()), rel=1e-6)


def test_fifty_links_are_a_cantilever() -> None:
    length, bending = 0.12, 1e-3
    give = [tip_compliance(uniform_beam(length, bending, n)) for n in (5, 10, 50)]
    error = abs(np.array(give) / (length**3 / (3 * bending)) - 1)
    assert (np.diff(error) < 0).all()
    assert error[-1] < 2e-4


@pytest.mark.parametrize(
    ("load", "sideways", "shortening"),
    [
        pytest.param(1.0, 0.30172, 0.05643, marks=pytest.mark.slow),
        pytest.param(2.0, 0.49346, 0.16064, marks=pytest.mark.slow),
        (10.0, 0.81061, 0.55500),
    ],
)
def test_a_hundred_links_are_the_elastica(load: float, sideways: float, shortening: float) -> None:
    """Tip of a cantilever under P L^2 / E I (Mattiasson 1981, Int. J. Num. Meth. Eng. 17)."""
    beam = uniform_beam(1.0, 1.0, 100)
    angles = equilibrium(beam, np.array([1.0 - 1e-9]) * beam.length, np.array([[0.0, load]])).angles
    tip = shape(beam, angles)[0, -1] + [1.0 / 200, 0.0]
    assert tip[1] == pytest.approx(sideways, abs=2e-3)
    assert 1.0 - tip[0] == pytest.approx(shortening, abs=2e-3)


def test_hinges_carry_the_moment_of_the_load() -> None:
    place, force = loads(50, 1)
    rest = equilibrium(chain(), place, force)
    points = shape(chain(), rest.angles)
    link = ANTENNA.link_length
    for i in range(50):
        n = min(int(place[i] // link), 5)
        ahead = points[i, n + 1] - points[i, n]
        at = points[i, n] + ahead * (place[i] - n * link) / link
        arm = at - points[i, : n + 1]
        moment = arm[:, 0] * force[i, 1] - arm[:, 1] * force[i, 0]
        assert (chain().stiffness * rest.angles)[i, : n + 1] == pytest.approx(moment, abs=1e-10)
        assert (rest.angles[i, n + 1 :] == 0).all()


def test_mirrored_loads_bend_to_the_other_side() -> None:
    place, force = loads(50, 2)
    here = equilibrium(chain(), place, force).angles
    there = equilibrium(chain(), place, force * [1, -1]).angles
    assert there == pytest.approx(-here, abs=1e-12)


def test_a_batch_is_as_many_single_loads() -> None:
    place, force = loads(5, 3)
    batch = equilibrium(chain(), place, force).angles
    for i in range(5):
        single = equilibrium(chain(), place[i : i + 1], force[i : i + 1]).angles
        assert batch[i] == pytest.approx(single[0], abs=1e-9)


@pytest.mark.parametrize("count", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_the_engine_rests_where_statics_says(count: int) -> None:
    """Random loads, largest joint angle within 1 %."""
    place, force = loads(count, 4)
    expected = equilibrium(chain(), place, force)
    assert expected.solved.all()
    calm = ANTENNA.model_copy(
        update={"damping_time": 0.12}
    )  # comes to rest soon, at the same place
    bench = Bench(compile_bench(BenchPhysicsParams(), calm), calm)
    for i in range(count):
        found = _rest(bench, float(place[i]), force[i])
        largest = abs(expected.angles[i]).max()
        assert abs(found - expected.angles[i]).max() <= 0.01 * largest + 1e-5


def _rest(bench: Bench, place: float, force: Floats) -> Floats:
    model, data = bench.model, bench.data
    mujoco.mj_resetData(model, data)
    bench.place(0.0, 0.0, 0.0)
    link = ANTENNA.link_length
    n = min(int(place / link), 5)
    body = model.body(f"antenna/hinge{n}").id
    load = np.array([*force, 0.0])
    for _ in range(3000):
        data.qfrc_applied[:] = 0.0
        point = data.xpos[body] + (place - n * link) * data.xmat[body].reshape(3, 3)[:, 0]
        mujoco.mj_applyFT(model, data, load, np.zeros(3), point, body, data.qfrc_applied)
        bench.step()
    return bench.hinges().copy()


def test_pushing_beyond_buckling_is_called_unstable() -> None:
    along = np.array([[-5.0, 0.0]])
    rest = equilibrium(chain(), np.array([ANTENNA.length]), along)
    assert rest.solved.all()
    assert not rest.stable.any()


def test_all_profiles_keep_to_their_meaning() -> None:
    k = {p: np.array(with_profile(BARE, p).spring_stiffness()) for p in PROFILES}
    assert k["descending"] == pytest.approx(k["ascending"][::-1])
    assert (k["stiff"] >= k["descending"]).all()
    assert (k["descending"] >= k["compliant"]).all()
    give = {p: tip_compliance(Chain.of(with_profile(ANTENNA, p))) for p in PROFILES}
    assert give["matched_uniform"] == pytest.approx(give["descending"], rel=1e-9)
    assert np.ptp(k["matched_uniform"]) == 0


def test_an_unknown_profile_is_refused() -> None:
    with pytest.raises(ValueError, match="expected a profile of stiff, descending"):
        with_profile(ANTENNA, "springy")


@pytest.mark.parametrize("place", [0.0, -0.1, 0.2, float("nan")])
def test_a_load_off_the_chain_is_refused(place: float) -> None:
    with pytest.raises(ValueError, match="expected places above 0"):
        equilibrium(chain(), np.array([place]), np.zeros((1, 2)))
