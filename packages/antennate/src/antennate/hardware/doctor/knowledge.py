"""Numbers of the robot itself: measured, stated in its file, or assumed. No port is asked."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.check import Finding, Grade, Row, ids_text
from antennate.hardware.joints import unmeasured
from antennate.messages import typed
from antennate.params.control import CurveParams
from antennate.robots.parts import supply


def rows(config: DoctorConfig, bus: bool, esp32: bool) -> Iterator[Row]:
    """A row for each number that would be assumed, of the ports that are looked at."""
    robot, control = config.robot, config.control
    ids = [i for n, group, _ in robot.groups if not group.ids for i in robot.ids[robot.places(n)]]
    limits = (
        f"{name} {math.degrees(robot.limits[robot.places(name).start]):.0f} deg"
        for name, group, count in robot.groups
        if count and math.isfinite(group.largest) and _unstated(group, "limit")
    )
    cells = bus and supply(robot).on_cells
    volts = _unstated(config.limits, "supply_warn", "supply_hold", "supply_off")
    left, right = _curve(control.conditioning), control.conditioning_right
    other = _curve(right) if right else left or "that of the left one"
    axes = ", ".join(["x", "y", *_unstated(robot.imu, "gyro_step", "accel_step")])
    curve = f"`{typed('record')}`, `{typed('calibrate')}`, then calibration"
    sided, both = (esp32 and robot.antenna_count >= count for count in (1, 2))
    table: tuple[tuple[Any, str, Any, Grade, str], ...] = (
        (bus, "ids", ids and f"{ids_text(ids)} in the order of the joints", "warn",
         f"`{typed('setup')}` and `{typed('zero')}` write them"),
        (bus, "joint limits", ", ".join(limits), "note", "set robot.*.limit to where they stop"),
        (cells, "supply limits", volts and f"{', '.join(volts)} V, of three lithium cells", "note",
         "set limits.supply_warn, supply_hold and supply_off to what your supply needs"),
        (sided, "left calibration", left, "warn", f"{curve} = FILE"),
        (both, "right calibration", other, "warn" if right or left else "note",
         f"{curve}_right = FILE"),
        (esp32 and robot.has_imu, "inertial axes", f"{axes}; at rest only z is seen", "note",
         "see IMU_AXES in firmware/config.py, robot.imu.gyro_step and accel_step"),
    )  # fmt: skip
    if bus:
        yield _zeros(config)
    for check, lack, grade, cure in (row[1:] for row in table if row[0]):
        finding = Finding(f"assumed: {lack}", grade, cure) if lack else Finding("in its file")
        yield finding.row("robot", check, "in its file")


def _zeros(config: DoctorConfig) -> Row:
    names, date = unmeasured(config.robot, config.zeros), config.zeros.measured
    some = f": {', '.join(names)}" if len(names) < len(config.robot.ids) else ""
    known = Finding(f"measured on {date}" if date else "in its file, without a date")
    lack = Finding(f"not measured{some}", "bad", f"run `{typed('zero')}`")
    return (lack if names else known).row("robot", "zeros and directions", "measured")


def _unstated(group: Any, *names: str) -> list[str]:
    """Which of these parameters no file states, with the values that they have then."""
    return [f"{n} {getattr(group, n)}" for n in names if n not in group.model_fields_set]


def _curve(curve: CurveParams) -> str:
    """Numbers of a curve that no file states, in words."""
    read = ("polarity", "counts_low", "counts_high", "midpoint", "slope")[: 3 if curve.knots else 5]
    lack = _unstated(curve, *read)
    return f"{'that' if len(lack) == 5 else ', '.join(lack)} of a simulated antenna" if lack else ""
