"""Weighs settings by what the paper says: `python docs/science/published.py PART GROUP FILE...`.

Parts, over folders of `antennate study studies/published_GROUP.toml` or of later stages: `weigh`
fits the outcome over the unknowns, and tells what is left of their ranges; with `--write` it is
docs/science/published_GROUP.json and figures. `hidden` prints a study of hidden settings;
`recover` weighs by what came out there, the first folder, and asks whether they are found. `next`
prints a study of settings drawn from what is left, or searched by some of the statements. `best`
names the likeliest settings by their own trials; with `--write` the first is
docs/science/published_GROUP_best.toml. `tune` prints a search of the published rule or of a clock
in the setting of a file. `rows` keeps the rows of folders as docs/science/published_GROUP.csv.
Needs `uv run --with scikit-learn`. The likelihoods are those of docs/science/published.md.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import math
import sys
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import tomlkit
import tuning
from numpy.typing import NDArray
from published_figures import marginals, screening, trade
from scipy.stats import binom, norm

from antennate.control.registry import unread
from antennate.errors import ConfigError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.figures import render
from antennate.params.base import read_file
from antennate.params.control import ControlParams

Floats = NDArray[np.float64]
Row = Mapping[str, str]
HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
SPREAD = 0.15
"""Standard deviation of the logarithm of a mean speed beside that of chance."""
DRAWS = 100_000
"""Settings that are weighed."""
CHUNK = 20_000
"""Settings whose outcomes are told at a time: what fits into the memory of a laptop."""
FITS = 12
"""Fits to points drawn anew with replacement: what they leave open of the outcome."""
FOLDS = 5
BINS = 10
"""Most parts of the range of an unknown that are told apart."""
NARROWED = 0.02
"""Information from which on an unknown is told by the data [nats]."""
PAIR_BINS, PAIRS = 5, 4
"""Parts of a range in a pair, and pairs that are drawn."""
ENOUGH = 4
"""Trials from which on a setting is drawn alone."""
SHUFFLES = 200
"""Random orders of the outcomes, which say what an effect must exceed."""
LATER = 571000
"""Seeds of later stages are this and 1 to 999 more; none is reserved or of the first stage."""
FRESH = 572001
"""Seed on which the likeliest setting is judged."""
TUNING = 571999
"""Seed on which the rule and its rivals are tuned in a setting."""
HIDDEN = 20261130
"""Seed of hidden settings."""


def say(text: str) -> None:
    """Say one line beside what is printed."""
    sys.stderr.write(f"published.py: {text}\n")


def refuse(text: str) -> NoReturn:
    """End with one line and exit code 2."""
    say(text)
    raise SystemExit(2)


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
        columns: What is read of a row.
        ends: How a trial may end; empty where that is not read.
        told: Status of rows that are read.
    """

    who: str
    all: tuple[str, ...]
    outcomes: Mapping[str, Callable[[Mapping[str, Row]], float]]
    paper: Mapping[str, Statement]
    columns: tuple[str, ...]
    ends: tuple[str, ...] = ()
    told: tuple[str, ...] = ("ok",)


def number_in(row: Row, column: str) -> float:
    """A finite number of a row."""
    try:
        number = float(row[column])
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        refuse(f"{row['place']}: {column}: expected a finite number, found {row[column]!r}")
    return number


def _crossed(name: str) -> Callable[[Mapping[str, Row]], float]:
    return lambda rows: float(rows[name]["outcome"] == "success")


def _speed(name: str) -> Callable[[Mapping[str, Row]], float]:
    def logarithm(rows: Mapping[str, Row]) -> float:
        row = rows[name]
        if row["outcome"] != "success":
            return math.nan
        way, time = (number_in(row, name) for name in ("progress_m", "time_s"))
        if min(way, time) <= 0:
            refuse(f"{row['place']}: progress_m, time_s: expected above 0, found {way}, {time}")
        return math.log(way / time)

    return logarithm


def _nearer(rows: Mapping[str, Row]) -> float:
    pair = rows["paper"], rows["open"]
    if any(row["outcome"] != "success" for row in pair):
        return math.nan
    ours, without = (number_in(row, "offset_m") for row in pair)
    return float(ours < without)


def _ended(name: str, outcome: str) -> Callable[[Mapping[str, Row]], float]:
    return lambda rows: float(rows[name]["outcome"] == outcome)


def _below(name: str, degrees: float) -> Callable[[Mapping[str, Row]], float]:
    return lambda rows: float(number_in(rows[name], "hinge_max_deg") < degrees)


def _calibrated(rows: Mapping[str, Row]) -> float:
    return float(rows["calibrate"]["status"] == "ok")


