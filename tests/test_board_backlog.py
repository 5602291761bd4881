"""The antenna board behind its port: another one, and a backlog."""

from __future__ import annotations

from esp32_streams import encoded, hello, made
from port_pieces import Pieces

from antennate.hardware.esp32.board import KEPT, Board
from antennate.hardware.esp32.frame import SAMPLE_FRAME_SIZE


def test_L13_another_board_is_refused_and_its_samples_are_not_used() -> None:
    port = Pieces(hello() + encoded(made(0)))
    board = Board(port, 0.05)
    assert board.poll(0.0) == 1
    stranger = hello(boot=9, device=b"stranger")
    port.data = stranger + encoded(made(1, boot=9))
    assert board.poll(0.01) == 0
    assert "found another one" in board.refusals[-1]
    assert board.clock.resets == 0


def backlog(seconds: float) -> tuple[Board, Pieces, float]:
    """A board read every 10 ms for a second, then not for some time, while it goes on."""
    port = Pieces(hello())
    board = Board(port, 0.05)
    for n in range(100):
        port.data += encoded(made(n))
        board.poll(0.01 * n)
    end = 100 + round(100 * seconds)
    port.data = b"".join(encoded(made(n)) for n in range(100, end))
    return board, port, 0.01 * (end - 1)


def test_L17_after_a_sleep_of_5_s_the_newest_sample_is_used_and_the_oldest_are_counted() -> None:
    board, _, now = backlog(5.0)
    used = board.poll(now)
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
    board.poll(now)
    assert board.newest(now) is None
    port.data = b"".join(encoded(made(n)) for n in range(598, 600))
    board.poll(now)
    assert board.newest(now) is not None


def test_L17_a_port_that_never_ends_does_not_hold_up_the_loop() -> None:
    class Flood(Pieces):
        reads = 0

        def read(self, most: int, timeout: float) -> bytes:
            self.reads += 1
            return bytes(most)

    port = Flood()
    Board(port, 0.05).poll(0.0)
    assert port.reads <= 64
