"""The hard set: scenes by name, the same for every study, each with one difficulty.

All are kinds of the tunnel, mirrored at random and with its time limit.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping

from antennate.params.scene import CylinderParams, TunnelParams
from antennate.sim.scenes.plan import Arm, Room
from antennate.sim.scenes.tunnel import TunnelScene

_CORNER = TunnelParams(turns_deg=(120.0,))
_U_TURN = TunnelParams(segments=(1.0, 0.8, 1.0), turns_deg=(90.0, 90.0))
_ROOM = TunnelParams(segments=(1.0, 1.8), turns_deg=(90.0,), strewn=0)
_DEAD_END = TunnelParams(segments=(0.7, 1.0), turns_deg=(90.0,), free_width=0.44, strewn=0)
_HEAVY = TunnelParams(cylinder=CylinderParams(mass=0.5))

HARD: Mapping[str, Callable[[], TunnelScene]] = {
    "corner": functools.partial(TunnelScene, _CORNER),
    "uturn": functools.partial(TunnelScene, _U_TURN),
    "room": functools.partial(TunnelScene, _ROOM, rooms=(Room(1, 0.6, 1.6, 1.2, gap=0.5),)),
    "deadend": functools.partial(TunnelScene, _DEAD_END, arms=(Arm(0, 1.1),)),
    "heavy": functools.partial(TunnelScene, _HEAVY),
    "noisy": functools.partial(TunnelScene, variation={"reading_noise": 3.0}),
    "broken": functools.partial(TunnelScene, variation={"broken": "random"}),
}
"""A corner of 120 deg; two of 90 deg to the same side; a room behind a corner, 1 m long and 1.2 m
wide, left by a gap of 0.5 m in the wall opposite; a way that goes on by a branch of 0.44 m at
0.7 m, with a blind end at 1.8 m straight ahead; the tunnel with cylinders of 0.5 kg, with three
times the noise of the readings, with one antenna broken off."""
