"""The boulder wall: which antenna passes a line of small spheres, which jams, which slips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna.statics import Profile, about
from antennate.errors import SimulationError
from antennate.experiments.bench import bench_films
from antennate.experiments.wall.physics import (
    Traverse,
    WallConfig,
    WallTrial,
    classify,
    invalid,
    passage,
)
from antennate.sim.bench import Watch, unwatched
from antennate.studies import statistics
from antennate.studies.experiment import (
    Experiment,
    OneByOne,
    OnRow,
    OnStep,
    Trials,
    no_row,
    no_step,
)
from antennate.studies.measures import Measure, Table, few, largest, median, successes, summarise
from antennate.studies.pool import Workers

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from antennate.telemetry.view.simulation import SimulationView

_COUNTS = {"successes": "success", "jams": "jam", "slips": "slip", "invalid": "invalid"}
"""Names of the counts, and the outcome that each counts."""
_WILSON = Measure("wilson95", "  Wilson 95 %", "%", form=".0f", scale=100.0)
PROFILE = (
    Measure("trials", "trials", form="d"),
    Measure("successes", "successes", form="d"),
    _WILSON,
    Measure("jams", "jams", form="d"),
    Measure("slips", "slips", form="d"),
    Measure("invalid", "invalid", form="d"),
    Measure("after_start.successes", "successes after", form="d"),
    Measure("after_start.wilson95", _WILSON.label, "%", form=".0f", scale=100.0),
    Measure("after_start.jams", "jams after", form="d"),
    Measure("after_start.slips", "slips after", form="d"),
    Measure("least_advance_mm", "least advance", "mm", of=median),
    Measure("longest_stick_mm", "longest stick", "mm", of=median, form=".1f"),
    Measure("longest_gap_s", "longest gap", "s", of=median),
    Measure("touched", of=median),
    Measure("force_mean_n", "contact force, mean", "N", of=median, form=".3f"),
    Measure("force_max_n", "contact force, largest", "N", of=largest),
    Measure("flex_max_deg", "flex, largest", "deg", of=largest, form=".0f"),
    Measure("hinge_max_deg", "angle of a hinge, largest", "deg", of=largest, form=".0f"),
)
_TEST = (
    ("only_first", "only the first succeeded", "d"),
    ("only_second", "only the second", "d"),
    ("mcnemar_p", "McNemar p", ".3g"),
)
PAIR = tuple(
    Measure(f"{part}{name}", f"{label}{after}", form=form)
    for part, after in (("", ""), ("after_start.", ", after"))
    for name, label, form in _TEST
)


def summary(rows: Sequence[WallTrial]) -> dict[str, Any]:
    """One profile in numbers, over the whole travel and after the start."""
    valid = [row for row in rows if row.outcome != "invalid"]
    return {
        **_counts([row.outcome for row in rows]),
        "after_start": _counts([row.outcome_after_start for row in rows]),
        **summarise(PROFILE, valid),
    }


def _counts(outcomes: Sequence[str]) -> dict[str, Any]:
    counts = {name: outcomes.count(outcome) for name, outcome in _COUNTS.items()}
    valid = len(outcomes) - counts["invalid"]
    wilson = statistics.wilson95(counts["successes"], valid) if valid else None
    return {"trials": len(outcomes), **counts, "wilson95": wilson}


def paired(reference: str, by_profile: Mapping[str, Sequence[WallTrial]]) -> dict[str, Any]:
    """The reference against every other profile, on trials valid in both, with both counts."""
    tests = {}
    for other, theirs in by_profile.items():
        pairs = [
            pair
            for pair in zip(by_profile.get(reference, ()), theirs, strict=False)
            if "invalid" not in (pair[0].outcome, pair[1].outcome)
        ]
        if other != reference and pairs:
            tests[f"{reference}-{other}"] = {
                "trials": len(pairs),
                **_mcnemar(pairs, "outcome"),
                "after_start": _mcnemar(pairs, "outcome_after_start"),
            }
    return tests


def border(jam_travel: float, rows: Sequence[WallTrial]) -> dict[str, Any]:
    """How near the sticks of valid trials come to the travel [m] that makes one a jam.

    Returns:
        `at_mm`, that travel; `below_mm` and `above_mm`, the longest stick that is no jam and the
        shortest that is one, None where there is none. With any travel between the two every trial
        jams or does not jam as it does now.
    """
    at = 1e3 * jam_travel
    sticks = [row.longest_stick_mm for row in rows if row.outcome != "invalid"]
    below = max((stick for stick in sticks if stick <= at), default=None)
    above = min((stick for stick in sticks if stick > at), default=None)
    return {"at_mm": at, "below_mm": below, "above_mm": above}


def _mcnemar(pairs: Sequence[tuple[WallTrial, WallTrial]], column: str) -> dict[str, Any]:
    succeeded = [[getattr(row, column) == "success" for row in pair] for pair in pairs]
    return asdict(statistics.mcnemar(np.array(succeeded)))


REFERENCE: Profile = "descending"
"""The profile that all others are compared with."""


@dataclass(frozen=True)
class WallOutcome:
    """All trials of a run.

    Attributes:
        rows: Sorted by profile and trial.
        examples: The first trial of every profile.
    """

    config: WallConfig
    rows: list[WallTrial]
    examples: dict[str, Traverse]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        by_profile = {
            p: [row for row in self.rows if row.profile == p] for p in self.config.profiles
        }
        return {
            "schema": 2,
            "command": "wall",
            "seed": self.config.seed,
            "gravity": self.config.wall.gravity,
            "start_m": self.config.wall.start,
            "profiles": {p: summary(rows) for p, rows in by_profile.items()},
            "border": border(self.config.wall.jam_travel, self.rows),
            "paired": paired(REFERENCE, by_profile),
        }


def run_trial(
    config: WallConfig, profile: str, trial: int, watch: Watch = unwatched
) -> tuple[WallTrial, Traverse | None]:
    """One trial, and of the first of a profile its passage."""
    try:
        seen = passage(config, profile, trial, watch)
    except SimulationError as error:
        return invalid(config.seed, trial, profile, str(error)), None
    row = classify(config.wall, config.seed, trial, profile, seen)
    return row, seen if trial == 0 else None


TRIALS = Trials[WallConfig](
    "profile",
    every=lambda config: [(p, k) for k in range(config.trials) for p in config.profiles],
    carry_out=OneByOne(run_trial),
    row=WallTrial,
    invalid=lambda config, profile, trial, why: invalid(config.seed, trial, profile, why),
    watched=lambda view: {"watch": lambda bench: view.tick(bench.model, bench.data)},
)


def run(
    config: WallConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
    view: SimulationView | None = None,
) -> WallOutcome:
    """Run all trials of all profiles.

    Raises:
        WorkerError: A worker process failed.
    """
    passages, _ = TRIALS.gather(config, workers, on_step, on_row, view=view)
    examples = {row.profile: seen for row, seen in passages if seen is not None}
    return WallOutcome(config, [row for row, _ in passages], examples)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The profiles, and the reference against each other one."""
    profiles = Table.of(
        "Profiles",
        result["profiles"],
        PROFILE,
        f"Seed {result['seed']}, gravity {result['gravity']}. `after` leaves out the first "
        f"{1e3 * result['start_m']:g} mm of travel.\nMedians over trials; invalid trials are left "
        "out of them.",
        about(result["profiles"]),
    )
    pairs = Table.of(
        f"{REFERENCE} (first) against each, trial by trial",
        {name.split("-")[1]: pair for name, pair in result["paired"].items()},
        PAIR,
        "McNemar's test, exact, two-sided.",
    )
    return (profiles, pairs) if result["paired"] else (profiles,)