def _number(of: Callable[[Callable[[str], float]], float]) -> Callable[[Mapping[str, Row]], float]:
    """Of a calibration, from its columns; NaN of a recording that was refused."""

    def number(rows: Mapping[str, Row]) -> float:
        row = rows["calibrate"]
        if not _calibrated(rows):
            return math.nan
        return of(lambda name: number_in(row, f"calibration.{name}"))

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
        columns=("outcome", "time_s", "progress_m", "offset_m"),
        ends=("success", "timeout", "left", "overturned", "fell", "invalid"),
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
        columns=("outcome", "hinge_max_deg"),
        ends=("success", "jam", "slip", "invalid"),
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
        columns=(
            *("calibration.slope", "calibration.midpoint"),
            *(f"calibration.speeds.{k}.r2" for k in range(3)),
            *(f"calibration.cross_validated_rmse.{n}" for n in ("sigmoid", "line", "isotonic")),
        ),
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

    def shares(self, values: Mapping[str, Any], place: str) -> list[float]:
        """A setting, as it stands at a place, as numbers from 0 to 1, one a name."""
        found: list[float] = []
        for name, axis in self.axes.items():
            value = values[name]
            if isinstance(axis, list):
                if value not in axis:
                    refuse(f"{place}: {name}: expected one of {axis}, found {value}")
                found += _choices(axis)[axis.index(value)].tolist()
                continue
            low, high = axis["low"], axis["high"]
            close = 1e-5 * max(abs(low), abs(high))  # kept rows have six digits
            if not low - close <= value <= high + close:
                refuse(f"{place}: {name}: expected {low:g} to {high:g}, found {value}")
            if axis.get("log"):
                found.append(math.log(value / axis["low"]) / math.log(axis["high"] / axis["low"]))
            else:
                found.append((value - axis["low"]) / (axis["high"] - axis["low"]))
        return found


def _choices(axis: Sequence[Any]) -> Floats:
    """The values of a list as numbers from 0 to 1, shape (values, entries of one)."""
    if isinstance(axis[0], str):
        return np.linspace(0.0, 1.0, len(axis))[:, None]
    entries = np.array([v if isinstance(v, list) else [v] for v in axis], float)
    low = entries.min(axis=0)
    return (entries - low) / (entries.max(axis=0) - low)


@dataclass(frozen=True)
class Draws:
    """Settings drawn from the ranges.

    Attributes:
        columns: Of each unknown its values; of a list their places in it.
        x: The settings as numbers from 0 to 1, shape (n, unknowns).
    """

    unknowns: Unknowns
    columns: Mapping[str, NDArray[Any]]
    x: Floats

    def setting(self, k: int) -> dict[str, Any]:
        """One of them as the values of a study."""
        return {
            name: axis[self.columns[name][k]]
            if isinstance(axis, list)
            else self.columns[name][k].item()
            for name, axis in self.unknowns.axes.items()
        }


def prior(unknowns: Unknowns, count: int, seed: int = 1) -> Draws:
    """Settings drawn from the ranges."""
    rng = np.random.default_rng(seed)
    columns: dict[str, NDArray[Any]] = {}
    x: list[Floats] = []
    for name, axis in unknowns.axes.items():
        if isinstance(axis, list):
            columns[name] = rng.integers(len(axis), size=count)
            x.append(_choices(axis)[columns[name]])
            continue
        low, high = axis["low"], axis["high"]
        if axis.get("whole"):
            columns[name] = rng.integers(low, high + 1, size=count)
            share = (columns[name] - low) / (high - low)
        else:
            share = rng.uniform(size=count)
            far = low * (high / low) ** share if axis.get("log") else low + (high - low) * share
            columns[name] = far
        x.append(share[:, None])
    return Draws(unknowns, columns, np.hstack(x))


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


def lines(files: Iterable[Path], names: Sequence[str], group: Group) -> Iterable[dict[str, str]]:
    """Rows of tables of studies; one point is one setting, whichever stages walked it.

    A row has its place in the files as `place`.
    """
    points: dict[tuple[str, ...], int] = {}
    for file in files:
        path = file / "trials.csv" if file.is_dir() else file
        if not path.is_file():
            refuse(f"{path}: expected the rows of a study, found no such file")
        with path.open(encoding="utf-8", newline="") as table:
            rows = csv.DictReader(table)
            wanted = (*names, group.who, "status", *group.columns)
            if missing := [name for name in wanted if name not in (rows.fieldnames or ())]:
                refuse(f"{path}: expected a column {missing[0]}, found none")
            for row in rows:
                if None in row or None in row.values():
                    refuse(f"{path}, line {rows.line_num}: expected a cell for each column")
                setting = tuple(_short(row[name]) for name in names)
                yield row | {
                    "point": str(points.setdefault(setting, len(points))),
                    "place": f"{path}, line {rows.line_num}",
                }


