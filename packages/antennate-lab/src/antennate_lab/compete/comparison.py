"""Somebody's table of trials, run again: which rows differ, and whether chance alone makes that."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from antennate.sim.episode import Outcome
from antennate.studies.columns import tabular
from antennate.studies.statistics import sign_flips, signed_rank
from antennate.types import Floats, Ints
from antennate_lab.compete.checking import CLOSE
from antennate_lab.compete.episodes import EpisodeRow, restricted

BIAS, CHANCE = 0.01, 0.01
"""Times of a draw that differ by no more than this share of the limit are the same elsewhere (0.94
of 100 s in 200 draws, docs/performance.json); and the p below which a table does not repeat."""
ENOUGH = 4
"""Draws that can tell something if all are far off: 2 (1/4)^4 is below `CHANCE`, see `_far_p`."""


@tabular
class Differing:
    """A row that differs: as the table says, and as it was run here."""

    controller: str
    scene: str
    """Scene, with its other parameters."""
    seed: int
    trial: int
    """Number of the draw."""
    outcome: Outcome
    """Outcome in the table."""
    outcome_here: Outcome
    """Outcome here."""
    time_s: float
    """Time in the table."""
    time_here_s: float
    """Time here."""
    progress_m: float
    """Where the head ended along the route in the table."""
    progress_here_m: float
    """Where it ended here."""
    overturned: bool
    """Whether the robot lay on its back at the end in the table."""
    overturned_here: bool
    """Whether it lay so here."""
    limit_s: float
    """Time limit in the table."""
    limit_here_s: float
    """Time limit here."""
    given: str
    """What the simulation gave to the controller in the table."""
    given_here: str
    """What it gave here."""

    @property
    def differences(self) -> list[tuple[str, Any, Any]]:
        """Name of each column that differs, its value in the table and its value here."""
        pairs = (
            ("outcome", self.outcome, self.outcome_here),
            ("time_s", self.time_s, self.time_here_s),
            ("progress_m", self.progress_m, self.progress_here_m),
            ("limit_s", self.limit_s, self.limit_here_s),
            ("overturned", self.overturned, self.overturned_here),
            ("given", self.given, self.given_here),
        )
        return [(name, theirs, ours) for name, theirs, ours in pairs if theirs != ours]


@tabular
class Check:
    """Which rows of a table repeat here, and whether chance alone makes the others."""

    rows: int
    """Rows that were run again."""
    same: int
    """Rows that are the same here."""
    other_outcome: int
    """Rows with another outcome here."""
    broken: int
    """Rows that differ and must not: version, engine and processor are the same, or `limit_s` or
    `given` differs."""
    elsewhere: int
    """Rows of another version, engine or processor."""
    draws: int
    """Draws of the rows; one counts once in all conditions of a scene."""
    more_successes: int
    """Successes in the table less those here."""
    successes_p: float
    """Chance that another processor makes so many more or fewer."""
    mean_share_difference: float
    """Mean restricted time as a share of the limit, table less here."""
    times_p: float
    """Chance of such times on another processor, by Wilcoxon's test."""
    far_p: float
    """Chance of so many draws in which one is ahead by more than half of the limit."""
    versions: list[str]
    """Versions of antennate in the table."""
    engines: list[str]
    """Versions of MuJoCo in the table."""
    processors: list[str]
    """Models of the processors in the table."""
    differ: list[Differing]
    """Rows that differ, as the table says and as they ended here."""


def compared(theirs: Sequence[EpisodeRow], ours: Sequence[EpisodeRow]) -> Check:
    """Which rows of a table differ from those that were run here.

    Rows that were not run are left out, as after an interruption.
    """
    run = {(row.controller, row.scene, row.seed, row.trial): row for row in ours}
    pairs = [
        (row, again)
        for row in theirs
        if (again := run.get((row.controller, row.scene, row.seed, row.trial))) is not None
    ]
    differ = [(row, again) for row, again in pairs if not _alike(row, again)]
    won, far = _by_draw(pairs)
    return Check(
        rows=len(pairs),
        same=len(pairs) - len(differ),
        other_outcome=sum(row.outcome != again.outcome for row, again in differ),
        broken=sum(_must_repeat(row, again) for row, again in differ),
        elsewhere=sum(not _in_one_place(row, again) for row, again in pairs),
        draws=len(won),
        more_successes=int(won.sum()),
        successes_p=sign_flips(won),
        mean_share_difference=float(far.mean()) if len(far) else 0.0,
        times_p=signed_rank(far - np.clip(far, -BIAS, BIAS)),
        far_p=_far_p(far),
        versions=sorted({row.version for row in theirs}),
        engines=sorted({row.engine for row in theirs}),
        processors=sorted({row.processor for row in theirs}),
        differ=[_differing(row, again) for row, again in differ],
    )


