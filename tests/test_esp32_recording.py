"""A recorded stream of the antenna board: order, times and numbers as the board meant them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from esp32_streams import BOOT, BOOT_TEXTS, encoded, hello, made

from antennate import BadInputError, read_esp32

SERIAL = "240ac40102030000"


def stream(numbers: range, boot: int = BOOT, period_us: int = 10_000) -> bytes:
    return b"".join(encoded(made(n, n * period_us, boot)) for n in numbers)


def test_times_and_readings_are_the_boards(tmp_path: Path) -> None:
    path = tmp_path / "board.bin"
    path.write_bytes(BOOT_TEXTS[1] + hello() + stream(range(5, 305)))
    found = read_esp32(path)
    assert found.t == pytest.approx(0.01 * np.arange(300), abs=1e-9)
    assert (found.seq == np.arange(5, 305)).all()
    assert (found.counts[:, 0] == [made(n).left for n in range(5, 305)]).all()
    assert (found.counts[:, 1] == [made(n).right for n in range(5, 305)]).all()
    assert (found.rail[:, 0] == (found.seq % 2 == 1)).all()  # `made` sets the flags seq % 8
    assert (found.rail[:, 1] == (found.seq // 2 % 2 == 1)).all()
    assert found.hellos[0].device_id == SERIAL
    assert found.lost == found.unknown_boot == found.unordered == 0
    assert found.counters.text == 1
    assert (read_esp32(path.read_bytes()).counts == found.counts).all()


def test_the_boards_counter_wraps_even_in_a_gap() -> None:
    """2**30 us are 1073.7 s: a gap of 3000 s hides two wraps, which the numbers tell."""
    seq = [0, 1, 100_000, 400_000, 400_001]
    found = read_esp32(hello() + b"".join(encoded(made(n)) for n in seq))
    assert found.t == pytest.approx(0.01 * np.array(seq), abs=1e-6)
    assert found.lost == 400_002 - 5


def test_numbers_wrap() -> None:
    numbers = range(2**32 - 3, 2**32 + 4)
    found = read_esp32(hello() + stream(numbers))
    assert (np.diff(found.seq) == 1).all()
    assert found.lost == 0


def test_late_and_doubled_samples_find_their_place() -> None:
    order = [0, 1, 4, 2, 2, 3, 5, 1, 6]
    found = read_esp32(hello() + b"".join(encoded(made(n)) for n in order))
    assert (found.seq == np.arange(7)).all()
    assert found.t == pytest.approx(0.01 * np.arange(7), abs=1e-9)


def test_a_time_that_does_not_rise_is_left_out() -> None:
    samples = [made(n) for n in range(10)]
    samples[4] = made(4, 10_000)  # back in time
    samples[7] = made(7, 60_000)  # frozen
    found = read_esp32(hello() + b"".join(map(encoded, samples)))
    assert found.seq.tolist() == [0, 1, 2, 3, 5, 6, 8, 9]
    assert found.unordered == found.lost == 2
    assert found.t == pytest.approx(0.01 * found.seq, abs=1e-9)


def test_each_boot_has_its_own_time() -> None:
    data = hello() + stream(range(50)) + hello(7, reset=3) + stream(range(20), 7)
    data += stream(range(3), 99)  # a boot that never greeted
    found = read_esp32(data)
    assert found.boot.tolist() == [0] * 50 + [1] * 20
    assert found.t[50] == 0.0
    assert found.hellos[1].reset == 3
    assert found.unknown_boot == 3


def test_a_hello_may_come_after_its_samples() -> None:
    assert len(read_esp32(stream(range(5)) + hello()).t) == 5


def test_damaged_frames_are_counted() -> None:
    data = bytearray(hello() + stream(range(100)))
    data[len(hello()) + 300] ^= 0x10
    found = read_esp32(bytes(data))
    assert found.lost == 1
    assert found.counters.crc_errors + found.counters.cobs_errors == 1


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "0 bytes with 0 good and 0 damaged frames"),
        (b"\x00hello, world, this is text\x00", "with 0 good"),
        (stream(range(3)), "3 samples but no HELLO"),
        (hello(8) + stream(range(3)), "no HELLO of the boot"),
        (hello(tick_bits=9), "ticks have 16 to 32 bits, found 9"),
    ],
)
def test_what_holds_no_samples_is_refused(tmp_path: Path, data: bytes, why: str) -> None:
    path = tmp_path / "bad.bin"
    path.write_bytes(data)
    with pytest.raises(BadInputError, match=why) as error:
        read_esp32(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "none.bin", tmp_path):
        with pytest.raises(BadInputError, match=path.name):
            read_esp32(path)


def test_a_data_frame_holds_the_columns() -> None:
    frame = read_esp32(hello() + stream(range(4))).to_dataframe()
    assert list(frame) == ["boot", "seq", "t", "left", "right", "left_rail", "right_rail"]
    assert frame["left"].tolist() == [0.0, 7.0, 14.0, 21.0]
