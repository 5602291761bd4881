"""What the readings of docs/science/sides.py tell: `python docs/science/sides_told.py FOLDER`.

By the criterion of docs/science/sides.md. It needs scikit-learn (`uv run --with scikit-learn`) and
writes docs/science/sides_PLAN.json and sides.png beside itself.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import rankdata
from sides import AXES, COLUMNS, SCENES, SEEDS, Design, designs, drawn

from antennate.antenna.sensor import counts
from antennate.figures import INK, SERIES, WIDTH, canvas, render, styled
from antennate.sim.engine import mujoco
from antennate.sim.knowledge import SIDE_AHEAD, angle_ahead, mean_direction
from antennate.types import Floats

HERE = Path(__file__).parent
ASIDE = math.radians(30.0)
"""Angle to the point ahead from which on there is a side to ask for [rad], as in knowledge.md."""
RATE, CYCLE = 20, 25
"""Samples of a second, and of a gait cycle."""
SHORTEST = 2 * RATE
"""Samples before a jam without which nothing is asked."""
STEPS = 40
"""Of a sequence for the network."""
WINDOWS = {"jammed": 10.0, "decision": 16.0}
"""How much of the past is read at each moment [s]."""
SETS = {"antennae": ("touch",), "all": ("touch", "body"), "without antennae": ("body",)}
BEYOND = {"range finders": ("range",), "range finders and body": ("range", "body")}
"""Read of the ten best alone: what no antenna has."""
FINDERS = (0.06, 0.02, 0.033, math.radians(60.0))
"""Place of a range finder before and beside the middle of the head and above the floor [m], and its
direction from the heading [rad]."""
CONE, REACH, ERROR = math.radians(27.0), 1.3, 0.02
"""Field of view [rad], largest distance in strong light and error [m] of a VL53L1X (ST)."""
BOOTSTRAPS = 500
AT = {name: i for i, name in enumerate(COLUMNS)}
YAWS = slice(AT["yaw1"], AT["yaw5"] + 1)
ERRORS = slice(AT["error1"], AT["error5"] + 1)
HALF_WIDTH = 0.20
"""Half of the free width of most of these scenes [m]."""


@dataclass
class Event:
    """A moment of a robot that has to choose a side.

    Attributes:
        design, scene, episode: Where it is from.
        left: Whether the way goes on to the left.
        felt: Whether the rule of `geometric` had called it jammed itself.
        odd: Numbers that change their sign in a mirror, by kind.
        even: Numbers that do not.
        steps: The sequence, by kind, shape (STEPS, channels), and as in a mirror.
    """

    design: str
    scene: str
    episode: int
    left: bool
    felt: bool
    odd: dict[str, Floats]
    even: dict[str, Floats]
    steps: dict[str, tuple[Floats, Floats]]


def flexes(samples: Floats, design: Design) -> Floats:
    """Readings as shares of a right angle, left and right, shape (n, 2)."""
    sensor = design.robot.antenna.sensor
    straight, bent = (float(counts(sensor, np.array(flex))) for flex in (0.0, math.pi / 2))
    return (straight - samples[:, [AT["left"], AT["right"]]]) / (straight - bent)


def ranges(trial: Floats, scene: Any, rng: np.random.Generator) -> Floats:
    """Readings of two range finders on the head [m], left and right, shape (n, 2).

    The nearest surface of the drawn scene in the cone of each, with an error of each sample and one
    of each sensor. What can be pushed stands where it began.
    """
    spec = mujoco.MjSpec()
    scene.build(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    before, beside, above, aside = FINDERS
    spread = np.linspace(-CONE / 2.0, CONE / 2.0, 7)
    found = np.full((len(trial), 2), REACH)
    geoms, distances = np.zeros(len(spread), np.int32), np.zeros(len(spread))
    for row, (x, y, heading) in enumerate(trial[:, [AT["x"], AT["y"], AT["heading"]]].tolist()):
        ahead = np.array([math.cos(heading), math.sin(heading)])
        for side, sign in enumerate((1.0, -1.0)):
            place = [x, y] + before * ahead + sign * beside * np.array([-ahead[1], ahead[0]])
            angles = heading + sign * aside + spread
            rays = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
            mujoco.mj_multiRay(
                *(model, data, np.append(place, above), rays.ravel(), None, 1, -1),
                *(geoms, distances, None, len(spread), REACH),
            )
            met = distances[distances >= 0.0]
            found[row, side] = met.min() if len(met) else REACH
    error = rng.normal(0.0, ERROR, 2) + rng.normal(0.0, ERROR, found.shape)
    return np.clip(found + error, 0.0, REACH)


def _segment(values: Floats, first: int, end: int) -> Floats:
    """Mean, largest and spread of both sides in a stretch, shape (3, 2); zeros if it is empty."""
    part = values[max(first, 0) : max(end, 0)]
    if not len(part):
        return np.zeros((3, 2))
    return np.array([part.mean(axis=0), part.max(axis=0), part.std(axis=0)])


def _touched(flex: Floats, stretches: list[tuple[int, int]], looks: list[tuple[int, int]]) -> Any:
    """Odd and even numbers of what both antennae read in stretches, and in two looks."""
    odd, even = [], []
    for first, end in stretches:
        found = _segment(flex, first, end)
        odd.append(found[:, 0] - found[:, 1])
        even.append(found[:2].sum(axis=1))
    one, two = (_segment(flex, *look) for look in looks)
    odd += [one[:, 0] - two[:, 1], one[:, 1] - two[:, 0]]
    even += [one[:2, 0] + two[:2, 1], one[:2, 1] + two[:2, 0]]
    return np.concatenate(odd), np.concatenate(even)


def _mean(values: Floats, first: int, end: int) -> Floats:
    part = values[max(first, 0) : max(end, 0)]
    return part.mean(axis=0) if len(part) else np.zeros(values.shape[1])


def _moved(
    trial: Floats, stretches: list[tuple[int, int]], looks: list[tuple[int, int]], now: int
) -> tuple[Floats, Floats]:
    """Odd and even numbers of the gyroscope, the joints and the robot's own commands."""
    legs = trial[:, [AT["lag_left"], AT["lag_right"]]]
    turning = np.cumsum(trial[:, AT["gyro"]]) / RATE
    signed = np.concatenate(
        [turning[:, None], trial[:, YAWS], trial[:, ERRORS], legs[:, :1] - legs[:, 1:]], axis=1
    )
    odd, even = [], []
    for first, end in stretches:
        odd.append(_mean(signed, first, end))
        odd[-1][0] -= turning[now - 1]
        even.append(_mean(legs, first, end).sum(keepdims=True))
    odd.append(sum((_mean(signed, *look) for look in looks), np.zeros(signed.shape[1]))[1:])
    maneuver = trial[:now, AT["maneuver"]]
    turns = np.flatnonzero((maneuver == 1) | (maneuver == 2))
    last = 0.0 if not len(turns) else 3.0 - 2.0 * maneuver[turns[-1]]
    tries = np.count_nonzero((maneuver[1:] == 3) & (maneuver[:-1] != 3))
    odd.append(np.array([math.sin(turning[now - 1]), turning[now - 1], last]))
    even.append(np.array([math.cos(turning[now - 1]), float(tries), float(trial[now - 1, 1])]))
    return np.concatenate(odd), np.concatenate(even)


