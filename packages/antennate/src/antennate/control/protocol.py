"""Protocol of recordings: steps as data, and the joint targets of each step.

Joints move alone while the robot hangs, then it walks and stands on the floor, then a hand pushes
its antennae and lets them go. The targets of a step follow from the step, the robot and the time
since the step began; nothing is fed back. So a simulation can be told the same.

A swept joint follows a(f) sin p, whose frequency f rises from `lowest` to `highest` by the same
ratio in each second. Its amplitude is that of the step, and less where the joint would be faster
than SPEED of `fastest`.
"""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from antennate.control.gait import Gait
from antennate.errors import ConfigError
from antennate.messages import nearest, shown
from antennate.params.base import Params, number, own_file, read_file
from antennate.params.control import ControlParams
from antennate.params.scene import HookParams
from antennate.robots.spec import RobotSpec
from antennate.types import Floats, Maneuver, joint_angles

PROTOCOLS = ("identify", "check")
"""Protocols that are known by name; each is a file beside this one."""
EACH = "each"
"""Stands for all joints of the robot, one after the other."""
SPEED = 0.9
"""Share of `fastest` that a sweep uses at most: its end comes to rest on top of that (assumed)."""
SAMPLES = 10
"""Fewest ticks in a period of a sweep (assumed: a sine is still one)."""
_FADE = 0.25
"""Time in which a sweep comes to rest [s] (assumed)."""

_Word = Annotated[str, Field(pattern=r"^[\w.-]*$", max_length=40)]


class Step(Params):
    """One step of a protocol: a joint that is swept, a maneuver, or a push of an antenna."""

    name: _Word = number("", "1", "assumed: that of what moves")
    """Name, unlike that of any other step."""
    place: Literal["hanging", "floor", "hand"] = number("floor", "1", "assumed: it walks")
    """Robot that hangs, walks on the floor, or stands there while a hand pushes an antenna."""
    seconds: float = number(5.0, "s", "assumed: some periods", gt=0, le=600)
    """Duration."""
    joint: _Word = number("", "1", "assumed: none")
    """Joint that is swept while the robot hangs, or `each`."""
    amplitude: float = number(
        0.35, "rad", "assumed: 20 degrees, less than any joint may do", gt=0, le=math.pi
    )
    """Largest amplitude of the joint."""
    lowest: float = number(0.1, "Hz", "paper: PACE, chirps from 0.1 Hz", gt=0, le=100)
    """Frequency at which the sweep begins."""
    highest: float = number(10.0, "Hz", "paper: PACE, chirps up to 10 Hz", gt=0, le=100)
    """Frequency at which the sweep ends."""
    maneuver: Literal["FORWARD", "TURN_L", "TURN_R", "REVERSE", "HOLD"] = number(
        "HOLD", "1", "assumed: it stands"
    )
    """Maneuver on the floor; HOLD stands."""
    frequency: float = number(0.5, "Hz", "assumed: a slow gait", gt=0, le=2)
    """Frequency of the gait on the floor."""
    antenna: Literal["", "left", "right"] = number("", "1", "assumed: none")
    """Antenna that a hand pushes."""
    mark: float | None = number(None, "mm", "assumed: its tip", gt=0, le=1000)
    """Place of the push along the antenna, from its base."""
    aside: float = number(10.0, "mm", "assumed: seen on a ruler, far from any limit", gt=0, le=200)
    """Way of that place to the side, towards the tail."""
    let_go: bool = number(False, "1", "assumed: it is held")
    """Whether the antenna is let go as the step begins; else it is held meanwhile."""

    @model_validator(mode="after")
    def _one_thing_moves(self) -> Self:
        wanted = {"hanging": "joint", "hand": "antenna"}.get(self.place, "maneuver")
        for name in ("joint", "antenna"):
            if bool(getattr(self, name)) != (name == wanted):
                found = "none" if name == wanted else getattr(self, name)
                what = f"one with place {self.place}" if name == wanted else "none"
                raise ValueError(f"{name}: expected {what}, found {found}")
        if self.place != "floor" and self.maneuver != "HOLD":
            raise ValueError(f"maneuver: expected place floor beside it, found {self.place}")
        if self.joint and self.lowest >= self.highest:
            raise ValueError(
                f"lowest must be below highest, found {self.lowest:g} and {self.highest:g} Hz"
            )
        return self

    @property
    def called(self) -> str:
        """Its name, or that of what moves."""
        return self.name or self.joint or self.antenna or self.maneuver.lower()


class Protocol(Params):
    """Steps of recordings, one after the other, and the times between them."""

    about: str = number("", "1", "assumed: nothing to say")
    """Sentence on what it is for."""
    settle: float = number(0.5, "s", "assumed: a joint in the air rests", ge=0.1, le=60)
    """Time in which the joints go to where a step begins; longer where they have far to go."""
    carry: float = number(8.0, "s", "assumed: a robot of 2 kg, and a hook", ge=0, le=600)
    """Time to hang the robot or to put it down, where nobody confirms it by a key."""
    reach: float = number(3.0, "s", "assumed: a hand at the robot", ge=0, le=600)
    """Time to push an antenna, where nobody confirms it by a key."""
    hook: HookParams = HookParams()
    """What the robot hangs by; `fit` simulates it. The default is the hook of the twin."""
    steps: tuple[Step, ...] = number((), "1", "assumed: none")
    """Steps in their order."""

    @model_validator(mode="after")
    def _has_steps(self) -> Self:
        if not self.steps:
            raise ValueError("steps: expected at least one, found none")
        return self

    @classmethod
    def named(cls, text: str) -> Self:
        """The protocol of a name, or of a TOML file with the keys of this model.

        Args:
            text: The name, or the path of the file.

        Raises:
            ConfigError: There is no such protocol, or its file cannot be used.
        """
        if text in PROTOCOLS:
            return read_file(Path(__file__).with_name(f"{text}.toml"), cls)
        return read_file(own_file("--protocol", text, PROTOCOLS), cls)

    def made_for(self, robot: RobotSpec, control: ControlParams) -> Self:
        """The protocol of one robot: a step for each joint, each with its name, all in its limits.

        Args:
            robot: The robot.
            control: Numbers of its control.

        Raises:
            ConfigError: A joint is none of the robot, or an angle or a frequency is beyond its
                limit, or two steps have one name.
        """
        steps = [one for step in self.steps for one in _each(step, robot)]
        for step in steps:
            _require_limits(step, robot, control)
        names = Counter(step.called for step in steps)
        if twice := [name for name, count in names.items() if count > 1]:
            raise ConfigError(f"steps: expected names that differ, found {twice[0]} twice")
        named = (step.model_copy(update={"name": step.called}) for step in steps)
        return self.model_copy(update={"steps": tuple(named)})


