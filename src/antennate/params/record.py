"""How an antenna is recorded at a bench."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from antennate.params.base import Params, number

_Mark = Annotated[float, Field(ge=-1000, le=1000)]


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
