"""Numbers of the robot itself: measured, stated in its file, or assumed. No port is asked."""

from __future__ import annotations

import math
from collections.abc import Iterator

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.check import Finding, Grade, Row, ids_text
from antennate.hardware.joints import unmeasured
from antennate.messages import typed
from antennate.params.base import changes
from antennate.params.control import CurveParams

_SUPPLY = ("limits.supply_warn", "limits.supply_hold", "limits.supply_off")


def rows(config: DoctorConfig, bus: bool, esp32: bool) -> Iterator[Row]:
    """A row for each number that would be assumed, of the ports that are looked at."""
    robot = config.robot
    if bus:
        yield _zeros(config)
        ids = f"{ids_text(robot.ids)} in the order of the joints" if robot.unstated("ids") else ""
        yield _row("ids", ids, f"`{typed('setup')}` and `{typed('zero')}` write them", "warn")
        cure = "set robot.*.limit to where these joints meet their stops"
        yield _row("joint limits", _limits(config), cure)
        levels = ", ".join(f"{getattr(config.limits, name.split('.')[1]):g}" for name in _SUPPLY)
        cells = "" if any(changes(config, _SUPPLY)) else f"three lithium cells, {levels} V"
        yield _row("supply limits", cells, f"set {', '.join(_SUPPLY)} to what your supply needs")
    if esp32 and robot.antenna_count:
        yield from _curves(config)
    if esp32 and robot.has_imu:
        cure = "see IMU_AXES in firmware/config.py, robot.imu.gyro_step and accel_step"
        yield _row("inertial axes", "x, y and steps; at rest only z is seen", cure)


def _row(check: str, assumed: str, cure: str, grade: Grade = "note") -> Row:
    """What is assumed of a number, nothing if its file has it."""
    finding = Finding(f"assumed: {assumed}", grade, cure) if assumed else Finding("in its file")
    return finding.row("robot", check, "in its file")


def _zeros(config: DoctorConfig) -> Row:
    names, date = unmeasured(config.robot, config.zeros), config.zeros.measured
    finding = Finding(f"measured on {date}" if date else "in its file, without a date")
    if names:
        some = f": {', '.join(names)}" if len(names) < len(config.robot.ids) else ""
        finding = Finding(f"not measured{some}", "bad", f"run `{typed('zero')}`")
    return finding.row("robot", "zeros and directions", "measured")


def _limits(config: DoctorConfig) -> str:
    """Limits that no file has, in words."""
    robot = config.robot
    return ", ".join(
        f"{name} {math.degrees(robot.limits[robot.places(name).start]):.0f} deg"
        for name, group, count in robot.groups
        if count and math.isfinite(group.largest) and not any(changes(group, ["limit"]))
    )


def _curves(config: DoctorConfig) -> Iterator[Row]:
    control, cure = config.control, f"`{typed('record')}`, `{typed('calibrate')}`, then calibration"
    own = any(changes(control.conditioning, CurveParams.model_fields))
    left = "" if own else "that of a simulated antenna"
    yield _row("left calibration", left, f"{cure} = FILE", "warn")
    right = "" if control.conditioning_right else left or "that of the left one"
    yield _row("right calibration", right, f"{cure}_right = FILE", "warn" if left else "note")
