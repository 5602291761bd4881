"""What the control makes of traverses, and how its alarms answer true contacts.

The control is the robot's: `conditioning` and `contact`, stepped tick by tick for a batch of
traverses of the same length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from antennate.antenna.sensor import reading_noise
from antennate.control.conditioning import ContactState, RunningMean, bending_level
from antennate.experiments.bench import recorded
from antennate.experiments.touch.physics import TouchConfig, Traverse
from antennate.params.control import ConditioningParams, RuleParams
from antennate.types import Bools, Contact, Floats, Ints


def runs(state: Bools) -> Ints:
    """Begin and end (exclusive) of every run of True, shape (n, 2) [ticks]."""
    edges = np.flatnonzero(np.diff(state.astype(np.int8), prepend=0, append=0))
    return edges.reshape(-1, 2)


def merged(state: Bools, shortest: int) -> Bools:
    """The state with every gap between two runs filled that is shorter than `shortest` ticks."""
    filled = state.copy()
    edges = runs(state)
    for end, begin in zip(edges[:-1, 1], edges[1:, 0], strict=True):
        if begin - end < shortest:
            filled[end:begin] = True
    return filled


@dataclass(frozen=True, slots=True)
class Matches:
    """How alarms answer contacts.

    Attributes:
        contacts: Begin and end of every contact, shape (n, 2) [ticks].
        found: Whether a contact matches an alarm, shape (n,).
        carried: Contacts that are found by an alarm that had begun before them.
        alarms: Number of alarms; `false` of them match no contact.
        onset: Begin of the first matching alarm after the begin of the contact [ticks].
        release: End of the last matching alarm after the end of the contact [ticks].
    """

    contacts: Ints
    found: Bools
    carried: int
    alarms: int
    false: int
    onset: Ints
    release: Ints


def match(truth: Bools, alarm: Bools, grace: int) -> Matches:
    """Match contacts and alarms that overlap, a contact taken `grace` ticks longer at its end.

    Args:
        truth: True state, shape (n,).
        alarm: Sensed state, shape (n,).
        grace: How much later an alarm may still answer [ticks].
    """
    contacts, alarms = runs(truth), runs(alarm)
    over = (alarms[None, :, 0] < contacts[:, None, 1] + grace) & (
        alarms[None, :, 1] > contacts[:, None, 0]
    )
    answered, answering = np.asarray(over.any(axis=1)), np.asarray(over.any(axis=0))
    onset, release, carried = [], [], 0
    for i in np.flatnonzero(answered):
        begin, end = contacts[i]
        answers = alarms[over[i]]
        if answers[0, 0] < begin:
            carried += 1
        else:
            onset.append(answers[0, 0] - begin)
        last = answers[-1, 1]
        onwards = i + 1 < len(contacts) and last > contacts[i + 1, 0]
        if not onwards and end < len(truth) and last < len(truth):
            release.append(last - end)
    return Matches(
        contacts,
        found=answered,
        carried=carried,
        alarms=len(alarms),
        false=int((~answering).sum()),
        onset=np.array(onset, dtype=np.int64),
        release=np.array(release, dtype=np.int64),
    )


@dataclass(frozen=True, slots=True)
class Comparison:
    """One traverse compared with the truth.

    Attributes:
        wall, speed, profile, trial: Which traverse; speed in [m/s].
        metres: Its length [m].
        truth: True state, shape (n,).
        alarm: Sensed state, shape (n,).
        level: Logit of b, shape (n,).
        flex: Flex of the engine [rad], shape (n,).
    """

    wall: str
    speed: float
    profile: str
    trial: int
    metres: float
    truth: Bools
    alarm: Bools
    level: Floats
    flex: Floats
    matches: Matches

    @property
    def missed_flex(self) -> Floats:
        """Largest flex in each missed contact [rad], either way, shape (missed,)."""
        lost = self.matches.contacts[~self.matches.found]
        return np.array([abs(self.flex[begin:end]).max() for begin, end in lost])


def sense(
    conditioning: ConditioningParams, rule: RuleParams, counts: Floats, period: float
) -> tuple[Floats, Bools]:
    """Let the control read counts of shape (n, B), one row every `period` seconds.

    Returns:
        The bending level b and whether it says CONTACT, at every tick, each of shape (n, B).
    """
    batch = counts.shape[1]
    mean = RunningMean(conditioning, batch, period)
    contact = ContactState(rule, batch)
    levels, states = [], []
    for row in counts:
        b = bending_level(conditioning, mean.step(np.stack([row, row], axis=1)))
        levels.append(b[:, 0])
        states.append(contact.step(b)[:, 0])
    return np.array(levels), np.array(states) == Contact.CONTACT


def true_contact(config: TouchConfig, force: Floats) -> Bools:
    """Whether an obstacle presses, for forces over time [N], shape (n,)."""
    return merged(
        force > config.contact_force, round(config.merge_time * config.antenna.sensor.rate)
    )


def compare(config: TouchConfig, traverses: Sequence[Traverse]) -> list[Comparison | None]:
    """Let the control read all traverses, those of one speed side by side; None if invalid."""
    comparisons: list[Comparison | None] = [None] * len(traverses)
    for speed in config.speeds:
        places = [i for i, t in enumerate(traverses) if t.plan.speed == speed and not t.reason]
        if places:
            batch = _compare_batch(config, [traverses[i] for i in places])
            for place, comparison in zip(places, batch, strict=True):
                comparisons[place] = comparison
    return comparisons


def readings(config: TouchConfig, batch: Sequence[Traverse]) -> Floats:
    """What the sensor reads in B traverses of n ticks each [counts], shape (n, B)."""
    sensor, ticks = config.antenna.sensor, len(batch[0].x)
    noises = {
        trial: reading_noise(sensor, np.random.default_rng([config.seed, trial, 1]), (ticks,))
        for trial in {t.plan.trial for t in batch}
    }
    return recorded(
        sensor,
        np.stack([t.flex for t in batch], axis=1),
        np.stack([noises[t.plan.trial] for t in batch], axis=1),
    )


def _compare_batch(config: TouchConfig, batch: Sequence[Traverse]) -> list[Comparison]:
    sensor = config.antenna.sensor
    counts = readings(config, batch)
    level, alarm = sense(config.conditioning, config.rule, counts, 1.0 / sensor.rate)
    safe = np.clip(level, 1e-15, 1.0 - 1e-15)
    logit = np.log(safe / (1.0 - safe))
    grace = round(config.conditioning.averaging_time * sensor.rate)
    comparisons = []
    for i, traverse in enumerate(batch):
        truth, plan = true_contact(config, traverse.force), traverse.plan
        comparisons.append(
            Comparison(
                plan.wall,
                plan.speed,
                plan.profile,
                plan.trial,
                metres=float(traverse.x[-1] - traverse.x[0]),
                truth=truth,
                alarm=alarm[:, i],
                level=logit[:, i],
                flex=traverse.flex,
                matches=match(truth, alarm[:, i], grace),
            )
        )
    return comparisons
