"""Bit errors and lost bytes on a wire, by chance from a seed."""

from __future__ import annotations

import numpy as np


class Noise:
    """What a bad wire does to the bytes that cross it, in either direction.

    Args:
        seed: Of its chance.

    Attributes:
        ber: Share of bits that arrive wrong.
        loss: Share of bytes that do not arrive.
        wrong: Bits turned over so far.
        lost: Bytes lost so far.
    """

    def __init__(self, seed: int) -> None:
        self.ber = self.loss = 0.0
        self.wrong = self.lost = 0
        self._rng = np.random.default_rng(seed)

    def __call__(self, data: bytes) -> bytes:
        """What arrives of these bytes."""
        if not data or not (self.ber or self.loss):
            return data
        turned = self._rng.random(8 * len(data)) < self.ber
        kept = self._rng.random(len(data)) >= self.loss
        self.wrong += int(turned.sum())
        self.lost += int((~kept).sum())
        return (np.frombuffer(data, np.uint8) ^ np.packbits(turned))[kept].tobytes()
