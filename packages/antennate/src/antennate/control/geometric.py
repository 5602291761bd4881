"""`geometric`: the search of `closed` in metres and degrees, by the model of the gait.

It walks by the gait that the model found fastest at no more cost of transport, and turns by the
configured one. How fast both go follows from the quasi-static model (`antennate.robots.mechanics`),
so escapes keep their mean size, about, at other frequencies and on other robots. They are times all
the same: a single turn depends on the gait phase at which it begins (docs/science/geometry.md). The
body wave goes over from one to the other at limited rates: no joint target jumps.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from antennate.control.escape import SearchRule, Sizes
from antennate.control.gait import DIRECTION, STEER, targets
from antennate.control.kind import ControllerKind, all_but
from antennate.control.rule_controller import RuleController
from antennate.errors import ConfigError
from antennate.params.control import ControlParams, SearchParams
from antennate.params.gaits import GaitParams
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Floats, Ints, JointCommand, Maneuver

if TYPE_CHECKING:
    from geometric_locomotion.twist import TwistMap, Wave

AMPLITUDE_RATE = 0.5
"""Largest change of the amplitude [rad/s]; a second from legs alone to the largest wave."""
LEAD_RATE = 1.0
"""Largest change of the lead [rad/s]."""
NUMBER_RATE = 0.25
"""Largest change of the wave number [1/s]; a second to the other gait, so that legs keep up."""
_SLOWEST, _LEAST_TURN = 0.02, 0.03
"""Least speed [m/s] and rate of turns [rad/s]: an escape would take half a minute (assumed)."""

_SIZES = ("reverse_time", "reverse_most", "turn_time", "lost_turn", "return_time")
"""Parameters of the search that `geometric` has in metres and degrees."""


@lru_cache
def _speeds(robot: str, frequency: float, *waves: Wave) -> tuple[Floats, Floats]:
    """Speed [m/s] and rate of yaw [rad/s] of body waves on a robot, which is given as JSON."""
    from antennate.robots.mechanics import cycles
    from geometric_locomotion.twist import Wave  # only where the model is asked

    columns = (np.array(part, float) for part in zip(*waves, strict=True))
    gait = GaitParams(frequency=frequency)
    walked = cycles(RobotSpec.model_validate_json(robot), gait, Wave(*columns))
    return frequency * walked.step, frequency * walked.yaw


class TwoGaits:
    """A gait to walk by and one to turn by, with a smooth way between them; as `Gait`.

    Args:
        control: The gait of turns, the rates, and which gait walks.
        robot: A robot with rolling legs.
        batch: Number of robots B.

    Attributes:
        phase: Gait phase [rad], shape (B,).
        wave: Amplitude [rad], wave number, lead [rad] and offset [rad] now, shape (B, 4).
        bent: Largest flex of each row, 0 to 1, shape (B,); `soften` lowers the amplitude
            by it.
        frequency: Frequency [Hz].
        speed: Forward speed by the model [m/s].
        turning: Rate of a turn by the model [rad/s].
    """

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int) -> None:
        from geometric_locomotion.twist import Wave  # only where the model is asked

        if robot.legs.kind != "rolling":
            raise ConfigError("expected a robot with rolling legs, found lifting ones")
        gait, own, most = control.gait, control.geometric, robot.yaw_limit
        ahead = gait if own.forward == "gait" else GaitParams.named(own.forward)
        amplitudes = min(ahead.amplitude, most), min(gait.amplitude, most)
        walk = Wave(amplitudes[0], ahead.wave_number, ahead.body_phase, 0.0)
        turn = Wave(amplitudes[1], gait.wave_number, gait.body_phase, control.escape.turn_offset)
        speed, yaw = _speeds(robot.model_dump_json(), gait.frequency, walk, turn)
        self.speed, self.turning = float(speed[0]), abs(float(yaw[1]))
        if self.speed < _SLOWEST or self.turning < _LEAST_TURN:
            raise ConfigError(
                f"expected gaits that walk {_SLOWEST:g} m/s and turn {_LEAST_TURN:g} rad/s at "
                f"least, found {self.speed:.3f} m/s and {self.turning:.3f} rad/s by the model"
            )
        self._goals = np.array([walk, turn], float)
        self._robot, self._soften, self._gait = robot, own.soften, gait
        rates = (AMPLITUDE_RATE, NUMBER_RATE, LEAD_RATE, gait.offset_rate)
        self._most = control.period * np.array(rates)
        self.frequency = gait.frequency
        self._advance = 2.0 * math.pi * gait.frequency * control.period
        self._swing = 2.0 * math.pi * gait.antenna_frequency * control.period
        self._joint = 2.0 * math.pi * np.arange(1, robot.links) / robot.yaw_count
        self.phase, self.bent, self._sweep = np.zeros((3, batch))
        self.wave: Floats = np.tile(self._goals[0], (batch, 1))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew at a phase [rad], in the wave that walks."""
        self.phase[rows] = phase
        self.wave[rows] = self._goals[0]
        self.bent[rows] = self._sweep[rows] = 0.0

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> JointCommand:
        """Advance one control period and return the targets; HOLD keeps the command."""
        moves = (maneuver != int(Maneuver.HOLD))[:, None]
        goal = self._goals[(STEER[maneuver] != 0.0).astype(int)]
        goal[:, 0] *= 1.0 - self._soften * self.bent
        goal[:, 3] *= STEER[maneuver]
        self.wave += moves * np.clip(goal - self.wave, -self._most, self._most)
        self.phase += DIRECTION[maneuver] * self._advance
        self._sweep += moves[:, 0] * self._swing
        amplitude, number, lead, offset = self.wave.T[:, :, None]
        yaw = amplitude * np.sin(number * self._joint + lead - self.phase[:, None]) + offset
        limit = self._robot.yaw_limit
        command = targets(self._gait, self._robot, self.phase, self.wave[:, 3], self._sweep)
        return replace(command, yaw=np.clip(yaw, -limit, limit), leg=self._legs())

    def _legs(self) -> Floats:
        """Angles of rolling legs [rad], shape (B, L, 2): each link later by the wave as it is."""
        lag = 2.0 * math.pi * self.wave[:, 1, None] * np.arange(self._robot.links)
        turned = self.phase[:, None] - lag / self._robot.links
        return turned[:, :, None] + np.array([0.0, math.pi])


