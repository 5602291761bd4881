"""How often a 95 % interval of a restricted mean time holds the true mean, by five methods.

A restricted time is the limit where a trial fails. Times of successes are lognormal below the
limit, or those of an evaluation (docs/science/evaluation-20261126.csv), drawn with replacement.
Each cell is a number of trials, a distribution and a share of failures; each draw of it gives
every method the same values. Differences are of two conditions on the same trials: how hard a
trial is moves the times of both, and their failures (a Gaussian copula with a given correlation).

Methods: Student's t; Hall's (1992) cubic transformation of t against skewness, Journal of the Royal
Statistical Society B 54, 221-228; bootstrap-t and BCa with 1000 samples (Efron and Tibshirani,
1993, An Introduction to the Bootstrap, chapters 12 and 14); and `joined`, what the program prints:
`mean95` and `difference95` of antennate.studies.statistics. All are cut at what is possible.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri, stdtrit

from antennate.studies.statistics import difference95, mean95
from antennate.types import Floats

SCIENCE = Path(__file__).parent.parent / "docs" / "science"
LIMIT, MEAN = 100.0, 20.0
"""Time limit and about the mean time of successes [s], as in the default tunnel."""
SEED, SAMPLES, SOME = 37, 1000, 300
COUNTS = (5, 10, 20, 40, 100, 400)
SHARES = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.3, 0.5)
PAIRED = ((0.0, 0.0), (0.01, 0.0), (0.02, 0.0), (0.02, 0.02), (0.05, 0.02), (0.1, 0.1), (0.3, 0.05))
SPREADS = (0.37, 0.8)
"""Standard deviation of the logarithm of lognormal times; the evaluation has 0.37 to 0.63."""
LIKE = ((0.37, 0.37), (0.6, 0.37))
"""Spreads of two conditions."""
HARD = (0.0, 0.9)
"""Correlation of both conditions over trials."""
Ends = tuple[Floats, Floats]
METHODS = ("student", "hall", "bootstrap_t", "bca", "joined")


def student(values: Floats) -> Ends:
    """Both ends of every draw, values of shape (draws, n)."""
    count = values.shape[1]
    half = stdtrit(count - 1, 0.975) * values.std(axis=1, ddof=1) / np.sqrt(count)
    return values.mean(axis=1) - half, values.mean(axis=1) + half


def hall(values: Floats) -> Ends:
    """The same, by Hall's transformation."""
    count, mean = values.shape[1], values.mean(axis=1)
    error = values.std(axis=1, ddof=1) / np.sqrt(count)
    skewness = _skewness(values) / np.sqrt(count)
    skewness = np.where(abs(skewness) < 1e-9, 1e-9, skewness)
    far = stdtrit(count - 1, 0.975)
    ends = [
        mean - error * 3.0 / skewness * (np.cbrt(1.0 + skewness * (t - skewness / 6.0)) - 1.0)
        for t in (far, -far)
    ]
    return ends[0], ends[1]


