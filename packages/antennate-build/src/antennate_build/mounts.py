"""Where servos take screws: their horns, their cases and hole patterns.

The origin lies on the shaft, z along it towards the horn, y along the case away from its longer
part. Lengths are in mm. The numbers are those of ROBOTIS' own solids: XL-430_new and XL,XC-330,
as they stand in the assembly of the arm low_cost_robot (hardware/follower/step/arm.step), measured
there. Others cite the same circles from ROBOTIS' drawings of the XL/XC-330 (2020-05-28: four holes
of 1.6 on a circle of 12) and of the horn HN12-N101 (2019-05-22: eight M2 on a circle of 16); the
drawings themselves were not at hand. The e-manual gives the
XC430 and the XL430 the same frames (FR12 series) and size (28.5 x 46.5 x 34).
"""

from __future__ import annotations

from dataclasses import dataclass

from antennate.errors import ConfigError

Place = tuple[float, float]
"""Two coordinates [mm]."""


@dataclass(frozen=True)
class Screw:
    """A screw that goes through a printed part into a servo.

    Attributes:
        name: What to ask for; its length is the number at the end [mm].
        thread: Diameter of its thread [mm].
        clearance: Hole that it passes [mm].
        head: Diameter of its head [mm].
        head_height: Height of its head [mm].
    """

    name: str
    thread: float
    clearance: float
    head: float
    head_height: float


@dataclass(frozen=True)
class Horn:
    """The horn of a servo.

    Attributes:
        circle: Diameter of the circle of its holes [mm].
        holes: How many are used, the first on the y axis.
        diameter: Of the horn [mm].
        top: Height of its face [mm].
        depth: Depth of its holes [mm].
        centre: Diameter that a part leaves free in the middle; 0 if nothing stands out there [mm].
        screw: The screw without its length.
    """

    circle: float
    holes: int
    diameter: float
    top: float
    depth: float
    centre: float
    screw: Screw


@dataclass(frozen=True)
class Mount:
    """The outside of a servo, and its holes.

    Attributes:
        name: Kind of the case.
        x: Half width of the case [mm].
        y: Ends of the case along its length [mm].
        z: Back and front of the case [mm].
        horn: Its horn.
        sides: Holes in both faces across x, as (y, z) [mm].
        end: Holes in the face at the far end of y, as (x, z) [mm].
        back: Holes along z, as (x, y), open to the front and to the back [mm].
        depth: Depth of the holes of the case [mm].
        screw: The screw of the case without its length.
        source: Where these numbers come from.
    """

    name: str
    x: float
    y: tuple[float, float]
    z: tuple[float, float]
    horn: Horn
    sides: tuple[Place, ...]
    end: tuple[Place, ...]
    back: tuple[Place, ...]
    depth: float
    screw: Screw
    source: str

    @property
    def length(self) -> float:
        """Length of the case [mm]."""
        return self.y[1] - self.y[0]


M2_TAPPING = Screw("self-tapping screw M2", 2.0, 2.2, 3.8, 1.6)
M2 = Screw("pan head screw M2", 2.0, 2.2, 3.8, 1.6)
M2_5_TAPPING = Screw("self-tapping screw M2.5", 2.5, 2.8, 4.8, 2.0)

X330 = Mount(
    name="X330",
    x=10.0,
    y=(-24.5, 9.5),
    z=(-19.5, 3.5),
    horn=Horn(12.0, 4, 16.0, 6.5, 2.9, 0.0, M2_TAPPING),
    sides=(),
    end=(),
    back=((8.0, 7.5), (-8.0, 7.5), (8.0, -22.5), (-8.0, -22.5)),
    depth=4.5,
    screw=M2_TAPPING,
    source="ROBOTIS: solid XL,XC-330, measured",
)
X430 = Mount(
    name="X430",
    x=14.25,
    y=(-35.25, 11.25),
    z=(-17.0, 17.0),
    horn=Horn(16.0, 4, 20.5, 19.0, 3.3, 10.0, M2),
    sides=((-4.0, 6.0), (-4.0, -6.0), (-28.0, 6.0), (-28.0, -6.0)),
    end=((8.0, 6.0), (-8.0, 6.0), (8.0, -6.0), (-8.0, -6.0)),
    back=((11.0, 8.0), (-11.0, 8.0), (11.0, -32.0), (-11.0, -32.0)),
    depth=3.8,
    screw=M2_5_TAPPING,
    source="ROBOTIS: solid XL-430_new, measured; horn HN12-N101, as others cite it",
)
GRAMS = {"xc430_w240": 65.0, "xl430_w250": 57.2, "xl330_m288": 18.0}
"""Mass of a servo by its name [g]: ROBOTIS e-manual."""
MOUNTS = {"xc430_w240": X430, "xl430_w250": X430, "xl330_m288": X330}
"""Cases by the name of a servo in a robot's description."""


def mount_of(servo: str, where: str) -> Mount:
    """The case of a servo.

    Args:
        servo: Its name in a robot's description.
        where: The parameter that names it, for the error.

    Raises:
        ConfigError: No hole pattern of it is known.
    """
    if servo not in MOUNTS:
        raise ConfigError(
            f"{where}: expected a servo whose hole pattern is known, one of {', '.join(MOUNTS)}, "
            f"found {servo}"
        )
    return MOUNTS[servo]
