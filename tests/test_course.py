"""A drive through a protocol before the twin, in invented time: who is asked what, and when."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from twin_rig import Rig, rig

from antennate.control.protocol import Protocol, Step
from antennate.hardware.config import DriveConfig
from antennate.hardware.driving.drive import drive
from antennate.hardware.driving.protocol import Course, ProtocolController
from antennate.hardware.driving.report import Report
from antennate.hardware.safety.session import Session
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig
from antennate.twin.faults import Faults, read

ROBOT, CONTROL, PERIOD = RobotSpec(), ControlParams(), 0.01
HANG = {"place": "hanging", "joint": "yaw1", "seconds": 1.0}
STAND = {"name": "stand", "seconds": 0.5}
PUSH = {"name": "push", "place": "hand", "antenna": "left", "mark": 80.0, "seconds": 1.0}
RING = {"name": "ring", "place": "hand", "antenna": "right", "let_go": True, "seconds": 1.0}


def protocol(*steps: dict[str, Any]) -> Protocol:
    given = Protocol(carry=2.0, reach=1.0, steps=tuple(Step(**step) for step in steps))
    return given.made_for(ROBOT, CONTROL)


def events_of(course: Course, seconds: float) -> dict[float, tuple[str, ...]]:
    """What begins and ends, by time [s]."""
    found = dict[float, tuple[str, ...]]()
    for tick in range(round(seconds / PERIOD)):
        course.step(7.0 + tick * PERIOD)
        if course.events:
            found[round(tick * PERIOD, 2)] = course.events
    return found


def test_steps_follow_one_another_by_time_and_orders_tell_a_twin_what_to_do() -> None:
    orders: list[str] = []
    plan = protocol(HANG, STAND, PUSH, RING)
    course = Course(plan, ROBOT, CONTROL, tell=orders.append)
    found = events_of(course, 20.0)
    assert orders == [
        "hang",
        "floor",
        "touch left:10mm:80mm",
        "touch left:0mm",
        "touch right:10mm",
        "touch right:0mm",
    ]
    texts = [event for events in found.values() for event in events]
    assert texts == [f"{word} {step.name}" for step in plan.steps for word in ("begin", "end")]
    begin = {events[0].split()[1]: t for t, events in found.items() if "begin" in events[0]}
    end = {events[0].split()[1]: t for t, events in found.items() if "end" in events[0]}
    assert begin["yaw1"] == pytest.approx(0.5 + 2.0, abs=0.03)  # settle, carry
    for step in plan.steps:
        assert end[step.name] - begin[step.name] == pytest.approx(step.seconds)
    assert begin["ring"] - end["push"] == pytest.approx(0.5 + 1.0, abs=0.03)  # settle, reach
    assert course.over


def test_a_person_who_confirms_decides_when_a_step_begins_and_is_told_what_to_do() -> None:
    keys: list[str] = []

    def confirmed() -> bool:
        came = bool(keys)
        keys.clear()
        return came

    course = Course(protocol(HANG), ROBOT, CONTROL, confirmed=confirmed)
    keys.append("x")  # before anything is asked
    assert events_of(course, 30.0) == {}
    assert "do=(hang the robot" in course.note
    assert "press the space bar" in course.note
    keys.append(" ")
    course.step(40.0)
    assert course.events == ("begin yaw1",)


def test_finished_steps_are_left_out_and_the_robot_is_hung_again_where_it_must() -> None:
    orders: list[str] = []
    other = {**HANG, "joint": "yaw2"}
    course = Course(protocol(HANG, other, STAND), ROBOT, CONTROL, {"yaw1"}, tell=orders.append)
    found = [event for events in events_of(course, 12.0).values() for event in events]
    assert found[0] == "begin yaw2"
    assert orders == ["hang", "floor"]
    assert "yaw1" not in " ".join(found)


def test_time_that_is_left_falls_to_nothing_with_the_steps() -> None:
    course = Course(protocol(HANG, STAND), ROBOT, CONTROL)
    course.step(0.0)
    assert "step 1 of 2: yaw1, 4 s, then stand" in course.note  # 0.5 + 2 + 1 of 8 s or so
    first = course.note
    for tick in range(1, 300):
        course.step(tick * PERIOD)
    assert first != course.note
    assert "step 1 of 2: yaw1, 1 s, then stand" in course.note


class Recorded:
    """A drive through a protocol before the twin, and what its physics did."""

    def __init__(
        self, plan: Protocol, each: Callable[[Rig, Session], None] = lambda made, session: None
    ) -> None:
        self.made = rig(TwinConfig.model_validate({"scene": "flat"}))
        session, robot = self.made.session, self.made.robot
        self.ticks: list[tuple[tuple[str, ...], float, float, float]] = []
        self.course = Course(plan, ROBOT, CONTROL, tell=self._order)
        session.control.controller = ProtocolController(CONTROL, ROBOT, self.course, session)

        def tick(session: Session, t: float) -> None:
            middle = robot.world.link_places()[ROBOT.links // 2]
            under = slice(ROBOT.antenna.sensed_hinges)
            left, right = robot.world.bends().reshape(2, -1)[:, under].sum(axis=1).tolist()
            self.ticks.append((session.events, float(middle[2]), left, right))
            each(self.made, session)

        config = DriveConfig(dry_run=0.5, touch_check=False, fault_time=0.5)
        self.report: Report = drive(session, config, arm=True, on_tick=tick)

    def _order(self, order: str) -> None:
        word, _, rest = order.partition(" ")
        robot = self.made.robot
        if word == "touch":
            robot.order_touch(rest)
        else:
            robot.hands.hanging = word == "hang"

    def within(self, name: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Height of the middle link [m] and flex of both antennae [rad] in a step, shape (n, 3)."""
        begin = next(i for i, tick in enumerate(self.ticks) if f"begin {name}" in tick[0])
        end = next(i for i, tick in enumerate(self.ticks) if f"end {name}" in tick[0])
        return np.array([tick[1:] for tick in self.ticks[begin:end]])


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    return Recorded(protocol(HANG, STAND, PUSH, RING))


