"""`antennate log replay`: what it says of a log, what it leaves behind, and when it refuses."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import phone
import pytest
from log_ticks import HEADER, chunks, unclosed
from worlds import recorded, session, simulated

from antennate import figures as style
from antennate.cli import main
from antennate.errors import LogError
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.studies.run_files import LOG
from antennate.telemetry.figure import Course
from antennate.telemetry.figure import replay as draw
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.replay import ReplayRobot, recorded_controller, replay
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Contact, JointCommand, Maneuver

TICKS = 200


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of the published rule, with a turn."""
    folder = tmp_path_factory.mktemp("log")
    return recorded(simulated(folder, "paper", 0), folder / "log", TICKS)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def said(capsys: pytest.CaptureFixture[str], *argv: str) -> dict:
    assert main(["log", "replay", *argv, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_G7_the_same_code_decides_the_same(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = said(capsys, str(log))
    assert (result["ticks"], result["different"], result["different_commands"]) == (TICKS, 0, 0)
    assert result["first_difference"] is None
    assert result["duration_s"] == pytest.approx((TICKS - 1) * 0.01)
    assert sum(result["shares"].values()) == pytest.approx(1.0)
    assert result["controller"] == result["recorded_controller"] == "paper"
    assert (result["seed"], result["trial"]) == (0, 0)
    assert result["closed"]


def test_G6_all_files_of_a_log_are_replayed_as_one(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second one was never begun; the first was cut by a kill, the third was closed."""
    first, third = tmp_path / "drive.mcap", tmp_path / "drive-3.mcap"
    with LogReader(log) as reader:
        ticks = list(reader)
    cut = LogWriter(first, reader.header)
    for tick in ticks[:120]:
        cut.write(tick)
    cut.flush()
    with LogWriter(third, reader.header, flush=0.0) as writer:
        for tick in ticks[120:]:
            writer.write(tick)
    result = said(capsys, str(first))
    assert result["parts"] == ["drive.mcap", "drive-3.mcap"]
    assert (result["ticks"], result["different"], result["different_commands"]) == (TICKS, 0, 0)
    assert result["closed"]
    data = bytearray(third.read_bytes())
    data[chunks(data)[-1][1] - 1] ^= 1
    third.write_bytes(data)
    assert main(["log", "replay", str(first), "--json"]) == 2
    out, err = capsys.readouterr()
    assert (json.loads(out)["missing"], json.loads(out)["damaged"]) == (1, 1)
    assert "of drive-3.mcap" in err


def test_another_controller_is_compared(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    result = said(capsys, str(log), "--controller", "open")
    turning = 1.0 - result["recorded_shares"]["FORWARD"]
    assert result["shares"]["FORWARD"] == 1.0
    assert result["different"] == round(turning * TICKS) > 0
    assert result["first_difference"]["replayed"] == "FORWARD"
    assert main(["log", "replay", str(log), "--controller", "open"]) == 0
    out = capsys.readouterr().out
    assert f"first in tick {result['first_difference']['tick']} at " in out


def test_replay_export_and_plot_count_time_as_the_loop_did(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A loop that began five seconds before its first tick."""
    path = tmp_path / LOG
    with LogReader(log) as reader, LogWriter(path, reader.header) as writer:
        for tick in reader:
            writer.write(dataclasses.replace(tick, now=tick.now + 5.0))
    result = said(capsys, str(tmp_path), "--controller", "open")
    assert main(["log", "export", str(tmp_path)]) == 0
    with path.with_suffix(".csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    turned = next(row for row in rows if row["maneuver"] != "0")
    first = result["first_difference"]
    assert (first["tick"], first["time_s"]) == (int(turned["number"]), float(turned["now"]))
    with LogReader(path) as reader:
        times = Course.of(reader, TICKS).t
    assert times.tolist() == [float(row["now"]) for row in rows]
    assert times[0] >= 5.0


@pytest.mark.ci
def test_it_leaves_a_table_and_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The table holds what the log holds, to the last digit."""
    live = session(tmp_path, "closed", 1, blind=130)
    path = recorded(live, tmp_path / "log", 180)
    out = tmp_path / "out"
    assert main(["log", "replay", str(path), "--out", str(out)]) == 0
    with (out / "ticks.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 180
    for row, seen in zip(rows, live.seen, strict=True):
        angles = np.concatenate(
            [seen.command.yaw[0], seen.command.leg.ravel(), seen.command.antenna[0]]
        )
        assert [float(row[name]) for name in RobotSpec().joint_names] == angles.tolist()
        counts = np.array([float(row["counts_left"]), float(row["counts_right"])])
        np.testing.assert_array_equal(counts, seen.frame.counts[0])
        assert int(row["maneuver"]) == int(row["replayed"]) == seen.maneuver
    assert rows[145]["state"] == "HOLD"
    assert "HOLD STALE: no fresh sample" in rows[145]["causes"]
    assert {p.name for p in (out / "figures").iterdir()} == {"replay.svg", "replay.png"}
    assert json.loads((out / "result.json").read_text())["states"]["OFF"] > 0.5
    capsys.readouterr()
    assert main(["log", "replay", str(path), "--out", str(out)]) == 2
    assert "--overwrite" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("answer", "code", "said"),
    [
        ("1 / 0", 2, "of 180 ticks, first by this: ZeroDivisionError"),
        ("replace(command, yaw=command.yaw * np.nan)", 2, "by this: expected finite angles in yaw"),
        ("replace(command, leg=command.leg[:, :1])", 2, "by this: expected leg of shape"),
        ("replace(command, yaw=command.yaw * 1j)", 2, "by this: expected finite angles in yaw"),
        (
            "replace(command, yaw=command.yaw + 0.01)",
            0,
            "in all 180 ticks, but its commands differ",
        ),
    ],
)
def test_a_controller_that_fails_or_commands_otherwise_is_told_in_the_sentence(
    answer: str, code: int, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It decides as the recorded one, and begins to differ after 10 steps."""
    path = recorded(session(tmp_path, "open", 1), tmp_path / "log", 180)
    own = tmp_path / "own.py"
    own.write_text(
        "from dataclasses import replace\nimport numpy as np\n"
        "from antennate.control.controllers import open_loop\n"
        "class Own:\n"
        "    def __init__(self, *given): self.sound, self.count = open_loop(*given), 0\n"
        "    def __getattr__(self, name): return getattr(self.sound, name)\n"
        "    def step(self, frame):\n"
        "        command = self.sound.step(frame)\n"
        "        self.count += 1\n"
        f"        return command if self.count <= 10 else {answer}\n"
    )
    assert main(["log", "replay", str(path), "--controller", f"{own}:Own"]) == code
    assert said in capsys.readouterr().out.replace("\n", " ")


def test_G2_a_damaged_log_is_replayed_as_far_as_it_goes(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad"
    with LogReader(log) as reader, LogWriter(bad, reader.header, flush=0.0) as writer:
        for tick in reader:
            writer.write(tick)
    data = bytearray(bad.read_bytes())
    data[chunks(data)[TICKS // 2][1] - 1] ^= 4
    bad.write_bytes(data)
    assert main(["log", "replay", str(bad), "--json"]) == 2
    out, err = capsys.readouterr()
    result = json.loads(out)
    assert (result["ticks"], result["missing"]) == (TICKS - 1, 1)
    assert f"ticks missing: 1; ticks read: {TICKS - 1}; first at byte " in err
    assert err.count("\n") == 1
    assert main(["log", "replay", str(bad)]) == 2
    out = capsys.readouterr().out
    assert "the log is damaged." in out
    assert "complete" not in out


@pytest.mark.parametrize("number", [math.inf, math.nan, 1e308])
def test_times_and_readings_may_be_anything(
    log: Path, number: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing can be said of the duration then; the report says so too."""
    with LogReader(log) as reader, LogWriter(Path("odd"), reader.header) as writer:
        for tick in reader:
            sign = -number if tick.number % 2 else number
            odd = dataclasses.replace(tick, t=sign, now=sign, counts=(sign, number))
            writer.write(odd)
    for words in (["odd"], ["odd", "--controller", "closed", "--out", "out"]):
        assert main(["log", "replay", *words]) == 0
        assert capsys.readouterr().err == ("written to out\n" if "--out" in words else "")
    assert main(["report", "out"]) == 0
    assert f"{TICKS} ticks, - s, in odd" in Path("out/report.html").read_text()


def test_a_log_that_was_not_closed_is_no_error(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its program was killed; nothing that was written is lost."""
    cut = tmp_path / "cut"
    cut.write_bytes(unclosed(log.read_bytes()))
    result = said(capsys, str(cut))
    assert (result["ticks"], result["closed"]) == (TICKS, False)


@pytest.mark.parametrize(
    ("argv", "what"),
    [
        ([], "expected the name of a log or of a run, found none"),
        (["nothing.log"], "nothing.log: No such file"),
        (["."], "expected a run with a log, found none"),
        (["empty"], "expected a log with ticks, found none"),
        (["text"], "no intact header, 0 intact ticks; damaged places: 1"),
        (["own"], "give --controller with its name if it may run"),
        (
            ["own", "--controller", "sideways"],
            "controller: expected one of open, timed, paper, closed",
        ),
    ],
)
def test_what_cannot_be_replayed_is_refused_in_one_line(
    argv: list[str], what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "text").write_text("not a log of anything\n")
    own = Header(controller="this:Class", params=ControlParams())
    LogWriter(tmp_path / "own", own).close()
    LogWriter(tmp_path / "empty", Header(controller="open", params=ControlParams())).close()
    assert main(["log", "replay", *argv]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert what in err
    assert err.count("\n") == 1


def test_a_replay_without_ticks_has_nothing_to_read() -> None:
    body = ReplayRobot([], Header(controller="open", params=ControlParams()))
    with pytest.raises(LogError, match="found the end of the log"):
        body.read()


def test_a_controller_that_raises_is_counted_and_does_not_end_the_replay(log: Path) -> None:
    with LogReader(log) as reader:
        sound = recorded_controller(reader.header)

        class Broken:
            maneuver, contact = sound.maneuver, sound.contact

            def step(self, frame: object) -> None:
                raise ValueError("a bug")

        ticks = list(reader)
    found = replay(ticks, Broken(), HEADER)  # type: ignore[arg-type]
    assert (found.failures, found.commands, len(found.maneuvers)) == (TICKS, TICKS, TICKS)
    nowhere = (math.nan,) * len(RobotSpec().joint_names)
    failed = [dataclasses.replace(tick, angles=nowhere) for tick in ticks]
    assert replay(failed, Broken(), HEADER).commands == 0  # type: ignore[arg-type]


def test_the_figure_shows_every_stretch_and_repeats_its_bytes() -> None:
    n = 100
    course = Course(
        t=0.01 * np.arange(n),
        reading=np.full((n, 2), 1800.0),
        level=np.zeros((n, 2)),
        contact=np.repeat([[Contact.FREE, Contact.CONTACT], [Contact.UNKNOWN, 9]], 50, axis=0),
        recorded=np.repeat([Maneuver.FORWARD, Maneuver.HOLD], 50).astype(int),
        replayed=np.repeat([Maneuver.FORWARD, 7], 50).astype(int),
        state=["OFF"] * 30 + ["OK"] * 70,
        threshold=0.4,
    )
    figure = draw(course)
    bars = [len(panel.collections) for panel in figure.axes]
    assert bars == [0, 0, 2, 5]  # one unknown, one contact; 2 recorded, 1 known replayed, 2 states
    assert figure.axes[1].lines[-1].get_ydata() == [0.4, 0.4]
    assert phone.smallest(figure) >= phone.LEAST
    assert style.render(figure) == style.render(draw(course))
    raised = {"pitch": np.full((n, 5), 0.5), "elevation": np.full((n, 2), -0.25)}
    panel = draw(dataclasses.replace(course, **raised)).axes[3]
    assert panel.get_title(loc="left") == "Raised"
    assert [line.get_ydata()[0] for line in panel.lines] == pytest.approx(
        [28.65] * 5 + [-14.32] * 2, abs=0.01
    )
    simulated = draw(dataclasses.replace(course, replayed=None, state=[""] * n))
    rows = [label.get_text() for label in simulated.axes[3].get_yticklabels()]
    assert rows == ["recorded"]  # no supervisor
    nothing = {"level": np.full((n, 2), math.nan), "contact": np.full((n, 2), Contact.UNKNOWN)}
    undecided = dataclasses.replace(course, recorded=np.full(n, -1), replayed=None, **nothing)
    of_twin = draw(dataclasses.replace(undecided, state=[""] * n))
    assert [panel.get_title(loc="left") for panel in of_twin.axes] == ["Readings"]


def test_a_pause_without_a_log_is_left_empty() -> None:
    """Two seconds of ticks, a pause of 28 s after a fault, two seconds of ticks."""
    t = np.concatenate([np.arange(200), np.arange(3000, 3200)]) * 0.01
    course = Course(
        t=t,
        reading=np.full((400, 2), 1800.0),
        level=np.zeros((400, 2)),
        contact=np.repeat([Contact.CONTACT, Contact.UNKNOWN, Contact.CONTACT], [150, 50, 200])[
            :, None
        ].repeat(2, axis=1),
        recorded=np.repeat([Maneuver.FORWARD, Maneuver.HOLD, Maneuver.HOLD], [150, 50, 200]),
        replayed=None,
        state=["OK"] * 150 + ["FAULT"] * 50 + ["OK"] * 200,
        threshold=0.4,
    )
    readings, levels, *bands = draw(course).axes
    for line in (*readings.lines, *levels.lines[:2]):
        x, y = (np.asarray(values, float) for values in line.get_data())
        assert x[np.isnan(y)] == pytest.approx([2.0])  # where the line breaks
        assert np.isfinite(y).sum() == 400
    spans = [
        path.get_extents().intervalx.tolist()
        for panel in bands
        for bars in panel.collections
        for path in bars.get_paths()
    ]
    assert len(spans) == 2 * 3 + 3 + 3  # both sides; maneuvers, HOLD in two pieces; states
    assert not any(begin < 29.9 and end > 2.1 for begin, end in spans)


@pytest.mark.parametrize("fresh", [True, False])
def test_G7_a_tick_without_a_decision_keeps_the_last_pose_that_was_not_refused(
    log: Path, fresh: bool
) -> None:
    """As a session does: the second command was refused, and the third tick kept the first.

    Also where a controller returns the same arrays each time, and writes into its frame.
    """

    class Turning:
        maneuver, contact = np.zeros(1, int), np.zeros((1, 2), int)
        yaw = np.zeros((1, 5))

        def step(self, frame: AntennaFrame) -> JointCommand:
            self.yaw += 0.1
            frame.t[:] = frame.counts[:] = 0.0
            yaw = self.yaw.copy() if fresh else self.yaw
            return JointCommand(yaw, np.zeros((1, 6, 2)), np.zeros((1, 2)))

    with LogReader(log) as reader:
        first, second, third, *_ = reader
    angles = [(yaw,) * 5 + (0.0,) * 14 for yaw in (0.1, 0.2)]
    ticks = [
        dataclasses.replace(first, angles=angles[0], maneuver=0),
        dataclasses.replace(second, angles=angles[1], maneuver=0, refused=1),
        dataclasses.replace(third, angles=angles[0], maneuver=0, refused=1, asked=False),
    ]
    found = replay(ticks, Turning(), HEADER)
    assert (found.commands, found.different) == (0, 0)
