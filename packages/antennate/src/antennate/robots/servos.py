"""Servo models: the numbers of a description and how such a servo moves a load.

The numbers and their sources are those of the model files (`dynamixel_bus.models`), and so are the
meanings of a model's fields those of `ServoParams`. In position mode

    drive    u = clip(gain (goal(t - delay) - q), -1, 1),   gain = P / divisor · 4096 / 2π / 885
    motor    τ = stall · v · u - stall / no_load_speed · ω
    friction |f| ≤ friction + load_friction · |τ|,   against the motion; it holds a shaft at rest
    shaft    (armature + inertia) ω' = τ + f - gravity · sin q

v is the supply over the voltage at which stall torque and no-load speed are given. Without torque
u and τ are 0. `replay` takes goals as they arrive, so without the delay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    SerializerFunctionWrapHandler,
    create_model,
    model_serializer,
)

from antennate.params.base import Params, number
from antennate.types import Bools, Floats
from dynamixel_bus.model import ServoModel, position_gain
from dynamixel_bus.models import MODELS, XC430_W240, XL330_M288, XL430_W250, not_served


def _served(name: Any) -> Any:
    """The name, unless it is of a servo that the bus does not speak with."""
    if why := not_served(str(name)):
        raise ValueError(f"expected a servo of the X series, found {name}: {why}")
    return name


ServoName = Annotated[
    Literal[
        "xc430_w240",
        "xl330_m288",
        "xl430_w250",
        "xl330_m077",
        "xc330_m181",
        "xc330_m288",
        "xc330_t181",
        "xc330_t288",
        "xm430_w210",
        "xm430_w350",
        "xm540_w150",
        "xm540_w270",
    ],
    BeforeValidator(_served),
]
_ALWAYS_WRITTEN = 3
"""Models that stand in every file of a run, used or not: the first ones."""


_NUMBERS: dict[str, tuple[str, dict[str, Any]]] = {
    "gain_divisor": ("1", {"gt": 0}),
    "stall_torque": ("N·m", {"gt": 0}),
    "no_load_speed": ("rad/s", {"gt": 0}),
    "armature": ("kg·m²", {"ge": 0}),
    "friction": ("N·m", {"ge": 0}),
    "load_friction": ("1", {"ge": 0, "lt": 1}),
}
"""Unit and bounds of each number of the model file, in the order of an array of them."""
MODEL_NUMBERS = tuple(_NUMBERS)
"""Names of these numbers, the fields of `ServoParams` that a fit changes."""


def _rated(model: ServoModel, name: str) -> Any:
    """A number of a model, as it stands in its file."""
    unit, bounds = _NUMBERS[name]
    return number(getattr(model.rating, name), unit, model.rating.sources[name], **bounds)


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

    stall_torque: float = _rated(XC430_W240, "stall_torque")
    """Torque at standstill."""
    no_load_speed: float = _rated(XC430_W240, "no_load_speed")
    """Speed unloaded."""
    p_gain: float = _gain(XC430_W240)
    """Gain of the position loop as its register holds it."""
    gain_divisor: float = _rated(XC430_W240, "gain_divisor")
    """What that gain is divided by: counts of drive per tick of position error."""
    armature: float = _rated(XC430_W240, "armature")
    """Inertia at the output."""
    friction: float = _rated(XC430_W240, "friction")
    """Friction at the output that is always there."""
    load_friction: float = _rated(XC430_W240, "load_friction")
    """Friction of the gear as a share of the torque of its motor."""
    delay: float = number(
        0.0, "s", "assumed: none; the bus and the loop of the servo take some ms", ge=0, le=0.05
    )
    """Time from a goal on the bus to the drive that follows it."""

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


def _numbers_of(model: ServoModel) -> type[ServoParams]:
    """Parameters of a servo with the numbers of another model."""
    rated = {name: (float, _rated(model, name)) for name in MODEL_NUMBERS}
    fields: dict[str, Any] = rated | {"p_gain": (float, _gain(model))}
    kind = create_model(model.name, __base__=ServoParams, __module__=__name__, **fields)
    kind.servo = model
    return kind


class XL330Params(_numbers_of(XL330_M288)):
    """DYNAMIXEL XL330-M288-T at 5 V."""


class XL330M077Params(_numbers_of(MODELS["xl330-m077"])):
    """DYNAMIXEL XL330-M077-T at 5 V."""


class XC330M181Params(_numbers_of(MODELS["xc330-m181"])):
    """DYNAMIXEL XC330-M181-T at 5 V."""


class XC330M288Params(_numbers_of(MODELS["xc330-m288"])):
    """DYNAMIXEL XC330-M288-T at 5 V."""


class XC330T181Params(_numbers_of(MODELS["xc330-t181"])):
    """DYNAMIXEL XC330-T181-T at 11.1 V."""


class XC330T288Params(_numbers_of(MODELS["xc330-t288"])):
    """DYNAMIXEL XC330-T288-T at 11.1 V."""


class XL430Params(_numbers_of(XL430_W250)):
    """DYNAMIXEL XL430-W250-T at 11.1 V."""


class XM430W210Params(_numbers_of(MODELS["xm430-w210"])):
    """DYNAMIXEL XM430-W210-T at 11.1 V."""


class XM430W350Params(_numbers_of(MODELS["xm430-w350"])):
    """DYNAMIXEL XM430-W350-T at 11.1 V."""


class XM540W150Params(_numbers_of(MODELS["xm540-w150"])):
    """DYNAMIXEL XM540-W150-T at 11.1 V."""


class XM540W270Params(_numbers_of(MODELS["xm540-w270"])):
    """DYNAMIXEL XM540-W270-T at 11.1 V."""


class ServosParams(Params):
    """The servo models by name; a joint group names one of them."""

    xc430_w240: ServoParams = ServoParams()
    xl330_m288: XL330Params = XL330Params()
    xl430_w250: XL430Params = XL430Params()
    xl330_m077: XL330M077Params = XL330M077Params()
    xc330_m181: XC330M181Params = XC330M181Params()
    xc330_m288: XC330M288Params = XC330M288Params()
    xc330_t181: XC330T181Params = XC330T181Params()
    xc330_t288: XC330T288Params = XC330T288Params()
    xm430_w210: XM430W210Params = XM430W210Params()
    xm430_w350: XM430W350Params = XM430W350Params()
    xm540_w150: XM540W150Params = XM540W150Params()
    xm540_w270: XM540W270Params = XM540W270Params()

    def of(self, name: ServoName) -> ServoParams:
        """The model of a name."""
        return getattr(self, name)

    @model_serializer(mode="wrap")
    def _as_before(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Models that came later are written where their numbers were changed."""
        table = handler(self)
        for name, field in list(type(self).model_fields.items())[_ALWAYS_WRITTEN:]:
            if getattr(self, name) == field.default:
                table.pop(name, None)
        return table


