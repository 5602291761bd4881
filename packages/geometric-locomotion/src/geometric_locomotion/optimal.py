"""Optimal strokes: the small one of least energy in closed form, large ones by optimisation.

The energy of a stroke at its best pace is the square of its length in the dissipation metric, per
period. Distances are those of the body over one stroke, in the chain's unit of length.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.linalg import eigh, null_space
from scipy.optimize import minimize

from geometric_locomotion.arguments import sampled, scalar, whole
from geometric_locomotion.chain import PlanarChain
from geometric_locomotion.curvature import curvature
from geometric_locomotion.errors import BadInputError
from geometric_locomotion.stroke import FourierStroke, Stroke, displacement
from geometric_locomotion.types import Floats

Objective = Literal["distance", "efficiency"]
Goal = Callable[[PlanarChain, Stroke], float]

_NEAR = 1.0
"""Farthest that a search moves a coefficient [rad]: strokes that go round once stay so."""
_SEARCHES = 10
"""Most searches one after the other, each from where the last one had to stop."""
_TIMES = 64
"""Times of a stroke at which its angles are held within the bound."""
_SIZE = 1.3
"""Largest angle of the stroke that a search starts from [rad]."""


@dataclass(frozen=True)
class SmallStroke:
    """Ellipse of least energy for a small displacement: first cos + second sin.

    Attributes:
        first: One half-axis of the ellipse, of unit energy norm, shape (m,).
        second: The other, shape (m,).
        economy: Displacement over energy, of strokes so small that both grow with the square.
    """

    first: Floats
    second: Floats
    economy: float

    def stroke(self, size: float) -> FourierStroke:
        """The stroke with no angle above a size [rad]."""
        scale = scalar("size", size) / np.hypot(self.first, self.second).max()
        return FourierStroke(0 * self.first, scale * self.first[None], scale * self.second[None])


def small_stroke(chain: PlanarChain) -> SmallStroke:
    """The stroke about the straight chain that moves it forward at least energy.

    With the metric G and the curvature F of x, both at the straight shape, displacement is
    pi a^T F b and energy 2 pi^2 (a^T G a + b^T G b) for the half-axes a, b: the largest pair of
    eigenvalues of F against G gives the plane (Alouges et al. 2018, arXiv 1801.04687).
    """
    straight = np.zeros(chain.joints)
    forward = -curvature(chain.connection, straight)[0]
    values, vectors = eigh(1j * forward, chain.metric(straight).astype(complex))
    first, second = np.sqrt(2) * vectors[:, -1].real, np.sqrt(2) * vectors[:, -1].imag
    if first @ forward @ second < 0:
        second = -second
    return SmallStroke(first, second, float(values[-1] / (4 * np.pi)))


def effort(chain: PlanarChain, stroke: Stroke, steps: int = 120) -> float:
    """Length of a stroke in the dissipation metric; its square is the least energy per period."""
    shape, rate = sampled(stroke, (np.arange(whole("steps", steps, 1)) + 0.5) / steps)
    power = (rate[:, None, :] @ chain.metric(shape) @ rate[..., None])[:, 0, 0]
    return float(np.sqrt(power).mean())


def distance(chain: PlanarChain, stroke: Stroke, steps: int = 60) -> float:
    """How far one stroke takes the chain; a stroke that turns it, too, takes it in a circle."""
    place = displacement(lambda a, b: chain.twist(a, b, chain.links // 2), stroke, steps)
    return float(np.hypot(*place[:2]))


def efficiency(chain: PlanarChain, stroke: Stroke) -> float:
    """Power to tow the straight chain at the stroke's mean speed, over that of swimming.

    Lighthill's efficiency, with the stroke at its best pace.
    """
    return chain.length * (distance(chain, stroke) / effort(chain, stroke)) ** 2


def _lengths(chain: PlanarChain, stroke: Stroke) -> float:
    return distance(chain, stroke) / chain.length


def best_stroke(
    chain: PlanarChain,
    objective: Objective = "distance",
    *,
    bound: float = np.pi,
    centre: float = 0.0,
    harmonics: int = 3,
) -> FourierStroke:
    """A local optimum among strokes that do not turn the chain.

    Front and rear angles are alike in even shapes (arcs) and opposite in odd ones (zigzags). A
    stroke whose odd part is even in time and whose even part is odd in time is its own mirror
    image, so it does not turn a chain that is alike in front and rear. The mean shape is odd.

    Args:
        chain: Chain with lengths that are alike from both ends.
        objective: What is made large, over one period.
        bound: Largest angle of a joint [rad].
        centre: Where to start: the first odd shape's angle in the middle of the stroke [rad]; 0
            also keeps the stroke about the straight chain.
        harmonics: Harmonics of the Fourier series.

    Raises:
        BadInputError: Less than three links, lengths that differ from end to end, a centre beyond
            the bound, a search without an optimum, or three links that go farther in several loops.
    """
    if chain.links < 3 or not np.allclose(chain.lengths, chain.lengths[::-1]):
        raise BadInputError(
            "a stroke needs 3 links or more with lengths alike from both ends, found "
            f"{chain.lengths}"
        )
    if objective not in get_args(Objective):
        known = " or ".join(get_args(Objective))
        raise BadInputError(f"objective: expected {known}, found {objective!r:.60}")
    scalar("centre", centre)
    scalar("bound", bound)
    if whole("harmonics", harmonics, -1 << 31) < 1 or not abs(centre) < bound:
        raise BadInputError(
            f"a stroke needs 1 harmonic or more and a centre within its bound, found {harmonics} "
            f"harmonics, the centre {centre:g} and the bound {bound:g} rad"
        )
    goal = _lengths if objective == "distance" else efficiency
    values = _start(chain, centre, bound)
    for count in sorted({1, harmonics}):  # the best ellipse first, then its neighbourhood
        rows = _mirrored(chain.joints, count, about_zero=centre == 0)
        values = _search(chain, goal, rows, _padded(values, count, chain.joints) @ rows.T, bound)
    stroke = _as_stroke(values, chain.joints)
    if chain.joints == 2 and not _goes_round_once(stroke):
        raise BadInputError(
            f"no stroke that goes round once is best within {bound:g} rad: lower the bound, or "
            f"give fewer than {harmonics} harmonics"
        )
    return stroke


def _goes_round_once(stroke: Stroke) -> bool:
    """Whether a loop of two joints, and its direction, turn once about the mean shape."""
    vectors = stroke(np.linspace(0, 1, 721))
    angles = (np.unwrap(np.arctan2(*(v - v[:-1].mean(axis=0)).T)) for v in vectors)
    return all(abs(abs(angle[-1] - angle[0]) - 2 * np.pi) < 1 for angle in angles)


def _search(chain: PlanarChain, goal: Goal, rows: Floats, start: Floats, bound: float) -> Floats:
    """Coefficients of the best stroke near a start, in the span of the rows."""
    limits = _angles(rows, chain.joints)

    def cost(x: Floats) -> float:
        return -goal(chain, _as_stroke(x @ rows, chain.joints))

    inside = {
        "type": "ineq",
        "fun": lambda x: np.concatenate([bound - limits @ x, bound + limits @ x]),
        "jac": lambda _: np.concatenate([-limits, limits]),
    }
    for _ in range(_SEARCHES):
        near = np.stack([start - _NEAR, start + _NEAR], axis=-1)
        options = {"maxiter": 300, "ftol": 1e-9}
        result = minimize(
            cost, start, method="SLSQP", bounds=near, constraints=inside, options=options
        )
        if not result.success:
            raise BadInputError(f"no optimal stroke within {bound:g} rad: {result.message}")
        if np.abs(result.x - start).max() < 0.99 * _NEAR:
            return result.x @ rows
        start = result.x
    raise BadInputError(f"no optimal stroke within {bound:g} rad after {_SEARCHES} searches")


def _mirrored(joints: int, harmonics: int, about_zero: bool) -> Floats:
    """Mirrored strokes (free, (1 + 2 K) m): centre, cosines, sines, one behind the other."""
    swap = np.eye(joints)[::-1]
    odd = null_space(np.eye(joints) + swap).T
    even = null_space(np.eye(joints) - swap).T
    blocks = []
    for part in range(1 + 2 * harmonics):
        shapes = odd if part <= harmonics else even
        harmonic = part if part <= harmonics else part - harmonics
        if about_zero and harmonic % 2 == 0:
            continue  # the second half of the stroke is the first one with opposite angles
        block = np.zeros((len(shapes), 1 + 2 * harmonics, joints))
        block[:, part] = shapes
        blocks.append(block.reshape(len(shapes), -1))
    return np.concatenate(blocks)


def _as_stroke(values: Floats, joints: int) -> FourierStroke:
    parts = values.reshape(-1, joints)
    harmonics = len(parts) // 2
    return FourierStroke(parts[0], parts[1 : 1 + harmonics], parts[1 + harmonics :])


def _start(chain: PlanarChain, centre: float, bound: float) -> Floats:
    """Coefficients of an ellipse like the small optimal one, its angles within the bound."""
    small = small_stroke(chain)
    wave = small.first + 1j * small.second
    odd = (wave - wave[::-1]) / 2
    turned = wave * np.exp(-1j * np.angle(odd[np.abs(odd).argmax()]))
    odd, even = (turned - turned[::-1]).real / 2, (turned + turned[::-1]).imag / 2
    size = min(_SIZE, 0.8 * (bound - abs(centre))) / np.hypot(odd, even).max()
    return np.concatenate([centre * odd / np.abs(odd).max(), size * odd, size * even])


def _padded(values: Floats, harmonics: int, joints: int) -> Floats:
    """Coefficients of the same stroke with more harmonics."""
    stroke = _as_stroke(values, joints)
    more = ((0, harmonics - len(stroke.cosine)), (0, 0))
    parts = (stroke.centre[None], np.pad(stroke.cosine, more), np.pad(stroke.sine, more))
    return np.concatenate(parts).reshape(-1)


def _angles(rows: Floats, joints: int) -> Floats:
    """Angles at `_TIMES` times, joint by joint, of each free value: (times m, free)."""
    t = np.arange(_TIMES) / _TIMES
    return np.stack([_as_stroke(row, joints)(t)[0].reshape(-1) for row in rows], axis=-1)
