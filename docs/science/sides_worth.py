"""What a side of a given certainty is worth: `python docs/science/sides_worth.py PART FOLDER`.

A teller with errors stands between the truth and the escape of `geometric`: at each decision to
turn it tells a side, which is the right one with the probability of an AUC. Parts: `trials` runs
all rivals through the draws, and goes on where it was stopped; `table` writes the table of
docs/science/sides.md, docs/science/sides_worth.json and the figure, of the draws that all rivals
have done. The criterion is that page's.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from told import Told

from antennate.control.registry import make_controller
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus, cpu_bodies
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.figures import INK, SERIES, WIDTH, canvas, render, styled
from antennate.params.control import ControlParams
from antennate.params.gaits import GaitParams
from antennate.sim.knowledge import SIDE_AHEAD
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand

HERE = Path(__file__).parent
SEEDS = (591_001, 591_002, 591_003)
"""Of the rounds, by turns; none was used before."""
SMOKE = (590_900,)
"""To see that all this runs."""
EACH = 10
"""Draws of a scene in a round: six rounds are 60 draws of three seeds."""
LIMIT = 100.0
"""Time after which a trial has failed [s]."""
FREQUENCY = 0.8
"""Of the gait [Hz], unless another is asked for: that of `sides.py`, as sides.md explains."""
PLACE = 0.4
"""How far apart jams of one place are, at most [m]: a corridor's width."""
SCENES = ("tunnel", "corner", "uturn", "room", "deadend")
AUCS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
NEEDED = (0.5, 0.7, 0.8)
"""AUCs between which the bound x of the designs lies, and chance: these run first."""
RESAMPLES = 10_000
"""Of the bootstrap over draws."""


@dataclass(frozen=True)
class Rival:
    """A controller and what it is told.

    Attributes:
        controller: Its name.
        side: Whether it knows the side as `--knows side` tells it.
        auc: Of the teller's score; None without a teller.
        kept: Whether an error is kept at a place; else each decision has its own.
        first: Whether it asks at the first try of a jam alone, and then searches both sides.
        optional: Whether it runs after the others.
    """

    controller: str = "geometric"
    side: bool = False
    auc: float | None = None
    kept: bool = False
    first: bool = False
    optional: bool = False


def rivals() -> dict[str, Rival]:
    """All rivals, by name. Those that the bound x does not need are optional."""
    known = {"geometric-side": Rival(side=True), "timed": Rival("timed")}
    known |= {"timed-side": Rival("timed", side=True)}
    known |= {f"told-{auc:g}": Rival(auc=auc) for auc in AUCS}
    known |= {f"kept-{auc:g}": Rival(auc=auc, kept=True) for auc in AUCS[:-1]}
    known |= {f"first-{auc:g}": Rival(auc=auc, first=True) for auc in AUCS[1:]}
    found = {"geometric": Rival()}
    for name, rival in known.items():
        found[name] = replace(rival, optional=rival.first or rival.auc not in NEEDED)
    return found


RIVALS = rivals()


class Errors:
    """Chance of a trial's teller, the same for all rivals: a score's error and a coin, each time.

    Args:
        key: Seed, scene and number of the trial.
    """

    def __init__(self, key: Iterable[int]) -> None:
        self._rng = np.random.default_rng([*key])
        self._places: list[tuple[Floats, tuple[float, float]]] = []

    def next(self) -> tuple[float, float]:
        """Error of a score, of the standard normal distribution, and a coin, -1 or 1."""
        error, coin = self._rng.standard_normal(2)
        return float(error), math.copysign(1.0, coin)

    def of_place(self, head: Floats) -> tuple[float, float]:
        """Those of the place of a head [m], shape (2,); of a new place the next ones."""
        for place, found in self._places:
            if math.dist(place, head) < PLACE:
                return found
        self._places.append((head.copy(), self.next()))
        return self._places[-1][1]