_MIRRORED = {
    "touch": ([1, 0, 3, 2, 4, 5, 6, 8, 7], np.ones(9)),
    "body": ([*range(12), 13, 12], np.array([-1.0] * 12 + [1.0, 1.0])),
    "range": ([1, 0, 2, 3, 4, 6, 5], np.ones(7)),
}
"""Order and signs of the channels of a sequence in a mirror."""


def _sequences(trial: Floats, flex: Floats, far: Floats | None, now: int, seconds: float) -> Any:
    """Sequences up to a moment, by kind, and as in a mirror."""
    maneuver, stage = trial[:, AT["maneuver"]], trial[:, AT["stage"]]
    turn = 1.0 * (maneuver == 1) - (maneuver == 2)
    done = [maneuver == 0, maneuver == 3, turn != 0.0, stage == 1, stage == 2]
    own = np.stack(done, axis=1).astype(float)
    bases = trial[:, [AT["base_left"], AT["base_right"]]]
    legs = 5.0 * trial[:, [AT["lag_left"], AT["lag_right"]]]
    body = [
        turn[:, None],
        trial[:, [AT["gyro"]]],
        2.0 * trial[:, YAWS],
        5.0 * trial[:, ERRORS],
        legs,
    ]
    every = round(seconds * RATE / STEPS)
    wanted = np.maximum(np.arange(now - every * STEPS, now), 0)
    kinds = {"touch": [flex, bases, own], "body": body}
    kinds |= {} if far is None else {"range": [far, own]}
    found = {}
    for kind, parts in kinds.items():
        values = np.concatenate(parts, axis=1)[wanted].reshape(STEPS, every, -1).mean(axis=1)
        order, signs = _MIRRORED[kind]
        found[kind] = (values, values[:, order] * signs)
    return found