def refusal(check: Check) -> str:
    """Why a table does not repeat; empty if it does.

    It has a row that differs and must not; or, as on another processor, its successes or times
    differ by more than chance makes them.
    """
    if check.broken:
        return (
            f"Expected no difference in {check.broken} of them: on one version, engine and "
            "processor every row repeats, and limits and what is given are the same everywhere."
        )
    if check.successes_p < CHANCE:
        return (
            f"Expected as many successes as here but for chance, found {check.more_successes:+d}"
            f" (p {check.successes_p:.1g}, at least {CHANCE:g} is chance)."
        )
    p = min(check.times_p, check.far_p)
    if p < CHANCE:
        return (
            "Expected times as here but for chance, found mean times that differ by "
            f"{100 * check.mean_share_difference:+.1f} % of the limit (p {p:.1g}, at least "
            f"{CHANCE:g} is chance)."
        )
    return ""


def _alike(row: EpisodeRow, again: EpisodeRow) -> bool:
    numbers = [(getattr(row, n), getattr(again, n)) for n in ("time_s", "progress_m", "limit_s")]
    exact = all(getattr(row, n) == getattr(again, n) for n in ("outcome", "overturned", "given"))
    return exact and all(abs(one - other) <= CLOSE for one, other in numbers)


def _in_one_place(row: EpisodeRow, again: EpisodeRow) -> bool:
    """Whether both are of one version, engine and processor."""
    alike = (row.version, row.engine) == (again.version, again.engine)
    named = again.processor.startswith(f"{row.processor} (")  # by former tables, without numbers
    return alike and (named or row.processor == again.processor)


def _must_repeat(row: EpisodeRow, again: EpisodeRow) -> bool:
    """Whether rows that differ are of one place, or differ in a rule."""
    if _in_one_place(row, again):
        return True
    ran = "invalid" not in (row.outcome, again.outcome)
    return row.given != again.given or (ran and abs(row.limit_s - again.limit_s) > CLOSE)


def _by_draw(pairs: Sequence[tuple[EpisodeRow, EpisodeRow]]) -> tuple[Ints, Floats]:
    """How successes and restricted times of each draw differ, shapes (n,): table less here.

    On another processor a draw ends as if it were walked again, so either end is as likely in the
    table as here: each difference could as well have the other sign. No size counts but by its
    rank, so a row moves a test by no more than its place. Conditions of a scene are often the same
    walk, so a draw of it counts once.
    """
    walks: dict[tuple[str, str, int, int], list[tuple[float, float]]] = {}
    for row, again in pairs:
        won = (row.outcome == "success") - (again.outcome == "success")
        theirs, ours = restricted([row, again])
        key = (row.controller, row.scene.partition("+")[0], row.seed, row.trial)
        walks.setdefault(key, []).append((won, theirs - ours))
    more = np.array([sum(won for won, _ in walk) for walk in walks.values()], int)
    far = np.array([sum(far for _, far in walk) / len(walk) for walk in walks.values()])
    return more, far


def _far_p(far: Floats) -> float:
    """Two-sided p of differences (n,) of which so many are above half of the limit to one side.

    Of such a draw one time is below half of the limit and the other above. If a time is below with
    chance q wherever the draw is run, it is so in the table alone with q (1 - q), at most 1/4. So
    the number of such draws is binomial at most, however a controller walks. It tells of few draws,
    of which signs alone say nothing.
    """
    from scipy.special import bdtrc  # scipy.stats takes half a second longer

    most = max(int((far < -0.5).sum()), int((far > 0.5).sum()))
    return min(1.0, 2.0 * float(bdtrc(most - 1, len(far), 0.25))) if most else 1.0


def _differing(row: EpisodeRow, again: EpisodeRow) -> Differing:
    return Differing(
        controller=row.controller,
        scene=row.scene,
        seed=row.seed,
        trial=row.trial,
        outcome=row.outcome,
        outcome_here=again.outcome,
        time_s=row.time_s,
        time_here_s=again.time_s,
        progress_m=row.progress_m,
        progress_here_m=again.progress_m,
        overturned=row.overturned,
        overturned_here=again.overturned,
        limit_s=row.limit_s,
        limit_here_s=again.limit_s,
        given=row.given,
        given_here=again.given,
    )
