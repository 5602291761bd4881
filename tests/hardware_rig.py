"""Films, controller and supervisor put together in invented time, as a robot would have them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from antennate.control.registry import make_controller
from antennate.hardware.safety.channel import Band, ChannelDiagnosis, Finding
from antennate.hardware.safety.supervisor import Inputs, Outputs, Supervisor
from antennate.params.control import ConditioningParams, ControlParams
from antennate.params.safety import SupervisorParams
from antennate.types import AntennaFrame, Contact, JointCommand, Maneuver, State

PERIOD = 0.01
FREE, BENT = 1872.0, 1450.0
"""Readings of a straight and of a strongly bent flex film [counts]."""
BAND = Band(ConditioningParams().counts_low, ConditioningParams().counts_high, -1)
LIMIT = SupervisorParams().stale_age


def healthy(now: float, **changes: Any) -> Inputs:
    """Inputs of a tick in which all is well, with some changed."""
    settings: dict[str, Any] = {
        "age": 0.005,
        "valid": 1,
        "refused": 0,
        "findings": (Finding.OK, Finding.OK),
        "noise": ("", ""),
        "decided_at": now,
        "maneuver": Maneuver.FORWARD,
        "contact": (Contact.FREE, Contact.FREE),
        "bad_command": "",
        "failure": "",
        "resets": 0,
        "reset_reason": "",
        "board_error": "",
        "missed": {},
        "servo_errors": {},
        "bus_error": "",
        "watchdogs": (),
        "disarmed": (),
        "supply": 12.0,
        "behind": {},
        "outside": {},
        "leaps": {},
        "modes": {},
        "drift": "",
        "imu": "",
        "objections": (),
        "unrecorded": False,
        "stop": False,
        "released": False,
        "arm": False,
    }
    return Inputs(**(settings | changes))


class Ticker:
    """A supervisor with its own invented time."""

    def __init__(self, params: SupervisorParams | None = None) -> None:
        self.supervisor = Supervisor(params or SupervisorParams())
        self.n = 0

    @property
    def now(self) -> float:
        return self.n * PERIOD

    def step(self, **changes: Any) -> Outputs:
        self.n += 1
        return self.supervisor.step(self.now, healthy(self.now, **changes))

    def run(self, ticks: int, **changes: Any) -> list[Outputs]:
        return [self.step(**changes) for _ in range(ticks)]


def armed(params: SupervisorParams | None = None) -> Ticker:
    """One that walks."""
    ticker = Ticker(params)
    ticker.run(20)
    assert ticker.step(arm=True).arming
    assert ticker.step().state is State.OK
    return ticker


class Rig:
    """One tick after the other: readings in, command sent out."""

    def __init__(self, name: str = "paper", control: Any = None) -> None:
        self.control = control or make_controller(name, ControlParams())
        self.films = [ChannelDiagnosis(BAND) for _ in range(2)]
        self.supervisor = Supervisor(SupervisorParams())
        self.n = -1
        self.newest = -math.inf
        self.clear = False
        self.used_ages: list[float] = []
        self.sent: list[JointCommand] = []
        self.outputs: list[Outputs] = []

    @property
    def now(self) -> float:
        return self.n * PERIOD

    def step(
        self,
        samples: Iterable[tuple[float, float, float]],
        age: float | None = None,
        **changes: Any,
    ) -> Outputs:
        """One tick with the samples (time taken [s], left, right [counts]) that arrived for it."""
        self.n += 1
        fresh = 0
        for taken, *counts in samples:
            self.newest = taken
            fresh += self.now - taken <= LIMIT
            for film, reading in zip(self.films, counts, strict=True):
                film.step(taken, reading)
        age = self.now - self.newest if age is None else age
        frame = self._frame(age)
        failure = ""
        try:
            command = self.control.step(frame)
        except RuntimeError as error:
            failure, command = str(error), None
        known = {} if failure else self._known()
        outputs = self.supervisor.step(
            self.now,
            healthy(
                self.now,
                **(
                    {
                        "age": age,
                        "valid": fresh,
                        "findings": tuple(film.reading.finding for film in self.films),
                        "noise": tuple(film.noise_text for film in self.films),
                        "failure": failure,
                    }
                    | known
                    | changes
                ),
            ),
        )
        self.clear = outputs.clear
        if outputs.move:
            assert command is not None
            assert np.isfinite(frame.counts).all()
            self.used_ages.append(self.now - self.newest)
        self.sent.append(command if outputs.move and command is not None else self.sent[-1])
        self.outputs.append(outputs)
        return outputs

    def _frame(self, age: float) -> AntennaFrame:
        usable = age <= LIMIT and self.clear
        counts = [film.reading.counts if usable else math.nan for film in self.films]
        return AntennaFrame(t=np.array([self.now]), counts=np.array([counts]))

    def _known(self) -> dict[str, Any]:
        return {
            "maneuver": int(self.control.maneuver[0]),
            "contact": tuple(self.control.contact[0].tolist()),
        }

    def start(self, counts: tuple[float, float] = (FREE, FREE)) -> None:
        """Arm it and wait until it walks."""
        self.sent.append(self.control.gait.step(np.array([int(Maneuver.HOLD)])))
        self.go(30, counts)
        assert self.step([(self.now + PERIOD, *counts)], arm=True).arming
        self.go(30, counts)
        assert self.outputs[-1].move

    def go(self, ticks: int, counts: tuple[float, float] = (FREE, FREE), **changes: Any) -> None:
        """Some ticks with a fresh sample each."""
        rng = np.random.default_rng(self.n + 1)
        for _ in range(ticks):
            noise = np.rint(rng.normal(0.0, 2.5, 2))
            left, right = (np.array(counts) + noise).tolist()
            self.step([((self.n + 1) * PERIOD, left, right)], **changes)

    def pose_step(self) -> float:
        """Largest change between the last two commands sent [rad]."""
        return pose_change(*self.sent[-2:])


def pose_change(before: JointCommand, after: JointCommand) -> float:
    """Largest change of a joint [rad]."""
    return max(
        float(np.abs(after.yaw - before.yaw).max()), float(np.abs(after.leg - before.leg).max())
    )