def _aside(trial: Floats, route: Floats, now: int) -> float:
    """Angle from the mean heading of the last gait cycle to the point ahead [rad]."""
    heading = mean_direction(trial[max(now - CYCLE, 0) : now, AT["heading"]].tolist())
    head = trial[now - 1, [AT["x"], AT["y"]]]
    return angle_ahead(route, head, heading, SIDE_AHEAD)


def events_of(
    trial: Floats, design: Design, seed: int, beyond: bool = False
) -> dict[str, list[Event]]:
    """The moments of one episode: jammed, and after backing off and looking.

    Args:
        trial: Its samples.
        design: What the robot carried.
        seed: Of its draw.
        beyond: Whether range finders are read, too.
    """
    number = int(trial[0, 0])
    scene, flex = drawn(seed, number), flexes(trial, design)
    far = ranges(trial, scene, np.random.default_rng([seed, number])) if beyond else None
    maneuver, stage = trial[:, AT["maneuver"]], trial[:, AT["stage"]]
    found: dict[str, list[Event]] = {moment: [] for moment in WINDOWS}
    for begin in (np.flatnonzero((maneuver[1:] == 3) & (maneuver[:-1] != 3)) + 1).tolist():
        if begin < SHORTEST:
            continue
        rest = np.flatnonzero(maneuver[begin:] != 3)
        back = begin + int(rest[0]) if len(rest) else len(trial)
        ends = np.flatnonzero(stage[back:] == 0)
        now = back + int(ends[0]) if len(ends) else len(trial)
        turn = now - np.count_nonzero(stage[back:now] == 2)
        moments = {"jammed": (begin, begin)} | (
            {"decision": (now, back)} if now < len(trial) else {}
        )
        for moment, (end, at) in moments.items():
            angle = _aside(trial, scene.centre, at)
            if abs(angle) < ASIDE:
                continue
            stretches = [(begin - a * RATE, begin - b * RATE) for a, b in ((10, 4), (4, 1), (1, 0))]
            after = moment == "decision"
            half = (begin + back) // 2 if after else begin
            stretches += [(begin, half), (half, back if after else begin)]
            looks = [(back, turn), (turn, now)] if after else [(0, 0), (0, 0)]
            parts = {
                "touch": _touched(flex, stretches, looks),
                "body": _moved(trial, stretches, looks, end),
            }
            if far is not None:
                parts["range"] = _touched(far, stretches, looks)
            found[moment].append(
                Event(
                    design.name,
                    scene.name,
                    number,
                    angle > 0.0,
                    bool(trial[begin, AT["felt"]]),
                    {kind: odd for kind, (odd, _) in parts.items()},
                    {kind: even for kind, (_, even) in parts.items()},
                    _sequences(trial, flex, far, end, WINDOWS[moment]),
                )
            )
    return found


