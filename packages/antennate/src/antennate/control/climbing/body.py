"""The vertical part of the command: a body whose links follow a line over edges.

The robot has a plan for each edge: where its head is past the edge. The line rises before the edge
and comes down to the step behind it; each link takes the slope of the line where the plan says that
it is, so that the lift travels down the body.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from antennate.control.climbing.heading import Heading, direction, steer
from antennate.control.gait import STEER, Gait
from antennate.control.knowledge import EDGES
from antennate.errors import ConfigError
from antennate.params.climb import ClimbParams
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Bools, Floats, Ints, JointCommand, Maneuver

_STEEPEST = 0.8
"""Sine of the steepest slope of a link: 53 degrees (ramps over 50 fail)."""
_MOST_SAG = 0.4
"""Most that a target is changed against its load [rad]."""
_REST = 1e-9
"""Change of a target in a tick under which a joint is told to stand [rad]."""


def line(params: ClimbParams, robot: RobotSpec, u: Floats, rise: Floats | float) -> Floats:
    """Height of the centre line at distances u past an edge of a rise [m], the same shape."""
    top = rise + params.over
    up = np.clip((u + params.before + params.ramp) / params.ramp, 0.0, 1.0)
    down = np.clip((u - _level(robot)) / params.settle, 0.0, 1.0)
    return top * _smooth(up) - params.over * _smooth(down)


def _level(robot: RobotSpec) -> float:
    """How far behind an edge the line begins to come down [m]: half a link."""
    return 0.5 * robot.link_pitch


def _smooth(x: Floats) -> Floats:
    return x * x * (3.0 - 2.0 * x)


def pitch_angles(params: ClimbParams, robot: RobotSpec, progress: Floats, rise: Floats) -> Floats:
    """Pitch joints of a body that follows its line over edges [rad], shape (B, P).

    Args:
        params: The line.
        robot: The robot.
        progress: Distance of the head past each edge [m], shape (B, K); NaN where there is none.
        rise: Height for which it is raised at each edge [m], shape (B, K).
    """
    ends = progress[:, :, None] + robot.link_pitch * (0.5 - np.arange(robot.links + 1))
    over = line(params, robot, ends, rise[:, :, None])
    heights = np.nansum(np.where(np.isnan(ends), 0.0, over), axis=1)
    rise = (heights[:, :-1] - heights[:, 1:]) / robot.link_pitch
    slopes = np.arcsin(np.clip(rise, -_STEEPEST, _STEEPEST))
    return slopes[:, :-1] - slopes[:, 1:]


class Body:
    """The vertical part of the command of B robots, and the gait beside it.

    Attributes:
        phase: Gait phase [rad], shape (B,).
        progress: Distance of the head past each edge, by the plan [m], shape (B, K), NaN for none.
        rise: Height for which it is raised at each edge [m], shape (B, K).
        elevation: Where the antennae are to be raised to, from the plane of the tail, however the
            head is raised [rad], shape (B,).
        sweep: Where the bases are to be turned to [rad], shape (B,).
        nod: Lift of the head beside all plans, negative down [rad], shape (B,).
        held: Rows whose pitch joints are brought to their targets in spite of their load, (B,).
        still: Rows whose command stands still, as their readings cannot be used, shape (B,).
        measured: Pitch joints as their servos reported them [rad], shape (B, P); NaN if unknown.
    """

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int) -> None:
        self._params, self._robot, self._period = control.climb, robot, control.period
        self._level = _level(robot)
        self._yaws, self._pitches = robot.places("yaw"), robot.places("pitch")
        self._gait = Gait(control.gait, robot, batch, control.period)
        self.phase: Floats = self._gait.phase
        self._gait.amplitude = np.full(batch, control.gait.amplitude)
        self._amplitude: Floats = self._gait.amplitude
        self._usual = control.gait.amplitude
        self._fast = control.gait.frequency
        self._slow = min(control.climb.frequency, self._fast)
        self.progress: Floats = np.full((batch, EDGES), np.nan)
        self.rise: Floats = np.full((batch, EDGES), control.climb.rise)
        self.elevation: Floats = np.zeros(batch)
        self.sweep: Floats = np.zeros(batch)
        self.nod: Floats = np.zeros(batch)
        self.held: Bools = np.zeros(batch, dtype=bool)
        self.still: Bools = np.zeros(batch, dtype=bool)
        self.measured: Floats = np.full((batch, robot.pitch_count), np.nan)
        self._reported: Floats = np.full((batch, robot.yaw_count), np.nan)
        self._heading: Heading | None = None
        if robot.has_imu:
            self._heading = Heading(control.climb.heading, batch, control.period)
        self._joints: Floats = np.zeros((batch, robot.pitch_count))
        self._stands: Bools = np.zeros(batch, dtype=bool)
        self._sag: Floats = np.zeros((batch, robot.pitch_count))
        self._now: Floats = np.zeros((batch, robot.pitch_count + 2))

    @property
    def climbs(self) -> Bools:
        """Rows with a plan, shape (B,)."""
        return np.logical_or.reduce(self.progress > -np.inf, axis=1)

    @property
    def head_is_up(self) -> Bools:
        """Rows whose head is on its way over an edge, by the plan, shape (B,)."""
        return np.logical_or.reduce(self.progress < self._level + self._params.settle, axis=1)

    @property
    def nose_is_up(self) -> Bools:
        """Rows whose head has yet to come down behind an edge, by the plan, shape (B,)."""
        return np.logical_or.reduce(self.progress < self._level, axis=1)

    @property
    def behind(self) -> Bools:
        """Edges that the head has passed, by the plan, shape (B, K)."""
        return self.progress >= self._level + self._params.settle

    @property
    def raised(self) -> Floats:
        """Elevation of the antennae as it is commanded now [rad], shape (B,)."""
        return self._now[:, -2]

    def reset(self, rows: Ints | Bools, phase: Floats | float = 0.0) -> None:
        """Start some rows anew, level."""
        self._gait.reset(rows, phase)
        self._amplitude[rows] = self._usual
        self.progress[rows] = np.nan
        self.nod[rows] = 0.0
        self._now[rows] = 0.0
        self._sag[rows], self.held[rows], self.still[rows] = 0.0, False, False
        self.rise[rows], self.measured[rows] = self._params.rise, np.nan
        self.elevation[rows] = self.sweep[rows] = 0.0
        self._stands[rows], self._reported[rows], self._joints[rows] = False, np.nan, 0.0
        if self._heading is not None:
            self._heading.reset(rows)

    def begin(self, rows: Bools, rise: float | None = None) -> None:
        """Start a plan of some rows, shape (B,), for an edge ahead, where there is room for one.

        It is raised for a rise [m], that of the parameters if None.
        """
        for row in np.flatnonzero(rows & np.isnan(self.progress).any(axis=1)):
            free = int(np.flatnonzero(np.isnan(self.progress[row]))[0])
            self.progress[row, free] = -self._params.ahead
            self.rise[row, free] = self._params.rise if rise is None else rise

    def advance(self, rows: Bools) -> None:
        """Let the plans of some rows, shape (B,), go on; those that the tail has passed end."""
        self.progress[rows] += self._params.pace * self._period
        self.progress[self.progress > self._robot.length + self._params.settle] = np.nan

    def sink(self, rows: Bools, least: float = 0.0) -> None:
        """Bring the lines that the head is on of some rows, shape (B,), nearer to the floor.

        While the head is up these are those that it has not passed, else those behind it; none is
        brought under a rise `least` [m].
        """
        passed = np.where(self.head_is_up[:, None], ~self.behind, self.behind)
        lower = np.maximum(self.rise - self._params.sink_rate * self._period, least)
        lowered = rows[:, None] & passed & (self.rise > least)
        self.rise = np.where(lowered, lower, self.rise)

    def step(self, maneuver: Ints, turn_offset: Floats | float | None = None) -> JointCommand:
        """Joint targets of the maneuvers and of the plans."""
        wave = np.where(self.climbs, min(self._params.amplitude, self._usual), self._usual)
        change = self._params.amplitude_rate * self._period * (maneuver != int(Maneuver.HOLD))
        self._amplitude += np.clip(wave - self._amplitude, -change, change)
        slow = np.logical_or.reduce(self.progress > -self._params.ahead, axis=1)
        self._gait.frequency = np.where(slow, self._slow, self._fast)
        size = self._gait.params.turn_offset if turn_offset is None else turn_offset
        command = self._gait.steer(maneuver, STEER[maneuver] * size + self._back(maneuver))
        pitch = pitch_angles(self._params, self._robot, self.progress, self.rise)
        pitch[:, 0] += self.nod
        goals = np.column_stack([pitch, self.elevation, self.sweep])
        most = np.full(goals.shape[1], self._params.rate * self._period)
        moves = ~self.still[:, None]
        self._now += np.clip(goals - self._now, -most, most) * moves
        self._carry(goals[:, :-2], moves)
        limit, most = self._robot.pitch.largest, self._robot.elevation.largest
        joints = np.clip(self._now[:, :-2] + self._sag, -limit, limit)
        rests = np.logical_and.reduce(abs(joints - self._joints) < _REST, axis=1)
        self._stands = rests & (maneuver == int(Maneuver.HOLD))
        self._joints = joints
        lowered = np.clip(self._now[:, -2] - self._now[:, :-2].sum(axis=1), -most, most)
        return replace(
            command,
            antenna=np.repeat(self._now[:, -1:], 2, axis=1),
            pitch=joints.copy(),
            elevation=np.repeat(lowered[:, None], 2, axis=1),
        )

    def feel(self, frame: AntennaFrame) -> None:
        """Take where the joints are and how the head turns, where the robot can tell."""
        if frame.positions.size:
            self._reported = frame.positions[:, self._yaws]
            self.measured = frame.positions[:, self._pitches]
        if self._heading is not None:
            along = direction(self._reported, self.measured)
            self._heading.step(frame, along, self._stands)

    def _back(self, maneuver: Ints) -> Floats:
        """Yaw offset that keeps the heading of rows whose head is at an edge [rad], shape (B,).

        It is the heading that they had when the plan began, or when they last steered.
        """
        if self._heading is None:
            return np.zeros(len(maneuver))
        forward = maneuver == int(Maneuver.FORWARD)
        keep = self.nose_is_up & (forward | (maneuver == int(Maneuver.HOLD)))
        self._heading.mark(keep)
        self._heading.forget(~keep)
        return steer(self._params.heading, np.where(forward, self._heading.turned, 0.0))

    def _carry(self, goals: Floats, moves: Bools) -> None:
        """Integrate what the load takes off the pitch joints of held rows; let go of the others."""
        least = self._params.carry_rate * self._period
        lack = np.nan_to_num(goals - self.measured)
        back = np.clip(-self._sag, -least, least)
        change = np.where(self.held[:, None], self._params.carry_gain * self._period * lack, back)
        self._sag = np.clip(self._sag + change * moves, -_MOST_SAG, _MOST_SAG)


def require_pitch(robot: RobotSpec) -> None:
    """Check that a robot can leave the plane."""
    if not robot.pitch_count or not robot.elevation_count:
        lacking = "pitch joints" if not robot.pitch_count else "antennae that rise"
        raise ConfigError(
            f"expected a robot with pitch joints and antennae that rise, such as scuttle3d, found "
            f"one without {lacking}"
        )
