"""Legs that turn without end.

A servo counts 256 turns either way and then takes no goal. Before that the robot stands still, and
one leg after the other forgets its turns: torque off, clear, the goal where it stands, torque on.
Each step takes one tick and is read back before the next. A leg without torque may be turned by
weight or by a person, for as long as the program is stopped: it gets torque only after its position
was read anew and its goal seen to be that. The others keep their torque, and the gait goes on at
the same phase.
Source of the instruction: https://emanual.robotis.com/docs/en/dxl/protocol2/#clear-0x10.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from antennate.hardware.dynamixel.bringup import BringUpError
from antennate.hardware.joints import Joints
from antennate.hardware.safety import torque
from antennate.hardware.safety.deadlines import READ_LEG
from antennate.types import Floats
from dynamixel_bus.bus import Bus
from dynamixel_bus.inquiry import read_once
from dynamixel_bus.model import TICKS_A_TURN, Register
from dynamixel_bus.models import XC430_W240

_TORQUE = XC430_W240["torque_enable"]
_PRESENT = XC430_W240["present_position"]
MOST_TURNS = 250.0
"""Turns from which on legs forget them: of the 256 of an XC430-W240 (datasheet) six are left, 12 s
of walking."""
CALM = 5
"""Ticks without motion before the first is let go: 50 ms (assumed)."""
_CALM_TICKS = 2.0
"""Change of a position from tick to tick that is no motion [ticks]: twice the resolution
(assumed)."""
_PATIENCE = 100
"""Ticks to wait for that: 1 s (assumed)."""
_TRIES = 20
"""Ticks that one step of a leg may take: twice as long as a late answer is waited for (assumed)."""
SLACK = 0.25
"""Turn of a leg without torque that is put up with [turns]: 245:1 gears hold, and half a turn could
not be told (assumed)."""


class LegTurns:
    """Watches how far legs have turned, and lets them forget it; for one thread.

    Attributes:
        forgotten: Legs that have forgotten their turns so far.
        stage: What the next leg has to do: 0 lose its torque, 1 forget its turns, 2 get it back.
    """

    def __init__(self, bus: Bus, joints: Joints) -> None:
        self._bus, self._joints = bus, joints
        self.forgotten = 0
        self.reset()

    def reset(self) -> None:
        """Give up what was begun; torque is off, or comes on anew."""
        self._left: deque[int] = deque()
        self.stage = self._tried = self._waited = self._still = 0
        self._before: Mapping[int, int] = {}
        self._place = math.nan

    @property
    def standing(self) -> bool:
        """Whether the robot has to stand still for it."""
        return bool(self._left)

    @property
    def loose(self) -> int | None:
        """Id of the leg whose torque may be off for it, None if there is none."""
        begun = self.standing and (self.stage or self._tried)
        return self._joints.ids[self._left[0]] if begun else None

    def begin(self, goals: Floats) -> None:
        """Stand still from now on if the goal of a leg, of all [ticks], shape (n,), is far."""
        turning = self._joints.turning
        turned = abs(goals[turning]) / TICKS_A_TURN
        if not self.standing and turned.max(initial=0.0) >= MOST_TURNS:
            self.reset()
            self._left.extend(turning[turned >= 0.5 * MOST_TURNS].tolist())

    def step(self, goals: Floats, positions: Mapping[int, int], may_begin: bool = True) -> None:
        """Do one step of one leg; the goals of legs that were cleared are changed in place.

        Args:
            goals: Of all servos [ticks], shape (n,).
            positions: Newest positions by id [ticks].
            may_begin: Whether the next leg may lose its torque; one that has lost it goes on.
        """
        waits = self.stage == 0 and not may_begin
        if not self.standing or waits or not self._calm(positions):
            return
        at = self._left[0]
        stages = (self._release, self._forget, self._hold)
        if stages[self.stage](at, goals):
            self._tried = 0
            self.stage += 1
        else:
            self._tried += 1
        if self.stage == len(stages):
            self._left.popleft()
            self.stage = 0
            self.forgotten += 1
        if self._tried >= _TRIES:
            servo, stage = self._joints.ids[at], self.stage
            self.reset()
            what = ("lose its torque", "forget its turns", "get its torque back")[stage]
            raise BringUpError(f"expected leg servo {servo} to {what}, found that it does not")

    def _calm(self, positions: Mapping[int, int]) -> bool:
        """Whether the legs have come to rest, or are not waited for any longer."""
        if self._still >= CALM or self._waited >= _PATIENCE:
            return True
        self._waited += 1
        moved = [abs(p - self._before.get(i, math.inf)) for i, p in positions.items()]
        self._still = self._still + 1 if max(moved, default=math.inf) <= _CALM_TICKS else 0
        self._before = dict(positions)
        return False

    def _release(self, at: int, goals: Floats) -> bool:
        servo = self._joints.ids[at]
        place = self._read(servo, _PRESENT)
        if place is None or not torque.loosen(self._bus, servo):
            return False
        self._place = place
        return True

    def _forget(self, at: int, goals: Floats) -> bool:
        """Clear, without torque; from then on its turns are counted anew."""
        servo = self._joints.ids[at]
        if self._read(servo, _TORQUE) != 0:
            return False
        self._bus.clear(servo)  # its answer may get lost: the position tells
        place = self._read(servo, _PRESENT)
        slack = SLACK * TICKS_A_TURN
        if place is None or not -slack <= place < TICKS_A_TURN + slack:
            return False
        shift = TICKS_A_TURN * round((place - self._place) / TICKS_A_TURN)
        if abs(place - self._place - shift) > slack:
            return False
        self._joints.shift(at, shift)
        goals[at] = place
        return True

    def _hold(self, at: int, goals: Floats) -> bool:
        """The goal where the leg stands now, then torque."""
        servo = self._joints.ids[at]
        place = self._read(servo, _PRESENT)
        if place is None:
            return False
        goals[at] = place
        return torque.fasten(self._bus, servo, place)

    def _read(self, servo: int, register: Register) -> int | None:
        return read_once(self._bus, servo, register, READ_LEG)