def gather(folder: Path, plan: str) -> dict[str, list[Event]]:
    """All moments of a folder."""
    found: dict[str, list[Event]] = {moment: [] for moment in WINDOWS}
    known = designs()
    for path in sorted(folder.glob("*_*.npz")):
        with np.load(path) as file:
            samples, of = file["samples"].astype(float), str(file["plan"])
        if of != plan:
            raise SystemExit(f"{path}: expected episodes of {plan}, found those of {of}")
        design = known[path.stem.rpartition("_")[0]]
        for number in np.unique(samples[:, 0]):
            trial = samples[samples[:, 0] == number]
            for moment, some in events_of(trial, design, SEEDS[plan], plan == "best").items():
                found[moment] += some
    return found


def numbers_of(design: Design) -> Floats:
    """A design as numbers of about 1, for estimators that learn of all designs at once."""
    motions = [float(design.motion == motion) for motion in AXES["motion"]]
    shape = [10.0 * design.length, design.angle / 45.0, math.log(design.softness)]
    return np.array([*shape, math.log(design.taper), design.sensor, design.swing, *motions])


@dataclass
class Table:
    """Moments as arrays: each as it was, then each in a mirror.

    Attributes:
        odd, even: Shapes (n, ...).
        steps: Sequences, shape (2 n, STEPS, channels).
        left: Shape (n,).
    """

    odd: Floats
    even: Floats
    steps: Floats
    left: Any

    @classmethod
    def of(cls, events: list[Event], kinds: tuple[str, ...]) -> Table:
        """What these kinds of readings hold, and the design of each."""
        known = {name: numbers_of(design) for name, design in designs().items()}
        own = np.array([known[event.design] for event in events])
        odd = np.array([np.concatenate([e.odd[k] for k in kinds]) for e in events])
        even = np.array([np.concatenate([e.even[k] for k in kinds]) for e in events])
        steps = [
            np.array([np.concatenate([e.steps[k][seen] for k in kinds], axis=1) for e in events])
            for seen in (0, 1)
        ]
        shown = np.repeat(own[:, None, :], STEPS, axis=1)
        both = np.concatenate([np.concatenate([part, shown], axis=2) for part in steps])
        left = np.array([event.left for event in events])
        return cls(odd, np.concatenate([even, own], axis=1), both, left)


def threshold(table: Table, learn: Any, test: Any) -> Floats:
    """The best single number of those that change their sign in a mirror."""
    signs = np.where(table.left[learn], 1.0, -1.0)
    areas = np.array([area(column * signs) for column in table.odd[learn].T])
    best = int(np.argmax(np.abs(areas - 0.5)))
    return table.odd[test, best] * np.sign(areas[best] - 0.5)


def logistic(table: Table, learn: Any, test: Any) -> Floats:
    """Logistic regression on all of those, without a constant."""
    from sklearn.linear_model import LogisticRegression

    scale = np.sqrt((table.odd[learn] ** 2).mean(axis=0)) + 1e-9
    model = LogisticRegression(C=0.03, fit_intercept=False, max_iter=500)
    model.fit(table.odd[learn] / scale, table.left[learn])
    return (table.odd[test] / scale) @ model.coef_[0]