def sizes_of(control: ControlParams, speed: float, turning: float) -> Sizes:
    """The sizes of `geometric` as times, of a robot that walks [m/s] and turns [rad/s] so fast."""
    own, search = control.geometric, control.search
    return Sizes(
        patience=search.patience,
        reverse_time=own.reverse_distance / speed,
        reverse_most=own.reverse_most / speed,
        turn_time=own.turn_angle / turning,
        growth=search.growth,
        free_time=search.free_time,
        proof_time=search.proof_time,
        lost_turn=own.lost_angle / turning,
        lost_time=search.lost_time,
        return_time=own.return_angle / turning,
    )


class GeometricRule(SearchRule):
    """The search of `closed`, its sizes in metres and degrees.

    Args:
        control: All numbers of the control.
        gait: How fast it walks and turns, and whom it tells how far antennae are bent.
        batch: Number of rows B.
    """

    def __init__(self, control: ControlParams, gait: TwoGaits, batch: int) -> None:
        self._moves = gait
        super().__init__(control, batch, sizes_of(control, gait.speed, gait.turning))

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick; the gait is told the largest flex of each row."""
        self._moves.bent = np.clip(np.nan_to_num(flex).max(axis=1), 0.0, 1.0)
        return super().step(t, level, contact, flex)


def geometric(control: ControlParams, robot: RobotSpec, batch: int) -> RuleController:
    """`geometric`: `closed` by a faster gait, with escapes in metres and degrees."""
    gait = TwoGaits(control, robot, batch)
    rule = GeometricRule(control, gait, batch)
    return RuleController(rule, control, robot, batch, gait)


def _reads(control: ControlParams, knows: Collection[str]) -> tuple[str, ...]:
    """Parameters that `geometric` reads: no detector and patience where it is told of a jam."""
    search = all_but(SearchParams, "search", *_SIZES, *(["patience"] if "jam" in knows else []))
    detector = "repetition.pressure" if "jam" in knows else "repetition"
    return *search, "geometric", detector, "escape.turn_offset"


class TwistGait:
    """Gaits of B robots that follow forward speeds and curvatures in place of maneuvers.

    Every tick the wave moves towards that of the twist map, no faster than its rates, so that no
    joint target jumps when what is wanted does.

    Args:
        params: Frequency, rate of the offset, and antennae; the map gives the wave.
        robot: The robot that walks, with rolling legs.
        batch: Number of robots B.
        period: Control period [s].
        twists: The twist map of this robot at this frequency.

    Attributes:
        phase: Gait phase [rad], shape (B,).
        wave: Amplitude, lead and offset of the wave as it is now [rad], shape (B, 3).
    """

    def __init__(
        self, params: GaitParams, robot: RobotSpec, batch: int, period: float, twists: TwistMap
    ) -> None:
        self._robot, self._twists = robot, twists
        self._legs = params.model_copy(update={"wave_number": twists.wave_number, "amplitude": 0.0})
        self._advance = 2.0 * math.pi * params.frequency * period
        self._most = period * np.array([AMPLITUDE_RATE, LEAD_RATE, params.offset_rate])
        self._joint = 2.0 * math.pi * twists.wave_number * np.arange(1, robot.links)
        self._joint /= robot.yaw_count
        self.phase: Floats = np.zeros(batch)
        self.wave: Floats = np.tile([0.0, float(twists.lead[0]), 0.0], (batch, 1))

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew at a phase [rad], straight and without a wave."""
        self.phase[rows] = phase
        self.wave[rows] = 0.0, float(self._twists.lead[0]), 0.0

    def step(self, speed: Floats, curvature: Floats) -> JointCommand:
        """Advance one control period and return the targets.

        Args:
            speed: Forward speed [m/s], shape (B,); what the map does not reach is the nearest.
            curvature: Curvature [1/m], shape (B,), positive to the left.
        """
        wanted = [self._twists.gait(*pair) for pair in zip(speed, curvature, strict=True)]
        goal = np.array([(gait.amplitude, gait.lead, gait.offset) for gait in wanted])
        self.wave += np.clip(goal - self.wave, -self._most, self._most)
        self.phase += self._advance
        amplitude, lead, offset = self.wave.T[:, :, None]
        yaw = amplitude * np.sin(self._joint + lead - self.phase[:, None]) + offset
        limit = self._robot.yaw_limit
        command = targets(self._legs, self._robot, self.phase, self.wave[:, 2])
        return replace(command, yaw=np.clip(yaw, -limit, limit))


KINDS = (
    ControllerKind(
        name="geometric",
        about="closed by a faster gait; its escapes are in metres and degrees, by a model",
        make=geometric,
        reads=_reads,
        colour="#117733",
        line=(0, (6, 1.5, 2, 1.5)),
    ),
)
