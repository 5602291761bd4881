"""Logs on disk: exact, and readable after whatever happens to them."""

from __future__ import annotations

import io
import json
import math
import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from log_ticks import HEADER, ODD, tick

import antennate
from antennate.errors import AntennateError, LogError
from antennate.params.control import ControlParams
from antennate.telemetry.framing import LONGEST, SCHEMA, framed, opened, pieces
from antennate.telemetry.header import Header
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.writer import LogWriter

ROOM = 0.0


def written(path: Path, ticks: int) -> bytes:
    with LogWriter(path, HEADER, ROOM) as log:
        for number in range(1, ticks + 1):
            log.write(tick(number) if number % 2 else tick(number).pack())
    return path.read_bytes()


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
    for number in range(1, 2000):
        one = tick(number)
        back = Tick.unpack(one.pack())
        assert back.pack() == one.pack()
        assert (back.state, back.causes, back.contact) == (one.state, one.causes, one.contact)
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


@pytest.mark.parametrize("size", [0, 1, 248, 249, 250, 251, 252, 508, 509, 1000, 70_000])
@pytest.mark.parametrize("byte", [0, 1, 255])
def test_a_record_of_any_length_is_framed_and_opened(size: int, byte: int) -> None:
    """Around 254 bytes, where COBS begins a new block."""
    content = b"\x01\x02" + bytes([byte]) * size
    record = framed(content)
    assert record[0] == record[-1] == 0
    assert 0 not in record[1:-1]
    assert [opened(piece or b"") for _, piece in pieces(io.BytesIO(record))] == [content]


def test_G2_a_log_cut_at_every_byte_gives_a_correct_prefix(tmp_path: Path) -> None:
    """Of the header at every 16th byte and around its end."""
    data = written(tmp_path / "whole", 4)
    begin = data.index(0, 1)
    lengths = []
    for size in (*range(0, begin - 16, 16), *range(begin - 16, len(data))):
        result = found(tmp_path / "cut", data[:size])
        if result is None:
            assert not lengths  # only a cut header is refused
            continue
        numbers, log = result
        assert numbers == list(range(1, len(numbers) + 1))
        assert log.bad <= 1
        lengths.append(len(numbers))
    assert lengths == sorted(lengths)
    assert (lengths[0], lengths[-1]) == (0, 4)


@pytest.mark.parametrize(
    ("flips", "logs"),
    [(1, 1000), (3, 100), (40, 20), pytest.param(1, 10_000, marks=pytest.mark.slow)],
)
def test_G2_flipped_bits_cost_the_records_they_hit_and_no_other(
    tmp_path: Path, flips: int, logs: int
) -> None:
    data = written(tmp_path / "whole", 12)
    start = data.index(0, 1) + 1
    rng = np.random.default_rng(flips)
    damaged = 0
    for _ in range(logs):
        spoiled = bytearray(data)
        places = rng.integers(start, len(data), flips)
        for place in places.tolist():
            spoiled[place] ^= 1 << int(rng.integers(8))
        result = found(tmp_path / "spoiled", bytes(spoiled))
        assert result is not None
        numbers, log = result
        assert numbers == sorted(set(numbers))
        assert len(numbers) >= 12 - flips
        lost_end = log.end is None
        assert log.missing == (max(numbers, default=0) if lost_end else 12) - len(numbers)
        if len(numbers) < 12:
            assert log.bad > 0
            assert log.damage[0].offset > 0
            damaged += 1
    assert damaged > 0.8 * logs


def test_G2_a_damaged_header_is_refused_and_what_follows_counted(tmp_path: Path) -> None:
    data = bytearray(written(tmp_path / "whole", 2))
    for place in range(1, data.index(0, 1), 16):
        spoiled = bytearray(data)
        spoiled[place] ^= 1 << place // 16 % 8
        (tmp_path / "spoiled").write_bytes(spoiled)
        with pytest.raises(
            LogError, match=r"no intact header, 2 intact ticks; damaged places: [12]"
        ):
            LogReader(tmp_path / "spoiled")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "no intact header, 0 intact ticks"),
        (b"\0" * 1000, "no intact header, 0 intact ticks"),
        (b"t,left,right\n0.0,1800,1801\n", "no intact header, 0 intact ticks; damaged places: 1"),
        (b"\x7fELF" + bytes(range(256)) * 4000, "no intact header"),
        (framed(bytes((SCHEMA + 1, 1)) + b"{}"), f"schema {SCHEMA}, found schema {SCHEMA + 1}"),
        (framed(tick(1).pack()), "expected a header as first record"),
        (framed(bytes((SCHEMA, 1)) + b"[" * 100_000), "found no JSON"),
        (framed(bytes((SCHEMA, 1)) + b'{"controller": 3}'), "controller: expected text, found 3"),
        (
            framed(HEADER.pack().replace(b'"midpoint"', b'"middle"')),
            "params.conditioning.middle: expected a known key",
        ),
    ],
)
def test_G2_what_is_no_log_is_refused_in_one_line(tmp_path: Path, data: bytes, said: str) -> None:
    path = tmp_path / "log"
    path.write_bytes(data)
    with pytest.raises(LogError, match=said) as error:
        LogReader(path)
    assert "\n" not in str(error.value)