def boosting(table: Table, learn: Any, test: Any) -> Floats:
    """Boosted trees, of each moment and its mirror image."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    def seen(rows: Any, sign: float) -> Floats:
        return np.concatenate([sign * table.odd[rows], table.even[rows]], axis=1)

    model = HistGradientBoostingClassifier(
        max_iter=80, learning_rate=0.08, max_leaf_nodes=8, min_samples_leaf=20, random_state=0
    )
    x = np.concatenate([seen(learn, 1.0), seen(learn, -1.0)])
    model.fit(x, np.concatenate([table.left[learn], ~table.left[learn]]))
    return model.decision_function(seen(test, 1.0)) - model.decision_function(seen(test, -1.0))


def network(table: Table, learn: Any, test: Any) -> Floats:
    """A gated recurrent network of 16 units, of each moment and its mirror image."""
    count = len(table.left)
    places, asked = np.arange(count)[learn], np.arange(count)[test]
    x = table.steps[np.concatenate([places, places + count])]
    model = Gru(x.shape[2], 16, np.random.default_rng(0))
    model.fit(x, np.concatenate([table.left[learn], ~table.left[learn]]).astype(float))
    return model.score(table.steps[asked]) - model.score(table.steps[asked + count])


class Gru:
    """A gated recurrent unit with one logistic output of its last state.

    Args:
        inputs: Channels.
        units: Of its state.
        rng: Draws the weights at first, and the batches.
    """

    def __init__(self, inputs: int, units: int, rng: np.random.Generator) -> None:
        self._units, self._rng = units, rng
        self._w = rng.normal(0.0, inputs**-0.5, (inputs, 3 * units))
        self._u = rng.normal(0.0, units**-0.5, (units, 3 * units))
        self._b, self._out = np.zeros(3 * units), rng.normal(0.0, 0.1, units)

    def _forward(self, x: Floats) -> tuple[Floats, list[Any]]:
        h, n, kept = np.zeros((len(x), self._units)), self._units, []
        given = x @ self._w + self._b
        for t in range(x.shape[1]):
            back = h @ self._u
            gates = 1.0 / (1.0 + np.exp(-(given[:, t, : 2 * n] + back[:, : 2 * n])))
            update, reset = gates[:, :n], gates[:, n:]
            new = np.tanh(given[:, t, 2 * n :] + reset * back[:, 2 * n :])
            kept.append((h, update, reset, new, back[:, 2 * n :]))
            h = (1.0 - update) * new + update * h
        return h, kept

    def score(self, x: Floats) -> Floats:
        """Logarithm of the odds, shape (n,)."""
        return self._forward(x)[0] @ self._out

    def _slopes(self, x: Floats, y: Floats) -> list[Floats]:
        """Slopes of the mean loss by the weights."""
        h, kept = self._forward(x)
        miss = (1.0 / (1.0 + np.exp(-h @ self._out)) - y) / len(y)
        out, dh = h.T @ miss, miss[:, None] * self._out
        w, u, b = np.zeros_like(self._w), np.zeros_like(self._u), np.zeros_like(self._b)
        for t in range(x.shape[1] - 1, -1, -1):
            before, update, reset, new, back = kept[t]
            dnew = dh * (1.0 - update) * (1.0 - new**2)
            dupdate = dh * (before - new) * update * (1.0 - update)
            dreset = dnew * back * reset * (1.0 - reset)
            given = np.concatenate([dupdate, dreset, dnew], axis=1)
            backs = np.concatenate([dupdate, dreset, dnew * reset], axis=1)
            w += x[:, t].T @ given
            u += before.T @ backs
            b += given.sum(axis=0)
            dh = dh * update + backs @ self._u.T
        return [w, u, b, out]

    def fit(self, x: Floats, y: Floats, epochs: int = 20, batch: int = 128) -> None:
        """Learn by Adam, with a decay of the weights."""
        weights = [self._w, self._u, self._b, self._out]
        first, second = ([np.zeros_like(w) for w in weights] for _ in range(2))
        step = 0
        for _ in range(epochs):
            order = self._rng.permutation(len(x))
            for some in np.array_split(order, max(1, len(order) // batch)):
                step += 1
                for i, slope in enumerate(self._slopes(x[some], y[some])):
                    slope = np.clip(slope, -1.0, 1.0) + 1e-3 * weights[i]
                    first[i] += 0.1 * (slope - first[i])
                    second[i] += 0.01 * (slope**2 - second[i])
                    size = np.sqrt(second[i] / (1.0 - 0.99**step)) + 1e-8
                    weights[i] -= 4e-3 * first[i] / (1.0 - 0.9**step) / size


def area(signed: Floats) -> float:
    """AUC of scores with the sign of the truth, each moment taken with its mirror image."""
    ranks = rankdata(np.concatenate([signed, -signed]))[: len(signed)]
    n = len(signed)
    return float((ranks.sum() - n * (n + 1) / 2) / n**2)


def interval(signed: Floats, episodes: Any, share: float = 0.95) -> list[float]:
    """Percentile interval of an AUC by a bootstrap over episodes."""
    rng = np.random.default_rng(0)
    places = [np.flatnonzero(episodes == episode) for episode in np.unique(episodes)]
    areas = []
    for _ in range(BOOTSTRAPS):
        chosen = rng.integers(len(places), size=len(places))
        areas.append(area(signed[np.concatenate([places[i] for i in chosen])]))
    rest = 50.0 * (1.0 - share)
    return np.percentile(areas, [rest, 100.0 - rest]).round(3).tolist()


Estimator = Callable[[Table, Any, Any], Floats]
OWN: dict[str, Estimator] = {"threshold": threshold, "logistic": logistic, "boosting": boosting}
"""Learn of one design."""
SHARED: dict[str, Estimator] = {"boosting, all designs": boosting, "network, all designs": network}
"""Learn of all designs, with their numbers."""


def left_out(table: Table, scenes: Any, chosen: Any, estimator: Estimator) -> Floats:
    """Signed scores of moments, each by an estimator that learned in the other scenes."""
    scores = np.zeros(len(chosen))
    for scene in SCENES:
        learn, test = chosen & (scenes != scene), chosen & (scenes == scene)
        if test.any() and 0 < table.left[learn].sum() < learn.sum():
            scores[test] = estimator(table, learn, test)
    return scores * np.where(table.left, 1.0, -1.0)


def judge(events: list[Event], kinds: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """AUC and interval of each estimator, by design."""
    table = Table.of(events, kinds)
    names = np.array([event.design for event in events])
    scenes = np.array([event.scene for event in events])
    episodes = np.array([event.episode for event in events])
    everyone = np.ones(len(events), dtype=bool)
    shared = {name: left_out(table, scenes, everyone, how) for name, how in SHARED.items()}
    found: dict[str, dict[str, Any]] = {}
    for name in np.unique(names).tolist():
        own = names == name
        signed = {label: left_out(table, scenes, own, how)[own] for label, how in OWN.items()}
        signed |= {label: scores[own] for label, scores in shared.items()}
        found[name] = {
            label: _told(scores, scenes[own], episodes[own]) for label, scores in signed.items()
        }
    return found


def _told(signed: Floats, scenes: Any, episodes: Any) -> dict[str, Any]:
    """An AUC with its intervals."""
    return {
        "auc": round(area(signed), 3),
        "interval_95": interval(signed, episodes),
        "interval_99_5": interval(signed, episodes, 0.995),
        "scenes": _by_scene(signed, scenes),
    }


def pooled(events: list[Event], kinds: tuple[str, ...]) -> dict[str, Any]:
    """AUC and interval of each estimator, of all designs together: for what no design changes."""
    table = Table.of(events, kinds)
    scenes = np.array([event.scene for event in events])
    episodes = np.array([event.episode for event in events])
    everyone = np.ones(len(events), dtype=bool)
    estimators = OWN | {"network": network}
    signed = {name: left_out(table, scenes, everyone, how) for name, how in estimators.items()}
    return {label: _told(scores, scenes, episodes) for label, scores in signed.items()}


def _by_scene(signed: Floats, scenes: Any) -> dict[str, float]:
    """AUC in each scene."""
    return {scene: round(area(signed[scenes == scene]), 3) for scene in SCENES if scene in scenes}


def score_of(design: dict[str, Any]) -> float:
    """The better moment's mean AUC over estimators, of the antennae alone."""
    return max(mean_area(design[moment]["antennae"]) for moment in WINDOWS)


