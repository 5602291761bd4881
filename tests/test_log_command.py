"""`antennate log`, and the logs of simulations: what other tools read, and when it refuses."""

from __future__ import annotations

import csv
import gc
import json
import os
import re
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from log_ticks import HEADER, chunks, tick, unclosed
from mcap.reader import make_reader
from mcap.writer import Writer
from worlds import recorded, session

from antennate import simulate
from antennate.cli import main
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.robots.spec import RobotSpec
from antennate.sim.world import World
from antennate.telemetry.reader import LogReader
from antennate.telemetry.topics import CONTACT_FORCES, COORDINATES
from antennate.telemetry.writer import LogWriter
from antennate.types import AntennaFrame, Controller, Maneuver

TICKS = 180


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a session that is armed and walks."""
    folder = tmp_path_factory.mktemp("drive")
    return recorded(session(folder, "closed", 1), folder / "drive.mcap", TICKS)


@pytest.fixture
def log(drive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of it in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return Path(shutil.copy(drive, tmp_path / "drive.mcap"))


def test_info_tells_the_first_and_the_last_events(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with LogWriter(tmp_path / "log.mcap", HEADER) as log:
        for number in range(50):
            log.write(replace(tick(number), now=0.01 * number, state="", causes=()))
            log.event(f"event {number}")
    assert main(["log", "info", str(tmp_path / "log.mcap")]) == 0
    said = capsys.readouterr().out
    told = [int(line.split()[-1]) for line in said.splitlines() if " s event " in line]
    assert told == [*range(10), *range(40, 50)]
    assert "... 30 more events; --json has all" in said


def test_info_of_a_good_drive_says_first_how_it_ended_and_calls_nothing_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    states = ["OFF; OFF NOT_ARMED: not armed yet; FAULT BOARD: gone; HOLD STALE: old", "HOLD"]
    states += ["OK after HOLD", "HOLD after OK; HOLD STALE: old", "OK after HOLD"]
    with LogWriter(tmp_path / "log.mcap", HEADER) as log:
        for number, text in enumerate(states):
            log.write(replace(tick(number), now=1.0 * number, state="", causes=()))
            log.event(text)
    assert main(["log", "info", str(tmp_path / "log.mcap")]) == 0
    said = capsys.readouterr().out
    told = [line.strip() for line in said.splitlines() if re.search(r"\d s (O|H)", line)]
    times = [re.search(r"[\d.]+ s", line)[0] for line in told]  # type: ignore[index]
    assert times[0] == times[-1]
    assert [re.sub(r"[\d.]+ s ", "", line) for line in told] == [
        "At the end: OK after HOLD",
        "before it could walk, OFF; NOT_ARMED: not armed yet; BOARD: gone; STALE: old",
        "before it could walk, HOLD",
        *states[2:],
    ]


def test_info_says_what_there_is(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["log", "info", str(log), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert main(["log", str(log), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found
    assert (found["ticks"], found["closed"], found["damaged"]) == (TICKS, True, 0)
    with log.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    counted = {
        summary.channels[n].topic: c for n, c in summary.statistics.channel_message_counts.items()
    }
    header = {"/config", "/versions"}
    assert found["messages"] == {name: c for name, c in counted.items() if name not in header}
    assert found["messages"]["/joint_states"] == TICKS
    assert any(event["text"].startswith("OK after") for event in found["events"])
    assert main(["log", "info", str(log)]) == 0
    said = capsys.readouterr().out
    assert "/joint_commands" in said
    assert f"{TICKS} ticks in" in said


def info(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any]]:
    """Exit code and findings of `info`."""
    code = main(["log", "info", str(path), "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_info_finds_the_same_by_the_summary_as_by_reading_every_tick(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same log without its end has no summary."""
    data = log.read_bytes()
    closed = info(log, capsys)
    log.write_bytes(unclosed(data))
    opened = info(log, capsys)
    assert closed[0] == 0
    assert closed[1]["duration_s"] == pytest.approx(0.01 * TICKS, abs=0.05)
    assert closed[1].pop("closed")
    assert not opened[1].pop("closed")
    assert closed[1] == opened[1]


