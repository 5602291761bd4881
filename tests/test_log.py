"""Logs on disk: exact, and readable after whatever happens to them."""

from __future__ import annotations

import json
import math
import os
import resource
import struct
import subprocess
import sys
import time
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import zstandard
from log_ticks import CHUNK, HEADER, MAGIC, ODD, chunks, tick, unclosed
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

import antennate
from antennate.errors import AntennateError, LogError
from antennate.params.control import ControlParams
from antennate.telemetry.cdr import MessageType
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import (
    ANTENNA,
    CONFIG,
    COORDINATES,
    EVENTS,
    IMU,
    JOINT_COMMANDS,
    TICK_TOPICS,
    TOPICS,
    VERSIONS,
    Topic,
)
from antennate.telemetry.writer import SYNC, LogWriter

ROOM = 0.0


def written(path: Path, ticks: int) -> bytes:
    """A log with one chunk a tick."""
    with LogWriter(path, HEADER, ROOM, flush=0.0) as log:
        for number in range(1, ticks + 1):
            log.write(tick(number))
    return path.read_bytes()


def anew(log: Path, copy: Path, size: int, packed: CompressionType) -> bytes:
    """The same messages in chunks of about this size, as another program writes them."""
    with log.open("rb") as file, copy.open("wb") as target:
        writer, schemas, channels = Writer(target, chunk_size=size, compression=packed), {}, {}
        writer.start()
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            assert schema is not None
            if channel.topic not in channels:
                if schema.name not in schemas:
                    about = (schema.name, schema.encoding, schema.data)
                    schemas[schema.name] = writer.register_schema(*about)
                about = (channel.topic, channel.message_encoding, schemas[schema.name])
                channels[channel.topic] = writer.register_channel(*about)
            writer.add_message(
                channels[channel.topic],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()
    return copy.read_bytes()


def found(path: Path, data: bytes) -> tuple[list[int], LogReader] | None:
    """Numbers of the ticks read, each compared with what was written; None if refused."""
    path.write_bytes(data)
    try:
        with LogReader(path) as log:
            numbers = []
            for one in log:
                assert one.pack() == tick(one.number).pack()
                numbers.append(one.number)
            return numbers, log
    except LogError as error:
        assert "\n" not in str(error)  # noqa: PT017 any other error fails the test
        return None


def test_a_tick_comes_back_bit_by_bit() -> None:
    for number in range(1, 700):
        one = tick(number)
        back = Tick.unpack(one.pack())
        assert back.pack() == one.pack()
        assert (back.state, back.causes, back.contact) == (one.state, one.causes, one.contact)
        names = HEADER.robot.joint_names
        assert Tick.of_messages(dict(one.messages(names, 0))).pack() == one.pack()
    floats = np.array(ODD)
    pairs = Tick.unpack(replace(tick(1), counts=(ODD[1], ODD[2])).pack()).counts
    assert math.copysign(1.0, pairs[0]) == -1.0
    assert np.array(pairs).tobytes() == floats[1:3].tobytes()


def test_a_header_comes_back_with_every_float(tmp_path: Path) -> None:
    written(tmp_path / "log", 0)
    with LogReader(tmp_path / "log") as log:
        assert log.header == HEADER
        assert log.header.params.conditioning.midpoint == 0.30000000000000004
        assert list(log) == []
        assert (log.end, log.missing, log.bad) == (0, 0, 0)


def test_messages_are_the_bytes_of_ros_2() -> None:
    """CDR by its specification: text with a zero, numbers at multiples of their size."""
    text = MessageType("std_msgs/msg/String", "string data\n")
    assert text.encode("hello").hex() == "000100000600000068656c6c6f00"
    mixed = MessageType("m", "bool a\nfloat64 b\nstring[] c\nfloat64[] d\nuint8 e\nint64[2] f\n")
    values = (True, 0.5, ("", "ab"), (1.0,), 7, (-1, 2))
    data = mixed.encode(*values)
    assert data.hex(" ", 4) == (
        "00010000 01000000 00000000 00000000 0000e03f 02000000 01000000 00000000 03000000 "
        "61620000 01000000 00000000 0000f03f 07000000 00000000 ffffffff ffffffff 02000000 00000000"
    )
    assert mixed.decode(data) == dict(zip("abcdef", values, strict=True))
    for cut in range(len(data)):
        with pytest.raises(LogError, match="expected a m, found"):
            mixed.decode(data[:cut])


@pytest.mark.parametrize("every", [29, pytest.param(1, marks=pytest.mark.slow)])
def test_G2_a_log_cut_at_every_byte_gives_a_correct_prefix(tmp_path: Path, every: int) -> None:
    """Of header and summary at some bytes."""
    data = written(tmp_path / "whole", 4)
    places = chunks(data)
    lengths = []
    inner = range(places[2][0] - 20, places[3][0] + 20)
    for size in sorted({*range(0, len(data), every), *inner, len(data)}):
        result = found(tmp_path / "cut", data[:size])
        if result is None:
            assert not lengths  # only a cut header is refused
            continue
        numbers, log = result
        assert numbers == list(range(1, len(numbers) + 1))
        assert log.bad <= 1
        assert log.end == (4 if size == len(data) else None)
        lengths.append(len(numbers))
    assert lengths == sorted(lengths)
    assert (lengths[0], lengths[-1]) == (0, 4)


@pytest.mark.parametrize(
    ("flips", "logs"),
    [(1, 150), (3, 60), (40, 20), pytest.param(1, 10_000, marks=pytest.mark.slow)],
)
def test_G2_flipped_bits_cost_the_chunks_they_hit_and_no_other(
    tmp_path: Path, flips: int, logs: int
) -> None:
    data = written(tmp_path / "whole", 12)
    start = chunks(data)[1][0]
    end = len(unclosed(data))
    rng = np.random.default_rng(flips)
    damaged = 0
    for _ in range(logs):
        spoiled = bytearray(data)
        places = rng.integers(start, end, flips)
        for place in places.tolist():
            spoiled[place] ^= 1 << int(rng.integers(8))
        result = found(tmp_path / "spoiled", bytes(spoiled))
        assert result is not None
        numbers, log = result
        assert numbers == sorted(set(numbers))
        assert len(numbers) >= 12 - flips
        assert (log.end, log.missing) == (12, 12 - len(numbers))
        if len(numbers) < 12:
            assert log.bad > 0
            assert log.damage[0].offset > 0
            damaged += 1
    assert damaged > 0.5 * logs


@pytest.mark.parametrize("packed", [CompressionType.ZSTD, CompressionType.NONE])
def test_G2_damage_costs_other_programs_logs_no_more(
    tmp_path: Path, packed: CompressionType
) -> None:
    """A chunk that is damaged anywhere, its head included, hides none of those that follow."""
    written(tmp_path / "log", 40)
    data = anew(tmp_path / "log", tmp_path / "new", 1000, packed)
    places = chunks(data)
    begin, end = places[len(places) // 2]
    assert len(places) > 20
    for place in (begin, begin + 3, begin + 12, begin + 45, end - 1):
        spoiled = bytearray(data)
        spoiled[place] ^= 0x55
        result = found(tmp_path / "spoiled", bytes(spoiled))
        assert result is not None
        numbers, log = result
        assert len(numbers) >= 36
        assert numbers[-1] == 40
        assert log.bad >= 40 - len(numbers)
        assert len(numbers) < 40 or place in (begin + 12, begin + 45)  # what no CRC covers


def test_G2_a_chunk_without_a_crc_is_called_so(tmp_path: Path) -> None:
    """MCAP lets a program leave it out; what cannot be checked is not read."""
    data = written(tmp_path / "log", 4)
    begin, _ = chunks(data)[2]
    bare = bytearray(data)
    bare[begin + 9 + 24 : begin + 9 + 28] = bytes(4)
    result = found(tmp_path / "bare", bytes(bare))
    assert result is not None
    assert result[0] == [1, 3, 4]
    assert [damage.reason for damage in result[1].damage] == ["chunk without a CRC"]


@pytest.mark.parametrize("closed", [True, False])
def test_G2_an_index_that_a_flipped_bit_makes_an_end_ends_nothing(
    tmp_path: Path, closed: bool
) -> None:
    """Kinds of MCAP: 0x07 an index of messages, 0x0F the end of the data."""
    data = written(tmp_path / "log", 6)
    (_, end), (after, _) = chunks(data)[2:4]
    assert data[end] == 0x07
    spoiled = bytearray(data if closed else unclosed(data))
    spoiled[end] ^= 0x08
    result = found(tmp_path / "spoiled", bytes(spoiled))
    assert result is not None
    assert result[0] == [1, 2, 3, 4, 5, 6]
    assert [damage.reason for damage in result[1].damage] == ["damaged record"]
    assert after > end


def test_G2_a_damaged_summary_costs_no_tick(tmp_path: Path) -> None:
    data = written(tmp_path / "whole", 3)
    for place in range(len(unclosed(data)) + 13, len(data), 97):
        spoiled = bytearray(data)
        spoiled[place] ^= 1 << place % 8
        result = found(tmp_path / "spoiled", bytes(spoiled))
        assert result is not None
        assert (result[0], result[1].end, result[1].missing) == ([1, 2, 3], None, 0)
        assert [one.reason for one in result[1].damage] == ["damaged summary"]


def test_G2_a_damaged_header_is_refused_and_what_follows_counted(tmp_path: Path) -> None:
    data = bytearray(written(tmp_path / "whole", 2))
    begin, end = chunks(data)[0]
    refused = 0
    for place in range(begin + 60, end, 32):
        spoiled = bytearray(data)
        spoiled[place] ^= 1 << place // 16 % 8
        (tmp_path / "spoiled").write_bytes(spoiled)
        try:
            with LogReader(tmp_path / "spoiled") as log:
                assert log.header == HEADER  # a bit that zstd does not use
        except LogError as error:
            assert "no intact header, 2 intact ticks; damaged places: 1" in str(error)  # noqa: PT017
            refused += 1
    assert refused > 30


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "no intact header, 0 intact ticks"),
        (b"\0" * 1000, "no intact header, 0 intact ticks"),
        (b"t,left,right\n0.0,1800,1801\n", "no intact header, 0 intact ticks; damaged places: 1"),
        (b"\x7fELF" + bytes(range(256)) * 4000, "no intact header"),
        (MAGIC, "no intact header, 0 intact ticks; damaged places: 0"),
    ],
)
def test_G2_what_is_no_log_is_refused_in_one_line(tmp_path: Path, data: bytes, said: str) -> None:
    path = tmp_path / "log"
    path.write_bytes(data)
    with pytest.raises(LogError, match=said) as error:
        LogReader(path)
    assert "\n" not in str(error.value)