def smoothed(scores: dict[str, float]) -> dict[str, float]:
    """Mean of the score of each design and of what the others let expect of its numbers."""
    from sklearn.linear_model import RidgeCV
    from sklearn.model_selection import LeaveOneOut, cross_val_predict
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    known = [designs()[name] for name in scores]
    x = np.array([[*numbers_of(design), reach_of(design) / HALF_WIDTH] for design in known])
    y = np.array([*scores.values()])
    model = make_pipeline(StandardScaler(), RidgeCV(np.logspace(-1, 3, 9)))
    expected = cross_val_predict(model, x, y, cv=LeaveOneOut())
    return dict(zip(scores, ((y + expected) / 2.0).tolist(), strict=True))


def reach_of(design: Design) -> float:
    """How far to the side the tip comes from the middle of the head [m], its base moved."""
    most = {"sinusoid": 0.7, "outwards": 0.9, "look": 0.9}.get(design.motion, 0.0)
    start = math.radians(design.angle)
    end = start + most * design.swing
    widest = 1.0 if start <= math.pi / 2 <= end else max(math.sin(start), math.sin(end))
    return design.robot.antenna.base_spacing / 2 + design.length * widest


def mean_area(estimators: dict[str, Any]) -> float:
    """Mean AUC of all estimators."""
    return float(np.mean([estimator["auc"] for estimator in estimators.values()]))


