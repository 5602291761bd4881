"""Each rule of the board at its own best pace: `python docs/science/paces.py PART FOLDER`.

Parts, one command each; what was stopped goes on with the same command:

- `search`: each rule at each of PACES in the eight scenes of the board, 20 draws of seed 592000.
- `judge`: each at the pace that the search gave it, 100 fresh draws, PARTS hidden seeds;
  beside them `geometric` at its pace, told a side by TELLERS.
- `keep`: the parts that are whole go to `paces_judged.csv`; `judge` runs those that are not there.
- `table`: the pace of each rule and how it was chosen, and the board of the judged run.

Asked are the rules of the board that are near its top. `open` crosses 92 of 800 there, and `map`
is told the way: neither can be the best blind rule or the best that feels. 0.5 Hz is not asked:
all that were tried took less time at 0.8 than at 0.6 Hz (pace.md).

The pace of a rule, written before the search ran: of the paces whose crossings are within noise of
the most, that of the least mean time, a failure as the limit; the slower one of equals. A pace is
within noise if it crosses fewer by no more than one standard error of the difference. A draw counts
once: its difference is summed over the scenes, and the error is that of the sum over 20 draws.

The judgement, written before the judged run: touch pays if a rule that feels crosses at least 15
points of 100 more, the 95 % interval above 5, and takes at least 25 % less time, the interval below
-15 %, than each of the blind rules. Intervals are percentiles of 10,000 samples of the draws, each
with all its scenes. (Before the search was looked at, only the best of each kind was to be judged.
It then had `schedule` before `timed` by 4 of 160, which is noise, and far behind in time. So both
blind rules are rivals, which makes it harder for touch, and all four rules are judged.)

A teller is judged by the same words against the same blind rules. It uses all that a sense of its
AUC can tell at a decision, with an error anew each time, which is the best case. If the one of
0.77, the bound of the ten best antennae, does not pay, none of these antennae pays on this board
by the side that it tells to `geometric`. If it pays and the one of 0.65, the best antenna found,
does not, then that antenna does not pay, and a better one is not excluded.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from antennate.control.readings import short_names
from antennate.params.control import ControlParams
from antennate.types import Floats
from antennate_lab.compete.checking import read_rows
from antennate_lab.compete.config import SCENES_OF_BOARD, CompeteConfig, plain
from antennate_lab.compete.episodes import EpisodeRow, restricted
from antennate_lab.compete.page import apart, markdown, sentence
from antennate_lab.compete.standings import standing

PACES, USUAL = (0.6, 0.7, 0.8), 0.6
"""Frequencies of the gait that are tried, and the default, for which times were set [Hz]."""
SEARCH, DRAWS = 592_000, 20
"""Seed of the search, and its draws of each scene."""
PARTS, EACH = 10, 10
"""Parts of the judged run, and the draws of each."""
BLIND, FEELS = ("timed", "schedule"), ("closed", "geometric")
TELLERS = ("docs/science/told.py:told_77", "docs/science/told.py:told_65")
TIMES: Mapping[str, Sequence[str]] = {
    "timed": ("timed.walk_time", "escape.reverse_time", "escape.turn_time"),
    "schedule": ("schedule.walk_time", "schedule.reverse_times"),
    "closed": tuple(
        f"search.{name}"
        for name in ("reverse_time", "reverse_most", "turn_time", "lost_turn", "return_time")
    ),
}
"""Times by the clock, which keep their gait cycles; `geometric` does so by its model."""
RATES: Mapping[str, Sequence[str]] = {"schedule": ("schedule.turn_rate",)}
"""What is taken for so much a second."""
RESAMPLES = 10_000
SEARCHED = Path(__file__).with_name("paces_search.csv")
"""Rows of the search, for a folder without one."""
JUDGED = Path(__file__).with_name("paces_judged.csv")
"""Rows of the judged parts that are whole."""


def at(rule: str, pace: float) -> str:
    """A rule at a pace, as `compete --controllers` takes it."""
    parts, own, factor = [f"gait.frequency={pace:g}"], ControlParams(), USUAL / pace
    scales = ((TIMES, factor), (RATES, 1.0 / factor))
    for path, scale in ((p, s) for table, s in scales for p in table.get(rule, ())):
        group, _, name = path.partition(".")
        values = np.round(scale * np.atleast_1d(getattr(getattr(own, group), name)), 4)
        text = ", ".join(f"{value:g}" for value in values)
        single = isinstance(getattr(getattr(own, group), name), float)
        parts.append(f"{path}={text if single else f'[{text}]'}")
    return "+".join([rule, *(parts if pace != USUAL else parts[:1])])


def run(
    folder: Path,
    controllers: Iterable[str],
    seed: int | None,
    draws: int,
    workers: int,
    scenes: Iterable[str] = SCENES_OF_BOARD,
) -> None:
    """Run a competition, or go on with it; without a seed, with a hidden one."""
    command = [sys.executable, "-m", "antennate", "compete", "--out", folder, "--resume"]
    command += ["--controllers", *controllers, "--scenes", *scenes]
    command += ["--hidden"] if seed is None else ["--seed", str(seed)]
    command += ["--trials", str(draws), "--workers", str(workers), "--no-figures"]
    if code := subprocess.run(command, check=False).returncode:
        sys.exit(code)


def cells(rows: Iterable[EpisodeRow]) -> dict[str, tuple[Floats, Floats]]:
    """Whether each draw was crossed, and its share of the limit, by controller: (draws, scenes)."""
    found: dict[str, dict[tuple[int, int, str], tuple[float, float]]] = {}
    for row in rows:
        draw = float(row.outcome == "success"), float(restricted([row])[0])
        found.setdefault(row.controller, {})[row.seed, row.trial, row.scene] = draw
    shape = -1, len(SCENES_OF_BOARD), 2
    return {
        name: (table[..., 0], table[..., 1])
        for name, draws in found.items()
        for table in [np.array([draws[key] for key in sorted(draws)]).reshape(shape)]
    }


def searched(folder: Path) -> dict[str, tuple[Floats, Floats]]:
    """What was crossed in the search of a folder, or in the one that is kept here."""
    path = folder / "search" / "trials.csv"
    return cells(read_rows(path if path.exists() else SEARCHED))


def chosen(found: Mapping[str, tuple[Floats, Floats]]) -> dict[str, str]:
    """The pace of each rule by the definition above: the controller's text by the rule."""
    best = {}
    for rule in dict.fromkeys(map(plain, found)):
        own = {name: values for name, values in found.items() if plain(name) == rule}
        most = max(own, key=lambda name: (own[name][0].sum(), -own[name][1].mean()))
        within = []
        for name, (crossed, share) in own.items():
            lost = (own[most][0] - crossed).sum(axis=1)
            if lost.sum() <= np.sqrt(len(lost) * lost.var(ddof=1)) + 1e-9:
                within.append((round(share.mean(), 9), name))
        best[rule] = min(within)[1]
    return best


