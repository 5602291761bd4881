"""A rod as long, thick and heavy, and on average as stiff, as our antenna swings into a sphere."""

from __future__ import annotations

from importlib import metadata
from typing import Any

import elastica as ea
import numpy as np
from answering import Job, answer

ELEMENTS = 12
"""Twice as many as our antenna has hinges."""


class Scene(ea.BaseSystemCollection, ea.Constraints, ea.Damping, ea.Contact):
    pass


class Swinging(ea.ConstraintBase):
    """The first element is held and turned to and fro about z."""

    def __init__(self, *places: Any, swing: float, **more: Any) -> None:
        super().__init__(**more)
        self._at, self._frame = (np.array(place) for place in places)
        self._swing = swing

    def constrain_values(self, system: Any, time: float) -> None:
        angle = self._swing * np.sin(2 * np.pi * time)
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        system.position_collection[..., 0] = self._at
        system.director_collection[..., 0] = self._frame @ turn.T

    def constrain_rates(self, system: Any, time: float) -> None:
        system.velocity_collection[..., 0] = 0.0
        rate = 2 * np.pi * self._swing * np.cos(2 * np.pi * time)
        system.omega_collection[..., 0] = system.director_collection[..., 0] @ [0.0, 0.0, rate]


def antenna(told: dict[str, Any]) -> Job:
    spec = told["antenna"]
    count, length, radius = len(spec["stiffness"]), spec["length"], spec["radius"]
    link = length / count
    bending = link * count / sum(1.0 / k for k in spec["stiffness"])  # of the same whole flex
    area = np.pi * radius**2
    young = bending / (area * radius**2 / 4)
    density = count * spec["link_mass"] / (area * length)
    element = length / ELEMENTS
    step = 0.4 * element * np.sqrt(density / young)
    scene = Scene()
    rod = ea.CosseratRod.straight_rod(
        ELEMENTS,
        np.zeros(3),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        length,
        radius,
        density,
        youngs_modulus=young,
        shear_modulus=young / 3,
    )
    x, y, size = told["ball"]
    ball = ea.Sphere(np.array([x, y, 0.0]), size, 1000.0)
    scene.append(rod)
    scene.append(ball)
    scene.constrain(rod).using(
        Swinging,
        constrained_position_idx=(0,),
        constrained_director_idx=(0,),
        swing=told["swing"],
    )
    scene.constrain(ball).using(
        ea.FixedConstraint, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    scene.dampen(rod).using(
        ea.AnalyticalLinearDamper, damping_constant=1.0 / spec["damping_time"], time_step=step
    )
    scene.detect_contact_between(rod, ball).using(
        ea.RodSphereContact,
        k=100.0,
        nu=0.01,
        velocity_damping_coefficient=1.0,
        friction_coefficient=spec["friction"],
    )
    scene.finalize()
    stepper = ea.PositionVerlet()
    now = [0.0]

    def go_on(seconds: float) -> None:
        for _ in range(round(seconds / step)):
            now[0] = stepper.step(scene, now[0], step)
        if not np.isfinite(rod.position_collection).all():
            raise SystemExit("the rod has left all bounds")

    return go_on, {"size": f"{ELEMENTS} elements, step {1e3 * step:.2g} ms"}


if __name__ == "__main__":
    answer(metadata.version("pyelastica"), lambda told: {"antenna": antenna(told)})
