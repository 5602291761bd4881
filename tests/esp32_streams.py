"""Streams of the antenna board for tests: frames, bit errors, boot texts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from antennate.hardware.esp32 import frame
from antennate.hardware.esp32.wire import Sample
from antennate.twin.robot import BOARD_SETTINGS

BOOT = 0x1234ABCD
Bytes = NDArray[np.uint8]

BOOT_TEXTS = (
    b"ets Jul 29 2019 12:21:46\r\n\r\nrst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\r\n"
    b"configsip: 0, SPIWP:0xee\r\nmode:DIO, clock div:2\r\nload:0x3fff0030,len:4892\r\n"
    b"entry 0x400805b0\r\n",
    b"\r\nBrownout detector was triggered\r\n\r\n",
    b"Guru Meditation Error: Core  1 panic'ed (LoadProhibited). Exception was unhandled.\r\n"
    b"Core  1 register dump:\r\nPC      : 0x400d1a2b  PS      : 0x00060730  A0 : 0x800d1c11\r\n"
    b"EXCVADDR: 0x00000000  LBEG    : 0x4000c2e0\r\n\r\n"
    b"Backtrace: 0x400d1a2b:0x3ffb1f60 0x400d1c0e:0x3ffb1f80\r\n\r\nRebooting...\r\n",
    b"\x1b[0;31mE (1234) wifi: a line in colour\x1b[0m\r\n",
    b'Traceback (most recent call last):\r\n  File "main.py", line 12, in <module>\r\n'
    b"OSError: [Errno 12] ENOMEM\r\n>>> ",
)
"""Texts as the boot ROM, the panic handler, the logger and the prompt would print them."""


def made(seq: int, ticks: int | None = None, boot: int = BOOT) -> Sample:
    """A sample whose readings follow from its number."""
    ticks = seq * 10_000 if ticks is None else ticks
    return Sample(
        boot_id=boot,
        seq=seq % 2**32,
        ticks=ticks % 2**30,
        left=seq * 7 % 4096,
        right=seq * 13 % 4096,
        flags=seq % 8,
        drops=seq // 100 % 65536,
    )


def encoded(sample: Sample) -> bytes:
    """Its frame."""
    buffer = bytearray(frame.SAMPLE_FRAME_SIZE)
    encoder = frame.SampleEncoder(sample.boot_id)
    encoder.encode_sample_into(
        buffer,
        sample.seq,
        sample.ticks,
        sample.left,
        sample.right,
        sample.flags,
        sample.drops,
    )
    return bytes(buffer)


def frames_of(samples: list[Sample]) -> Bytes:
    """Frames one after the other, shape (n, frame size)."""
    joined = b"".join(map(encoded, samples))
    return np.frombuffer(joined, dtype=np.uint8).reshape(len(samples), -1)


def hello(
    boot: int = BOOT,
    rate: int = 100,
    tick_bits: int = 30,
    reset: int = 1,
    device: bytes = b"\x24\x0a\xc4\x01\x02\x03",
) -> bytes:
    """Frame of a greeting."""
    config = frame.config_hash(rate, *BOARD_SETTINGS)
    return frame.encode_hello(boot, reset, config, device, rate, tick_bits)


def with_bit_errors(stream: Bytes, rate: float, rng: np.random.Generator) -> Bytes:
    """The same bytes with each bit flipped at this rate."""
    bits = stream.size * 8
    hit = rng.integers(0, bits, rng.binomial(bits, rate))
    damaged = stream.copy()
    flat = damaged.reshape(-1)
    np.bitwise_xor.at(flat, hit // 8, (1 << (hit % 8)).astype(np.uint8))
    return damaged


def framed(body: bytes) -> bytes:
    """Any body as an intact frame."""
    packer = frame.Packer(len(body))
    packer.body[: len(body)] = body
    buffer = bytearray(len(body) + frame.WRAPPING)
    packer.pack_into(buffer)
    return bytes(buffer)