class Teller(Told):
    """A controller that is told a side by a teller with errors, for a rival.

    An error that is kept is one of right or wrong: at that place the teller is wrong whatever the
    side is by then.

    Args:
        made: The controller.
        rival: How it is told.
        bodies: The simulated robots.
        keys: Seed, scene and number of the trial of each row.
        batch: Rows.
    """

    def __init__(
        self, made: Any, rival: Rival, bodies: Any, keys: dict[int, tuple[int, ...]], batch: int
    ) -> None:
        assert rival.auc is not None
        super().__init__(made, rival.auc, batch)
        self._rival, self._bodies, self._keys = rival, bodies, keys
        self._errors: dict[int, Errors] = {}
        self._truth, self._told = (np.zeros(batch, int) for _ in range(2))
        self.decisions: dict[int, list[tuple[int, int]]] = {}

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start rows anew."""
        super().reset(rows, phase)
        for row in np.arange(len(self._truth))[rows].tolist():
            self._errors[row] = Errors(self._keys[row])
            self.decisions[self._keys[row][-1]] = []

    def told(self, side: Ints) -> Ints:
        """What is told, shape (B,); 0 at later tries of a rival that asks at the first alone."""
        self._truth, self._told = side, super().told(side)
        if self._rival.first:
            self._told *= self._made.rule._search.tries == 0
        return self._told

    def drawn(self, row: int) -> tuple[float, float]:
        """Error and coin of a row, the same for all rivals."""
        errors = self._errors[row]
        kept = self._rival.kept
        return errors.of_place(self._bodies.world(row).head[:2]) if kept else errors.next()

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period; a row that has backed off has decided."""
        backed = self._backed
        command = super().step(frame)
        for row in np.flatnonzero(backed & ~self._backed).tolist():
            decision = int(self._truth[row]), int(self._told[row])
            self.decisions[self._keys[row][-1]].append(decision)
        return command


def run_round(
    folder: Path, name: str, scene: str, number: int, smoke: bool, frequency: float
) -> str:
    """Run a round of draws of a rival in a scene, and write their rows."""
    path = folder / f"{name}_{scene}_{number}.json"
    if path.exists():
        if json.loads(path.read_text())["frequency_hz"] != frequency:
            raise ValueError(f"{path}: expected a run at {frequency:g} Hz, found another")
        return f"{path.stem}: done before"
    rival, each = RIVALS[name], 3 if smoke else EACH
    seeds = SMOKE if smoke else SEEDS
    seed, first = seeds[number % len(seeds)], number // len(seeds) * each
    config = TunnelConfig(
        seed=seed,
        scene=scene,
        trials=first + each,
        time_limit=LIMIT,
        knows=("side",) if rival.side else (),
        control=ControlParams(gait=GaitParams(frequency=frequency)),
    )
    robots: list[Any] = []
    tellers: list[Teller] = []
    keys: dict[int, tuple[int, ...]] = {}

    def bodies(batch: int) -> Any:
        drawn, robot = cpu_bodies(config)(batch)
        robots.append(robot)
        return drawn, robot

    def make(_: str, control: Any, robot: Any, batch: int) -> Any:
        made = make_controller(rival.controller, control, robot, batch)
        if rival.auc is None:
            return made
        tellers.append(Teller(made, rival, robots[-1], keys, batch))
        return tellers[-1]

    def monitor(row: int, episode: Any) -> TrialMonitor:
        keys[row] = seed, SCENES.index(scene), episode.number
        return TrialMonitor(episode, name)

    rows: list[dict[str, Any]] = []
    begun = time.process_time()
    run_trials(
        *(config, rival.controller, range(first, first + each)),
        emit=lambda found: rows.append(asdict(found[0])),
        apparatus=Apparatus(make, bodies, monitor),
    )
    decisions = {k: v for teller in tellers for k, v in teller.decisions.items()}
    kept: list[dict[str, Any]] = [
        {key: row[key] for key in ("seed", "trial", "outcome", "time_s", "reason")}
        | {"decisions": decisions.get(row["trial"], [])}
        for row in sorted(rows, key=lambda row: row["trial"])
    ]
    cpu = time.process_time() - begun
    folder.mkdir(parents=True, exist_ok=True)
    short = path.with_suffix(".part")
    found = {"frequency_hz": frequency, "cpu_s": cpu, "rows": kept}
    short.write_text(json.dumps(found) + "\n")
    short.rename(path)
    walked = sum(row["time_s"] for row in kept)
    return f"{path.stem}: {walked:.0f} s of walking in {cpu:.0f} s of a processor"


def trials(folder: Path, rounds: int, workers: int, smoke: bool, frequency: float) -> None:
    """Run all rivals, a round after the other; those that are optional after all others."""
    tasks = [
        (folder, name, scene, number, smoke, frequency)
        for optional in (False, True)
        for number in range(rounds)
        for name, rival in RIVALS.items()
        if rival.optional == optional
        for scene in SCENES
    ]
    with ProcessPoolExecutor(workers) as pool:
        for done in pool.map(run_round, *zip(*tasks, strict=True)):
            print(done, flush=True)


