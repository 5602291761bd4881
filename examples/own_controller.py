"""A controller of one's own: it follows the wall on its left, and turns away when it is pressed.

uv run antennate tunnel --controllers open closed examples/own_controller.py:OwnController
uv run antennate drive --controller examples/own_controller.py:OwnController
"""

import numpy as np

from antennate.control.conditioning import ContactState, RunningMean, bending_level
from antennate.control.gait import Gait
from antennate.types import Contact, Maneuver

LOST, PRESSED, BACK = 2.0, 3.0, 2.5  # [s] without the wall, turning away from it, in reverse


class OwnController:
    def __init__(self, control, robot, batch):
        self.conditioning = control.conditioning
        self.mean = RunningMean(control.conditioning, batch, control.period)
        self.state = ContactState(control.rule, batch)
        self.gait = Gait(control.gait, robot, batch, control.period)
        self.felt, self.eased, self.until = self.times = np.zeros((3, batch))  # [s]

    def reset(self, rows, phase=0.0):
        self.mean.reset(rows), self.state.reset(rows), self.gait.reset(rows, phase)
        self.times[:, rows] = -np.inf

    def step(self, frame):
        self.level = bending_level(self.conditioning, self.mean.step(frame.counts))
        self.contact = self.state.step(self.level)
        t, left, right = frame.t, *(self.contact.T == Contact.CONTACT)
        away = right | (self.level[:, 0] > 0.9)
        self.felt[:] = np.where(left | np.isinf(self.felt), t, self.felt)
        self.eased[:] = np.where(away & np.isfinite(self.eased), self.eased, t)
        self.until[:] = np.where(t - self.eased > PRESSED, t + BACK, self.until)
        rules = [np.isnan(self.level).any(axis=1), t < self.until, away, t - self.felt > LOST]
        answers = [Maneuver.HOLD, Maneuver.REVERSE, Maneuver.TURN_R, Maneuver.TURN_L]
        self.maneuver = np.select(rules, answers, Maneuver.FORWARD)
        return self.gait.step(self.maneuver)
