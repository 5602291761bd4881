"""What a competition comes to: of each controller, of each in each scene, and of every two."""

from __future__ import annotations

from antennate.studies.columns import Ends, column, percent, tabular
from antennate.studies.pooling import count, share, total
from antennate.studies.statistics import wilson
from antennate_lab.compete.comparison import Check, refusal


@tabular
class Ranked:
    """Where a controller stands."""

    given: str
    """What the simulation gave to it, in words; such a controller has no rank."""
    rank: int | None = column("rank", form=".0f", interval="rank_95")
    """One more than the number of others that succeed more often by more than `tie`; its interval
    holds for all ranks at once."""
    rank_95: tuple[int, int] | None


@tabular
class Cell:
    """A controller in one scene; without an episode there all but counts are `null`."""

    episodes: int = column("episodes", form="d")
    successes: int = column("successes", pool=count("end", "success"), form="d")
    """Episodes that succeeded."""
    success_share: float | None = percent("  share", pool=share("end", "success"))
    """Successes over episodes."""
    wilson95: Ends | None = wilson("end")
    """Wilson's interval of that share; over several scenes, of the effective number of trials."""
    restricted_mean_share: float | None = percent(
        "restricted mean time", "% of limit", form=".1f", interval="restricted_mean_share_95"
    )
    """Mean time as a share of the limit of each episode, 1 for a failure, and its interval."""
    restricted_mean_share_95: Ends | None


@tabular
class Controller(Cell, Ranked):
    """A controller over all scenes.

    `successes`, `timeouts`, `left`, `fell`, `invalid`, and episodes whose outcome is overturned,
    which have no key of their own, add up to `episodes`.
    """

    speed_m_s: float | None = column("speed over successes", "m/s", form=".3f", interval="speed_95")
    """Mean speed over successes, and its interval over draws."""
    speed_95: Ends | None
    timeouts: int = column("out of time", pool=count("end", "timeout"), form="d")
    """Episodes that were not out within the limit."""
    left: int = column("left the scene", pool=count("end", "left"), form="d")
    """Episodes that left the scene by another way than the exit."""
    fell: int = column("fell", pool=count("end", "fell"), form="d")
    """Episodes in which the robot fell."""
    overturned: int = column("on its back at the end", pool=count("overturned", True), form="d")
    """Episodes after which the robot lay on its back, whatever their outcome."""
    invalid: int = column("INVALID", form="d")
    """Episodes that are INVALID; they are failures."""
    void_decisions: int = column(pool=total, default=0)
    first_reason: str | None


@tabular
class Pair:
    """Two controllers that are ranked, on the draws that both have."""

    names: tuple[str, str]
    """The first and the second."""
    episodes: int
    """Episodes compared."""
    draws: int
    """Draws of these episodes."""
    only_first: int = column("only first", form="d")
    """Episodes in which only the first succeeded."""
    only_second: int = column("only second", form="d")
    """Episodes in which only the second did."""
    mcnemar_p: float
    """McNemar's test of successes, exact, by draws."""
    mcnemar_holm_p: float = column("McNemar p", form=".2g")
    """P of that test with Holm's correction over all pairs."""
    share_difference: float = percent(
        "time apart", "% of limit", form="+.1f", interval="share_difference_95"
    )
    """Mean over draws of the restricted time as a share of the limit, first less second."""
    share_difference_95: Ends | None
    wilcoxon_p: float | None
    """Signed-rank test on the means of the draws; `null` with one draw."""
    wilcoxon_holm_p: float = column("Wilcoxon p", form=".2g")
    """P of that test with Holm's correction over all pairs."""
    both: int
    """Episodes in which both succeeded."""
    success_difference: float
    """Success share of the first less that of the second."""
    tie: bool
    """Whether that difference is no more than the run's `tie`."""


@tabular
class Asked:
    """What was run."""

    schema: int = 1
    command: str = "compete"
    seed: int | None
    """Seed of the run; `null` with `--check`."""
    trials: int
    """Draws of each scene."""
    decision_limit_s: float
    """Processor time that a decision may take."""
    tie: float
    """Largest difference of success shares that is a tie."""
    interrupted: bool = False
    """Always false: a run that is interrupted has no result."""


@tabular
class Standing:
    """What the rows of one run or of several come to."""

    seeds: list[int]
    """Seeds of all rows."""
    hidden: bool
    """Whether the seed of each row was drawn when its run began."""
    controllers: dict[str, Controller]
    """Each controller by name."""
    scenes: dict[str, dict[str, Cell]]
    """Of each scene every controller by name."""
    paired: dict[str, Pair]
    """Every two controllers that are ranked, as `first-second`."""
    check: Check | None
    """How a table repeats, with `--check`; else `null`."""


@tabular
class CompeteResult(Standing, Asked):
    """What a run comes to."""

    @property
    def failed(self) -> bool:
        """Whether a table that was checked does not repeat, or there is no valid episode at all."""
        if self.check is not None:
            return bool(refusal(self.check))
        return len(none_valid(self)) == len(self.controllers)


def none_valid(result: Standing) -> dict[str, str | None]:
    """Controllers of which every episode is INVALID, and why the first one is."""
    return {
        name: each.first_reason
        for name, each in result.controllers.items()
        if each.episodes and each.invalid == each.episodes
    }