STEP = 0.002
"""Time step of the replay [s]; the position loop holds its drive for one."""


@dataclass(frozen=True)
class Course:
    """What F servos were told, and what hung on them, at T times that are `STEP` apart.

    A shaft begins where it was measured, and again wherever torque is switched.

    Attributes:
        goal: Goal positions [rad], shape (T, F).
        torque: Whether torque was on, shape (T, F).
        supply: Supply over the nominal voltage, shape (T, F).
        position: Measured positions [rad], shape (T, F).
        speed: Measured speeds [rad/s], shape (T, F).
        p_gain: Gain of the position loop as its register held it, shape (F,).
        inertia: Inertia of the load [kg·m²], shape (F,).
        gravity: Torque of the load's weight at a right angle [N·m], shape (F,); 0 rad hangs down.
    """

    goal: Floats
    torque: Bools
    supply: Floats
    position: Floats
    speed: Floats
    p_gain: Floats
    inertia: Floats
    gravity: Floats

    @property
    def begins(self) -> Bools:
        """Where a shaft begins from its measurement, shape (T, F)."""
        switched = self.torque[1:] != self.torque[:-1]
        return np.vstack([np.ones((1, self.torque.shape[1]), bool), switched])


def values_of(servo: ServoParams) -> Floats:
    """The parameters of a servo in the order of MODEL_NUMBERS, shape (6,)."""
    return np.array([getattr(servo, name) for name in MODEL_NUMBERS])


def replay(values: Floats, course: Course, every: int = 1) -> Floats:
    """Positions [rad] of servos that are told what a course says, shape (T / every, B, F).

    Args:
        values: Parameters of B servo models in the order of MODEL_NUMBERS, shape (B, 6).
        course: What F of each are told.
        every: Only every so many times are kept.
    """
    divisor, stall, fastest, armature, dry, loaded = values.T[:, :, None]
    gain = position_gain(course.p_gain, divisor)
    inertia = armature + course.inertia
    braking = stall / fastest
    faded = np.exp(-STEP * braking / inertia)  # share of a speed that braking leaves after a step
    braked = (1.0 - faded) / braking  # speed that a torque adds in a step
    positions = np.empty((-(-len(course.goal) // every), *gain.shape))
    begins = course.begins
    ever = np.flatnonzero(begins.any(axis=1)).tolist()
    q = w = np.zeros(gain.shape)
    for i, goal in enumerate(course.goal):
        if i in ever:
            q = np.where(begins[i], course.position[i], q)
            w = np.where(begins[i], course.speed[i], w)
        if i % every == 0:
            positions[i // every] = q
        on = course.torque[i]
        driven = stall * course.supply[i] * np.clip(gain * (goal - q), -1.0, 1.0) * on
        q = q + 0.5 * STEP * w
        grip = dry + loaded * abs(driven - braking * w * on)
        added = np.where(on, braked, STEP / inertia)
        free = np.where(on, faded, 1.0) * w + added * (driven - course.gravity * np.sin(q))
        # what friction leaves; it stops a shaft, and does not turn it back
        w = np.copysign(np.maximum(abs(free) - added * grip, 0.0), free)
        q = q + 0.5 * STEP * w
    return positions
