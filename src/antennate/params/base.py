"""How a number is declared: a frozen model and a field with unit and source."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

GATHERED = "gathered"
"""Marks a list whose flag, given again, adds to it; of other flags the last one counts."""


class Params(BaseModel):
    """A frozen group of numbers; unknown keys, NaN and infinities are errors."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def number(default: Any, unit: str, source: str, meaning: str, **bounds: Any) -> Any:
    """Declare one parameter with its unit, source and meaning; `bounds` as for pydantic's Field."""
    return Field(
        default,
        description=f"{meaning} [{unit}]" if unit != "1" else meaning,
        json_schema_extra={"unit": unit, "source": source, "meaning": meaning},
        **bounds,
    )