def read(files: Sequence[Path], group: Group, unknowns: Unknowns) -> Rows:
    """Trials that ended, of all of a group.

    Raises:
        SystemExit: There are none, or a row has a cell that cannot be.
    """
    found: dict[tuple[str, ...], dict[str, dict[str, str]]] = {}
    for row in lines(files, [*unknowns.axes], group):
        if row["status"] in group.told:
            if group.ends and row["outcome"] not in group.ends:
                ends = ", ".join(group.ends)
                refuse(f"{row['place']}: outcome: expected one of {ends}, found {row['outcome']!r}")
            who = row[group.who] or group.all[0]  # a trial that failed has no columns
            scene = row["point"], row.get("seed", ""), row.get("trial", "")
            found.setdefault(scene, {})[who] = row
    whole = {key: rows for key, rows in found.items() if set(group.all) <= set(rows)}
    if not whole:
        refuse(f"{files[0]}: expected trials of {', '.join(group.all)}, found none")
    if few := len(found) - len(whole):
        say(f"{few} of {len(found)} trials lack a row of {' or '.join(group.all)}: left out")
    firsts = [rows[group.all[0]] for rows in whole.values()]
    return Rows(
        np.array([unknowns.shares(_values(unknowns, row), row["place"]) for row in firsts]),
        {
            name: np.array([of(rows) for rows in whole.values()])
            for name, of in group.outcomes.items()
        },
        np.array([int(point) for point, *_ in whole]),
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
            found[name] = int(text) if text.isdigit() else number_in(row, name)
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
        parts = np.array_split(x, max(1, len(x) // CHUNK))
        if self.spread:
            return np.hstack([[fit.predict(part) for fit in self.fits] for part in parts])
        return np.hstack([[_chance(fit, part) for fit in self.fits] for part in parts])


def _chance(model: Any, x: Floats) -> Floats:
    """Of a model that may have seen but one outcome."""
    found = model.predict_proba(x)
    return found @ np.asarray(model.classes_, float)


def choose(x: Floats, y: Floats, points: NDArray[np.int64], chance: bool) -> Fitted:
    """The model of the least loss on points that were left out, fitted to all that are known."""
    from sklearn.model_selection import GroupKFold

    known = np.isfinite(y)
    x, y, points = x[known], y[known], points[known]
    settings = np.unique(points)
    if len(settings) < FOLDS:
        refuse(f"expected {FOLDS} settings or more in which all is told, found {len(settings)}")
    folds = [*GroupKFold(FOLDS).split(x, y, points)]
    losses: dict[str, float] = {}
    kinds = models() if chance else regressions()
    if chance and any(len(np.unique(y[train])) == 1 for train, _ in folds):
        kinds = {"constant": kinds["constant"]}
    for name, make in kinds.items():
        loss = np.zeros(len(y))
        for train, test in folds:
            model = make().fit(x[train], y[train].astype(int) if chance else y[train])
            if chance:
                p = np.clip(_chance(model, x[test]), 1e-6, 1 - 1e-6)
                loss[test] = -np.where(y[test] > 0, np.log(p), np.log(1 - p))
            else:
                loss[test] = (model.predict(x[test]) - y[test]) ** 2
        losses[name] = float(loss.mean())
    best = min(losses, key=losses.__getitem__)
    rng = np.random.default_rng(0)
    fits: list[Any] = []
    while len(fits) < FITS:
        times = np.bincount(
            rng.integers(len(settings), size=len(settings)), minlength=len(settings)
        )
        rows = np.repeat(np.arange(len(y)), times[np.searchsorted(settings, points)])
        if not chance or len(set(y[rows])) == len(set(y)):
            fits.append(kinds[best]().fit(x[rows], y[rows].astype(int) if chance else y[rows]))
    spread = 0.0 if chance else math.sqrt(losses[best])
    return Fitted(best, (losses[best], losses["constant"]), fits, spread)


@dataclass(frozen=True)
class FittedModels:
    """Models of all that the paper speaks of in a group."""

    models: dict[str, Fitted]

    @classmethod
    def of(cls, rows: Rows, group: Group) -> FittedModels:
        """Fitted to trials."""
        return cls(
            {
                name: choose(rows.x, y, rows.points, isinstance(group.paper[name], Count | AtLeast))
                for name, y in rows.outcomes.items()
            }
        )

    def at(self, x: Floats) -> dict[str, Floats]:
        """What comes out in settings by each fit, shape (fits, n)."""
        return {name: model.at(x) for name, model in self.models.items()}

    def likelihoods(
        self, told: Mapping[str, Floats], said: Mapping[str, Statement]
    ) -> dict[str, Floats]:
        """Likelihood of each statement where that comes out, mean over the fits, shape (n,)."""
        return {
            name: statement.likelihood(told[name], self.models[name].spread).mean(axis=0)
            for name, statement in said.items()
        }


def weights_of(likelihoods: Mapping[str, Floats]) -> Floats:
    """Weights of draws, their sum 1."""
    product = np.prod(list(likelihoods.values()), axis=0)
    if not product.sum() > 0:
        refuse(
            "expected a setting within the ranges with a likelihood above zero, found none: widen "
            "the ranges of the study"
        )
    return product / product.sum()


def quantiles(values: Floats, weights: Floats, at: Sequence[float]) -> list[float]:
    """Weighted quantiles."""
    order = np.argsort(values)
    return np.interp(at, np.cumsum(weights[order]), values[order]).tolist()


def region(values: Floats, weights: Floats) -> list[float]:
    """What holds 90 % of the weight: of few values the likeliest, else the ends of the middle."""
    few = np.unique(values)
    if len(few) > BINS:
        return [round(end, 3) for end in quantiles(values, weights, (0.05, 0.95))]
    share = np.bincount(np.searchsorted(few, values), weights, len(few))
    order = np.argsort(-share)
    count = int(np.searchsorted(np.cumsum(share[order]), 0.9)) + 1
    return sorted(round(float(value), 3) for value in few[order[:count]])


def holds(kept: Sequence[float], value: float, few: bool) -> bool:
    """Whether a region holds a value."""
    if few:
        return bool(np.isclose(kept, value, atol=1e-3).any())
    return kept[0] <= value <= kept[1]


def _places(values: Floats, most: int) -> tuple[NDArray[np.int64], int]:
    """In which part of its range each value lies, and how many parts there are."""
    parts = np.unique(values)
    if len(parts) > BINS:
        parts = np.linspace(0.0, 1.0, most, endpoint=False)
    return np.searchsorted(parts, values + 1e-12, side="right") - 1, len(parts)


def left_of(names: Sequence[str], x: Floats, weights: Floats) -> dict[str, Any]:
    """Of each unknown what is left: 90 % of it as shares of its range, and by how much it narrowed.

    `narrowed` is the information in nats, from counts in bins, less what chance alone gives.
    """
    effective = 1.0 / float((weights**2).sum())
    found = {}
    for k, name in enumerate(names):
        place, count = _places(x[:, k], BINS)
        share = np.bincount(place, weights, count)
        prior = np.bincount(place, minlength=count) / len(x)
        there = share > 0
        nats = float((share[there] * np.log(share[there] / prior[there])).sum())
        found[name] = {
            "region": region(x[:, k], weights),
            "few": len(np.unique(x[:, k])) <= BINS,
            "narrowed": round(nats - (len(prior) - 1) / (2 * effective), 3),
            "share": [round(float(v), 4) for v in share / prior],
        }
    return found


def pairs_of(names: Sequence[str], x: Floats, weights: Floats, count: int) -> list[dict[str, Any]]:
    """The pairs that the data tie together most: information beyond that of each alone [nats]."""
    effective = 1.0 / float((weights**2).sum())
    found = []
    for (j, one), (k, other) in itertools.combinations(enumerate(names), 2):
        (a, rows), (b, columns) = (_places(x[:, i], PAIR_BINS) for i in (j, k))
        both = np.bincount(a * columns + b, weights, rows * columns).reshape(rows, columns)
        prior = np.bincount(a * columns + b, minlength=rows * columns).reshape(rows, columns)
        alone = both.sum(axis=1, keepdims=True) * both.sum(axis=0, keepdims=True)
        there = both > 0
        nats = float((both[there] * np.log(both[there] / alone[there])).sum())
        nats -= (rows - 1) * (columns - 1) / (2 * effective)
        share = both / np.maximum(prior / len(x), 1e-12)
        found.append(
            {"names": [one, other], "nats": round(nats, 3), "share": np.round(share, 3).tolist()}
        )
    return sorted(found, key=lambda pair: -pair["nats"])[:count]


def measured(names: Sequence[str], x: Floats, weights: Floats, chance: Floats) -> dict[str, float]:
    """How much of what is left open of an outcome a measurement of each unknown would settle.

    Share of the variance of the outcome over what is left that lies between values of the unknown,
    less what chance alone gives.
    """
    effective = 1.0 / float((weights**2).sum())
    middle = float(weights @ chance)
    whole = max(float(weights @ (chance - middle) ** 2), 1e-12)
    found = {}
    for k, name in enumerate(names):
        place, count = _places(x[:, k], BINS)
        mass = np.bincount(place, weights, count)
        means = np.bincount(place, weights * chance, count)[mass > 0] / mass[mass > 0]
        between = float(mass[mass > 0] @ (means - middle) ** 2)
        found[name] = round(between / whole - (count - 1) / effective, 3)
    return found


def effects_of(rows: Rows, names: Sequence[str]) -> dict[str, dict[str, list[float]]]:
    """Of each outcome the change from one end of each unknown to the other, and its size as noise.

    Least squares over all unknowns at once, of means of settings. The second number is the size as
    a share of the largest that means in random order reach in one study of twenty.
    """
    found = {}
    rng = np.random.default_rng(0)
    for name, outcome in rows.outcomes.items():
        known = np.isfinite(outcome)
        _, first, place = np.unique(rows.points[known], return_index=True, return_inverse=True)
        y = np.bincount(place, outcome[known]) / np.bincount(place)
        design = np.insert(rows.x[known][first], 0, 1.0, axis=1)
        solve = np.linalg.pinv(design)
        orders = np.column_stack([y, *(rng.permutation(y) for _ in range(SHUFFLES))])
        slopes = solve @ orders
        left = np.sqrt(((orders - design @ slopes) ** 2).mean(axis=0))
        sizes = np.abs(slopes) / np.outer(np.sqrt((solve**2).sum(axis=1)), np.maximum(left, 1e-12))
        limit = np.quantile(sizes[1:, 1:].max(axis=0), 0.95)
        found[name] = {
            n: [round(float(slopes[k, 0]), 3), round(float(sizes[k, 0] / limit), 2)]
            for k, n in enumerate(names, 1)
        }
    return found


def weigh(name: str, files: Sequence[Path], write: bool) -> None:
    """Tell what the paper's data leave of the ranges, and perhaps write it."""
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    rows = read(files, group, unknowns)
    fitted = FittedModels.of(rows, group)
    x = prior(unknowns, DRAWS).x
    told = fitted.at(x)
    likelihoods = fitted.likelihoods(told, group.paper)
    weights = weights_of(likelihoods)
    result = {
        "trials": len(rows.x),
        "settings": len(set(rows.points.tolist())),
        "mean": {n: round(float(np.nanmean(y)), 3) for n, y in rows.outcomes.items()},
        "models": {
            n: {"chosen": m.name, "loss": round(m.loss[0], 4), "constant": round(m.loss[1], 4)}
            for n, m in fitted.models.items()
        },
        "effective_draws": round(1.0 / float((weights**2).sum()), 1),
        "evidence": {n: round(float(v.mean()), 5) for n, v in likelihoods.items()},
        "largest": {n: round(float(v.max()), 4) for n, v in likelihoods.items()},
        "together": float(np.prod(list(likelihoods.values()), axis=0).mean()),
        "there": {
            n: [round(v, 4) for v in quantiles(y.mean(axis=0), weights, (0.05, 0.5, 0.95))]
            for n, y in told.items()
        },
        "effects": effects_of(rows, unknowns.names),
        "measured": {
            n: measured(unknowns.names, x, weights, y.mean(axis=0)) for n, y in told.items()
        },
        "left": left_of(unknowns.names, x, weights),
    }
    narrowed = {n: f for n, f in result["left"].items() if f["narrowed"] > NARROWED}
    these = [k for k, n in enumerate(unknowns.names) if n in narrowed]
    result["pairs"] = pairs_of([unknowns.names[k] for k in these], x[:, these], weights, PAIRS)
    if write:
        ends = dict(zip(unknowns.names, unknowns.ends, strict=True))
        figures = {"": marginals(narrowed, ends), "-screening": screening(result["effects"])}
        if name == "tunnel" and (shares := traded(rows)):
            crossed = [(a / n, b / m) for a, n, b, m in judged().values()]
            figures["-trade"] = trade(shares, crossed)
        for kind, drawn in figures.items():
            image = ROOT / "docs" / "images" / f"published-{name}{kind}.png"
            image.write_bytes(render(drawn)["png"])
        text = json.dumps(result, indent=1)
        (HERE / f"published_{name}.json").write_text(text + "\n", encoding="utf-8")
        print(f"written: docs/science/published_{name}.json and its figures in docs/images")
    for n, found in result["models"].items():
        print(f"{n}: {found}, likelihood {result['evidence'][n]}, at most {result['largest'][n]}")
    print(f"effective draws: {result['effective_draws']} of {DRAWS}")
    print("in what is left:", result["there"])
    for n, shares in result["measured"].items():
        first = sorted(shares.items(), key=lambda item: -item[1])[:4]
        print(f"{n}: settled most by {', '.join(f'{u} ({v:.0%})' for u, v in first)}")
    for n, found in sorted(result["left"].items(), key=lambda item: -item[1]["narrowed"])[:12]:
        print(f"{n:45} {found['narrowed']:6.3f} nats, 90 % in {found['region']}")


def judged() -> dict[tuple[str, str], tuple[int, int, int, int]]:
    """By setting and seed how many crossed of how many, without and with the rule, when judged."""
    found: dict[tuple[str, str], dict[str, list[bool]]] = {}
    with (HERE / "published_judged.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            of = found.setdefault((row["setting"], row["seed"]), {})
            of.setdefault(row["controller"], []).append(row["outcome"] == "success")
    return {
        key: (sum(of["open"]), len(of["open"]), sum(of["paper"]), len(of["paper"]))
        for key, of in found.items()
    }


def traded(rows: Rows) -> list[tuple[float, float, int]]:
    """Of settings with enough trials the share that crosses without and with the rule."""
    found = []
    for point in np.unique(rows.points):
        here = rows.points == point
        if here.sum() >= ENOUGH:
            shares = (float(rows.outcomes[f"{n} crosses"][here].mean()) for n in ("open", "paper"))
            found.append((*shares, int(here.sum())))
    return found


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
        tomlkit.dumps({"settings": {"seed": seed, **first.get("settings", {})}}),
        "[vary]",
        *(f'"{key}" = {json.dumps([s[key] for s in settings])}' for key in settings[0]),
    ]
    return "\n".join(text)


def following(name: str, files: Sequence[Path], told: argparse.Namespace) -> str:
    """A study of settings drawn from what is left; by a power of the likelihood it is a search."""
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    draws = prior(unknowns, DRAWS, told.seed)
    fitted = FittedModels.of(read(files, group, unknowns), group)
    said = {n: statement for n, statement in group.paper.items() if n in (told.only or group.paper)}
    likelihoods = fitted.likelihoods(fitted.at(draws.x), said)
    weights = weights_of({n: likely**told.power for n, likely in likelihoods.items()})
    if told.count > (some := int((weights > 0).sum())):
        refuse(
            f"--count: expected at most {some}, the draws that have a weight, found {told.count}"
        )
    rng = np.random.default_rng(told.seed)
    chosen = rng.choice(DRAWS, size=told.count, replace=False, p=weights)
    return study_of(name, [draws.setting(k) for k in chosen], told.trials, LATER + told.seed)


def near(name: str, files: Sequence[Path], told: argparse.Namespace) -> str:
    """A study of settings near the likeliest ones: a search, not a draw from what is left.

    An unknown of a range moves by a tenth of it or so, one of a list is drawn anew one time in ten.
    """
    unknowns, rng = Unknowns.of(study_file(name)), np.random.default_rng(told.seed)
    parents = [values for _, _, _, values in likeliest(name, files, told.only)[: told.near]]
    settings = []
    for _ in range(told.count):
        values = dict(parents[rng.integers(len(parents))])
        for n, axis in unknowns.axes.items():
            if isinstance(axis, list):
                values[n] = axis[rng.integers(len(axis))] if rng.random() < 0.1 else values[n]
                continue
            law = (math.log, math.exp) if axis.get("log") else (float, float)
            low, high, at = (law[0](v) for v in (axis["low"], axis["high"], values[n]))
            moved = law[1](min(max(at + 0.1 * (high - low) * rng.normal(), low), high))
            values[n] = round(moved) if axis.get("whole") else moved
        settings.append(values)
    return study_of(name, settings, told.trials, LATER + told.seed)


def likeliest(
    name: str, files: Sequence[Path], only: Sequence[str] | None = None
) -> list[tuple[float, str, dict[str, str], dict[str, Any]]]:
    """Settings in the order of their likelihood by their own trials: its logarithm, point, outcome.

    A chance is (did + 1) / (trials + 2), a mean that of the trials; where none tells, 0.
    """
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    rows = read(files, group, unknowns)
    names = [*unknowns.axes]
    values = {row["point"]: _values(unknowns, row) for row in lines(files, names, group)}
    same: dict[str, list[int]] = {}  # points of one setting, as of a study that varies the seed
    for point in np.unique(rows.points).tolist():
        same.setdefault(json.dumps(values[str(point)]), []).append(point)
    found = []
    for point, *others in same.values():
        here, logarithm, told = np.isin(rows.points, [point, *others]), 0.0, {}
        for n, said in group.paper.items():
            y = rows.outcomes[n][here]
            y = y[np.isfinite(y)]
            told[n] = f"{y.mean():.2f} of {len(y)}" if len(y) else "-"
            if isinstance(said, Mean | Near):
                spread = float(y.std(ddof=1)) if len(y) > 1 else float(isinstance(said, Mean))
                likely = said.likelihood(y.mean(keepdims=True), spread) if len(y) else np.zeros(1)
            else:
                likely = said.likelihood(np.array([(y.sum() + 1) / (len(y) + 2)]), 0.0)
            if n in (only or group.paper):
                logarithm += float(np.log(np.maximum(likely, 1e-300))[0])
        found.append((logarithm, str(point), told, values[str(point)]))
    return sorted(found, key=lambda item: -item[0])


def best(name: str, files: Sequence[Path], count: int, write: bool) -> None:
    """Print the settings that are likeliest by their own trials, and perhaps write the first."""
    found = likeliest(name, files)
    for logarithm, point, told, _ in found[:count]:
        print(f"{logarithm:8.2f}  point {point}: {told}")
    trials = ["trials = 200"] if "trials" in tomllib.loads(study_file(name).read_text()) else []
    tables: dict[str, list[str]] = {"": [*trials, f"seed = {FRESH}"]}
    for path, value in found[0][3].items():
        table, _, key = path.rpartition(".")
        tables.setdefault(table, []).append(f"{key} = {json.dumps(value)}")
    text = "\n\n".join("\n".join([f"[{t}]"] * bool(t) + tables[t]) for t in sorted(tables))
    if write:
        (HERE / f"published_{name}_best.toml").write_text(text + "\n", encoding="utf-8")
        print(f"the first one is written to docs/science/published_{name}_best.toml")
    else:
        print(f"\n{text}")


SEARCHED = {
    "paper": """
"control.rule.threshold" = { low = 0.05, high = 0.9 }
"control.rule.hysteresis" = { low = 0.0, high = 0.1 }
"control.rule.strong" = { low = 0.3, high = 0.95 }
"control.rule.similar" = { low = 0.05, high = 0.5 }
"control.rule.hold_time" = { low = 0.3, high = 6.0, log = true }
"control.conditioning.averaging_time" = { low = 0.02, high = 0.5, log = true }
"control.gait.turn_offset" = { low = 0.1, high = 0.6 }
""",
    **{rival: tuning.SEARCHED[rival] for rival in ("timed", "schedule")},
}
"""What is searched of the rule and of the clocks, each with the same budget."""


def tuned(file: Path, controller: str, proposals: int, trials: int) -> str:
    """A search by plan `optuna` of one controller in a setting."""
    read_file(file, TunnelConfig)
    left_out = {"trials", "seed", "controllers"}
    left_out |= {*tomllib.loads(SEARCHED[controller])}
    left_out |= {"control." + name for name in unread(controller, ControlParams())}
    fixed = [
        f"{path} = {json.dumps(value)}"
        for path, value in _paths(tomllib.loads(file.read_text(encoding="utf-8")))
        if path not in left_out
    ]
    return "\n".join(
        [
            f'experiment = "tunnel"\nplan = "optuna"\npoints = {proposals}\ntrials = {trials}',
            'validated = 1\nvalidation_factor = 1\nminimize = ["time_s"]\n',
            f"[vary]{SEARCHED[controller]}",
            f'[settings]\ncontrollers = ["{controller}"]\nseed = {TUNING}',
            *fixed,
        ]
    )


def _paths(tables: Mapping[str, Any], before: str = "") -> Iterable[tuple[str, Any]]:
    """Values of nested tables by their dotted paths."""
    for key, value in tables.items():
        if isinstance(value, dict):
            yield from _paths(value, f"{before}{key}.")
        else:
            yield before + key, value


def recover(name: str, files: Sequence[Path]) -> None:
    """Say whether hidden settings lie within what their own data leave."""
    group, unknowns = GROUPS[name], Unknowns.of(study_file(name))
    hidden = read(files[:1], group, unknowns)
    fitted = FittedModels.of(read(files[1:], group, unknowns), group)
    x = prior(unknowns, DRAWS).x
    chances = fitted.at(x)
    told = inside = 0
    for place in sorted(set(hidden.points.tolist())):
        here = hidden.points == place
        said = {}
        for n, y in hidden.outcomes.items():
            known = y[here][np.isfinite(y[here])]
            if len(known):
                said[n] = group.paper[n].again(known)
        weights = weights_of(fitted.likelihoods(chances, said))
        print(f"hidden setting {place}: {said}, {1 / float((weights**2).sum()):.0f} draws")
        for k, (n, found) in enumerate(left_of(unknowns.names, x, weights).items()):
            if found["narrowed"] > NARROWED:
                truth = hidden.x[here][0, k]
                told += 1
                inside += holds(found["region"], truth, found["few"])
                print(f"  {n}: {found['region']}, hidden {truth:.3f}")
    print(f"{inside} of {told} unknowns that the data narrow lie within their 90 % region")


def keep(name: str, files: Sequence[Path]) -> None:
    """Keep the rows of studies as one table, only what is read here."""
    unknowns, group = Unknowns.of(study_file(name)), GROUPS[name]
    rows = [*lines(files, [*unknowns.axes], group)]
    if not rows:
        refuse(f"{files[0]}: expected rows, found none")
    columns = ["point", "seed", *unknowns.axes, "trial", group.who, *group.columns, "status"]
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


class Words(argparse.ArgumentParser):
    """Words of the command line; what is wrong with them is one line."""

    def error(self, message: str) -> NoReturn:
        """End with one line and exit code 2."""
        refuse(message)


def words() -> Words:
    """The parts, each with the options that it reads."""
    parser = Words(description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True, parser_class=Words)
    options: dict[str, dict[str, Any]] = {
        "--count": {"type": _from(1), "default": 60, "help": "settings (default: 60)"},
        "--trials": {"type": _from(1), "default": 8, "help": "of each setting (default: 8)"},
        "--seed": {"type": int, "default": 1, "choices": range(1, 1000), "metavar": "1..999"},
        "--power": {"type": _power, "default": 1.0, "help": "of the likelihood, to search"},
        "--only": {"nargs": "+", "help": "statements to search by"},
        "--near": {"type": _from(1), "help": "search near so many of the likeliest settings"},
        "--controller": {"choices": SEARCHED, "default": "paper"},
        "--write": {"action": "store_true", "help": "write it into docs"},
    }
    for part, names in {
        "weigh": ["--write"],
        "hidden": ["--count", "--trials"],
        "recover": [],
        "next": ["--count", "--trials", "--seed", "--power", "--only", "--near"],
        "best": ["--count", "--write"],
        "tune": ["--controller", "--count", "--trials"],
        "rows": [],
    }.items():
        one = parts.add_parser(part)
        one.add_argument("group", choices=["tunnel"] if part == "tune" else GROUPS)
        least = {"recover": 2, "tune": 1}.get(part, 0)
        if part != "hidden":
            one.add_argument(
                "files", nargs=1 if part == "tune" else "+" if least else "*", type=Path
            )
        for name in names:
            one.add_argument(name, **options[name])
    return parser


def _from(least: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"expected at least {least}, found {text}")
        return int(text)

    return number


def _power(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0.0 < number <= 1000.0:
        raise argparse.ArgumentTypeError(f"expected a number above 0, at most 1000, found {text}")
    return number


def carry_out(told: argparse.Namespace, files: Sequence[Path]) -> None:
    """Carry out the part that is asked for."""
    name = told.group
    if told.part == "hidden":
        draws = prior(Unknowns.of(study_file(name)), told.count, HIDDEN)
        settings = [draws.setting(k) for k in range(told.count)]
        sys.stdout.write(study_of(name, settings, told.trials, LATER))
    elif told.part == "weigh":
        weigh(name, files, told.write)
    elif told.part == "best":
        best(name, files, told.count, told.write)
    elif told.part == "tune":
        sys.stdout.write(tuned(files[0], told.controller, told.count, told.trials))
    elif told.part == "next":
        sys.stdout.write((near if told.near else following)(name, files, told))
    else:
        {"recover": recover, "rows": keep}[told.part](name, files)
    sys.stdout.flush()


def main() -> None:
    """Run one part."""
    told = words().parse_args()
    files = getattr(told, "files", None) or [HERE / f"published_{told.group}.csv"]
    if told.part == "recover" and len(files) < 2:
        refuse("recover: expected a folder of hidden settings, then those of stages")
    known = GROUPS[told.group].paper
    if strange := set(getattr(told, "only", None) or ()) - set(known):
        refuse(f"--only: expected some of {', '.join(known)}, found {', '.join(sorted(strange))}")
    try:
        carry_out(told, files)
    except ModuleNotFoundError as error:
        refuse(f"expected the package scikit-learn ({error}); uv run --with scikit-learn has it")
    except ConfigError as error:
        refuse(str(error))
    except OSError as error:
        refuse(f"{error.filename or 'output'}: {error.strerror}")
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        refuse(f"{files[0]}: {error}")


if __name__ == "__main__":
    main()
