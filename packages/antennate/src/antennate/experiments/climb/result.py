"""What result.json of `antennate climb` holds."""

from __future__ import annotations

from antennate.experiments.climb.rows import Effort, Probe
from antennate.studies.columns import Ends, Frame, column, percent, tabular
from antennate.studies.pooling import count, mean
from antennate.studies.statistics import Outcomes

REFERENCE = "level"
"""Whose speed on the flat floor the others are compared with."""


def _of_successes(rows: Frame, name: str) -> float | None:
    """Mean over successes of the column that the name ends with."""
    return mean(rows[rows["outcome"] == "success"], name.removeprefix("success_"))


@tabular
class Ended(Outcomes):
    """How the trials of a condition ended."""

    overturned: int = column("overturned", pool=count("outcome", "overturned"), form="d")
    """Trials in which the robot overturned."""
    success_time_s: float | None = column("time of a success", "s", _of_successes, form=".1f")
    """Time to the end, mean over successes."""
    success_speed_m_s: float | None = column(
        "speed of a success, climbing", "m/s", _of_successes, form=".3f"
    )
    """Speed of the middle of the robot while it climbs, mean over successes."""


@tabular
class Climbed(Effort, Ended):
    """All trials of a condition.

    Loads count from a link pitch before the first edge on, and are `null` for `locked`.
    """


@tabular
class Height(Climbed):
    """The trials of a condition on steps of one height."""

    height_m: float
    """Height of the step."""


@tabular
class Pair:
    """`climb` beside another condition, trial by trial."""

    trials: int = column("valid in both", form="d")
    """Trials that are valid in both."""
    only_climb: int = column("only climb", form="d")
    """Trials on which only `climb` succeeded."""
    only_other: int = column("only the other", form="d")
    """Trials on which only the other succeeded."""
    mcnemar_p: float = column("McNemar p", form=".3g")
    """McNemar's test on those, exact and two-sided."""


@tabular
class PlanError:
    """How far the plan has the head from where it is when the centre of a link crosses the edge."""

    link: str
    """Name of the link, head first; `all links` comes last."""
    crossings: int = column("crossings", form="d")
    """Crossings of the edge with a plan."""
    low_cm: float | None = column("5 %", "cm", form="+.1f", default=None)
    """Error of the plan, 5th percentile; positive is ahead of the robot."""
    middle_cm: float | None = column("50 %", "cm", form="+.1f", default=None)
    """Error of the plan, median."""
    high_cm: float | None = column("95 %", "cm", form="+.1f", default=None)
    """Error of the plan, 95th percentile."""
    within: float | None = percent("within -6 to +4 cm", default=None)
    """Share of the crossings within the aim of -6 to +4 cm."""


@tabular
class Climbing:
    """Steps, with one gain divisor."""

    divisor: float
    """Gain divisor of the servos of the body."""
    conditions: dict[str, Climbed]
    """Each condition, over all heights."""
    heights: dict[str, list[Height]]
    """Each condition, height by height."""
    pairs: dict[str, Pair]
    """`climb` beside each other condition, all heights pooled."""
    plan: list[PlanError] | None
    """Error of the plan of `climb`; `null` without it."""


@tabular
class OnGround(Climbed):
    """The trials of a condition on one ground."""

    ground: str
    """The ground as on the command line."""
    scene: str
    """Name of the scene of the ground."""
    size: float | None
    """Size of the ground [m; deg of a ramp]."""
    fell: int = column("fell", pool=count("outcome", "fell"), form="d")
    """Trials in which the robot fell."""
    stopped: int = column("stopped before it", pool=count("outcome", "stopped"), form="d")
    """Trials in which the robot stopped before a drop."""


@tabular
class Walk:
    """A condition on the flat floor."""

    trials: int = column("trials", form="d")
    """Trials with a speed."""
    speed_m_s: float | None = column("speed", "m/s", form=".4f", interval="speed_95")
    """Mean speed of the middle of the robot."""
    speed_95: Ends | None
    ratio: float | None = column(f"over that of {REFERENCE}", form=".3f", interval="ratio_95")
    """Mean speed over that of `level` on the same trials; its interval is by jackknife."""
    ratio_95: Ends | None
    climbs: float | None = column("climbs begun, mean")
    """Climbs begun, mean over valid trials: all are false ones."""


@tabular
class Crossing:
    """Other grounds, with one gain divisor."""

    divisor: float
    grounds: dict[str, list[OnGround]]
    """Each condition, ground by ground, of those that are to be crossed."""
    pairs: dict[str, dict[str, Pair]]
    """Each kind of ground, all sizes pooled: `climb` beside each other condition, as on steps."""
    flat: dict[str, Walk] | None
    """Each condition on the flat floor; `null` without it."""


@tabular
class ProbeError:
    """Height by the probe less the true one, of steps of 2 to 10 cm."""

    steps: int
    """Valid trials on such steps."""
    told: int
    """Trials in which the ground was taken for a step, and its height told."""
    bias_m: float | None
    """Mean error."""
    rmse_m: float | None
    """Root mean square error."""


@tabular
class FalseClimbs:
    """Climbs begun where there is no step, over all valid trials."""

    false_climbs: int = column("false climbs", form="d")
    time_s: float
    """Time of all trials."""
    way_m: float
    """Distance that the middle of the robot walked in all trials."""
    per_1000_s: float | None = column("  per 1000 s", interval="per_1000_s_95")
    """Climbs begun in 1000 s, with Garwood's exact interval of a Poisson count."""
    per_1000_s_95: Ends | None
    per_m: float | None = column("  per metre", "1/m", form=".3f", interval="per_m_95")
    """Climbs begun in a metre walked, with its interval."""
    per_m_95: Ends | None


@tabular
class Cliff:
    """A drop of 35 cm, whose ground is out of reach."""

    trials: int
    """Valid trials."""
    stopped: int
    """Trials in which the robot stopped before it."""
    wilson95: Ends
    """Wilson's interval of the share that stopped."""


@tabular
class Sensing:
    """What `climb` feels, with one gain divisor."""

    divisor: float
    invalid: int
    first_reason: str | None
    confusion: dict[str, dict[str, int]]
    """Valid trials of each ground by what it is taken for: `FLOOR`, `STEP_UP` and so on."""
    felt: dict[str, Probe]
    """Each ground that is to be felt."""
    heights: ProbeError
    """Error of the height of a step."""
    false_climbs: dict[str, FalseClimbs]
    """The flat floor, and rubble."""
    cliff: Cliff
    """The drop that is to be stopped at."""


@tabular
class ClimbResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "climb"
    seed: int
    time_limit_s: float
    """Time after which a trial on one step has failed."""
    heights_m: list[float]
    """Heights of the steps."""
    interrupted: bool = False
    climbing: list[Climbing]
    """Steps: an entry for each gain divisor."""
    grounds: list[Crossing]
    """Other grounds: an entry for each gain divisor."""
    sensing: list[Sensing]
    """What is felt: an entry for each gain divisor; empty with `--sensing 0`."""

    @property
    def failed(self) -> bool:
        """Whether every trial of some condition is invalid."""
        climbs = [each for entry in self.climbing for each in entry.conditions.values()]
        crosses = [each for e in self.grounds for some in e.grounds.values() for each in some]
        return any(0 < each.trials == each.invalid for each in (*climbs, *crosses))
