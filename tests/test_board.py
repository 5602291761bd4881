"""The antenna board behind its port: what may be used, and what is NaN."""

from __future__ import annotations

import dataclasses
import math
import struct

import numpy as np
import pytest
from esp32_streams import BOOT, encoded, framed, hello, made

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.board import Board, counts_of


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


def spoken(greeting: bytes, flags: int = 0) -> Board:
    """A board that has greeted and sent 20 samples, the last one taken at 0.19 s."""
    wire = Wire()
    board = Board(wire, age_limit=0.05)
    wire.came = greeting
    for n in range(20):
        wire.came += encoded(dataclasses.replace(made(n), flags=flags))
        board.poll(n * 0.01)
    return board


def test_a_reading_older_than_the_limit_is_none() -> None:
    board = spoken(hello())
    assert board.newest(0.19 + 0.049) is not None
    assert board.newest(0.19 + 0.051) is None
    assert np.isnan(counts_of(board.newest(0.19 + 0.051))).all()


@pytest.mark.parametrize(
    ("flags", "lost"),
    [(0, [False, False]), (frame.FLAG_LEFT_RAIL, [True, False]), (3, [True, True])],
)
def test_S5_a_reading_at_a_rail_is_none(flags: int, lost: list[bool]) -> None:
    read = counts_of(spoken(hello(), flags).newest(0.19))[0].tolist()
    assert [math.isnan(counts) for counts in read] == lost


def test_E8_no_sample_of_a_board_with_old_firmware_is_used() -> None:
    old = framed(struct.pack("<BBI4BI8sBH", 1, 1, BOOT, 0, 0, 9, 1, 0, b"", 30, 100))
    board = spoken(old)
    assert board.clock.newest is None
    assert "firmware 0.0.9" in board.refusals[0]
