"""Grounds that `antennate climb` asks for by a word: `gap:0.1` is a gap of 10 cm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from antennate.errors import ConfigError
from antennate.params.base import from_values
from antennate.params.scene import GroundParams

FLAT = "flat"
"""Flat floor, on which speed is measured."""
FLAT_TIME = 20.0
"""Time for which a robot walks on it [s]: some 4 m."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of ground; its name is that of the scene.

    Attributes:
        size: The size in a word, a field of `GroundParams`.
        label: What tables call one, with {} for the size.
        scale: Factor from the size to the one in tables.
        patience: Time limit over that of one step: as many climbs as it asks for.
    """

    size: str
    label: str
    scale: float = 100.0
    patience: float = 1.0


KINDS: Mapping[str, Kind] = {
    "gap": Kind("width", "gap of {} cm"),
    "step_down": Kind("height", "step down of {} cm"),
    "stairs": Kind("height", "stairs of {} cm", patience=2.0),
    "ramp": Kind("slope", "ramp of {} deg", scale=1.0),
    "step_tunnel": Kind("height", "tunnel with a step of {} cm", patience=2.0),
}
"""Kinds of ground by name, but for the flat floor, which has no size."""
USUAL = (FLAT, "gap:0.1", "gap:0.3", "step_down:0.1", "stairs:0.08", "ramp:20")
"""One of each kind but the tunnel, which takes longest, and a gap that is too wide."""


@dataclass(frozen=True, slots=True)
class Terrain:
    """One ground of a run.

    Attributes:
        word: As on the command line.
        scene: Name of its scene.
        size: Its size [m; deg of a ramp], None of the flat floor.
    """

    word: str
    scene: str
    size: float | None = None

    @classmethod
    def of(cls, word: str) -> Terrain:
        """The ground of a word, as `gap:0.1`."""
        scene, _, text = word.partition(":")
        if word == FLAT:
            return cls(word, FLAT)
        if scene not in KINDS or not text:
            known = ", ".join(f"{name}:{kind.size.upper()}" for name, kind in KINDS.items())
            raise ValueError(f"expected {FLAT} or one of {known}, found {word!r}")
        try:
            size = float(text)
        except ValueError:
            raise ValueError(f"expected a number after {scene}:, found {text!r}") from None
        try:
            from_values(GroundParams, {KINDS[scene].size: size})
        except ConfigError as error:
            raise ValueError(f"{scene}: {error}") from None
        return cls(f"{scene}:{size:.12g}", scene, size)

    @property
    def values(self) -> dict[str, Any]:
        """The group `ground` of its scene."""
        return {} if self.size is None else {KINDS[self.scene].size: self.size}

    @property
    def label(self) -> str:
        """What tables call it."""
        if self.size is None:
            return FLAT
        kind = KINDS[self.scene]
        return kind.label.format(f"{kind.scale * self.size:.12g}")

    @property
    def patience(self) -> float:
        """Time limit over that of one step."""
        return 1.0 if self.size is None else KINDS[self.scene].patience

    @property
    def length(self) -> float:
        """Height or width [m], 0 of what has none."""
        return 0.0 if self.size is None or KINDS[self.scene].scale == 1.0 else self.size

    @property
    def seed(self) -> int:
        """What is added to the seed of a run: another number for each ground, above all steps."""
        if self.size is None:
            return 10_000
        at = list(KINDS).index(self.scene)
        return 10_000 * (at + 2) + round(KINDS[self.scene].scale * 100.0 * self.size)
