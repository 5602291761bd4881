"""A controller that goes through a protocol of recordings, under the same supervisor.

Its time begins once torque is on and the joints have reached the first command. Before a step the
joints go to where it begins; then, where a person has something to do, the robot stands until that
is confirmed, or for the protocol's time. A HOLD or a FAULT breaks the step off: a HOLD ends the
drive, a FAULT as in any drive.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple

import numpy as np

from antennate.control.protocol import Protocol, Step, lead, targets
from antennate.control.rule_controller import RuleController
from antennate.hardware.driving.teleop import KeyRule
from antennate.hardware.safety.session import Session
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.types import AntennaFrame, Floats, JointCommand, Maneuver, State, joint_command

_REST = 0.5
"""Time in which the robot stands after the last step [s] (assumed)."""
Task = tuple[str, str]
"""What a person does: in words, and as an order that a twin takes."""
_NOTHING: Task = ("", "")


class _Stage(NamedTuple):
    """A step, or what comes before it: the way to it, or a task of a person.

    Attributes:
        step: The step.
        rows: Targets, a row a tick [rad], shape (ticks, joints).
        task: What a person does as it begins.
        asks: Whether that is to be confirmed.
        runs: Whether it is the step itself.
    """

    step: Step
    rows: Floats
    task: Task = _NOTHING
    asks: bool = False
    runs: bool = False


def _tasks(step: Step, hanging: bool) -> Iterator[Task]:
    """What a person does before a step of a robot that hangs or stands."""
    if hanging and step.place != "hanging":
        yield "put the robot down on the floor", "floor"
    elif not hanging and step.place == "hanging":
        yield "hang the robot by its middle, all legs free", "hang"
    if step.place == "hand":
        where = "its tip" if step.mark is None else f"{step.mark:g} mm from its base"
        what = f"push the {step.antenna} antenna {step.aside:g} mm towards the tail"
        mark = "" if step.mark is None else f":{step.mark:g}mm"
        yield f"{what} at {where} and hold it", f"touch {step.antenna}:{step.aside:g}mm{mark}"


def _stages(
    protocol: Protocol, robot: RobotSpec, control: ControlParams, done: Collection[str]
) -> Iterator[_Stage]:
    """Stages of the steps that are left, each from where the one before it ends; then a rest."""
    period, hanging = control.period, False
    left = [step for step in protocol.steps if step.called not in done]
    last, after = targets(left[0], robot, control)[0], _NOTHING
    for step in left:
        rows = targets(step, robot, control)
        way = lead(last, rows[0], robot, period, protocol.settle)
        yield _Stage(step, way, after)
        for task in _tasks(step, hanging):
            time = protocol.reach if task[1].startswith("touch") else protocol.carry
            stand = np.tile(way[-1], (max(1, round(time / period)), 1))
            yield _Stage(step, stand, task, asks=True)
        release = f"let go of the {step.antenna} antenna", f"touch {step.antenna}:0mm"
        rows += way[-1] - rows[0]  # whole turns of legs
        yield _Stage(step, rows, release if step.let_go else _NOTHING, runs=True)
        after = release if step.antenna and not step.let_go else _NOTHING
        last, hanging = rows[-1], step.place == "hanging"
    yield _Stage(left[-1], np.tile(last, (round(_REST / period), 1)), after)


class Course:
    """The course of a protocol: what is commanded and asked at a time.

    Args:
        protocol: Made for the robot.
        robot: The robot.
        control: Its control.
        done: Names of steps that are left out; not all.
        confirmed: Whether a person has confirmed a task since the last call; None where nobody
            does, and each task takes the time of the protocol.
        tell: Told the order of each task.

    Attributes:
        angles: Targets of now [rad], shape (joints,).
        events: What began or ended with this tick.
        over: Whether there is nothing more.
        broken: Whether it was broken off.
    """

    def __init__(
        self,
        protocol: Protocol,
        robot: RobotSpec,
        control: ControlParams,
        done: Collection[str] = (),
        confirmed: Callable[[], bool] | None = None,
        tell: Callable[[str], None] = lambda order: None,
    ) -> None:
        self._names = [step.called for step in protocol.steps]
        self._stages = list(_stages(protocol, robot, control, done))
        self._period, self._confirmed, self._tell = control.period, confirmed, tell
        self._at, self._row, self._since = 0, 0, math.nan
        self.angles: Floats = self._stages[0].rows[0]
        self.events: tuple[str, ...] = ()
        self.over = self.broken = False

    def step(self, t: float) -> None:
        """Go on to a time [s]; the first one begins it."""
        self._since = t if math.isnan(self._since) else self._since
        self.events, stage = (), self._stages[self._at]
        self._row = round((t - self._since) / self._period)
        asks = stage.asks and self._confirmed is not None
        if self._confirmed() if asks and self._confirmed else self._row >= len(stage.rows):
            self.over = self._at == len(self._stages) - 1
            if not self.over:
                stage = self._next(stage, t)
        self.angles = stage.rows[min(self._row, len(stage.rows) - 1)]

    def _next(self, before: _Stage, t: float) -> _Stage:
        """Begin the next stage."""
        self._at, self._row, self._since = self._at + 1, 0, t
        stage = self._stages[self._at]
        if stage.asks and self._confirmed is not None:
            self._confirmed()  # what was typed before is no answer
        if stage.task[1]:
            self._tell(stage.task[1])
        ends = (f"end {before.step.called}",) if before.runs else ()
        self.events = (*ends, f"begin {stage.step.called}") if stage.runs else ends
        return stage

    def break_off(self) -> None:
        """Stay where it is, for good."""
        stage = self._stages[self._at]
        self.events = (f"break {stage.step.called}",) if stage.runs else ()
        self.broken = True

    @property
    def maneuver(self) -> Maneuver:
        """Maneuver of now."""
        stage = self._stages[self._at]
        return Maneuver[stage.step.maneuver] if stage.runs else Maneuver.HOLD

    @property
    def note(self) -> str:
        """Step of now and the next one, how long they take, and what a person is to do."""
        if self.broken or math.isnan(self._since) or self._at == len(self._stages) - 1:
            return ""
        now, *later = self._stages[self._at :]
        step, later = now.step, later[:-1]
        rest = max(0, len(now.rows) - self._row)
        own = rest + sum(len(stage.rows) for stage in later if stage.step is step)
        minutes, seconds = divmod(
            round(self._period * (rest + sum(len(stage.rows) for stage in later))), 60
        )
        following = next((s.step.called for s in later if s.step is not step), "the end")
        name = f"step {1 + self._names.index(step.called)} of {len(self._names)}: {step.called}"
        text = (
            f"{name}, {self._period * own:.0f} s, then {following}, {minutes}:{seconds:02} min left"
        )
        key = "; then press the space bar" if now.asks and self._confirmed is not None else ""
        return f"{text} do=({now.task[0]}{key})" if now.task[0] else text


class ProtocolController(RuleController):
    """The controller of one robot that goes through a protocol.

    Args:
        control: Numbers of the control.
        robot: The robot.
        course: What is commanded when.
        session: Tells when the robot is ready, and its state.
    """

    def __init__(
        self, control: ControlParams, robot: RobotSpec, course: Course, session: Session
    ) -> None:
        self._wish = KeyRule(control)
        super().__init__(self._wish, control, robot, 1)
        self._course, self._session, self._begun = course, session, False
        self._shapes = robot.command_shapes()

    @property
    def phase(self) -> Floats:
        """Gait phase: none is told."""
        return np.full(1, math.nan)

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the command for this frame.

        Raises:
            KeyboardInterrupt: The protocol is over, or a HOLD has broken it off.
        """
        session, course = self._session, self._course
        state = State.OK if session.outputs is None else session.outputs.state
        self._begun |= session.tally.sent > 0 and state < State.HOLD
        if course.over or (course.broken and state < State.FAULT):
            raise KeyboardInterrupt("the end of the protocol" if course.over else "a HOLD")
        if self._begun and not course.broken:
            course.step(float(frame.t[0])) if state < State.HOLD else course.break_off()
            session.note, session.events = course.note, course.events
        self._wish.wanted = course.maneuver
        super().step(frame)  # contact and level of the readings
        return joint_command(course.angles, self._shapes)