def times_of(folder: Path) -> tuple[dict[str, Floats], dict[str, dict[str, Any]], list[int]]:
    """Times of each rival [s], shape (scenes, draws), NaN if invalid; how many were right; seeds.

    A failure counts as the limit. Draws are those that all needed rivals have done; an optional
    one that has done fewer has NaN for the rest.
    """
    rows: dict[str, dict[tuple[str, int, int], Any]] = {}
    for path in sorted(folder.glob("*.json")):
        name, scene, _ = path.stem.split("_")
        for row in json.loads(path.read_text())["rows"]:
            rows.setdefault(name, {})[scene, row["seed"], row["trial"]] = row
    usual = [rows.get(name, {}) for name in RIVALS if not RIVALS[name].optional]
    draws = sorted(
        {key[1:] for key in usual[0] if all((s, *key[1:]) in r for r in usual for s in SCENES)}
    )
    times, told = {}, {}
    for name in RIVALS:
        own = rows.get(name, {})
        whole = [draw for draw in draws if all((s, *draw) in own for s in SCENES)]
        if not whole:
            continue
        times[name] = np.array(
            [[time_of(own[s, *d]) if d in whole else math.nan for d in draws] for s in SCENES]
        )
        told[name] = shares([own[s, *draw]["decisions"] for s in SCENES for draw in whole])
    return times, told, sorted({seed for seed, _ in draws})


def time_of(row: dict[str, Any]) -> float:
    """Time of a trial [s]: a failure as the limit, NaN if it is invalid."""
    if row["outcome"] == "invalid":
        return math.nan
    return min(row["time_s"], LIMIT) if row["outcome"] == "success" else LIMIT


def shares(trials: list[Any]) -> dict[str, Any]:
    """Number of decisions with a side, of those told rightly, and of those without a side."""
    pairs = np.array([pair for decisions in trials for pair in decisions], int).reshape(-1, 2)
    truth, told = pairs[(pairs[:, 0] != 0) & (pairs[:, 1] != 0)].T
    return {
        "decisions": len(truth),
        "right": int((truth == told).sum()),
        "straight": int((pairs[:, 0] == 0).sum()),
    }


def saved(base: Floats, other: Floats) -> dict[str, Any]:
    """Time that another rival saves [s], in each scene and in all alike, with 95 % intervals.

    Args:
        base: Times of the one that it is compared with, shape (scenes, draws).
        other: Its times. Compared are the draws that both have done.
    """
    gain = base - other
    gain = gain[:, np.isfinite(gain).any(axis=0)]
    count = gain.shape[1]
    chance = np.random.default_rng(59).integers(count, size=(RESAMPLES, count))
    resampled = np.nanmean(gain[:, chance], axis=2)
    ends = np.percentile(resampled, [2.5, 97.5], axis=1).T
    pooled = np.percentile(resampled.mean(axis=0), [2.5, 97.5])
    return {
        "scenes": np.nanmean(gain, axis=1).tolist(),
        "scenes_95": ends.tolist(),
        "all": float(np.nanmean(gain, axis=1).mean()),
        "all_95": pooled.tolist(),
    }


def chance_of(name: str, times: Any) -> str:
    """Rival that is told a side by chance, in the same way if there is one."""
    alike = f"{name.partition('-')[0]}-0.5"
    return alike if alike in times else "told-0.5"


def table(folder: Path) -> None:
    """Write the numbers, the figure and the table of the page."""
    times, told, seeds = times_of(folder)
    paces = {json.loads(path.read_text())["frequency_hz"] for path in folder.glob("*.json")}
    if len(paces) != 1:
        sys.exit(f"expected a folder of one pace, found {sorted(paces)} Hz")
    count = next(iter(times.values())).shape[1]
    if not count:
        sys.exit("expected a draw that all rivals have done, found none")
    result = {
        "seeds": seeds,
        "draws": count,
        "limit_s": LIMIT,
        "frequency_hz": paces.pop(),
        "side_ahead_m": SIDE_AHEAD,
        "scenes": SCENES,
        "rivals": {
            name: {
                "valid": np.isfinite(found).sum(axis=1).tolist(),
                "crossed": (found < LIMIT).sum(axis=1).tolist(),
                "draws": int(np.isfinite(found).any(axis=0).sum()),
                "mean_s": np.nanmean(found, axis=1).tolist(),
                **told[name],
                "saved": saved(times["geometric"], found),
                "saved_chance": saved(times[chance_of(name, times)], found),
            }
            for name, found in times.items()
        },
    }
    (HERE / "sides_worth.json").write_text(json.dumps(result, indent=1) + "\n")
    (HERE / "sides_worth.png").write_bytes(render(_figure(result["rivals"]))["png"])
    write(result)


