"""Everything that decides the outcome of `antennate servo`."""

from __future__ import annotations

from typing import ClassVar

from pydantic import model_validator

from antennate.params.base import Params, number, require_default
from antennate.robots.servos import ServoName, ServoParams, ServosParams


class ServoConfig(Params):
    """Everything that decides the outcome of `antennate servo`."""

    unread: ClassVar[tuple[str, ...]] = tuple(
        f"servos.{name}.p_gain" for name in ServosParams.model_fields
    )
    recording: tuple[str, ...] = number((), "1", "assumed: has to be named", metavar="FILE")
    """Recordings: JSON of Rhoban/bam, or logs of `drive` with --joint."""
    joint: str | None = number(None, "1", "assumed: has to be named if a recording is a log")
    """Joint of a log."""
    servo: ServoName = number("xl330_m288", "1", "assumed: the model with a known recording")
    """Model of the servo."""
    servos: ServosParams = ServosParams()
    mass: float | None = number(None, "kg", "assumed: as the recording says", ge=0)
    """Mass at the end of the arm; as the recording says if not given."""
    length: float | None = number(None, "m", "assumed: as the recording says", ge=0)
    """Length of the arm, which hangs down at 0 rad; as the recording says if not given."""
    inertia: float = number(0.0, "kg·m²", "assumed: only the mass and the servo", ge=0)
    """Inertia of the load beside that of the mass."""
    supply: float | None = number(None, "V", "assumed: as the recording says", gt=0)
    """Supply where a recording tells none, as no log does; nominal in a replay if not given."""
    fit: bool = number(False, "1", "assumed: a replay alone")
    """Identify the model from the recordings."""

    @property
    def given(self) -> ServoParams:
        """The numbers of the servo."""
        return self.servos.of(self.servo)

    @model_validator(mode="after")
    def _agree(self) -> ServoConfig:
        others = (f"servos.{name}" for name in ServosParams.model_fields if name != self.servo)
        require_default(self, f"the servo is {self.servo}", *others)
        return self