def sentence(result: Mapping[str, Any]) -> str:
    """Which profiles passed, how sure it is, and what it depends on."""
    profiles = result["profiles"]
    so_few = few(row["trials"] - row["invalid"] for row in profiles.values())
    text = f"Walls passed (95 % interval): {successes(profiles)}. {_border(result)}"
    return f"{text} {so_few}".strip()


def _border(result: Mapping[str, Any]) -> str:
    at, below, above = (result["border"][key] for key in ("at_mm", "below_mm", "above_mm"))
    if below is None and above is None:
        return "No trial is valid, so nothing is known of jams."
    if below is None or above is None:
        lagged = "every trial the tip lagged" if below is None else "no trial did the tip lag"
        return f"In {lagged} more than {at:g} mm, the limit that counts as a jam."
    return (
        f"A trial is a jam if the base moves {at:g} mm while the tip stays. The nearest trials: "
        f"{at - below:.1f} mm below and {above - at:.1f} mm above this limit."
    )


OUTCOME_COLOURS = {
    "successes": "#56B4E9",
    "jams": "#9A9A9A",
    "slips": "#F0E442",
    "invalid": "#EBEBEB",
}


def figures(outcome: WallOutcome) -> dict[str, Figure]:
    """All figures of a run; without an example, no passages."""
    result = outcome.result()
    drawn = {"wall": outcomes(result), "sticks": sticks(outcome.rows, result["border"]["at_mm"])}
    examples = outcome.examples
    return {**drawn, "passages": passages(examples)} if examples else drawn


