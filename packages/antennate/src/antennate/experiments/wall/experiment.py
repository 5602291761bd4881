"""The boulder wall: which antenna passes a line of small spheres, which jams, which slips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from antennate import figures as style
from antennate.antenna.statics import Profile, about
from antennate.errors import SimulationError
from antennate.experiments.wall.physics import (
    Measured,
    Traverse,
    WallConfig,
    WallTrial,
    classify,
    invalid,
    passage,
)
from antennate.sim.bench import Bench, unwatched
from antennate.studies.charts import Shares, Strip
from antennate.studies.columns import Ends, Frame, column, column_of, tabular
from antennate.studies.experiment import Experiment
from antennate.studies.pooling import by, count, pooled, valid
from antennate.studies.statistics import Discordance, Matched, mcnemar, wilson
from antennate.studies.tables import Table, few, successes
from antennate.studies.trials import Found, Trials

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from antennate.telemetry.view.simulation import SimulationView

REFERENCE: Profile = "descending"
"""The profile that all others are compared with."""


@tabular
class Passed:
    """How the trials of a profile ended, over a part of the travel."""

    trials: int = column("trials", form="d")
    successes: int = column("successes", pool=count("outcome", "success"), form="d")
    """Trials that passed."""
    wilson95: Ends | None = wilson()
    """Wilson's interval of their share of the valid ones; `null` without any."""
    jams: int = column("jams", pool=count("outcome", "jam"), form="d")
    """Trials that jammed; one that does both is a jam."""
    slips: int = column("slips", pool=count("outcome", "slip"), form="d")
    """Trials that slipped."""
    invalid: int = column("invalid", form="d")
    """Trials whose physics became invalid; they are left out of all else."""


@tabular
class ProfileSummary(Measured, Passed):
    """All trials of a profile."""

    after_start: Passed = column("after")
    """Counts without the first `start_m` of the travel."""


@tabular
class Pair(Matched):
    """`descending` against another profile."""

    after_start: Discordance = column("after")
    """Comparison without the first `start_m` of the travel."""


@tabular
class Border:
    """How near the sticks of valid trials come to the travel that makes one a jam."""

    at_mm: float
    """That travel: a longer stick is a jam."""
    below_mm: float | None
    """The longest stick that is none; with any limit up to the next the table is the same."""
    above_mm: float | None
    """The shortest stick that is a jam."""


@tabular
class WallResult:
    """What a run comes to."""

    schema: int = 2
    command: str = "wall"
    seed: int
    gravity: str
    """Direction of gravity in the plane."""
    start_m: float
    """Travel that the counts of `after_start` leave out."""
    profiles: dict[str, ProfileSummary]
    border: Border
    """The border of a jam."""
    paired: dict[str, Pair]
    """`descending` against each other profile, as `descending-stiff`."""

    @property
    def failed(self) -> bool:
        """Whether every trial of some profile is invalid."""
        return any(0 < each.trials == each.invalid for each in self.profiles.values())


def summarise(config: WallConfig, rows: Frame) -> WallResult:
    """The result of the rows of a run."""
    by_profile = by(rows, "profile", config.profiles)
    return WallResult(
        seed=config.seed,
        gravity=config.wall.gravity,
        start_m=config.wall.start,
        profiles={
            name: pooled(ProfileSummary, some, after_start=pooled(Passed, _late(some)))
            for name, some in by_profile.items()
        },
        border=_border(1e3 * config.wall.jam_travel, valid(rows)["longest_stick_mm"]),
        paired=_paired(by_profile),
    )


def _late(rows: Frame) -> Frame:
    """Rows whose outcome is that without the start."""
    return rows.assign(outcome=rows["outcome_after_start"])


def _border(at: float, sticks: Any) -> Border:
    below, above = sticks[sticks <= at], sticks[sticks > at]
    return Border(
        at_mm=at,
        below_mm=max(below, default=None),
        above_mm=min(above, default=None),
    )


def _paired(by_profile: Mapping[str, Frame]) -> dict[str, Pair]:
    """The reference against every other profile, on trials valid in both, with both counts."""
    tests: dict[str, Pair] = {}
    first = by_profile.get(REFERENCE)
    for name, rows in by_profile.items():
        if name == REFERENCE or first is None:
            continue
        both = valid(first).merge(valid(rows), on="trial", suffixes=("", "_other"))
        if len(both):
            whole, late = (_matched(both, of) for of in ("outcome", "outcome_after_start"))
            tests[f"{REFERENCE}-{name}"] = Pair(**vars(whole), after_start=late)
    return tests


def _matched(both: Frame, outcome: str) -> Matched:
    return mcnemar((both[[outcome, f"{outcome}_other"]] == "success").to_numpy())


def run_trial(
    config: WallConfig, profile: str, trial: int, view: SimulationView | None = None
) -> tuple[WallTrial, Traverse | None]:
    """One trial, which a page may show, and of the first of a profile its passage."""

    def watch(bench: Bench) -> None:
        if view is not None:
            view.tick(bench.model, bench.data)

    try:
        seen = passage(config, profile, trial, watch if view else unwatched)
    except SimulationError as error:
        return invalid(config, profile, trial, str(error)), None
    row = classify(config.wall, config.seed, trial, profile, seen)
    return row, seen if trial == 0 else None