def foreign(
    path: Path, config: str | bytes | None, changed: str = "", encoding: str = "cdr"
) -> None:
    """A log of the right topics by `mcap` alone, one of them `changed` in its definition."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        for topic in TOPICS:
            schema = topic.type.schema.encode() + b"uint8 more\n" * (topic.name == changed)
            kind = writer.register_schema(topic.type.name, "ros2msg", schema)
            channel = writer.register_channel(topic.name, encoding, kind)
            if topic is CONFIG and config is not None:
                data = config if isinstance(config, bytes) else topic.type.encode(config)
                writer.add_message(channel, 0, data, 0)
            elif topic is VERSIONS:
                writer.add_message(channel, 0, topic.type.encode("{}"), 0)
        writer.finish()


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (None, "found no /config"),
        ("[" * 100_000, "found no JSON"),
        ("[]", "found no JSON"),
        (b"", "/config: expected a std_msgs/msg/String, found 0 bytes"),
        ('{"controller": 3}', "controller: expected text, found 3"),
        ('{"controller": "open", "params": {"gates": 1}}', "params.gates: expected a known key"),
    ],
)
def test_G2_a_header_that_says_something_else_is_refused(
    tmp_path: Path, config: str | bytes | None, said: str
) -> None:
    foreign(tmp_path / "log", config)
    with pytest.raises(LogError, match=said) as error:
        LogReader(tmp_path / "log")
    assert "\n" not in str(error.value)


def test_G2_other_definitions_of_messages_are_refused(tmp_path: Path) -> None:
    config = '{"controller": "open", "params": {}}'
    foreign(tmp_path / "log", config)
    with LogReader(tmp_path / "log") as log:
        assert list(log) == []
    foreign(tmp_path / "other", config, changed="/antenna")
    with pytest.raises(LogError, match="expected antennate_msgs/msg/Antenna as now defined"):
        LogReader(tmp_path / "other")


def test_G2_another_encoding_of_messages_is_refused(tmp_path: Path) -> None:
    foreign(tmp_path / "log", '{"controller": "open", "params": {}}', encoding="json")
    with pytest.raises(LogError, match="expected messages in /config encoded as cdr, found json"):
        LogReader(tmp_path / "log")


@pytest.mark.parametrize(
    ("topic", "kind"),
    [
        (ANTENNA, "antennate_msgs/msg/Antenna"),
        (JOINT_COMMANDS, "sensor_msgs/msg/JointState"),
        (EVENTS, "rcl_interfaces/msg/Log"),
        (COORDINATES, "antennate_msgs/msg/Coordinates"),
    ],
)
def test_G2_a_message_of_a_known_topic_that_is_not_of_its_type_is_named(
    tmp_path: Path, topic: Topic, kind: str
) -> None:
    """Of three ticks the second one has three bytes in place of a message."""
    path = tmp_path / "log"
    with LogWriter(path, HEADER, ROOM, flush=0.0) as log:
        log.write(tick(1))
        messages = dict(tick(2).messages(HEADER.robot.joint_names, 2)) | {topic: b"abc"}
        for each, data in messages.items():
            log.add(each, 2, 2, data)
        log.flush()
        log.write(tick(3))
    with LogReader(path) as reader:
        reader.survey() if topic is EVENTS else list(reader)
        assert reader.ticks == 3 - (topic in (ANTENNA, JOINT_COMMANDS))
        assert [each.reason for each in reader.damage] == [
            f"{topic.name}: expected a {kind}, found 3 bytes: another encoding"
        ]


def test_G2_random_bytes_between_records_hide_none(tmp_path: Path) -> None:
    """Also some that no memory should hold at once."""
    rng = np.random.default_rng(5)
    data = written(tmp_path / "whole", 40)
    first, *others = chunks(data)
    parts = [data[: first[1]]]
    for begin, end in others:
        noise = rng.integers(0, 256, int(rng.integers(1, 900)), np.uint8).tobytes()
        parts += [noise, data[begin:end]]
    begin, end = others[-1]
    parts.insert(-1, b"\xaa" * 3_000_000)
    parts.append(b"\xbb" * 2_000_000)
    result = found(tmp_path / "log", b"".join(parts))
    assert result is not None
    assert result[0] == list(range(1, 41))
    assert result[1].missing == 0
    assert result[1].bad > 10


def test_X10_a_chunk_that_grows_beyond_all_bounds_is_not_unpacked(tmp_path: Path) -> None:
    """A bomb: it says 1 kB, or 100 MB, and holds 1 GB; and a record that says 2^63 bytes."""
    data = unclosed(written(tmp_path / "whole", 2))
    bomb = zstandard.compress(bytes(1 << 30))
    tail = struct.pack("<Q", len(bomb)) + bomb
    for size in (1000, 10**8, 1 << 63):
        head = struct.pack("<QQQII", 0, 0, size, zlib.crc32(b""), 4) + b"zstd"
        record = struct.pack("<BQ", CHUNK, len(head) + len(tail)) + head + tail
        second = chunks(data)[1][0]
        result = found(tmp_path / "log", data[:second] + record + data[second:])
        assert result is not None
        assert (result[0], result[1].bad) == ([1, 2], 1)
    result = found(tmp_path / "log", data + struct.pack("<BQ", CHUNK, 1 << 63))
    assert result is not None
    assert (result[0], result[1].bad) == ([1, 2], 1)


def test_G2_a_tick_that_came_before_is_not_read_again(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "whole", HEADER, ROOM, flush=0.0) as log:
        for number in [1, 2, 2, 5, 4, 6]:
            log.write(tick(number))
    result = found(tmp_path / "log", unclosed((tmp_path / "whole").read_bytes()))
    assert result is not None
    numbers, reader = result
    assert numbers == [1, 2, 5, 6]
    assert (reader.bad, reader.missing) == (2, 2)
    assert [one.reason for one in reader.damage] == ["tick 2 after 2", "tick 4 after 5"]


def test_the_readers_of_mcap_read_all_of_it(tmp_path: Path) -> None:
    """By topic and time, also what a killed program left; our encoder against another decoder."""
    data = written(tmp_path / "log", 30)
    with (tmp_path / "log").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert {channel.topic for channel in summary.channels.values()} == {
            topic.name
            for topic in TOPICS
            if topic is not IMU  # its robot has none
        }
        for topic in TICK_TOPICS:
            assert len(list(reader.iter_messages(topics=[topic.name]))) == 30
    (tmp_path / "killed").write_bytes(unclosed(data))
    with (tmp_path / "killed").open("rb") as file:
        messages = NonSeekingReader(file).iter_messages(log_time_order=False)
        topics = [channel.topic for _, channel, _ in _until_the_end(messages)]
    assert topics.count("/antenna") == 30
    with (tmp_path / "log").open("rb") as file:
        stream = StreamReader(file, emit_chunks=True, validate_crcs=True)
        crcs = [each.uncompressed_crc for each in stream.records if isinstance(each, Chunk)]
    assert len(crcs) == 31
    assert all(crcs)


@pytest.mark.parametrize(
    ("size", "packed"),
    [
        *((size, CompressionType.ZSTD) for size in (500, 20_000, 1 << 30)),
        (20_000, CompressionType.NONE),
    ],
)
def test_a_log_that_another_program_has_written_anew_is_read_whole(
    tmp_path: Path, size: int, packed: CompressionType
) -> None:
    """Header and ticks share chunks, or channels and their schemas stand in several."""
    written(tmp_path / "log", 30)
    anew(tmp_path / "log", tmp_path / "new", size, packed)
    read = found(tmp_path / "copy", (tmp_path / "new").read_bytes())
    assert read is not None
    numbers, reader = read
    assert numbers == list(range(1, 31))
    assert (reader.bad, reader.missing, reader.end) == (0, 0, 30)
    with LogReader(tmp_path / "new") as one, LogReader(tmp_path / "log") as other:
        assert one.header == other.header
        assert one.survey().messages == other.survey().messages
        assert one.ticks == 30


def test_a_file_that_only_looks_like_the_next_one_is_left_out(tmp_path: Path) -> None:
    """It has the same header, as another run of the same, but begins with the first tick."""
    written(tmp_path / "walk.mcap", 20)
    written(tmp_path / "walk-2.mcap", 30)
    with LogReader(tmp_path / "walk.mcap") as log:
        numbers = [one.number for one in log]
    assert numbers == list(range(1, 21))
    assert [(one.path.name, one.reason) for one in log.damage] == [
        ("walk-2.mcap", "a file of another log")
    ]
    other = HEADER.model_copy(update={"seed": 8})
    (tmp_path / "walk-2.mcap").unlink()
    with LogWriter(tmp_path / "walk-2.mcap", other, ROOM, flush=0.0) as writer:
        writer.write(tick(21))
    with LogReader(tmp_path / "walk.mcap") as log:
        assert len(list(log)) == 20
    assert (log.bad, log.missing, log.end) == (1, 0, 20)


def test_messages_have_the_time_of_day(tmp_path: Path) -> None:
    """A loop that began with the year 2027; other tools draw their curves over these times."""
    begin = 1_798_761_600 * 10**9
    times = (0.5, 0.51, 60.0)
    with LogWriter(tmp_path / "log", HEADER.model_copy(update={"start": begin}), ROOM) as log:
        for number, now in enumerate(times, start=1):
            log.write(replace(tick(number), now=now))
    with (tmp_path / "log").open("rb") as file:
        found = [message.log_time for *_, message in make_reader(file).iter_messages(["/antenna"])]
    assert found == [begin + round(1e9 * now) for now in times]


def _until_the_end(messages: Iterator) -> Iterator:
    """What `mcap` reads of a file that has no end."""
    try:
        yield from messages
    except (McapError, struct.error):
        return


def test_rosbags_decodes_what_our_encoder_made(tmp_path: Path) -> None:
    rosbags = pytest.importorskip("rosbags.highlevel")
    one = replace(tick(3), now=1.5, angles=tuple(0.1 * n for n in range(19)))
    with LogWriter(tmp_path / "log.mcap", HEADER, ROOM) as log:
        log.write(replace(one, positions=one.angles))
    with rosbags.AnyReader([tmp_path / "log.mcap"]) as reader:
        found = {c.topic: reader.deserialize(data, c.msgtype) for c, _, data in reader.messages()}
        times = {
            time for connection, time, _ in reader.messages() if connection.topic == "/antenna"
        }
    assert times == {1_500_000_000}
    assert found["/joint_commands"].name == list(HEADER.robot.joint_names)
    assert found["/joint_commands"].position.tolist() == list(one.angles)
    assert found["/joint_states"].position.tolist() == list(one.angles)
    assert (found["/joint_states"].header.stamp.sec, len(found["/joint_states"].effort)) == (1, 0)
    np.testing.assert_array_equal(found["/antenna"].counts, one.counts)
    assert found["/maneuver"].maneuver == one.maneuver
    assert found["/counters"].frames == one.frames
    assert tuple(found["/supervisor"].causes) == one.causes
    assert found["/events"].msg.startswith(one.state)
    assert json.loads(found["/versions"].data)["antennate"] == antennate.__version__


def test_a_new_cause_within_a_state_is_an_event_and_a_known_one_is_none(tmp_path: Path) -> None:
    stale, silent = "HOLD STALE: no fresh sample (age {})", "HOLD SILENT_SERVO: servo 7"
    told = [
        ("OK", ()),
        ("HOLD", (stale.format(0.06),)),
        ("HOLD", (stale.format(0.07),)),
        ("HOLD", (silent, stale.format(0.08))),
        ("HOLD", (stale.format(0.09),)),
        ("HOLD", (silent, stale.format(0.10))),
        ("OK", ()),
        ("HOLD", (silent,)),
    ]
    with LogWriter(tmp_path / "log.mcap", HEADER) as log:
        for number, (state, causes) in enumerate(told):
            log.write(replace(tick(number), now=0.01 * number, state=state, causes=causes))
    with LogReader(tmp_path / "log.mcap") as reader:
        events = [EVENTS.decode(data)["msg"] for _, data in reader.survey().events]
    assert events == [
        "OK",
        "HOLD after OK; HOLD STALE: no fresh sample (age 0.06)",
        "HOLD; HOLD SILENT_SERVO: servo 7; HOLD STALE: no fresh sample (age 0.08)",
        "OK after HOLD",
        "HOLD after OK; HOLD SILENT_SERVO: servo 7",
    ]


@pytest.mark.ci
@pytest.mark.parametrize("kills", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_G1_a_killed_program_loses_a_quarter_of_a_second_at_most(
    tmp_path: Path, kills: int
) -> None:
    here = Path(__file__).parent
    source = Path(antennate.__file__).resolve().parents[1]
    environment = {
        **os.environ,
        "PYTHONPATH": f"{source}{os.pathsep}{here}",
        "OPENBLAS_NUM_THREADS": "1",
    }
    words = [sys.executable, str(here / "log_killed.py"), str(tmp_path), str(kills), "1"]
    done = subprocess.run(
        words, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    assert len(results) == kills
    for given, read, missing, bad, wrong, lost in results:
        assert read <= given + 1  # the kill may come before a write is told
        assert lost <= 0.25
        assert (missing, wrong) == (0, 0)
        assert bad <= 1  # the chunk that was being written
    assert max(lost for *_, lost in results) > 0.05
    assert max(given for given, *_ in results) > 30


@pytest.mark.ci
def test_G3_a_power_cut_loses_a_second_at_most(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After it a file holds what it held when the disk was last asked to keep it."""
    path, kept, names = tmp_path / "log", [0], list[Path]()

    def asked(file: int) -> None:
        kept.append(os.fstat(file).st_size)

    def asked_whole(file: int) -> None:
        names.append(Path(f"/proc/self/fd/{file}").readlink())

    monkeypatch.setattr(os, "fdatasync", asked)
    monkeypatch.setattr(os, "fsync", asked_whole)
    log, begin, cuts = LogWriter(path, HEADER, ROOM, sync=SYNC), time.monotonic(), []
    before = stood = 0.0  # time in which a busy machine let nothing of this happen
    while (now := time.monotonic() - begin) < 3.0:
        before, stood = now, max(stood, now - before)
        log.write(replace(tick(log.written), now=now))
        if log.written % 5 == 0:
            cuts.append((now, kept[-1]))
        time.sleep(0.01)
    log.close()
    assert tmp_path in names
    assert len(set(kept)) >= 4
    whole, rest = path.read_bytes(), tmp_path / "rest"
    for now, size in cuts:
        if now <= 1.0:
            continue
        rest.write_bytes(whole[:size])
        with LogReader(rest) as reader:
            last = max(each.now for each in reader)
        assert now - last <= 1.0 + stood


