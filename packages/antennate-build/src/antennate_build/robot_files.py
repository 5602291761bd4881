"""Files with which a robot is simulated as it is built: robot.toml, robot.xml and their meshes."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from antennate.files import writing
from antennate.params.base import from_values, put_over
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import ANTENNA_PREFIXES, RobotSpec
from antennate.studies.formats import to_toml
from antennate_build import checks, kernel
from antennate_build.antenna_assembly import AntennaSolids
from antennate_build.build.naming import MESHES
from antennate_build.kernel import Solid
from antennate_build.robot_assembly import RobotSolids
from antennate_build.weights import SOURCES

_PERIOD = 0.01
"""Time between two commands [s]: 100 Hz, as all commands have it unless told otherwise."""
_FINE = (0.1, 0.5)
"""How far meshes may leave their solid [mm], and turn from one triangle to the next [rad]."""


def files(
    robot: RobotSolids, antenna: AntennaSolids | None, values: Mapping[str, Any]
) -> dict[str, str | bytes]:
    """The files by name.

    Args:
        robot: The links.
        antenna: The antennae, if it has some.
        values: What is otherwise than in the description of the robot.
    """
    from antennate.sim.export.mjcf import to_mjcf  # the engine, slow to import
    from antennate.sim.export.parts import lone_robot

    spec = robot.layout.robot
    meshes = {f"{name}.stl": data for name, data in _meshes(robot, antenna).items()}
    built = from_values(RobotSpec, put_over(spec.model_dump(), {**values, "meshes": MESHES}))
    with tempfile.TemporaryDirectory() as folder:
        with writing(Path(folder)):
            for name, data in meshes.items():
                Path(folder, name).write_bytes(data)
        drawn = built.model_copy(update={"meshes": folder})
        text = to_mjcf(lone_robot(PhysicsParams(), drawn, _PERIOD), "The robot as it is built").text
    named = text.replace('file="robot_', f'file="{MESHES}/')
    return {
        "robot.toml": _text(built),
        "robot.xml": named,
        **{f"{MESHES}/{name}": data for name, data in meshes.items()},
    }


def _text(built: RobotSpec) -> str:
    """The robot's file, with where its numbers come from."""
    head = (
        "The robot as it is built, for --robot of all commands. What is otherwise than before:",
        *SOURCES,
    )
    lines = [f"# {line}" for line in head]
    lines += ["", to_toml(built.model_copy(update={"bodies": ()}))]
    for body in built.bodies:
        lines += ["[[bodies]]", f'name = "{body.name}"', f"mass = {body.mass}  # kg"]
        lines += [f"centre = {list(body.centre)}  # m", f"inertia = {list(body.inertia)}  # kg·m²"]
        lines += [f'source = "{body.source}"', ""]
    return "\n".join(lines)


def _meshes(robot: RobotSolids, antenna: AntennaSolids | None) -> dict[str, bytes]:
    """Binary STL of each body, in its frame [mm]."""
    spec = robot.layout.robot
    found = {
        name: _stl([solid for _, solid in robot.bodies(n)])
        for n, name in enumerate(spec.link_names)
    }
    out = 500.0 * (spec.width - spec.leg_width)
    parts = [solid for _, solid in robot.legs()]
    legs = [
        _stl([kernel.moved(solid, (0.0, y, 0.0)) for solid in parts[side::2]])
        for side, y in ((0, -out), (1, out))
    ]
    found |= {name: legs["_r" in name] for name in spec.leg_names}
    if antenna is None:
        return found
    for side, prefix in enumerate(ANTENNA_PREFIXES):
        bracket, turn = antenna.sides[side]
        over = 0.0 if side else math.pi  # a right antenna hangs upside down as it is simulated, too
        found[f"{prefix}base"] = _stl([kernel.turned(antenna.printed[bracket], over, "x")])
        roll = turn - over
        for n, name in enumerate(spec.antenna.hinge_names):
            found[prefix + name] = _stl([kernel.turned(s, roll, "x") for s in antenna.moving(n)])
    return found


def _stl(solids: list[Solid]) -> bytes:
    return checks.stl(kernel.mesh(kernel.together(solids), *_FINE))
