"""Noise, hum, converters that stick, plateaus and drift are named, and healthy sensors are not."""

from __future__ import annotations

import csv
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import pytest
from doctor_rig import Patient, wrong
from hardware_rig import BAND, FREE, PERIOD
from twin_rig import simulation

from antennate.antenna.curves import Samples, plateau_of, white_noise
from antennate.antenna.fitting import check
from antennate.control.conditioning import bending_level
from antennate.control.loop import run_loop
from antennate.errors import CalibrationError
from antennate.experiments.calibrate.run import CalibrateConfig, run
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.hardware.config import DoctorConfig
from antennate.hardware.doctor.checkup import examine
from antennate.hardware.safety.channel import ChannelDiagnosis, Finding
from antennate.hardware.safety.signal_quality import SignalQuality
from antennate.params.control import ConditioningParams
from antennate.params.hardware import DoctorParams
from antennate.params.safety import SupervisorParams
from antennate.types import AntennaFrame, Contact, Floats, JointCommand

RECORDED = Path(__file__).parents[2] / "shared/data/flex_static_12bit/derived/flex_static.csv"
NOISE = 2.5
"""Of readings of a resting sensor [counts]."""


def hum(amplitude: float, frequency: float, n: int, phase: float = 1.0) -> Floats:
    """Readings of a straight sensor that hums, 100 a second."""
    t = PERIOD * np.arange(n)
    noise = np.random.default_rng(1).normal(0.0, NOISE, n)
    return np.rint(FREE + amplitude * np.sin(2 * np.pi * frequency * t + phase) + noise)


def told(readings: Floats) -> ChannelDiagnosis:
    """What a channel says after these."""
    channel = ChannelDiagnosis(BAND)
    for n, counts in enumerate(readings.tolist()):
        channel.step(n * PERIOD, counts)
    return channel


@pytest.mark.parametrize(
    ("amplitude", "frequency", "words"),
    [
        (400.0, 50.0, "50 Hz or an alias"),
        (120.0, 50.0, "50 Hz or an alias"),
        (400.0, 60.0, "40 or 60 Hz or an alias"),
        (400.0, 150.0, "50 Hz or an alias"),
        (200.0, 45.0, "45 or 55 Hz or an alias"),
    ],
)
def test_S14_a_hum_is_named_with_size_and_frequency(
    amplitude: float, frequency: float, words: str
) -> None:
    """At 100 samples a second f and 100 - f give the same readings (Nyquist), so both are said.

    Mains at half the rate give readings that alternate by amplitude times the sine of the phase.
    """
    before = hum(0.0, frequency, 50)
    phase = np.pi / 2 if frequency % 50 == 0 else 1.0
    channel = told(np.concatenate([before, hum(amplitude, frequency, 40, phase)]))
    assert channel.reading.finding is Finding.NOISE
    assert np.isnan(channel.reading.counts)
    assert words in channel.noise_text
    size = float(channel.noise_text.split()[0].removeprefix("±"))
    assert size == pytest.approx(amplitude, rel=0.1)


def test_S14_skipped_readings_do_not_change_the_frequency() -> None:
    """A busy host takes the newest reading alone: one of ten or so is never seen."""
    readings = hum(400.0, 50.0, 300, np.pi / 2)
    channel = ChannelDiagnosis(BAND)
    for n in np.flatnonzero(np.arange(300) % 13 != 0).tolist():
        channel.step(n * PERIOD, float(readings[n]))
        if n > 30 and channel.reading.finding is Finding.NOISE:
            assert channel.noise_text.endswith("at 50 Hz or an alias of it")
    assert channel.counted[Finding.NOISE] > 240


def beating(amplitude: float, frequency: float, n: int) -> tuple[ChannelDiagnosis, list[Finding]]:
    """What a channel finds in readings that a hum beats with, from where it is seen."""
    channel = ChannelDiagnosis(BAND)
    found = [
        channel.step(i * PERIOD, counts).finding
        for i, counts in enumerate(hum(amplitude, frequency, n, 0.3).tolist())
    ]
    return channel, found[found.index(Finding.NOISE) :]


