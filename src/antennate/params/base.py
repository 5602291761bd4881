"""How a number is declared: a frozen model and a field with unit and source."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.fields import FieldInfo

GATHERED = "gathered"
"""Marks a list whose flag, given again, adds to it; of other flags the last one counts."""
ROBOT = "robot"
"""This group is described whole: a file may hold what a command does not read, a flag may not."""


class Params(BaseModel):
    """A frozen group of numbers; unknown keys, NaN and infinities are errors.

    Attributes:
        unread: Parameters of its groups, dotted, that a command with this configuration does not
            read. They are no flags, and a value other than the default is an error.
        shared: Whether its file serves other commands too, and so may hold what is not read here.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True
    )
    unread: ClassVar[tuple[str, ...]] = ()
    shared: ClassVar[bool] = False

    @model_validator(mode="after")
    def _refuse_unread(self) -> Self:
        for path in () if self.shared else self.unread:
            *groups, name = path.split(".")
            group: Any = self
            for part in groups:
                group = getattr(group, part)
            default, found = type(group).model_fields[name].default, getattr(group, name)
            if groups[0] != ROBOT and found != default:
                raise ValueError(
                    f"{path}: expected {default}, as it is not read here, found {found}"
                )
        return self


def paths_of(model: type[Params], path: str) -> tuple[str, ...]:
    """Every parameter of a group that stands at a dotted path."""
    found: list[str] = []
    for name, field in model.model_fields.items():
        kind, deeper = field.annotation, f"{path}.{name}"
        if isinstance(kind, type) and issubclass(kind, Params):
            found += paths_of(kind, deeper)
        else:
            found.append(deeper)
    return tuple(found)


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


def number(default: Any, unit: str, source: str, **bounds: Any) -> Any:
    """Declare one parameter with its unit and source; the docstring below it is its meaning.

    Args:
        default: Its default.
        unit: Its unit, "1" if it has none.
        source: Where the default comes from.
        bounds: As for pydantic's Field.
    """
    return Field(default, json_schema_extra={"unit": unit, "source": source}, **bounds)


def meaning(field: FieldInfo, unit: bool = True) -> str:
    """What a parameter is, as a phrase without a full stop, with its unit in brackets if wanted."""
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    words = " ".join((field.description or "").split()).removesuffix(".")
    first = words.partition(" ")[0]
    phrase = first.lower() + words[len(first) :] if first.istitle() else words
    return f"{phrase} [{extra['unit']}]" if unit and extra.get("unit", "1") != "1" else phrase
