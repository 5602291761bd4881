"""Purcell's swimmer: how far a stroke takes it, what the curvature says, and the best strokes."""

import numpy as np

from geometric_locomotion.chain import PlanarChain, purcell
from geometric_locomotion.coordinates import minimum_perturbation, square
from geometric_locomotion.curvature import corrected_integral, curvature
from geometric_locomotion.friction import coulomb_twist
from geometric_locomotion.optimal import best_stroke, distance, efficiency, small_stroke
from geometric_locomotion.stroke import displacement, ellipse, path

if __name__ == "__main__":
    swimmer = purcell()  # three equal links, 1 long together, drag ratio 2
    circle = ellipse([0.5, 0.0], [0.0, 0.5])  # both joints swing by 0.5 rad, a quarter apart
    print("where it takes the front link:", path(swimmer.twist, circle)[-1][:2, 2].round(4))

    forward = -curvature(swimmer.connection, np.zeros(2))[0, 0, 1]
    print(f"by curvature: {np.pi * 0.5**2 * forward:.4f}, exact: {distance(swimmer, circle):.4f}")

    farthest = best_stroke(swimmer, "distance")
    frame = minimum_perturbation(swimmer.connection, square(2.2))
    for name, connection in (
        ("front link", swimmer.connection),
        ("minimum perturbation", frame.change(swimmer.connection)),
    ):
        estimate = np.hypot(*corrected_integral(connection, farthest)[:2])
        print(f"farthest: {distance(swimmer, farthest):.4f}, in {name} {estimate:.4f}")

    efficient = best_stroke(swimmer, "efficiency")
    print(f"most efficient: {efficiency(swimmer, efficient):.4f}")

    eel = PlanarChain.equal(8)
    wave = small_stroke(eel).stroke(0.3)
    phase = np.degrees(np.unwrap(np.angle(wave.cosine[0] + 1j * wave.sine[0])))
    print("eight links, phase of each joint:", (phase - phase[0]).round())

    snake = PlanarChain.equal(8, drag_ratio=10.0)  # on dry ground
    place = displacement(lambda shape, rate: coulomb_twist(snake, shape, rate), wave)
    print(f"on dry ground: {np.hypot(*place[:2]):.4f} lengths a cycle")
