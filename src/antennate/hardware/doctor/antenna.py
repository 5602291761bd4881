"""What it means that an antenna board says so: one row for each check."""

from __future__ import annotations

import numpy as np

from antennate.control.conditioning import bending_level
from antennate.errors import CalibrationError
from antennate.hardware.doctor.hearing import Heard
from antennate.hardware.doctor.rows import Row, Verdict, row
from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.film import require_film
from antennate.hardware.esp32.wire import Hello, Reset, objections
from antennate.hardware.safety.diagnosis import Band, ChannelDiagnosis, Finding
from antennate.params import ControlParams, DiagnosisParams, DoctorParams, SupervisorParams

_PART = "esp32"
_LONGEST_TEXT = 60
SIDES = ("left", "right")
_DEGRADED = (Finding.OUT_OF_CAL, Finding.SPIKY, Finding.SATURATED)


def board_rows(
    heard: Heard,
    control: ControlParams,
    limits: SupervisorParams,
    params: DoctorParams,
    diagnosis: DiagnosisParams | None = None,
) -> list[Row]:
    """All rows of a board; those about readings only if any came."""
    rows = [_greeting(heard, params)]
    if heard.hello is None:
        return rows
    rows += [_firmware(heard.hello), _boot(heard, heard.hello), _rate(heard, limits)]
    if heard.readings:
        rows += [_losses(heard), _crc(heard)]
        for side, name in enumerate(SIDES):
            rows += _channel(heard, side, name, control, params, diagnosis or DiagnosisParams())
    return rows


def film_rows(hello: Hello | None, sensor_id: str | None) -> list[Row]:
    """Whether the calibrated films are those of this board, where their id names a board."""
    try:
        require_film(hello, sensor_id)
    except CalibrationError:
        found = "" if hello is None else hello.device_id
        cure = "calibrate the films of this board, or name their file in calibration"
        return [Row(_PART, "films", f"on board {sensor_id}", f"board {found}", "bad", cure)]
    return []


def _greeting(heard: Heard, params: DoctorParams) -> Row:
    expected = f"within {params.greeting:g} s"
    if heard.hello is not None:
        found = f"board {heard.hello.device_id}"
        return Row(_PART, "greeting", expected, found, "ok")
    if heard.servos:
        cure = "swap the ports of --esp32 and --bus"
        return Row(_PART, "greeting", expected, "servos are on this port", "bad", cure)
    if heard.refusals:
        cure = "copy the three files of firmware/ to the board again"
        return Row(_PART, "greeting", expected, heard.refusals[-1], "bad", cure)
    if heard.text:
        said = " ".join(heard.text.split())[:_LONGEST_TEXT]
        cure = "its program does not run: copy the files of firmware/ to the board and reset it"
        return Row(_PART, "greeting", expected, f"text: {said!r}", "bad", cure)
    if heard.received:
        cure = "check that this is the antenna board, with the program of firmware/ on it"
        return Row(_PART, "greeting", expected, f"{heard.received} bytes, no frame", "bad", cure)
    cure = "check its cable and power, press its reset button, copy firmware/ to it"
    return Row(_PART, "greeting", expected, "nothing", "bad", cure)


def _firmware(hello: Hello) -> Row:
    has, needs = (".".join(map(str, v)) for v in (hello.firmware, frame.FIRMWARE))
    bad: Verdict | None = "bad" if objections(hello) else None
    return row(
        _PART,
        "firmware",
        f"{needs} or newer, protocol {frame.PROTOCOL}",
        f"{has}, protocol {frame.PROTOCOL}",
        bad,
        "copy the three files of firmware/ to the board again",
    )


def _boot(heard: Heard, hello: Hello) -> Row:
    reason = hello.reset.name.lower().replace("_", " ")
    found = f"{reason}, {heard.boots} more boots" if heard.boots else reason
    watchdog = hello.reset is Reset.WATCHDOG
    return row(
        _PART,
        "boot",
        "once, not by its watchdog",
        found,
        "bad" if heard.boots else "warn" if watchdog else None,
        "check its supply and USB cable; if only the watchdog did it, copy firmware/ again",
    )