LABELS = {
    "geometric": "`geometric`, own readings",
    "geometric-side": "`geometric`, `--knows side`",
    "timed": "`timed`, blind",
    "timed-side": "`timed`, `--knows side`",
}
"""Rows of the table without a teller."""
KINDS = {"told": "AUC {}", "kept": "AUC {}, errors kept", "first": "AUC {}, first try alone"}


def label(name: str) -> str:
    """Name of a row of the table."""
    kind, _, auc = name.partition("-")
    return LABELS.get(name) or KINDS[kind].format(auc)


def span(value: float, ends: list[float]) -> str:
    """Difference and its interval [s]."""
    return f"{value:+.1f} ({ends[0]:+.1f} to {ends[1]:+.1f})"


def write(result: dict[str, Any]) -> None:
    """Write the table of the page."""
    heads = ("side told", "draws", "right", *(f"`{scene}`" for scene in SCENES), "crossed")
    heads = (*heads, "mean [s]", "saved against `geometric` [s]", "saved against its AUC 0.5 [s]")
    lines = [
        f"{result['draws']} draws of each scene or fewer, seeds "
        f"{', '.join(map(str, result['seeds']))}, at {result['frequency_hz']:g} Hz, at most "
        f"{LIMIT:g} s. Each scene: mean time [s] and how many crossed.",
        "",
        f"| {' | '.join(heads)} |",
        "|" + " --- |" * len(heads),
    ]
    for name, cell in result["rivals"].items():
        share = f"{100 * cell['right'] / cell['decisions']:.0f} %" if cell["decisions"] else ""
        scenes = [f"{m:.1f}, {n}" for m, n in zip(cell["mean_s"], cell["crossed"], strict=True)]
        whole = f"{sum(cell['crossed'])} of {sum(cell['valid'])}", f"{np.mean(cell['mean_s']):.1f}"
        gains = [span(cell[k]["all"], cell[k]["all_95"]) for k in ("saved", "saved_chance")]
        gains = ["" if gain.startswith("+0.0 (+0.0") else gain for gain in gains]
        lines.append(
            f"| {' | '.join([label(name), str(cell['draws']), share, *scenes, *whole, *gains])} |"
        )
    lines += ["", "![Time saved by a teller, by its AUC](sides_worth.png)"]
    page = HERE / "sides.md"
    begin, rest = page.read_text().split("<!-- worth: ")
    head, rest = rest.split("\n", 1)
    _, after = rest.split("<!-- end of worth -->")
    text = "\n".join(lines)
    page.write_text(f"{begin}<!-- worth: {head}\n{text}\n<!-- end of worth -->{after}")


@styled
def _figure(cells: dict[str, Any]) -> Figure:
    """Time saved against `geometric`, by the AUC of the teller."""
    figure = canvas(WIDTH, 2.8)
    panel = figure.subplots()
    names = {"told": "errors anew", "kept": "errors kept at a place", "first": "asked once a jam"}
    for place, (kind, words) in enumerate(names.items()):
        found = [(auc, cells[f"{kind}-{auc:g}"]) for auc in AUCS if f"{kind}-{auc:g}" in cells]
        if not found:
            continue
        at = np.array([auc for auc, _ in found]) + 0.006 * (place - 1)
        mean = [cell["saved"]["all"] for _, cell in found]
        low, high = np.array([cell["saved"]["all_95"] for _, cell in found]).T
        panel.plot(at, mean, "o-", color=SERIES[place], markersize=3, label=words)
        panel.vlines(at, low, high, color=SERIES[place])
    panel.axhline(0.0, color=INK, linewidth=0.8)
    panel.set_xlabel("AUC of the teller")
    panel.set_ylabel("time saved against geometric [s]")
    panel.legend(fontsize=7, loc="lower right")
    return figure


def main(argv: list[str]) -> None:
    """Do what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=["trials", "table"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--smoke", action="store_true", help="three draws of a seed of their own")
    parser.add_argument("--frequency", type=float, default=FREQUENCY, help="of the gait [Hz]")
    asked = parser.parse_args(argv)
    if asked.part == "table":
        table(asked.folder)
    else:
        rounds = 1 if asked.smoke else asked.rounds
        trials(asked.folder, rounds, asked.workers, asked.smoke, asked.frequency)


if __name__ == "__main__":
    main(sys.argv[1:])
