"""`antennate robot`: what a robot's file says, and how to build and wire that robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from pydantic.dataclasses import dataclass

from antennate.cli.addresses import RobotFileOptions, parse_robot
from antennate.cli.exit_codes import OK
from antennate.cli.results import ResultOptions, folder_for, tell
from antennate.dxl.model import EXTENDED_MODE
from antennate.hardware.robot_file import RobotFile
from antennate.params.base import Params
from antennate.robots.parts import Rail, Supply, bill, servos_of, supply
from antennate.robots.spec import RobotSpec
from antennate.studies.formats import to_csv
from antennate.studies.measures import Measure, Table
from antennate.studies.report import View

DESCRIPTION = """\
Say what a robot consists of: joints with their ids and servos, what its supply has to give, a
wiring diagram and a bill of materials. Nothing is sent to any port.

The folder holds figures/wiring.svg and .png, bom.csv and result.json."""
_COLUMNS = ("id", "servo", "mode", "zero", "direction")
_RAIL = (
    Measure("servos", "servos", form="d"),
    Measure("standby", "standby", "A"),
    Measure("walking", "walking, mean", "A"),
    Measure("peak", "walking, most", "A"),
    Measure("stall", "all stalled", "A"),
)


class DescribedRobot(Params):
    """The robot that is described."""

    robot: RobotSpec = RobotSpec()


@dataclass(frozen=True)
class Options(ResultOptions, RobotFileOptions):
    """Where the results go, and which file describes the robot."""


def _of_robot(file: RobotFile) -> DescribedRobot:
    return DescribedRobot(robot=file.robot)


def command(argv: Sequence[str]) -> int:
    """Describe the robot, and write the diagram and the bill.

    Raises:
        AntennateError: The robot or the folder cannot be used.
    """
    config, options = parse_robot("robot", DESCRIPTION, _of_robot, argv, Options)
    robot = config.robot
    with folder_for(VIEW, options, config, argv) as folder:
        from antennate.robots.wiring import wiring  # slow to import

        folder.without_trials()
        parts = [asdict(part) for part in bill(robot)]
        folder.write("bom.csv", to_csv(parts))
        folder.write_figures({"wiring": wiring(robot)})
        result = {
            "schema": 1,
            "command": "robot",
            "joints": dict(_joints(robot)),
            "supply": asdict(supply(robot)),
            "bom": parts,
        }
        folder.finish(result)
        tell(result, options, VIEW.tables(result), VIEW.sentence(result))
    return OK


def _tables(result: Mapping[str, Any]) -> Sequence[Table]:
    power = _supply(result)
    rails = {
        f"{rail.voltage:g} V": {**asdict(rail), "servos": len(rail.ids)} for rail in power.rails
    }
    return (
        Table("Joints", _COLUMNS, _cells(result["joints"])),
        Table.of("Supply", rails, _RAIL, _note(power)),
    )


def _supply(result: Mapping[str, Any]) -> Supply:
    found = result["supply"]
    return Supply(**{**found, "rails": tuple(Rail(**rail) for rail in found["rails"])})


def _joints(robot: RobotSpec) -> Iterator[tuple[str, dict[str, Any]]]:
    servos, modes = servos_of(robot), robot.modes
    for name, number, servo, zero, direction in zip(
        robot.joint_names, robot.ids, servos, robot.zeros, robot.directions, strict=True
    ):
        mode = "extended position" if modes[number] == EXTENDED_MODE else "position"
        row = {"id": number, "servo": servo.product, "mode": mode, "zero": zero}
        yield name, row | {"direction": direction}


def _cells(joints: dict[str, dict[str, Any]]) -> list[tuple[str, list[str]]]:
    return [(name, [str(row[key]) for key in _COLUMNS]) for name, row in joints.items()]


def _note(power: Supply) -> str:
    return (
        f"A plug of a servo's cable carries at most 3 A: feed the chain for each {power.per_feed} "
        f"servos, at {power.feeds} places."
    )


def _sentence(result: Mapping[str, Any]) -> str:
    power = _supply(result)
    drawn = f"{power.walking:.1f} A while walking, at most {power.peak:.1f} A"
    return (
        f"{len(result['joints'])} servos draw {drawn}, and {power.stall:.1f} A if all of them "
        f"stall; fuse {power.fuse:g} A; a battery of 2.2 Ah lasts {60 * power.hours(2.2):.0f} min "
        "of walking."
    )


_CAPTIONS = {
    "wiring": "Servos in plan on their bus, head to the left, what feeds them, and the board."
}
VIEW = View("robot", DESCRIPTION, DescribedRobot, _tables, _sentence, captions=_CAPTIONS)