def tables(result: WallResult) -> Sequence[Table]:
    """The profiles, and the reference against each other one."""
    profiles = Table.of(
        "Profiles",
        result.profiles,
        note=f"Seed {result.seed}, gravity {result.gravity}. `after` leaves out the first "
        f"{1e3 * result.start_m:g} mm of travel.\nMedians over trials; invalid trials are left "
        "out of them.",
        preface=about(result.profiles),
    )
    pairs = Table.of(
        f"{REFERENCE} (first) against each, trial by trial",
        {name.split("-")[1]: pair for name, pair in result.paired.items()},
        note="McNemar's test, exact, two-sided.",
    )
    return (profiles, pairs) if result.paired else (profiles,)


def sentence(result: WallResult) -> str:
    """Which profiles passed, how sure it is, and what it depends on."""
    so_few = few(each.trials - each.invalid for each in result.profiles.values())
    passed = f"Walls passed (95 % interval): {successes(result.profiles)}."
    return f"{passed} {_depends(result.border)} {so_few}".strip()


def _depends(border: Border) -> str:
    at, below, above = border.at_mm, border.below_mm, border.above_mm
    if below is None and above is None:
        return "No trial is valid, so nothing is known of jams."
    if below is None or above is None:
        lagged = "every trial the tip lagged" if below is None else "no trial did the tip lag"
        return f"In {lagged} more than {at:g} mm, the limit that counts as a jam."
    return (
        f"A trial is a jam if the base moves {at:g} mm while the tip stays. The nearest trials: "
        f"{at - below:.1f} mm below and {above - at:.1f} mm above this limit."
    )


OUTCOMES = Shares(
    {"successes": "#56B4E9", "jams": "#9A9A9A", "slips": "#F0E442", "invalid": "#EBEBEB"}
)
STICKS = Strip(
    column_of(WallTrial, "longest_stick_mm"),
    "the base moves, the tip does not",
    "The outcome depends on this border; a mark is a trial",
    "above {} mm: a jam",
)


def figures(found: Found[WallConfig, WallResult, Traverse]) -> dict[str, Figure]:
    """All figures of a run; without an example, no passages."""
    result = found.result()
    start = f"first {1e3 * result.start_m:g} mm"
    late = {name: each.after_start for name, each in result.profiles.items()}
    panels: Mapping[str, Mapping[str, Passed]] = {
        "Whole travel; lines: Wilson 95 % of success": result.profiles,
        f"After the {start}, in which the\nantenna bows from its approach": late,
    }
    drawn = {
        "wall": OUTCOMES.draw(panels),
        "sticks": STICKS.draw(found.frame, "profile", result.border.at_mm),
    }
    return {**drawn, "passages": passages(found.drawn)} if found.drawn else drawn


@style.styled
def passages(examples: Mapping[tuple[str, int], Traverse]) -> Figure:
    """The first trial of every profile: advance of the tip, and shapes along the wall."""
    figure = style.canvas(style.WIDTH, 2.3 * len(examples))
    panels = figure.subplots(len(examples), 2, squeeze=False, sharex="col", sharey="col")
    for ((profile, _), seen), (advance, along) in zip(examples.items(), panels, strict=True):
        colour, end = style.PROFILE_LOOKS[profile][0], 1e3 * seen.base[-1]
        advance.plot(1e3 * seen.base, 1e3 * seen.tip, color=colour)
        advance.plot([0, end], [0, end], color=style.FAINT, zorder=0)
        advance.set(title=profile.replace("_", " "), ylabel="advance of the tip [mm]")
        for shape in seen.shapes:
            along.plot(*(1e3 * shape.T), color=colour, linewidth=1.0)
        _draw_boulders(along, seen)
        along.set(ylabel="along the wall [mm]", aspect="equal")
    panels[-1, 0].set_xlabel("travel of the base [mm]")
    panels[-1, 1].set_xlabel("from the crests [mm]")
    return figure


def _draw_boulders(panel: Axes, seen: Traverse) -> None:
    """The boulders that the antenna could have reached."""
    from matplotlib.patches import Circle

    along = seen.shapes[..., 1]
    reached = (seen.boulders[:, 1] > along.min()) & (seen.boulders[:, 1] < along.max())
    for x, y, radius in (1e3 * seen.boulders[reached]).tolist():
        panel.add_patch(Circle((x, y), radius, color=style.MUTED, linewidth=0))


def _result_of(found: Found[WallConfig, WallResult, object]) -> WallResult:
    return summarise(found.config, found.frame)


EXPERIMENT = Experiment.of_folder(
    __name__,
    WallConfig,
    Trials[WallConfig](
        run_trial,
        row=WallTrial,
        summarise=_result_of,
        every=lambda config: [(p, k) for k in range(config.trials) for p in config.profiles],
        invalid=invalid,
    ),
    tables,
    sentence,
    result=WallResult,
    figures=figures,
    captions={
        "wall": "Outcomes of the trials of each profile, over the whole travel and after the "
        "start.",
        "sticks": "The longest stick of every valid trial, and the border beyond which one is a "
        "jam.",
        "passages": "The first trial of each profile: advance of the tip, and shapes of the "
        "antenna along the wall.",
    },
)
