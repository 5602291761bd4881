"""Weighs settings by what the paper says: `python docs/science/published.py PART FOLDER...`.

Parts, over folders of `antennate study studies/published_tunnel.toml` or of later stages:
`weigh` fits the outcome over the unknowns, and writes what is left of their ranges to
docs/science/published_tunnel.json and its figure. `hidden` prints a study of three hidden settings;
`recover` weighs by what came out there, the first folder, and asks whether they are found. `next`
prints a study of settings drawn from what is left. Needs `uv run --with scikit-learn`.
The likelihoods are those of docs/science/published.md.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom, norm

Floats = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
STUDY = ROOT / "studies" / "published_tunnel.toml"
RESULT = Path(__file__).with_name("published_tunnel.json")
CROSSED = {"open": (6, 10), "paper": (10, 10)}
"""Robots that crossed, of how many."""
SPEED = {"open": 0.04, "paper": 0.12}
"""Mean speed of those that crossed [m/s]."""
SPREAD = 0.15
"""Standard deviation of the logarithm of such a mean beside that of chance."""
DRAWS = 100_000
"""Settings that are weighed."""
FITS = 12
"""Fits to rows drawn anew with replacement: what the rows leave open of the outcome."""
FOLDS = 5
NARROWED = 0.02
"""Information from which on an unknown is told by the data [nats]."""
HIDDEN = 20261129
"""Seed of hidden settings."""


@dataclass(frozen=True)
class Unknowns:
    """The axes of the study, and each as numbers from 0 to 1.

    Attributes:
        axes: By dotted name a range, or the values of a list.
    """

    axes: Mapping[str, Any]

    @classmethod
    def of(cls, file: Path) -> Unknowns:
        """Those that a study varies, but its seed."""
        vary = tomllib.loads(file.read_text(encoding="utf-8"))["vary"]
        return cls({name: axis for name, axis in vary.items() if name != "seed"})

    @property
    def names(self) -> list[str]:
        """One an unknown number; of a tuple one an entry."""
        return [
            f"{name}[{k}]" if count > 1 else name
            for name, axis in self.axes.items()
            for count in [len(_entries(_choices(axis)[0])) if isinstance(axis, list) else 1]
            for k in range(count)
        ]

    def shares(self, values: Mapping[str, Any]) -> list[float]:
        """A setting as numbers from 0 to 1, one a name."""
        found: list[float] = []
        for name, axis in self.axes.items():
            if isinstance(axis, list):
                columns = np.array([_entries(choice) for choice in _choices(axis)], float)
                low, high = columns.min(axis=0), columns.max(axis=0)
                found += [*((np.array(_entries(values[name])) - low) / (high - low))]
            elif axis.get("log"):
                found.append(_share(*map(math.log, (values[name], axis["low"], axis["high"]))))
            else:
                found.append(_share(values[name], axis["low"], axis["high"]))
        return found

    def draw(self, rng: np.random.Generator) -> dict[str, Any]:
        """A setting, drawn from the ranges."""
        values: dict[str, Any] = {}
        for name, axis in self.axes.items():
            if isinstance(axis, list):
                values[name] = axis[int(rng.integers(len(axis)))]
            elif axis.get("whole"):
                values[name] = int(rng.integers(axis["low"], axis["high"] + 1))
            elif axis.get("log"):
                values[name] = math.exp(rng.uniform(math.log(axis["low"]), math.log(axis["high"])))
            else:
                values[name] = float(rng.uniform(axis["low"], axis["high"]))
        return values


def _share(value: float, low: float, high: float) -> float:
    return (value - low) / (high - low)


def _choices(axis: Any) -> list[Any]:
    return list(axis)


def _entries(value: Any) -> list[float]:
    return [float(v) for v in value] if isinstance(value, list) else [float(value)]


@dataclass(frozen=True)
class Rows:
    """Trials of both robots.

    Attributes:
        x: The setting of each pair of trials as numbers from 0 to 1, shape (n, unknowns).
        crossed: By robot whether it crossed, shape (n,).
        speed: By robot the logarithm of its mean speed where it crossed, else NaN.
        nearer: 1 where the one with feedback was nearer to the middle, 0 where not; NaN where not
            both crossed.
        groups: Which point of a study each is of, shape (n,).
    """

    x: Floats
    crossed: dict[str, Floats]
    speed: dict[str, Floats]
    nearer: Floats
    groups: NDArray[np.int64]


def read(folders: Sequence[Path], unknowns: Unknowns) -> Rows:
    """Pairs of trials of one setting and one tunnel.

    Raises:
        SystemExit: There are none.
    """
    pairs: dict[tuple[int, str, str], dict[str, dict[str, str]]] = {}
    for number, folder in enumerate(folders):
        with (folder / "trials.csv").open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                if row["status"] == "ok":
                    key = (number, row["point"], row["trial"])
                    pairs.setdefault(key, {})[row["controller"]] = row
    whole = {key: pair for key, pair in pairs.items() if set(SPEED) <= set(pair)}
    if not whole:
        raise SystemExit(f"{folders[0]}: expected trials of {' and '.join(SPEED)}, found none")
    x, crossed, speed, nearer = [], {n: [] for n in SPEED}, {n: [] for n in SPEED}, []
    for pair in whole.values():
        x.append(unknowns.shares(_values(unknowns, pair["open"])))
        for name in SPEED:
            row, success = pair[name], pair[name]["outcome"] == "success"
            crossed[name].append(float(success))
            way = float(row["progress_m"]) / float(row["time_s"])
            speed[name].append(math.log(way) if success else math.nan)
        both = all(pair[name]["outcome"] == "success" for name in SPEED)
        off = [float(pair[name]["offset_m"] or "nan") for name in ("paper", "open")]
        nearer.append(float(off[0] < off[1]) if both else math.nan)
    places = {key[:2]: place for place, key in enumerate(dict.fromkeys(k[:2] for k in whole))}
    return Rows(
        np.array(x),
        {name: np.array(v) for name, v in crossed.items()},
        {name: np.array(v) for name, v in speed.items()},
        np.array(nearer),
        np.array([places[key[:2]] for key in whole]),
    )


def _values(unknowns: Unknowns, row: Mapping[str, str]) -> dict[str, Any]:
    """The values of a row as those of the study file."""
    found: dict[str, Any] = {}
    for name, axis in unknowns.axes.items():
        text = row[name]
        if isinstance(axis, list) and isinstance(axis[0], list):
            found[name] = [float(word) for word in text.split()]
        elif text in ("True", "False"):
            found[name] = text == "True"
        else:
            found[name] = float(text)
    return found


def models() -> dict[str, Callable[[], Any]]:
    """Models of a chance over the unknowns, the constant first."""
    from sklearn.dummy import DummyClassifier
    from sklearn.ensemble import HistGradientBoostingClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    def logistic(degree: int, strength: float) -> Any:
        features = PolynomialFeatures(degree, include_bias=False)
        return make_pipeline(
            features, StandardScaler(), LogisticRegression(C=strength, max_iter=2000)
        )

    return {
        "constant": lambda: DummyClassifier(strategy="prior"),
        **{f"linear, C {c:g}": (lambda c=c: logistic(1, c)) for c in (0.01, 0.1, 1.0)},
        **{f"squares, C {c:g}": (lambda c=c: logistic(2, c)) for c in (1e-4, 1e-3, 1e-2)},
        "trees": lambda: HistGradientBoostingClassifier(
            max_iter=60, learning_rate=0.05, max_leaf_nodes=8, min_samples_leaf=20, random_state=0
        ),
    }


def regressions() -> dict[str, Callable[[], Any]]:
    """Models of a number over the unknowns, the constant first."""
    from sklearn.dummy import DummyRegressor
    from sklearn.linear_model import Ridge
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler

    def ridge(degree: int, strength: float) -> Any:
        features = PolynomialFeatures(degree, include_bias=False)
        return make_pipeline(features, StandardScaler(), Ridge(strength))

    return {
        "constant": DummyRegressor,
        **{f"linear, {c:g}": (lambda c=c: ridge(1, c)) for c in (1.0, 10.0, 100.0)},
        **{f"squares, {c:g}": (lambda c=c: ridge(2, c)) for c in (100.0, 1000.0, 10000.0)},
    }


@dataclass(frozen=True)
class Fitted:
    """A model that was chosen.

    Attributes:
        name: Which.
        loss: Its mean loss on settings left out, and that of the constant: logarithmic of a
            chance, squared of a number.
        fits: It, fitted to rows that were drawn anew.
        spread: Standard deviation about it on settings left out; 0 of a chance.
    """

    name: str
    loss: tuple[float, float]
    fits: list[Any]
    spread: float = 0.0

    def at(self, x: Floats) -> Floats:
        """Chance or number of each fit, shape (fits, n)."""
        if self.spread:
            return np.array([fit.predict(x) for fit in self.fits])
        return np.array([fit.predict_proba(x)[:, 1] for fit in self.fits])


def choose(x: Floats, y: Floats, groups: NDArray[np.int64], chance: bool) -> Fitted:
    """The model of the least loss on points that were left out, fitted to all that are known."""
    from sklearn.model_selection import GroupKFold

    known = np.isfinite(y)
    x, y, groups = x[known], y[known], groups[known]
    losses: dict[str, float] = {}
    kinds = models() if chance else regressions()
    for name, make in kinds.items():
        loss = np.zeros(len(y))
        for train, test in GroupKFold(FOLDS).split(x, y, groups):
            model = make().fit(x[train], y[train].astype(int) if chance else y[train])
            if chance:
                p = np.clip(model.predict_proba(x[test])[:, -1], 1e-6, 1 - 1e-6)
                loss[test] = -np.where(y[test] > 0, np.log(p), np.log(1 - p))
            else:
                loss[test] = (model.predict(x[test]) - y[test]) ** 2
        losses[name] = float(loss.mean())
    best = min(losses, key=losses.__getitem__)
    rng = np.random.default_rng(0)
    fits = []
    while len(fits) < FITS:
        rows = rng.integers(len(y), size=len(y))
        if not chance or len(set(y[rows])) == 2:
            fits.append(kinds[best]().fit(x[rows], y[rows].astype(int) if chance else y[rows]))
    spread = 0.0 if chance else math.sqrt(losses[best])
    return Fitted(best, (losses[best], losses["constant"]), fits, spread)


@dataclass(frozen=True)
class Outcome:
    """Models of all that the data speak of."""

    crossed: dict[str, Fitted]
    speed: dict[str, Fitted]
    nearer: Fitted

    @classmethod
    def of(cls, rows: Rows) -> Outcome:
        """Fitted to trials."""
        x, groups = rows.x, rows.groups
        return cls(
            {n: choose(x, y, groups, chance=True) for n, y in rows.crossed.items()},
            {n: choose(x, y, groups, chance=False) for n, y in rows.speed.items()},
            choose(x, rows.nearer, groups, chance=True),
        )

    def likelihoods(self, x: Floats, data: Data) -> dict[str, Floats]:
        """Likelihood of each statement in settings, mean over the fits, shape (n,)."""
        found = {}
        for name, model in self.crossed.items():
            found[f"{name} crosses"] = binom.pmf(*data.crossed[name], model.at(x)).mean(axis=0)
        for name, model in self.speed.items():
            count = data.crossed[name][0]
            if count:
                sd = math.hypot(model.spread / math.sqrt(count), SPREAD)
                off = math.log(data.speed[name]) - model.at(x)
                found[f"speed of {name}"] = norm.pdf(off, scale=sd).mean(axis=0)
        if data.nearer is not None:
            p = self.nearer.at(x).mean(axis=0)
            found["centred"] = p if data.nearer else 1 - p
        return found


@dataclass(frozen=True)
class Data:
    """What is known of some robots: how many crossed, how fast, whether nearer to the middle."""

    crossed: Mapping[str, tuple[int, int]]
    speed: Mapping[str, float]
    nearer: bool | None


PAPER = Data(CROSSED, SPEED, nearer=True)


def weights_of(likelihoods: Mapping[str, Floats]) -> Floats:
    """Weights of draws, their sum 1."""
    product = np.prod(list(likelihoods.values()), axis=0)
    if not product.sum() > 0:
        raise SystemExit("no setting within the ranges has a likelihood above zero")
    return product / product.sum()


def quantiles(values: Floats, weights: Floats, at: Sequence[float]) -> list[float]:
    """Weighted quantiles."""
    order = np.argsort(values)
    return np.interp(at, np.cumsum(weights[order]), values[order]).tolist()


def left_of(names: Sequence[str], x: Floats, weights: Floats) -> dict[str, Any]:
    """Of each unknown what is left: quantiles as shares of its range, and by how much it narrowed.

    `narrowed` is the information in nats, from counts in ten bins, less what chance alone gives.
    """
    effective = 1.0 / float((weights**2).sum())
    found = {}
    for k, name in enumerate(names):
        edges = np.unique(np.quantile(x[:, k], np.linspace(0, 1, 11)))
        share, _ = np.histogram(x[:, k], edges, weights=weights)
        prior = np.histogram(x[:, k], edges)[0] / len(x)
        there = share > 0
        nats = float((share[there] * np.log(share[there] / prior[there])).sum())
        low, middle, high = quantiles(x[:, k], weights, (0.05, 0.5, 0.95))
        found[name] = {
            "quantiles": [round(v, 3) for v in (low, middle, high)],
            "narrowed": round(nats - (len(prior) - 1) / (2 * effective), 3),
            "share": [round(float(v), 4) for v in share / prior],
        }
    return found


def prior(unknowns: Unknowns, count: int, seed: int = 1) -> tuple[list[dict[str, Any]], Floats]:
    """Settings drawn from the ranges, and as numbers from 0 to 1."""
    rng = np.random.default_rng(seed)
    settings = [unknowns.draw(rng) for _ in range(count)]
    return settings, np.array([unknowns.shares(setting) for setting in settings])


def weigh(folders: Sequence[Path]) -> None:
    """Write what the paper's data leave of the ranges."""
    unknowns = Unknowns.of(STUDY)
    rows = read(folders, unknowns)
    outcome = Outcome.of(rows)
    _, x = prior(unknowns, DRAWS)
    likelihoods = outcome.likelihoods(x, PAPER)
    weights = weights_of(likelihoods)
    fitted = {
        **{f"{name} crosses": model for name, model in outcome.crossed.items()},
        **{f"speed of {name}": model for name, model in outcome.speed.items()},
        "centred": outcome.nearer,
    }
    best = {name: float(v.max()) for name, v in likelihoods.items()}
    result = {
        "pairs": len(rows.x),
        "settings": len(set(rows.groups.tolist())),
        "crossed": {name: round(float(v.mean()), 3) for name, v in rows.crossed.items()},
        "speed": {n: round(math.exp(float(np.nanmean(v))), 4) for n, v in rows.speed.items()},
        "models": {
            name: {"chosen": m.name, "loss": round(m.loss[0], 4), "constant": round(m.loss[1], 4)}
            for name, m in fitted.items()
        },
        "effective_draws": round(1.0 / float((weights**2).sum()), 1),
        "evidence": {name: round(float(v.mean()), 5) for name, v in likelihoods.items()},
        "together": float(np.prod(list(likelihoods.values()), axis=0).mean()),
        "largest": {name: round(v, 4) for name, v in best.items()},
        "there": {
            name: [round(v, 4) for v in quantiles(m.at(x).mean(axis=0), weights, (0.05, 0.5, 0.95))]
            for name, m in fitted.items()
        },
        "left": left_of(unknowns.names, x, weights),
    }
    RESULT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    for name, found in result["models"].items():
        print(f"{name}: {found}, likelihood {result['evidence'][name]}, at most {best[name]:.4f}")
    print(f"effective draws: {result['effective_draws']} of {DRAWS}")
    print("in what is left:", result["there"])
    narrowed = sorted(result["left"].items(), key=lambda item: -item[1]["narrowed"])
    for name, found in narrowed[:12]:
        print(f"{name:45} {found['narrowed']:6.3f} nats, quantiles {found['quantiles']}")


