"""Servo models: what a robot's description may name, with the numbers that its physics needs."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

from antennate.params.base import Params, number

TICKS_A_TURN = 4096
"""Datasheet of all models: 4096 pulses a revolution."""
MOST_TICKS = 1_048_575
"""Farthest position in extended mode, 256 turns either way [ticks]."""
POSITION_MODE = 3
"""Operating mode: position within one turn."""
EXTENDED_MODE = 4
"""Operating mode: position over many turns."""

ServoName = Literal["xc430_w240", "xl330_m288", "xl430_w250"]
_RPM = 2.0 * math.pi / 60.0
FULL_DRIVE = 885
"""Datasheet of all models: counts of the full drive."""


class ServoParams(Params):
    """A servo in position mode, a DYNAMIXEL XC430-W240-T at 11.1 V.

    The drive follows the position error up to full drive. Torque follows the drive, less what speed
    takes on the torque-speed line, less friction. Another model is a subclass with its own numbers.

    Attributes:
        model_number: What the servo answers when it is asked for its model.
        voltage: Supply that the robot gives it [V].
        stall_current: Current at that voltage with the shaft held [A] (datasheet).
        standby_current: Current without torque [A] (datasheet).
        datasheet: Stall torque [N·m] and no-load speed [rad/s] at that voltage (datasheet).
        product: Name of the maker.
    """

    model_number: ClassVar[int] = 1080
    voltage: ClassVar[float] = 11.1
    stall_current: ClassVar[float] = 1.3
    standby_current: ClassVar[float] = 0.046
    datasheet: ClassVar[tuple[float, float]] = (1.7, 65.0 * _RPM)
    product: ClassVar[str] = "XC430-W240-T"

    stall_torque: float = number(1.7, "N·m", "datasheet: XC430-W240, 11.1 V", gt=0)
    """Torque at standstill."""
    no_load_speed: float = number(
        65.0 * _RPM, "rad/s", "datasheet: XC430-W240, 65 rpm at 11.1 V", gt=0
    )
    """Speed unloaded."""
    p_gain: float = number(700.0, "1", "datasheet: Position P Gain of a new one", gt=0)
    """Gain of the position loop as its register holds it."""
    gain_divisor: float = number(
        128.0,
        "1",
        "datasheet: block diagram of X servos; no recording of this model is known",
        gt=0,
    )
    """What that gain is divided by: counts of drive per tick of position error."""
    armature: float = number(
        0.003, "kg·m²", "assumed: a rotor of 5e-8 kg·m² behind a 245:1 gear", ge=0
    )
    """Inertia at the output."""
    friction: float = number(0.0, "N·m", "assumed: none, until it is measured", ge=0)
    """Friction at the output that is always there."""
    load_friction: float = number(0.0, "1", "assumed: none, until it is measured", ge=0, lt=1)
    """Friction of the gear as a share of the torque of its motor."""

    @property
    def position_gain(self) -> float:
        """Share of the full drive per radian of position error [1/rad]."""
        return self.p_gain / self.gain_divisor * TICKS_A_TURN / (2 * math.pi) / FULL_DRIVE

    @property
    def stiffness(self) -> float:
        """Torque per radian of position error, before saturation [N·m/rad]."""
        return self.stall_torque * self.position_gain

    @property
    def damping(self) -> float:
        """Slope of the torque-speed line [N·m·s/rad]: full drive holds no_load_speed unloaded."""
        return self.stall_torque / self.no_load_speed


class XL330Params(ServoParams):
    """DYNAMIXEL XL330-M288-T at 5 V."""

    model_number: ClassVar[int] = 1200
    voltage: ClassVar[float] = 5.0
    stall_current: ClassVar[float] = 1.47
    standby_current: ClassVar[float] = 0.017
    datasheet: ClassVar[tuple[float, float]] = (0.52, 103.0 * _RPM)
    product: ClassVar[str] = "XL330-M288-T"

    stall_torque: float = number(0.52, "N·m", "datasheet: XL330-M288, 5 V", gt=0)
    """Torque at standstill."""
    no_load_speed: float = number(
        103.0 * _RPM, "rad/s", "datasheet: XL330-M288, 103 rpm at 5 V", gt=0
    )
    """Speed unloaded."""
    p_gain: float = number(400.0, "1", "datasheet: Position P Gain of a new one", gt=0)
    """Gain of the position loop as its register holds it."""
    gain_divisor: float = number(
        256.0, "1", "measured: drive over position error in a recording; `antennate servo`", gt=0
    )
    """What that gain is divided by: counts of drive per tick of position error."""
    armature: float = number(
        0.0019, "kg·m²", "fitted: `antennate servo --fit`, with the data sheet's line", ge=0
    )
    """Inertia at the output."""
    friction: float = number(
        0.023, "N·m", "fitted: `antennate servo --fit`, with the data sheet's line", ge=0
    )
    """Friction at the output that is always there."""
    load_friction: float = number(
        0.35, "1", "fitted: `antennate servo --fit`, with the data sheet's line", ge=0, lt=1
    )
    """Friction of the gear as a share of the torque of its motor."""


class XL430Params(ServoParams):
    """DYNAMIXEL XL430-W250-T at 11.1 V."""

    model_number: ClassVar[int] = 1060
    voltage: ClassVar[float] = 11.1
    stall_current: ClassVar[float] = 1.3
    standby_current: ClassVar[float] = 0.052
    datasheet: ClassVar[tuple[float, float]] = (1.4, 57.0 * _RPM)
    product: ClassVar[str] = "XL430-W250-T"

    stall_torque: float = number(1.4, "N·m", "datasheet: XL430-W250, 11.1 V", gt=0)
    """Torque at standstill."""
    no_load_speed: float = number(
        57.0 * _RPM, "rad/s", "datasheet: XL430-W250, 57 rpm at 11.1 V", gt=0
    )
    """Speed unloaded."""
    p_gain: float = number(640.0, "1", "datasheet: Position P Gain of a new one", gt=0)
    """Gain of the position loop as its register holds it."""


class ServosParams(Params):
    """The servo models by name; a joint group names one of them."""

    xc430_w240: ServoParams = ServoParams()
    xl330_m288: XL330Params = XL330Params()
    xl430_w250: XL430Params = XL430Params()

    def of(self, name: ServoName) -> ServoParams:
        """The model of a name."""
        return getattr(self, name)
