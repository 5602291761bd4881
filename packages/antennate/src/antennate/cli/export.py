"""`antennate robot --export`: the robot as MJCF or URDF, for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate import __version__
from antennate.errors import ConfigError
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.studies.columns import Column
from antennate.studies.tables import Table

_MEASURES = (
    Column("joints", "joints", form="d"),
    Column("servos", "servos", form="d"),
    Column("mass", "mass", "kg", form=".4f"),
    Column("ticks", "control periods", form="d"),
    Column("walk_difference_m", "head apart", "m", form=".2g"),
)


def exported(
    robot: RobotSpec, kind: str, scene: str, seed: int, gait: str
) -> tuple[Mapping[str, str | bytes], dict[str, Any]]:
    """The files of an export by name, and its result.

    Args:
        robot: The robot.
        kind: `mjcf` or `urdf`.
        scene: Scene of MJCF, empty for a flat floor.
        seed: Seed of that scene.
        gait: Gait of the walk beside MJCF, empty for the default one.
    """
    from antennate.sim.export.folder import export_mjcf, export_urdf  # slow to import
    from antennate.sim.scenes.registry import check_name

    title = f"Written by antennate {__version__}"
    if kind == "urdf":
        export = export_urdf(robot, title)
    else:
        try:
            check_name(scene or "flat")
        except ConfigError as error:
            raise ConfigError(f"--scene: {error}") from None
        gait_of_walk = GaitParams.named(gait) if gait else GaitParams()
        export = export_mjcf(robot, scene or "flat", seed, gait_of_walk, title)
    names = sorted(export.files)
    result = {"schema": 1, "command": "robot", "export": kind, "files": names, **export.result}
    return export.files, result


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Numbers of the exported model, and where it differs from that of the simulator."""
    measures = [measure for measure in _MEASURES if measure.name in result]
    numbers = Table.of("Model", {result["export"].upper(): dict(result)}, measures)
    differences = result.get("model_difference") or {}
    rows = [(name, [f"{value:.2g}"]) for name, value in differences.items()]
    if not rows:
        return (numbers,)
    return numbers, Table("Arrays that differ from the simulator's", ("at most",), rows)


def sentence(result: Mapping[str, Any]) -> str:
    """What was exported, and how exact it is."""
    names = ", ".join(result["files"])
    if result["export"] == "urdf":
        return f"{names}: {result['joints']} joints, {result['mass']:.4g} kg."
    apart = result["walk_difference_m"]
    exact = "to the last bit" if apart == 0.0 else f"within {apart:.2g} m"
    return (
        f"{names}: in {result['engine']} alone the head of scene.xml goes where that of the "
        f"simulator goes, {exact}, over {result['ticks']} control periods."
    )
