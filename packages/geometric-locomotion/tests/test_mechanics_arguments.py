"""Every public name of the mechanics refuses bad arguments by a line with the argument's name."""

from __future__ import annotations

import importlib
import inspect
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import geometric_locomotion
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
from geometric_locomotion.friction import coulomb_power, coulomb_twist
from geometric_locomotion.maps import curvature_map
from geometric_locomotion.optimal import best_stroke, distance, efficiency, effort, small_stroke
from geometric_locomotion.stroke import FourierStroke, displacement, ellipse, path, polygon
from geometric_locomotion.twist import TwistMap

CHAIN, LOOP = purcell(), ellipse([0.3, 0.0], [0.0, 0.3])
A, V, NAN = CHAIN.connection, CHAIN.twist, math.nan
GRID = square(1.0, 8)
TABLE = {
    "amplitude": np.array([0.0, 0.1]),
    "offset": np.array([0.0, 0.2, 0.4]),
    "lead": np.zeros(2),
    "wave_number": 1.0,
    "speed": np.ones((2, 3)),
    "curvature": np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]]),
}
MAP = TwistMap(**TABLE)


def vectors(name: str, act: Any, *shape: int) -> list[tuple[str, str, Any]]:
    """Rows of the table for one argument of such a shape."""
    bad = [np.full(shape, NAN), np.full(shape, math.inf), np.zeros((*shape[:-1], shape[-1] + 1))]
    bad += [[[1.0], [1.0, 2.0]], None, "words", np.full(shape, "1")]
    return [(f"{act.__name__} {i}", name, lambda x=x: act(x)) for i, x in enumerate(bad)]


def named(name: str, function: Any) -> Any:
    """A function of one argument, with a name for the table."""
    function.__name__ = name
    return function


