"""How much of a contact's force does one scalar tell? By statics, and by traverses past a post.

A curve of force over flex is fitted to one half of the loads and tested on the other: one curve for
every place of contact, as if a second sense told where it is, and one curve for all places. Forces
reach up to that which, normal to the tip, turns a hinge by the limit; no load that turns a hinge
farther takes part.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna.statics import Chain, about, equilibrium, with_profile
from antennate.experiments.bench import bench_films, between
from antennate.experiments.force.explained import by_group, explained
from antennate.experiments.force.physics import (
    ForceConfig,
    Points,
    Traverse,
    drag,
    largest_force,
    static_loads,
    traverse_points,
)
from antennate.sim.bench import Watch
from antennate.studies.experiment import Experiment, OnRow, OnStep, no_row, no_step
from antennate.studies.measures import Measure, Table, shown
from antennate.studies.pool import Workers, gather
from antennate.types import Floats, Ints

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure

SCALARS = ("flex", "reading", "level")
"""Flex without noise, one reading of the converter, and b of the readings of T_avg."""


@dataclass(frozen=True, slots=True)
class TraverseRow:
    """One traverse, a row of trials.csv."""

    seed: int
    trial: int
    profile: str
    status: str
    overlap: float
    speed_m_s: float
    samples: int
    flex_max_rad: float
    force_max_n: float
    place_last: float
    reason: str


@dataclass(frozen=True, slots=True)
class ProfileOutcome:
    """What one profile came to: its summary, its rows and the points that figures draw."""

    profile: str
    summary: dict[str, Any]
    rows: list[TraverseRow]
    statics: Points
    traverses: Points


@dataclass(frozen=True, slots=True)
class ForceOutcome:
    """All profiles in the order of the configuration."""

    config: ForceConfig
    profiles: list[ProfileOutcome]

    @property
    def rows(self) -> list[TraverseRow]:
        """Every traverse."""
        return [row for profile in self.profiles for row in profile.rows]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "schema": 1,
            "command": "force",
            "seed": self.config.seed,
            "hinge_limit_deg": self.config.hinge_limit_deg,
            "from_place": self.config.from_place,
            "friction": self.config.antenna.friction,
            "profiles": {p.profile: p.summary for p in self.profiles},
        }


def score(
    points: Points, scalar: str, from_place: float, bins: float | None, largest: float
) -> dict[str, Any]:
    """How much of the force a scalar explains: one curve, or one for every `bins` of the length."""
    within = points.place >= from_place - 1e-9
    fit, test = within & points.fit, within & ~points.fit
    x, force = points.scalars[scalar], points.force
    group = np.zeros(len(force), np.int64)
    if bins is not None:
        group = np.floor(points.place / bins + 1e-6).astype(np.int64)
    guess = by_group(
        (x[fit], force[fit], group[fit]), x[test], group[test], falling=scalar == "reading"
    )
    return _row(points, np.flatnonzero(test)[np.isfinite(guess)], guess, largest)


def _row(points: Points, which: Ints, guess: Floats, largest: float) -> dict[str, Any]:
    guess = guess[np.isfinite(guess)]
    row = asdict(explained(points.force[which], guess, points.trial[which]))
    return row | {"rmse_percent": 100.0 * row["rmse"] / largest}


def _score_all(points: Points, config: ForceConfig, largest: float) -> dict[str, Any]:
    """Every scalar, with the place known and unknown."""
    known = {"known": config.place_step, "unknown": None}
    return {
        name: {s: score(points, s, config.from_place, bins, largest) for s in SCALARS}
        for name, bins in known.items()
    }


def study_profile(config: ForceConfig, profile: str) -> ProfileOutcome:
    """Statics and traverses of one profile."""
    antenna = with_profile(config.antenna, profile)
    chain, limit = Chain.of(antenna), math.radians(config.hinge_limit_deg)
    largest = largest_force(chain, limit)
    plain, left_out = static_loads(config, profile, 0.0, largest)
    rubbed, also_out = static_loads(config, profile, config.antenna.friction, largest)
    trials = [traverse(config, profile, k) for k in range(config.traverses)]
    rows, dragged = [row for row, _ in trials], traverse_points(config, [t for _, t in trials])
    guess = closed_form(chain, dragged, config, largest)
    settled = dragged.age >= config.conditioning.averaging_time
    summary = {
        "force_max_n": largest,
        "statics": {
            name: {"loads": len(points.force), "left_out": out}
            | _score_all(points, config, largest)
            for name, points, out in (
                ("frictionless", plain, left_out),
                ("friction", rubbed, also_out),
            )
        },
        "by_range": [
            {"from_place": float(place)} | score(plain, "flex", place, None, largest)
            for place in config.places()
        ],
        "traverses": {
            "trials": len(rows),
            "invalid": sum(row.status == "invalid" for row in rows),
            **_score_all(dragged, config, largest),
            "closed_form": {
                name: _row(dragged, np.flatnonzero(which), guess[which], largest)
                for name, which in (("all", settled | True), ("settled", settled))
            },
        },
    }
    return ProfileOutcome(profile, summary, rows, plain, dragged)


def traverse(
    config: ForceConfig, profile: str, k: int, watch: Watch | None = None
) -> tuple[TraverseRow, Traverse]:
    """The k-th traverse of a profile; `watch` looks at the bench after each physics step."""
    antenna, limit = with_profile(config.antenna, profile), math.radians(config.hinge_limit_deg)
    chance = float(np.random.default_rng([config.seed, 1, k]).uniform())
    share = (k + chance) / config.traverses
    overlap = config.from_place + (1.0 - config.from_place) * share
    speed = config.speed(k)
    record = drag(
        config.physics,
        *(antenna, overlap, speed, config.post_radius, limit, antenna.sensor.rate),
        watch,
    )
    row = TraverseRow(
        config.seed,
        k,
        profile,
        "invalid" if record.reason else "valid",
        overlap,
        speed,
        len(record.flex),
        float(record.flex.max(initial=0.0)),
        float(record.force.max(initial=0.0)),
        float(record.place[-1]) if len(record.place) else 0.0,
        record.reason,
    )
    return row, record


def closed_form(chain: Chain, points: Points, config: ForceConfig, largest: float) -> Floats:
    """Force from flex and place by the frictionless statics alone, nothing fitted [N]."""
    flex, place = points.scalars["flex"], np.clip(points.place, config.nearest, 1.0)
    grid = np.linspace(config.nearest, 1.0, 39)
    sizes = np.linspace(0.0, 2.0 * largest, 41)
    force = np.stack([np.zeros_like(sizes), sizes], axis=1)
    covered = config.antenna.sensed_hinges
    tables = []
    for at in grid:
        rest = equilibrium(chain, np.full(len(sizes), at * chain.length), force, follower=True)
        tables.append(np.interp(flex, rest.angles[:, :covered].sum(axis=1), sizes))
    return between(grid, np.array(tables), place)


def run(
    config: ForceConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> ForceOutcome:
    """Study every profile.

    Raises:
        WorkerError: A worker process died.
    """

    def keep(outcome: ProfileOutcome) -> None:
        for row in outcome.rows:
            on_row(row)

    tasks = [(config, profile) for profile in config.profiles]
    return ForceOutcome(config, gather(study_profile, tasks, workers, on_step, keep))


PARTS = {
    "at rest": "statics.frictionless",
    "with friction": "statics.friction",
    "dragged": "traverses",
}
"""Where a result holds each part."""
MEASURES = (
    Measure("force_max_n", "largest force", "N", form=".4f"),
    *(
        Measure(f"{path}.{place}.flex.r2", f"{name}, place {place}", interval="r2_95")
        for name, path in PARTS.items()
        for place in ("known", "unknown")
    ),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """What flex explains, profile by profile."""
    shares = Table.of(
        "Share of the force that flex explains (R2)",
        result["profiles"],
        MEASURES,
        f"Places from {result['from_place']:g} of the length to the tip, hinges up to "
        f"{result['hinge_limit_deg']:g} deg; friction {result['friction']:g}.\n"
        "Place known: one curve for every place; unknown: one for all.\n"
        f"Intervals: over loads at rest and over {tested(result)} traverses, which served no fit, "
        "as if their overlaps\nwere drawn at random along the antenna. They are spread evenly: "
        "another seed moves R2 far less.",
        about(result["profiles"]),
    )
    return (shares,)


def tested(result: Mapping[str, Any]) -> int:
    """Traverses that the intervals of the dragged antenna are over."""
    rows = (profile["traverses"]["unknown"]["flex"] for profile in result["profiles"].values())
    return min(row["groups"] for row in rows)


def sentence(result: Mapping[str, Any]) -> str:
    """What flex explains at rest for the first profile of the paper."""
    profiles = result["profiles"]
    name = "descending" if "descending" in profiles else next(iter(profiles))
    rest = profiles[name]["statics"]["frictionless"]
    known, unknown = (rest[place]["flex"] for place in ("known", "unknown"))
    return (
        f"{name}: at rest, flex explains {shown(unknown['r2'])} of the force (95 % interval "
        f"{shown(unknown['r2_95'])}) where the place is unknown, {shown(known['r2'])} "
        f"({shown(known['r2_95'])}) where it is known."
    )


@style.styled
def figures(outcome: ForceOutcome) -> dict[str, Figure]:
    """Force over flex at rest and on the move, and the share of force explained.

    The points are those of `descending`, or of the first profile.
    """
    from matplotlib import cm, colors

    figure, result, profiles = style.canvas(style.WIDTH, 12.0), outcome.result(), outcome.profiles
    rest, move, ranges, shares = figure.subplots(4, 1)
    example = next((p for p in profiles if p.profile == "descending"), profiles[0])
    scale = cm.ScalarMappable(colors.Normalize(result["from_place"], 1.0), "viridis")
    moved = result["profiles"][example.profile]["traverses"]["trials"]
    title = f"{example.profile}: at rest, normal to the link"
    _scatter(rest, example.statics, scale, result, title)
    _scatter(move, example.traverses, scale, result, f"Dragged past a post, {moved} traverses")
    label = "place of contact / length"
    figure.colorbar(scale, ax=[rest, move], label=label, **style.above(figure))
    _draw_ranges(ranges, result)
    _draw_shares(shares, result)
    return {"force": figure}


def _scatter(
    panel: Axes, points: Points, scale: ScalarMappable, result: Mapping[str, Any], title: str
) -> None:
    within = points.place >= result["from_place"] - 1e-9
    panel.scatter(
        np.degrees(points.scalars["flex"][within]),
        points.force[within],
        c=scale.to_rgba(points.place[within]),
        s=7,
        linewidths=0,
        rasterized=True,
    )
    panel.set(
        xlabel="flex under the flex sensor [deg]",
        ylabel="contact force [N]",
        title=f"{title}\n(n = {within.sum()})",
        xlim=(0, None),
        ylim=(0, None),
    )


def _draw_ranges(panel: Axes, result: Mapping[str, Any]) -> None:
    for name, profile in result["profiles"].items():
        rows = profile["by_range"]
        place = [row["from_place"] for row in rows]
        low, high = np.array([row["r2_95"] for row in rows]).T
        colour = style.PROFILE_LOOKS[name][0]
        panel.fill_between(place, low, high, color=colour, alpha=0.12, linewidth=0)
        panel.plot(place, [row["r2"] for row in rows], color=colour, label=name.replace("_", " "))
    panel.axvline(result["from_place"], color=style.MUTED, linewidth=1, linestyle=(0, (4, 2)))
    panel.set(
        xlabel="nearest place where the contact may be / length",
        ylabel="R² of force, place unknown",
        title="One curve for all places\nfrom there to the tip, at rest",
        ylim=(0, 1.02),
    )
    panel.legend(loc="lower right")


def _draw_shares(panel: Axes, result: Mapping[str, Any]) -> None:
    profiles = result["profiles"]
    parts = (("at rest", style.INK), ("dragged", style.SERIES[5]))
    places = (("known", "o"), ("unknown", "s"))
    trials = tested(result)
    for k, ((part, colour), (place, marker)) in enumerate(product(parts, places)):
        known = Measure(f"{PARTS[part]}.{place}.flex", f"{part}, place {place}")
        style.intervals(
            panel,
            [i + 0.18 * (k - 1.5) for i in range(len(profiles))],
            [known.value(row) for row in profiles.values()],
            ("r2", "r2_95"),
            trials,
            marker=marker,
            color=colour,
            label=known.label,
            markerfacecolor=colour if place == "known" else "white",
        )
    style.categories(panel, [name.replace("_", "\n") for name in profiles])
    panel.set(
        ylabel="R² of force",
        title=f"Share of force that flex explains\n({style.interval_note(trials)})",
    )
    bottom, top = panel.get_ylim()
    panel.set_ylim(min(bottom, 0.0), top + 0.35)
    panel.set_yticks([0.2 * step for step in range(6)])
    panel.legend(loc="upper left", ncols=2, fontsize=8)


_SPEED = 0.25
"""Speed of the film over that of the base: a picture for each sample at 100 Hz."""


def _film(config: ForceConfig, profile: str, trial: int, watch: Watch) -> str:
    """Drag the antenna past the post for a film, the middle traverse; the title."""
    row, _ = traverse(config, profile, config.traverses // 2, watch)
    invalid = f": {row.status}" if row.reason else ""
    return f"{profile}, {1 / _SPEED:g} times slower{invalid}"


EXPERIMENT = Experiment.of_folder(
    *(__name__, ForceConfig, run, tables, sentence),
    figures=figures,
    films=bench_films(lambda config: config.profiles, _film, "post", _SPEED),
    parts="profiles",
    captions={
        "force": "Force over flex, at rest and on the move, and the share of the force "
        "that one reading explains.",
    },
    explained="docs/results.md",
)
