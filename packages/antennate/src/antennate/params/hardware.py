"""The hardware of a robot: its set-up, its examination, its network, and the supply of a twin."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from antennate.params.base import Params, number

_Mark = Annotated[float, Field(ge=-1000, le=1000)]


class PortsParams(Params):
    """The two ports of a robot, where --esp32 and --bus do not name them."""

    esp32: str = number("", "1", "assumed: none; `antennate setup` finds it")
    """Antenna board, as --esp32."""
    bus: str = number("", "1", "assumed: none; `antennate setup` finds it")
    """Servo bus, as --bus."""


class SetupParams(Params):
    """How servos are found and joints are measured, and what is done so far."""

    done: tuple[str, ...] = number((), "1", "assumed: none; kept by `antennate setup`")
    """Joints whose servo is set up."""
    scan: float = number(0.8, "s", "datasheet: the SDK waits 3 ms for each of 253 ids", gt=0, le=5)
    """Time for answers to a ping of all servos."""
    port_time: float = number(3.0, "s", "assumed: a slow hub", gt=0, le=60)
    """Longest time for a port to appear."""
    hold: float = number(0.5, "s", "assumed: a breath", gt=0, le=10)
    """Time over which a zero is taken."""
    still: float = number(
        0.01, "rad", "assumed: six ticks; a hand that holds a robot trembles less", gt=0, le=0.2
    )
    """Most motion of a joint while its zero is taken."""
    turn: float = number(
        0.17,
        "rad",
        "assumed: 10 degrees, beyond any backlash and easily done by hand",
        gt=0.02,
        le=1,
    )
    """Motion that shows the direction of a joint."""
    horn_teeth: int = number(
        24,
        "1",
        "assumed: steps of 15 degrees; the manuals do not tell, count those of yours",
        ge=4,
        le=100,
    )
    """Places in which a horn can be put on its shaft."""


class ZerosParams(Params):
    """What is known of zeros and directions beside their values under `robot`."""

    measured: str = number("", "1", "assumed: not known; kept by `antennate setup zero`")
    """Date on which they were measured."""
    missing: tuple[str, ...] = number((), "1", "assumed: none; kept by `antennate setup`")
    """Joints without known zero or direction: another servo, or no direction measured."""


class JogParams(Params):
    """How a single joint is moved by keys."""

    step: float = number(0.05, "rad", "assumed: 3 degrees", gt=0.001, le=0.5)
    """Angle of one key."""
    speed: float = number(0.5, "rad/s", "assumed: a ninth of a walking leg", gt=0.02, le=2)
    """Profile velocity."""
    pwm: float = number(
        0.3, "1", "assumed: enough for an unloaded joint, not for a finger", gt=0.05, le=1
    )
    """Share of the full drive."""
    reach: float = number(
        0.35, "rad", "assumed: 20 degrees, seen by the eye and short of most stops", gt=0, le=1.6
    )
    """Way from where a joint stands, either way, while its zero or direction is not measured."""


class TeleopParams(Params):
    """How a robot walks by keys."""

    release: float = number(
        0.5, "s", "assumed: keys that are held repeat every 33 to 92 ms", gt=0, le=2
    )
    """Time without a key after which the robot stands."""
    gamepad_silence: float = number(
        2.0,
        "s",
        "assumed: a thumb on a stick moves more often; a lost radio is silent",
        needs=["--gamepad"],
        gt=0,
        le=10,
    )
    """Time without an event of the gamepad after which the robot stands until the next one."""
    oscillation_amplitude: float = number(0.35, "rad", "assumed: 20 degrees", ge=0, le=0.7)
    """Amplitude of the antenna bases."""
    oscillation_frequency: float = number(0.5, "Hz", "assumed: that of the gait", gt=0, le=1)
    """Oscillations of the antenna bases per second."""


class GoalsParams(Params):
    """How a robot walks by goals of its joints."""

    release: float = number(
        0.2,
        "s",
        "assumed: a program that sends at 100 Hz leaves out 20 in a row",
        needs=["--accept"],
        gt=0,
        le=2,
    )
    """Time without goals after which the robot stands."""


class DoctorParams(Params):
    """How long is looked, and from where on something is not good."""

    listen: float = number(2.0, "s", "assumed: 200 readings", gt=0, le=60)
    """Time over which the board is listened to."""
    greeting: float = number(3.0, "s", "assumed: boots in 2 s, greets every second", gt=0, le=60)
    """Longest wait for a greeting."""
    reads: int = number(20, "1", "assumed: enough for a median", ge=3, le=1000)
    """Reads of all servos that are timed."""
    answer_time: float = number(0.002, "s", "assumed: the bus gives up then", gt=0, le=0.1)
    """Longest time to a servo's answer beyond the wire and its return delay."""
    read_time: float = number(0.007, "s", "assumed: what a tick leaves for reading", gt=0, le=0.1)
    """Longest time of one read of all servos."""
    latency_timer: int = number(
        1, "ms", "datasheet: FTDI's AN232B-04, 1 ms is the lowest, 16 ms the default", ge=1, le=255
    )
    """Highest latency timer of a USB adapter."""
    heat_margin: float = number(10.0, "degC", "assumed: minutes of walking", ge=0, le=50)
    """Distance from a servo's own limit at which its temperature is warned of."""
    noise: float = number(10.0, "counts", "assumed: four times a resting sensor's", gt=0, le=1000)
    """Highest standard deviation of the readings at rest."""
    noise_ratio: float = number(
        3.0, "1", "assumed: far beyond what chance and another day do", ge=1, le=1000
    )
    """Highest noise in units of that when it was calibrated."""
    calibrated_noise: float | None = number(
        None, "counts", "assumed: that of the calibration file", ge=0, le=4095
    )
    """Noise of the left antenna when it was calibrated, of both without another calibration."""
    calibrated_noise_right: float | None = number(
        None, "counts", "assumed: that of its calibration file", ge=0, le=4095
    )
    """Noise of the right antenna when it was calibrated."""
    gravity_error: float = number(
        0.1, "1", "assumed: five times a zero-g level of 20 mg, or a slope of 6 deg", gt=0, le=1
    )
    """Largest part of gravity by which the inertial sensor at rest is off."""
    turning: float = number(
        0.1, "rad/s", "assumed: nearly six times a zero-rate level of 1 deg/s", gt=0, le=10
    )
    """Highest mean angular velocity that it shows at rest."""