def test_G4_a_full_disk_ends_the_log_with_one_message_and_keeps_what_was_written(
    tmp_path: Path,
) -> None:
    path, whole = tmp_path / "log", tmp_path / "whole"
    with LogWriter(whole, HEADER, ROOM, flush=0.0) as log:
        for number in range(1, 21):
            log.write(tick(number))
        within = whole.stat().st_size + 300  # in the midst of the next tick
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = LogWriter(path, HEADER, ROOM, flush=0.0)
    said = []
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (within, hard))
        for number in range(1, 200):
            try:
                log.write(tick(number))
            except LogError as error:
                said.append(str(error))
        log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert len(said) == 1
    assert f"the log ends after {log.kept} ticks" in said[0]
    result = found(tmp_path / "copy", path.read_bytes())
    assert result is not None
    numbers, reader = result
    assert numbers == list(range(1, len(numbers) + 1))
    assert log.kept == len(numbers) == 20
    assert reader.end is None
    assert reader.bad == 1


def test_G4_a_disk_that_takes_nothing_more_is_said_once(tmp_path: Path) -> None:
    path = tmp_path / "log"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = LogWriter(path, HEADER, ROOM, flush=0.0)
    log.write(tick(1))
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, hard))
        with pytest.raises(LogError, match="File too large; the log ends after 1 ticks"):
            log.write(tick(2))
        log.write(tick(3))
        log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert found(tmp_path / "copy", path.read_bytes())[0] == [1]  # type: ignore[index]


