"""What a traverse comes to, and what statics and traverses of all profiles do."""

from __future__ import annotations

from typing import Literal

from antennate.experiments.force.explained import Explained, Number
from antennate.studies.columns import column, tabular


@tabular
class TraverseRow:
    """A traverse, a row of trials.csv."""

    seed: int
    trial: int
    """Number of the traverse."""
    profile: str
    status: Literal["valid", "invalid"]
    """Whether the physics stayed valid; if not, all that is measured is 0."""
    overlap: float
    """Place of the first contact over the length of the antenna."""
    speed_m_s: float
    """Speed of the base."""
    samples: int
    """Samples in which the post pressed."""
    flex_max_rad: float
    """Largest flex under the flex sensor."""
    force_max_n: float
    """Largest contact force."""
    place_last: float
    """Place of the last contact over the length of the antenna."""
    reason: str


@tabular
class Told(Explained):
    """How much of the force a scalar tells."""

    rmse_percent: Number
    """Root mean square error over `force_max_n`."""


@tabular
class ToldFrom(Told):
    """How much of the force flex tells from a place on to the tip, by one curve for all places."""

    from_place: float
    """Nearest place over the length of the antenna."""


@tabular
class Scalars:
    """How much of the force each scalar tells."""

    flex: Told = column()
    """Flex, without noise."""
    reading: Told
    """Counts of one reading."""
    level: Told
    """Bending level b of the readings of T_avg."""


@tabular
class Curves:
    """How much the best increasing curve tells."""

    known: Scalars = column("(place known)")
    """A curve for every place; places of a traverse are in bins of `place_step`."""
    unknown: Scalars = column("(place unknown)")
    """One curve for all places."""


@tabular
class Loads(Curves):
    """Loads at rest."""

    loads: int
    """Loads that turn no hinge beyond the limit."""
    left_out: int
    """Loads that do, and take no part."""


@tabular
class Statics:
    """Loads at rest at every place, of many sizes."""

    frictionless: Loads = column("at rest")
    """Loads normal to the link."""
    friction: Loads = column("with friction")
    """Loads within the cone of friction."""


@tabular
class ClosedForm:
    """The frictionless statics with flex and place, fitted to nothing."""

    all: Told
    """All samples."""
    settled: Told
    """Samples T_avg or more after the first touch."""


@tabular
class Traverses(Curves):
    """Traverses past a post, of which one half fits and the other tests."""

    trials: int
    """Traverses run."""
    invalid: int
    """Traverses whose physics became invalid; they enter nothing."""
    closed_form: ClosedForm
    """Statics in place of a curve."""


@tabular
class ProfileResult:
    """Loads and traverses of a profile."""

    force_max_n: float = column("largest force", "N", form=".4f")
    """Force, normal to the tip, that turns the most bent hinge by the limit."""
    statics: Statics = column()
    """Loads at rest."""
    by_range: list[ToldFrom]
    """Loads at rest without friction, from each place on to the tip."""
    traverses: Traverses = column("dragged")
    """Traverses past a post."""


@tabular
class ForceResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "force"
    seed: int
    hinge_limit_deg: float
    """Largest angle of a hinge; loads that turn one farther take no part."""
    from_place: float
    """Nearest place of contact that the question is about, over the length of the antenna."""
    friction: float
    """Friction of the contacts that have any."""
    profiles: dict[str, ProfileResult]
