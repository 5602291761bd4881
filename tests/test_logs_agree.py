"""A log that another program wrote anew in any legal way: all that read it tell the same."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Message, Schema
from mcap.writer import CompressionType, IndexType, Writer

from antennate import simulate
from antennate.cli import main
from antennate.telemetry.reader import LogReader
from antennate.telemetry.writer import LogWriter

Messages = Sequence[tuple[Schema | None, Channel, Message]]
LAST = 2**64 - 1
"""Latest time [ns] that MCAP can tell."""
SMALL = {"chunk_size": 300}
"""A few messages in a chunk: its borders are within ticks."""
BARE = {
    "use_statistics": False,
    "use_summary_offsets": False,
    "index_types": IndexType.NONE,
    "repeat_channels": False,
    "repeat_schemas": False,
}
"""Without a summary."""


class Anew(NamedTuple):
    """A way to write a log anew.

    Attributes:
        change: What becomes of its messages.
        how: What the writer is told.
        more: What is written before each message, with its number.
        channels: Channels of each topic, taken in turn.
        reason: Why the ticks cannot be known; empty where they can.
    """

    change: Callable[[Messages], Messages] = lambda messages: messages
    how: Mapping[str, Any] = SMALL
    more: Callable[[Writer, int], object] = lambda writer, number: None
    channels: int = 1
    reason: str = ""


def by_topic(messages: Messages) -> Messages:
    return sorted(messages, key=lambda each: each[1].topic)


def at(time: int, messages: Messages) -> Messages:
    return [(s, c, replace(each, log_time=time)) for s, c, each in messages]


def numbered(messages: Messages, start: int, step: int) -> Messages:
    numbers = count(start, step)
    return [(s, c, replace(each, sequence=next(numbers))) for s, c, each in messages]


def attach(writer: Writer, number: int) -> None:
    writer.add_attachment(0, 0, "photo", "image/png", bytes(100))
    writer.add_metadata("place", {"room": "12"})


def speak(writer: Writer, number: int) -> None:
    """A message of another program, each on a channel of its own, whose times go back."""
    channel = writer.register_channel("/other", "json", 0)
    writer.add_message(channel, LAST - number, b"{}", 0)


WAYS = {
    "as it comes": Anew(how={}),
    "small chunks": Anew(),
    "no chunks": Anew(how={"use_chunking": False}),
    "no chunks, by topic": Anew(by_topic, {"use_chunking": False}),
    "no CRCs": Anew(how={"enable_crcs": False, **SMALL}),
    "no statistics": Anew(how={"use_statistics": False}),
    "no index": Anew(how={"index_types": IndexType.NONE}),
    "no summary": Anew(how={**BARE, **SMALL}),
    "neither chunks nor summary": Anew(how={**BARE, "use_chunking": False}),
    "uncompressed": Anew(how={"compression": CompressionType.NONE}),
    "lz4": Anew(how={"compression": CompressionType.LZ4}),
    "zstd": Anew(how={"compression": CompressionType.ZSTD}),
    "attachments": Anew(more=attach),
    "attachments, no chunks": Anew(how={"use_chunking": False}, more=attach),
    "another topic": Anew(more=speak),
    "another topic, by topic": Anew(by_topic, more=speak),
    "by topic": Anew(by_topic),
    "by time and topic": Anew(
        lambda found: sorted(found, key=lambda each: (each[2].log_time, each[1].topic))
    ),
    "backwards": Anew(lambda found: found[::-1]),
    "header last": Anew(lambda found: [*found[2:], *at(LAST, found[:2])]),
    "numbers all 0": Anew(lambda found: numbered(found, 0, 0)),
    "numbers fall": Anew(lambda found: numbered(found, 10**6, -1)),
    "each message twice": Anew(lambda found: [each for each in found for _ in range(2)]),
    "all of it twice, of other numbers": Anew(lambda found: numbered([*found, *found], 0, 1)),
    "all of it twice": Anew(lambda found: [*found, *found]),
    "two channels of a topic": Anew(channels=2),
    "one time and number": Anew(  # nothing tells which messages are of one tick
        lambda found: at(7, numbered(found, 0, 0)), reason="tick with two messages in a topic"
    ),
}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A simulated second, and an event after it."""
    folder = tmp_path_factory.mktemp("log")
    simulate("closed", time_limit=1.0, log=folder / "simulated.mcap")
    with (
        LogReader(folder / "simulated.mcap") as log,
        LogWriter(folder / "log.mcap", log.header) as out,
    ):
        for records, _ in log.groups():
            for record in records:
                out.add(*record)
        out.event("carried back to the start", t=9.0)
    return folder / "log.mcap"


def write(source: Path, target: Path, way: Anew) -> None:
    with source.open("rb") as file:
        messages = [*make_reader(file).iter_messages(log_time_order=False)]
    with target.open("wb") as file:
        writer, known = Writer(file, **way.how), dict[tuple[str, int], int]()
        writer.start()
        for number, (schema, channel, each) in enumerate(way.change(messages)):
            place = channel.topic, number % way.channels
            if place not in known:
                assert schema is not None
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                known[place] = writer.register_channel(channel.topic, "cdr", kind)
            way.more(writer, number)
            writer.add_message(known[place], each.log_time, each.data, 0, each.sequence)
        writer.finish()


def told(path: Path) -> tuple[list[Any], list[int], list[str]]:
    """What `info`, `export`, `replay` and the reader say, exit codes, and what is on stderr."""
    found, codes, errors = list[Any](), list[int](), list[str]()
    for words in (["log", "info", "--json"], ["log", "replay", "--json"], ["log", "export"]):
        with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as wrong:
            codes.append(main([*words, str(path)]))
        errors.append(wrong.getvalue())
        if "--json" in words and out.getvalue():
            result = json.loads(out.getvalue())
            found.append({k: v for k, v in result.items() if k not in ("log", "parts", "guarded")})
    table = path.with_suffix(".csv")
    found.append(table.read_text() if table.exists() else "")
    with LogReader(path) as log:
        found.append([each.pack() for each in log])
    return found, codes, errors


@pytest.fixture(scope="module")
def wanted(log: Path) -> list[Any]:
    return told(log)[0]


@pytest.mark.parametrize("name", WAYS)
def test_all_say_the_same(name: str, log: Path, wanted: list[Any], tmp_path: Path) -> None:
    way, new = WAYS[name], tmp_path / "new.mcap"
    write(log, new, way)
    found, codes, errors = told(new)
    if way.reason:
        assert codes == [2, 2, 2]
        assert found[-2:] == ["", []]
        assert all(way.reason in each and each.count("\n") == 1 for each in errors)
    else:
        assert found == wanted
        assert codes == [0, 0, 0]
        assert all(each.count("\n") <= 1 for each in errors)


def test_so_they_do_of_a_log_that_rosbags_wrote(
    log: Path, wanted: list[Any], tmp_path: Path
) -> None:
    """It leaves the comments out of the definitions of messages."""
    rosbags = pytest.importorskip("rosbags.highlevel")
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    how = {"version": 9, "storage_plugin": rosbag2.StoragePlugin.MCAP}
    with rosbags.AnyReader([log]) as bag, rosbag2.Writer(tmp_path / "bag", **how) as out:
        topics = {
            each.topic: out.add_connection(each.topic, each.msgtype, typestore=bag.typestore)
            for each in bag.connections
        }
        for each, time, data in bag.messages():
            out.write(topics[each.topic], time, data)
    assert told(tmp_path / "bag" / "bag.mcap")[0] == wanted
