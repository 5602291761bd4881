"""What a survey of an antenna board means: the board itself, its wire, and each antenna."""

from __future__ import annotations

import numpy as np

from antennate.control.conditioning import bending_level
from antennate.errors import CalibrationError
from antennate.hardware.doctor.board_survey import BoardSurvey
from antennate.hardware.doctor.check import Check, Finding
from antennate.hardware.doctor.config import DoctorConfig
from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import Reset, objections, require_sensor
from antennate.hardware.safety import diagnosis
from antennate.hardware.safety.diagnosis import Band, ChannelDiagnosis

_LONGEST_TEXT = 60
_COPY = "copy the three files of firmware/ to the board again"
_CURES = {
    diagnosis.Finding.OPEN: "the wire of this antenna is broken, or its plug is out",
    diagnosis.Finding.SHORT_LO: "the sensor is torn off its wire, its plug is out, or it is "
    "shorted to ground",
    diagnosis.Finding.SHORT_HI: "the wire of this antenna is shorted to the supply",
    diagnosis.Finding.STUCK: "the converter always gives one value: reset the board, check the pin",
    diagnosis.Finding.SATURATED: "let the antenna straighten; then choose another divider resistor",
    diagnosis.Finding.OUT_OF_CAL: "calibrate this antenna again: `antennate record`, "
    "`antennate calibrate`",
}
_DEGRADED = (diagnosis.Finding.OUT_OF_CAL, diagnosis.Finding.SPIKY, diagnosis.Finding.SATURATED)


def checks(board: BoardSurvey, robot: DoctorConfig) -> list[Check[BoardSurvey]]:
    """The checks for which there is something to look at, in the order in which they are shown."""
    found = [_GREETING]
    if board.hello is not None:
        found += _BOARD
        if board.readings:
            found += _WIRE
            for side, name in enumerate(("left", "right")):
                found += _antenna(board, robot, name, board.counts[:, side].tolist())
    try:
        require_sensor(board.hello, robot.sensor_id)
    except CalibrationError:
        found.append(_SENSORS)
    return found