@pytest.mark.parametrize("frequency", [49.95, 49.98, 50.02, 50.05])
@pytest.mark.parametrize("amplitude", [120.0, 400.0])
def test_S14_a_hum_stays_in_force_while_its_beat_hides_it(
    amplitude: float, frequency: float
) -> None:
    """Readings alternate by sin(2 pi (f - 50 Hz) t): mains of 50.02 Hz have a null every 25 s."""
    channel, found = beating(amplitude, frequency, 6000)
    assert len(found) > 5000
    assert set(found) == {Finding.NOISE}
    assert channel.noise_text.endswith("at 50 Hz or an alias of it")
    assert channel.noise.size == pytest.approx(amplitude, abs=4 * NOISE)


def test_S14_a_hum_that_ends_is_over_after_its_time_and_a_gap_does_not_end_it() -> None:
    """The next one is told by its own size."""
    channel, _ = beating(400.0, 50.02, 1000)
    quiet = hum(0.0, 50.0, 4000)
    found = [channel.step(10.0 + i * PERIOD, c).finding for i, c in enumerate(quiet[:1500])]
    assert channel.step(26.0, FREE).finding is Finding.NOISE  # 1 s without a reading
    assert channel.noise_text.startswith("±40")
    found += [channel.step(26.0 + i * PERIOD, c).finding for i, c in enumerate(quiet[1500:], 1)]
    over = found.index(Finding.OK)
    assert set(found[:over]) == {Finding.NOISE}
    assert set(found[over:]) == {Finding.OK}
    assert 10.0 + (over + 100) * PERIOD == pytest.approx(10.0 + 30.0, abs=0.2)
    assert channel.noise_text == ""
    channel.step(60.0, FREE)
    for i, counts in enumerate(hum(120.0, 50.0, 40, np.pi / 2).tolist()):
        channel.step(60.0 + (i + 1) * PERIOD, counts)
    assert channel.noise.size == pytest.approx(120.0, abs=4 * NOISE)


def test_S14_the_time_of_a_hum_is_a_parameter() -> None:
    quality = SignalQuality(ConditioningParams(), limits=SupervisorParams(hum_time=2.0))
    readings = np.concatenate([hum(400.0, 50.0, 100, np.pi / 2), hum(0.0, 50.0, 400)])
    found = []
    for n, counts in enumerate(readings.tolist()):
        quality.step(n * PERIOD, [counts, FREE], [Contact.FREE, Contact.FREE])
        found.append(quality.findings[0])
    assert set(found[100:295]) == {Finding.NOISE}
    assert set(found[315:]) == {Finding.OK}


def test_S14_noise_of_no_frequency_is_no_open_wire() -> None:
    """Normal noise of 250 counts; a floating pin wanders over all 4096."""
    noise = np.random.default_rng(2).normal(0.0, 250.0, 300)
    channel = told(np.rint(FREE + noise))
    assert channel.counted[Finding.NOISE] > 200
    assert channel.counted[Finding.OPEN] < 10


@pytest.mark.parametrize("frequency", [50.0, 50.02, 60.0])
def test_S14_the_doctor_names_a_hum_and_lets_nobody_drive(frequency: float) -> None:
    patient = Patient("esp32=hum:120")
    patient.robot.converter.mains = frequency
    checkup = patient.examine(bus=False)
    rows = wrong(checkup)
    assert checkup.grade == "bad"
    assert "noise that hides the flex sensor" in rows["esp32: left antenna"].found
    assert ("40 or 60 Hz" if frequency == 60.0 else "50 Hz") in rows["esp32: right noise"].found
    assert "mains" in rows["esp32: left noise"].cure


def test_S4_a_converter_whose_last_bit_toggles_is_stuck_after_150() -> None:
    channel = ChannelDiagnosis(BAND)
    toggles = np.random.default_rng(3).integers(-1, 2, 200) + 1800
    found = [channel.step(n * PERIOD, float(c)).finding for n, c in enumerate(toggles)]
    assert found.index(Finding.STUCK) == 149
    assert set(found[149:]) == {Finding.STUCK}


