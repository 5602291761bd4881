"""What `antennate study` is told."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Tag, field_validator
from pydantic.fields import FieldInfo

from antennate.errors import ConfigError
from antennate.messages import nearest, shortened, without_group
from antennate.params.base import Params, number
from antennate.studies.experiment import Planned
from antennate.studies.plan import (
    RANGE_OR_CHOICES,
    Axes,
    Kind,
    Point,
    Range,
    make_points,
)

OF_SEARCH = (
    *("maximize", "minimize", "batch", "least_ok", "validated", "validation_factor", "reference"),
)
"""Parameters that only plan optuna reads."""


class StudyConfig(Planned):
    """Everything that decides the outcome of `antennate study`."""

    former: ClassVar[Mapping[str, Sequence[str]]] = {
        "proposals": ("points",),
        "search": ("vary",),
        "evaluate": ("experiment", "trials", "settings", "maximize", "minimize"),
    }

    experiment: str = number(
        "tunnel", "1", "assumed: the question of the paper", examples=["tunnel", "wall"]
    )
    """Experiment that is run at each point, or a function trial(config, seed) as MODULE:NAME."""
    plan: Kind = number("grid", "1", "assumed: every combination is what a map needs")
    """How points are chosen: grid, list, random, sobol, morris or optuna."""
    points: int = number(16, "1", "assumed: a power of 2, as Sobol's points need", ge=1, le=100000)
    """Points of random and sobol, trajectories of morris, designs that optuna proposes."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of the plan; trials have that of their experiment."""
    trials: int | None = number(
        None, "1", "assumed: as many as the experiment has by itself", ge=1, le=100000
    )
    """Trials at each point."""
    response: str | None = number(None, "1", "assumed: the share of successes if there is one")
    """Column of the rows whose mean is compared between points."""
    settings: dict[str, Any] = number({}, "1", "assumed: the defaults of the experiment")
    """Parameters of the experiment that are the same at all points."""
    vary: dict[
        str,
        Annotated[
            Annotated[tuple[Any, ...], Tag("choices")] | Annotated[Range, Tag("range")],
            RANGE_OR_CHOICES,
        ],
    ] = number({}, "1", "assumed: nothing varies")
    """Parameters that vary, by dotted name: a list of values, or low and high of a range."""
    assumed: float | None = number(
        None, "1", "assumed: only what is named varies", gt=0, lt=1, examples=[0.2]
    )
    """Vary every assumed number of the experiment by this share of its default, up and down."""
    leave_out: tuple[str, ...] = number((), "1", "assumed: none is left out")
    """Assumed numbers that do not vary, or all of a group."""

    maximize: tuple[str, ...] = number((), "1", "assumed: nothing is searched for")
    """Measures that shall be large, for optuna; with @success at its end the mean of one over the
    trials that succeeded."""
    minimize: tuple[str, ...] = number((), "1", "assumed: nothing is searched for")
    """Measures that shall be small, likewise."""
    batch: int = number(8, "1", "assumed: enough to keep some cores busy", ge=1, le=10000)
    """Designs that optuna proposes at once, before their results are known."""
    least_ok: float = number(0.5, "1", "assumed: half of the trials say something", gt=0, le=1)
    """Share of the trials that must be ok; with fewer a design of optuna has failed."""
    validated: int = number(5, "1", "assumed: some along the front", ge=0, le=1000)
    """Designs of the front that are run again on fresh seeds, with the references; 0 for none."""
    validation_factor: int = number(4, "1", "assumed: intervals half as wide", ge=1, le=1000)
    """How many times the trials of the search those have."""
    reference: dict[str, dict[str, Any]] = number({}, "1", "assumed: nothing to compare with")
    """Designs that are run beside those of optuna, by name; others are compared with the first."""

    @field_validator("experiment")
    @classmethod
    def _as_registered(cls, name: str) -> str:
        return without_group(name)

    def points_of(self, model: type[Params] | None) -> list[Point]:
        """All points, in order."""
        return make_points(self.plan, self.axes(model), self.points, self.seed)

    def axes(self, model: type[Params] | None) -> Axes:
        """What varies: what is named, and the assumed numbers of the experiment if asked for."""
        axes: dict[str, Any] = dict(self.vary)
        if self.assumed is not None and model is not None:
            if self.plan in ("grid", "list", "optuna"):
                raise ConfigError(
                    f"assumed: expected plan random, sobol or morris beside it, found {self.plan}"
                )
            known = [name for name, *_ in assumed_fields(model())]
            for group in self.leave_out:
                if not any(f"{name}.".startswith(f"{group}.") for name in known):
                    groups = {name.rpartition(".")[0] for name in known} - {""}
                    raise ConfigError(
                        "leave_out: expected an assumed number or a group of them"
                        f"{nearest(group, [*known, *sorted(groups)])}, found {shortened(group)}"
                    )
            for name, range_ in assumed_ranges(model, self.assumed):
                left_out = any(f"{name}.".startswith(f"{group}.") for group in self.leave_out)
                if not left_out and name not in axes:
                    axes[name] = range_
        return axes


def assumed_ranges(model: type[Params], share: float) -> Iterator[tuple[str, Range]]:
    """Each number of a configuration whose source is an assumption, with a range around it.

    Numbers that are 0 by default, whole numbers and lists have no such range: a study names them.
    """
    for name, value, field in assumed_fields(model()):
        if isinstance(value, float) and value != 0.0 and name not in model.unread:
            ends = sorted((value * (1.0 - share), value * (1.0 + share)))
            low, high = _bounds(field)
            yield name, Range(low=max(ends[0], low), high=min(ends[1], high))


def assumed_fields(group: Params, path: str = "") -> Iterator[tuple[str, Any, FieldInfo]]:
    """Dotted name, value and field of each parameter whose source is an assumption."""
    for name, field in type(group).model_fields.items():
        value = getattr(group, name)
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        if isinstance(value, Params):
            yield from assumed_fields(value, f"{path}{name}.")
        elif str(extra.get("source", "")).startswith("assumed"):
            yield path + name, value, field


def _bounds(field: FieldInfo) -> tuple[float, float]:
    """The least and the largest value that a field takes."""
    bounds = {"ge": -math.inf, "gt": -math.inf, "le": math.inf, "lt": math.inf}
    for bound in field.metadata:
        bounds |= {n: limit for n in bounds if (limit := getattr(bound, n, None)) is not None}
    low = max(bounds["ge"], math.nextafter(bounds["gt"], math.inf))
    return low, min(bounds["le"], math.nextafter(bounds["lt"], -math.inf))
