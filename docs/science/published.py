"""Weighs settings by what the paper says: `python docs/science/published.py PART FOLDER...`.

Parts, over folders of `antennate study studies/published_GROUP.toml` or of later stages: `weigh`
fits the outcome over the unknowns, and writes what is left of their ranges to
docs/science/published_GROUP.json and a figure. `hidden` prints a study of three hidden settings;
`recover` weighs by what came out there, the first folder, and asks whether they are found. `next`
prints a study of settings drawn from what is left, `best` names the likeliest settings by
their own trials; `rows` keeps the rows of folders as one table.
Needs `uv run --with scikit-learn`. The likelihoods are those of docs/science/published.md.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import binom, norm

from antennate.figures import FAINT, SERIES, WIDTH, canvas, render, styled

Floats = NDArray[np.float64]
Row = Mapping[str, str]
HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
SPREAD = 0.15
"""Standard deviation of the logarithm of a mean speed beside that of chance."""
DRAWS = 100_000
"""Settings that are weighed."""
FITS = 12
"""Fits to points drawn anew with replacement: what they leave open of the outcome."""
FOLDS = 5
BINS = 10
"""Most parts of the range of an unknown that are told apart."""
NARROWED = 0.02
"""Information from which on an unknown is told by the data [nats]."""
LATER = 571000
"""Seeds of later stages are this and 1 to 999 more; none is reserved or of the first stage."""
FRESH = 572001
"""Seed on which the likeliest setting is judged."""
HIDDEN = 20261129
"""Seed of hidden settings."""


@dataclass(frozen=True)
class Count:
    """So many of so many did."""

    did: int
    of: int

    def likelihood(self, chance: Floats, spread: float) -> Floats:
        """Of chances."""
        return binom.pmf(self.did, self.of, chance)

    def again(self, values: Floats) -> Count:
        """The same kind of statement on other trials."""
        return Count(int(values.sum()), len(values))


@dataclass(frozen=True)
class AtLeast:
    """That many of so many did, or more."""

    did: int
    of: int

    def likelihood(self, chance: Floats, spread: float) -> Floats:
        """Of chances."""
        return binom.sf(self.did - 1, self.of, chance)

    def again(self, values: Floats) -> Count:
        """The same kind of statement on other trials."""
        return Count(int(values.sum()), len(values))


@dataclass(frozen=True)
class Mean:
    """A mean over so many, whose logarithm the model tells."""

    value: float
    of: int

    def likelihood(self, logarithm: Floats, spread: float) -> Floats:
        """Of logarithms of means, trials about which have a standard deviation."""
        sd = math.hypot(spread / math.sqrt(self.of), SPREAD)
        return norm.pdf(math.log(self.value) - logarithm, scale=sd)

    def again(self, values: Floats) -> Mean:
        """The same kind of statement on other trials."""
        return Mean(math.exp(float(values.mean())), len(values))


@dataclass(frozen=True)
class Near:
    """A number, so far from that of the setting at most, or one that is below it.

    Attributes:
        sd: Standard deviation of the distance.
        below: Whether any number of the setting below it serves as well.
    """

    value: float
    sd: float
    below: bool = False

    def likelihood(self, number: Floats, spread: float) -> Floats:
        """Of numbers, about which the model errs with a standard deviation."""
        law = norm.cdf if self.below else norm.pdf
        return law(self.value - number, scale=math.hypot(spread, self.sd))

    def again(self, values: Floats) -> Near:
        """What another recording says: a number, as a bound is not seen."""
        return Near(float(values.mean()), self.sd)


Statement = Count | AtLeast | Mean | Near


@dataclass(frozen=True)
class Group:
    """Claims that are weighed together.

    Attributes:
        who: Column of who a row is of; rows of one point and trial belong together.
        all: Who has to be there.
        outcomes: What the paper speaks of, from the rows of all; NaN where a trial does not tell.
        paper: What it says of each.
        told: Status of rows that are read.
    """

    who: str
    all: tuple[str, ...]
    outcomes: Mapping[str, Callable[[Mapping[str, Row]], float]]
    paper: Mapping[str, Statement]
    told: tuple[str, ...] = ("ok",)


def _crossed(name: str) -> Callable[[Mapping[str, Row]], float]:
    return lambda rows: float(rows[name]["outcome"] == "success")


def _speed(name: str) -> Callable[[Mapping[str, Row]], float]:
    def logarithm(rows: Mapping[str, Row]) -> float:
        row = rows[name]
        speed = float(row["progress_m"]) / float(row["time_s"])
        return math.log(speed) if row["outcome"] == "success" else math.nan

    return logarithm


def _nearer(rows: Mapping[str, Row]) -> float:
    both = all(row["outcome"] == "success" for row in rows.values())
    off = [float(rows[name]["offset_m"]) if both else math.nan for name in ("paper", "open")]
    return float(off[0] < off[1]) if both else math.nan


def _ended(name: str, outcome: str) -> Callable[[Mapping[str, Row]], float]:
    return lambda rows: float(rows[name]["outcome"] == outcome)


def _below(name: str, degrees: float) -> Callable[[Mapping[str, Row]], float]:
    return lambda rows: float(float(rows[name]["hinge_max_deg"]) < degrees)


def _calibrated(rows: Mapping[str, Row]) -> float:
    return float(rows["calibrate"]["status"] == "ok")


def _number(of: Callable[[Callable[[str], float]], float]) -> Callable[[Mapping[str, Row]], float]:
    """Of a calibration, from its columns; NaN of a recording that was refused."""

    def number(rows: Mapping[str, Row]) -> float:
        row = rows["calibrate"]
        return of(lambda name: float(row[f"calibration.{name}"])) if _calibrated(rows) else math.nan

    return number


def _apart(column: Callable[[str], float]) -> float:
    """Logarithm of how much the speeds miss R² of 0.95 and 0.02 between them, the larger one."""
    r2 = [column(f"speeds.{k}.r2") for k in range(3)]
    return math.log(max((1 - min(r2)) / 0.05, (max(r2) - min(r2)) / 0.02, 1e-3))


def _beaten(column: Callable[[str], float]) -> float:
    """Logarithm of the sigmoid's error over that of its best rival, on pushes left out."""
    sigmoid, *rivals = (
        column(f"cross_validated_rmse.{name}") for name in ("sigmoid", "line", "isotonic")
    )
    return math.log(sigmoid / min(rivals))


