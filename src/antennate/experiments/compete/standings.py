"""Who stands where: each controller, each in each scene, every two, and ranks with intervals.

Every number is made of rows alone, and a row that is INVALID is a failure. A rank is one more than
how many others succeed more often by more than a tie. Its interval follows from tests of every two
with Holm's correction: from one more than how many are surely better, to one for each that is not
surely worse. All these intervals together hold all true ranks with 95 % (Mogstad, Romano, Shaikh
and Wilhelm 2024, Review of Economic Studies 91, 476-518).

A draw is a seed and the number of a trial. Scenes share it: a condition of a scene is the same
tunnel, and a robot that feels nothing walks alike in all of them. So over several scenes a draw
counts once, in tests and in intervals. The test of successes is McNemar's, exact, by draws
(`statistics.sign_flips`): had two controllers changed places in a draw, they had in all its scenes.
Where a controller is better in one scene and worse in another it errs on the safe side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from antennate.experiments.compete.episodes import Episode, restricted
from antennate.studies import statistics
from antennate.studies.measures import Measure, count, summarise, total
from antennate.types import Floats, Ints

ALPHA = 0.05
CONTROLLER = (
    Measure("rank", "rank", form="d"),
    Measure("rank_95", "  95 %", form=".0f"),
    Measure("episodes", "episodes", form="d"),
    Measure("successes", "successes", of=count("outcome", "success"), form="d"),
    Measure("success_share", "  share", "%", form=".0f", scale=100.0),
    Measure("wilson95", "  Wilson 95 %", "%", form=".0f", scale=100.0),
    Measure(
        *("restricted_mean_share", "restricted mean time", "% of limit"),
        form=".1f",
        scale=100.0,
        interval="restricted_mean_share_95",
    ),
    Measure("speed_m_s", "speed over successes", "m/s", form=".3f", interval="speed_95"),
    Measure("timeouts", "out of time", of=count("outcome", "timeout"), form="d"),
    Measure("left", "left the scene", of=count("outcome", "left"), form="d"),
    Measure("fell", "fell", of=count("outcome", "fell"), form="d"),
    Measure("overturned", "on its back at the end", of=total, form="d"),
    Measure("invalid", "INVALID", of=count("outcome", "invalid"), form="d"),
)
PAIR = (
    Measure("only_first", "only first", form="d"),
    Measure("only_second", "only second", form="d"),
    Measure("mcnemar_holm_p", "McNemar p", form=".2g"),
    Measure(
        *("share_difference", "time apart", "% of limit"),
        form="+.1f",
        scale=100.0,
        interval="share_difference_95",
    ),
    Measure("wilcoxon_holm_p", "Wilcoxon p", form=".2g"),
)

Rows = Sequence[Episode]
Key = tuple[str, int, int]
"""Scene, seed and trial of a draw."""


def standings(rows: Rows, tie: float) -> dict[str, Any]:
    """All that is told of these rows.

    Args:
        rows: All episodes.
        tie: Largest difference of success shares that is none.
    """
    by_name = {name: [r for r in rows if r.controller == name] for name in names_of(rows)}
    ranked = [name for name, own in by_name.items() if not any(row.given for row in own)]
    controllers = {name: _controller(own) for name, own in by_name.items()}
    pairs = _pairs({name: by_name[name] for name in ranked}, tie)
    for name in ranked:
        controllers[name] |= _rank(name, ranked, pairs)
    scenes = dict.fromkeys(row.scene for row in rows)
    return {
        "controllers": controllers,
        "scenes": {
            scene: {
                name: _cell([row for row in own if row.scene == scene])
                for name, own in by_name.items()
            }
            for scene in scenes
        },
        "paired": {f"{first}-{second}": pair for (first, second), pair in pairs.items()},
    }


def none_valid(result: Mapping[str, Any]) -> dict[str, str]:
    """Controllers of which every episode is INVALID, and why the first one is."""
    return {
        name: row["first_reason"]
        for name, row in result["controllers"].items()
        if row["episodes"] and row["invalid"] == row["episodes"]
    }


def names_of(rows: Rows) -> list[str]:
    """The controllers of these rows, in their order."""
    return list(dict.fromkeys(row.controller for row in rows))


def _cell(rows: Rows) -> dict[str, Any]:
    """One controller in one scene; all None without rows."""
    won = sum(row.outcome == "success" for row in rows)
    share, ends = statistics.mean95(np.array(restricted(rows)), 0.0, 1.0, restricted=True)
    return {
        "episodes": len(rows),
        "successes": won,
        "success_share": won / len(rows) if rows else None,
        "wilson95": statistics.wilson95(won, len(rows)) if rows else None,
        "restricted_mean_share": share if rows else None,
        "restricted_mean_share_95": ends,
    }


def _controller(rows: Rows) -> dict[str, Any]:
    """One controller over all scenes, whose draws count once each."""
    draw = _draws([_key(row) for row in rows])
    won = np.array([row.outcome == "success" for row in rows])
    times = _by_draw(draw, np.array(restricted(rows)))
    share, share_ends = statistics.mean95(times, 0.0, 1.0, restricted=True)
    speeds = [row.progress_m / row.time_s for row in rows if row.outcome == "success"]
    speed, ends = statistics.mean95_by_draw(np.array(speeds), draw[won], 0.0)
    given = next((row.given for row in rows if row.given), "")
    return {
        "given": given,
        "rank": None,
        "rank_95": None,
        **_cell(rows),
        "wilson95": statistics.wilson95_by_draw(
            np.bincount(draw, weights=won).round().astype(int), np.bincount(draw)
        ),
        "restricted_mean_share": share,
        "restricted_mean_share_95": share_ends,
        **summarise(CONTROLLER, rows),
        "void_decisions": total("void_decisions", rows),
        "speed_m_s": speed if speeds else None,
        "speed_95": ends,
        "first_reason": next((row.reason for row in rows if row.reason), None),
    }


def _key(row: Episode) -> Key:
    return row.scene, row.seed, row.trial


def _draws(keys: Sequence[Key]) -> Ints:
    """The number of the draw that each of these is of, from 0, shape (n,)."""
    numbers: dict[tuple[int, int], int] = {}
    return np.array([numbers.setdefault(key[1:], len(numbers)) for key in keys])


def _by_draw(draw: Ints, values: Floats) -> Floats:
    """The mean of the values of each draw."""
    means: Floats = np.bincount(draw, weights=values) / np.bincount(draw)
    return means


def _pairs(by_name: Mapping[str, Rows], tie: float) -> dict[tuple[str, str], dict[str, Any]]:
    """Every two controllers on the draws that both have, with Holm's correction over all pairs."""
    keyed, pairs = {name: {_key(row): row for row in rows} for name, rows in by_name.items()}, {}
    for first, second in combinations(by_name, 2):
        both = [key for key in keyed[first] if key in keyed[second]]
        times = np.array([restricted(keyed[n][k] for k in both) for n in (first, second)])
        won = np.array(
            [[keyed[n][k].outcome == "success" for k in both] for n in (first, second)], dtype=bool
        )
        if both:
            draw = _draws(both)
            one, other = (_by_draw(draw, each) for each in times)
            mean, ends = statistics.difference95(one, other, 1.0)
            sums = np.bincount(draw, weights=won[0].astype(int) - won[1]).round().astype(int)
            apart = float(won[0].mean() - won[1].mean())
            pairs[first, second] = {
                "names": [first, second],
                "episodes": len(both),
                "draws": len(sums),
                "only_first": int((won[0] & ~won[1]).sum()),
                "only_second": int((won[1] & ~won[0]).sum()),
                "mcnemar_p": statistics.sign_flips(sums),
                "share_difference": mean,
                "share_difference_95": ends,
                "wilcoxon_p": statistics.signed_rank(one - other) if len(one) > 1 else None,
                "both": int((won[0] & won[1]).sum()),
                "success_difference": apart,
                "tie": abs(apart) <= tie + 1e-12,
            }
    for p in ("mcnemar_p", "wilcoxon_p"):
        raised = statistics.holm([1.0 if (v := pair[p]) is None else v for pair in pairs.values()])
        for pair, value in zip(pairs.values(), raised, strict=True):
            pair[p.replace("_p", "_holm_p")] = value
    return pairs


