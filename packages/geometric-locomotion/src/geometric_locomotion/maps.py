"""Curvature maps of a three-link chain with its optimal strokes, as arrays for figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometric_locomotion.arguments import scalar, whole
from geometric_locomotion.chain import PlanarChain
from geometric_locomotion.coordinates import minimum_perturbation, square
from geometric_locomotion.curvature import corrected_integral, curvature
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.optimal import (
    Objective,
    best_stroke,
    distance,
    efficiency,
)
from geometric_locomotion.stroke import FourierStroke, ellipse
from geometric_locomotion.types import Floats

_REGION = 2.2
"""Half-width of the square in which the body frame is fitted [rad]: that of the best strokes."""


@dataclass(frozen=True)
class Loop:
    """An optimal stroke.

    Attributes:
        stroke: The stroke itself.
        shape: Shapes along it [rad], closed, shape (n, 2).
        distance: How far it takes the chain, in chain lengths.
        efficiency: Lighthill's efficiency at its best pace.
    """

    stroke: FourierStroke
    shape: Floats
    distance: float
    efficiency: float


@dataclass(frozen=True)
class CurvatureMap:
    """Curvature of a three-link chain's motion forward, and its optimal strokes.

    Attributes:
        angle: Angles of either joint [rad], shape (n,).
        forward: Displacement forward by a small loop, over its area, in minimum-perturbation
            coordinates [chain lengths per rad squared], shape (n, n), first joint first.
        middle: The same in the frame of the middle link.
        loops: Optimal strokes by objective.
        size: Radii of circles about the straight shape [rad], shape (k,).
        exact: Distance of one such stroke [chain lengths], shape (k,).
        corrected: Its estimate by the corrected integral in minimum-perturbation coordinates.
        corrected_middle: That in the frame of the middle link.
    """

    angle: Floats
    forward: Floats
    middle: Floats
    loops: dict[Objective, Loop]
    size: Floats
    exact: Floats
    corrected: Floats
    corrected_middle: Floats


def curvature_map(chain: PlanarChain, reach: float = 2.4, count: int = 61) -> CurvatureMap:
    """Maps over the square from -reach to reach [rad], `count` angles each way.

    Raises:
        BadInputError: A chain that has other than three links, or whose ends differ.
    """
    if chain.links != 3:
        raise BadInputError(f"a map needs a chain of 3 links, found {chain.links}")
    whole("count", count, 2)
    angle = np.linspace(-scalar("reach", reach, above=0.0), reach, count)
    grid = np.stack(np.meshgrid(angle, angle, indexing="ij"), axis=-1)

    def middle(shape: Floats) -> Floats:
        return chain.connection(shape, 1)

    best = minimum_perturbation(middle, square(_REGION)).change(middle)
    size = np.linspace(0.05, 2.0, 40)
    circles = [ellipse([radius, 0.0], [0.0, radius]) for radius in size]
    corrected, corrected_middle = (
        np.array([np.hypot(*corrected_integral(frame, c, 100)[:2]) for c in circles])
        for frame in (best, middle)
    )
    return CurvatureMap(
        angle=angle,
        forward=-curvature(best, grid)[..., 0, 0, 1] / chain.length,
        middle=-curvature(middle, grid)[..., 0, 0, 1] / chain.length,
        loops={objective: _loop(chain, objective) for objective in ("distance", "efficiency")},
        size=size,
        exact=np.array([distance(chain, circle) for circle in circles]) / chain.length,
        corrected=corrected / chain.length,
        corrected_middle=corrected_middle / chain.length,
    )


def _loop(chain: PlanarChain, objective: Objective) -> Loop:
    stroke = best_stroke(chain, objective)
    shape, _ = stroke(np.linspace(0, 1, 201))
    far = distance(chain, stroke) / chain.length
    return Loop(stroke, shape, far, efficiency(chain, stroke))