def bootstraps(values: Floats, rng: np.random.Generator) -> tuple[Ends, Ends]:
    """Bootstrap-t and BCa; all draws share the same samples of places."""
    count, mean = values.shape[1], values.mean(axis=1)
    times = rng.multinomial(count, np.full(count, 1.0 / count), SAMPLES).T / count
    means = values @ times
    spread = np.sqrt(np.maximum(values**2 @ times - means**2, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.nan_to_num((means - mean[:, None]) / spread, nan=0.0, posinf=1e9, neginf=-1e9)
    low, high = np.quantile(t, (0.025, 0.975), axis=1) * values.std(axis=1)
    studentised = mean - high, mean - low
    below = (means < mean[:, None]).mean(axis=1) + 0.5 * (means == mean[:, None]).mean(axis=1)
    bias = ndtri(np.clip(below, 1.0 / SAMPLES, 1.0 - 1.0 / SAMPLES))
    speed = _skewness(values) / (6.0 * np.sqrt(count))
    means.sort(axis=1)
    ends = []
    for far in (ndtri(0.025), ndtri(0.975)):
        level = ndtr(bias + (bias + far) / (1.0 - speed * (bias + far)))
        place = np.clip((level * SAMPLES).astype(int), 0, SAMPLES - 1)
        ends.append(means[np.arange(len(means)), place])
    return studentised, (ends[0], ends[1])


def _skewness(values: Floats) -> Floats:
    off = values - values.mean(axis=1, keepdims=True)
    return (off**3).mean(axis=1) / np.maximum((off**2).mean(axis=1), 1e-12) ** 1.5


def rivals(values: Floats, least: float, rng: np.random.Generator) -> dict[str, Ends]:
    """Intervals of every draw by the methods that know nothing of failures.

    Both bootstraps take long: they have the first `SOME` draws alone.
    """
    studentised, bca = bootstraps(values[:SOME], rng)
    every = {
        "student": student(values),
        "hall": hall(values),
        "bootstrap_t": studentised,
        "bca": bca,
    }
    return {
        name: (np.clip(low, least, LIMIT), np.clip(high, least, LIMIT))
        for name, (low, high) in every.items()
    }


def judged(found: dict[str, Ends], truth: float) -> dict[str, Any]:
    """Share of intervals that hold the truth and their mean width [s], of each method."""
    slack = 1e-9
    return {
        name: {
            "holds": float(np.mean((low <= truth + slack) & (truth - slack <= high))),
            "below": float(np.mean(high < truth - slack)),
            "above": float(np.mean(low > truth + slack)),
            "width_s": float(np.mean(high - low)),
        }
        for name, (low, high) in found.items()
    }


def times(uniform: Floats, spread: float) -> Floats:
    """Lognormal times below the limit, of uniform numbers."""
    middle = MEAN * np.exp(-(spread**2) / 2.0)
    most = ndtr(np.log(LIMIT / middle) / spread)
    return middle * np.exp(spread * ndtri(np.clip(uniform, 1e-12, 1.0) * most))


def _restricted(spread: float, share: float) -> float:
    """True mean of restricted times with a share of failures [s]."""
    grid = (np.arange(1_000_000) + 0.5) / 1_000_000
    return (1.0 - share) * float(times(grid, spread).mean()) + share * LIMIT


def seen() -> dict[str, Floats]:
    """Restricted times of the evaluation by controller, in the order of trials [s]."""
    found: dict[str, list[float]] = {}
    with (SCIENCE / "evaluation-20261126.csv").open() as file:
        for row in csv.DictReader(file):
            late = row["outcome"] != "success"
            found.setdefault(row["controller"], []).append(LIMIT if late else float(row["time_s"]))
    return {name: np.array(values) for name, values in found.items()}


def means(draws: int, counts: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """One row for each cell of one condition."""
    makers: dict[str, tuple[Callable[[np.random.Generator, tuple[int, int]], Floats], float]] = {}
    for spread in SPREADS:
        makers[f"lognormal {spread}"] = (
            lambda rng, shape, s=spread: times(rng.random(shape), s),
            _restricted(spread, 0.0),
        )
    every = seen()
    for name in ("open", "closed"):
        known = every[name][every[name] < LIMIT]
        makers[f"seen {name}"] = (
            lambda rng, shape, k=known: rng.choice(k, shape),
            float(known.mean()),
        )
    for place, (name, (make, mean)) in enumerate(makers.items()):
        for count in counts:
            for share in SHARES:
                rng = np.random.default_rng([SEED, place, count, round(1000 * share)])
                values = make(rng, (draws, count))
                values[rng.random(values.shape) < share] = LIMIT
                found = rivals(values, 0.0, rng)
                found["joined"] = _ends([mean95(v, 0.0, LIMIT, restricted=True) for v in values])
                truth = (1.0 - share) * mean + share * LIMIT
                row = {"times": name, "trials": count, "failures": share, "mean_s": truth}
                yield {**row, **judged(found, truth)}


def differences(draws: int, counts: tuple[int, ...]) -> Iterator[dict[str, Any]]:
    """One row for each cell of two conditions."""
    every = [(like, hard, shares) for like in LIKE for hard in HARD for shares in PAIRED]
    for place, (like, hard, shares) in enumerate(every):
        truth = _restricted(like[0], shares[0]) - _restricted(like[1], shares[1])
        what = {"times": f"lognormal {like[0]}, {like[1]}", "correlation": hard, "failures": shares}
        for count in counts:
            rng = np.random.default_rng([SEED, 2, place, count])
            first, second = _pair(rng, (draws, count), like, hard, shares)
            yield {**what, **_of_pair(first, second, truth, rng)}
    known = seen()
    for names in (("open", "closed"), ("paper", "closed"), ("open", "paper")):
        ours, theirs = known[names[0]], known[names[1]]
        shares = float((ours >= LIMIT).mean()), float((theirs >= LIMIT).mean())
        what = {"times": f"seen {names[0]}, {names[1]}", "correlation": None, "failures": shares}
        for count in counts:
            rng = np.random.default_rng([SEED, 3, count, len(names[0])])
            place = rng.integers(len(ours), size=(draws, count))
            truth = float((ours - theirs).mean())
            yield {**what, **_of_pair(ours[place], theirs[place], truth, rng)}


def _pair(
    rng: np.random.Generator,
    shape: tuple[int, int],
    like: tuple[float, float],
    hard: float,
    shares: tuple[float, float],
) -> tuple[Floats, Floats]:
    """Restricted times of two conditions."""
    slow, fails = rng.normal(size=shape), rng.normal(size=shape)
    found = []
    for spread, share in zip(like, shares, strict=True):
        own = [
            ndtr(np.sqrt(hard) * common + np.sqrt(1.0 - hard) * rng.normal(size=shape))
            for common in (slow, fails)
        ]
        found.append(np.where(own[1] < share, LIMIT, times(own[0], spread)))
    return found[0], found[1]


def _of_pair(
    first: Floats, second: Floats, truth: float, rng: np.random.Generator
) -> dict[str, Any]:
    found = rivals(first - second, -LIMIT, rng)
    found["joined"] = _ends([difference95(a, b, LIMIT) for a, b in zip(first, second, strict=True)])
    return {"trials": first.shape[1], "mean_s": truth, **judged(found, truth)}


def _ends(found: list[tuple[float, tuple[float, float] | None]]) -> Ends:
    low, high = np.array([ends for _, ends in found], float).T
    return low, high


def table(rows: list[dict[str, Any]], of: str) -> str:
    """The least coverage of each method over all cells of a column, and the mean width."""
    heads = [of, *METHODS, "width of Student's [s]", "of joined"]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for value in dict.fromkeys(str(row[of]) for row in rows):
        mine = [row for row in rows if str(row[of]) == value]
        least = [f"{100 * min(row[name]['holds'] for row in mine):.1f}" for name in METHODS]
        widths = [np.mean([row[n]["width_s"] for row in mine]) for n in ("student", "joined")]
        lines.append("| " + " | ".join([value, *least, *(f"{w:.1f}" for w in widths)]) + " |")
    return "\n".join(lines)


def main() -> None:
    """Simulate, print the tables, and write them unless it was quick."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="400 draws of 5 and of 40 trials")
    quick = parser.parse_args().quick
    counts, draws = ((5, 40), 400) if quick else (COUNTS, 1500)
    with ProcessPoolExecutor(2) as pool:
        parts = {part.__name__: pool.submit(_rows, part, draws, counts) for part in PARTS}
        found = {name: part.result() for name, part in parts.items()}
    for name, rows in found.items():
        print(f"{name}: least share of intervals that hold the true mean [%], {draws} draws a cell")
        print(table(rows, "trials"), "\n")
        print("40 trials:")
        print(table([row for row in rows if row["trials"] == 40], "failures"), "\n")
    if not quick:
        about = {"seed": SEED, "draws": draws, "bootstrap_draws": SOME, "limit_s": LIMIT}
        text = _lines({**about, **_rounded(found)})
        (SCIENCE / "coverage.json").write_text(text, encoding="utf-8")


PARTS = (means, differences)


def _rows(
    part: Callable[[int, tuple[int, ...]], Iterator[dict[str, Any]]],
    draws: int,
    counts: tuple[int, ...],
) -> list[dict[str, Any]]:
    return list(part(draws, counts))


def _lines(whole: dict[str, Any]) -> str:
    """JSON with one line for each cell."""
    parts = [
        f'"{name}": ' + ("[\n" + ",\n".join(map(json.dumps, part)) + "\n]")
        if isinstance(part, list)
        else f'"{name}": {json.dumps(part)}'
        for name, part in whole.items()
    ]
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(part) for part in value]
    return round(value, 4) if isinstance(value, float) else value


if __name__ == "__main__":
    main()