def study_of(settings: Sequence[Mapping[str, Any]], trials: int, seed: int) -> str:
    """A study file of these settings, each with the same tunnels."""
    lines = [
        'experiment = "tunnel"',
        'plan = "list"',
        f"trials = {trials}",
        "",
        "[settings]",
        f"controllers = {json.dumps(list(SPEED))}",
        f"seed = {seed}",
        "",
        "[vary]",
        *(f'"{name}" = {json.dumps([s[name] for s in settings])}' for name in settings[0]),
    ]
    return "\n".join(lines)


def following(folders: Sequence[Path], count: int, trials: int, seed: int) -> str:
    """A study of settings drawn from what is left."""
    unknowns = Unknowns.of(STUDY)
    settings, x = prior(unknowns, DRAWS, seed)
    weights = weights_of(Outcome.of(read(folders, unknowns)).likelihoods(x, PAPER))
    rng = np.random.default_rng(seed)
    chosen = rng.choice(DRAWS, size=count, replace=False, p=weights)
    return study_of([settings[k] for k in chosen], trials, 561000 + seed)


def recover(folders: Sequence[Path]) -> None:
    """Say whether hidden settings lie within what their own data leave."""
    unknowns = Unknowns.of(STUDY)
    hidden = read(folders[:1], unknowns)
    outcome = Outcome.of(read(folders[1:], unknowns))
    _, x = prior(unknowns, DRAWS)
    told = inside = 0
    for place in range(int(hidden.groups.max()) + 1):
        here = hidden.groups == place
        truth = hidden.x[here][0]
        crossed, speed = {}, {}
        for name in SPEED:
            won = hidden.crossed[name][here] > 0
            crossed[name] = int(won.sum()), len(won)
            if won.any():
                speed[name] = math.exp(float(hidden.speed[name][here][won].mean()))
        closer = hidden.nearer[here]
        known = np.isfinite(closer)
        nearer = bool(closer[known].mean() > 0.5) if known.any() else None
        data = Data(crossed, speed, nearer)
        weights = weights_of(outcome.likelihoods(x, data))
        print(f"hidden setting {place}: {data}, {1 / float((weights**2).sum()):.0f} draws")
        for k, (name, found) in enumerate(left_of(unknowns.names, x, weights).items()):
            low, _, high = found["quantiles"]
            if found["narrowed"] > NARROWED:
                told += 1
                inside += low <= truth[k] <= high
                print(f"  {name}: {low} to {high}, hidden {truth[k]:.3f}")
    print(f"{inside} of {told} unknowns that the data narrow lie within their 90 % interval")


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("weigh", "hidden", "recover", "next"))
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    told = parser.parse_args()
    if told.part == "hidden":
        print(study_of(prior(Unknowns.of(STUDY), 3, HIDDEN)[0], 10, HIDDEN % 9000 + 560000))
    elif told.part == "next":
        print(following(told.folders, told.count, told.trials, told.seed))
    else:
        {"weigh": weigh, "recover": recover}[told.part](told.folders)


if __name__ == "__main__":
    main()