def _greeting(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    if board.hello is not None:
        return Finding(f"board {board.hello.device_id}")
    if board.servos:
        return Finding("servos are on this port", "bad", "swap the ports of --esp32 and --bus")
    if board.refusals:
        return Finding(board.refusals[-1], "bad", _COPY)
    if board.text:
        text = " ".join(board.text.split())[:_LONGEST_TEXT]
        cure = "its program does not run: copy the files of firmware/ to the board and reset it"
        return Finding(f"text: {text!r}", "bad", cure)
    if board.received:
        cure = "check that this is the antenna board, with the program of firmware/ on it"
        return Finding(f"{board.received} bytes, no frame", "bad", cure)
    cure = "check its cable and power, press its reset button, copy firmware/ to it"
    return Finding("nothing", "bad", cure)


def _firmware(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    if board.hello is None:
        return Finding("none")
    found = f"{_version(board.hello.firmware)}, protocol {frame.PROTOCOL}"
    return Finding(found, "bad" if objections(board.hello) else "ok", _COPY)


def _version(numbers: tuple[int, ...]) -> str:
    return ".".join(map(str, numbers))


def _boot(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    reset = Reset.POWER_ON if board.hello is None else board.hello.reset
    reason = reset.name.lower().replace("_", " ")
    return Finding(
        f"{reason}, {board.boots} more boots" if board.boots else reason,
        "bad" if board.boots else "warn" if reset is Reset.WATCHDOG else "ok",
        "check its supply and USB cable; if only the watchdog did it, copy firmware/ again",
    )


def _rates(robot: DoctorConfig) -> tuple[float, float]:
    """Lowest and highest rate that is good [Hz]."""
    rate, error = robot.limits.rate, robot.limits.rate_error
    return rate * (1 - error), rate * (1 + error)


def _rate(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    if board.rate is None:
        return Finding("no samples", "bad", "reset the board")
    low, high = _rates(robot)
    cure = "set RATE in firmware/config.py, or limits.rate"
    return Finding(f"{board.rate:.1f} Hz", "ok" if low <= board.rate <= high else "warn", cure)


def _lost(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    dropped = f", {board.dropped} not sent" if board.dropped else ""
    return Finding(
        f"{board.lost} of {board.lost + len(board.readings)}{dropped}",
        "warn" if board.lost or board.dropped else "ok",
        "use a shorter cable and no hub; end other programs on the port",
    )


def _broken(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    cure = "use a shorter cable, away from motors; check the ground of the board"
    return Finding(str(board.broken), "warn" if board.broken else "ok", cure)


def _sensors(board: BoardSurvey, robot: DoctorConfig) -> Finding:
    device = "" if board.hello is None else board.hello.device_id
    cure = "calibrate the antennae of this board, or name their file in calibration"
    return Finding(f"board {device}", "bad", cure)


# one antenna


def _antenna(
    board: BoardSurvey, robot: DoctorConfig, name: str, counts: list[float]
) -> list[Check[BoardSurvey]]:
    """Checks of an antenna by its readings [counts]."""
    curve, noise, middle = robot.control.conditioning, float(np.std(counts)), np.median(counts)
    quiet = Finding(
        f"{noise:.1f} counts",
        "warn" if noise > robot.doctor.noise else "ok",
        "leave the antenna alone; then check its plug, cable and ground",
    )
    found = [_measured(f"{name} noise", f"at most {robot.doctor.noise:g} counts", quiet)]
    try:
        band = Band.of(curve, robot.reach)
        channel = ChannelDiagnosis(band)
    except CalibrationError as error:
        wrong = Finding(str(error), "bad", "calibrate again, with another divider resistor")
        return [*found, _measured(f"{name} calibration", "leaves the rails free", wrong)]
    for reading, value in zip(board.readings, counts, strict=True):
        channel.step(1e-6 * reading.elapsed_us, value)
    shown = channel.reading.finding
    signal = Finding(
        f"{shown.value} ({middle:.0f} counts)",
        "ok" if shown is diagnosis.Finding.OK else "warn" if shown in _DEGRADED else "bad",
        _CURES.get(shown, "check plug, cable and divider of this antenna"),
    )
    found.append(_measured(f"{name} antenna", "ok", signal))
    return [*found, _at_rest(robot, name, float(middle))] if shown.usable else found


def _at_rest(robot: DoctorConfig, name: str, counts: float) -> Check[BoardSurvey]:
    curve, threshold = robot.control.conditioning, robot.control.rule.threshold
    low, high = curve.counts_low - diagnosis.MARGIN, curve.counts_high + diagnosis.MARGIN
    level = float(bending_level(curve, np.array(counts)))
    finding = Finding(
        f"{counts:.0f} counts, b = {level:.2f}",
        "bad" if level >= threshold else "ok" if low <= counts <= high else "warn",
        "straighten the antenna; if it is straight, `antennate record` and `antennate calibrate`, "
        "and put the new curve into [control.conditioning]",
    )
    expected = f"{low:.0f} to {high:.0f} counts, b below {threshold:g}"
    return _measured(f"{name} at rest", expected, finding)


def _measured(name: str, expected: str, finding: Finding) -> Check[BoardSurvey]:
    return Check(name, expected, lambda board, robot: finding)


_GREETING: Check[BoardSurvey] = Check(
    "greeting", lambda board, robot: f"within {robot.doctor.greeting:g} s", _greeting
)
_BOARD = (
    Check("firmware", f"{_version(frame.FIRMWARE)} or newer, protocol {frame.PROTOCOL}", _firmware),
    Check("boot", "once, not by its watchdog", _boot),
    Check("rate", lambda board, robot: "{:g} to {:g} Hz".format(*_rates(robot)), _rate),
)
_WIRE = (Check("lost samples", "none", _lost), Check("broken frames", "none", _broken))
_SENSORS = Check("sensors", lambda board, robot: f"on board {robot.sensor_id}", _sensors)
