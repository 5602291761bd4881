"""What a robot with lowered antennae does: probe, climb, back off from drops, steer by walls."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from antennate.control.climbing.body import Body
from antennate.control.escape import SearchRule
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import Bools, Floats, Ints, Maneuver

_NEARLY = 0.02
"""How near to its lowest elevation an antenna has come down [rad]."""


class Stage(IntEnum):
    """What a robot is doing."""

    WALK = 0
    PROBE_UP = 1
    LIFT = 2
    CHECK = 3
    PROBE_DOWN = 4
    BACK = 5
    TURN = 6
    STEER = 7
    RETREAT = 8


class Ground(IntEnum):
    """What antennae feel of the ground ahead."""

    FLOOR = 0
    STEP_UP = 1
    DROP = 2
    WALL = 3
    UNKNOWN = 4


class ClimbRule:
    """Feels its way: probes what stands ahead, climbs steps, backs off from drops, steers by walls.

    Args:
        control: All numbers of the control.
        robot: The robot.
        batch: Number of robots B.
        body: The vertical part, which it commands.

    Attributes:
        stage: `Stage`, shape (B,).
        ground: `Ground` ahead, shape (B,).
        height: Height of what was probed last [m], shape (B,): negative of a drop; infinite for a
            wall, minus infinite for a drop without a floor within reach.
    """

    def __init__(self, control: ControlParams, robot: RobotSpec, batch: int, body: Body) -> None:
        self._p, self._feel = control.climb, control.climb.feel
        self._robot, self._period, self._body = robot, control.period, body
        self._steer = SearchRule(control, batch)
        self.turn_offset = self._steer.turn_offset
        self.stage: Ints = np.full(batch, int(Stage.WALK))
        self.ground: Ints = np.full(batch, int(Ground.FLOOR))
        self.height: Floats = np.full(batch, np.nan)
        self._since, self._felt, self._free, self._blind = np.zeros((4, batch))
        self._missed: Floats = np.zeros((batch, 2))
        self._missing: Bools = np.zeros((batch, 2), dtype=bool)
        self._passed: Floats = np.full((batch, 2), np.nan)
        self._climbs: Ints = np.zeros(batch, np.int64)
        self._close: Bools = np.zeros(batch, dtype=bool)

    def reset(self, rows: Ints | Bools) -> None:
        """Start rows anew, walking."""
        self._steer.reset(rows)
        self.stage[rows], self.ground[rows] = Stage.WALK, Ground.FLOOR
        for memory in (self._since, self._felt, self._missed, self._free, self._blind):
            memory[rows] = 0.0
        self._climbs[rows], self._close[rows] = 0, False
        self._passed[rows] = self.height[rows] = np.nan

    def step(self, t: Floats, level: Floats, contact: Ints, flex: Floats) -> Ints:
        """Maneuvers of this tick; a row whose flex cannot be used holds."""
        known: Bools = np.logical_and.reduce(abs(flex) < math.inf, axis=1)
        self._count(flex, known)
        steering = self._steer.step(t, level, contact, flex)
        maneuver = np.full(len(t), int(Maneuver.HOLD))
        for row in np.flatnonzero(known).tolist():
            act = _ACTS[Stage(self.stage.item(row))]
            maneuver[row] = act(self, row, flex[row], steering.item(row))
        self.ground[~known] = Ground.UNKNOWN
        self._body.held, self._body.still = self._body.nose_is_up, ~known
        return maneuver

    def _count(self, flex: Floats, known: Bools) -> None:
        """How long something was felt, ground was missed, nothing was felt, a stage lasted [s]."""
        touches = (flex > self._feel.touch).any(axis=1)
        dt = np.where(known, self._period, 0.0)
        self._felt = np.where(touches, self._felt + dt, 0.0)
        misses = flex < self._feel.missing
        self._missed = np.where(misses, self._missed + dt[:, None], 0.0)
        self._free = np.where(touches, 0.0, self._free + dt)
        self._since += dt
        self._blind = np.maximum(self._blind - dt, 0.0)

    def _to(self, row: int, stage: Stage) -> None:
        self.stage[row] = stage
        self._since[row] = self._felt[row] = 0.0
        self._missed[row] = 0.0

    def _pose(self, row: int, elevation: float, sweep: float = 0.0, nod: float = 0.0) -> None:
        body = self._body
        body.elevation[row], body.sweep[row], body.nod[row] = elevation, sweep, nod

    def _one(self, row: int) -> Bools:
        return np.arange(len(self.stage)) == row

    def _walk(self, row: int, flex: Floats, steering: int) -> int:
        """Walk with lowered antennae, over an edge with raised ones."""
        body = self._body
        body.advance(self._one(row))
        if body.head_is_up[row]:
            self._pose(row, self._feel.tread, self._feel.inwards)
            if self._since[row] > self._feel.settle_time and (flex < self._feel.missing).all():
                body.sink(self._one(row), least=self._p.least)
            return Maneuver.FORWARD
        self._pose(row, self._feel.elevation)
        if self._free[row] > self._feel.plane_time and not body.climbs[row]:
            self._climbs[row] = 0
        above = body.behind[row] & (body.rise[row] > 0.0)
        if above.any() and (flex < self._feel.missing).any():
            body.sink(self._one(row))
        self.ground[row] = Ground.FLOOR
        if self._since[row] < self._feel.settle_time or self._blind[row]:
            return Maneuver.FORWARD
        if self._felt[row] > self._feel.touch_time:
            self._passed[row] = np.nan
            over = abs(self.height[row]) < self._p.lowest  # what it thought to walk over holds it
            self._close[row] = over and self._since[row] < self._p.over_time
            self._to(row, Stage.PROBE_UP)
        elif self._misses_ground(row) and not above.any():
            self.ground[row] = Ground.DROP
            self._missing[row] = self._missed[row] > 0.0
            self._to(row, Stage.PROBE_DOWN)
        return Maneuver.FORWARD if self.stage[row] == Stage.WALK else Maneuver.HOLD

    def _misses_ground(self, row: int) -> bool:
        """Whether both antennae miss the ground for a while, or one, as at an edge met aslant."""
        low, high = sorted(self._missed[row].tolist())
        return max(low - self._feel.missing_time, high - self._feel.aslant_time) > 0.0

    def _probe_up(self, row: int, flex: Floats, steering: int) -> int:
        """Stand, and raise the antennae until both have slipped over the edge."""
        angle = self._feel.elevation + self._feel.sweep_rate * self._since[row]
        self._pose(row, angle, self._feel.inwards)
        lower = np.fmin(self._passed[row], self._body.raised[row])
        self._passed[row] = np.where(flex > self._feel.clear, np.nan, lower)
        if angle < self._feel.highest:
            return Maneuver.HOLD
        passed = float(self._passed[row].max())
        rise = self._feel.level_height + self._feel.height_slope * passed
        self.height[row] = math.inf if math.isnan(passed) else rise
        self.ground[row] = Ground.STEP_UP
        if self._climbs[row] >= self._p.attempts:
            self._wall(row)
        elif self.height[row] < self._p.lowest and not self._close[row]:
            self._blind[row] = self._p.step_time
            self._to(row, Stage.WALK)
        elif (self._climbs[row] or self._close[row]) and not self._body.climbs[row]:
            self._to(row, Stage.RETREAT)
        else:
            self._raise(row)
        return Maneuver.HOLD

    def _tip(self, angle: float) -> float:
        """Height of the tip of a straight antenna at an elevation [m]."""
        axle = self._robot.leg_radius + self._robot.leg_eccentricity
        return axle + self._robot.antenna.length * math.sin(angle)

    def _raise(self, row: int) -> None:
        """Begin a climb, by the height of the probe if it is low and nothing speaks against it."""
        low = self.height[row] < self._p.low and not (self._climbs[row] or self._close[row])
        rise = self.height[row] + self._p.spare if low else self._p.rise
        self._climbs[row] += not self._body.climbs[row]
        self._body.begin(self._one(row), rise)
        self._to(row, Stage.LIFT)

    def _lift(self, row: int, flex: Floats, steering: int) -> int:
        """Stand until the head is raised, then the antennae level before it.

        They are spread a little: one that is pushed along its axis may bend the other way, which is
        no touch.
        """
        late = self._since[row] > 0.5 * self._p.lift_time
        self._pose(row, self._feel.check if late else self._feel.highest, self._feel.check_sweep)
        if self._since[row] > self._p.lift_time:
            self._to(row, Stage.CHECK)
        return Maneuver.HOLD

    def _check(self, row: int, flex: Floats, steering: int) -> int:
        """Walk on with the head raised: what its level antennae touch is higher than any step."""
        if self._since[row] > self._p.approach_time:
            self._body.advance(self._one(row))
        if self._felt[row] > self._feel.check_time:
            self._wall(row)
        elif not (self._body.progress[row] < -self._p.before).any():
            self._to(row, Stage.WALK)
        return Maneuver.FORWARD

    def _wall(self, row: int) -> None:
        """Give up plans for what is ahead, and steer; those behind the head go on."""
        self.ground[row], self.height[row] = Ground.WALL, math.inf
        self._body.progress[row, ~self._body.behind[row]] = np.nan
        self._steer.reset(np.array([row]))
        self._to(row, Stage.STEER)

    def _probe_down(self, row: int, flex: Floats, steering: int) -> int:
        """Creep until the head is past the edge, and lower it with the antennae to find ground."""
        since = self._since[row] - self._feel.creep_time
        if since < 0.0:
            self._pose(row, self._feel.elevation)
            return Maneuver.FORWARD
        angle = self._feel.elevation - self._feel.sweep_rate * since
        self._pose(row, angle, self._feel.inwards, self._feel.bow)
        if (flex > self._feel.clear)[self._missing[row]].all():
            self.height[row] = self._tip(self._body.raised[row])
            self._blind[row] = self._p.drop_time
            self._to(row, Stage.WALK)
        elif self._body.raised[row] <= self._feel.lowest + _NEARLY:
            self.height[row] = -math.inf
            self._to(row, Stage.BACK)
        return Maneuver.HOLD

    def _retreat(self, row: int, flex: Floats, steering: int) -> int:
        """Back off from a step that it stands at, to have room for the head."""
        self._pose(row, 0.5 * self._feel.highest)
        if self._since[row] > self._p.retreat_time:
            self._raise(row)
        return Maneuver.REVERSE

    def _back(self, row: int, flex: Floats, steering: int) -> int:
        """Back off from a drop, and before that over the way that it crept."""
        self._pose(row, self._feel.elevation)
        if self._since[row] > self._p.back_time + self._feel.creep_time:
            self._to(row, Stage.TURN)
        return Maneuver.REVERSE

    def _turn(self, row: int, flex: Floats, steering: int) -> int:
        """Turn away from a drop."""
        if self._since[row] > self._p.turn_time:
            self._to(row, Stage.WALK)
        return Maneuver.TURN_R

    def _in_plane(self, row: int, flex: Floats, steering: int) -> int:
        """Steer by level antennae, as `closed` does, until nothing is felt for a while."""
        self._pose(row, 0.0, self._feel.plane_sweep)
        if steering == Maneuver.FORWARD:
            self._body.advance(self._one(row))
        if self._free[row] > self._feel.plane_time and steering == Maneuver.FORWARD:
            self._to(row, Stage.WALK)
        return steering


_ACTS = {
    Stage.WALK: ClimbRule._walk,
    Stage.PROBE_UP: ClimbRule._probe_up,
    Stage.LIFT: ClimbRule._lift,
    Stage.CHECK: ClimbRule._check,
    Stage.PROBE_DOWN: ClimbRule._probe_down,
    Stage.BACK: ClimbRule._back,
    Stage.TURN: ClimbRule._turn,
    Stage.STEER: ClimbRule._in_plane,
    Stage.RETREAT: ClimbRule._retreat,
}
