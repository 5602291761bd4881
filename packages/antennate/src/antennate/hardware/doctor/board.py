"""The antenna board at rest: its greeting and its readings, and what they mean."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from antennate.antenna.curves import plateau_of
from antennate.control.conditioning import bending_level
from antennate.errors import CalibrationError
from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor import inertial
from antennate.hardware.doctor.bus_survey import master
from antennate.hardware.doctor.check import Finding, Opener
from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import BOARD_BAUD, Board
from antennate.hardware.esp32.clock import Timed
from antennate.hardware.esp32.wire import Counters, Hello, Reset, objections, require_sensor
from antennate.hardware.safety import channel as diagnosis
from antennate.hardware.safety.channel import WINDOW, Band, ChannelDiagnosis, Noise, noise_of
from antennate.messages import typed
from antennate.params.control import CurveParams
from antennate.params.hardware import DoctorParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats

_PATIENCE = 0.02
"""Longest wait for bytes before the time is looked at again [s]."""


@dataclass(slots=True)
class BoardSurvey:
    """What came from the board's port.

    Attributes:
        refusals: Why frames were refused.
        text: Printable text that came instead of frames.
        received: Bytes received.
        readings: Usable samples after the greeting.
        lost: Samples between them that never came.
        dropped: Samples that the board itself could not send meanwhile.
        broken: Pieces with a wrong CRC or code after the greeting.
        boots: Times it started anew meanwhile.
        servos: Whether servos answer on the port.
        radio: Whether the board sends by radio.
    """

    hello: Hello | None = None
    refusals: list[str] = field(default_factory=list[str])
    text: str = ""
    received: int = 0
    readings: list[Timed] = field(default_factory=list[Timed])
    lost: int = 0
    dropped: int = 0
    broken: int = 0
    boots: int = 0
    servos: bool = False
    radio: bool = False

    @property
    def counts(self) -> Floats:
        """Readings of both antennae [counts], shape (n, 2)."""
        pairs = [(r.sample.left, r.sample.right) for r in self.readings]
        return np.array(pairs, float).reshape(-1, 2)

    @property
    def rate(self) -> float | None:
        """Samples per second as they arrived [Hz], None of fewer than two."""
        span = self.readings[-1].arrived - self.readings[0].arrived if self.readings else 0.0
        return (len(self.readings) - 1) / span if span > 0 else None

    def result(self) -> dict[str, Any]:
        """Findings of the board for result.json."""
        counts, hello = self.counts, self.hello
        known = len(counts) > 0
        return {
            "device_id": None if hello is None else hello.device_id,
            "firmware": None if hello is None else list(hello.firmware),
            "reset": None if hello is None else hello.reset.name,
            "rate_hz": self.rate,
            "readings": len(counts),
            "lost": self.lost,
            "broken": self.broken,
            "median_counts": np.median(counts, axis=0).tolist() if known else None,
            "noise_counts": counts.std(axis=0).tolist() if known else None,
        }


def survey_board(
    opener: Opener, robot: RobotSpec, params: DoctorParams, now: Callable[[], float]
) -> BoardSurvey:
    """Wait for a greeting and read for a while; without one, see whether servos are there."""
    survey = BoardSurvey()
    with opener(BOARD_BAUD) as port:
        port.drain()
        board = Board(port)
        end = now() + params.greeting
        while (board.hello is None or board.clock.newest is None) and now() < end:
            board.wait(_PATIENCE, now)
        if board.hello is not None:
            _read(board, survey, params.listen, now)
        survey.hello, survey.refusals = board.hello, board.refusals
        survey.text, survey.received = board.decoder.take_text(), board.decoder.counters.received
    if survey.hello is None and not survey.refusals:
        with master(opener, robot.baud, now) as bus:
            survey.servos = bool(bus.scan())
    return survey


def _read(board: Board, survey: BoardSurvey, seconds: float, now: Callable[[], float]) -> None:
    counters, clock = board.decoder.counters, board.clock
    broken, boots, lost = _broken(counters), clock.resets, clock.sequence.lost
    end = now() + seconds
    while now() < end:
        survey.readings += board.wait(_PATIENCE, now)
    survey.boots = clock.resets - boots
    survey.lost = clock.sequence.lost - (0 if survey.boots else lost)
    survey.broken = _broken(counters) - broken
    if survey.readings and not survey.boots:
        first, last = survey.readings[0].sample, survey.readings[-1].sample
        survey.dropped = (last.drops - first.drops) % (1 << 16)


def _broken(counters: Counters) -> int:
    return counters.crc_errors + counters.cobs_errors + counters.oversize + counters.noise


_LONGEST_TEXT = 60
_COPY = "copy the three files of firmware/ to the board again"
_CURES = {
    diagnosis.Finding.OPEN: "the wire of this antenna is broken, or its plug is out",
    diagnosis.Finding.SHORT_LO: "the sensor is torn off its wire, its plug is out, or it is "
    "shorted to ground",
    diagnosis.Finding.SHORT_HI: "the wire of this antenna is shorted to the supply",
    diagnosis.Finding.STUCK: "the converter always gives one value: reset the board, check "
    "the pin; if it is the highest value, set its attenuation",
    diagnosis.Finding.NOISE: "keep its wires away from mains, motors and servo cables, join the "
    "grounds, put 100 nF from pin to ground; an open wire hums, too",
    diagnosis.Finding.SATURATED: "let the antenna straighten; then choose another divider resistor",
    diagnosis.Finding.OUT_OF_CAL: f"calibrate this antenna again: `{typed('record')}`, "
    f"`{typed('calibrate')}`",
}
_RADIO = (
    "if it is quiet by cable, the radio disturbs the converter: put 100 nF from each pin to ground "
    "and the antenna of the radio away from the wires; or calibrate by radio"
)
_OFTEN = 0.1
"""Share of the readings that makes an antenna bad, although most of them are good."""
_DEGRADED = (diagnosis.Finding.OUT_OF_CAL, diagnosis.Finding.SPIKY, diagnosis.Finding.SATURATED)


def findings(board: BoardSurvey, config: DoctorConfig) -> Iterator[tuple[Finding, str, str]]:
    """Each with the name of its check and what would be good, in the order to be shown."""
    hello = board.hello
    yield _greeting(board), "greeting", f"within {config.doctor.greeting:g} s"
    if hello is None:
        return
    least = f"{_version(frame.FIRMWARE)} or newer, protocol {frame.PROTOCOL}"
    version = f"{_version(hello.firmware)}, protocol {frame.PROTOCOL}"
    yield Finding(version, "bad" if objections(hello) else "ok", _COPY), "firmware", least
    yield _boot(board, hello), "boot", "once, not by its watchdog"
    rate, error = config.limits.rate, config.limits.rate_error
    low, high = rate * (1 - error), rate * (1 + error)
    yield _rate(board, low, high), "rate", f"{low:g} to {high:g} Hz"
    if board.readings:
        yield _lost(board), "lost samples", "none"
        cure = "use a shorter cable, away from motors; check the ground of the board"
        broken = Finding(str(board.broken), "warn" if board.broken else "ok", cure)
        yield broken, "broken frames", "none"
        for side, name in enumerate(("left", "right")[: config.robot.antenna_count or 2]):
            yield from _antenna(board, config, name, board.counts[:, side].tolist())
        yield from inertial.findings(board.readings, config)
    for sensor_id in dict.fromkeys((config.sensor_id, config.sensor_id_right)):
        try:
            require_sensor(hello, sensor_id)
        except CalibrationError:
            cure = "calibrate the antennae of this board, or name their file in calibration"
            other = Finding(f"board {hello.device_id}", "bad", cure)
            yield other, "sensors", f"on board {sensor_id}"


def _greeting(board: BoardSurvey) -> Finding:
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


def _version(numbers: tuple[int, ...]) -> str:
    return ".".join(map(str, numbers))


def _boot(board: BoardSurvey, hello: Hello) -> Finding:
    reason = hello.reset.name.lower().replace("_", " ")
    return Finding(
        f"{reason}, {board.boots} more boots" if board.boots else reason,
        "bad" if board.boots else "warn" if hello.reset is Reset.WATCHDOG else "ok",
        "check its supply and USB cable; if only the watchdog did it, copy firmware/ again",
    )


def _rate(board: BoardSurvey, low: float, high: float) -> Finding:
    if board.rate is None:
        return Finding("no samples", "bad", "reset the board")
    cure = "set RATE in firmware/config.py, or limits.rate"
    return Finding(f"{board.rate:.1f} Hz", "ok" if low <= board.rate <= high else "warn", cure)


def _lost(board: BoardSurvey) -> Finding:
    dropped = f", {board.dropped} not sent" if board.dropped else ""
    return Finding(
        f"{board.lost} of {board.lost + len(board.readings)}{dropped}",
        "warn" if board.lost or board.dropped else "ok",
        "use a shorter cable and no hub; end other programs on the port",
    )


def _antenna(
    board: BoardSurvey, config: DoctorConfig, name: str, counts: list[float]
) -> Iterator[tuple[Finding, str, str]]:
    """Findings on an antenna by its readings [counts]."""
    yield _noise(board, config, name, counts)
    try:
        reach, covered = config.reaches[name == "right"], config.limits.covered
        band = Band.of(_curve(config, name), reach, covered)
        channel = ChannelDiagnosis(band, config.limits.hum_time)
    except CalibrationError as error:
        wrong = Finding(str(error), "bad", "calibrate again, with another divider resistor")
        yield wrong, f"{name} calibration", "leaves the rails free"
        return
    seen: list[diagnosis.Finding] = []
    noise = ""
    for reading, value in zip(board.readings, counts, strict=True):
        seen.append(channel.step(1e-6 * reading.elapsed_us, value).finding)
        noise = channel.noise_text or noise
    shown, middle = _usual(seen), float(np.median(counts))
    low, high = _limits(_curve(config, name))
    if shown is diagnosis.Finding.OUT_OF_CAL and low <= middle <= high:
        shown = diagnosis.Finding.OK  # noise reaches beyond, which has a row of its own
    text = f"{shown.value}, {noise}" if shown is diagnosis.Finding.NOISE else shown.value
    signal = Finding(
        f"{text} ({middle:.0f} counts)",
        "ok" if shown is diagnosis.Finding.OK else "warn" if shown in _DEGRADED else "bad",
        _CURES.get(shown, "check plug, cable and divider of this antenna"),
    )
    plateau = plateau_of(np.array(counts))
    shorted = shown in (diagnosis.Finding.SHORT_LO, diagnosis.Finding.SHORT_HI)
    if plateau is not None and not shorted:
        signal = Finding(plateau.text("the readings"), "bad", _CURES[diagnosis.Finding.STUCK])
    yield signal, f"{name} antenna", "ok"
    if shown.usable:
        yield _at_rest(config, name, middle)


def _usual(seen: list[diagnosis.Finding]) -> diagnosis.Finding:
    """What a tenth of the readings say of a channel that is not usable, else most of them."""
    counted = Counter(seen[diagnosis.AGREE :] or seen)
    worse = [state for state in counted if not state.usable]
    commonest = max(worse, key=lambda state: counted[state], default=seen[-1])
    often = worse and counted[commonest] > _OFTEN * len(seen)
    return commonest if often else counted.most_common(1)[0][0]


def _usual_noise(readings: Sequence[float]) -> Noise:
    """Noise of many readings at rest: of a hum if most windows have one, else of them all."""
    starts = range(0, len(readings) - WINDOW + 1, WINDOW)
    parts = [noise_of(readings[start : start + WINDOW]) for start in starts]
    humming = [part for part in parts if part.hums]
    if parts and 2 * len(humming) > len(parts):
        return Noise(
            max(part.size for part in humming),
            float(np.median([part.frequency for part in humming])),
        )
    return Noise(0.5 * float(np.ptp(readings)) if readings else 0.0)


def _noise(
    board: BoardSurvey, config: DoctorConfig, name: str, counts: list[float]
) -> tuple[Finding, str, str]:
    """How noisy the readings are, also beside those of the calibration."""
    good = config.doctor
    before, right = good.calibrated_noise, good.calibrated_noise_right
    before = right if name == "right" and right is not None else before
    noise, usual = float(np.std(counts)), _usual_noise(counts)
    usually = max(before or 0.0, 1.0)
    louder = noise > good.noise_ratio * usually
    text, expected = f"{noise:.1f} counts", f"at most {good.noise:g} counts"
    cure = "leave the antenna alone; then check its plug, cable and ground"
    bad = noise > good.noise
    if bad and usual.hums and board.rate is not None:
        text += f": a hum of {usual.text(board.rate)}"
        cure = _CURES[diagnosis.Finding.NOISE]
    if before is not None:
        expected += f", {before:.1f} when it was calibrated"
        if louder:
            bad, text = True, f"{text}, {noise / usually:.0f} times that"
            cure = _RADIO if board.radio else cure
    return Finding(text, "warn" if bad else "ok", cure), f"{name} noise", expected


def _curve(config: DoctorConfig, name: str) -> CurveParams:
    """Curve of the antenna on a side; the right one may have its own."""
    both, right = config.control.conditioning, config.control.conditioning_right
    return right if right is not None and name == "right" else both


def _limits(curve: CurveParams) -> tuple[float, float]:
    """Readings that are within the calibrated range [counts]."""
    return curve.counts_low - diagnosis.MARGIN, curve.counts_high + diagnosis.MARGIN


def _at_rest(config: DoctorConfig, name: str, counts: float) -> tuple[Finding, str, str]:
    curve, threshold = _curve(config, name), config.control.rule.threshold
    low, high = _limits(curve)
    level = float(bending_level(curve, np.array(counts)))
    finding = Finding(
        f"{counts:.0f} counts, b = {level:.2f}",
        "bad" if level >= threshold else "ok" if low <= counts <= high else "warn",
        f"straighten the antenna; if it is straight, `{typed('record')}` and "
        f"`{typed('calibrate')}`, and put the new curve into [control.conditioning]",
    )
    return finding, f"{name} at rest", f"{low:.0f} to {high:.0f} counts, b below {threshold:g}"