class DeadManParams(Params):
    """A key that is held lets the robot walk; a terminal tells it by the characters it repeats."""

    release: float = number(0.3, "s", "assumed: held keys repeat every 33 to 92 ms", gt=0, le=2)
    """Longest time between two characters of a key that is held."""
    off: float = number(5.0, "s", "assumed: time to change the hand", ge=0, le=600)
    """Time after its release until the torque goes off."""


class NetworkParams(Params):
    """Pace and limits of signed datagrams."""

    ask_period: float = number(0.25, "s", "assumed: eight asks in a grant of 2 s", gt=0, le=1)
    """Time between two asks for frames."""
    rate: float = number(1000.0, "1/s", "assumed: ten times what a board sends", gt=0, le=1e5)
    """Authentic frames a second that are handed on."""
    burst: int = number(
        512, "1", "assumed: more datagrams than wait in the 208 KiB that Linux holds", ge=1, le=1e4
    )
    """Authentic frames at once."""
    look_rate: float = number(
        51_200.0,
        "1/s",
        "measured: 3 us each, so a flood costs at most a sixth of a core",
        gt=0,
        le=1e6,
    )
    """Datagrams a second that are looked at; the system drops the others."""
    look_burst: int = number(512, "1", "measured: 3 us each, so 1.5 ms of a tick", ge=1, le=1e4)
    """Datagrams at once that are looked at."""


class BatteryParams(Params):
    """The supply of a twin once it discharges; until then its voltage is constant."""

    voltage: float = number(
        11.1, "V", "datasheet: XC430-W240, recommended voltage; three lithium cells", gt=0, le=16
    )
    """Voltage at rest before it discharges."""
    antenna_voltage: float = number(
        5.0,
        "V",
        "datasheet: XL330-M288, recommended voltage; assumed behind a regulator",
        gt=0,
        le=16,
    )
    """Voltage at the antenna servos as long as the supply is above it."""
    resistance: float = number(
        0.1, "ohm", "assumed: three lithium cells of 20 mohm each, a cable and plugs", ge=0, le=10
    )
    """Source resistance."""
    stall_current: float = number(
        1.3, "A", "assumed: about that of a stalled XC430-W240 at 11.1 V", ge=0, le=10
    )
    """Current of a servo that pulls as hard as it can."""


class RecordParams(Params):
    """What is recorded: marks held by hand, pushes of a stage, or whatever comes."""

    side: Literal["left", "right"] = number("left", "1", "assumed: the first")
    """Antenna to record; without marks and speed both are."""
    marks: tuple[_Mark, ...] = number((), "unit", "assumed: none")
    """Bends or positions to hold the antenna at, each confirmed by Enter; 0 is straight."""
    unit: Literal["1", "rad", "deg", "m", "mm"] = number("mm", "1", "assumed: a ruler")
    """Unit of the marks."""
    hold: float = number(1.0, "s", "assumed: 100 readings", gt=0, le=600)
    """Time recorded at each mark."""
    speed: float | None = number(None, "m/s", "assumed: no stage", gt=0, le=1)
    """Constant speed of a stage that pushes."""
    length: float = number(0.05, "m", "assumed: as the simulated rig", gt=0, le=1)
    """Way of the stage in one push."""
    passes: int = number(4, "1", "assumed: there and back, twice: two trials", ge=1, le=1000)
    """Times the marks are gone through, every other time backwards, or pushes of a stage."""
    duration: float | None = number(None, "s", "assumed: until Ctrl-C", gt=0)
    """Time to record without marks and speed."""

    @model_validator(mode="after")
    def _one_kind(self) -> RecordParams:
        if self.marks and self.speed is not None:
            raise ValueError(
                f"expected marks or speed, found marks {_said(self.marks)} and speed {self.speed:g}"
            )
        if self.marks and len(set(self.marks)) < 2:
            raise ValueError(
                f"marks must be two different values or more, found {_said(self.marks)}"
            )
        return self


def _said(numbers: tuple[float, ...]) -> str:
    return " ".join(f"{number:g}" for number in numbers)
