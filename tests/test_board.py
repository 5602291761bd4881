"""The antenna board behind its port: what may be used, and what is NaN."""

from __future__ import annotations

import dataclasses
import struct

import numpy as np
from esp32_streams import BOOT, encoded, framed, hello, made

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import Board, BoardReader


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
        board.poll(n * 0.01)
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


def test_samples_that_the_board_took_too_late_are_counted() -> None:
    assert spoken(hello(), flags=frame.FLAG_LATE).overdue == 20
    assert spoken(hello()).overdue == 0


def test_E8_no_sample_of_a_board_with_old_firmware_is_used() -> None:
    old = framed(struct.pack("<BBI4BI8sBH", 1, 1, BOOT, 0, 0, 9, 1, 0, b"", 30, 100))
    board = spoken(old)
    assert board.clock.newest is None
    assert "firmware 0.0.9" in board.refusals[0]
