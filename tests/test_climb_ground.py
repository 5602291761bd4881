"""Other grounds of `antennate climb`: words, criteria, measures, and robots that walk there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from antennate.control.climbing.rule import Ground, Stage
from antennate.experiments.climb.config import (
    Cell,
    ClimbConfig,
    cells,
    config_of,
    limit_of,
    seed_of,
)
from antennate.experiments.climb.criterion import AFTER, Criterion
from antennate.experiments.climb.measures import ratio95, summarise, walks
from antennate.experiments.climb.physics import carry_out
from antennate.experiments.climb.rows import ClimbRow
from antennate.experiments.climb.sensing import Verdict
from antennate.experiments.climb.tables import ground_tables
from antennate.sim.trial import draw_trial, scene_of
from antennate.studies.pooling import frame

WORDS = (
    "flat",
    "gap:0.1",
    "gap:0.3",
    "step_down:0.1",
    "stairs:0.08",
    "ramp:20",
    "step_tunnel:0.08",
)


def cells_of(**values: Any) -> tuple[ClimbConfig, dict[str, Cell]]:
    """A run of the condition `level` on some grounds, and its cells by ground."""
    values = {"heights": (0.05,), "conditions": ("level",), "divisors": (256.0,), **values}
    config = ClimbConfig(**{"sensing": 0, **values})
    return config, {cell.ground: cell for cell in cells(config).values() if cell.part == "ground"}


def test_each_ground_has_its_size_its_limit_and_draws_of_its_own() -> None:
    config, by_ground = cells_of(grounds=WORDS)
    assert tuple(by_ground) == WORDS
    sizes = {word: config_of(config, cell).ground for word, cell in by_ground.items()}
    assert (sizes["gap:0.3"].width, sizes["step_down:0.1"].height) == (0.3, 0.1)
    assert (sizes["stairs:0.08"].height, sizes["stairs:0.08"].tread) == (0.08, 0.3)
    assert (sizes["ramp:20"].slope, sizes["step_tunnel:0.08"].height) == (20.0, 0.08)
    limits = [limit_of(config, cell) for cell in by_ground.values()]
    assert limits == [20.0, 60.0, 60.0, 60.0, 120.0, 60.0, 120.0]
    seeds = {seed_of(config, cell) for cell in cells(config).values()}
    assert len(seeds) == len(WORDS) + 1


def placed(word: str, x: float, z: float) -> tuple[Any, Any, Criterion]:
    """A robot at phase 0 whose tail is x past the last edge and that stands at a height z [m]."""
    config, by_ground = cells_of(grounds=(word,))
    one = config_of(config, by_ground[word])
    start = draw_trial(one, scene_of(one), 0, one.control.gait, one.control.period)
    world, robot = start.world, one.robot
    scene: Any = start.scene
    head = scene.edges[-1].x + x + (robot.links - 1) * robot.link_pitch
    legs, higher = np.zeros((robot.links, 2)), z - scene.ground
    world.place(head, 0.0, 0.0, np.zeros(robot.yaw_count), legs, higher)
    return world, scene, Criterion(by_ground[word], start.episode(60.0), robot.link_pitch)


@pytest.mark.parametrize(
    ("word", "landing"),
    [("gap:0.2", 0.35), ("step_down:0.1", 0.0), ("stairs:0.08", 0.24), ("ramp:20", 0.1)],
)
def test_a_ground_is_crossed_when_all_links_stand_behind_it_at_its_height(
    word: str, landing: float
) -> None:
    for x, outcome in [(0.13, "success"), (0.11, None), (-1.2, None)]:
        world, _, criterion = placed(word, x, landing)
        assert criterion.look(world, world.link_places(), Verdict()) == outcome
    world, _, criterion = placed(word, 0.13, landing - 0.1)  # as far, but too low
    assert criterion.look(world, world.link_places(), Verdict()) is None


def verdict_at(t: float, ground: Ground) -> Verdict:
    """Something that was felt at t [s] and told a second later."""
    verdict = Verdict()
    verdict.look(Stage.PROBE_DOWN, Ground.FLOOR, 0.0, t)
    verdict.look(Stage.BACK, ground, -0.3, t + 1.0)
    return verdict


@pytest.mark.parametrize(
    ("x", "ground", "waited", "outcome"),
    [
        (-1.2, Ground.DROP, AFTER + 1.0, "stopped"),
        (-1.2, Ground.DROP, AFTER - 1.0, None),
        (-1.2, Ground.STEP_UP, AFTER + 1.0, None),
        (-0.5, Ground.DROP, AFTER + 1.0, None),  # its head is over the gap
    ],
)
def test_who_stands_before_a_gap_that_was_felt_long_ago_has_stopped(
    x: float, ground: Ground, waited: float, outcome: str | None
) -> None:
    world, _, criterion = placed("gap:0.3", x, 0.35)
    felt = verdict_at(world.t - waited, ground)
    assert criterion.look(world, world.link_places(), felt) == outcome


def test_one_link_deep_in_a_gap_is_a_fall() -> None:
    world, scene, criterion = placed("gap:0.3", -0.5, 0.35)
    links = world.link_places()
    links[0, 2] = scene.ground - 0.17
    assert criterion.look(world, links, Verdict()) is None
    links[0, 2] = scene.ground - 0.18
    assert criterion.look(world, links, Verdict()) == "fell"


def row(condition: str, ground: str, outcome: str, trial: int = 0, **more: Any) -> ClimbRow:
    """A crossing by hand."""
    place: dict[str, Any] = {"part": "ground", "ground": ground, "height_m": None, "divisor": 256.0}
    place |= {"seed": 0, "cell": condition, "trial": trial, "condition": condition}
    return ClimbRow(**place, outcome=outcome, time_s=9.0, **more)


def test_crossings_of_rows_by_hand() -> None:
    config, _ = cells_of(grounds=("gap:0.1", "gap:0.3"), conditions=("level", "climb"))
    rows = [
        row("level", "gap:0.1", "success", 0),
        row("level", "gap:0.1", "fell", 1),
        row("level", "gap:0.3", "fell", 0),
        row("level", "gap:0.3", "invalid", 1, reason="why"),
        row("climb", "gap:0.1", "success", 0),
        row("climb", "gap:0.1", "success", 1),
        row("climb", "gap:0.3", "stopped", 0),
        row("climb", "gap:0.3", "stopped", 1),
    ]
    result = summarise(config, frame(rows))
    (entry,) = result.grounds
    near, far = entry.grounds["level"]
    assert (near.successes, near.fell, near.success_share) == (1, 1, 0.5)
    assert (far.fell, far.invalid, far.first_reason) == (1, 1, "why")
    assert [each.stopped for each in entry.grounds["climb"]] == [0, 2]
    pair = entry.pairs["gap"]["level"]
    assert (pair.trials, pair.only_climb, pair.only_other) == (3, 1, 0)
    assert entry.flat is None
    crossed, ended, *_ = ground_tables(result)
    assert [name for name, _ in crossed.rows] == ["gap of 10 cm", "gap of 30 cm"]
    assert ended.rows[1][1] == ["1 fell, 1 invalid", "2 stopped"]


def test_a_ratio_of_speeds_is_that_of_paired_trials_and_has_its_interval() -> None:
    """Ratios turn into their inverse, and their interval with them, when two are swapped."""
    rng = np.random.default_rng(0)
    base = 0.2 + 0.02 * rng.standard_normal(12)
    speeds = {"level": base, "climb": 0.99 * base + 0.001 * rng.standard_normal(12)}
    rows = {
        name: frame(row(name, "flat", "walked", k, speed_m_s=v) for k, v in enumerate(values))
        for name, values in speeds.items()
    }
    flat = walks(rows)
    assert flat["level"].ratio == 1.0
    climb = flat["climb"]
    assert climb.ratio == pytest.approx(speeds["climb"].mean() / base.mean())
    assert climb.ratio is not None
    assert climb.ratio_95 is not None
    low, high = climb.ratio_95
    assert 0.98 < low < climb.ratio < high < 1.0
    _, turned = ratio95(np.column_stack([base, speeds["climb"]]))
    assert turned == pytest.approx((1 / high, 1 / low))
    assert walks({name: some[:4] for name, some in rows.items()})["climb"].ratio_95 is None


@pytest.mark.slow
def test_a_robot_that_feels_nothing_crosses_what_is_small_and_falls_into_what_is_wide() -> None:
    config, by_ground = cells_of(grounds=("gap:0.05", "gap:0.5", "step_down:0.05", "flat"))
    ended: list[ClimbRow] = []
    for cell in by_ground.values():
        carry_out(config, cell.name, [0], lambda item: ended.append(item[0]))
    assert [r.outcome for r in ended] == ["success", "fell", "success", "walked"]
    assert ended[-1].speed_m_s == pytest.approx(0.22, abs=0.03)  # a robot in the plane: 0.23 m/s
