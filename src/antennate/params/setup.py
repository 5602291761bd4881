"""How a robot is set up: looking for servos, zeros by hand, single joints moved slowly."""

from __future__ import annotations

from antennate.params.base import Params, number


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