def sticky(n: int) -> Floats:
    """Readings as in esp-idf issue 164: sd 9.35, 38 of 45 are 3 mod 4."""
    rng = np.random.default_rng(4)
    readings = np.rint(FREE + rng.normal(0.0, 9.35, n))
    sticks = rng.random(n) < (38 / 45 - 0.25) / 0.75
    return np.where(sticks, 4 * np.rint((readings - 3) / 4) + 3, readings)


def test_S4_codes_that_stick_to_every_fourth_are_no_fault() -> None:
    readings = sticky(100_000)
    assert np.mean(readings % 4 == 3) == pytest.approx(38 / 45, abs=0.01)
    channel = told(readings)
    assert set(channel.counted) - {f for f, n in channel.counted.items() if not n} <= {
        Finding.OK,
        Finding.OUT_OF_CAL,
        Finding.LOST,
    }
    assert channel.counted[Finding.LOST] == 2
    assert plateau_of(readings) is None
    assert wrong(Patient("esp32=sticky").examine(bus=False)) == {}


def test_S4_the_doctor_names_a_converter_that_is_stuck_but_for_a_count() -> None:
    row = wrong(Patient("esp32=stuck_left").examine(bus=False))["esp32: left antenna"]
    assert row.grade == "bad"
    assert "stuck" in row.found
    assert "saturates" not in row.found


@pytest.mark.parametrize(
    "rate",
    [
        -30.0,
        -10.0,
        *(pytest.param(rate, marks=pytest.mark.slow) for rate in (-2.0, 2.0)),
        10.0,
        30.0,
    ],
)
def test_S7_drift_of_both_antennae_is_named_before_their_wires(rate: float) -> None:
    """A drift [counts/s] towards the bent end, or away from it, until the readings are refused."""
    quality, params = SignalQuality(ConditioningParams()), ConditioningParams()
    rng, drifted = np.random.default_rng(5), 0
    for n in range(60_000):
        counts = np.rint(FREE - rate * n * PERIOD + rng.normal(0.0, NOISE, 2))
        touches = bending_level(params, counts) > 0.5
        quality.step(n * PERIOD, counts.tolist(), touches.astype(int).tolist())
        drifted += "left" in quality.drifted and "right" in quality.drifted
        if Finding.OPEN in quality.findings:
            break
    assert Finding.OPEN in quality.findings
    assert drifted > 500


@pytest.mark.slow
def test_S7_S14_twenty_tunnels_give_no_alarm() -> None:
    """A robot that walks, touches, turns and backs out; the first two readings are not believed."""
    seen: Counter[str] = Counter()
    for trial in range(20):
        stage = simulation(TunnelConfig(seed=4242), "closed", trial)
        quality = SignalQuality(ConditioningParams())
        contact = [Contact.FREE, Contact.FREE]

        def go_on(frame: AntennaFrame, command: JointCommand) -> bool:
            quality.step(float(frame.t[0]), frame.counts[0].tolist(), contact)  # noqa: B023
            contact[:] = stage.control.contact[0].tolist()  # noqa: B023
            seen.update(finding.name for finding in quality.findings)  # noqa: B023
            seen["DRIFT"] += bool(quality.drifted)  # noqa: B023
            return stage.go_on(frame, command)  # noqa: B023

        run_loop(stage.body, stage.control, stage.period, go_on)
    assert seen["LOST"] <= 4 * 20
    assert {name for name, count in seen.items() if count} <= {"OK", "OUT_OF_CAL", "LOST"}


@pytest.mark.skipif(not RECORDED.exists(), reason="recordings not present")
def test_S4_S14_a_real_sensor_held_still_has_no_plateau_and_no_noise() -> None:
    """500 readings of 12 bits at each of ten angles, standard deviations of 1.7 to 2.4 counts."""
    held = defaultdict[str, list[float]](list)
    with RECORDED.open() as file:
        for row in csv.DictReader(file):
            held[row["angle_deg"]].append(float(row["adc12_if_3v3"]))
    for readings in held.values():
        assert plateau_of(np.array(readings)) is None
        noise = white_noise(np.array(readings), np.zeros(len(readings), int))
        assert noise == pytest.approx(np.std(readings), rel=0.35)
    angles = np.repeat([float(angle) for angle in held], 500)
    assert plateau_of(np.concatenate([*held.values()]), angles) is None


