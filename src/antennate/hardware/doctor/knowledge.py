"""Numbers of the robot itself: measured, stated in its file, or assumed. No port is asked."""

from __future__ import annotations

import math
from collections.abc import Iterator

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.check import Finding, Row, ids_text
from antennate.hardware.joints import unmeasured
from antennate.messages import typed
from antennate.params.base import changes
from antennate.params.control import ConditioningParams
from antennate.robots.spec import RobotSpec

_SUPPLY = ("limits.supply_warn", "limits.supply_hold", "limits.supply_off")


def rows(config: DoctorConfig, bus: bool, esp32: bool) -> Iterator[Row]:
    """A row for each number that a command would assume, of the ports that are looked at."""
    robot = config.robot
    if bus:
        yield _zeros(config).row("robot", "zeros and directions", "measured")
        yield _ids(robot).row("robot", "ids", "in its file")
        yield _limits(robot).row("robot", "joint limits", "in its file")
        yield _supply(config).row("robot", "limits of the supply", "in its file")
    if esp32 and robot.antenna_count:
        for side in ("left", "right"):
            yield _curve(config, side).row("robot", f"{side} calibration", "of this antenna")
    if esp32 and robot.has_imu:
        cure = "see IMU_AXES in firmware/config.py, robot.imu.gyro_step and accel_step"
        axes = Finding("assumed: x, y and steps; at rest only z is seen", "note", cure)
        yield axes.row("robot", "inertial axes", "as mounted")


def _zeros(config: DoctorConfig) -> Finding:
    names = unmeasured(config.robot, config.zeros)
    if names:
        some = f": {', '.join(names)}" if len(names) < len(config.robot.ids) else ""
        return Finding(f"not measured{some}", "bad", f"run `{typed('zero')}`; nothing walks before")
    date = config.zeros.measured
    return Finding(f"measured on {date}" if date else "stated in its file, without a date")


def _ids(robot: RobotSpec) -> Finding:
    if not (names := robot.unstated("ids")):
        return Finding("in its file")
    ids = ids_text(i for i, n in zip(robot.ids, robot.joint_names, strict=True) if n in names)
    cure = f"`{typed('setup')}` and `{typed('zero')}` write them"
    return Finding(f"assumed: {ids}, in the order of the joints", "warn", cure)


def _limits(robot: RobotSpec) -> Finding:
    assumed: list[str] = []
    for name, group, count in robot.groups:
        if count and not math.isinf(group.largest) and not any(changes(group, ["limit"])):
            limit = robot.limits[robot.places(name).start]
            assumed.append(f"{name} {math.degrees(limit):.0f} deg")
    text = f"assumed: {', '.join(assumed)}" if assumed else "in its file"
    cure = "set robot.*.limit to where these joints meet their stops"
    return Finding(text, "note" if assumed else "ok", cure)


def _supply(config: DoctorConfig) -> Finding:
    levels = config.limits
    text = f"{levels.supply_warn:g}, {levels.supply_hold:g} and {levels.supply_off:g} V"
    if any(changes(config, _SUPPLY)):
        return Finding(text)
    cure = f"set {', '.join(_SUPPLY)} to what your supply needs"
    return Finding(f"assumed: three lithium cells, {text}", "note", cure)


def _curve(config: DoctorConfig, side: str) -> Finding:
    control = config.control
    if side == "right" and control.conditioning_right is not None:
        return Finding("its own curve")
    if not any(changes(control.conditioning, set(ConditioningParams.model_fields) - _NO_CURVE)):
        cure = f"`{typed('record')}` and `{typed('calibrate')}`, then calibration = FILE"
        return Finding("assumed: the curve of the simulated antenna", "warn", cure)
    if side == "left":
        return Finding("its own curve")
    cure = "set calibration_right to the file of the right antenna, or to that of the left"
    return Finding("assumed: the curve of the left antenna", "note", cure)


_NO_CURVE = {"averaging_time"}
