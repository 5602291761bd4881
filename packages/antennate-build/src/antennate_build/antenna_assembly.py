"""An antenna put together: where each part stands at some angles of its hinges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from antennate_build import antenna_parts, kernel
from antennate_build.kernel import Point, Solid
from antennate_build.layout import AntennaLayout, segment_names
from antennate_build.mounts import Mount


@dataclass(frozen=True)
class Placed:
    """A part at its place.

    Attributes:
        name: Its name, with a number where there are several.
        part: The item of the bill that it is one of.
        solid: The solid, in the frame of the assembly.
    """

    name: str
    part: str
    solid: Solid

    @property
    def kind(self) -> str:
        """What it is: bracket, spring, pin, segment or cover."""
        return self.name.partition("_")[0]


@dataclass(frozen=True)
class AntennaSolids:
    """The parts of an antenna, each in its own frame, and how they go together.

    Attributes:
        layout: Sizes.
        mount: The servo of its base.
        sides: Names of the brackets, and how each turns the antenna about its own axis [rad].
    """

    layout: AntennaLayout
    mount: Mount
    sides: tuple[tuple[str, float], ...] = (("bracket", 0.0),)

    @property
    def standing(self) -> tuple[str, float]:
        """The bracket on which the antenna stands most upright, and its turn."""
        return min(self.sides, key=lambda side: abs(side[1]))

    @property
    def hinges(self) -> int:
        """Number of hinges."""
        return self.layout.antenna.hinges

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Part of each segment, base to tip."""
        return segment_names(self.layout)

    @cached_property
    def printed(self) -> dict[str, Solid]:
        """Printed parts by name."""
        parts = {
            name: antenna_parts.bracket(self.layout, self.mount, turn) for name, turn in self.sides
        }
        for n, name in enumerate(self.names):
            if name not in parts:
                parts[name] = antenna_parts.segment(self.layout, n)
        return parts | {
            "pin": antenna_parts.pin(self.layout),
            "cover": antenna_parts.cover(self.layout),
        }

    @property
    def counts(self) -> dict[str, int]:
        """How many of each printed part one antenna takes; of the brackets one in all."""
        counts = dict.fromkeys((name for name, _ in self.sides), 1)
        for name in self.names:
            counts[name] = counts.get(name, 0) + 1
        return counts | {"pin": self.hinges, "cover": self.layout.sensed + 1}

    def placed(self, angles: Sequence[float] = (), springs: bool = True) -> list[Placed]:
        """All parts, hinge by hinge from the base, in the frame of the first hinge.

        Args:
            angles: Angle of each hinge [rad]; straight if not given.
            springs: Whether the springs are among them, wound by the angles.
        """
        angles = tuple(angles) or (0.0,) * self.hinges
        bracket, turn = self.standing
        solid = self.printed[bracket]
        solid = kernel.turned(solid, -turn, "x") if turn else solid
        parts = [Placed(bracket, bracket, solid)]
        middle = antenna_parts.posts_of_bracket(self.layout, self.mount)
        parts.append(self._cover(1, (sum(middle) / 2.0, 0.0, 0.0), (0.0, 0.0), 0.0))
        at, heading = (0.0, 0.0), 0.0
        for n, name in enumerate(self.names):
            if springs:
                spring = antenna_parts.spring(self.layout, n, angles[n])
                item = self.layout.springs[n].item
                parts.append(self._put(f"spring_{n + 1}", item, spring, at, heading))
            parts.append(self._put(f"pin_{n + 1}", "pin", self.printed["pin"], at, heading))
            heading += angles[n]
            parts.append(self._put(f"segment_{n + 1}", name, self.printed[name], at, heading))
            if n < self.layout.sensed:
                place = (self.layout.length / 2.0, 0.0, 0.0)
                parts.append(self._cover(n + 2, place, at, heading))
            at = (
                at[0] + self.layout.length * math.cos(heading),
                at[1] + self.layout.length * math.sin(heading),
            )
        return parts

    def moving(self, number: int) -> list[Solid]:
        """What turns with a hinge, straight, in its frame."""
        parts = [self.printed[self.names[number]], self.printed["pin"]]
        if number < self.layout.sensed:
            half = self.layout.length / 2.0
            parts.append(kernel.moved(self.printed["cover"], (half, 0.0, 0.0)))
        return parts

    def hung(self, side: int, heading: float) -> list[Placed]:
        """All printed parts of an antenna of a robot, straight, in the frame of its base.

        A robot carries its antennae upside down: their servos are above them.

        Args:
            side: 0 for the left one, 1 for the right one.
            heading: Angle from the heading of the robot to the left [rad].
        """
        name, turn = self.sides[side]
        found = []
        for part in self.placed(springs=False):
            own = part.part.startswith("bracket")
            solid = self.printed[name] if own else kernel.turned(part.solid, turn, "x")
            over = kernel.turned(solid, math.pi, "x")
            put = kernel.turned(over, heading)
            found.append(Placed(part.name, name if own else part.part, put))
        return found

    def _cover(self, number: int, place: Point, at: tuple[float, float], heading: float) -> Placed:
        solid = kernel.moved(self.printed["cover"], place)
        return self._put(f"cover_{number}", "cover", solid, at, heading)

    def _put(
        self, name: str, part: str, solid: Solid, at: tuple[float, float], heading: float
    ) -> Placed:
        put = kernel.moved(kernel.turned(solid, heading) if heading else solid, (*at, 0.0))
        return Placed(name, part, put)
