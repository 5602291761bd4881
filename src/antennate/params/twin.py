"""What the twin's robot is fed from, and how its board and servos behave."""

from __future__ import annotations

from antennate.params.base import Params, number


class BatteryParams(Params):
    """The supply of a twin once it begins to sag; until then it is stiff."""

    voltage: float = number(
        11.1,
        "V",
        "datasheet: XC430-W240, recommended voltage; three lithium cells",
        "voltage at rest before it sags",
        gt=0,
        le=16,
    )
    antenna_voltage: float = number(
        5.0,
        "V",
        "datasheet: XL330-M288, recommended voltage; assumed behind a regulator",
        "voltage at the antenna servos as long as the supply is above it",
        gt=0,
        le=16,
    )
    resistance: float = number(
        0.1,
        "ohm",
        "assumed: three small lithium cells of 20 mohm each, a cable and plugs",
        "source resistance",
        ge=0,
        le=10,
    )
    stall_current: float = number(
        1.3,
        "A",
        "assumed: about that of a stalled XC430-W240 at 11.1 V",
        "current of a servo that pulls as hard as it can",
        ge=0,
        le=10,
    )


class TwinParams(Params):
    """Habits of the twin's board, servos, adapter and hand."""

    greeting_period: float = number(
        1.0, "s", "assumed: as firmware/main.py", "time between greetings of the board", gt=0, le=60
    )
    boot_samples: int = number(
        50,
        "1",
        "assumed: half a second at 100 Hz",
        "samples that a starting board does not send",
        ge=0,
        le=10_000,
    )
    standing_noise: float = number(
        2.5,
        "counts",
        "assumed: as while walking",
        "standard deviation of the readings of a resting film",
        ge=0,
        le=100,
    )
    udp_silence: float = number(
        0.1,
        "s",
        "assumed: ten samples",
        "silence after which the board answers no asks either",
        gt=0,
        le=10,
    )
    servo_boot: float = number(
        0.25, "s", "assumed: not in the manual", "time after a reboot without ears", gt=0, le=10
    )
    packet_patience: float = number(
        0.01,
        "s",
        "assumed: ten times the longest packet used",
        "silence after which servos forget half a packet",
        gt=0,
        le=1,
    )
    lump: float = number(
        0.00025,
        "s",
        "assumed: two microframes of USB",
        "answers leave in lumps of this time",
        gt=0,
        le=0.1,
    )
    hand_depth: float = number(
        0.6,
        "1",
        "assumed: twice what the check by touch asks for",
        "change of the reading by a hand, in spans",
        gt=0,
        le=1,
    )
    hand_time: float = number(
        1.0, "s", "assumed: a slow touch", "time for which the hand bends an antenna", gt=0, le=60
    )