ROWS = [
    *(row for act in (lie.se2_exp,) for row in vectors("twist", act, 3)),
    *(row for act in (lie.se2_log, lie.se2_inverse) for row in vectors("pose", act, 3, 3)),
    *vectors("pose", lie.se2_adjoint, 3, 3),
    *vectors("vector", lie.hat, 3),
    *vectors("rotation", lie.so3_exp, 3),
    *vectors("matrix", lie.so3_log, 3, 3),
    *vectors("twist", lie.se3_exp, 6),
    *(
        row
        for act in (lie.se3_log, lie.se3_inverse, lie.se3_adjoint)
        for row in vectors("pose", act, 4, 4)
    ),
    *vectors("a", named("se2_bracket", lambda x: lie.se2_bracket(x, np.zeros(3))), 3),
    *(
        row
        for act in (CHAIN.poses, CHAIN.jacobians, CHAIN.resistance, CHAIN.connection, CHAIN.metric)
        for row in vectors("shape", act, 2)
    ),
    *vectors("rate", named("twist", lambda x: V(np.zeros(2), x)), 2),
    *vectors("rate", named("coulomb_twist", lambda x: coulomb_twist(CHAIN, np.zeros(2), x)), 2),
    *vectors(
        "twist", named("power", lambda x: coulomb_power(CHAIN, np.zeros(2), np.ones(2), x)), 3
    ),
    *vectors("centre", named("stroke", lambda x: FourierStroke(x, *[np.ones((1, 2))] * 2)), 2)[:2],
    *vectors("corners", polygon, 4, 2)[:2],
    *vectors("shapes", named("minimum", lambda x: minimum_perturbation(A, x, 1)), 9, 2)[:2],
    ("pose", "x, y and heading", lambda: lie.se2_pose(np.zeros(2), np.zeros(3), 0.0)),
    ("pose nan", "heading", lambda: lie.se2_pose(0.0, 0.0, NAN)),
    ("bracket", "a and b", lambda: lie.se2_bracket(np.zeros((2, 3)), np.zeros((5, 3)))),
    ("one link", "a chain needs 2", lambda: PlanarChain((1.0,))),
    ("negative length", "each length", lambda: PlanarChain((1.0, -1.0))),
    ("no length", "each length", lambda: PlanarChain((1.0, NAN))),
    ("a word", "each length", lambda: PlanarChain(("a", "b"))),  # pyright: ignore[reportArgumentType]
    ("ratio", "the drag ratio", lambda: PlanarChain((1.0, 1.0), 0.0)),
    ("no links", "links", lambda: PlanarChain.equal(1)),
    ("half links", "links", lambda: PlanarChain.equal(2.5)),  # pyright: ignore[reportArgumentType]
    ("length", "length", lambda: PlanarChain.equal(3, -1.0)),
    ("link", "link", lambda: A(np.zeros(2), 3)),
    ("link of friction", "link", lambda: coulomb_twist(CHAIN, np.zeros(2), np.ones(2), 3)),
    ("axes", "shape and rate", lambda: V(np.zeros((2, 2)), np.zeros((3, 2)))),
    ("reach", "reach", lambda: square(-1.0)),
    ("count", "count", lambda: square(1.0, 0)),
    ("degree", "degree", lambda: minimum_perturbation(A, GRID, -1)),
    ("no function", "connection", lambda: minimum_perturbation(None, GRID, 1)),  # pyright: ignore[reportArgumentType]
    ("another", "connection", lambda: minimum_perturbation(lambda s: np.zeros(3), GRID, 1)),
    ("one shape", "largest shape", lambda: minimum_perturbation(A, np.zeros((9, 2)), 1)),
    ("frame", "shape", lambda: minimum_perturbation(A, GRID, 2).pose(np.zeros(3))),
    ("gradient", "function", lambda: gradient(None, np.zeros(2))),  # pyright: ignore[reportArgumentType]
    ("slopes", "shape", lambda: exterior_derivative(A, np.array([NAN, 0.0]))),
    ("curvature", "shape", lambda: curvature(A, np.array([NAN, 0.0]))),
    ("steps", "steps", lambda: velocity_integral(A, LOOP, 0)),
    ("half steps", "steps", lambda: corrected_integral(A, LOOP, 1.5)),  # pyright: ignore[reportArgumentType]
    ("no stroke", "stroke", lambda: velocity_integral(A, None)),  # pyright: ignore[reportArgumentType]
    ("half a stroke", "stroke", lambda: effort(CHAIN, lambda t: t)),  # pyright: ignore[reportArgumentType]
    ("time", "t", lambda: LOOP(np.array([NAN]))),
    ("axis", "first", lambda: ellipse([NAN, 0.0], [0.0, 1.0])),
    ("two middles", "centre and first", lambda: ellipse([1.0, 0.0], [0.0, 1.0], np.zeros(3))),
    ("no corner", "number of corners", lambda: polygon(np.zeros((0, 2)))),
    ("no steps", "steps", lambda: path(V, LOOP, 0)),
    ("velocity", "velocity", lambda: displacement(lambda a, b: a, LOOP)),
    ("way", "steps", lambda: distance(CHAIN, LOOP, -1)),
    ("paces", "stroke", lambda: efficiency(CHAIN, 7)),  # pyright: ignore[reportArgumentType]
    ("size", "size", lambda: small_stroke(CHAIN).stroke(NAN)),
    ("objective", "objective", lambda: best_stroke(CHAIN, "speed")),  # pyright: ignore[reportArgumentType]
    ("bound", "bound", lambda: best_stroke(CHAIN, bound=NAN)),
    ("harmonics", "harmonics", lambda: best_stroke(CHAIN, harmonics=1.5)),  # pyright: ignore[reportArgumentType]
    ("map", "reach", lambda: curvature_map(CHAIN, reach=-1.0)),
    ("angles", "count", lambda: curvature_map(CHAIN, count=1)),
    *((f"map {n}", n, lambda n=n: TwistMap(**{**TABLE, n: NAN * TABLE[n]})) for n in TABLE),
    ("falling", "steps of offset", lambda: TwistMap(**{**TABLE, "offset": np.array([0, 2, 1.0])})),
    ("short", "speed", lambda: TwistMap(**{**TABLE, "speed": np.ones((2, 2))})),
    ("no speed", "curvature", lambda: MAP.speeds(NAN)),
    ("no twist", "amplitude", lambda: MAP.twist(NAN, 0.0)),
    ("no offset", "offset", lambda: MAP.twist(0.1, math.inf)),
]
HELD_BY_OTHERS = {
    "legged": "robots/mechanics.py alone imports it, with a robot that was checked",
    "arguments": "what refuses",
}
RESULTS = {"BodyFrame", "SmallStroke", "CurvatureMap", "Loop", "Wave"}
"""What functions return."""
UNASKED = {"purcell": PlanarChain}
"""What hands its arguments on to a name that is asked."""


@pytest.mark.parametrize(("what", "name", "act"), ROWS, ids=[row[0] for row in ROWS])
def test_a_bad_argument_is_refused_by_its_name_in_one_line(what: str, name: str, act: Any) -> None:
    with pytest.raises(BadInputError) as found:
        act()
    assert str(found.value).startswith(name), what
    assert "\n" not in str(found.value)
    assert "found" in str(found.value)


def test_every_public_name_is_asked() -> None:
    source = Path(__file__).read_text().partition("HELD_BY_OTHERS")[0].partition("ROWS = [")[2]
    for file in Path(geometric_locomotion.__file__).parent.glob("[a-z]*.py"):
        if file.stem in (*HELD_BY_OTHERS, "errors"):
            continue
        module = importlib.import_module(f"geometric_locomotion.{file.stem}")
        own = [
            name
            for name, each in vars(module).items()
            if not name.startswith("_")
            and (inspect.isfunction(each) or inspect.isclass(each))
            and each.__module__ == module.__name__
        ]
        missing = [n for n in own if n not in source and n not in RESULTS and n not in UNASKED]
        assert not missing, f"{module.__name__}: {missing}"


def test_sound_arguments_of_any_kind_of_number_are_taken() -> None:
    """Whole numbers and lists; what moves straight ahead comes back as it was."""
    pose = lie.se2_pose([2], 1, np.float32(0.0))
    assert pose.shape == (1, 3, 3)
    assert lie.se2_log(lie.se2_exp([1, 0, 0])) == pytest.approx([1.0, 0.0, 0.0])
    assert PlanarChain([1, 2]).length == 3  # pyright: ignore[reportArgumentType]