GROUPS = {
    "tunnel": Group(
        "controller",
        ("open", "paper"),
        {
            "open crosses": _crossed("open"),
            "paper crosses": _crossed("paper"),
            "speed of open": _speed("open"),
            "speed of paper": _speed("paper"),
            "centred": _nearer,
        },
        {
            "open crosses": Count(6, 10),
            "paper crosses": Count(10, 10),
            "speed of open": Mean(0.04, 6),
            "speed of paper": Mean(0.12, 10),
            "centred": AtLeast(1, 1),
        },
    ),
    "wall": Group(
        "profile",
        ("stiff", "compliant", "descending"),
        {
            "stiff jams": _ended("stiff", "jam"),
            "soft slips": _ended("compliant", "slip"),
            "descending passes": _ended("descending", "success"),
            "springs below 30 deg": _below("descending", 30.0),
        },
        {
            "stiff jams": AtLeast(11, 20),
            "soft slips": AtLeast(11, 20),
            "descending passes": AtLeast(17, 20),
            "springs below 30 deg": AtLeast(20, 20),
        },
    ),
    "calibration": Group(
        "command",
        ("calibrate",),
        {
            "calibrated": _calibrated,
            "slope": _number(lambda column: math.log(column("slope"))),
            "midpoint": _number(lambda column: column("midpoint")),
            "one curve": _number(_apart),
            "sigmoid": _number(_beaten),
        },
        {
            "calibrated": Count(1, 1),
            "slope": Near(math.log(18.3), 0.1),
            "midpoint": Near(0.305, 0.025),
            "one curve": Near(0.0, 0.2, below=True),
            "sigmoid": Near(0.0, 0.05, below=True),
        },
        told=("ok", "failed"),
    ),
}


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
            for count in [
                len(axis[0]) if isinstance(axis, list) and isinstance(axis[0], list) else 1
            ]
            for k in range(count)
        ]

    @property
    def ends(self) -> list[tuple[str, str]]:
        """Its lowest and highest value in words, one a name."""
        found: list[tuple[str, str]] = []
        for axis in self.axes.values():
            if isinstance(axis, dict):
                found.append((f"{axis['low']:g}", f"{axis['high']:g}"))
            elif isinstance(axis[0], list):
                found += [(f"{min(v):g}", f"{max(v):g}") for v in zip(*axis, strict=True)]
            else:
                found.append((str(axis[0]).lower(), str(axis[-1]).lower()))
        return found

    def shares(self, values: Mapping[str, Any]) -> list[float]:
        """A setting as numbers from 0 to 1, one a name."""
        found: list[float] = []
        for name, axis in self.axes.items():
            if isinstance(axis, list) and isinstance(axis[0], str):
                found.append(axis.index(values[name]) / (len(axis) - 1))
            elif isinstance(axis, list):
                columns = np.array([_entries(choice) for choice in axis], float)
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


