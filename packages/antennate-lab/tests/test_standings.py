"""Standings of a competition: made of rows alone, against closed forms and published figures."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from itertools import product
from math import lcm
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest, wilcoxon

from antennate.studies.columns import content, typed
from antennate.studies.formats import to_json
from antennate.studies.statistics import (
    holm,
    mean95_by_draw,
    sign_flips,
    wilson95,
    wilson95_by_draw,
)
from antennate_lab.compete.checking import read_rows
from antennate_lab.compete.comparison import compared
from antennate_lab.compete.config import CompeteConfig
from antennate_lab.compete.episodes import EpisodeRow
from antennate_lab.compete.experiment import summarise
from antennate_lab.compete.figure import drawn
from antennate_lab.compete.page import apart, markdown, ordered, readme, sentence, tables
from antennate_lab.compete.result import CompeteResult, Standing
from antennate_lab.compete.standings import profiles, standing

LIMIT = 100.0


def rows_of(name: str, times: list[float | None], given: str = "") -> list[EpisodeRow]:
    """Rows of one controller in draws of their own, in two scenes by turns; None is a failure."""
    return [
        EpisodeRow(
            controller=name,
            scene=("uturn", "corner")[k % 2],
            seed=1,
            trial=k,
            outcome="timeout" if time is None else "success",
            time_s=LIMIT if time is None else time,
            progress_m=2.0,
            given=given,
            drawn=True,
        )
        for k, time in enumerate(times)
    ]


def judged(*groups: list[EpisodeRow]) -> CompeteResult:
    return summarise(CompeteConfig(tie=0.01), [row for group in groups for row in group])


@pytest.mark.parametrize(
    ("p", "wanted"),
    [
        ([0.01, 0.04, 0.03, 0.005], [0.03, 0.06, 0.06, 0.02]),
        ([0.4, 0.6], [0.8, 0.8]),
        ([], []),
    ],
)
def test_holm_raises_p_values_as_its_paper_says(p: list[float], wanted: list[float]) -> None:
    """Of 0.005 four times, of 0.01 thrice, of 0.03 twice, and 0.04 no less than that."""
    assert holm(p) == pytest.approx(wanted)


def test_each_way_to_end_is_counted_and_together_they_are_all_episodes() -> None:
    ends = ["success", "timeout", "left", "overturned", "fell", "fell", "invalid"]
    rows = [
        replace(row, outcome=end, overturned=end == "overturned")
        for row, end in zip(rows_of("open", [LIMIT] * 7), ends, strict=True)
    ]
    result = standing(rows, 0.01)
    names = ("successes", "timeouts", "left", "overturned", "fell", "invalid")
    assert [getattr(result.controllers["open"], name) for name in names] == [1, 1, 1, 1, 2, 1]
    shares = (result.controllers["open"], result.scenes["uturn"]["open"])
    assert [each.success_share for each in shares] == [1 / 7, 1 / 4]
    assert "| fell | on its back | INVALID |" in markdown(result)
    assert markdown(result).splitlines()[2].endswith("| 2 | 1 | 1 |")


def test_without_a_valid_episode_no_table_of_dashes_is_shown() -> None:
    rows = [replace(row, outcome="invalid", reason="none") for row in rows_of("closed", [5.0])]
    assert not tables(judged(rows))


def test_a_difference_that_two_processors_make_is_a_tie() -> None:
    """200 and 198 of 200; 197 is beyond it."""
    first = rows_of("a", [10.0] * 200)
    near, far = (rows_of("b", [10.0] * n + [None] * (200 - n)) for n in (198, 197))
    tied, apart = judged(first, near), judged(first, far)
    assert tied.paired["a-b"].tie
    assert [tied.controllers[n].rank for n in "ab"] == [1, 1]
    assert not apart.paired["a-b"].tie
    assert [apart.controllers[n].rank for n in "ab"] == [1, 2]
    assert [apart.controllers[n].rank_95 for n in "ab"] == [(1, 2), (1, 2)]


def test_ranks_and_their_intervals_follow_from_the_tests_of_every_two() -> None:
    """With 40 draws a alone crosses 20 more than b and c each: p is 2 * 0.5^20, thrice that."""
    result = judged(
        rows_of("a", [10.0] * 40),
        rows_of("b", [20.0] * 20 + [None] * 20),
        rows_of("c", [None] * 2 + [20.0] * 19 + [None] * 19),
    )
    cells, pair = result.controllers, result.paired["a-b"]
    assert (pair.only_first, pair.only_second) == (20, 0)
    assert pair.mcnemar_p == pytest.approx(2 * 0.5**20)
    assert pair.mcnemar_holm_p == pytest.approx(2 * 2 * 0.5**20)  # c has 21: it is first
    assert [cells[n].rank for n in "abc"] == [1, 2, 3]
    assert [cells[n].rank_95 for n in "abc"] == [(1, 1), (2, 3), (2, 3)]
    assert cells["b"].wilson95 == wilson95(20, 40)
    assert cells["b"].restricted_mean_share == pytest.approx((20 * 0.2 + 20) / 40)
    assert result.scenes["uturn"]["a"].episodes == 20


def test_scenes_of_one_draw_count_once_in_tests_and_intervals() -> None:
    """The same ends in three conditions of a scene are no more than those of one."""
    times = {"a": [10.0] * 15 + [None] * 5, "b": [None] * 9 + [12.0] * 8 + [None] * 3}
    alone = judged(*([replace(r, scene="uturn") for r in rows_of(n, times[n])] for n in "ab"))
    scenes = ("uturn", "uturn+variation.reading_noise=3", "uturn+readings=delayed:0.02")
    thrice = judged(
        *([replace(r, scene=s) for s in scenes for r in rows_of(n, times[n])] for n in "ab")
    )
    one, pair = alone.paired["a-b"], thrice.paired["a-b"]
    assert (pair.only_first, pair.only_second) == (27, 6)
    assert (pair.episodes, pair.draws, one.draws) == (60, 20, 20)
    assert pair.mcnemar_p == pytest.approx(binomtest(9, 11).pvalue)
    for key in ("mcnemar_p", "wilcoxon_p", "share_difference", "share_difference_95"):
        assert getattr(pair, key) == pytest.approx(getattr(one, key)), key
    cell, same = thrice.controllers["a"], alone.controllers["a"]
    assert cell.wilson95 == pytest.approx(wilson95(15, 20))
    assert thrice.scenes["uturn"]["a"].wilson95 == wilson95(15, 20)
    assert cell.restricted_mean_share == pytest.approx(same.restricted_mean_share)
    assert cell.restricted_mean_share_95 == pytest.approx(same.restricted_mean_share_95)


@pytest.mark.parametrize("seed", range(4))
def test_flips_of_signs_are_those_of_every_choice(seed: int) -> None:
    sums = np.random.default_rng(seed).integers(-4, 5, 11)
    totals = [abs(sums @ signs) for signs in product((-1, 1), repeat=len(sums))]
    assert sign_flips(sums) == pytest.approx(np.mean(np.array(totals) >= abs(sums.sum())))


def test_draws_that_end_alike_tell_as_much_as_one_trial_each() -> None:
    """And draws whose trials have nothing to do with one another as much as all of them."""
    alike, apart = np.tile([0, 4], 10), np.tile([1, 3], 10)
    assert wilson95_by_draw(alike, np.full(20, 4)) == pytest.approx(wilson95(10, 20))
    assert wilson95_by_draw(apart, np.full(20, 4))[0] > wilson95(10, 20)[0]
    assert wilson95_by_draw(np.full(5, 8), np.full(5, 8)) == wilson95(5, 5)
    assert wilson95_by_draw(np.array([6]), np.array([8])) == wilson95(0.75, 1)
    rng = np.random.default_rng(1)
    held = 0
    for _ in range(400):  # a draw's four trials end alike in half of the draws
        own, same = rng.random((2, 40)) < 0.5
        others = np.where(same, 4 * own, own + rng.binomial(3, 0.5, 40))
        low, high = wilson95_by_draw(others, np.full(40, 4))
        held += low <= 0.5 <= high
    assert held >= 0.92 * 400


def test_the_mean_of_draws_of_several_values_has_the_interval_of_draws() -> None:
    values = np.array([3.0, 5.0, 4.0, 8.0, 6.0, 7.0, 9.0])
    alone = np.arange(7) * 2
    for times in (1, 4):  # what a draw brings alike tells as much as once
        mean, ends = mean95_by_draw(np.tile(values, times), np.tile(alone, times), 0.0)
        assert mean == pytest.approx(6.0)
        assert ends == pytest.approx((4.002105, 7.997895))  # 6 ± 2.446912 √(28 / 6 / 7)
    mean, ends = mean95_by_draw(np.full(14, 0.1), np.repeat(np.arange(7), 2), 0.0)
    assert ends is not None
    assert ends[0] <= mean <= ends[1]
    assert mean95_by_draw(values, np.array([0, 0, 0, 1, 1, 2, 2]), 0.0) == (6.0, None)
    rng = np.random.default_rng(2)
    held = 0
    for _ in range(400):  # a draw brings one to four values, which share half of their variance
        counts = rng.integers(1, 5, 40)
        draw = np.repeat(np.arange(40), counts)
        _, ends = mean95_by_draw(
            10.0 + rng.normal(size=40)[draw] + rng.normal(size=len(draw)), draw, 0.0
        )
        assert ends is not None
        held += ends[0] <= 10.0 <= ends[1]
    assert 0.92 * 400 <= held <= 0.98 * 400


def test_times_of_the_board_are_ranked_as_fractions_have_them() -> None:
    """Means of the shares of each draw, in exact fractions, and of these SciPy's Pratt."""
    rows = read_rows(Path(__file__).parents[3] / "docs" / "leaderboard.csv")
    names = ("follow", "centre")
    draws: dict[tuple[int, int], dict[str, list[Fraction]]] = {}
    for row in (row for row in rows if row.controller in names):
        share = Fraction(str(row.time_s)) / Fraction(str(row.limit_s))
        share = share if row.outcome == "success" else Fraction(1)
        draws.setdefault((row.seed, row.trial), {n: [] for n in names})[row.controller] += [share]
    means = [Fraction(sum(d[names[0]]) - sum(d[names[1]]), 8) for d in draws.values()]
    whole = lcm(*(mean.denominator for mean in means))
    ticks = np.array([int(mean * whole) for mean in means])
    test = wilcoxon(ticks, zero_method="pratt", method="asymptotic", correction=False)
    pairs = standing([row for row in rows if row.controller in names], 0.015).paired
    p = pairs["follow-centre"].wilcoxon_p
    assert p == pytest.approx(np.asarray(test)[1], rel=1e-9) == pytest.approx(0.036265, abs=1e-6)