@style.styled
def outcomes(result: Mapping[str, Any]) -> Figure:
    """Outcomes of the trials of each profile, over the whole travel and after the start."""
    figure = style.canvas(style.WIDTH, 6.0)
    whole, late = figure.subplots(2, 1)
    profiles = result["profiles"]
    _draw_outcomes(whole, profiles, "Whole travel; lines: Wilson 95 % of success")
    after = {name: profile["after_start"] for name, profile in profiles.items()}
    start = f"first {1e3 * result['start_m']:g} mm"
    _draw_outcomes(late, after, f"After the {start}, in which the\nantenna bows from its approach")
    figure.legend(
        *whole.get_legend_handles_labels(), loc="outside lower center", ncols=4, columnspacing=1.2
    )
    return figure


def _draw_outcomes(panel: Axes, profiles: Mapping[str, Mapping[str, Any]], title: str) -> None:
    places = np.arange(len(profiles))
    floor = np.zeros(len(profiles))
    for outcome, colour in OUTCOME_COLOURS.items():
        shares = np.array(
            [profile[outcome] / max(profile["trials"], 1) for profile in profiles.values()]
        )
        if outcome != "invalid" or shares.any():
            panel.bar(places, shares, 0.6, floor, color=colour, label=outcome)
        floor += shares
    for place, profile in zip(places, profiles.values(), strict=True):
        ends = profile["wilson95"]
        if ends:
            panel.plot([place, place], ends, color=style.INK, linewidth=1.4)
    labels = [
        f"{name.replace('_', chr(10))}\nn = {profile['trials']}"
        for name, profile in profiles.items()
    ]
    panel.set_xticks(places, labels)
    panel.set(title=title, ylabel="share of trials", ylim=(0, 1.02))
    panel.grid(axis="x", visible=False)


