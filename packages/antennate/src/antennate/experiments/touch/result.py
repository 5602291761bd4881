"""What is told of a traverse and of many, and what a run comes to."""

from __future__ import annotations

from typing import Literal

from antennate.studies.columns import Ends, column, percent, tabular, tabular_row


@tabular
class Touched:
    """How long the antenna touched."""

    contact_share: float | None = percent("time in contact", default=None)
    """Share of ticks in contact."""


@tabular
class Answers:
    """Contacts, and how alarms answer them; an alarm is a time sensed as contact."""

    f1: float | None = column("F1", interval="f1_95", default=None)
    """F1 of ticks, 1 without error; `null` without contact and alarm."""
    contacts: int | None = column("contacts", form="d", default=None)
    """True contacts."""
    missed: int | None = column("  missed", form="d", default=None)
    """Contacts that no alarm answers."""


@tabular
class Alarms(Answers):
    """Contacts and alarms, and how they answer one another."""

    alarms: int | None = column("alarms", form="d", default=None)
    """Alarms, the times sensed as contact."""
    false: int | None = column("  false", form="d", default=None)
    """Alarms that answer no contact."""


@tabular_row
class TouchRow(Alarms, Touched):
    """A traverse, a row of trials.csv; what is measured is empty where it is invalid."""

    seed: int
    trial: int
    wall: str
    """Kind of wall."""
    speed_m_s: float
    """Speed of the carriage."""
    profile: str
    status: Literal["valid", "invalid"]
    """Whether the physics stayed valid."""
    overlap_m: float
    """How far the straight tip would stand behind the surface of the wall."""
    largest_flex_rad: float | None = None
    """Largest flex under the flex sensor, either way."""
    largest_force_n: float | None = None
    """Largest contact force."""
    reason: str = ""


@tabular
class Score(Answers):
    """How well contact is sensed."""

    f1_95: Ends | None
    precision: float | None = column("precision", interval="precision_95")
    """Share of the ticks of alarms that are contact."""
    recall: float | None = column("recall", interval="recall_95")
    """Share of the ticks in contact that are alarms."""
    false_per_m: float | None = column("false alarms per metre", interval="false_per_m_95")
    """False alarms per metre of traverse."""


@tabular
class Missed:
    """Contacts that no alarm answers."""

    missed_per_m: float | None = column("missed contacts per metre", interval="missed_per_m_95")
    """Missed contacts per metre of traverse."""
    missed_per_m_95: Ends | None
    missed_wilson95: Ends
    """Wilson's interval of the share of contacts that are missed."""
    missed_flex_rad: float | None
    """Median of the largest flex in missed contacts; `null` without any."""


@tabular
class Latency:
    """How much later alarms are than contacts."""

    n: int
    """Contacts that have this latency."""
    median_ms: float | None = column("median", "ms", form=".0f")
    median_95_ms: Ends | None
    """Interval of the median over trials."""
    p90_ms: float | None = column("  90 %", "ms", form=".0f")
    """90th percentile."""
    median_mm: float | None = column("  way until then", "mm", form=".0f")
    """Median travel of the carriage meanwhile."""


@tabular
class Reaction:
    """How fast alarms answer, and how far apart their level lies with contact and without."""

    onset: Latency = column("onset latency")
    """Start of an alarm after that of its contact."""
    release: Latency = column("release latency")
    """End of an alarm after that of its contact."""
    auc: float | None = column("area under ROC, level", form=".3f", interval="auc_95")
    """Area under the ROC of b."""
    auc_95: Ends | None


