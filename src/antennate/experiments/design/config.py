"""What `study design` is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field, Tag, model_validator

from antennate.params.base import Params, Strict, number
from antennate.studies.plan import RANGE_OR_CHOICES, Range

Goal = Literal["maximize", "minimize"]
_MOST_ENTRIES = 100
OF_SUCCESSES = "@success"
"""End of a measure of trials that succeeded."""


class Axis(Range):
    """The range of one parameter, or of each entry of a list.

    Attributes:
        entries: Fewest and most entries of a list; None if the parameter is one number.
        rising: Whether the entries are put into rising order.
    """

    entries: tuple[int, int] | None = None
    rising: bool = False

    @model_validator(mode="after")
    def _of_lists(self) -> Axis:
        if self.rising and self.entries is None:
            raise ValueError("expected entries beside rising, found none")
        if self.entries and not 1 <= self.entries[0] <= self.entries[1] <= _MOST_ENTRIES:
            raise ValueError(
                f"expected the fewest and the most entries, 1 to {_MOST_ENTRIES}, found "
                f"{self.entries[0]} and {self.entries[1]}"
            )
        return self


Axes = dict[
    str,
    Annotated[
        Annotated[tuple[Any, ...], Tag("choices")] | Annotated[Axis, Tag("range")],
        RANGE_OR_CHOICES,
    ],
]
"""By dotted name: the values of a parameter, or its range."""


@dataclass(frozen=True)
class Objective:
    """One number that a design is judged by.

    Attributes:
        label: Label of the evaluation.
        measure: What is measured in it.
        goal: Whether it shall be large or small.
    """

    label: str
    measure: str
    goal: Goal

    @property
    def name(self) -> str:
        """Its name in tables."""
        return f"{self.label}.{self.measure}"

    @property
    def column(self) -> str:
        """The column that it is made of."""
        return self.measure.removesuffix(OF_SUCCESSES)

    @property
    def of_successes(self) -> bool:
        """Whether only trials that succeeded count."""
        return self.measure.endswith(OF_SUCCESSES)

    @property
    def sign(self) -> float:
        """What makes it a number that shall be small."""
        return 1.0 if self.goal == "minimize" else -1.0


class Evaluation(Strict):
    """How one experiment evaluates a design.

    Attributes:
        experiment: Its name, or a function trial(config, seed) as MODULE:NAME; the label if not
            given.
        trials: Trials of each design, as many as the experiment has by itself if not given; of an
            experiment that has no trials of its own, runs with different seeds.
        settings: Parameters of the experiment that are the same for all designs.
        maximize: Measures that shall be large. One that ends with `@success` is the mean over the
            trials that succeeded; a design without any is worse in it than all others.
        minimize: Measures that shall be small, likewise.
    """

    experiment: str | None = None
    trials: int | None = Field(None, ge=1, le=100000)
    settings: dict[str, Any] = Field({})
    maximize: tuple[str, ...] = ()
    minimize: tuple[str, ...] = ()

    def objectives(self, label: str) -> list[Objective]:
        """What it judges a design by."""
        return [
            *(Objective(label, measure, "maximize") for measure in self.maximize),
            *(Objective(label, measure, "minimize") for measure in self.minimize),
        ]


class DesignConfig(Params):
    """Everything that decides the outcome of `study design`."""

    proposals: int = number(
        40, "1", "assumed: four times what is drawn before the sampler learns", ge=1, le=100000
    )
    """Designs that are proposed."""
    batch: int = number(8, "1", "assumed: enough to keep some cores busy", ge=1, le=10000)
    """Designs that are proposed at once, before their results are known."""
    seed: int = number(0, "1", "assumed: any", ge=0)
    """Seed of the proposals; trials have that of their experiment."""
    least_ok: float = number(0.5, "1", "assumed: half of the trials say something", gt=0, le=1)
    """Share of the trials of each experiment that must be ok; with fewer a design has failed."""
    validated: int = number(5, "1", "assumed: some along the front", ge=0, le=1000)
    """Designs of the front that are run again on fresh seeds, with the references; 0 for none."""
    validation_factor: int = number(4, "1", "assumed: intervals half as wide", ge=1, le=1000)
    """How many times the trials of the search those have."""
    search: Axes = number({}, "1", "assumed: nothing is searched")
    """Parameters that are searched, by dotted name: a list of choices, or a range."""
    reference: dict[str, dict[str, Any]] = number({}, "1", "assumed: nothing to compare with")
    """Designs that are always evaluated, by name; the first is what others are compared with."""
    evaluate: dict[str, Evaluation] = number({}, "1", "assumed: a file says what a design is for")
    """Experiments that evaluate a design, with their objectives."""

    def objectives(self) -> list[Objective]:
        """All objectives in the order of the file."""
        return [o for label, asked in self.evaluate.items() for o in asked.objectives(label)]