@style.styled
def sticks(rows: Sequence[WallTrial], border: float) -> Figure:
    """The longest stick of every valid trial, and what makes one a jam.

    Args:
        rows: Trials of all profiles.
        border: Longest stick that is no jam [mm].
    """
    figure = style.canvas(style.WIDTH, 3.6)
    panel = figure.subplots()
    profiles = list(dict.fromkeys(row.profile for row in rows))
    for place, profile in enumerate(profiles):
        valid = [r for r in rows if r.profile == profile and r.outcome != "invalid"]
        apart = place + np.linspace(-0.25, 0.25, len(valid)) if len(valid) > 1 else [place]
        colour, marker, _ = style.PROFILE_LOOKS[profile]
        heights = sorted(row.longest_stick_mm for row in valid)
        panel.plot(apart[: len(valid)], heights, marker, color=colour, markersize=4)
    panel.axhline(border, color=style.INK, linewidth=1.0)
    panel.annotate(
        f"above {border:g} mm: a jam",
        (len(profiles) - 0.45, border),
        (0, 3),
        textcoords="offset points",
        ha="right",
        fontsize=8,
    )
    style.categories(panel, [name.replace("_", "\n") for name in profiles])
    panel.set_yscale("log")
    low, high = panel.get_ylim()
    ticks = [tick for tick in (1, 2, 5, 10, 20, 50, 100, 200) if low <= tick <= high]
    panel.set_yticks(ticks, [str(tick) for tick in ticks])
    panel.yaxis.minorticks_off()
    panel.set_ylabel("longest stick of a trial:\nthe base moves, the tip does not [mm]")
    panel.set_title("The outcome depends on this border; a mark is a trial")
    return figure


def _draw_boulders(panel: Axes, seen: Traverse) -> None:
    """The boulders that the antenna could have reached."""
    from matplotlib.patches import Circle

    along = seen.shapes[..., 1]
    reached = (seen.boulders[:, 1] > along.min()) & (seen.boulders[:, 1] < along.max())
    for x, y, radius in (1e3 * seen.boulders[reached]).tolist():
        panel.add_patch(Circle((x, y), radius, color=style.MUTED, linewidth=0))


@style.styled
def passages(examples: Mapping[str, Traverse]) -> Figure:
    """The first trial of every profile: advance of the tip, and shapes along the wall."""
    figure = style.canvas(style.WIDTH, 2.3 * len(examples))
    panels = figure.subplots(len(examples), 2, squeeze=False, sharex="col", sharey="col")
    for (profile, seen), (advance, along) in zip(examples.items(), panels, strict=True):
        colour = style.PROFILE_LOOKS[profile][0]
        advance.plot(1e3 * seen.base, 1e3 * seen.tip, color=colour)
        end = 1e3 * seen.base[-1]
        advance.plot([0, end], [0, end], color=style.FAINT, zorder=0)
        advance.set(title=profile.replace("_", " "), ylabel="advance of the tip [mm]")
        for shape in seen.shapes:
            along.plot(*(1e3 * shape.T), color=colour, linewidth=1.0)
        _draw_boulders(along, seen)
        along.set_aspect("equal")
        along.set(ylabel="along the wall [mm]")
    for panel, words in zip(
        panels[-1], ("travel of the base [mm]", "from the crests [mm]"), strict=True
    ):
        panel.set_xlabel(words)
    return figure


def _film(config: WallConfig, profile: str, trial: int, watch: Watch) -> str:
    """Run one trial for its film; the title."""
    seen = passage(config, profile, trial, watch)
    outcome = classify(config.wall, config.seed, trial, profile, seen).outcome
    return f"{profile}, trial {trial}: {outcome}"


CAPTIONS = {
    "wall": "Outcomes of the trials of each profile, over the whole travel and after the start.",
    "sticks": "The longest stick of every valid trial, and the border beyond which one is a jam.",
    "passages": "The first trial of each profile: advance of the tip, and shapes of "
    "the antenna along the wall.",
}

EXPERIMENT = Experiment.of_folder(
    *(__name__, WallConfig, run, tables, sentence),
    figures=figures,
    films=bench_films(lambda config: config.profiles, _film, "wall"),
    trials=TRIALS,
    measures=PROFILE,
    shown=True,
    failed=lambda result: any(  # all trials of a profile are invalid
        0 < p["trials"] == p["invalid"] for p in result["profiles"].values()
    ),
    captions=CAPTIONS,
    explained="docs/results.md",
)