def _entries(value: Any) -> list[float]:
    return [float(v) for v in value] if isinstance(value, list) else [float(value)]


@dataclass(frozen=True)
class Rows:
    """Trials of all of a group in one setting and one scene.

    Attributes:
        x: The setting of each as numbers from 0 to 1, shape (n, unknowns).
        outcomes: By name what came out, shape (n,); NaN where a trial does not tell.
        points: Which point of a study each is of, shape (n,).
    """

    x: Floats
    outcomes: dict[str, Floats]
    points: NDArray[np.int64]


def lines(files: Iterable[Path]) -> Iterable[dict[str, str]]:
    """Rows of tables of studies; points are numbered on from one file to the next."""
    number = 0
    for file in files:
        points: dict[str, int] = {}
        path = file / "trials.csv" if file.is_dir() else file
        with path.open(encoding="utf-8", newline="") as table:
            for row in csv.DictReader(table):
                place = points.setdefault(row["point"], number + len(points))
                yield row | {"point": str(place)}
        number += len(points)


def read(files: Sequence[Path], group: Group, unknowns: Unknowns) -> Rows:
    """Trials that ended, of all of a group.

    Raises:
        SystemExit: There are none.
    """
    found: dict[tuple[str, str], dict[str, dict[str, str]]] = {}
    for row in lines(files):
        if row["status"] in group.told:
            who = row[group.who] or group.all[0]  # a trial that failed has no columns
            found.setdefault((row["point"], row["trial"]), {})[who] = row
    whole = {key: rows for key, rows in found.items() if set(group.all) <= set(rows)}
    if not whole:
        raise SystemExit(f"{files[0]}: expected trials of {', '.join(group.all)}, found none")
    return Rows(
        np.array(
            [unknowns.shares(_values(unknowns, rows[group.all[0]])) for rows in whole.values()]
        ),
        {
            name: np.array([of(rows) for rows in whole.values()])
            for name, of in group.outcomes.items()
        },
        np.array([int(point) for point, _ in whole]),
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
        elif isinstance(axis, list) and isinstance(axis[0], str):
            found[name] = text
        else:
            found[name] = int(text) if text.isdigit() else float(text)
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
        fits: It, fitted to points that were drawn anew.
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


def choose(x: Floats, y: Floats, points: NDArray[np.int64], chance: bool) -> Fitted:
    """The model of the least loss on points that were left out, fitted to all that are known."""
    from sklearn.model_selection import GroupKFold

    known = np.isfinite(y)
    x, y, points = x[known], y[known], points[known]
    losses: dict[str, float] = {}
    kinds = models() if chance else regressions()
    for name, make in kinds.items():
        loss = np.zeros(len(y))
        for train, test in GroupKFold(FOLDS).split(x, y, points):
            model = make().fit(x[train], y[train].astype(int) if chance else y[train])
            if chance:
                p = np.clip(model.predict_proba(x[test])[:, -1], 1e-6, 1 - 1e-6)
                loss[test] = -np.where(y[test] > 0, np.log(p), np.log(1 - p))
            else:
                loss[test] = (model.predict(x[test]) - y[test]) ** 2
        losses[name] = float(loss.mean())
    best = min(losses, key=losses.__getitem__)
    rng = np.random.default_rng(0)
    fits, settings = [], np.unique(points)
    while len(fits) < FITS:
        times = np.bincount(
            rng.integers(len(settings), size=len(settings)), minlength=len(settings)
        )
        rows = np.repeat(np.arange(len(y)), times[np.searchsorted(settings, points)])
        if not chance or len(set(y[rows])) == 2:
            fits.append(kinds[best]().fit(x[rows], y[rows].astype(int) if chance else y[rows]))
    spread = 0.0 if chance else math.sqrt(losses[best])
    return Fitted(best, (losses[best], losses["constant"]), fits, spread)


@dataclass(frozen=True)
class Outcome:
    """Models of all that the paper speaks of in a group."""

    models: dict[str, Fitted]

    @classmethod
    def of(cls, rows: Rows, group: Group) -> Outcome:
        """Fitted to trials."""
        return cls(
            {
                name: choose(rows.x, y, rows.points, isinstance(group.paper[name], Count | AtLeast))
                for name, y in rows.outcomes.items()
            }
        )

    def likelihoods(self, x: Floats, said: Mapping[str, Statement]) -> dict[str, Floats]:
        """Likelihood of each statement in settings, mean over the fits, shape (n,)."""
        return {
            name: statement.likelihood(model.at(x), model.spread).mean(axis=0)
            for name, statement in said.items()
            for model in [self.models[name]]
        }


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

    `narrowed` is the information in nats, from counts in bins, less what chance alone gives.
    """
    effective = 1.0 / float((weights**2).sum())
    found = {}
    for k, name in enumerate(names):
        values = np.unique(x[:, k])
        if len(values) > BINS:
            values = np.linspace(0.0, 1.0, BINS, endpoint=False)
        place = np.searchsorted(values, x[:, k], side="right") - 1
        share = np.bincount(place, weights, len(values))
        prior = np.bincount(place, minlength=len(values)) / len(x)
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


def weigh(name: str, files: Sequence[Path]) -> None:
    """Write what the paper's data leave of the ranges."""
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    rows = read(files, group, unknowns)
    outcome = Outcome.of(rows, group)
    _, x = prior(unknowns, DRAWS)
    likelihoods = outcome.likelihoods(x, group.paper)
    weights = weights_of(likelihoods)
    result = {
        "trials": len(rows.x),
        "settings": len(set(rows.points.tolist())),
        "mean": {n: round(float(np.nanmean(y)), 3) for n, y in rows.outcomes.items()},
        "models": {
            n: {"chosen": m.name, "loss": round(m.loss[0], 4), "constant": round(m.loss[1], 4)}
            for n, m in outcome.models.items()
        },
        "effective_draws": round(1.0 / float((weights**2).sum()), 1),
        "evidence": {n: round(float(v.mean()), 5) for n, v in likelihoods.items()},
        "largest": {n: round(float(v.max()), 4) for n, v in likelihoods.items()},
        "together": float(np.prod(list(likelihoods.values()), axis=0).mean()),
        "there": {
            n: [round(v, 4) for v in quantiles(m.at(x).mean(axis=0), weights, (0.05, 0.5, 0.95))]
            for n, m in outcome.models.items()
        },
        "left": left_of(unknowns.names, x, weights),
    }
    (ROOT / "docs" / "images" / f"published-{name}.png").write_bytes(
        render(figure(result["left"], dict(zip(unknowns.names, unknowns.ends, strict=True))))["png"]
    )
    text = json.dumps(result, indent=1)
    (HERE / f"published_{name}.json").write_text(text + "\n", encoding="utf-8")
    for n, found in result["models"].items():
        print(f"{n}: {found}, likelihood {result['evidence'][n]}, at most {result['largest'][n]}")
    print(f"effective draws: {result['effective_draws']} of {DRAWS}")
    print("in what is left:", result["there"])
    for n, found in sorted(result["left"].items(), key=lambda item: -item[1]["narrowed"])[:12]:
        print(f"{n:45} {found['narrowed']:6.3f} nats, quantiles {found['quantiles']}")


COLUMNS = 4
"""Panels beside one another."""


@styled
def figure(left: Mapping[str, Any], ends: Mapping[str, tuple[str, str]]) -> Figure:
    """How much likelier than in its range each value of an unknown is, of those that narrowed."""
    shown = {n: f for n, f in left.items() if f["narrowed"] > NARROWED}
    names = sorted(shown, key=lambda n: -shown[n]["narrowed"])
    rows = max(1, math.ceil(len(names) / COLUMNS))
    drawn = canvas(WIDTH, 0.5 + 1.25 * rows)
    panels = drawn.subplots(rows, COLUMNS, squeeze=False, sharey=True).ravel()
    for panel in panels[len(names) :]:
        panel.set_visible(False)
    for panel, n in zip(panels, names, strict=False):
        share = shown[n]["share"]
        panel.bar(
            np.arange(len(share)) / len(share), share, 1 / len(share), align="edge", color=SERIES[0]
        )
        panel.axhline(1.0, color=FAINT)
        panel.set_title(n.rpartition(".")[2].split("_n_mm")[0].replace("_", "\n", 1), fontsize=7)
        panel.set_xticks([0, 1], ends[n], fontsize=7)
        panel.tick_params(axis="y", labelsize=7)
        for label, side in zip(panel.get_xticklabels(), ("left", "right"), strict=True):
            label.set_horizontalalignment(side)
    return drawn


def study_file(name: str) -> Path:
    """The first stage of a group."""
    return ROOT / "studies" / f"published_{name}.toml"


def study_of(name: str, settings: Sequence[Mapping[str, Any]], trials: int, seed: int) -> str:
    """A study file of these settings, each with the same scenes."""
    first = tomllib.loads(study_file(name).read_text(encoding="utf-8"))
    text = [
        f'experiment = "{first["experiment"]}"',
        'plan = "list"',
        *([f"trials = {trials}"] if "trials" in first else []),
        "",
        "[settings]",
        *(f"{key} = {json.dumps(value)}" for key, value in first.get("settings", {}).items()),
        f"seed = {seed}",
        "",
        "[vary]",
        *(f'"{key}" = {json.dumps([s[key] for s in settings])}' for key in settings[0]),
    ]
    return "\n".join(text)


def following(name: str, files: Sequence[Path], count: int, trials: int, seed: int) -> str:
    """A study of settings drawn from what is left."""
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    settings, x = prior(unknowns, DRAWS, seed)
    outcome = Outcome.of(read(files, group, unknowns), group)
    weights = weights_of(outcome.likelihoods(x, group.paper))
    chosen = np.random.default_rng(seed).choice(DRAWS, size=count, replace=False, p=weights)
    return study_of(name, [settings[k] for k in chosen], trials, LATER + seed)


def best(name: str, files: Sequence[Path], count: int) -> None:
    """Print the settings that are likeliest by their own trials, and write the first one.

    A chance is (did + 1) / (trials + 2), a mean that of the trials; where none tells, 0.
    """
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    rows = read(files, group, unknowns)
    values = {row["point"]: _values(unknowns, row) for row in lines(files)}
    found = []
    for point in np.unique(rows.points):
        here, logarithm, told = rows.points == point, 0.0, {}
        for n, said in group.paper.items():
            y = rows.outcomes[n][here]
            y = y[np.isfinite(y)]
            told[n] = f"{y.mean():.2f} of {len(y)}" if len(y) else "-"
            if isinstance(said, Mean | Near):
                spread = float(y.std(ddof=1)) if len(y) > 1 else float(isinstance(said, Mean))
                likely = said.likelihood(y.mean(keepdims=True), spread) if len(y) else np.zeros(1)
            else:
                likely = said.likelihood(np.array([(y.sum() + 1) / (len(y) + 2)]), 0.0)
            logarithm += float(np.log(np.maximum(likely, 1e-12))[0])
        found.append((logarithm, str(point), told))
    found.sort(key=lambda item: -item[0])
    for logarithm, point, told in found[:count]:
        print(f"{logarithm:8.2f}  point {point}: {told}")
    trials = ["trials = 200"] if "trials" in tomllib.loads(study_file(name).read_text()) else []
    tables: dict[str, list[str]] = {"": [*trials, f"seed = {FRESH}"]}
    for path, value in values[found[0][1]].items():
        table, _, key = path.rpartition(".")
        tables.setdefault(table, []).append(f"{key} = {json.dumps(value)}")
    text = "\n\n".join("\n".join([f"[{t}]"] * bool(t) + tables[t]) for t in sorted(tables))
    (HERE / f"published_{name}_best.toml").write_text(text + "\n", encoding="utf-8")


def recover(name: str, files: Sequence[Path]) -> None:
    """Say whether hidden settings lie within what their own data leave."""
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    hidden = read(files[:1], group, unknowns)
    outcome = Outcome.of(read(files[1:], group, unknowns), group)
    _, x = prior(unknowns, DRAWS)
    told = inside = 0
    for place in sorted(set(hidden.points.tolist())):
        here = hidden.points == place
        said = {}
        for n, y in hidden.outcomes.items():
            known = y[here][np.isfinite(y[here])]
            if len(known):
                said[n] = group.paper[n].again(known)
        weights = weights_of(outcome.likelihoods(x, said))
        print(f"hidden setting {place}: {said}, {1 / float((weights**2).sum()):.0f} draws")
        for k, (n, found) in enumerate(left_of(unknowns.names, x, weights).items()):
            low, _, high = found["quantiles"]
            if found["narrowed"] > NARROWED:
                truth = hidden.x[here][0, k]
                told += 1
                inside += low <= truth <= high
                print(f"  {n}: {low} to {high}, hidden {truth:.3f}")
    print(f"{inside} of {told} unknowns that the data narrow lie within their 90 % interval")


def keep(name: str, files: Sequence[Path]) -> None:
    """Keep the rows of studies as one table, only what is read here."""
    unknowns, group = Unknowns.of(study_file(name)), GROUPS[name]
    read_here = ["outcome", "time_s", "limit_s", "progress_m", "offset_m", "hinge_max_deg"]
    read_here += ["calibration.slope", "calibration.midpoint"]
    read_here += [f"calibration.speeds.{k}.r2" for k in range(3)]
    read_here += [f"calibration.cross_validated_rmse.{n}" for n in ("sigmoid", "line", "isotonic")]
    columns = ["point", "seed", *unknowns.axes, "trial", group.who, *read_here, "status"]
    rows = [*lines(files)]
    columns = [column for column in columns if column in rows[0]]
    with (HERE / f"published_{name}.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        table.writeheader()
        table.writerows({name: _short(text) for name, text in row.items()} for row in rows)


def _short(text: str) -> str:
    """A number with six digits, as that of no setting matters beyond; other words as they are."""
    try:
        return text if text.isdigit() else f"{float(text):.6g}"
    except ValueError:
        return text


def main() -> None:
    """Run one part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("weigh", "hidden", "recover", "next", "best", "rows"))
    parser.add_argument("group", choices=GROUPS)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--trials", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1, choices=range(1, 1000), metavar="1..999")
    told = parser.parse_args()
    name = told.group
    files = told.files or [HERE / f"published_{name}.csv"]
    if told.part == "hidden":
        settings = prior(Unknowns.of(study_file(name)), 3, HIDDEN)[0]
        sys.stdout.write(study_of(name, settings, told.trials, LATER))
    elif told.part == "best":
        best(name, files, told.count)
    elif told.part == "next":
        sys.stdout.write(following(name, files, told.count, told.trials, told.seed))
    else:
        {"weigh": weigh, "recover": recover, "rows": keep}[told.part](name, files)


if __name__ == "__main__":
    main()
