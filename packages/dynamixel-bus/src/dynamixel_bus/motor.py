"""The motor of a servo that stands alone, and what makes its drive: the loops of the manuals.

The motor is a torque-speed line through stall torque and unloaded speed of its rating, both in
proportion to the supply, and the inertia at its output; its horn carries nothing.
That gives a time constant of 12 ms (XC430). Without torque the gear stops the shaft, and nothing
turns it. The loops run once a millisecond (assumed) with the gains of the manuals. Feedforward
gains have the divisor of the manuals, 4; that the speed and the acceleration of the profile count
in pulses and loops, as the D gain does, is assumed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dynamixel_bus.memory import Memory
from dynamixel_bus.model import FULL_DRIVE, POSITION_UNIT, Rating

LOOP = 0.001
"""Period of the loops [s], for which their gains are meant."""
STEP = 0.002
"""Longest step of a motor [s]."""
FRICTION = 0.1
"""Torque by which the gear stops a shaft without drive, in stall torques (assumed)."""
CREEP = 10.0
"""Speed below which friction holds a shaft [ticks/s]: a fifth of a degree in a quarter second."""


class Shaft:
    """The shaft of a servo; subclasses move it.

    Args:
        position: Where it is [ticks], whole turns counted.

    Attributes:
        position: Where it is [ticks].
        speed: How fast it turns [ticks/s].
        duty: Share of the supply that its motor gets, -1 to 1.
        load: Its torque in stall torques, which is its current in stall currents.
    """

    def __init__(self, position: float) -> None:
        self.position = position
        self.speed = self.duty = self.load = 0.0

    def rest(self) -> None:
        """Let the shaft stand, without drive."""
        self.speed = self.duty = self.load = 0.0


class Motor(Shaft):
    """The shaft of a servo that stands alone.

    Args:
        position: Where it is [ticks].
        rating: Of its motor, at the recommended supply.
    """

    def __init__(self, position: float, rating: Rating) -> None:
        super().__init__(position)
        self.rating = rating
        self._fastest = rating.no_load_speed / POSITION_UNIT
        self._lag = rating.armature * rating.no_load_speed / rating.stall_torque
        self._stop = FRICTION * rating.stall_torque / rating.armature / POSITION_UNIT
        self._faded = math.exp(-STEP / self._lag)

    def drive(self, duty: float, dt: float, supply: float) -> None:
        """Give the motor a share of the supply for a time [s]; `supply` is in recommended ones."""
        faded = self._faded if dt == STEP else math.exp(-dt / self._lag)
        end = duty * supply * self._fastest
        before = self.speed
        self.speed = end + (before - end) * faded
        self.position += end * dt + (before - end) * self._lag * (1.0 - faded)
        self.duty = duty
        self.load = duty * supply - before / self._fastest

    def free(self, dt: float) -> None:
        """Let it run down without drive for a time [s]."""
        lost = min(self._stop * dt, abs(self.speed))
        self.position += (self.speed - math.copysign(0.5 * lost, self.speed)) * dt
        self.speed -= math.copysign(lost, self.speed)
        self.duty = self.load = 0.0

    def after_friction(self, load: float) -> float:
        """What is left of a torque, in stall torques, after friction.

        A shaft that stands needs more than that to move.
        """
        turning = abs(self.speed) > CREEP
        against = math.copysign(FRICTION, self.speed if turning else load)
        if not turning and abs(load) <= FRICTION:
            return -self.speed / self._fastest
        return load - against

    def needed(self, load: float, supply: float) -> float:
        """The share of the supply that gives a torque, in stall torques, at the present speed."""
        return (load + self.speed / self._fastest) / supply if supply else 0.0


@dataclass(slots=True)
class Loops:
    """Position and velocity loop: their gains as in the control table, and their sums.

    Attributes:
        first: Feedforward of the speed of the profile.
        second: Feedforward of its acceleration.
    """

    p: float = 0.0
    i: float = 0.0
    d: float = 0.0
    vp: float = 0.0
    vi: float = 0.0
    first: float = 0.0
    second: float = 0.0
    total: float = 0.0

    def read(self, memory: Memory) -> None:
        """Take the gains from a control table."""
        self.p, self.i, self.d = (memory.get(f"position_{gain}_gain") for gain in "pid")
        self.vp, self.vi = (memory.get(f"velocity_{gain}_gain") for gain in "pi")
        self.first = memory.get("feedforward_1st_gain")
        self.second = memory.get("feedforward_2nd_gain")

    def ahead(self, speed: float, acceleration: float) -> float:
        """PWM for a speed [ticks/s] and an acceleration [ticks/s²] of the profile."""
        return self.first / 4 * speed * LOOP + self.second / 4 * acceleration * LOOP**2

    def position(
        self, away: float, behind: float, dt: float, limit: float, ahead: float = 0.0
    ) -> float:
        """Drive for a distance [ticks] and a difference of speeds [ticks/s], within a limit.

        `ahead` is PWM that is added, as by the feedforward gains.
        """
        wanted = self.p / 128 * away + self.d / 16 * behind * LOOP + self.total + ahead
        return self._limited(wanted, self.i / 65_536 * away * dt / LOOP, limit)

    def velocity(self, behind: float, dt: float, limit: float) -> float:
        """Drive for a difference of speeds [0.229 rev/min], within a limit."""
        wanted = self.vp / 128 * behind + self.total
        return self._limited(wanted, self.vi / 65_536 * behind * dt / LOOP, limit)

    def _limited(self, wanted: float, more: float, limit: float) -> float:
        """Within a limit; the sum grows only where that has an effect."""
        full = limit * FULL_DRIVE
        if abs(wanted) < full or wanted * more < 0.0:
            self.total = max(-full, min(self.total + more, full))
        return max(-full, min(wanted, full)) / FULL_DRIVE
