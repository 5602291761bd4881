"""The gait: its wave, the step of lifting legs, and the gaits that are known by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from antennate.params.base import Params, number, own_file, read_file


class LiftParams(Params):
    """The step of lifting legs; rolling legs do not read it."""

    stance: float = number(0.0, "rad", "assumed: the foot below", ge=-1.6, le=1.6)
    """Angle of a leg that stands."""
    lifted: float = number(0.5, "rad", "assumed: a foot 0.07 m out rises by 34 mm", ge=-1.6, le=1.6)
    """Angle of a leg in the air."""
    begin: float = number(
        1.25 * math.pi,
        "rad",
        "assumed: as b11bl0",
        ge=-2 * math.pi,
        le=2 * math.pi,
    )
    """Gait phase at which the front left leg leaves the ground."""
    lag: float = number(
        math.pi, "rad", "assumed: neighbours take turns; six legs then stand on three", ge=0, le=6.3
    )
    """How much later the legs of each further link lift; the right leg is half a cycle behind."""
    share: float = number(0.5, "1", "assumed: as long in the air as on the ground", ge=0, le=1)
    """Share of the cycle in the air."""


def _hexapod(ahead: float, lift: float) -> Mapping[str, Any]:
    """A gait of the hexapod: f = A sin(P - pi/4) in front, b = A sin(P - pi/4 + ahead) behind.

    As ours count, that is A sin(5 pi/4 - P) and A sin(5 pi/4 - ahead - P): a wave over two joints
    whose phase rises by -ahead from one to the next.

    Args:
        ahead: Phase of the back joint before the front one [rad].
        lift: Gait phase at which the front right leg leaves the ground [rad].
    """
    rise = -ahead % (2.0 * math.pi)
    return {
        "frequency": 0.5,
        "amplitude": math.radians(48.75),
        "wave_number": rise / math.pi,
        "body_phase": 5 * math.pi / 4 - rise,
        "lift": {"stance": 0.4602, "lifted": 1.1804, "begin": lift + math.pi, "lag": math.pi},
    }


def _wave(amplitude: float, wave_number: float, lead: float) -> Mapping[str, Any]:
    """A gait of rolling legs; amplitude and lead of the body over the legs [deg]."""
    return {
        "amplitude": math.radians(amplitude),
        "wave_number": wave_number,
        "body_phase": math.radians(lead),
    }


GAITS: Mapping[str, Mapping[str, Any]] = {
    "serpenoid": {},
    "swift": _wave(29.0, 0.75, 217.0),
    "thrifty": _wave(29.0, 0.9, 208.0),
    "b11bl0": _hexapod(11 * math.pi / 8, math.pi / 4),
    "in_phase": _hexapod(math.pi, math.pi / 2),
}
"""Gaits by name: what differs from the defaults.

`swift` and `thrifty` are of the default robot and fitted by `antennate geometry`: the first walks
17 % faster than `serpenoid` at the same cost of transport, the second 10 % faster at less.

`b11bl0` and `in_phase` are of the six-legged robot `hexapod`, after a table of its simulated gaits
(psu-LiBR) with 49 rows a cycle and the columns -b and f. In `b11bl0` the middle left, back right
and front right legs are in the air in rows 7 to 30, in `in_phase` in rows 13 to 36, the other three
in the rest. The period is not published; 2 s is assumed.
"""


class GaitParams(Params):
    """The serpenoid body wave and the stepping legs."""

    known: ClassVar[tuple[str, ...]] = tuple(GAITS)
    choice: ClassVar[str] = f"{', '.join(GAITS)} (the first is the default), or a TOML file"
    frequency: float = number(
        0.6,
        "Hz",
        "assumed: legs then turn at 55 % of the servo's no-load speed (docs/science/pace.md)",
        gt=0,
        le=1.0,
    )
    """Cycles per second."""
    wave_number: float = number(1.0, "1", "assumed: one wave, as in other robots", gt=0, le=3)
    """Waves along the body."""
    amplitude: float = number(
        math.radians(25.0), "rad", "assumed: 15 to 35 deg is usual", ge=0, le=1.2
    )
    """Amplitude of a yaw joint."""
    body_phase: float = number(
        math.radians(200.0),
        "rad",
        "fitted: antennate gait, sweep of the leg phase; left feet are down at a bend to the left",
        ge=-2 * math.pi,
        le=2 * math.pi,
    )
    """Lead of the body wave over the legs."""
    turn_offset: float = number(
        math.radians(20.0), "rad", "assumed: antennate gait measures 35 deg a cycle", ge=0, le=1.0
    )
    """Yaw offset while turning."""
    offset_rate: float = number(1.5, "rad/s", "assumed: half a second for a full change", gt=0)
    """Largest change of the offset."""
    antenna_mean: float = number(0.0, "rad", "assumed: the mounting angle", ge=-0.8, le=0.8)
    """Angle about which the antenna bases sweep, or at which they are held."""
    antenna_amplitude: float = number(0.0, "rad", "assumed: held, as in the paper", ge=0, le=0.7)
    """Amplitude of the sweep of the antenna bases."""
    antenna_frequency: float = number(0.5, "Hz", "assumed: within the servos' speed", gt=0, le=1.0)
    """Sweeps of the antenna bases per second."""
    lift: LiftParams = LiftParams()

    @classmethod
    def named(cls, text: str | Path, folder: Path = Path()) -> Self:
        """The gait of a name, or of a TOML file with the keys of this model.

        Args:
            text: The name, or the path of the file.
            folder: Where a path that is not absolute starts.
        """
        if (table := GAITS.get(str(text))) is not None:
            return cls.model_validate(table)
        return read_file(own_file("--gait", str(text), GAITS, folder), cls)
