"""What the control makes of traverses, and how that compares with the truth.

The control is the robot's: `conditioning` and `contact`, stepped tick by tick for a batch of
traverses of the same length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from antennate.control.conditioning import RunningMean, bending_level
from antennate.control.contact import ContactState
from antennate.experiments.touch.episodes import Matches, match, merged
from antennate.params import ConditioningParams, RuleParams
from antennate.types import Bools, Contact, Floats


@dataclass(frozen=True, slots=True)
class Sensed:
    """What the control says at every tick.

    Attributes:
        b: Bending level, shape (n, B).
        alarm: Whether it says CONTACT, shape (n, B).
    """

    b: Floats
    alarm: Bools


def sense(
    conditioning: ConditioningParams, rule: RuleParams, counts: Floats, period: float
) -> Sensed:
    """Let the control read counts of shape (n, B), one row every `period` seconds."""
    batch = counts.shape[1]
    mean = RunningMean(conditioning, batch, period)
    contact = ContactState(rule, batch)
    levels, states = [], []
    for row in counts:
        b = bending_level(conditioning, mean.step(np.stack([row, row], axis=1)))
        levels.append(b[:, 0])
        states.append(contact.step(b)[:, 0])
    return Sensed(np.array(levels), np.array(states) == Contact.CONTACT)


@dataclass(frozen=True, slots=True)
class ContactCriteria:
    """How the truth is told from forces, and how late an alarm may come.

    Attributes:
        force: An obstacle that presses with more than this is felt [N].
        merge: Gaps between presses shorter than this are contact [ticks].
        grace: How much later than the end of a contact an alarm still answers it [ticks].
    """

    force: float
    merge: int
    grace: int


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
        matches: Contacts and alarms.
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


def true_state(criteria: ContactCriteria, force: Floats) -> Bools:
    """Whether an obstacle presses, for forces over time [N], shape (n,)."""
    return merged(force > criteria.force, criteria.merge)


def compare(truth: Bools, alarm: Bools, criteria: ContactCriteria) -> Matches:
    """Contacts against alarms, both of shape (n,)."""
    return match(truth, alarm, criteria.grace)


def logit(b: Floats) -> Floats:
    """log(b / (1 - b)), b kept off 0 and 1; same shape."""
    safe = np.clip(b, 1e-15, 1.0 - 1e-15)
    return np.log(safe / (1.0 - safe))