@styled
def figure(screening: dict[str, Any], best: dict[str, Any] | None) -> Figure:
    """AUC against reach over half the width, a panel for each moment; the ten best again."""
    drawing, known = canvas(WIDTH, 3.4), designs()
    panels = drawing.subplots(1, 2, sharey=True)
    for panel, moment in zip(panels, WINDOWS, strict=True):
        for motion, colour in zip(AXES["motion"], SERIES, strict=False):
            for designs_of, marks in ((screening, {"alpha": 0.45}), (best, {"marker": "D"})):
                names = [n for n in (designs_of or {}) if known[n].motion == motion]
                reach = [reach_of(known[name]) / HALF_WIDTH for name in names]
                told = [mean_area((designs_of or {})[n][moment]["antennae"]) for n in names]
                label = motion if designs_of is screening else None
                style: dict[str, Any] = {"marker": "o", "markersize": 4, "label": label} | marks
                panel.plot(reach, told, linestyle="none", color=colour, **style)
        for level in (0.5, 0.8):
            panel.axhline(level, color=INK, linewidth=0.6)
        panel.set_title({"jammed": "when jammed", "decision": "after backing off"}[moment])
        panel.set_ylim(0.3, 0.85)
    panels[0].set_ylabel("AUC of the side, antennae alone")
    drawing.supxlabel("reach of the tip to the side over half the corridor", fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    drawing.legend(
        handles, labels, loc="outside upper left", ncols=5, fontsize=8, columnspacing=1.0
    )
    return drawing


def draw() -> None:
    """Draw what the written files hold."""
    screening, best = (HERE / f"sides_{plan}.json" for plan in ("screening", "best"))
    ten = json.loads(best.read_text())["designs"] if best.exists() else None
    drawing = figure(json.loads(screening.read_text())["designs"], ten)
    HERE.joinpath("sides.png").write_bytes(render(drawing)["png"])


def verdict() -> str:
    """What the fresh draws say of the ten best, by items 2 and 4 of the criterion."""
    screening, best = (
        json.loads((HERE / f"sides_{plan}.json").read_text())["designs"]
        for plan in ("screening", "best")
    )
    lines = [
        "| design | largest AUC of the screening | on fresh draws | 95 % | 99.5 % | "
        "without antennae | |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    bound, where = 0.0, ""
    for name, fresh in best.items():
        places = [(moment, label) for moment in WINDOWS for label in ("antennae", "all")]
        found = [
            (estimator["auc"], *place, how)
            for place in places
            for how, estimator in screening[name][place[0]][place[1]].items()
        ]
        auc, moment, label, how = max(found)
        own = fresh[moment][label][how]
        ends = own["interval_95"], own["interval_99_5"]
        tells = own["auc"] >= 0.8 and ends[0][0] > 0.75
        may = "tells" if tells else "may tell" if ends[1][1] >= 0.8 else "does not tell"
        cells = [f"{auc:.2f}: {moment}, {label}, {how}", f"{own['auc']:.2f}"]
        cells += [f"{low:.2f} to {high:.2f}" for low, high in ends]
        cells += [f"{fresh[moment]['without antennae'][how]['auc']:.2f}", may]
        lines.append(f"| {name} | {' | '.join(cells)} |")
        for place in places:
            for each, estimator in fresh[place[0]][place[1]].items():
                if (most := estimator["interval_99_5"][1]) > bound:
                    bound = most
                    where = f"{name}: {', '.join(place)}, {each}, {estimator['auc']:.2f}"
    return "\n".join([*lines, "", f"The largest upper end of all is {bound:.2f} ({where})."])


def write_verdict() -> None:
    """Write it into the page."""
    page = HERE / "sides.md"
    before, mark, rest = page.read_text().partition("<!-- best: sides_told.py -->\n")
    _, end, after = rest.partition("\n<!-- end of best -->")
    page.write_text(f"{before}{mark}{verdict()}{end}{after}")


def main(argv: list[str]) -> None:
    """Judge a folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--plan", choices=list(SEEDS), default="screening")
    asked = parser.parse_args(argv)
    found = gather(asked.folder, asked.plan)
    result: dict[str, Any] = {"seed": SEEDS[asked.plan], "designs": {}}
    for moment, events in found.items():
        for label, kinds in SETS.items():
            for name, told in judge(events, kinds).items():
                design = result["designs"].setdefault(name, {m: {} for m in WINDOWS})
                some = [e for e in events if e.design == name]
                design[moment]["moments"] = len(some)
                design[moment]["felt"] = round(float(np.mean([e.felt for e in some])), 2)
                design[moment][label] = told
            print(moment, label, len(events), flush=True)
        for label, kinds in BEYOND.items() if asked.plan == "best" else ():
            told = pooled(events, kinds)
            result.setdefault("beyond", {}).setdefault(moment, {})[label] = told
            print(moment, label, {name: [e["auc"], *e["interval_95"]] for name, e in told.items()})
    scores = {name: score_of(design) for name, design in result["designs"].items()}
    rank = smoothed(scores)
    for name, design in result["designs"].items():
        design["score"], design["rank_by"] = round(scores[name], 3), round(rank[name], 3)
    ranked = sorted(rank, key=lambda name: -rank[name])
    result["designs"] = {name: result["designs"][name] for name in ranked}
    if asked.plan != "smoke":
        text = json.dumps(result, separators=(",", ":")) + "\n"
        HERE.joinpath(f"sides_{asked.plan}.json").write_text(text)
        draw()
    if asked.plan == "best":
        write_verdict()
    for name, design in result["designs"].items():
        cells = [
            f"{moment} {label} {mean_area(design[moment][label]):.2f}"
            for moment in WINDOWS
            for label in SETS
        ]
        print(
            name,
            design["score"],
            design["rank_by"],
            design["decision"]["moments"],
            *cells,
            sep=" | ",
        )


if __name__ == "__main__":
    main(sys.argv[1:])