def _each(step: Step, robot: RobotSpec) -> list[Step]:
    """The steps that one stands for."""
    if step.joint != EACH:
        return [step]
    prefix = f"{step.name}-" if step.name else ""
    return [
        step.model_copy(update={"joint": name, "name": f"{prefix}{name}"})
        for name in robot.joint_names
    ]


def _require_limits(step: Step, robot: RobotSpec, control: ControlParams) -> None:
    """Refuse what the robot cannot do."""
    bounds: list[tuple[str, float, float, str, str]] = []
    if step.joint:
        if step.joint not in robot.joint_names:
            known = robot.joint_names
            raise ConfigError(
                f"step {step.called}: expected a joint of the robot{nearest(step.joint, known)}, "
                f"found {shown(step.joint)}; it has {', '.join(known)}"
            )
        limit = robot.limits[robot.joint_names.index(step.joint)]
        bounds += [
            ("amplitude", step.amplitude, limit, "rad", "the limit of the joint"),
            ("highest", step.highest, control.rate / SAMPLES, "Hz", "a tenth of control.rate"),
        ]
    elif step.antenna:
        whole = 1e3 * robot.antenna.length
        bounds.append(("mark", step.mark or whole, whole, "mm", "the length of the antenna"))
    elif step.maneuver != "HOLD":
        swing = control.gait.amplitude
        robot.require_pace(f"step {step.called}: frequency", step.frequency, swing)
    for name, value, most, unit, why in bounds:
        if value > most:
            raise ConfigError(
                f"step {step.called}: expected {name} of at most {math.floor(1e3 * most) / 1e3:g} "
                f"{unit}, {why}, found {value:g}"
            )


def targets(step: Step, robot: RobotSpec, control: ControlParams) -> Floats:
    """Joint targets of a step from its beginning on, a row a tick [rad].

    Args:
        step: A step of a protocol that was made for the robot.
        robot: The robot.
        control: Its control: rate and gait; the step gives the frequency.

    Returns:
        Angles, shape (ticks, joints), in the order of the robot's joints.
    """
    ticks = max(1, round(step.seconds / control.period))
    if not step.joint:
        return _walk(step, robot, control, ticks)
    angles = np.zeros((ticks, len(robot.joint_names)))
    place = robot.joint_names.index(step.joint)
    t: Floats = control.period * np.arange(1.0, ticks + 1)
    angles[:, place] = sweep(step, robot.fastest[place], t)
    return angles


def sweep(step: Step, fastest: float, t: Floats) -> Floats:
    """Angles of the swept joint [rad] at times since the step began [s].

    Args:
        step: Amplitude, frequencies and duration.
        fastest: Fastest that the goal of the joint moves [rad/s].
        t: The times, shape (n,).
    """
    growth = math.log(step.highest / step.lowest) / step.seconds
    omega = 2.0 * math.pi * step.lowest * np.exp(growth * t)
    phase = (omega - 2.0 * math.pi * step.lowest) / growth
    size = np.minimum(step.amplitude, SPEED * fastest / np.hypot(omega, growth))
    fade = min(_FADE, step.seconds / 2)
    return size * np.sin(phase) * np.clip((step.seconds - t) / fade, 0.0, 1.0)


def _walk(step: Step, robot: RobotSpec, control: ControlParams, ticks: int) -> Floats:
    """Joint targets of a maneuver that begins straight at phase 0, or of standing there."""
    gait = Gait(control.gait, robot, 1, control.period)
    gait.frequency = step.frequency
    maneuver = np.array([int(Maneuver[step.maneuver])])
    commands: list[Any] = [gait.step(maneuver) for _ in range(ticks)]
    parts = list(robot.command_shapes())
    return np.concatenate([joint_angles(command, parts, 1) for command in commands])


def lead(before: Floats, after: Floats, robot: RobotSpec, period: float, settle: float) -> Floats:
    """Joint targets between two steps, from rest to rest, a row a tick [rad], shape (n, joints).

    Joints that turn without end go the short way; it ends at `after` but for whole turns.

    Args:
        before: Last targets of the step before, shape (joints,).
        after: First targets of the next step, shape (joints,).
        robot: The robot.
        period: Control period [s].
        settle: Shortest time [s]; longer where a joint would exceed half of `fastest`.
    """
    way = after - before
    turning = np.isinf(robot.limits)
    way[turning] -= 2.0 * math.pi * np.rint(way[turning] / (2.0 * math.pi))
    peak = 1.5 * abs(way) / (0.5 * np.array(robot.fastest))
    ticks = math.ceil(max(settle, float(peak.max())) / period)
    share = np.arange(1, ticks + 1)[:, None] / ticks
    return before + way * share * share * (3.0 - 2.0 * share)