def bent(plateau: float) -> Samples:
    """Pushes of a sensor whose readings rise from 1500 to 3500 and end at a plateau."""
    rng = np.random.default_rng(6)
    level = np.tile(np.linspace(0.0, 1.0, 200), 4)
    counts = np.rint(1500.0 + 2000.0 * level + rng.normal(0.0, NOISE, 800))
    trial = np.repeat(np.arange(4), 200)
    return Samples(np.minimum(counts, plateau), level, trial, np.full(800, 0.02), np.arange(2, 802))


def test_S3_a_plateau_below_the_rail_is_saturation() -> None:
    """An attenuation that is not set: 3124 of 4095; 19 of 100 readings are above it."""
    check(bent(3500.0))
    with pytest.raises(CalibrationError, match=r"3050 counts and 2[23] % .*saturated.*attenuation"):
        check(bent(3050.0))
    samples = bent(3124.0)
    found = plateau_of(samples.counts, samples.level)
    assert found is not None
    assert (found.counts, found.share) == (3124.0, pytest.approx(0.19, abs=0.01))
    assert "attenuation" in found.text("the readings")


def test_S3_a_quiet_antenna_that_is_held_at_marks_has_no_plateau() -> None:
    marks = np.repeat([0.0, 0.25, 0.5, 1.0], 200)
    assert plateau_of(1500.0 + 300.0 * marks, marks) is None


def test_S3_the_doctor_names_a_plateau() -> None:
    """Readings of 1876 with noise of 2.5 vary below 1876; at 1860 they look as if stuck."""
    for plateau, words in ((1876, "saturates"), (1860, "stuck")):
        rows = wrong(Patient(f"esp32=plateau:{plateau}").examine(bus=False))
        for side in ("left", "right"):
            assert words in rows[f"esp32: {side} antenna"].found
            assert "attenuation" in rows[f"esp32: {side} antenna"].cure


def test_S14_the_doctor_compares_noise_by_radio_with_that_of_the_calibration() -> None:
    """Quiet by cable, noisy while the radio sends: 2.5 against 30 counts."""
    for radio in (False, True):
        patient = Patient("esp32=radio_noise:30")
        patient.robot.converter.radio = radio
        config = DoctorConfig(doctor=DoctorParams(calibrated_noise=NOISE))
        path = "udp://board" if radio else "/dev/board"
        rows = wrong(examine(config, None, (path, patient.esp32), patient.clock.now))
        assert bool(rows) is radio
        if radio:
            row = rows["esp32: left noise"]
            assert "2.5 when it was calibrated" in row.expected
            assert "times that" in row.found
            assert "radio disturbs the converter" in row.cure


def test_S14_a_calibration_file_keeps_the_noise_of_its_readings(tmp_path: Path) -> None:
    samples = bent(4000.0)
    lines = [
        f"{t},{0.01 * i:.2f},{c:.0f},{b:.4f}"
        for i, (t, c, b) in enumerate(
            zip(samples.trial, samples.counts, samples.level, strict=True)
        )
    ]
    recording = tmp_path / "recording.csv"
    recording.write_text("\n".join(["trial,time,counts,bend", *lines]) + "\n")
    outcome = run(CalibrateConfig(recording=str(recording), averaging_time=0.1))
    assert outcome.calibration.noise_counts == pytest.approx(NOISE, rel=0.15)
    outcome.calibration.save(tmp_path / "left.json")
    config = DoctorConfig(calibration=str(tmp_path / "left.json")).calibrated()
    known = config.doctor
    assert known.calibrated_noise == known.calibrated_noise_right
    assert known.calibrated_noise == outcome.calibration.noise_counts
