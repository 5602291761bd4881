"""Recordings at a bench: the twin's antenna is held at marks, and calibrate finds its curve."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from doctor_rig import Patient
from esp32_streams import encoded, hello, made
from port_pieces import Pieces

from antennate.errors import BadInputError
from antennate.experiments.calibrate.recording import RecordingParams
from antennate.experiments.calibrate.run import CalibrateConfig, run
from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import Board
from antennate.hardware.esp32.recording import Recorder
from antennate.params.hardware import RecordParams


class Bench:
    """A twin's board, a person who holds its left antenna, and the file."""

    def __init__(self, curve: Callable[[float], float] = lambda mark: 1800.0) -> None:
        self.patient = Patient()
        self.lines: list[str] = []
        self.asked: list[str] = []
        self._curve = curve

    def ask(self, text: str) -> Callable[[], bool]:
        self.asked.append(text)
        if "hold at " in text:
            mark = float(text.split("hold at ")[1].split()[0].rstrip(","))
            self.patient.robot.hold(0, self._curve(mark))
        confirm_at = self.patient.clock.now() + 0.2
        return lambda: self.patient.clock.now() >= confirm_at

    def record(self, **settings: object) -> Recorder:
        clock = self.patient.clock
        recorder = Recorder(
            Board(self.patient.board),
            RecordParams.model_validate(settings),
            clock.now,
            self.ask,
            self.lines.append,
        )
        recorder.run()
        return recorder


def test_what_is_recorded_at_marks_calibrates_to_the_curve_of_the_antenna(tmp_path: Path) -> None:
    """Held by x = x0 - ln(1/b - 1) / k from the ends 1600 and 1900; b by a ruler of 50 mm."""
    slope, midpoint = 4.5, 0.5

    def counts(mark: float) -> float:
        b = mark / 50.0
        return 1600.0 + 300.0 * (midpoint + np.log(1.0 / b - 1.0) / slope)

    ends = [50.0 / (1.0 + np.exp(slope * midpoint * side)) for side in (1, -1)]
    marks = np.round(np.linspace(*ends, 9), 3).tolist()
    bench = Bench(counts)
    recorder = bench.record(marks=marks, hold=0.3, passes=4)
    assert recorder.rows == len(bench.lines) - 1 == 4 * 9 * 30
    file = tmp_path / "left.csv"
    file.write_text("\n".join(bench.lines) + "\n")
    columns = RecordingParams(bend_unit="mm", bend_zero=0.0, bend_full=50.0)
    outcome = run(CalibrateConfig(recording=str(file), columns=columns))
    found = outcome.calibration
    assert found.polarity == -1
    assert found.slope == pytest.approx(slope, rel=0.05)
    assert found.midpoint == pytest.approx(midpoint, abs=0.02)
    assert found.trials == 2  # each of them there and back
    assert outcome.assessment.hysteresis is not None
    assert abs(outcome.assessment.hysteresis.mean) < 0.01  # the bench has none


def test_every_other_pass_goes_backwards() -> None:
    bench = Bench()
    bench.record(marks=[0, 10], hold=0.1, passes=2)
    assert bench.asked == [
        f"pass {n} of 2: hold at {mark} mm, Enter" for n, mark in ((1, 0), (1, 10), (2, 10), (2, 0))
    ]


def test_a_push_of_a_stage_is_its_speed_times_the_boards_time() -> None:
    bench = Bench()
    bench.record(speed=0.1, length=0.02, passes=1)
    assert bench.lines[0] == "trial,speed_m_s,time,counts,bend"
    rows = np.array([line.split(",") for line in bench.lines[1:]], float)
    assert len(rows) == 20
    np.testing.assert_allclose(np.diff(rows[:, 2]), 0.01, atol=1e-6)
    np.testing.assert_allclose(rows[:, 4], 0.1 * 0.01 * np.arange(20), atol=1e-6)


def test_without_bends_both_antennae_are_written_and_time_goes_on_after_a_reset() -> None:
    bench = Bench()
    clock = bench.patient.clock
    robot, advance = bench.patient.robot, bench.patient.robot.advance
    resets: list[float] = []

    def breaking(t: float) -> None:
        if clock.now() >= 1.0 and not resets:
            resets.append(t)
            robot.break_board("reset")
        advance(t)

    robot.advance = breaking
    bench.record(duration=2.0)
    assert bench.lines[0] == "time,left,right"
    t = np.array([float(line.split(",")[0]) for line in bench.lines[1:]])
    assert (np.diff(t) > 0).all()
    assert np.diff(t).max() == pytest.approx(0.51, abs=0.05)
    assert len(t) == pytest.approx(150, abs=5)


def test_a_silent_board_is_an_error_of_one_line() -> None:
    bench = Bench()
    bench.patient.robot.board_silent = True
    bench.patient.robot.take()
    with pytest.raises(BadInputError, match=r"--esp32: expected readings .* doctor"):
        bench.record(duration=1.0)
    assert bench.lines == []


def test_E8_readings_of_a_board_with_old_firmware_are_not_recorded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    port = Pieces(hello() + b"".join(encoded(made(n)) for n in range(9)))
    monkeypatch.setattr(frame, "FIRMWARE", (99, 0, 0))
    board = Board(port)
    assert board.wait(0.0, lambda: 0.0) == []
    assert "this host needs 99.0.0" in board.refusals[0]


def test_a_file_is_never_overwritten_and_one_without_readings_is_not_left(tmp_path: Path) -> None:
    from antennate.cli.record import Lines

    file = tmp_path / "a.csv"
    with Lines(file) as lines:
        lines.write("time,left,right")
    assert not file.exists()
    with Lines(file) as lines:
        lines.write("time,left,right")
        lines.write("0.0,1,2")
        assert file.read_text() == "time,left,right\n0.0,1,2\n"
    with pytest.raises(FileExistsError), Lines(file):
        pass
    assert file.read_text() == "time,left,right\n0.0,1,2\n"
