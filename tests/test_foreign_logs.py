"""Logs that another program wrote anew, as the specification of MCAP allows."""

from __future__ import annotations

import json
import random
import struct
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from log_ticks import HEADER, MAGIC, chunks, tick
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from antennate.cli import main
from antennate.telemetry.reader import LogReader
from antennate.telemetry.topics import ANTENNA
from antennate.telemetry.writer import LogWriter

TICKS = 30
MESSAGE = 0x05
"""Kind of the record of a message; its channel comes first (specification of MCAP)."""
LAST = 2**64 - 1
"""Latest time [ns] that MCAP can tell."""


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log of antennate in an empty folder."""
    monkeypatch.chdir(tmp_path)
    with LogWriter(Path("log.mcap"), HEADER, 0.0, flush=0.0) as out:
        for number in range(1, TICKS + 1):
            out.write(tick(number))
    return Path("log.mcap")


def anew(
    log: Path,
    time: int | None = None,
    number: int | None = None,
    more: Iterable[tuple[int, bytes]] = (),
    attached: bytes = b"",
    order: str = "",
    **how: Any,
) -> Path:
    """The same messages, written by the package `mcap`.

    Args:
        log: The log.
        time: Time of all messages [ns], None for their own.
        number: Number of all messages, None for their own.
        more: Time [ns] and bytes of more messages in /antenna.
        attached: Content of an attachment.
        order: A topic whose messages come before all others but those of the header.
        how: What its writer is told.
    """
    copy = log.with_name("new.mcap")
    with log.open("rb") as file, copy.open("wb") as target:
        writer, channels = Writer(target, **how), dict[str, int]()
        writer.start()
        messages = [*make_reader(file).iter_messages(log_time_order=False)]
        if order:
            messages = messages[:2] + sorted(messages[2:], key=lambda each: each[1].topic != order)
        for schema, channel, message in messages:
            assert schema is not None
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", kind)
            at = message.log_time if time is None else time
            each = message.sequence if number is None else number
            writer.add_message(channels[channel.topic], at, message.data, at, each)
        for at, data in more:
            writer.add_message(channels["/antenna"], at, data, at)
        if attached:
            writer.add_attachment(0, 0, "noise", "", attached)
        writer.finish()
    return copy


def info(path: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any], str]:
    """Exit code and findings of `info`, and what it says beside them."""
    code = main(["log", "info", str(path), "--json"])
    said = capsys.readouterr()
    return code, json.loads(said.out), said.err


def ticks_of(path: Path) -> list[bytes]:
    with LogReader(path) as log:
        return [each.pack() for each in log]


WRITTEN = [tick(number).pack() for number in range(1, TICKS + 1)]


def test_recover_takes_messages_of_the_latest_time(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its own event has the time of the last one; ROS 2 knows none after 2038."""
    late = anew(log, time=LAST)
    assert main(["log", "recover", str(late), "--out", "whole.mcap"]) == 0
    assert f"{TICKS} ticks were written" in capsys.readouterr().out
    with Path("whole.mcap").open("rb") as file:
        found = [*make_reader(file).iter_messages(log_time_order=False)]
    assert {m.log_time for _, c, m in found if c.topic not in ("/config", "/versions")} == {LAST}
    event = [m.data for _, c, m in found if c.topic == "/events"][-1]
    assert struct.unpack_from("<iI", event, 4) == (2**31 - 1, 0)
    assert ticks_of(Path("whole.mcap")) == WRITTEN
    assert info(Path("whole.mcap"), capsys)[0] == 0


