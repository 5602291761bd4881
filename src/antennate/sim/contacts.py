"""The contacts of a state of the engine, as copies: it may go on before anybody looks at them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from antennate.sim.engine import mujoco
from antennate.types import Floats, Ints


class Contacts(NamedTuple):
    """All contacts of the last physics step.

    Attributes:
        geoms: Both geoms of each, shape (k, 2).
        address: Its first row of `force`, negative where it does not push, shape (k,).
        place: Where it is [m], shape (k, 3).
        frame: Its normal, from the first geom to the second, then two tangents, shape (k, 9).
        force: Forces of all constraints [N], shape (rows,).
    """

    geoms: NDArray[np.int32]
    address: NDArray[np.int32]
    place: Floats
    frame: Floats
    force: Floats

    @classmethod
    def of(cls, data: mujoco.MjData) -> Contacts:
        """Those of a state."""
        found: Any = data.contact
        parts = found.geom, found.efc_address, found.pos, found.frame, data.efc_force
        return cls(*(part.copy() for part in parts))

    @classmethod
    def joined(cls, several: Sequence[Contacts]) -> Contacts:
        """Those of several states as if they were of one."""
        before = np.cumsum([0, *(len(each.force) for each in several)])
        parts = [np.concatenate(part) for part in zip(*several, strict=True)]
        shift = np.repeat(before[:-1], [len(each.address) for each in several])
        parts[1] = np.where(parts[1] >= 0, parts[1] + shift, -1)
        return cls._make(parts)

    def between(self, kinds: Ints, total: int) -> tuple[Ints, Floats]:
        """Contacts that push, of two geoms whose kinds have this sum.

        Args:
            kinds: The kind of each geom, shape (geoms,).
            total: The sum.

        Returns:
            Their numbers, shape (n,), and normal forces [N], shape (n,).
        """
        first, second = kinds[self.geoms].T
        which = np.flatnonzero(first + second == total)
        if not len(which):
            return which, np.zeros(0)
        which = which[self.address[which] >= 0]
        return which, self.force[self.address[which]]
