"""What a run of `build` comes to: parts, springs, checks, and masses beside the simulation's."""

from __future__ import annotations

from antennate.studies.columns import column, percent, tabular


@tabular
class PartMade:
    """A printed part."""

    count: int = column("count", form="d")
    """How many are printed."""
    mass_g: float = column("mass", "g", form=".2f")
    """Mass of one."""
    size_mm: list[float] = column("size as printed", "mm", form=".1f", join=" x ")
    """Width, depth and height on the bed."""
    wall_mm: float = column("wall", "mm", form=".1f")
    """Thinnest wall, no more than what is asked for, by cubes of 0.1 mm or more."""
    thin_at: str
    """Where it is thinner than asked for, in mm on the bed; empty if nowhere."""
    closed: bool
    """Whether its mesh is closed."""
    supports: list[str]
    """What needs support while it is printed."""


@tabular
class SpringMade:
    """A torsion spring of stock wire."""

    count: int = column("count", form="d")
    """How many one antenna takes."""
    turns: float = column("turns", form="g")
    """Turns of its body."""
    wire_mm: float = column("wire", "mm")
    """Diameter of the wire."""
    coil_mm: float = column("mean diameter", "mm")
    """Mean diameter of the coils."""
    inner_mm: float = column("inside", "mm")
    """Inner diameter at rest, that of the mandrel after springback."""
    leg_mm: float = column("legs", "mm", form=".1f")
    """Length of each leg from the coil on."""
    stiffness_n_mm_per_deg: float = column("stiffness", "N·mm/deg", form=".4f")
    """Torque over angle with its legs gripped from the coil on."""
    wanted_n_mm_per_deg: float = column("  wanted", "N·mm/deg", form=".4f")
    """That of the specification."""
    error: float = percent("  rounding costs", form="+.1f")
    """Stiffness over the wanted one, less 1."""
    loose_error: float = percent("  with loose legs", form="+.1f")
    """The same if the legs bear at their ends alone, so that they bend, too."""
    yields_deg: float = column("yields at", "deg", form=".0f")
    """Angle at which the wire begins to yield."""


@tabular
class Checked:
    """One thing that was checked."""

    name: str
    """What."""
    found: str
    """What was found."""
    good: bool
    """Whether it is as it must be."""
    warn: bool = False
    """Whether it is good and yet to be looked at."""


@tabular
class Compared:
    """A number of the specification beside that of the parts."""

    unit: str
    """Unit of both."""
    specified: float = column("specification", form=".4g")
    """What is simulated."""
    built: float = column("built", form=".4g")
    """What the parts have."""
    difference: float = percent("difference", form="+.1f")
    """Built over specified, less 1."""


@tabular
class BuildResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "build"
    parts: dict[str, PartMade]
    """Printed parts by name."""
    springs: list[SpringMade]
    """Springs, stiff ones first; empty for a robot without antennae."""
    checks: list[Checked]
    """What was checked."""
    masses: dict[str, Compared]
    """Masses and inertias of the specification and of the parts."""
    apart: list[str]
    """Where the parts are not what is simulated."""

    @property
    def failed(self) -> bool:
        """Whether parts meet, springs do not fit, or a mesh has holes."""
        return not all(check.good for check in self.checks)