def _rank(
    name: str, ranked: Sequence[str], pairs: Mapping[tuple[str, str], Mapping[str, Any]]
) -> dict[str, Any]:
    """The rank of a controller, and its interval."""
    ahead = better = worse = 0
    for (first, second), pair in pairs.items():
        if name not in (first, second) or pair["tie"]:
            continue
        loses = (pair["success_difference"] > 0) == (name == second)
        sure = pair["mcnemar_holm_p"] < ALPHA
        ahead += loses
        better += loses and sure
        worse += not loses and sure
    return {"rank": 1 + ahead, "rank_95": [1 + better, len(ranked) - worse]}


def profiles(rows: Rows) -> tuple[Floats, dict[str, Floats]]:
    """Performance profiles (Dolan and More 2002, Mathematical Programming 91, 201-213).

    Of each draw the time of a controller over that of the fastest one that is ranked; infinite for
    a failure. Draws that nobody crosses count.

    Returns:
        Factors from 1 on, shape (n,), and of each controller the share of draws that it crosses
        within that factor of the fastest, shape (n,).
    """
    ranked = [row for row in rows if not row.given]
    best: dict[Key, float] = {}
    for row in ranked:
        key = _key(row)
        time = row.time_s if row.outcome == "success" else np.inf
        best[key] = min(best.get(key, np.inf), time)
    factors = np.linspace(1.0, 10.0, 181)
    shares = {}
    for name in names_of(ranked):
        ratios = np.array(
            [
                row.time_s / best[_key(row)] if row.outcome == "success" else np.inf
                for row in ranked
                if row.controller == name
            ]
        )
        shares[name] = (ratios[:, None] <= factors + 1e-12).mean(axis=0)
    return factors, shares