def test_the_twin_hangs_and_is_put_down(recorded: Recorded) -> None:
    assert (recorded.report.ended, recorded.report.refusal) == ("the end of the protocol", "")
    axle = ROBOT.leg_radius + ROBOT.leg_eccentricity
    hung, stood = recorded.within("yaw1")[:, 0], recorded.within("stand")[:, 0]
    assert hung.min() > 2.0 * axle + 0.01  # no foot reaches the floor, wherever its leg is
    assert np.ptp(hung) < 0.002
    assert axle - 2 * ROBOT.leg_eccentricity < stood.min() <= stood.max() < axle + 0.002


def test_a_push_at_a_mark_bends_the_simulated_antenna_as_its_springs_say(
    recorded: Recorded,
) -> None:
    """y = F sum(a^2 / k) and flex = F sum(a / k), a the distance of a hinge from the mark."""
    antenna = ROBOT.antenna
    stiffness = np.array(antenna.hinge_stiffness())
    arms = np.maximum(0.080 - antenna.link_length * np.arange(len(stiffness)), 0.0)
    under = slice(antenna.sensed_hinges)
    flex = 0.010 * (arms / stiffness)[under].sum() / (arms**2 / stiffness).sum()
    left, right = recorded.within("push")[:, 1:].T
    assert left == pytest.approx(np.full(len(left), flex), rel=0.03)
    assert right == pytest.approx(np.zeros(len(right)), abs=0.01)


def test_an_antenna_that_is_let_go_swings_through_and_comes_to_rest(recorded: Recorded) -> None:
    swing = recorded.within("ring")[:, 2]
    assert swing[0] > 0.05
    assert swing.min() < 0.0
    assert abs(swing[-20:]).max() < 0.05 * swing[0]


def test_a_silent_servo_breaks_a_step_off_and_ends_the_drive() -> None:
    faults: list[Faults] = []

    def each(made: Rig, session: Session) -> None:
        if "begin yaw1" in session.events:
            faults.append(Faults([read("servo:7=silent")], ROBOT.ids))
        for fault in faults:
            fault.apply(made.robot, made.clock.now())

    made = Recorded(protocol(HANG, STAND), each)
    events = [event for tick in made.ticks for event in tick[0]]
    assert events == ["begin yaw1", "break yaw1"]
    assert made.report.worst.name == "FAULT"
    assert made.course.broken
