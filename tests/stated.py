"""A robot whose zeros and directions stand in its file: those of a twin that is built ideally."""

from __future__ import annotations

from antennate.robots.spec import RobotSpec

MIDDLE = 2048


def stated(robot: RobotSpec | None = None) -> RobotSpec:
    """The same robot, with zeros and directions of all its joints."""
    table = (robot or RobotSpec()).model_dump()
    for name, _, count in (robot or RobotSpec()).groups:
        known = {"zeros": (MIDDLE,) * count, "directions": (1,) * count}
        table[name] |= {what: table[name][what] or values for what, values in known.items()}
    return RobotSpec.model_validate(table)


def words(robot: RobotSpec | None = None) -> list[str]:
    """Flags of a command that state them."""
    told = [
        (f"--robot.{name}.{what}", getattr(group, what))
        for name, group, count in stated(robot).groups
        for what in ("zeros", "directions")
        if count
    ]
    return [word for flag, values in told for word in (flag, *map(str, values))]


STATED = words()
