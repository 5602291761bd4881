"""Everything that docs/science/knowledge.md reports: `python docs/science/knowledge.py PART`.

Parts: `trials FOLDER` runs `timed` with what a simulation knows, in the hard set, and keeps a data
set of readings beside the truth; it goes on where it was stopped. `worth FOLDER` writes what the
knowledge is worth to docs/science/knowledge.json and draws its figure. `readings FOLDER` fits what
the readings tell, tested on scenes left out, into docs/science/readings.json (it needs
scikit-learn: `uv run --with scikit-learn`). A trial depends on the seed and its number alone.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import rankdata
from scipy.stats import t as student

from antennate.control.knowledge import KNOWABLE, Knowing, Knowledge
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus, cpu_bodies
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.figures import INK, SERIES, WIDTH, canvas, render, styled
from antennate.sim.knowledge import SIDE_AHEAD, angle_ahead
from antennate.sim.trial import draw_scene, scene_of
from antennate.studies.statistics import compare
from antennate.types import AntennaFrame

HERE = Path(__file__).parent


def row(*cells: object) -> str:
    """A row of a table in Markdown."""
    return "| " + " | ".join(map(str, cells)) + " |"


COLOUR = SERIES[0]

SEED = 370_037
"""Never used while anything was chosen."""
LIMIT = 60.0
"""Time after which a trial has failed [s]: shorter than usual, so that there are more of them."""
AT_ONCE = 4
"""Trials that run together."""
EVERY = 5
"""Ticks from one sample of the data set to the next: 20 Hz."""
SCENES = ("tunnel", "corner", "uturn", "deadend", "room")
CONDITIONS: dict[str, tuple[str, tuple[str, ...]]] = {
    "nothing": ("timed", ()),
    "side": ("timed", ("side",)),
    "map": ("map", ()),
    "jam": ("timed", ("jam",)),
    "facing": ("timed", ("facing",)),
    "free": ("timed", ("free",)),
    "closed-1": ("closed-1", ()),
}
"""A controller and what it knows, by the name of a column."""
SIGNALS = (
    *("row", "t", "x", "y", "heading", "left", "right", "maneuver", "phase"),
    *KNOWABLE,
    *("load", "error", "bend"),
)
"""Columns of the data set; `load` is the mean torque of the yaw joints without sign [N·m], `error`
the mean of their distance from the command [rad], `bend` the angle of the first one [rad]."""


class Recorded:
    """A controller that gets what it may know, and keeps the truth beside what it reads.

    Args:
        inner: The controller.
        knows: What it may know.
        robot: The simulated robots.
        batch: Their number.
    """

    knows = needs = KNOWABLE

    def __init__(self, inner: Any, knows: tuple[str, ...], robot: Any, batch: int) -> None:
        self._inner, self._robot, self._batch, self._ticks = inner, robot, batch, 0
        self._given = (*knows, *(inner.needs if isinstance(inner, Knowing) else ()))
        self._truth = Knowledge()
        self.samples: list[tuple[float, ...]] = []
        self.reset = inner.reset

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

    def know(self, knowledge: Knowledge) -> None:
        """Keep the truth, pass on what it may know."""
        self._truth = knowledge
        if self._given:
            self._inner.know(Knowledge(**{k: getattr(knowledge, k) for k in self._given}))

    def step(self, frame: AntennaFrame) -> Any:
        """As of a `Controller`."""
        command = self._inner.step(frame)
        if self._ticks % EVERY == 0:
            for row in np.flatnonzero(np.isfinite(frame.t)).tolist():
                self._sample(row, frame, command)
        self._ticks += 1
        return command

    def _sample(self, row: int, frame: AntennaFrame, command: Any) -> None:
        world, truth = self._robot.world(row), self._truth
        yaws = command.yaw.shape[1]
        angles, torques = world.drives()[:yaws], world.drive_torques()[:yaws]
        known = [float(getattr(truth, kind)[row]) for kind in KNOWABLE]
        self.samples.append(
            (
                *(row, frame.t[row], *world.head[:2], world.heading, *frame.counts[row]),
                *(self._inner.maneuver[row], self._inner.phase[row], *known),
                *(np.abs(torques).mean(), np.abs(command.yaw[row] - angles).mean(), angles[0]),
            )
        )


def config_of(scene: str, trials: int) -> TunnelConfig:
    """The trials of a scene."""
    return TunnelConfig(seed=SEED, scene=scene, trials=trials, time_limit=LIMIT)


def run_task(folder: Path, scene: str, condition: str, first: int) -> str:
    """Run AT_ONCE trials from number `first` on, and write rows and samples of them."""
    name, knows = CONDITIONS[condition]
    path = folder / f"{scene}-{condition}-{first}.npz"
    if path.exists():
        return path.stem
    config = config_of(scene, first + AT_ONCE)
    robots: list[Any] = []
    made: list[Recorded] = []

    def bodies(batch: int) -> Any:
        scene_drawn, robot = cpu_bodies(config)(batch)
        robots.append(robot)
        return scene_drawn, robot

    def make(_: str, control: Any, robot: Any, batch: int) -> Any:
        inner = make_controller(name, control, robot, batch)
        made.append(Recorded(inner, knows, robots[-1], batch))
        return made[-1]

    rows: list[dict[str, Any]] = []
    numbers = list(range(first, first + AT_ONCE))
    run_trials(
        *(config, name, numbers, lambda found: rows.append(asdict(found[0]))),
        apparatus=Apparatus(make, bodies),
    )
    samples = np.array(made[0].samples, np.float32)
    samples[:, 0] += first
    short = path.with_suffix(".part")
    with short.open("wb") as file:
        np.savez_compressed(file, samples=samples, rows=json.dumps(rows))
    short.rename(path)
    return path.stem


def trials(folder: Path, rounds: int, workers: int) -> None:
    """Run all trials, a few of every cell after the other."""
    folder.mkdir(parents=True, exist_ok=True)
    tasks = [
        (folder, scene, condition, AT_ONCE * number)
        for number in range(rounds)
        for some in (("nothing", "side", "map"), ("jam", "facing", "free", "closed-1"))
        for scene in SCENES
        for condition in some
    ]
    with ProcessPoolExecutor(workers) as pool:
        for done in pool.map(run_task, *zip(*tasks, strict=True)):
            print(done, flush=True)


def rows_of(folder: Path) -> dict[tuple[str, str], dict[int, Any]]:
    """The rows of all tasks that are done, by scene and condition, then by trial."""
    found: dict[tuple[str, str], dict[int, Any]] = {}
    for path in sorted(folder.glob("*.npz")):
        scene, _, rest = path.stem.partition("-")
        condition = rest.rpartition("-")[0]
        with np.load(path) as file:
            for row in json.loads(str(file["rows"])):
                found.setdefault((scene, condition), {})[row["trial"]] = row
    return found


def worth(folder: Path) -> None:
    """What the knowledge saves against `timed` without any, trial by trial."""
    found, scenes = rows_of(folder), {}
    for scene in SCENES:
        cells = {name: found.get((scene, name), {}) for name in CONDITIONS}
        base = cells["nothing"]
        scenes[scene] = {
            name: _cell(cells[name], base)
            for name in CONDITIONS
            if len(cells[name].keys() & base.keys()) >= AT_ONCE
        }
    pooled = {
        name: _pooled([scenes[scene][name] for scene in SCENES if name in scenes[scene]])
        for name in CONDITIONS
        if name != "nothing"
    }
    result = {"seed": SEED, "time_limit_s": LIMIT, "scenes": scenes, "pooled": pooled}
    (HERE / "knowledge.json").write_text(json.dumps(result, indent=1) + "\n")
    (HERE / "knowledge.png").write_bytes(render(_figure(scenes))["png"])
    tell_worth(result)


def tell_worth(result: dict[str, Any]) -> None:
    """Write the table of what the knowledge saves, a column for each scene."""
    scenes, pooled = result["scenes"], result["pooled"]
    trials = {cell["trials"] for cells in scenes.values() for cell in cells.values()}
    lines = [
        f"Seed {SEED}, {' to '.join(map(str, sorted(trials)))} trials a cell of at most "
        f"{LIMIT:g} s; a failure counts as {LIMIT:g} s. Each cell: mean time, how many crossed, "
        "and the time saved against `timed` that knows nothing, on the same trials, with its 95 % "
        "interval.",
        "",
        row("[s]", *(f"`{scene}`" for scene in scenes), "all scenes alike"),
        row(*["---"] * (len(scenes) + 2)),
    ]
    others = {"map": "`map`", "closed-1": "`closed-1`, nothing"}
    for name in CONDITIONS:
        cells = [_told(cells[name], name) if name in cells else "" for cells in scenes.values()]
        if name in pooled:
            cell = pooled[name]
            span = _span(cell["saved_s"], cell["saved_95_s"])
            cells.append(f"**{span}**, {100 * cell['share']:.0f} %")
        lines += [row(others.get(name, f"`timed`, {name}"), *cells, *[""] * (name not in pooled))]
    _write("worth", lines)


def _told(cell: dict[str, Any], name: str) -> str:
    """Mean time, crossings, and the time saved."""
    saved = "" if name == "nothing" else f": {_span(cell['saved_s'], cell['saved_95_s'])}"
    return f"{cell['mean_s']:.1f}, {cell['successes']}{saved}"


def _span(value: float, ends: Any) -> str:
    return f"{value:+.1f}" + (f" ({ends[0]:+.1f} to {ends[1]:+.1f})" if ends else "")


def _write(part: str, lines: list[str]) -> None:
    """Put lines between the two comments of a part on the page."""
    page = HERE / "knowledge.md"
    begin, rest = page.read_text().split(f"<!-- {part}: ")
    head, rest = rest.split("\n", 1)
    _, end = rest.split(f"<!-- end of {part} -->")
    text = "\n".join(lines)
    page.write_text(f"{begin}<!-- {part}: {head}\n{text}\n<!-- end of {part} -->{end}")


def _cell(cell: dict[int, Any], base: dict[int, Any]) -> dict[str, Any]:
    both = sorted(t for t in cell.keys() & base.keys() if "invalid" not in _ends(cell, base, t))
    times = np.array([[rows[t]["time_s"] for t in both] for rows in (base, cell)])
    won = np.array([[rows[t]["outcome"] == "success" for t in both] for rows in (base, cell)])
    test = compare(won[0], won[1], times[0], times[1], LIMIT)
    saved = (times[0] - times[1]).tolist()
    return {
        "trials": len(both),
        "successes": int(won[1].sum()),
        "mean_s": float(times[1].mean()),
        "saved_s": test.time_difference_s,
        "saved_95_s": test.time_difference_95,
        "spread_s": float(np.std(saved, ddof=1)),
    }


def _ends(cell: dict[int, Any], base: dict[int, Any], trial: int) -> tuple[str, str]:
    return cell[trial]["outcome"], base[trial]["outcome"]


def _pooled(cells: list[dict[str, Any]]) -> dict[str, Any]:
    """The mean over scenes, each with the same weight, and its 95 % interval (Student's)."""
    mean = float(np.mean([cell["saved_s"] for cell in cells]))
    error = float(np.sqrt(sum(c["spread_s"] ** 2 / c["trials"] for c in cells)) / len(cells))
    share = mean / float(np.mean([c["mean_s"] + c["saved_s"] for c in cells]))
    reach = error * float(student.ppf(0.975, sum(cell["trials"] - 1 for cell in cells)))
    ends = [mean - reach, mean + reach]
    return {"scenes": len(cells), "saved_s": mean, "saved_95_s": ends, "share": share}


@styled
def _figure(scenes: dict[str, Any]) -> Figure:
    """Time saved by each kind of knowledge, a panel for each scene."""
    shown = [scene for scene in SCENES if len(scenes[scene]) > 1]
    figure = canvas(WIDTH, 1.15 * len(shown) + 0.6)
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    names = [name for name in CONDITIONS if name != "nothing"]
    for panel, scene in zip(panels, shown, strict=True):
        for place, name in enumerate(names):
            cell = scenes[scene].get(name)
            if cell is None:
                panel.text(0.0, place, " not run", va="center", fontsize=7, color=INK)
                continue
            low, high = cell["saved_95_s"] or (cell["saved_s"],) * 2
            panel.plot([low, high], [place, place], color=COLOUR, linewidth=2)
            panel.plot(cell["saved_s"], place, "o", color=COLOUR, markersize=4)
        panel.axvline(0.0, color=INK, linewidth=0.8)
        panel.set_yticks(range(len(names)), names)
        panel.set_ylim(len(names) - 0.5, -0.5)
        base = scenes[scene]["nothing"]
        title = f"{scene}: timed takes {base['mean_s']:.0f} s ({base['trials']} trials)"
        panel.set_title(title, loc="left", fontsize=8)
    panels[-1].set_xlabel("time saved against timed that knows nothing [s]")
    return figure


PLACE = ("x", "y", "heading")
ASIDE = np.radians(30.0)
"""Angle to the point ahead from which on there is a side to ask for [rad]."""
CYCLE = 33
"""Samples of a gait cycle."""
GYRO_NOISE = 0.007
"""Noise density of the rate of a BMI270 [deg/s/√Hz] (BST-BMI270-DS000)."""
GYRO_OFFSET = 0.5
"""Its zero-rate offset over life, one standard deviation [deg/s] (BST-BMI270-DS000)."""
SETS = {
    "antennae now": ("now",),
    "antennae, 5 s": ("now", "past"),
    "antennae and own commands": ("now", "past", "own"),
    "own commands alone": ("own",),
    "gyro and own commands": ("own", "gyro"),
    "joints and own commands": ("own", "joint"),
    "all": ("now", "past", "own", "gyro", "joint"),
}
"""What a classifier reads."""


def features(samples: Any, rng: np.random.Generator) -> dict[str, Any]:
    """What a robot has at each sample of one trial, by kind, each of shape (n, columns).

    Args:
        samples: Columns as in `SIGNALS`, shape (n, columns).
        rng: Chance of the gyro.
    """
    at = {name: samples[:, i].astype(float) for i, name in enumerate(SIGNALS)}
    flex = (1872.0 - np.stack([at["left"], at["right"]], axis=1)) / 473.0
    more, less = flex.max(axis=1, keepdims=True), flex.min(axis=1, keepdims=True)
    turn = np.where(at["maneuver"] == 1, 1.0, np.where(at["maneuver"] == 2, -1.0, 0.0))
    step = EVERY * 0.01
    now = [_mean(flex, CYCLE), flex[:, :1] - flex[:, 1:], more, less]
    change = np.abs(flex - _past(flex, CYCLE))
    past = [
        *(_mean(flex, 100), _spread(flex, CYCLE), _mean(change, CYCLE // 2)),
        *(_past(_mean(flex, 60), 60), _mean(flex[:, :1] - flex[:, 1:], 100)),
        _mean((more < 0.1).astype(float), 20),
    ]
    kinds = np.stack([at["maneuver"] == kind for kind in range(4)], axis=1).astype(float)
    since = _since(at["maneuver"]) * step
    nominal = np.cumsum(turn) * step * np.radians(24.0)
    own = [
        *(kinds, _mean(kinds, 100), _mean(kinds, 300), since[:, None], at["t"][:, None]),
        *(_last(turn)[:, None], nominal[:, None], np.cos(nominal)[:, None]),
        *(_mean(turn[:, None], 200), np.sin(at["phase"])[:, None], np.cos(at["phase"])[:, None]),
    ]
    true = np.gradient(np.unwrap(at["heading"]), step)
    sigma = np.radians(GYRO_NOISE) * np.sqrt(0.5 / step)
    offset = np.radians(GYRO_OFFSET) * rng.standard_normal()
    rate = true + offset + sigma * rng.standard_normal(len(true))
    heading = np.cumsum(rate)[:, None] * step
    gyro = [
        *(heading, np.cos(heading), np.sin(heading), _mean(heading, CYCLE)),
        *(heading - _past(heading, n) for n in (CYCLE, 100, 200)),
        *(_mean(np.abs(rate)[:, None], CYCLE), _spread(heading, CYCLE)),
    ]
    strain = np.stack([at["load"], at["error"], at["bend"]], axis=1)
    joint = [strain, _mean(strain, CYCLE), _spread(strain, CYCLE), strain - _past(strain, CYCLE)]
    groups = {"now": now, "past": past, "own": own, "gyro": gyro, "joint": joint}
    return {name: np.concatenate(parts, axis=1) for name, parts in groups.items()}


def _past(values: Any, samples: int) -> Any:
    """Values some samples ago; the first ones before."""
    return np.concatenate([np.repeat(values[:1], samples, axis=0), values])[: len(values)]


def _mean(values: Any, samples: int) -> Any:
    """Mean over the last samples."""
    padded = np.concatenate([np.repeat(values[:1], samples, axis=0), values])
    total = np.cumsum(padded, axis=0)
    return (total[samples:] - total[:-samples]) / samples


def _spread(values: Any, samples: int) -> Any:
    """Standard deviation over the last samples."""
    return np.sqrt(np.maximum(_mean(values**2, samples) - _mean(values, samples) ** 2, 0.0))


def _since(maneuver: Any) -> Any:
    """Samples since the maneuver began."""
    change = np.flatnonzero(np.diff(maneuver, prepend=np.nan) != 0)
    return (
        np.arange(len(maneuver))
        - change[np.searchsorted(change, np.arange(len(maneuver)), "right") - 1]
    )


def _last(turn: Any) -> Any:
    """Side of the last turn, 0 before."""
    places = np.maximum.accumulate(np.where(turn != 0, np.arange(len(turn)), 0))
    return turn[places]


def data(folder: Path) -> tuple[dict[str, Any], dict[str, Any], Any, Any]:
    """Features, truths, scenes and trials of all conditions but `map`, twice a second."""
    parts: dict[str, list[Any]] = {}
    truths: dict[str, list[Any]] = {}
    scenes: list[Any] = []
    groups: list[Any] = []
    for path in sorted(folder.glob("*.npz")):
        scene, _, rest = path.stem.partition("-")
        condition = rest.rpartition("-")[0]
        if condition == "map":
            continue
        with np.load(path) as file:
            samples = file["samples"]
        config = config_of(scene, 1)
        drawn = scene_of(config)
        for row, seen in [(r, m) for r in np.unique(samples[:, 0]).tolist() for m in (False, True)]:
            trial = samples[samples[:, 0] == row]
            if len(trial) < 4 * CYCLE:
                continue
            rng = np.random.default_rng([SEED, int(row), len(groups)])
            some = slice(2 * CYCLE, None, 10)
            route: Any = getattr(draw_scene(config, drawn, int(row)), "route")  # noqa: B009
            x, y, heading = (trial[:, SIGNALS.index(n)].astype(float) for n in PLACE)
            heading = _mean(np.unwrap(heading)[:, None], CYCLE)[:, 0]  # without the head's swing
            places = zip(np.stack([x, y], axis=1)[some], heading[some].tolist(), strict=True)
            angles = np.array([angle_ahead(route, *place, SIDE_AHEAD) for place in places])
            side = np.sign(angles) * (np.abs(angles) > ASIDE) * (-1 if seen else 1)
            trial = mirrored(trial) if seen else trial
            truths.setdefault("side", []).append(side)
            for name, values in features(trial, rng).items():
                parts.setdefault(name, []).append(values[some])
            for kind in ("jam", "facing", "free", "maneuver"):
                truths.setdefault(kind, []).append(trial[some, SIGNALS.index(kind)])
            count = len(trial[some])
            truths.setdefault("known", []).append(np.full(count, condition))
            truths.setdefault("mirrored", []).append(np.full(count, seen))
            truths.setdefault("half", []).append(np.full(count, int(row) % 2))
            scenes.append(np.full(count, scene))
            groups.append(np.full(count, f"{scene}-{int(row)}"))
    return (
        {name: np.concatenate(values) for name, values in parts.items()},
        {name: np.concatenate(values) for name, values in truths.items()},
        np.concatenate(scenes),
        np.concatenate(groups),
    )


def mirrored(samples: Any) -> Any:
    """The samples of a trial as they were in a mirror, left for right."""
    found = samples.copy()
    at = {name: i for i, name in enumerate(SIGNALS)}
    found[:, [at["left"], at["right"]]] = samples[:, [at["right"], at["left"]]]
    found[:, [at["heading"], at["bend"]]] *= -1.0
    found[:, at["phase"]] += np.pi  # the right legs step where the left ones did
    turns = samples[:, at["maneuver"]]
    found[:, at["maneuver"]] = np.where(turns == 1, 2, np.where(turns == 2, 1, turns))
    return found


def _auc(score: Any, truth: Any) -> float:
    """Area under the receiver's curve, by ranks."""
    ranks = rankdata(score)
    ones = int(truth.sum())
    rest = len(truth) - ones
    return float((ranks[truth].sum() - ones * (ones + 1) / 2) / (ones * rest))


def readings(folder: Path, kinds: list[str]) -> None:
    """How well what a robot has tells side, jam, facing and free, on scenes left out."""
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    parts, truths, scenes, groups = data(folder)
    walking = truths["maneuver"] == 0
    asked = {
        "side": (truths["side"] > 0, walking & (truths["side"] != 0)),
        "jam": (truths["jam"] > 0, walking),
        "facing": (truths["facing"] > 0, walking),
        "free": (truths["free"] > 0, walking),
        "side when jammed": (truths["side"] > 0, (truths["jam"] > 0) & (truths["side"] != 0)),
    }
    path = HERE / "readings.json"
    result: dict[str, Any] = {"samples": {}, "auc": {}}
    if kinds and path.exists():
        result = json.loads(path.read_text())
    for kind in kinds or asked:
        truth, chosen = asked[kind]
        told = truths["known"] == kind.split()[0]  # whose commands would give the truth away
        chosen = chosen & ~told
        half = None
        if kind.startswith("side"):
            half = truths[
                "half"
            ]  # trials of a number begin alike in all scenes, and go to one side
        else:
            chosen = chosen & ~truths["mirrored"].astype(bool)
        result["samples"][kind] = [int((truth & chosen).sum()), int((~truth & chosen).sum())]
        result["auc"][kind] = {}
        for name, wanted in SETS.items():
            x = np.concatenate([parts[part] for part in wanted], axis=1)
            models = {
                "threshold": None,
                "logistic": make_pipeline(
                    StandardScaler(), LogisticRegression(max_iter=300, C=0.1)
                ),
                "boosting": HistGradientBoostingClassifier(
                    max_iter=60,
                    learning_rate=0.1,
                    max_leaf_nodes=15,
                    min_samples_leaf=60,
                    random_state=0,
                ),
            }
            result["auc"][kind][name] = {
                label: _left_out(
                    *(model, x[chosen], truth[chosen], scenes[chosen], groups[chosen]),
                    None if half is None else half[chosen],
                )
                for label, model in models.items()
            }
            print(kind, name, result["auc"][kind][name], flush=True)
    path.write_text(json.dumps(result, indent=1) + "\n")
    tell_readings(result)


def tell_readings(result: dict[str, Any]) -> None:
    """Write the tables of what the readings tell."""
    lines = ["AUC with 95 % interval; in brackets the samples that are so, and that are not."]
    for kind, sets in result["auc"].items():
        counts = " and ".join(f"{count}" for count in result["samples"][kind])
        labels = ("threshold", "logistic", "boosting")
        lines += ["", row(f"{kind} ({counts})", *labels), row(*["---"] * 4)]
        for name, found in sets.items():
            cells = [
                f"{m['mean']:.2f} ({m['interval_95'][0]:.2f}–{m['interval_95'][1]:.2f})"
                for m in (found[label] for label in labels)
            ]
            lines += [row(name, *cells)]
    _write("readings", lines)


def _left_out(
    model: Any, x: Any, truth: Any, scenes: Any, groups: Any, half: Any | None
) -> dict[str, Any]:
    """AUC of each scene by a model of the others, their mean, and its interval over trials.

    With halves, of shape (n,), a model learns on one half of the trials of the other scenes, and is
    tested on the other half of this one.
    """
    scores = np.full(len(truth), np.nan)
    by_scene: dict[str, float] = {}
    for scene in SCENES:
        out = scenes == scene
        if not (0 < truth[out].sum() < out.sum()) or out.all():
            continue
        for part in (None,) if half is None else (0, 1):
            test = out if part is None else out & (half == part)
            learn = ~out if part is None else ~out & (half != part)
            if model is None:
                areas = np.array([_auc(column, truth[learn]) for column in x[learn].T])
                best = int(np.argmax(np.abs(areas - 0.5)))
                scores[test] = x[test, best] * np.sign(areas[best] - 0.5)
            elif test.any():
                scores[test] = model.fit(x[learn], truth[learn]).predict_proba(x[test])[:, 1]
        by_scene[scene] = _auc(scores[out], truth[out])
    rng, means = np.random.default_rng(SEED), list[float]()
    places = {g: np.flatnonzero(groups == g) for g in np.unique(groups)}
    names = {scene: [g for g in places if g.startswith(f"{scene}-")] for scene in by_scene}
    for _ in range(200):
        areas = []
        for scene in by_scene:
            drawn = np.concatenate([places[g] for g in rng.choice(names[scene], len(names[scene]))])
            if 0 < truth[drawn].sum() < len(drawn):
                areas.append(_auc(scores[drawn], truth[drawn]))
        if areas:
            means.append(float(np.mean(areas)))
    ends = np.percentile(means, [2.5, 97.5]).round(3).tolist()
    mean = round(float(np.mean(list(by_scene.values()))), 3)
    return {
        "mean": mean,
        "interval_95": ends,
        "scenes": {s: round(a, 3) for s, a in by_scene.items()},
    }


def main(argv: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=["trials", "worth", "readings"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kinds", nargs="*", default=[], help="of readings: those to fit anew")
    asked = parser.parse_args(argv)
    if asked.part == "trials":
        trials(asked.folder, asked.rounds, asked.workers)
    elif asked.part == "worth":
        worth(asked.folder)
    else:
        readings(asked.folder, asked.kinds)


if __name__ == "__main__":
    main(sys.argv[1:])