def test_who_is_told_apart_is_said() -> None:
    """Nine draws that one alone crosses, and none the other: p = 2 / 2^9."""
    better = rows_of("a", [10.0] * 9)
    said = apart(judged(rows_of("b", [None] * 9), better, rows_of("c", [40.0] * 9)))
    crossed, faster = said.split("\n\n")
    assert crossed.endswith("5 %: `a` before `b`; `c` before `b`.")
    assert faster.endswith("5 %: `a` before `b`, `c`; `c` before `b`.")
    same = apart(judged(better, rows_of("b", [None] + [10.0] * 8)))
    assert same.count("nobody from nobody.") == 2


def test_a_result_is_read_back_as_it_was_written() -> None:
    """With a table of which one row differs, too."""
    rows = [*rows_of("a", [10.0, None] * 4), *rows_of("map", [5.0] * 8, given="jam map")]
    check = compared([replace(rows[0], time_s=9.0), *rows[1:]], rows)
    result = standing(rows, 0.01, check)
    assert [row.differences for row in check.differ] == [[("time_s", 9.0, 10.0)]]
    assert typed(Standing, json.loads(to_json(content(result)))) == result


def test_who_is_given_more_stands_outside_the_ranking() -> None:
    result = judged(rows_of("a", [10.0] * 6), rows_of("map", [5.0] * 6, given="jam map"))
    assert result.controllers["map"].rank is None
    assert result.controllers["a"].rank_95 == (1, 1)
    assert result.paired == {}
    assert ordered(result) == ["a", "map"]
    assert "| `map` | not ranked |" in markdown(result)
    assert "map" not in sentence(result)
    _, shares = profiles([*rows_of("a", [10.0] * 6), *rows_of("map", [5.0] * 6, "jam map")])
    assert shares.keys() == {"a"}
    assert shares["a"][0] == 1.0