def test_info_finds_what_is_damaged_or_missing_in_a_closed_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Tick 3 was never written; then a bit of the chunk of tick 2 is turned over."""
    path = tmp_path / "log.mcap"
    with LogWriter(path, HEADER, flush=0.0) as out:
        for number in (1, 2, 4):
            out.write(tick(number))
    code, found = info(path, capsys)
    assert (code, found["ticks"], found["missing"], found["damaged"]) == (2, 3, 1, 0)
    data = bytearray(path.read_bytes())
    data[chunks(data)[2][1] - 1] ^= 4
    path.write_bytes(data)
    code, found = info(path, capsys)
    assert (code, found["ticks"], found["missing"], found["damaged"]) == (2, 2, 2, 1)


def test_recover_makes_one_file_of_all_parts_that_others_open(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The first was cut by a kill, in the middle of a chunk; the second was closed."""
    with LogReader(log) as reader:
        ticks = list(reader)
    log.unlink()
    with LogWriter(log, reader.header, flush=0.0) as out:
        for one in ticks[:100]:
            out.write(one)
    data = unclosed(log.read_bytes())
    log.write_bytes(data[: chunks(log.read_bytes())[-1][0] + 30])
    with LogWriter(log.with_name("drive-2.mcap"), reader.header) as out:
        for one in ticks[110:]:
            out.write(one)
    assert main(["log", "recover", str(log)]) == 0
    assert "169 ticks were written to drive-recovered.mcap" in capsys.readouterr().out.replace(
        f"{log.parent}/", ""
    )
    made = log.with_name("drive-recovered.mcap")
    with LogReader(made) as read:
        again = list(read)
        assert (read.bad, read.end, read.header) == (0, 169, reader.header)
    assert [one.pack() for one in again] == [one.pack() for one in ticks[:99] + ticks[110:]]
    with made.open("rb") as file:
        found = make_reader(file, validate_crcs=True)
        topics = [channel.topic for _, channel, _ in found.iter_messages()]
    assert topics.count("/antenna") == 169
    assert main(["log", "recover", str(log)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert main(["log", "recover", str(log), "--overwrite"]) == 0
    assert not list(log.parent.glob(".*"))


def test_recover_says_what_it_leaves_out_and_touches_no_file_of_the_user(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ticks 3 and 5 were never written; the chunk of tick 2 is damaged."""
    monkeypatch.chdir(tmp_path)
    with LogWriter(Path("a.mcap"), HEADER, flush=0.0) as out:
        for number in (1, 2, 4, 6):
            out.write(tick(number))
    data = bytearray(Path("a.mcap").read_bytes())
    data[chunks(data)[2][1] - 1] ^= 4
    Path("a.mcap").write_bytes(data)
    Path(".a-recovered.mcap").write_text("mine")
    assert main(["log", "recover", "a.mcap"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "3 ticks were written" in said
    assert "damaged places left out: 1; ticks missing: 3" in said
    assert Path(".a-recovered.mcap").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.glob(".*")) == [".a-recovered.mcap"]


@pytest.mark.ci
@pytest.mark.parametrize("words", [["recover"], ["export", "--out", "table.csv"]])
def test_what_a_killed_command_left_goes_with_the_next_and_a_living_one_keeps_its_file(
    log: Path, words: list[str]
) -> None:
    """The first stands still before its file is whole; the second is killed there."""
    stops = """
import os, signal, sys
from antennate.cli import main
from antennate.telemetry.writer import LogWriter
def stop(*_):
    os.kill(os.getpid(), getattr(signal, sys.argv[1]))
    raise SystemExit(3)
LogWriter.close = os.fsync = stop
main(["log", sys.argv[2], "drive.mcap", *sys.argv[3:]])
"""
    command = [sys.executable, "-c", stops]
    mine = Path(".table.csv.0123456789abcdef.csv")
    mine.touch()
    first = subprocess.Popen([*command, "SIGSTOP", *words])
    try:
        assert os.WIFSTOPPED(os.waitpid(first.pid, os.WUNTRACED)[1])
        (living,) = set(Path().glob(".*")) - {mine}
        assert subprocess.run([*command, "SIGKILL", *words], check=False).returncode == -9
        assert len(set(Path().glob(".*")) - {mine, living}) == 1
        assert main(["log", words[0], "drive.mcap", *words[1:]]) == 0
        assert set(Path().glob(".*")) == {mine, living}
    finally:
        first.kill()
        first.wait()
    assert main(["log", words[0], "drive.mcap", *words[1:], "--overwrite"]) == 0
    assert set(Path().glob(".*")) == {mine}


def test_recover_names_the_file_of_the_user_where_the_disk_is_full(
    log: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20000, hard))
        assert main(["log", "recover", "drive.mcap", "--out", "a.mcap"]) == 2
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "expected to write a.mcap, found: " in capsys.readouterr().err
    monkeypatch.setattr(shutil, "disk_usage", lambda place: SimpleNamespace(free=2.5e4))
    assert main(["log", "recover", "drive.mcap", "--out", "a.mcap"]) == 2
    asked = re.search(r"expected ([\d.]+) kB free for a.mcap, found 25 kB", capsys.readouterr().err)
    assert asked is not None
    assert float(asked[1]) == pytest.approx(1.5e-3 * log.stat().st_size, rel=1e-3)
    assert [path.name for path in log.parent.iterdir()] == ["drive.mcap"]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_rosbags_opens_a_killed_log_once_it_is_recovered(log: Path) -> None:
    rosbags = pytest.importorskip("rosbags.highlevel")
    killed = log.with_name("killed.mcap")
    killed.write_bytes(unclosed(log.read_bytes())[:-100])
    with pytest.raises(rosbags.AnyReaderError), rosbags.AnyReader([killed]):
        pass
    gc.collect()  # it leaves the file open that it refused
    assert main(["log", "recover", "killed.mcap", "--out", "whole.mcap"]) == 0
    with rosbags.AnyReader([log.with_name("whole.mcap")]) as bag:
        antenna = [each for each in bag.connections if each.topic == "/antenna"]
        found = [bag.deserialize(data, c.msgtype) for c, _, data in bag.messages(antenna)]
    with LogReader(log) as reader:
        wanted = list(reader)
    assert len(found) == len(wanted)
    np.testing.assert_array_equal([f.counts for f in found], [w.counts for w in wanted])


def test_rerun_opens_a_killed_log_once_it_is_recovered(log: Path) -> None:
    """Its reader makes a column of each topic, and curves of the joints with their names."""
    rerun = pytest.importorskip("rerun.chunk")
    killed = log.with_name("killed.mcap")
    killed.write_bytes(unclosed(log.read_bytes())[:-100])
    with pytest.raises(ValueError, match="summary is missing"):
        list(rerun.McapReader(str(killed)).stream())
    assert main(["log", "recover", "killed.mcap", "--out", "whole.mcap"]) == 0
    found: dict[str, list[Any]] = {}
    for chunk in rerun.McapReader("whole.mcap").stream():
        table = chunk.to_record_batch().to_pydict()
        for name, values in table.items():
            found.setdefault(f"{chunk.entity_path} {name}", []).extend(values)
    with LogReader(log) as reader:
        wanted = list(reader)
    antenna = [one for [one] in found["/antenna antennate_msgs.msg.Antenna:message"]]
    np.testing.assert_array_equal([a["counts"] for a in antenna], [w.counts for w in wanted])
    np.testing.assert_array_equal([a["level"] for a in antenna], [w.level for w in wanted])
    maneuver = [one for [one] in found["/maneuver antennate_msgs.msg.Maneuver:message"]]
    assert [m["maneuver"] for m in maneuver] == [w.maneuver for w in wanted]
    angles = found["/joint_commands/position Scalars:scalars"]
    np.testing.assert_array_equal(angles, [w.angles for w in wanted])
    assert found["/joint_commands/position SeriesLines:names"][0] == list(RobotSpec().joint_names)
    assert any("OK after" in str(text) for text in found["/events TextLog:text"])


def test_export_writes_every_number_to_the_last_digit(log: Path) -> None:
    assert main(["log", "export", str(log)]) == 0
    with log.with_suffix(".csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    with LogReader(log) as reader:
        for row, one in zip(rows, reader, strict=True):
            assert [float(row[name]) for name in RobotSpec().joint_names] == list(one.angles)
            np.testing.assert_array_equal(
                [float(row[f"{name}_position"]) for name in RobotSpec().joint_names], one.positions
            )
            assert (int(row["maneuver"]), row["state"]) == (one.maneuver, one.state)
    assert "yaw1_effort" not in rows[0]


def test_export_to_parquet(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pandas = pytest.importorskip("pandas")
    if find_spec("pyarrow") is None:
        assert main(["log", "export", str(log), "--out", "a.parquet"]) == 2
        err = capsys.readouterr().err
        assert "./antennate/packages/* './antennate/packages/antennate[parquet]'" in err
        return
    assert main(["log", "export", str(log), "--out", "a.parquet"]) == 0
    table = pandas.read_parquet("a.parquet")
    with LogReader(log) as reader:
        assert table["phase"].tolist() == pytest.approx(
            [t.phase for t in reader], abs=0, nan_ok=True
        )


def test_a_name_that_grows_too_long_is_one_line(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = log.rename(f"{'n' * 245}.mcap")
    assert main(["log", "recover", str(name)]) == 2
    err = capsys.readouterr().err
    assert "File name too long" in err
    assert err.count("\n") == 1


def test_info_finds_ticks_that_cannot_be_read_in_a_sound_file(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every CRC is right, but the readings have another form."""
    with log.open("rb") as file, Path("new.mcap").open("wb") as copy:
        writer, known = Writer(copy), dict[str, int]()
        writer.start()
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            assert schema is not None
            if channel.topic not in known:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                known[channel.topic] = writer.register_channel(channel.topic, "cdr", number)
            data = message.data[:20] if channel.topic == "/antenna" else message.data
            about = (message.log_time, data, message.publish_time, message.sequence)
            writer.add_message(known[channel.topic], *about)
        writer.finish()
    code, told = info(Path("new.mcap"), capsys)
    assert (code, told["ticks"]) == (2, 0)


@pytest.mark.ci
def test_plot_draws_it(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["log", "plot", str(log)]) == 0
    assert f"ticks were drawn into {log.with_suffix('.png')}" in capsys.readouterr().out
    assert log.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    assert main(["log", "plot", str(log), "--out", "a.svg"]) == 0
    assert Path("a.svg").read_text().count("<path") > 20


@pytest.mark.ci
@pytest.mark.parametrize("now", [None, 0.5], ids=["any times", "one time"])
def test_plot_draws_a_log_of_absurd_numbers(
    now: float | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of both signs up to the largest there is, infinities and NaN; no word of what draws them."""
    log = tmp_path / "odd.mcap"
    with LogWriter(log, HEADER, 0.0) as out:
        for number in range(1, 60):
            out.write(tick(number) if now is None else replace(tick(number), now=now))
    assert main(["log", "plot", str(log)]) == 0
    assert capsys.readouterr().err == ""
    assert log.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("argv", "what"),
    [
        ([], "expected the name of a log or of a run, found none"),
        (["show", "drive.mcap"], "expected one of info, recover, export, plot or film, found show"),
        (["info", "nothing.mcap"], "nothing.mcap: No such file"),
        (["nothing.mcap"], "expected a log, found nothing.mcap: No such file"),
        (["info", "text"], "no intact header, 0 intact ticks; damaged places: 1"),
        (["info", "drive.mcap", "--out", "a"], "--out: expected no file for `info`"),
        (["info", "drive.mcap", "--overwrite"], "--overwrite: expected no file for `info`"),
        (["export", "drive.mcap", "--json"], "--json: expected `info`"),
        (["export", "drive.mcap", "--out", "a.xls"], "a name with .csv or .parquet, found a.xls"),
        (["recover", "drive.mcap", "--out", "drive.mcap"], "expected another file than the log"),
        (["recover", "text", "--out", "new.mcap"], "no intact header"),
        (["recover", "cut.mcap", "--out", "new.mcap"], "expected intact ticks, found none"),
        (["recover", "gone.mcap", "--out", "drive.mcap", "--overwrite"], "gone.mcap: No such file"),
        (
            ["recover", "drive.mcap", "--out", "x.mcap", "--overwrite"],
            "x.mcap: expected a file or a new name, found a folder",
        ),
        (["plot", "empty.mcap"], "expected a log with ticks, found none"),
        (["export", "empty.mcap"], "expected a log with ticks, found none"),
        (["export", "drive.mcap", "--out", "nowhere/a.csv"], "nowhere/a.csv: expected to write"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(
    argv: list[str], what: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("text").write_text("not a log of anything\n")
    Path("x.mcap").mkdir()
    LogWriter(Path("empty.mcap"), HEADER).close()
    with log.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    _, second, *_ = sorted(chunk.chunk_start_offset for chunk in summary.chunk_indexes)
    Path("cut.mcap").write_bytes(log.read_bytes()[: second + 50])  # the header alone is whole
    before = {path.name for path in Path().iterdir()}
    assert main(["log", *argv]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert what in err
    assert err.count("\n") == 1
    assert {path.name for path in Path().iterdir()} == before


def test_a_damaged_log_is_exported_as_far_as_it_goes(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with LogWriter(Path("bad.mcap"), HEADER, flush=0.0) as out:
        for number in (1, 2, 3):
            out.write(tick(number))
    data = bytearray(Path("bad.mcap").read_bytes())
    data[chunks(data)[2][1] - 1] ^= 4
    Path("bad.mcap").write_bytes(data)
    assert main(["log", "export", "bad.mcap"]) == 2
    assert (
        "found damaged places: 1; ticks missing: 1; ticks read: 2; first" in capsys.readouterr().err
    )
    assert Path("bad.csv").read_text().count("\n") == 3


@pytest.mark.ci
def test_G7_logs_of_trials_are_replayed_to_the_bit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four trials at once, each with its own log, which other programs read."""
    words = ["tunnel", "--trials", "2", "--controllers", "paper", "closed", "--time-limit", "3"]
    more = ["--workers", "1", "--no-figures", "--log", "--out", str(tmp_path / "run")]
    assert main([*words, *more]) == 0
    logs = sorted((tmp_path / "run" / "logs").iterdir())
    assert [p.name for p in logs] == [f"{c}-{n}.mcap" for c in ("closed", "paper") for n in (0, 1)]
    for path in logs:
        capsys.readouterr()
        assert main(["log", "replay", str(path), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["different"], found["different_commands"], found["closed"]) == (0, 0, True)
        assert found["ticks"] >= 300
        assert (found["seed"], f"-{found['trial']}.") == (0, path.name[-7:-4].removeprefix("d"))
    assert main([*words, *more, "--overwrite", "--trials", "1"]) == 0
    assert len(list((tmp_path / "run" / "logs").iterdir())) == 2


def test_the_log_of_a_simulated_trial_is_its_time_series(tmp_path: Path) -> None:
    """And the physics: joints follow their commands, forces are where the robot touches."""
    series = simulate("closed", time_limit=4.0, log=tmp_path / "trial.mcap")
    with LogReader(tmp_path / "trial.mcap") as log:
        groups = list(log.groups())
        assert log.header.phase != 0.0
    ticks = [one for _, one in groups if one is not None]
    np.testing.assert_array_equal([one.t for one in ticks], series.t)
    np.testing.assert_array_equal([one.counts for one in ticks], series.counts)
    np.testing.assert_array_equal([one.level for one in ticks], series.level)
    np.testing.assert_array_equal([one.contact for one in ticks], series.contact)
    np.testing.assert_array_equal([one.maneuver for one in ticks], series.maneuver)
    np.testing.assert_array_equal([one.angles[:5] for one in ticks], series.yaw)
    assert {one.maneuver for one in ticks} <= set(Maneuver)
    behind = np.array([one.positions[0] - one.angles[0] for one in ticks[100:]])
    assert 0.0 < np.abs(behind).max() < 0.3
    forces = [
        record.topic.type.decode(record.data)
        for records, _ in groups
        for record in records
        if record.topic.name == "/contact_forces"
    ]
    names = set(RobotSpec().link_names)
    for one in forces:
        assert len(one["part"]) == len(one["x"]) == len(one["normal"]) > 0
        assert min(one["normal"]) >= 0.0
        assert any(part in names or "antenna" in part or "leg" in part for part in one["part"])


def test_forces_and_coordinates_in_a_log_are_those_of_their_tick(tmp_path: Path) -> None:
    """They are encoded later, many at once; the engine has gone on by then."""
    config = TunnelConfig(trials=1, time_limit=6.0)
    seen: dict[float, tuple[float, list[float]]] = {}

    def watch(world: World, frame: AntennaFrame, controller: Controller) -> list[str]:
        seen[float(frame.t[0])] = world.obstacle_force(), world.data.qpos.tolist()
        return []

    run_trials(
        config, "open", [0], lambda found: None, logs=tmp_path, apparatus=Apparatus(watch=watch)
    )
    looks = pushed = 0
    with LogReader(tmp_path / "open-0.mcap") as log:
        for records, tick in log.groups():
            found = {record.topic: record.topic.decode(record.data) for record in records}
            if tick is None or COORDINATES not in found:
                continue
            force, place = seen.pop(tick.t)
            assert list(found[COORDINATES]["position"]) == place
            normal = found[CONTACT_FORCES]["normal"] if CONTACT_FORCES in found else ()
            assert sum(normal) == pytest.approx(force)
            looks, pushed = looks + 1, pushed + (force > 0)
    assert pushed >= 10
    assert looks == pytest.approx((looks + len(seen)) / 10, abs=1)


@pytest.mark.parametrize("word", ["missing", "drive.MCAP"])
def test_first_word_that_is_nothing_is_asked_about_as_log_or_action(
    word: str, refused: Callable[..., str]
) -> None:
    """A log has no flag, and neither has what is done with it."""
    assert refused("log", word) == (
        "antennate log: error: expected a log, the folder of a run, or one of info, recover, "
        f"export, plot, film, found '{word}'\n"
    )
