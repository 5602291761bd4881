"""Servo models: what a robot's description may name, with the numbers that its physics needs.

The numbers and their sources are those of the model files (`dxl.models`).
"""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from antennate.dxl.model import ServoModel, position_gain
from antennate.dxl.models import XC430_W240, XL330_M288, XL430_W250
from antennate.params.base import Params, number

ServoName = Literal["xc430_w240", "xl330_m288", "xl430_w250"]


def _rated(model: ServoModel, name: str, unit: str, **bounds: Any) -> Any:
    """A number of a model, as it stands in its file."""
    source = model.rating.sources[name]
    return number(getattr(model.rating, name), unit, source, **bounds)


def _gain(model: ServoModel) -> Any:
    return number(model.rating.p_gain, "1", "datasheet: Position P Gain of a new one", gt=0)


class ServoParams(Params):
    """A servo in position mode, a DYNAMIXEL XC430-W240-T at 11.1 V.

    The drive follows the position error up to full drive. Torque follows the drive, less what speed
    takes on the torque-speed line, less friction. Another model is a subclass with its own numbers.

    Attributes:
        servo: The model, with its control table and the numbers of its datasheet.
    """

    servo: ClassVar[ServoModel] = XC430_W240

    stall_torque: float = _rated(XC430_W240, "stall_torque", "N·m", gt=0)
    """Torque at standstill."""
    no_load_speed: float = _rated(XC430_W240, "no_load_speed", "rad/s", gt=0)
    """Speed unloaded."""
    p_gain: float = _gain(XC430_W240)
    """Gain of the position loop as its register holds it."""
    gain_divisor: float = _rated(XC430_W240, "gain_divisor", "1", gt=0)
    """What that gain is divided by: counts of drive per tick of position error."""
    armature: float = _rated(XC430_W240, "armature", "kg·m²", ge=0)
    """Inertia at the output."""
    friction: float = _rated(XC430_W240, "friction", "N·m", ge=0)
    """Friction at the output that is always there."""
    load_friction: float = _rated(XC430_W240, "load_friction", "1", ge=0, lt=1)
    """Friction of the gear as a share of the torque of its motor."""

    @property
    def model_number(self) -> int:
        """What the servo answers when it is asked for its model."""
        return self.servo.number

    @property
    def product(self) -> str:
        """Name of the maker."""
        return self.servo.name

    @property
    def voltage(self) -> float:
        """Supply that the robot gives it [V]."""
        return self.servo.rating.voltage

    @property
    def stall_current(self) -> float:
        """Current at that voltage with the shaft held [A]."""
        return self.servo.rating.stall_current

    @property
    def standby_current(self) -> float:
        """Current without torque [A]."""
        return self.servo.rating.standby_current

    @property
    def datasheet(self) -> tuple[float, float]:
        """Stall torque [N·m] and no-load speed [rad/s] of the datasheet at that voltage."""
        return self.servo.rating.stall_torque, self.servo.rating.no_load_speed

    @property
    def position_gain(self) -> float:
        """Share of the full drive per radian of position error [1/rad]."""
        return position_gain(self.p_gain, self.gain_divisor)

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

    servo: ClassVar[ServoModel] = XL330_M288

    stall_torque: float = _rated(XL330_M288, "stall_torque", "N·m", gt=0)
    """Torque at standstill."""
    no_load_speed: float = _rated(XL330_M288, "no_load_speed", "rad/s", gt=0)
    """Speed unloaded."""
    p_gain: float = _gain(XL330_M288)
    """Gain of the position loop as its register holds it."""
    gain_divisor: float = _rated(XL330_M288, "gain_divisor", "1", gt=0)
    """What that gain is divided by: counts of drive per tick of position error."""
    armature: float = _rated(XL330_M288, "armature", "kg·m²", ge=0)
    """Inertia at the output."""
    friction: float = _rated(XL330_M288, "friction", "N·m", ge=0)
    """Friction at the output that is always there."""
    load_friction: float = _rated(XL330_M288, "load_friction", "1", ge=0, lt=1)
    """Friction of the gear as a share of the torque of its motor."""


class XL430Params(ServoParams):
    """DYNAMIXEL XL430-W250-T at 11.1 V."""

    servo: ClassVar[ServoModel] = XL430_W250

    stall_torque: float = _rated(XL430_W250, "stall_torque", "N·m", gt=0)
    """Torque at standstill."""
    no_load_speed: float = _rated(XL430_W250, "no_load_speed", "rad/s", gt=0)
    """Speed unloaded."""
    p_gain: float = _gain(XL430_W250)
    """Gain of the position loop as its register holds it."""


class ServosParams(Params):
    """The servo models by name; a joint group names one of them."""

    xc430_w240: ServoParams = ServoParams()
    xl330_m288: XL330Params = XL330Params()
    xl430_w250: XL430Params = XL430Params()

    def of(self, name: ServoName) -> ServoParams:
        """The model of a name."""
        return getattr(self, name)
