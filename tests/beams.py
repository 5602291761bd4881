"""A straight beam as a chain of links, which theory knows."""

from __future__ import annotations

import numpy as np

from antennate.antenna.statics import Chain


def uniform_beam(length: float, bending_stiffness: float, count: int) -> Chain:
    """A beam [m] of E I [N·m²] in pieces that bend in their middles; the first half is rigid."""
    piece = length / count
    lengths = np.full(count, piece)
    lengths[-1] = piece / 2
    return Chain(lengths, np.full(count, bending_stiffness / piece))
