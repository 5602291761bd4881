"""What an antenna board says in a few seconds at rest, and what that means."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from antennate.conditioning import bending_level
from antennate.errors import CalibrationError
from antennate.hardware.doctor.rows import Opener, Row, Verdict, row
from antennate.hardware.doctor.survey import master
from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import BOARD_BAUD
from antennate.hardware.esp32.decoder import Counters
from antennate.hardware.esp32.stream import Reading, Stream
from antennate.hardware.esp32.wire import Hello, Reset, objections
from antennate.hardware.safety.diagnosis import Band, ChannelDiagnosis, Finding
from antennate.params import ControllerParams, DiagnosisParams, DoctorParams, SupervisorParams
from antennate.params.layout import LayoutParams
from antennate.records import Floats

_PART = "esp32"
_PATIENCE = 0.02
_LONGEST_TEXT = 60
SIDES = ("left", "right")
_DEGRADED = (Finding.OUT_OF_CAL, Finding.SPIKY, Finding.SATURATED)


@dataclass(slots=True)
class Heard:
    """What came from the board's port.

    Attributes:
        hello: Its greeting, None if none came.
        refusals: Why frames were refused.
        text: Printable text that came instead of frames.
        received: Bytes received.
        readings: Usable samples after the greeting.
        lost: Samples between them that never came.
        dropped: Samples that the board itself could not send meanwhile.
        broken: Pieces with a wrong CRC or code after the greeting.
        boots: Times it started anew meanwhile.
        servos: The port speaks as a bus of servos.
    """

    hello: Hello | None = None
    refusals: list[str] = field(default_factory=list[str])
    text: str = ""
    received: int = 0
    readings: list[Reading] = field(default_factory=list[Reading])
    lost: int = 0
    dropped: int = 0
    broken: int = 0
    boots: int = 0
    servos: bool = False

    @property
    def counts(self) -> Floats:
        """Readings of both antennae [counts], shape (n, 2)."""
        pairs = [(r.timed.sample.left, r.timed.sample.right) for r in self.readings]
        return np.array(pairs, float).reshape(-1, 2)

    @property
    def rate(self) -> float | None:
        """Samples per second as they arrived [Hz], None of fewer than two."""
        span = self.readings[-1].now - self.readings[0].now if self.readings else 0.0
        return (len(self.readings) - 1) / span if span > 0 else None


def listen(
    opener: Opener, layout: LayoutParams, params: DoctorParams, now: Callable[[], float]
) -> Heard:
    """Wait for a greeting and listen for a while; if none comes, see whether servos are there.

    Raises:
        PortError: The port is gone or cannot be opened.
    """
    heard = Heard()
    with opener(BOARD_BAUD) as port:
        port.drain()
        stream = Stream(port, now)
        end = now() + params.greeting
        while (stream.hello is None or stream.clock.newest is None) and now() < end:
            stream.take(_PATIENCE)
        if stream.hello is not None:
            _record(stream, heard, params.listen, now)
        heard.hello, heard.refusals = stream.hello, stream.refusals
        heard.text, heard.received = stream.decoder.take_text(), stream.decoder.counters.received
    if heard.hello is None and not heard.refusals:
        with opener(layout.baud) as port:
            heard.servos = bool(master(port, layout.baud, now).scan())
    return heard


def _record(stream: Stream, heard: Heard, seconds: float, now: Callable[[], float]) -> None:
    broken, boots, lost = _broken(stream.decoder.counters), stream.clock.resets, _lost(stream)
    end = now() + seconds
    while now() < end:
        heard.readings += stream.take(_PATIENCE)
    heard.boots = stream.clock.resets - boots
    heard.lost = _lost(stream) - (0 if heard.boots else lost)
    heard.broken = _broken(stream.decoder.counters) - broken
    if heard.readings and not heard.boots:
        first, last = heard.readings[0].timed.sample, heard.readings[-1].timed.sample
        heard.dropped = (last.drops - first.drops) % (1 << 16)


def _lost(stream: Stream) -> int:
    return stream.clock.sequence.lost


def _broken(counters: Counters) -> int:
    return counters.crc_errors + counters.cobs_errors + counters.oversize + counters.noise


def board_rows(
    heard: Heard,
    mind: ControllerParams,
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
            rows += _channel(heard, side, name, mind, params, diagnosis or DiagnosisParams())
    return rows


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
    mind: ControllerParams,
    params: DoctorParams,
    diagnosis: DiagnosisParams,
) -> list[Row]:
    counts, curve = heard.counts[:, side], mind.conditioning
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
        rows.append(_calibration(name, middle, mind, diagnosis.margin))
    return rows


_CURES = {
    Finding.OPEN: "the wire of this antenna is broken, or its plug is out",
    Finding.SHORT_LO: "the film is torn off its wire, its plug is out, or it is shorted to ground",
    Finding.SHORT_HI: "the wire of this antenna is shorted to the supply",
    Finding.STUCK: "a converter that always says the same: reset the board, check the pin",
    Finding.SATURATED: "let the antenna straighten; then choose another divider resistor",
    Finding.OUT_OF_CAL: "calibrate this antenna again: `antennate record`, `antennate calibrate`",
}


def _calibration(name: str, counts: float, mind: ControllerParams, margin: float) -> Row:
    curve = mind.conditioning
    low, high = curve.counts_low - margin, curve.counts_high + margin
    level = float(bending_level(curve, np.array(counts)))
    touched = level >= mind.rule.threshold
    outside = not low <= counts <= high
    return row(
        _PART,
        f"{name} at rest",
        f"{low:.0f} to {high:.0f} counts, b below {mind.rule.threshold:g}",
        f"{counts:.0f} counts, b = {level:.2f}",
        "bad" if touched else "warn" if outside else None,
        "straighten the antenna; if it is straight, `antennate record` and `antennate calibrate`, "
        "and put the new curve into [mind.conditioning]",
    )
