"""The supply of the twin's robot."""

from __future__ import annotations

from antennate.params.base import Params, number


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