def test_G2_random_bytes_between_records_hide_none(tmp_path: Path) -> None:
    """Also some that no memory should hold at once."""
    rng = np.random.default_rng(5)
    parts = [framed(HEADER.pack())]
    for number in range(1, 40):
        noise = rng.integers(0, 256, int(rng.integers(0, 900)), np.uint8).tobytes()
        parts += [noise, framed(tick(number).pack())]
    parts += [b"\xaa" * (3 * LONGEST), framed(tick(40).pack()), b"\xbb" * (2 * LONGEST)]
    result = found(tmp_path / "log", b"".join(parts))
    assert result is not None
    assert result[0] == list(range(1, 41))
    assert result[1].missing == 0
    assert result[1].bad > 10


def test_G2_what_is_too_long_for_a_record_is_not_held() -> None:
    long, longer = b"\xaa" * (2 * LONGEST), b"\xbb" * (5 * LONGEST)
    file = io.BytesIO(b"\0one\0" + long + b"\0\0two\0" + longer)
    places = [1, 5, 5 + len(long) + 2, 5 + len(long) + 6]
    assert list(pieces(file)) == list(zip(places, [b"one", None, b"two", None], strict=True))


def test_G2_a_tick_that_came_before_is_not_read_again(tmp_path: Path) -> None:
    order = [1, 2, 2, 5, 4, 6]
    data = framed(HEADER.pack()) + b"".join(framed(tick(n).pack()) for n in order)
    result = found(tmp_path / "log", data)
    assert result is not None
    numbers, log = result
    assert numbers == [1, 2, 5, 6]
    assert (log.bad, log.missing) == (2, 2)
    assert [one.reason for one in log.damage] == ["tick 2 after 2", "tick 4 after 5"]


@pytest.mark.parametrize("kills", [30, pytest.param(200, marks=pytest.mark.slow)])
def test_G1_a_killed_program_loses_no_tick_that_was_written(tmp_path: Path, kills: int) -> None:
    here = Path(__file__).parent
    source = Path(antennate.__file__).resolve().parents[1]
    environment = {
        **os.environ,
        "PYTHONPATH": f"{source}{os.pathsep}{here}",
        "OPENBLAS_NUM_THREADS": "1",
    }
    words = [sys.executable, str(here / "log_killed.py"), str(tmp_path), str(kills), "1"]
    done = subprocess.run(
        words, env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    assert len(results) == kills
    for returned, read, missing, bad, wrong in results:
        assert returned <= read <= returned + 1
        cut = bad == 1 and read == returned  # the one that was being written
        assert (missing, wrong) == (0, 0)
        assert bad == 0 or cut
    assert max(returned for returned, *_ in results) > 10


def test_G4_a_full_disk_ends_the_log_with_one_message_and_keeps_what_was_written(
    tmp_path: Path,
) -> None:
    path = tmp_path / "log"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = LogWriter(path, HEADER, ROOM)
    said = []
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
        for number in range(1, 200):
            try:
                log.write(tick(number))
            except LogError as error:
                said.append(str(error))
        log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert len(said) == 1
    assert f"the log ends after {log.written} ticks" in said[0]
    result = found(tmp_path / "copy", path.read_bytes())
    assert result is not None
    numbers, reader = result
    assert numbers == list(range(1, log.written + 1))
    assert log.written > 20
    assert reader.end is None
    assert reader.bad == 1


def test_G4_a_disk_that_takes_nothing_more_is_said_once(tmp_path: Path) -> None:
    path = tmp_path / "log"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    log = LogWriter(path, HEADER, ROOM)
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
    with pytest.raises(LogError, match="expected a tick of 2 joints"):
        Tick.unpack(packed[:100])


@pytest.mark.parametrize(
    "content", [b"", b"\x01\x02", tick(1).pack()[:-1], tick(1).pack() + b"x", b"\x02" * 400]
)
def test_what_is_no_tick_is_refused(content: bytes) -> None:
    with pytest.raises(LogError, match="expected"):
        Tick.unpack(content)


def test_a_header_of_defaults_names_its_fields() -> None:
    content = Header(controller="open", params=ControlParams()).pack()
    said = json.loads(content[2:])
    assert said["version"] == antennate.__version__
    assert said["fields"][:5] == ["schema", "kind", "joints", "number", "asked"]
    assert said["fields"][17:19] == ["yaw1", "yaw2"]
    assert said["params"]["gait"]["frequency"] == 0.6
