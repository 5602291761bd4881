"""Protocol 2.0, against packets printed by others and against the manufacturer's own program."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from test_manual_packets import FAST

from dynamixel_bus import packets
from dynamixel_bus.instructions import fast_pieces
from dynamixel_bus.packets import (
    HEADER,
    LONGEST,
    Instruction,
    Packet,
    PacketError,
    Status,
    StatusError,
)
from dynamixel_bus.parser import Parser

GOLDEN = Path(__file__).parents[3] / "shared/data/dxl_golden_packets/golden_packets.json"
needs_golden = pytest.mark.skipif(not GOLDEN.exists(), reason="golden packets not present")

FAST_REPLY = FAST["sync"]
FAST_IDS, FAST_VALUES = [3, 7, 4], [166, 2079, 1023]


@needs_golden
def test_golden_packets_byte_for_byte_both_ways() -> None:
    checked = 0
    for item in json.loads(GOLDEN.read_text())["packets"]:
        wire = bytes.fromhex(item["hex"])
        found = Parser().feed(wire)
        if item["kind"].endswith("-bad"):
            assert found == [], item["name"]
            continue
        (packet,) = found
        assert packets.encode(packet.id, packet.instruction, packet.params) == wire, item["name"]
        assert (packet.id, packet.instruction) == (wire[4], wire[7])
        assert (packet.instruction == Instruction.STATUS) == (item["kind"] == "status")
        checked += 1
    assert checked == 23


@needs_golden
def test_golden_crc_and_stuffing() -> None:
    golden = json.loads(GOLDEN.read_text())
    for item in golden["crc_vectors"]:
        crc = packets.crc16(bytes.fromhex(item["data"]))
        assert crc.to_bytes(2, "little") == bytes.fromhex(item["crc_le"])
    for item in golden["stuffing_vectors"]:
        raw, stuffed = bytes.fromhex(item["raw"]), bytes.fromhex(item["stuffed"])
        assert packets.stuff(raw) == stuffed
        assert packets.unstuff(stuffed) == raw


def test_crc_can_go_on_where_it_stopped() -> None:
    """CRC-16/UMTS has this polynomial and start; its check value is in the catalogue of CRCs."""
    assert packets.crc16(b"123456789") == 0xFEE8
    assert packets.crc16(b"6789", packets.crc16(b"12345")) == 0xFEE8


def test_B3_every_pattern_near_a_header_survives_stuffing() -> None:
    """All data of up to 7 bytes out of FF, FD and 00: whole on the other side, no header inside."""
    count = 0
    for length in range(8):
        for pattern in itertools.product(b"\xff\xfd\x00", repeat=length):
            data = bytes(pattern)
            wire = packets.write(1, 116, data)
            assert wire.find(HEADER, 1) < 0
            (packet,) = Parser().feed(wire)
            assert packet == Packet(1, Instruction.WRITE, b"\x74\x00" + data)
            count += 1
    assert count == (3**8 - 1) // 2


def test_B3_stuffing_is_that_of_the_manufacturer() -> None:
    sdk = pytest.importorskip("dynamixel_sdk")
    handler = sdk.PacketHandler(2.0)
    for pattern in itertools.product(b"\xff\xfd\x00", repeat=6):
        params = bytes(pattern)
        plain = [*HEADER, 1, 9, 0, Instruction.WRITE, *params, 0, 0]
        theirs = bytes(handler.addStuffing(list(plain))[7:-2])
        assert packets.stuff(bytes([Instruction.WRITE]) + params) == theirs


def stream(count: int = 8) -> tuple[bytes, list[Packet]]:
    rng = np.random.default_rng(1)
    wire, sent = b"", []
    for i in range(count):
        data = bytes(rng.choice([0xFF, 0xFD, 0x00, 0x55], 12).tolist())
        sent.append(Packet(i + 1, Instruction.STATUS, b"\0" + data))
        wire += packets.encode(i + 1, Instruction.STATUS, b"\0" + data)
    return wire, sent


def test_the_same_packets_come_out_however_the_stream_is_cut() -> None:
    wire, sent = stream()
    for size in range(1, 40):
        parser = Parser()
        found = [p for i in range(0, len(wire), size) for p in parser.feed(wire[i : i + size])]
        assert found == sent
        assert parser.pending == parser.counters.skipped_bytes == 0


def test_B3_no_flipped_bit_makes_a_wrong_packet_and_the_next_one_is_found() -> None:
    wire, sent = stream(3)
    for bit in range(8 * len(wire)):
        hurt = bytearray(wire)
        hurt[bit // 8] ^= 1 << bit % 8
        parser = Parser()
        found = parser.feed(bytes(hurt)) + parser.feed(bytes(LONGEST))
        assert len(found) == 2
        assert all(packet in sent for packet in found)


def test_B3_no_missing_byte_makes_a_wrong_packet() -> None:
    wire, sent = stream(3)
    for gone in range(len(wire)):
        found = Parser().feed(wire[:gone] + wire[gone + 1 :] + bytes(LONGEST))
        assert len(found) >= 1
        assert all(packet in sent for packet in found)


def test_garbage_costs_bounded_memory_and_every_byte_is_counted() -> None:
    rng = np.random.default_rng(2)
    parser, wire = Parser(), stream(1)[0]
    fed = most = 0
    for size in (1, 7, 1000, 60_000):
        junk = bytes(rng.choice([0xFF, 0xFD, 0x00, 0x01], size).tolist())
        assert not parser.feed(junk)
        fed, most = fed + size, max(most, parser.pending)
        assert parser.counters.skipped_bytes + parser.pending == fed
    parser.reset()
    assert parser.feed(wire) == stream(1)[1]
    assert (parser.counters.skipped_bytes, parser.pending) == (fed, 0)
    assert most < 2 * LONGEST


def test_lengths_that_cannot_be_are_refused_at_once() -> None:
    parser = Parser()
    assert parser.feed(HEADER + b"\x01\xff\xff" + packets.ping(7)) == [Packet(7, 1, b"")]
    assert parser.feed(HEADER + b"\x01\x02\x00" + packets.ping(8)) == [Packet(8, 1, b"")]
    assert parser.pending == 0


def test_an_error_that_nobody_knows_is_an_error() -> None:
    packet = Parser().feed(packets.encode(5, Instruction.STATUS, b"\x2a"))[0]
    answer = packets.as_status(packet)
    assert answer is not None
    assert answer.error == StatusError.UNKNOWN


def test_the_fast_reply_of_the_manual_is_split_and_made() -> None:
    pieces = [bytes.fromhex(piece) for piece in FAST_REPLY]
    answers = packets.split_fast_reply(b"".join(pieces), FAST_IDS, 4)
    assert [answer.id for answer in answers] == FAST_IDS
    assert [int.from_bytes(answer.data, "little") for answer in answers] == FAST_VALUES
    assert fast_pieces(3 * 8, answers) == pieces
    assert len(b"".join(pieces)) == packets.fast_reply_size(3, 4)


def test_B1_a_fast_reply_is_good_as_far_as_it_came() -> None:
    whole = bytes.fromhex("".join(FAST_REPLY))
    for length in range(len(whole) + 1):
        answers = packets.split_fast_reply(whole[:length], FAST_IDS, 4)
        assert len(answers) == max(0, (length - 8) // 8)


def test_B3_a_flipped_bit_in_a_fast_reply_spoils_two_values_at_most_and_makes_none() -> None:
    whole = bytes.fromhex("".join(FAST_REPLY))
    true = dict(zip(FAST_IDS, FAST_VALUES, strict=True))
    for bit in range(64, 8 * len(whole)):
        hurt = bytearray(whole)
        hurt[bit // 8] ^= 1 << bit % 8
        answers = packets.split_fast_reply(bytes(hurt), FAST_IDS, 4)
        assert len(answers) >= 1
        values = {a.id: int.from_bytes(a.data, "little") for a in answers}
        assert values.items() <= true.items()


def test_broken_parts_of_a_fast_reply_are_counted() -> None:
    """A bit in a part breaks it, one in its CRC the next part too, one in the header all."""
    said = [Status(i, StatusError.NONE, False, bytes([i] * 4)) for i in FAST_IDS]
    whole = b"".join(fast_pieces(8 * len(FAST_IDS), said))
    for cut in range(len(whole) + 1):
        good = len(packets.split_fast_reply(whole[:cut], FAST_IDS, 4))
        header = 0 < cut < 8
        assert packets.broken_fast_reply(whole[:cut], len(FAST_IDS), 4, good) == header
    for bit in range(8 * len(whole)):
        hurt = bytearray(whole)
        hurt[bit // 8] ^= 1 << bit % 8
        good = len(packets.split_fast_reply(bytes(hurt), FAST_IDS, 4))
        broken = packets.broken_fast_reply(bytes(hurt), len(FAST_IDS), 4, good)
        part, place = divmod(bit // 8 - 8, 8)
        twice = place >= 6 and part < len(FAST_IDS) - 1
        assert broken == (1 if part < 0 or not twice else 2)


def test_B2_a_lost_part_of_a_fast_reply_costs_itself_and_the_next() -> None:
    ids = list(range(1, 20))
    said = [Status(i, StatusError.NONE, False, bytes([i, 0xFF, 0xFD, i])) for i in ids]
    pieces = fast_pieces(8 * 19, said)
    for lost in range(1, 19):
        received = b"".join(pieces[:lost] + pieces[lost + 1 :])
        answers = packets.split_fast_reply(received, ids, 4)
        assert answers == said[:lost] + said[lost + 2 :]


def test_a_fast_reply_to_others_is_no_answer() -> None:
    whole = bytes.fromhex("".join(FAST_REPLY))
    assert packets.split_fast_reply(whole, [3, 7], 4) == []
    assert packets.split_fast_reply(whole, FAST_IDS, 5) == []
    assert [a.id for a in packets.split_fast_reply(whole, [3, 4, 7], 4)] == [3, 7]
    assert [a.id for a in packets.split_fast_reply(whole, [3, 8, 9], 4)] == [3]


@pytest.mark.parametrize("ids", [[], [1, 1], [253], [-1], [254]])
def test_ids_that_cannot_be_are_refused(ids: list[int]) -> None:
    with pytest.raises(PacketError, match="ids from 0 to 252"):
        packets.sync_read(ids, 0, 1)
    with pytest.raises(PacketError, match="ids from 0 to 252"):
        packets.fast_sync_read(ids, 0, 1)


def test_what_cannot_be_sent_is_refused() -> None:
    with pytest.raises(PacketError, match="as many bytes"):
        packets.sync_write(116, {1: b"\0\0", 2: b"\0"})
    with pytest.raises(PacketError, match="servo id"):
        packets.ping(253)
    with pytest.raises(PacketError, match="0 to 65535"):
        packets.read(1, 70_000, 1)
    with pytest.raises(PacketError, match="at most 1024"):
        packets.write(1, 0, bytes(1100))