@tabular
class Measures(Reaction, Missed, Score, Alarms, Touched):
    """Traverses pooled."""

    auc_flex: float | None = column("  flex itself", form=".3f")
    """Area under the ROC of the engine's flex."""
    auc_flex_95: Ends | None
    """Interval of that area."""
    false_per_m_95: Ends | None
    precision_95: Ends | None
    recall_95: Ends | None
    contact_share_95: Ends | None
    """Interval of `contact_share`."""
    f1_over_always_contact: float | None
    """F1 less that of a sensor that always says contact, a trial left out of both at once."""
    f1_over_always_contact_95: Ends | None
    """Interval of that difference."""
    carried: int
    """Contacts whose alarm had begun before them."""
    traverses: int
    """Traverses pooled."""
    ticks: int
    """Ticks of the traverses."""
    metres: float
    """Length of all traverses [m]."""


@tabular
class ProfileMeasures(Measures):
    """Traverses of a profile."""

    profile: str


@tabular
class SpeedMeasures(ProfileMeasures):
    """Traverses of a profile at a speed."""

    speed_m_s: float


@tabular
class WallMeasures(ProfileMeasures):
    """Traverses of a profile along a wall."""

    wall: str


@tabular
class Cell(SpeedMeasures, WallMeasures):
    """Traverses of a profile at a speed along a wall."""


@tabular
class Averaged(Reaction, Score):
    """All traverses, read with another T_avg."""

    averaging_time_s: float


@tabular
class Truth(Score, Touched):
    """All traverses against another definition of the truth."""

    contact_force_n: float
    merge_time_s: float


@tabular
class Needed:
    """What a contact must do to be felt."""

    flex_rad: float | None
    """Least steady flex at which b reaches θ; `null` if none does."""
    tip_force_n: dict[str, float | None]
    """Steady force, normal to the tip, that bends each profile so far; `null` beyond 1 N."""


@tabular
class Pair:
    """Two profiles, paired by trial."""

    f1_difference: float | None = column(interval="f1_difference_95")
    """F1 of the first less that of the second."""
    f1_difference_95: Ends | None


@tabular
class Point:
    """A threshold on b, without hysteresis."""

    theta: float
    """Threshold θ."""
    true_positive_rate: float | None
    """Share of the ticks in contact at or above it."""
    false_positive_rate: float | None
    """Share of the free ticks at or above it."""
    f1: float | None


@tabular
class Threshold(Point):
    """A threshold that stands out."""

    flex_rad: float | None
    """Least steady flex at which b reaches it; `null` if none does."""


@tabular
class Roc:
    """Every threshold on b."""

    curve: list[Point]
    """Thresholds from low to high; the best one has its flex here, too."""
    default: Threshold
    """Threshold of the configuration."""
    best_f1: Threshold
    """Threshold of the largest F1 on these data."""
    f1_always_contact: float | None
    """F1 of a sensor that always says contact, a control."""
    auc_random: float | None
    """Area under the ROC of random numbers, a control."""


@tabular
class TouchResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "touch"
    seed: int
    trials: int
    """Trials of every wall, speed and profile."""
    invalid: int
    """Traverses whose physics became invalid; they enter nothing."""
    rate_hz: float
    """Ticks a second."""
    travel_m: float
    """Length of a traverse."""
    contact_force_n: float
    """Force above which an obstacle presses."""
    merge_time_s: float
    """Gaps between presses shorter than this are contact."""
    averaging_time_s: float
    """T_avg, over which readings are averaged."""
    threshold: float
    """Threshold θ on b."""
    hysteresis: float
    """Hysteresis of θ."""
    needed: Needed
    """What a contact must do to be felt."""
    profiles: dict[str, ProfileMeasures]
    by_speed: list[SpeedMeasures]
    """Each profile at each speed."""
    by_wall: list[WallMeasures]
    """Each profile along each wall."""
    cells: list[Cell]
    """Each profile at each speed along each wall."""
    pairs: dict[str, Pair]
    """Every two profiles, as `stiff-descending`."""
    roc: dict[str, Roc]
    """Thresholds of each profile."""
    averaging: list[Averaged]
    """Other T_avg on the same traverses."""
    truths: list[Truth]
    """Other definitions of the truth on the same traverses."""
