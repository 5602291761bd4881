"""The antenna board behind its port: what may be used, what is NaN, another one, a backlog."""

from __future__ import annotations

import dataclasses
import struct

import numpy as np
from esp32_streams import BOOT, encoded, framed, hello, made
from port_pieces import Pieces

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import KEPT, Board, BoardReader
from antennate.hardware.esp32.frame import SAMPLE_FRAME_SIZE


class Wire:
    """Bytes that have come, as a Port."""

    def __init__(self) -> None:
        self.came = b""

    def read(self, most: int, timeout: float) -> bytes:
        part, self.came = self.came[:most], self.came[most:]
        return part

    def write(self, data: bytes) -> None:
        raise AssertionError("nothing is written to a board here")

    def drain(self) -> int:
        raise AssertionError("nothing is thrown away unseen")


@dataclasses.dataclass
class Now:
    """A clock that stands still."""

    time: float

    def now(self) -> float:
        return self.time

    def sleep_until(self, t: float) -> None:
        raise AssertionError("nothing waits here")


def spoken(greeting: bytes, counts: tuple[int, int] = (1800, 1810), flags: int = 0) -> Board:
    """A board that has greeted and sent 20 samples, the last one taken at 0.19 s."""
    wire = Wire()
    board = Board(wire, age_limit=0.05)
    wire.came = greeting
    for n in range(20):
        sample = dataclasses.replace(made(n), left=counts[0], right=counts[1], flags=flags)
        wire.came += encoded(sample)
        board.poll(Now(n * 0.01).now)
    return board


def test_a_reading_older_than_the_limit_is_none() -> None:
    board = spoken(hello())
    assert board.newest(0.19 + 0.049) is not None
    assert board.newest(0.19 + 0.051) is None
    assert np.isnan(BoardReader(board, Now(0.19 + 0.051)).read()[1]).all()


def test_S2_a_reading_at_a_rail_comes_as_it_was_read() -> None:
    """What it is worth is judged by the diagnosis of its channel, and nowhere before."""
    board = spoken(hello(), counts=(0, 4095), flags=frame.FLAG_LEFT_RAIL | frame.FLAG_RIGHT_RAIL)
    assert BoardReader(board, Now(0.19)).read()[1].tolist() == [[0.0, 4095.0]]


def test_a_program_that_is_held_up_as_it_reads_makes_no_later_sample_old() -> None:
    """For 75 ms, between its clock and its port or between the port and its clock."""

    class Slow(Wire):
        """A wire whose reader is held up before it reads, once; samples come meanwhile."""

        held = 0.0

        def read(self, most: int, timeout: float) -> bytes:
            clock.time += self.held
            self.came += b"".join(encoded(made(n)) for n in range(20, 20 + round(100 * self.held)))
            self.held = 0.0
            return super().read(most, timeout)

    wire, clock = Slow(), Now(0.0)
    board = Board(wire, age_limit=0.05)
    wire.came = hello()
    for n in range(20):
        clock.time, wire.came = 0.01 * n, wire.came + encoded(made(n))
        board.poll(clock.now)
    clock.time, wire.held = 0.195, 0.08
    assert board.poll(clock.now) == 8
    clock.time, wire.came = 0.281, encoded(made(28))
    assert board.poll(clock.now) == 1
    assert board.clock.age(clock.now()) < 0.005


def test_samples_that_the_board_took_too_late_are_counted() -> None:
    assert spoken(hello(), flags=frame.FLAG_LATE).overdue == 20
    assert spoken(hello()).overdue == 0


def test_E8_no_sample_of_a_board_with_old_firmware_is_used() -> None:
    old = framed(struct.pack("<BBI4BI8sBH", 1, 1, BOOT, 0, 0, 9, 1, 0, b"", 30, 100))
    board = spoken(old)
    assert board.clock.newest is None
    assert "firmware 0.0.9" in board.refusals[0]


def test_L13_another_board_is_refused_and_its_samples_are_not_used() -> None:
    port = Pieces(hello() + encoded(made(0)))
    board = Board(port, 0.05)
    assert board.poll(Now(0.0).now) == 1
    stranger = hello(boot=9, device=b"stranger")
    port.data = stranger + encoded(made(1, boot=9))
    assert board.poll(Now(0.01).now) == 0
    assert "found another one" in board.refusals[-1]
    assert board.clock.resets == 0


def backlog(seconds: float) -> tuple[Board, Pieces, float]:
    """A board read every 10 ms for a second, then not for some time, while it goes on."""
    port = Pieces(hello())
    board = Board(port, 0.05)
    for n in range(100):
        port.data += encoded(made(n))
        board.poll(Now(0.01 * n).now)
    end = 100 + round(100 * seconds)
    port.data = b"".join(encoded(made(n)) for n in range(100, end))
    return board, port, 0.01 * (end - 1)


def test_L17_after_a_sleep_of_5_s_the_newest_sample_is_used_and_the_oldest_are_counted() -> None:
    board, _, now = backlog(5.0)
    used = board.poll(Now(now).now)
    newest = board.newest(now)
    assert newest is not None
    assert newest.seq == 599
    assert board.clock.age(now) <= 0.005
    assert used <= 64
    assert board.skipped == 500 * SAMPLE_FRAME_SIZE - KEPT
    assert board.clock.sequence.lost == 500 - used


def test_L17_a_backlog_without_its_newest_part_is_not_acted_upon() -> None:
    """What Linux keeps for a line is the oldest; the rest was lost when its buffer was full."""
    board, port, now = backlog(5.0)
    port.data = port.data[: 4 * SAMPLE_FRAME_SIZE * 100]
    board.poll(Now(now).now)
    assert board.newest(now) is None
    port.data = b"".join(encoded(made(n)) for n in range(598, 600))
    board.poll(Now(now).now)
    assert board.newest(now) is not None


def test_L17_a_port_that_never_ends_does_not_hold_up_the_loop() -> None:
    class Flood(Pieces):
        reads = 0

        def read(self, most: int, timeout: float) -> bytes:
            self.reads += 1
            return bytes(most)

    port = Flood()
    Board(port, 0.05).poll(Now(0.0).now)
    assert port.reads <= 64
