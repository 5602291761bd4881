"""All files of an export, by name, and what was measured of them."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.sim.engine import mujoco
from antennate.sim.export.mjcf import to_mjcf
from antennate.sim.export.parts import gear_shares, lone_robot, robot_in_scene
from antennate.sim.export.readme import mjcf_readme, urdf_readme
from antennate.sim.export.urdf import to_urdf
from antennate.sim.export.walk import head_in_model, walk
from antennate.sim.trial import TrialConfig, scene_of, still_trial

README = "README.txt"
_PERIOD = 0.01
"""Time between two commands [s]: 100 Hz, as all commands have it unless told otherwise."""


class Export(NamedTuple):
    """An export.

    Attributes:
        files: Content of each file, by name.
        result: Numbers of the model; for MJCF also how far it is from that of the simulator.
    """

    files: Mapping[str, str | bytes]
    result: Mapping[str, Any]


def export_mjcf(
    robot: RobotSpec,
    scene: str = "flat",
    seed: int = 0,
    gait: GaitParams | None = None,
    title: str = "A robot of antennate",
) -> Export:
    """The robot as MJCF: alone, and in a scene with a walk to check it by.

    Args:
        robot: The robot.
        scene: Name of the scene, as `--scene` has it; its instance is that of trial 0.
        seed: Seed of that trial.
        gait: Gait of the walk, the default one if None.
        title: First line of all texts.

    Raises:
        ConfigError: There is no such scene, or the engine cannot write all digits.
        SceneError: It cannot be read, drawn or built, or the robot does not fit at its start.
        SimulationError: The robot does not stand the walk.
    """
    config = TrialConfig(seed=seed, scene=scene, robot=robot)
    gait = gait or GaitParams()
    world, drawn = still_trial(config, scene_of(config), gait)
    alone = to_mjcf(lone_robot(config.physics, robot, _PERIOD), title)
    whole = to_mjcf(robot_in_scene(config.physics, world, drawn, _PERIOD), title)
    model = mujoco.MjModel.from_xml_string(whole.text, whole.assets)
    lone = mujoco.MjModel.from_xml_string(alone.text, alone.assets)
    course = walk(world, gait, _PERIOD)
    shares = gear_shares(world.model, robot)[world.places.drives]
    loaded = {n: float(s) for n, s in zip(robot.joint_names, shares, strict=True) if s}
    apart = float(np.abs(head_in_model(model, course) - course.head).max())
    engine, ticks = f"mujoco {mujoco.__version__}", len(course.head)
    readme = mjcf_readme(
        title, engine, scene, robot, loaded, whole.difference, ticks=ticks, apart=apart
    )
    texts = {"robot.xml": alone.text, "scene.xml": whole.text, "gait.csv": course.table()}
    example = files("antennate.sim.export").joinpath("walk_example.txt").read_text("utf-8")
    result = {
        "engine": engine,
        "scene": scene,
        "seed": seed,
        "joints": int(np.count_nonzero(lone.jnt_type == mujoco.mjtJoint.mjJNT_HINGE)),
        "servos": int(lone.nu),
        "mass": float(lone.body_mass.sum()),
        "ticks": ticks,
        "walk_difference_m": apart,
        "model_difference": dict(whole.difference),
    }
    return Export(
        {README: readme, **texts, "walk.py": example, **alone.assets, **whole.assets}, result
    )


def export_urdf(robot: RobotSpec, title: str = "A robot of antennate") -> Export:
    """The robot as URDF.

    Args:
        robot: The robot.
        title: First line of all texts.
    """
    text = to_urdf(robot, title)
    root = ElementTree.fromstring(text.encode())  # noqa: S314 our own text
    result = {
        "joints": len(root.findall("joint")),
        "servos": len(robot.joint_names),
        "mass": sum(float(mass.get("value", 0.0)) for mass in root.iter("mass")),
    }
    return Export({README: urdf_readme(title, robot), "robot.urdf": text}, result)
