"""Signed datagrams between the antenna board and the host: one file for both ends.

It runs under CPython and, copied to the board as `antenna_datagram.py`, under MicroPython.

A tag is HMAC-SHA-256 (RFC 2104) cut to 16 bytes, over a label, the host's nonce and the content.
The nonce is new for every connection, so what was recorded before is worth nothing. An ASK that
repeats the board's boot id and its count of grants lets frames flow to its sender for LEASE_MS; any
other authentic ASK is answered with a GREETING alone, which is no longer than the ASK. Nothing else
is answered. Little-endian:

| datagram | fields |
|---|---|
| ASK | version, kind, nonce, number of the ask, boot id, count of grants, padding, tag |
| GREETING | frame of a HELLO, number of the ask it answers, count of grants, tag |
| frame | frame of a SAMPLE, tag |
"""

import struct
from hashlib import sha256

VERSION = 1
ASK = 4
TAG_SIZE = 16
NONCE_SIZE = 16
ASK_LAYOUT = "<BB16sIII10s"
ASK_SIZE = struct.calcsize(ASK_LAYOUT) + TAG_SIZE
COUNTS_LAYOUT = "<II"
COUNTS_SIZE = struct.calcsize(COUNTS_LAYOUT)
LEASE_MS = 2000
"""How long frames flow after a grant [ms]."""

FROM_HOST = b"A"
GREETING = b"G"
FRAME = b"F"

_BLOCK = 64
_MS_MASK = (1 << 30) - 1
_BLANK = bytes(10)


class Signer:
    """HMAC-SHA-256 with one key; MicroPython has none of its own."""

    def __init__(self, key: bytes) -> None:
        if len(key) > _BLOCK:
            key = sha256(key).digest()
        key = key + bytes(_BLOCK - len(key))
        self._inner = bytes([byte ^ 0x36 for byte in key])
        self._outer = bytes([byte ^ 0x5C for byte in key])

    def digest(self, *parts: bytes | bytearray | memoryview) -> bytes:
        """All 32 bytes over the parts, one after the other."""
        inner = sha256(self._inner)
        for part in parts:
            inner.update(part)
        outer = sha256(self._outer)
        outer.update(inner.digest())
        return outer.digest()

    def tag(self, *parts: bytes | bytearray | memoryview) -> bytes:
        """As many of them as a datagram carries."""
        return self.digest(*parts)[:TAG_SIZE]


def same(a: bytes | memoryview, b: bytes | memoryview) -> bool:
    """Whether two tags are equal, in a time that does not tell where they differ."""
    differing = len(a) ^ len(b)
    for x, y in zip(a, b):  # noqa: B905  (MicroPython has no `strict`)
        differing |= x ^ y
    return differing == 0


def encode_ask(signer: Signer, nonce: bytes, number: int, boot_id: int, count: int) -> bytes:
    """Datagram by which the host asks for frames; boot id and count as last received, else 0."""
    ask = struct.pack(ASK_LAYOUT, VERSION, ASK, nonce, number, boot_id, count, _BLANK)
    return ask + signer.tag(FROM_HOST, ask)


class Speaker:
    """The board's end: answers asks with a greeting, signs frames for the host that asked."""

    def __init__(self, signer: Signer, boot_id: int, hello: bytes, frame_size: int) -> None:
        self.listener = None
        self._signer = signer
        self._boot_id = boot_id
        self._hello = hello
        self._count = 0
        self._nonce = b""
        self._granted = 0
        self._size = frame_size
        self._datagram = bytearray(frame_size + TAG_SIZE)

    def answer(self, datagram: bytes, sender: object, now_ms: int) -> bytes | None:
        """What to answer to a datagram from an address, or None, at a time [ms] modulo 2**30."""
        if len(datagram) != ASK_SIZE:
            return None
        ask = datagram[:-TAG_SIZE]
        if not same(self._signer.tag(FROM_HOST, ask), datagram[-TAG_SIZE:]):
            return None
        version, kind, nonce, number, boot_id, count, _ = struct.unpack(ASK_LAYOUT, ask)
        if version != VERSION or kind != ASK:
            return None
        if boot_id == self._boot_id and count == self._count:
            self._count = (count + 1) & 0xFFFFFFFF
            self.listener = sender
            self._nonce = nonce
            self._granted = now_ms
        content = self._hello + struct.pack(COUNTS_LAYOUT, number, self._count)
        return content + self._signer.tag(GREETING, nonce, content)

    def sign(self, frame: bytes | bytearray, now_ms: int) -> bytearray | None:
        """Datagram of a frame, the same memory each time; None if nobody listens any more."""
        if self.listener is None:
            return None
        if (now_ms - self._granted) & _MS_MASK > LEASE_MS:
            self.listener = None
            return None
        self._datagram[: self._size] = frame
        self._datagram[self._size :] = self._signer.tag(FRAME, self._nonce, frame)
        return self._datagram
