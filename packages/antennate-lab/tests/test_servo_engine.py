"""The fit against data of a physics engine: a servo with friction, a weight and a high supply."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from servo_recordings import written

import antennate
from antennate.robots.servos import XL330Params
from antennate.types import Floats

RATE = 200.0
STEPS = 10
"""Steps of the engine a sample."""
TICK = 2 * math.pi / 4096
VOLTS = 7.3
MASS, LENGTH = 0.3, 0.1
TRUE = XL330Params(
    stall_torque=0.6,
    no_load_speed=9.0,
    armature=0.003,
    friction=0.03,
    load_friction=0.25,
    gain_divisor=200,
)


def engine() -> mujoco.MjModel:
    """A weight on an arm that hangs down, on a position servo at another supply."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 1.0 / RATE / STEPS
    arm = spec.worldbody.add_body(name="arm")
    arm.add_joint(
        name="arm",
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0, 1, 0],
        armature=TRUE.armature,
        damping=TRUE.stall_torque / TRUE.no_load_speed,
    )
    arm.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[1e-3, 0, 0], pos=[0, 0, -LENGTH], mass=MASS
    )
    return spec.compile()


def goals(seconds: float) -> Floats:
    """A sine that grows faster, then two angles that are held, in whole ticks [rad]."""
    t = np.arange(round(seconds * RATE)) / RATE
    swung = 1.2 * np.sin(2 * math.pi * (0.25 * t + 0.1 * t * t))
    held = np.where(t < seconds - 1.0, 1.4, 0.7)
    return TICK * np.round(np.where(t < seconds - 2.0, swung, held) / TICK)


def recorded(path: Path, p_gain: float, seconds: float = 5.0) -> str:
    """What the engine does, as a recording; the last half second without torque."""
    model = engine()
    data = mujoco.MjData(model)
    gain = p_gain / TRUE.gain_divisor / TICK / 885
    stall, entries = TRUE.stall_torque * VOLTS / TRUE.voltage, list[dict[str, Any]]()
    wanted = goals(seconds)
    for i, goal in enumerate(wanted.tolist()):
        on = i < len(wanted) - RATE / 2
        duty = float(np.clip(gain * (goal - data.qpos[0]), -1.0, 1.0)) * on
        entries.append(
            {
                "timestamp": i / RATE,
                "position": TICK * round(data.qpos[0] / TICK),
                "goal_position": goal,
                "load": round(885 * duty),
                "input_volts": VOLTS,
                "torque_enable": on,
            }
        )
        for _ in range(STEPS):
            drive = stall * float(np.clip(gain * (goal - data.qpos[0]), -1.0, 1.0)) * on
            slope = TRUE.stall_torque / TRUE.no_load_speed * on
            motor = drive - slope * data.qvel[0]
            model.dof_damping[0] = slope
            model.dof_frictionloss[0] = TRUE.friction + TRUE.load_friction * abs(motor)
            data.qfrc_applied[0] = drive
            mujoco.mj_step(model, data)
    return str(written(path, entries, p_gain, mass=MASS, length=LENGTH))


@pytest.mark.slow
def test_a_servo_with_friction_a_weight_and_another_supply_is_identified(tmp_path: Path) -> None:
    """Steps of the engine and of the formulas differ, which shows in the inertia most."""
    files = [recorded(tmp_path / f"{gain}.json", gain) for gain in (200, 400)]
    found = antennate.run("servo", recording=files, fit=True).summary
    whole = found["models"][-1]
    assert whole["error_deg"] < 0.2
    for name, rel in (
        ("gain_divisor", 0.01),
        ("stall_torque", 0.02),
        ("no_load_speed", 0.02),
        ("armature", 0.1),
        ("friction", 0.05),
        ("load_friction", 0.05),
    ):
        assert whole[name] == pytest.approx(getattr(TRUE, name), rel=rel), name
