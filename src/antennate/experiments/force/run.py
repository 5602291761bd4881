"""How much of a contact's force does one scalar tell? By statics, and by traverses past a post.

A curve of force over flex is fitted to one half of the loads and tested on the other: one curve for
every place of contact, as if a second sense told where it is, and one curve for all places. Forces
reach up to that which, normal to the tip, turns a hinge by the limit; no load that turns a hinge
farther takes part.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from antennate.antenna.statics import Chain, equilibrium, with_profile
from antennate.experiments.bench import between
from antennate.experiments.force.loads import (
    ForceConfig,
    Points,
    largest_force,
    static_loads,
    traverse_points,
)
from antennate.experiments.force.post_traverse import Traverse, drag
from antennate.sim.bench import Watch
from antennate.studies.experiment import OnRow, OnStep, no_row, no_step
from antennate.studies.pool import Workers, gather
from antennate.studies.regression import by_group, explained
from antennate.types import Floats, Ints

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
    rows, traverses = _traverse_all(config, profile)
    dragged = traverse_points(config, traverses)
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


def _traverse_all(config: ForceConfig, profile: str) -> tuple[list[TraverseRow], list[Traverse]]:
    found = [traverse(config, profile, k) for k in range(config.traverses)]
    return [row for row, _ in found], [one for _, one in found]


def traverse(
    config: ForceConfig, profile: str, k: int, watch: Watch | None = None
) -> tuple[TraverseRow, Traverse]:
    """The k-th traverse of a profile; `watch` looks at the bench after each physics step."""
    antenna, limit = with_profile(config.antenna, profile), math.radians(config.hinge_limit_deg)
    chance = float(np.random.default_rng([config.seed, 1, k]).uniform())
    share = (k + chance) / config.traverses
    overlap = config.from_place + (1.0 - config.from_place) * share
    speed = config.speed(k)
    one = drag(
        config.physics,
        *(antenna, overlap, speed, config.post_radius, limit, antenna.sensor.rate),
        watch,
    )
    row = TraverseRow(
        config.seed,
        k,
        profile,
        "invalid" if one.reason else "valid",
        overlap,
        speed,
        len(one.flex),
        float(one.flex.max(initial=0.0)),
        float(one.force.max(initial=0.0)),
        float(one.place[-1]) if len(one.place) else 0.0,
        one.reason,
    )
    return row, one


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
