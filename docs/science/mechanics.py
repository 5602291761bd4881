"""Everything that docs/science/mechanics.md reports: `python docs/science/mechanics.py`.

Prints the tables and draws docs/science/mechanics.png; about a minute on one core, nothing drawn
at random.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.figures import render
from antennate.types import Floats
from antennate_lab.swimmers import swimmer_figure
from geometric_locomotion.chain import PlanarChain, purcell
from geometric_locomotion.coordinates import minimum_perturbation, square
from geometric_locomotion.curvature import corrected_integral, velocity_integral
from geometric_locomotion.friction import coulomb_twist
from geometric_locomotion.lie import se2_inverse
from geometric_locomotion.maps import curvature_map
from geometric_locomotion.optimal import best_stroke, distance, efficiency, small_stroke
from geometric_locomotion.stroke import Connection, FourierStroke, displacement, ellipse, path

HERE = Path(__file__).parent


def row(*cells: object) -> None:
    """Print a row of a table in Markdown."""
    print("| " + " | ".join(map(str, cells)) + " |")


def frames() -> dict[str, Connection]:
    """Connections of Purcell's swimmer by the name of their body frame."""
    chain = purcell()

    def of_link(link: int) -> Connection:
        return lambda shape: chain.connection(shape, link)

    best = minimum_perturbation(of_link(1), square(2.2)).change(of_link(1))
    return {"front link": of_link(0), "middle link": of_link(1), "minimum perturbation": best}


def integrals(stroke: FourierStroke) -> None:
    """Both integrals of a stroke in three body frames."""
    exact = distance(purcell(), stroke)
    row("body frame", "plain", "corrected", "error of the corrected")
    for name, connection in frames().items():
        plain, corrected = (
            float(np.hypot(*integral(connection, stroke)[:2]))
            for integral in (velocity_integral, corrected_integral)
        )
        row(name, f"{plain:.4f}", f"{corrected:.4f}", f"{corrected / exact - 1:+.1%}")


def economy(chain: PlanarChain, step: float) -> float:
    """Displacement over energy of a small wave, alike in all joints, with a phase step [rad]."""
    wave = 0.01 * np.exp(1j * step * np.arange(chain.joints))
    stroke = ellipse(wave.real, wave.imag)
    shape, rate = stroke(np.arange(12) / 12)
    energy = np.einsum("ti,tij,tj->", rate, chain.metric(shape), rate) / 12
    return distance(chain, stroke) / float(energy)


def small() -> None:
    """Displacement over energy of small strokes: the optimal ellipse and two waves."""
    row("links", "optimal ellipse", "phase step [deg]", "wave, 120 deg", "wave, one on the body")
    for links in range(3, 11):
        chain = PlanarChain.equal(links)
        stroke = small_stroke(chain)
        phase = np.unwrap(np.angle(stroke.first + 1j * stroke.second))
        steps = np.degrees(np.abs(np.diff(phase)))
        waves = (economy(chain, 2 * np.pi / length) for length in (3, links))
        row(
            links,
            f"{stroke.economy:.3f}",
            f"{steps.min():.0f} to {steps.max():.0f}",
            *(f"{wave:.3f}" for wave in waves),
        )


def gains() -> None:
    """Efficiency of zigzag ovals over that of the best loop about the straight chain."""
    bounds = (2.2, 2.3, 2.4, 2.6, 2.8, 2.9, 3.0, 3.1)
    row("outer over middle link", "centred", *bounds)
    for arm in (1.0, 1.336, 1.5):
        chain = purcell(2.0, (arm, 1.0, arm))
        centred = efficiency(chain, best_stroke(chain, "efficiency"))
        values = []
        for bound in bounds:
            try:
                oval = best_stroke(chain, "efficiency", bound=bound, centre=1.6, harmonics=4)
                values.append(f"{efficiency(chain, oval) / centred:.2f}")
            except BadInputError:
                values.append("no optimum")
        row(arm, f"{centred:.4f}", *values)


def lobes() -> None:
    """Distance of two mirrored loops about zigzags, over the best about the straight chain."""
    bounds = (2.2, 2.3, 2.4)
    row("outer over middle link", "straight [lengths]", *bounds)
    for arm in (1.0, 1.336, 1.49):
        chain = purcell(2.0, (arm, 1.0, arm))
        far = distance(chain, best_stroke(chain, "distance"))
        row(arm, f"{far / chain.length:.4f}", *(f"{2 * _lobe(chain, b) / far:.2f}" for b in bounds))


def _lobe(chain: PlanarChain, bound: float) -> float:
    """How far forward a loop about a zigzag takes the straight chain, with the way to it."""
    stroke = best_stroke(chain, "distance", bound=bound, centre=1.6)
    start = stroke(np.zeros(1))[0][0]

    def way(t: Floats) -> tuple[Floats, Floats]:
        return np.multiply.outer(t, start), np.broadcast_to(start, (len(t), 2))

    there = path(chain.twist, way)[-1]
    moved = there @ path(chain.twist, stroke)[-1] @ se2_inverse(there)
    return float(moved[0, 2])


def crawling() -> None:
    """Distances by circles of 0.5 and 1 rad in a fluid and on dry ground, by drag ratio."""
    row("drag ratio", "fluid, 0.5 rad", "ground, 0.5 rad", "fluid, 1 rad", "ground, 1 rad")
    for ratio in (1.0, 2.0, 4.0, 10.0):
        chain = PlanarChain.equal(3, drag_ratio=ratio)

        def ground(shape: Floats, rate: Floats, chain: PlanarChain = chain) -> Floats:
            return coulomb_twist(chain, shape, rate, 1)

        cells = []
        for size in (0.5, 1.0):
            circle = ellipse([size, 0.0], [0.0, size])
            cells.append(f"{distance(chain, circle):.4f}")
            cells.append(f"{np.hypot(*displacement(ground, circle, 60)[:2]):.4f}")
        row(ratio, *cells)


if __name__ == "__main__":
    maps = curvature_map(purcell())
    (HERE / "mechanics.png").write_bytes(render(swimmer_figure(maps))["png"])
    for objective, loop in maps.loops.items():
        print(f"{objective}: {loop.distance:.4f} lengths, efficiency {loop.efficiency:.4%}")
        print(f"    cosine {loop.stroke.cosine.round(3).tolist()}")
        print(f"    sine {loop.stroke.sine.round(3).tolist()}")
    integrals(maps.loops["distance"].stroke)
    small()
    gains()
    lobes()
    crawling()
