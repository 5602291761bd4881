"""The inertial sensor of a board at rest: whether it answers, what it says of up and of turns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.check import Finding
from antennate.hardware.esp32.board import imu_counts
from antennate.hardware.esp32.clock import Timed
from antennate.hardware.safety.imu import ImuDiagnosis, ImuFinding
from antennate.params.scene import GRAVITY

_WIRES = (
    "check its wires and its supply of 3.3 V; PIN_SDA, PIN_SCL, IMU_ADDRESS and IMU_AXES in "
    "firmware/config.py, and that imu.py lies on the board: as it starts it says in a line what it "
    "cannot use"
)
_CURES = {
    ImuFinding.MISSING: _WIRES,
    ImuFinding.STUCK: "switch the board off and on; then change the sensor",
    ImuFinding.RAILED: "leave the robot alone; then change the sensor",
}
_MOUNTED = (
    "stand the robot level and leave it alone; IMU_AXES in firmware/config.py says how the sensor "
    "is mounted, robot.imu.accel_step what a count is"
)
_OFTEN = 0.1
"""Share of the readings that makes it bad, although most of them are good."""
_MOSTLY = 0.7
"""Share of gravity along an axis that points up, 45 degrees off at most."""


def findings(readings: Sequence[Timed], config: DoctorConfig) -> Iterator[tuple[Finding, str, str]]:
    """Each with the name of its check and what would be good; none where there is no sensor."""
    sends = any(reading.sample.imu for reading in readings)
    if not config.robot.has_imu:
        if sends:
            cure = (
                'to use it, set kind = "head" under [robot.imu] of robot.toml, or under [imu] of '
                "the file of the robot"
            )
            yield Finding("answers, and nothing reads it", "warn", cure), "inertial sensor", "none"
        return
    if not sends:
        cure = "set PIN_SDA and PIN_SCL in firmware/config.py, or robot.imu.kind to none"
        yield Finding("none on this board", "warn", cure), "inertial sensor", "ok"
        return
    diagnosis, good = ImuDiagnosis(config.robot.imu), list[np.ndarray]()
    for reading in readings:
        diagnosis.step(1e-6 * reading.elapsed_us, imu_counts(reading.sample.imu))
        if diagnosis.finding is ImuFinding.OK:
            felt = diagnosis.angular_velocity[0], diagnosis.linear_acceleration[0]
            good.append(np.concatenate(felt))
    counted = diagnosis.counted
    worst = max(_CURES, key=lambda finding: counted[finding])
    shown = worst if counted[worst] > _OFTEN * len(readings) else ImuFinding.OK
    lost = f" ({counted[worst]} of {len(readings)} readings)" if shown is worst else ""
    grade = "ok" if shown is ImuFinding.OK else "warn"
    text = f"{shown.value}{lost}{_missed(readings)}"
    yield Finding(text, grade, _CURES.get(shown, "")), "inertial sensor", "ok"
    if shown is ImuFinding.OK:
        yield from _at_rest(np.mean(good, axis=0), config)


def _missed(readings: Sequence[Timed]) -> str:
    """Readings that the sensor has not given since the board began, also those of lost samples."""
    misses = readings[-1].sample.misses
    return f", {misses} missed since the board began" if misses else ""


def _upwards(force: np.ndarray) -> str:
    """The axis that points up by a specific force, shape (3,), with its sign; z is none to name."""
    axis = int(abs(force).argmax())
    if abs(force[axis]) < _MOSTLY * GRAVITY:
        return ""
    name = f"{'-' if force[axis] < 0.0 else ''}{'xyz'[axis]}"
    return "" if name == "z" else f", so {name} points up"


def _at_rest(felt: np.ndarray, config: DoctorConfig) -> Iterator[tuple[Finding, str, str]]:
    """What a robot that stands feels, shape (6,)."""
    turning, force = np.degrees(felt[:3]), felt[3:]
    error = config.doctor.gravity_error
    away = np.linalg.norm(force - [0.0, 0.0, GRAVITY])
    up = Finding(
        f"{', '.join(f'{part:.2f}' for part in force)} m/s²{_upwards(force)}",
        "ok" if away <= error * GRAVITY else "warn",
        _MOUNTED,
    )
    yield up, "upwards", f"0, 0, {GRAVITY:g} m/s² within {100 * error:g} %"
    most = np.degrees(config.doctor.turning)
    still = Finding(
        f"{', '.join(f'{part:.1f}' for part in turning)} deg/s",
        "ok" if abs(turning).max() <= most else "warn",
        "leave the robot alone; then change the sensor",
    )
    yield still, "turning", f"at most {most:.1f} deg/s"