def _rate(heard: Heard, limits: SupervisorParams) -> Row:
    low, high = (limits.rate * (1 + sign * limits.rate_error) for sign in (-1, 1))
    rate = heard.rate
    wrong = rate is None or not low <= rate <= high
    return row(
        _PART,
        "rate",
        f"{low:g} to {high:g} Hz",
        "no samples" if rate is None else f"{rate:.1f} Hz",
        "bad" if rate is None else "warn" if wrong else None,
        "reset the board" if rate is None else "set RATE in firmware/config.py, or limits.rate",
    )


def _losses(heard: Heard) -> Row:
    dropped = f", {heard.dropped} not sent" if heard.dropped else ""
    return row(
        _PART,
        "lost samples",
        "none",
        f"{heard.lost} of {heard.lost + len(heard.readings)}{dropped}",
        "warn" if heard.lost or heard.dropped else None,
        "use a shorter cable and no hub; end other programs on the port",
    )


def _crc(heard: Heard) -> Row:
    return row(
        _PART,
        "broken frames",
        "none",
        str(heard.broken),
        "warn" if heard.broken else None,
        "use a shorter cable, away from motors; check the ground of the board",
    )


def _channel(
    heard: Heard,
    side: int,
    name: str,
    control: ControlParams,
    params: DoctorParams,
    diagnosis: DiagnosisParams,
) -> list[Row]:
    counts, curve = heard.counts[:, side], control.conditioning
    noise, middle = float(counts.std()), float(np.median(counts))
    rows = [
        row(
            _PART,
            f"{name} noise",
            f"at most {params.noise:g} counts",
            f"{noise:.1f} counts",
            "warn" if noise > params.noise else None,
            "leave the antenna alone; then check its plug, cable and ground",
        )
    ]
    try:
        judge = ChannelDiagnosis(
            diagnosis, Band(curve.counts_low, curve.counts_high, curve.polarity)
        )
    except CalibrationError as error:
        return [
            *rows,
            Row(
                _PART,
                f"{name} calibration",
                "leaves the rails free",
                str(error),
                "bad",
                "calibrate again, with another divider resistor",
            ),
        ]
    for reading, value in zip(heard.readings, counts.tolist(), strict=True):
        judge.step(1e-6 * reading.timed.elapsed_us, value)
    finding = judge.reading.finding
    verdict: Verdict = "ok" if finding is Finding.OK else "warn" if finding in _DEGRADED else "bad"
    rows.append(
        row(
            _PART,
            f"{name} antenna",
            "ok",
            f"{finding.value} ({middle:.0f} counts)",
            verdict,
            _CURES.get(finding, "check plug, cable and divider of this antenna"),
        )
    )
    if finding.usable:
        rows.append(_calibration(name, middle, control, diagnosis.margin))
    return rows


_CURES = {
    Finding.OPEN: "the wire of this antenna is broken, or its plug is out",
    Finding.SHORT_LO: "the film is torn off its wire, its plug is out, or it is shorted to ground",
    Finding.SHORT_HI: "the wire of this antenna is shorted to the supply",
    Finding.STUCK: "a converter that always says the same: reset the board, check the pin",
    Finding.SATURATED: "let the antenna straighten; then choose another divider resistor",
    Finding.OUT_OF_CAL: "calibrate this antenna again: `antennate record`, `antennate calibrate`",
}


def _calibration(name: str, counts: float, control: ControlParams, margin: float) -> Row:
    curve = control.conditioning
    low, high = curve.counts_low - margin, curve.counts_high + margin
    level = float(bending_level(curve, np.array(counts)))
    touched = level >= control.rule.threshold
    outside = not low <= counts <= high
    return row(
        _PART,
        f"{name} at rest",
        f"{low:.0f} to {high:.0f} counts, b below {control.rule.threshold:g}",
        f"{counts:.0f} counts, b = {level:.2f}",
        "bad" if touched else "warn" if outside else None,
        "straighten the antenna; if it is straight, `antennate record` and `antennate calibrate`, "
        "and put the new curve into [control.conditioning]",
    )