def kept(path: Path = JUDGED) -> list[EpisodeRow]:
    """Rows of the parts that are kept here."""
    return read_rows(path) if path.exists() else []


def whole_part(path: Path) -> list[EpisodeRow]:
    """Rows of a part that has all its draws, and valid episodes alone."""
    rows = read_rows(path)
    if (found := len({row.trial for row in rows})) != EACH:
        sys.exit(f"{path}: expected {EACH} draws of each scene, found {found}")
    if late := [row.reason for row in rows if row.outcome == "invalid"]:
        sys.exit(f"{path}: expected valid episodes alone, found {len(late)}: {late[0]}")
    return rows


def keep(folder: Path) -> None:
    """Keep the rows of the parts of a folder that are whole."""
    done = {row.seed for row in kept()}
    for path in sorted(folder.glob("judged-*/trials.csv")):
        if whole_part(path)[0].seed not in done:
            head, _, rest = path.read_text().partition("\n")
            JUDGED.write_text((JUDGED.read_text() if JUDGED.exists() else f"{head}\n") + rest)


def compared(found: Mapping[str, tuple[Floats, Floats]]) -> Iterable[str]:
    """All that feel or are told beside each blind rule, as judged above."""
    short = short_names(map(plain, found))
    blind = [name for name in found if plain(name) in BLIND]
    return [
        judged(short[plain(name)], found[name], plain(rival), found[rival])
        for name in found
        if name not in blind
        for rival in blind
    ]


def judged(ours: str, own: tuple[Floats, Floats], blind: str, other: tuple[Floats, Floats]) -> str:
    """One beside the best blind rule: points crossed more, time, and whether touch pays."""
    rng, draws = np.random.default_rng(59), len(own[0])
    picks = np.vstack([np.arange(draws), rng.integers(draws, size=(RESAMPLES, draws))])
    (crossed, share), (crosses, shares) = (
        [part.mean(axis=1)[picks].mean(axis=1) for part in parts] for parts in (own, other)
    )
    more, less = 100.0 * (crossed - crosses), 100.0 * (share / shares - 1.0)
    ends = [np.percentile(values[1:], [2.5, 97.5]) for values in (more, less)]
    pays = more[0] >= 15 and ends[0][0] > 5 and less[0] <= -25 and ends[1][1] < -15
    return (
        f"`{ours}` less `{blind}`: {more[0]:+.1f} points crossed ({ends[0][0]:+.1f} to "
        f"{ends[0][1]:+.1f}), {less[0]:+.1f} % time ({ends[1][0]:+.1f} to {ends[1][1]:+.1f}): "
        f"touch {'pays' if pays else 'is not shown to pay'} by the criterion"
    )


def table(folder: Path) -> None:
    """Print what was searched, and the board of what was judged."""
    found = searched(folder)
    best = chosen(found).values()
    print("| rule | pace [Hz] | crossed | time [% of limit] | chosen |\n|---|---|---|---|---|")
    for name, (crossed, share) in found.items():
        pace = name.partition("gait.frequency=")[2].partition("+")[0]
        count, time = f"{crossed.sum():.0f} of {crossed.size}", f"{100 * share.mean():.1f}"
        print(f"| `{plain(name)}` | {pace} | {count} | {time} | {'yes' * (name in best)} |")
    rows = kept()
    if (found := len({row.seed for row in rows})) < PARTS:
        print(f"\nJudged: {found} of {PARTS} parts. Nothing is told of them before all are there.")
        return
    result = standing(rows, CompeteConfig().tie)
    print("", sentence(result), apart(result), markdown(result), sep="\n\n")
    print("", *compared(cells(rows)), sep="\n\n")


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=("search", "judge", "keep", "table"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--draws", type=int, help="of each scene; 2 or more, to see it run")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    given = parser.parse_args()
    if given.part == "table":
        table(given.folder)
    elif given.part == "keep":
        keep(given.folder)
    elif given.part == "search":
        texts = [at(rule, pace) for rule in (*BLIND, *FEELS) for pace in PACES]
        run(given.folder / "search", texts, SEARCH, given.draws or DRAWS, given.workers)
    else:
        best = chosen(searched(given.folder))
        pace = best["geometric"].removeprefix("geometric")
        texts = [*best.values(), *(name + pace for name in TELLERS)]
        for part in range(len({row.seed for row in kept()}), PARTS):
            run(given.folder / f"judged-{part}", texts, None, given.draws or EACH, given.workers)


if __name__ == "__main__":
    main()
