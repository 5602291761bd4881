"""How much of a contact's force does one scalar tell? By statics, and by traverses past a post.

A curve of force over flex is fitted to one half of the loads and tested on the other: one curve for
every place of contact, as if a second sense told where it is, and one curve for all places. Forces
reach up to that which, normal to the tip, turns a hinge by the limit; no load that turns a hinge
farther takes part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from antennate.antenna.statics import (
    Chain,
    about,
    equilibrium,
    largest_force,
    with_profile,
)
from antennate.experiments.bench import between
from antennate.experiments.force.explained import by_group, explained
from antennate.experiments.force.physics import (
    ForceConfig,
    Points,
    Traverse,
    drag,
    static_loads,
    traverse_points,
)
from antennate.experiments.force.result import (
    ClosedForm,
    Curves,
    ForceResult,
    Loads,
    ProfileResult,
    Scalars,
    Statics,
    Told,
    ToldFrom,
    TraverseRow,
    Traverses,
)
from antennate.studies.columns import shown
from antennate.studies.experiment import Experiment
from antennate.studies.pool import Workers, gather
from antennate.studies.tables import Table
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.types import Floats, Ints

SCALARS = ("flex", "reading", "level")
"""Flex without noise, one reading of the converter, and b of the readings of T_avg."""


@dataclass(frozen=True, slots=True)
class ProfileOutcome:
    """What a profile came to: its result, its rows and the points that figures draw."""

    profile: str
    result: ProfileResult
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

    def result(self) -> ForceResult:
        """What they come to."""
        return ForceResult(
            seed=self.config.seed,
            hinge_limit_deg=self.config.hinge_limit_deg,
            from_place=self.config.from_place,
            friction=self.config.antenna.friction,
            profiles={each.profile: each.result for each in self.profiles},
        )


def score(
    points: Points, scalar: str, from_place: float, bins: float | None, largest: float
) -> Told:
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
    return _told(points, np.flatnonzero(test)[np.isfinite(guess)], guess, largest)


def _told(points: Points, which: Ints, guess: Floats, largest: float) -> Told:
    found = explained(points.force[which], guess[np.isfinite(guess)], points.trial[which])
    return Told(**vars(found), rmse_percent=100.0 * found.rmse / largest)


def _scalars(points: Points, config: ForceConfig, bins: float | None, largest: float) -> Scalars:
    return Scalars(
        **{name: score(points, name, config.from_place, bins, largest) for name in SCALARS}
    )


def _curves(points: Points, config: ForceConfig, largest: float) -> Curves:
    """Every scalar, with the place known and unknown."""
    known = _scalars(points, config, config.place_step, largest)
    return Curves(known=known, unknown=_scalars(points, config, None, largest))


def _loads(points: Points, left_out: int, config: ForceConfig, largest: float) -> Loads:
    curves = _curves(points, config, largest)
    return Loads(**vars(curves), loads=len(points.force), left_out=left_out)


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
    result = ProfileResult(
        force_max_n=largest,
        statics=Statics(
            frictionless=_loads(plain, left_out, config, largest),
            friction=_loads(rubbed, also_out, config, largest),
        ),
        by_range=[
            ToldFrom(from_place=place, **vars(score(plain, "flex", place, None, largest)))
            for place in config.places().tolist()
        ],
        traverses=Traverses(
            **vars(_curves(dragged, config, largest)),
            trials=len(rows),
            invalid=sum(row.status == "invalid" for row in rows),
            closed_form=ClosedForm(
                all=_told(dragged, np.arange(len(guess)), guess, largest),
                settled=_told(dragged, np.flatnonzero(settled), guess[settled], largest),
            ),
        ),
    )
    return ProfileOutcome(profile, result, rows, plain, dragged)


def traverse(config: ForceConfig, profile: str, k: int) -> tuple[TraverseRow, Traverse]:
    """The k-th traverse of a profile."""
    antenna, limit = with_profile(config.antenna, profile), math.radians(config.hinge_limit_deg)
    chance = float(np.random.default_rng([config.seed, 1, k]).uniform())
    share = (k + chance) / config.traverses
    overlap = config.from_place + (1.0 - config.from_place) * share
    speed = config.speed(k)
    record = drag(
        config.physics,
        antenna,
        overlap=overlap,
        speed=speed,
        post_radius=config.post_radius,
        limit=limit,
        rate=antenna.sensor.rate,
    )
    row = TraverseRow(
        seed=config.seed,
        trial=k,
        profile=profile,
        status="invalid" if record.reason else "valid",
        overlap=overlap,
        speed_m_s=speed,
        samples=len(record.flex),
        flex_max_rad=float(record.flex.max(initial=0.0)),
        force_max_n=float(record.force.max(initial=0.0)),
        place_last=float(record.place[-1]) if len(record.place) else 0.0,
        reason=record.reason,
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
    """Study every profile."""

    def keep(outcome: ProfileOutcome) -> None:
        for row in outcome.rows:
            on_row(row)

    tasks = [(config, profile) for profile in config.profiles]
    return ForceOutcome(config, gather(study_profile, tasks, workers, on_step, keep))


def tables(result: ForceResult) -> Sequence[Table]:
    """What flex explains, profile by profile."""
    shares = Table.of(
        "Share of the force that flex explains (R2)",
        result.profiles,
        note=f"Places from {result.from_place:g} of the length to the tip, hinges up to "
        f"{result.hinge_limit_deg:g} deg; friction {result.friction:g}.\n"
        "Place known: one curve for every place; unknown: one for all.\n"
        f"Intervals: over loads at rest and over {tested(result)} traverses, which served no fit, "
        "as if their overlaps\nwere drawn at random along the antenna. They are spread evenly: "
        "another seed moves R2 far less.",
        preface=about(result.profiles),
    )
    return (shares,)


def tested(result: ForceResult) -> int:
    """Traverses that the intervals of the dragged antenna are over."""
    return min(profile.traverses.unknown.flex.groups for profile in result.profiles.values())


def sentence(result: ForceResult) -> str:
    """What flex explains at rest for the first profile of the paper."""
    profiles = result.profiles
    name = "descending" if "descending" in profiles else next(iter(profiles))
    rest = profiles[name].statics.frictionless
    known, unknown = rest.known.flex, rest.unknown.flex
    return (
        f"{name}: at rest, flex explains {shown(unknown.r2)} of the force (95 % interval "
        f"{shown(unknown.r2_95)}) where the place is unknown, {shown(known.r2)} "
        f"({shown(known.r2_95)}) where it is known."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    ForceConfig,
    run,
    tables,
    sentence,
    result=ForceResult,
    row=TraverseRow,
    captions={
        "force": "Force over flex, at rest and on the move, and the share of the force "
        "that one reading explains.",
    },
)