def test_G4_a_log_that_cannot_begin_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log"
    with pytest.raises(LogError, match="expected 1e\\+12 GB free"):
        LogWriter(path, HEADER, 1e21)
    assert not path.exists()
    with pytest.raises(LogError, match="No such file"):
        LogWriter(tmp_path / "gone" / "log", HEADER, ROOM)
    with pytest.raises(LogError, match="expected a log that does not exist yet"):
        LogWriter(tmp_path, HEADER, ROOM)
    written(path, 3)
    before = path.read_bytes()
    with pytest.raises(LogError, match="choose another name"):
        LogWriter(path, HEADER, ROOM)
    assert path.read_bytes() == before


def test_a_tick_that_does_not_fit_is_refused() -> None:
    with pytest.raises(LogError, match="numbers that fit"):
        replace(tick(1), missed=-1).pack()
    assert issubclass(LogError, AntennateError)


def test_a_tick_of_a_robot_with_other_joints_comes_back_and_a_short_one_is_refused() -> None:
    other = replace(tick(1), angles=(0.5, -0.25))
    packed = other.pack()
    assert Tick.unpack(packed).angles == (0.5, -0.25)
    with pytest.raises(LogError, match="expected a antennate_msgs/msg/Tick, found 100 bytes"):
        Tick.unpack(packed[:100])


@pytest.mark.parametrize(
    "content", [b"", b"\x01\x02", tick(1).pack()[:-1], tick(1).pack() + b"x", b"\x02" * 400]
)
def test_what_is_no_tick_is_refused(content: bytes) -> None:
    with pytest.raises(LogError, match="expected"):
        Tick.unpack(content)


def test_a_header_of_defaults_says_what_wrote_it(tmp_path: Path) -> None:
    header = Header(controller="open", params=ControlParams(), calibration='{"left": {}}')
    assert Header.unpack(header.pack()) == header
    LogWriter(tmp_path / "log", header, ROOM).close()
    with LogReader(tmp_path / "log") as log:
        assert log.header == header
        assert log.header.version == antennate.__version__
        assert log.header.params.gait.frequency == 0.6
