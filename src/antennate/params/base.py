"""How a number is declared: a frozen model and a field with unit and source."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

GATHERED = "gathered"
"""Marks a list whose flag, given again, adds to it; of other flags the last one counts."""


DESCRIPTION = "robot"
"""A robot is described whole: its file may hold what a command does not read, a flag may not."""


class Params(BaseModel):
    """A frozen group of numbers; unknown keys, NaN and infinities are errors.

    Attributes:
        unread: Parameters of its groups, dotted, that a command with this configuration does not
            read. They are no flags, and a value other than the default is an error.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    unread: ClassVar[tuple[str, ...]] = ()

    @model_validator(mode="after")
    def _refuse_unread(self) -> Self:
        for path in self.unread:
            *groups, name = path.split(".")
            group: Any = self
            for part in groups:
                group = getattr(group, part)
            default, found = type(group).model_fields[name].default, getattr(group, name)
            if groups[0] != DESCRIPTION and found != default:
                raise ValueError(
                    f"{path}: expected {default}, as it is not read here, found {found}"
                )
        return self


def require_different(name: str, values: Sequence[Any]) -> None:
    """Check that no value stands twice in a list.

    Raises:
        ValueError: One does.
    """
    if len(set(values)) < len(values):
        raise ValueError(f"{name} must differ, got {', '.join(map(str, values))}")


def require_whole_steps(name: str, rate: float, timestep: float, share: int = 1) -> None:
    """Check that a period has a whole number of physics steps.

    Args:
        name: The parameter that is the rate.
        rate: Periods a second [Hz].
        timestep: Physics step [s].
        share: Into how many equal parts of whole steps a period is split.

    Raises:
        ValueError: It has not.
    """
    steps = 1.0 / (rate * share * timestep)
    if steps < 0.5 or abs(steps - round(steps)) > 1e-6:
        part = f" 1/{share} of" if share > 1 else ""
        raise ValueError(
            f"{name} must be a whole fraction of{part} the physics rate {1 / timestep:g} Hz, got "
            f"{rate:g} Hz"
        )


def number(default: Any, unit: str, source: str, meaning: str, **bounds: Any) -> Any:
    """Declare one parameter with its unit, source and meaning; `bounds` as for pydantic's Field."""
    return Field(
        default,
        description=f"{meaning} [{unit}]" if unit != "1" else meaning,
        json_schema_extra={"unit": unit, "source": source, "meaning": meaning},
        **bounds,
    )
