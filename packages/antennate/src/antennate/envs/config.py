"""Everything that decides the episodes of an environment."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from pydantic import model_validator

from antennate.control.policy.interface import PolicyInterface
from antennate.control.readers import HARDWARE_ALONE, UNREAD_BY_POLICIES
from antennate.params.base import Params, number, require_whole_steps
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec, require_antennae
from antennate.sim.trial import TrialConfig, require_own_curves
from antennate.types import Floats

Range = tuple[float, float]


class Randomisation(Params):
    """Ranges from which constants are drawn for each episode, uniformly; none by default."""

    leg_friction: Range = number((1.0, 1.0), "1", "assumed: as the robot has it")
    """Factor on the friction of all legs."""
    servo_torque: Range = number((1.0, 1.0), "1", "assumed: as the servos have it")
    """Factor on the stall torque of all servos."""
    servo_gain: Range = number((1.0, 1.0), "1", "assumed: as the servos have it")
    """Factor on the position gain of all servos."""
    noise: Range = number((1.0, 1.0), "1", "assumed: as the flex sensor has it")
    """Factor on the noise of readings, beside that of the scene."""
    sensor_gain: Range = number((1.0, 1.0), "1", "assumed: as calibrated")
    """Factor on the change of a reading by flex, of each antenna by itself."""
    sensor_offset: Range = number((0.0, 0.0), "counts", "assumed: as calibrated")
    """What is added to the readings of each antenna."""

    @model_validator(mode="after")
    def _rising(self) -> Randomisation:
        for name in type(self).model_fields:
            low, high = getattr(self, name)
            least = -4095.0 if name == "sensor_offset" else 0.1
            most = 4095.0 if name == "sensor_offset" else 10.0
            if not least <= low <= high <= most:
                raise ValueError(
                    f"{name} must rise from at least {least:g} to at most {most:g}, found {low:g} "
                    f"and {high:g}"
                )
        return self

    def draw(self, rng: np.random.Generator) -> Mapping[str, Floats]:
        """One draw of all: two numbers each, for both antennae; the others read the first."""
        ranges = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: rng.uniform(low, high, 2) for name, (low, high) in ranges.items()}


class EnvConfig(TrialConfig):
    """What an environment is made of: a trial, a policy's interface, and what is drawn."""

    unread: ClassVar[tuple[str, ...]] = HARDWARE_ALONE
    control: ControlParams = ControlParams()
    interface: PolicyInterface = PolicyInterface()
    randomise: Randomisation = Randomisation()
    readings: Literal["own", "none", "swapped"] = number(
        "own", "1", "assumed: what the robot reads"
    )
    """What the policy is given to read: own, none or swapped, as of `antennate tunnel`."""
    time_limit: float | None = number(
        None, "s", "paper: 0.04 m/s without feedback; half of that on 2 m, 100 s", gt=0, le=3600
    )
    """Time after which an episode is truncated; that of its scene if not given."""
    max_episode_steps: int | None = number(None, "1", "assumed: the time limit alone", ge=1)
    """Decisions after which an episode is truncated."""

    def unread_here(self) -> Mapping[str, str]:
        """What this robot does not have, and what no policy with this action reads."""
        own = {"gait": "gait.frequency", "joints": "gait.offset_rate"}
        action = self.interface.action
        paths = (*UNREAD_BY_POLICIES, "gait.turn_offset", *([own[action]] if action in own else []))
        why = f"policies with the action {action!r} do not read it"
        return {**super().unread_here(), **dict.fromkeys((f"control.{p}" for p in paths), why)}

    @model_validator(mode="after")
    def _agree(self) -> EnvConfig:
        require_whole_steps("control.rate", self.control.rate, self.physics.timestep)
        require_own_curves(self.robot, self.control)
        require_antennae(self.robot, "an environment")
        maneuvers = self.interface.action == "maneuver"
        self.robot.require_pace(
            "control.gait.frequency" if maneuvers else "interface.frequency",
            self.interface.fastest_gait(self.control.gait.frequency),
        )
        return self


def varied(robot: RobotSpec, draw: Mapping[str, Floats]) -> RobotSpec:
    """The robot with the constants of a draw."""
    servos = robot.servos
    names = ("servo_torque", "servo_gain", "noise", "leg_friction")
    torque, gain, noise, friction = (float(draw[name][0]) for name in names)
    changed = {
        name: (servo := getattr(servos, name)).model_copy(
            update={"stall_torque": servo.stall_torque * torque, "p_gain": servo.p_gain * gain}
        )
        for name in type(servos).model_fields
    }
    sensor = robot.antenna.sensor
    counts = ("sample_noise_counts", "common_noise_counts", "outlier_counts")
    noisy = sensor.model_copy(update={name: getattr(sensor, name) * noise for name in counts})
    return robot.model_copy(
        update={
            "leg_friction": robot.leg_friction * friction,
            "servos": servos.model_copy(update=changed),
            "antenna": robot.antenna.model_copy(update={"sensor": noisy}),
        }
    )
