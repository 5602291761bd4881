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
from dataclasses import replace
from itertools import combinations

import numpy as np

from antennate.studies import statistics
from antennate.studies.columns import Frame
from antennate.studies.pooling import by, frame, pooled
from antennate.types import Floats, Ints
from antennate_lab.compete.comparison import Check
from antennate_lab.compete.episodes import EpisodeRow, all_drawn, restricted
from antennate_lab.compete.result import Cell, Controller, Pair, Ranked, Standing

ALPHA = 0.05
_DRAW = ["scene", "seed", "trial"]
"""Columns that tell a draw of a scene."""
Rows = Sequence[EpisodeRow]


def standing(rows: Rows, tie: float, check: Check | None = None) -> Standing:
    """All that is told of these rows.

    Args:
        rows: All episodes.
        tie: Largest difference of success shares that is none.
        check: How they repeat a table, if they are of one.
    """
    table = frame(rows, EpisodeRow).rename(columns={"outcome": "end"})  # so INVALID is not left out
    by_name = by(table.assign(share=np.array(restricted(rows))), "controller")
    given = {name: next(filter(None, own["given"]), "") for name, own in by_name.items()}
    ranked = [name for name, words in given.items() if not words]
    pairs = _pairs({name: by_name[name] for name in ranked}, tie)
    scenes = dict.fromkeys(row.scene for row in rows)
    cells = {name: by(own, "scene", scenes) for name, own in by_name.items()}
    return Standing(
        seeds=list(dict.fromkeys(row.seed for row in rows)),
        hidden=all_drawn(rows),
        controllers={
            name: _controller(own, _ranked(name, given[name], len(ranked), pairs))
            for name, own in by_name.items()
        },
        scenes={
            scene: {name: _cell(own[scene]) for name, own in cells.items()} for scene in scenes
        },
        paired={"-".join(pair.names): pair for pair in pairs},
        check=check,
    )


def _cell(rows: Frame) -> Cell:
    """One controller in one scene."""
    mean, ends = statistics.mean95(rows["share"].to_numpy(), 0.0, 1.0, restricted=True)
    return pooled(
        Cell,
        rows,
        episodes=len(rows),
        restricted_mean_share=mean if len(rows) else None,
        restricted_mean_share_95=ends,
    )


def _controller(rows: Frame, where: Ranked) -> Controller:
    """One controller over all scenes, whose draws count once each."""
    draw, won = _draws(rows), (rows["end"] == "success").to_numpy()
    times = _by_draw(draw, rows["share"].to_numpy())
    mean, ends = statistics.mean95(times, 0.0, 1.0, restricted=True)
    speeds = (rows["progress_m"] / rows["time_s"]).to_numpy()[won]
    speed, speed_ends = statistics.mean95_by_draw(speeds, draw[won], 0.0)
    return pooled(
        Controller,
        rows,
        **vars(where),
        episodes=len(rows),
        wilson95=statistics.wilson95_by_draw(
            np.bincount(draw, weights=won).round().astype(int), np.bincount(draw)
        ),
        restricted_mean_share=mean,
        restricted_mean_share_95=ends,
        speed_m_s=speed if won.any() else None,
        speed_95=speed_ends,
        invalid=int((rows["end"] == "invalid").sum()),
        first_reason=next(filter(None, rows["reason"]), None),
    )


def _draws(rows: Frame) -> Ints:
    """The number of the draw that each row is of, from 0, shape (n,)."""
    return rows.groupby(["seed", "trial"], sort=False).ngroup().to_numpy()


def _by_draw(draw: Ints, values: Floats) -> Floats:
    """The mean of the values of each draw."""
    means: Floats = np.bincount(draw, weights=values) / np.bincount(draw)
    return means


def _pairs(by_name: Mapping[str, Frame], tie: float) -> list[Pair]:
    """Every two controllers on the draws that both have, with Holm's correction over all pairs."""
    pairs = list[Pair]()
    for first, second in combinations(by_name, 2):
        both = by_name[first].merge(by_name[second], on=_DRAW, suffixes=("", "_other"))
        if len(both):
            pairs.append(_pair((first, second), both, tie))
    mcnemar = statistics.holm([pair.mcnemar_holm_p for pair in pairs])
    wilcoxon = statistics.holm([pair.wilcoxon_holm_p for pair in pairs])
    return [
        replace(pair, mcnemar_holm_p=one, wilcoxon_holm_p=other)
        for pair, one, other in zip(pairs, mcnemar, wilcoxon, strict=True)
    ]


def _pair(names: tuple[str, str], both: Frame, tie: float) -> Pair:
    """Two controllers, as if there were no others."""
    draw, won = _draws(both), (both[["end", "end_other"]] == "success").to_numpy().T
    one, other = (_by_draw(draw, both[each].to_numpy()) for each in ("share", "share_other"))
    mean, ends = statistics.difference95(one, other, 1.0)
    sums = np.bincount(draw, weights=won[0].astype(int) - won[1]).round().astype(int)
    mcnemar = statistics.sign_flips(sums)
    wilcoxon = statistics.signed_rank(one - other) if len(one) > 1 else None
    apart = float(won[0].mean() - won[1].mean())
    return Pair(
        names=names,
        episodes=len(both),
        draws=len(sums),
        only_first=int((won[0] & ~won[1]).sum()),
        only_second=int((won[1] & ~won[0]).sum()),
        mcnemar_p=mcnemar,
        mcnemar_holm_p=mcnemar,
        share_difference=mean,
        share_difference_95=ends,
        wilcoxon_p=wilcoxon,
        wilcoxon_holm_p=1.0 if wilcoxon is None else wilcoxon,
        both=int((won[0] & won[1]).sum()),
        success_difference=apart,
        tie=abs(apart) <= tie + 1e-12,
    )


def _ranked(name: str, given: str, among: int, pairs: Sequence[Pair]) -> Ranked:
    """The rank of a controller among so many, and its interval; none of one that is given more."""
    if given:
        return Ranked(given=given, rank=None, rank_95=None)
    ahead = better = worse = 0
    for pair in pairs:
        if name not in pair.names or pair.tie:
            continue
        loses = (pair.success_difference > 0) == (name == pair.names[1])
        sure = pair.mcnemar_holm_p < ALPHA
        ahead += loses
        better += loses and sure
        worse += not loses and sure
    return Ranked(given="", rank=1 + ahead, rank_95=(1 + better, among - worse))


def profiles(rows: Rows) -> tuple[Floats, dict[str, Floats]]:
    """Performance profiles (Dolan and More 2002, Mathematical Programming 91, 201-213).

    Of each draw the time of a controller over that of the fastest one that is ranked; infinite for
    a failure. Draws that nobody crosses count.

    Returns:
        Factors from 1 on, shape (n,), and of each controller the share of draws that it crosses
        within that factor of the fastest, shape (n,).
    """
    ranked = frame([row for row in rows if not row.given], EpisodeRow)
    won = ranked["outcome"] == "success"
    draws = [ranked[each] for each in _DRAW]
    best = ranked["time_s"].where(won, np.inf).groupby(draws).transform("min")
    ratios = (ranked["time_s"] / best).where(won, np.inf)
    factors = np.linspace(1.0, 10.0, 181)
    return factors, {
        name: (own["ratio"].to_numpy()[:, None] <= factors + 1e-12).mean(axis=0)
        for name, own in by(ranked.assign(ratio=ratios), "controller").items()
    }
