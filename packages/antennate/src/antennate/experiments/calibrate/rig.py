"""The simulated rig: a rod that indents the antenna from the side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from antennate.params.base import Params, number
from antennate.params.scene import BenchPhysicsParams
from antennate.robots.antenna import AntennaSpec
from antennate.sim.bench import Bench, Slider, compile_bench
from antennate.types import Floats

_Speed = Annotated[float, Field(gt=0, le=1)]
_COMMAND_PERIOD = 0.001


class RigParams(Params):
    """The simulated rig."""

    speeds: tuple[_Speed, ...] = number(
        (0.05, 0.10, 0.15), "m/s", "paper: 5, 10 and 15 cm/s", min_length=1
    )
    """Pushing speeds."""
    pushes: int = number(10, "1", "assumed: enough for an interval", ge=1, le=1000)
    """Pushes at each speed."""
    place: float = number(0.08, "m", "assumed: two thirds out; the rod stays on", gt=0.01, le=0.4)
    """Place of the rod."""
    depth: float = number(0.05, "m", "assumed: bends the antenna to about a right angle", gt=0.002)
    """Full indentation."""
    rod_radius: float = number(0.006, "m", "assumed: a dowel", gt=1e-3, le=0.1)
    """Radius of the rod."""
    withdraw: bool = number(False, "1", "assumed: the paper pushes only")
    """Whether the rod also goes back at the same speed, so that hysteresis shows."""
    start_spread: float = number(0.0005, "m", "assumed: set by hand", ge=0)
    """Half range of the rod's first distance."""


@dataclass(frozen=True, slots=True)
class Push:
    """One push of the rig.

    Attributes:
        factors: What the stiffness of each spring is multiplied with, shape (n,).
        speed: Speed of the rod [m/s].
        gap: Its distance from the antenna at the start [m].
    """

    physics: BenchPhysicsParams
    antenna: AntennaSpec
    rig: RigParams
    factors: Floats
    speed: float
    gap: float

    def run(self, ticks: int) -> tuple[Floats, Floats, Floats]:
        """Time [s], flex [rad] and way of the rod from the first touch [m], each shape (ticks,)."""
        t = np.asarray(np.arange(ticks) * (1.0 / self.antenna.sensor.rate), np.float64)
        flex, y = self._pushed(self._commands(t))
        return t, flex, y + self._touch

    @property
    def _touch(self) -> float:
        """Distance of the rod's axis from the antenna's where they touch [m]."""
        return self.antenna.radius + self.rig.rod_radius

    @property
    def _steps(self) -> int:
        """Physics steps of a command."""
        return round(_COMMAND_PERIOD / self.physics.timestep)

    def _commands(self, t: Floats) -> Floats:
        """Places [m] and speeds [m/s] commanded to the rod along y, shape (ticks, commands, 2)."""
        count = round(1.0 / self.antenna.sensor.rate / _COMMAND_PERIOD)
        way = self.speed * (t[:, None] + np.arange(1, count + 1) * _COMMAND_PERIOD)
        whole = self.gap + self.rig.depth
        back = (way > whole) & self.rig.withdraw
        y = -self._touch - self.gap + np.where(back, 2 * whole - way, way)
        return np.stack([y, np.where(back, -self.speed, self.speed)], axis=-1)

    def _pushed(self, places: Floats) -> tuple[Floats, Floats]:
        """Flex [rad] and place of the rod [m] before the commands of each tick."""
        model = compile_bench(self.physics, self.antenna, probe_radius=self.rig.rod_radius)
        for i, factor in enumerate(self.factors):
            model.joint(f"antenna/hinge{i}").stiffness *= factor
        bench = Bench(model, self.antenna)
        rod = Slider(bench.model, bench.data, "probe")
        bench.place(0.0, 0.0, 0.0)
        rod.place(self.rig.place, -self._touch - self.gap)
        rows: list[tuple[float, float]] = []
        for commands in places.tolist():
            rows.append((bench.flex(), float(rod.position[1])))
            for y, speed in commands:
                rod.command(self.rig.place, y, 0.0, speed)
                bench.step(self._steps)
        flex, y = np.array(rows).T
        return flex, y