def test_a_profile_tells_how_many_draws_are_crossed_within_a_factor_of_the_fastest() -> None:
    """Ratios of a: 1, 2, inf, nobody; of b: 3, 1, 1, nobody."""
    factors, shares = profiles(
        [*rows_of("a", [10.0, 40.0, None, None]), *rows_of("b", [30.0, 20.0, 50.0, None])]
    )
    at = {x: int(np.argmin(np.abs(factors - x))) for x in (1.0, 1.9, 2.0, 2.9, 3.0, 10.0)}
    assert [shares["a"][i] for i in at.values()] == [0.25, 0.25, 0.5, 0.5, 0.5, 0.5]
    assert [shares["b"][i] for i in at.values()] == [0.5, 0.5, 0.5, 0.5, 0.75, 0.75]


def test_random_rows_rank_alike_in_any_order() -> None:
    rng = np.random.default_rng(3)
    times = {n: [float(t) if t < 90 else None for t in rng.uniform(5, 120, 30)] for n in "abcd"}
    one = judged(*(rows_of(n, times[n]) for n in "abcd"))
    other = judged(*(rows_of(n, times[n]) for n in "dbca"))
    for name, key in product("abcd", ("rank", "rank_95", "successes", "restricted_mean_share")):
        first, second = (getattr(each.controllers[name], key) for each in (one, other))
        assert first == second


def test_tables_page_and_figures_show_every_controller_and_scene() -> None:
    rows = [*rows_of("open", [10.0, None] * 4), *rows_of("closed", [20.0] * 8)]
    result = judged(rows)
    text = readme(result, rows)
    assert "hidden seed 1" in text
    for shown in (*(table.columns for table in tables(result)[:2]),):
        assert list(shown) == ["closed", "open"]
    assert [name for name, _ in tables(result)[1].rows] == ["uturn", "corner"]
    pairs = tables(result)[2]
    assert [*pairs.columns[:4]] == [
        "only first",
        "only second",
        "McNemar p",
        "time apart [% of limit]",
    ]
    assert [*pairs.columns[4:]] == ["95 %", "Wilcoxon p"]
    ((names, cells),) = pairs.rows  # p is 2 / 2^4, and time (4 * 0.8 - 4 * 0.1) / 8 apart
    assert (names, cells[:4]) == ("open and closed", ["0", "4", "0.12", "+35.0"])
    figures = drawn(result, rows)
    assert list(figures) == ["ranks", "scenes", "profiles"]
    ticks = {t.get_text() for panel in figures["scenes"].axes for t in panel.get_yticklabels()}
    assert ticks == {"uturn", "corner"}
    assert drawn(result, []) == {}