@pytest.mark.parametrize(
    "how",
    [
        {"use_statistics": False},
        {"index_types": IndexType.NONE},
        {
            "use_statistics": False,
            "index_types": IndexType.NONE,
            "repeat_channels": False,
            "repeat_schemas": False,
        },
    ],
    ids=["without statistics", "without places", "without a summary"],
)
def test_a_summary_may_leave_out_what_it_likes(
    log: Path, how: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    wanted = info(log, capsys)
    found = info(anew(log, chunk_size=50_000, **how), capsys)
    for each in (wanted, found):
        del each[1]["log"], each[1]["parts"]
    assert found == wanted
    assert found[0] == 0
    assert found[1]["closed"]
    assert ticks_of(Path("new.mcap")) == WRITTEN


@pytest.mark.parametrize(
    "how",
    [
        {"enable_crcs": False, "chunk_size": 2000},
        {"enable_crcs": False, "use_statistics": False},
    ],
    ids=["small chunks", "one chunk"],
)
def test_a_log_without_crcs_is_read_and_said_to_be_unguarded(
    log: Path, how: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    wanted = info(log, capsys)[1]
    new = anew(log, **how)
    code, found, said = info(new, capsys)
    assert code == 0
    assert said.count("\n") == 1
    assert f"{new}: written by another program without CRCs" in said
    assert (wanted.pop("guarded"), found.pop("guarded")) == (True, False)
    for each in (wanted, found):
        del each["log"], each["parts"]
    assert found == wanted
    assert ticks_of(new) == WRITTEN
    for words in (["export"], ["recover", "--out", "whole.mcap"]):
        assert main(["log", words[0], str(new), *words[1:]]) == 0
        assert "without CRCs" in capsys.readouterr().err
    assert ticks_of(Path("whole.mcap")) == WRITTEN
    assert info(Path("whole.mcap"), capsys)[2] == ""


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"compression": CompressionType.LZ4}, "`mcap compress --compression zstd` writes the log"),
        ({"use_chunking": False}, "outside of a chunk; `mcap sort` writes it into one"),
        ({"order": "/antenna"}, "one that goes back at byte 42; `mcap sort` writes them so"),
    ],
    ids=["lz4", "no chunks", "by topic"],
)
def test_a_log_that_is_not_read_is_refused_with_the_tool_that_rewrites_it(
    how: dict[str, Any], said: str, log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with LogWriter(Path("walk.mcap"), HEADER, 0.0) as out:
        for number in range(1, TICKS + 1):
            out.write(replace(tick(number), now=float(number)))
    new = anew(Path("walk.mcap"), **how)
    for words in (["log", "info"], ["log", "recover", "--out", "whole.mcap"], ["log", "replay"]):
        assert main([*words, str(new)]) == 2
        err = capsys.readouterr().err
        assert said in err
        assert err.count("\n") == 1
    assert not Path("whole.mcap").exists()


def test_a_file_that_continues_a_log_may_have_any_numbers(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The number of a tick is in its message; that of a message is the other program's."""
    more = [replace(tick(number), now=float(number)) for number in range(TICKS + 1, TICKS + 4)]
    with LogWriter(Path("next.mcap"), HEADER, 0.0) as out:
        for each in more:
            out.write(each)
    anew(Path("next.mcap"), number=0).rename("log-2.mcap")
    code, found, _ = info(log, capsys)
    assert (code, found["ticks"], found["closed"]) == (0, TICKS + 3, True)
    assert ticks_of(log) == WRITTEN + [each.pack() for each in more]


PEAK = """
import resource, subprocess, sys
code = subprocess.run([sys.executable, "-m", "antennate", *sys.argv[1:]]).returncode
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)
sys.exit(code)
"""
"""Says the largest memory of a command [KiB]: from a small program, as a child begins with that of
its parent."""
RISING, FALLING, ONE = 1, -1, 0
"""How times of messages follow one another [ns]."""


@pytest.mark.ci
@pytest.mark.parametrize(
    ("step", "size", "count", "pad", "said"),
    [
        pytest.param(
            *(FALLING, 1_000_000, 1900, False, "expected messages in the order of their times"),
            marks=pytest.mark.slow,
        ),
        pytest.param(
            *(RISING, 1_000_000, 1900, False, "expected an undamaged log, found damaged places"),
            marks=pytest.mark.slow,
        ),
        (RISING, 66_000_000, 2, False, "chunk of more than 8388608 bytes"),
        (RISING, 1_000_000, 300, True, "damaged places: 300;"),
        (RISING, 66_000_000, 3, True, "chunk of more than 8388608 bytes"),
        (ONE, 1_000_000, 300, True, "damaged places: 300;"),
        (ONE, 0, 200_000, True, "damaged places: 200000;"),
    ],
)
def test_X10_a_hostile_log_takes_at_most_200_MB(
    step: int, size: int, count: int, pad: bool, said: str, log: Path
) -> None:
    """Some hundred kB of zeros, which are no messages of /antenna, in chunks of 8 or 66 MB."""
    more = ((LAST // 2 + step * number, bytes(size)) for number in range(count))
    noise = random.Random(1).randbytes(20_000_000) if pad else b""
    hostile = anew(log, more=more, attached=noise, chunk_size=7_000_000)
    told = subprocess.run(
        [sys.executable, "-c", PEAK, "log", "info", hostile],
        capture_output=True,
        text=True,
        check=False,
    )
    *lines, peak = told.stderr.splitlines()
    assert told.returncode == 2
    assert len(lines) == 1
    assert said in lines[0]
    assert int(peak) * 1024 <= 200e6


def test_a_log_of_antennate_without_a_crc_is_damaged_whatever_follows_it(log: Path) -> None:
    """Only a file that names another program may be without; a damaged name is none."""
    data = bytearray(log.read_bytes())
    begin, _ = chunks(bytes(data))[2]
    data[begin + 9 + 24 : begin + 9 + 28] = bytes(4)
    for name in (data[len(MAGIC)], 0x55):
        data[len(MAGIC)] = name
        log.write_bytes(data)
        assert ticks_of(log) == WRITTEN[:1] + WRITTEN[2:]


@pytest.mark.parametrize(
    ("odd", "words"),
    [("type", ["log", "info"]), ("encoding", ["log", "info"]), ("controller", ["log", "replay"])],
)
def test_a_very_long_name_is_quoted_in_short(
    odd: str, words: list[str], log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = "long name\n\x1b[2J" * 10_000
    head = HEADER.model_copy(update={"controller": name if odd == "controller" else "closed"})
    with Path("odd.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        for topic, data in head.messages().items():
            kind = writer.register_schema(topic.type.name, "ros2msg", topic.type.schema.encode())
            writer.add_message(writer.register_channel(topic.name, "cdr", kind), 0, data, 0)
        about = name if odd == "type" else ANTENNA.type.name
        kind = writer.register_schema(about, "ros2msg", ANTENNA.type.schema.encode())
        encoding = name if odd == "encoding" else "cdr"
        writer.add_message(writer.register_channel("/antenna", encoding, kind), 1, b"", 1)
        writer.finish()
    assert main([*words, "odd.mcap"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "long name" in said
    assert len(said) < 1000
    assert "\x1b" not in said
