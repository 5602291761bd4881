"""No command accepts a parameter that it does not read: each is seen read in tiny runs, or refused.

A configuration records which of its parameters are read while an experiment runs; checks of the
configuration itself, and writing it down, do not count.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from protocol_logs import CONTROL, sweeps, walk, write
from pydantic import ValidationError
from recorded import act, leaves, meet_ground, recorded, tried
from servo_recordings import of_twin

from antennate import experiments
from antennate.control.protocol import Protocol, Step
from antennate.control.registry import BUILT_IN
from antennate.experiments.force import experiment as force
from antennate.robots.spec import RobotSpec
from antennate_lab.reproduce import experiment as reproduce

RECORDING = "time,counts,bend,trial,speed_m_s\n" + "".join(
    f"{0.01 * i:.2f},{1600 + 60 * np.log((k + 1) / (20 - k)):.0f},{k / 19},{trial},0.1\n"
    for trial in range(6)
    for i in range(20)
    for k in [i]
)
TRACKS = "frame,time,a_x,a_y,b_x,b_y\n" + "".join(
    f"{i},{0.02 * i:.2f},{i},5,{i + 3},4\n" for i in range(30)
)
ROWS = "controller,scene,seed,trial,outcome,time_s\nopen,flat+time_limit=0.1,3,0,timeout,0.1\n"
OTHER_SENSOR = {"kind": "fsr"}
RISING = {"polarity": 1}
"""What the curve of the other sensor needs."""
TINY: dict[str, list[dict[str, Any]]] = {
    "study": [
        {
            "trials": 1,
            "plan": plan,
            "points": 2,
            "settings": {"profiles": ["descending"], "wall": {"travel": 0.03, "start": 0.002}},
            "experiment": "wall",
            "vary": {"wall.speed": vary},
            "assumed": assumed,
            "leave_out": ["wall", "antenna", "variation", "physics"],
            "response": "force_mean_n",
        }
        for plan, vary, assumed in (
            ("grid", [0.2], None),
            ("morris", {"low": 0.2, "high": 0.4}, 0.1),
        )
    ]
    + [
        {
            "trials": 1,
            "plan": "optuna",
            "points": 2,
            "validated": 1,
            "validation_factor": 1,
            "minimize": ["force_mean_n"],
            "settings": {"profiles": ["descending"], "wall": {"travel": 0.03, "start": 0.002}},
            "experiment": "wall",
            "vary": {"wall.speed": [0.2, 0.4]},
            "reference": {"first": {"wall.speed": 0.2}},
        }
    ],
    "tunnel": [
        {
            "trials": 1,
            "time_limit": 0.1,
            "robot": {"antenna": {"sensor": OTHER_SENSOR}},
            "control": {"conditioning": RISING},
        },
        {"trials": 1, "time_limit": 0.1, "controllers": ["geometric"], "control": {"rate": 25.0}},
        {
            "trials": 3,
            "controllers": ["open"],
            "seed": 2,
            "scene": "corridors",
            "time_limit": 0.02,
            "corridors": {"pieces": [2, 2], "room_share": 0.5, "arm_share": 0.5},
        },
        {
            "trials": 1,
            "time_limit": 0.1,
            "controllers": [name for name in BUILT_IN if name != "geometric"],
            "control": {"rate": 25.0},
            "robot": {
                "yaw": {"servo": "xl330_m288"},
                "legs": {"kind": "lifting", "servo": "xl430_w250"},
                "pitch": {"kind": "actuated"},
                "elevation": {"kind": "pair"},
                "imu": {"kind": "head"},
            },
        },
        *(
            {"trials": 1, "controllers": ["open"], "time_limit": 0.02, "scene": scene}
            for scene in ("stairs", "gap", "ramp", "rubble")
        ),
    ],
    "compete": [
        {"trials": 1, "controllers": ["open"], "scenes": ["flat+time_limit=0.1"], "hidden": hidden}
        for hidden in (False, True)
    ]
    + [{"check": "rows.csv"}],
    "gait": [
        {
            "cycles": 2,
            "settling_cycles": 0,
            "sweep_points": 2,
            "gait": {"frequency": 0.8},
            "robot": {
                "yaw": {"servo": servo},
                "antenna": {"sensor": sensor},
                "elevation": {"kind": elevation},
                "imu": {"kind": "head"},
                "legs": {"kind": kind, "servo": "xl430_w250"},
            },
            "unknown": ["robot.leg_friction=0.5:0.6"],
            "draws": 1,
            "physics": {"timestep": 0.004, "contact_time": 0.008},
            "rate": 50.0,
        }
        for servo, sensor, kind, elevation in (
            ("xl330_m288", OTHER_SENSOR, "lifting", "pair"),
            ("xc430_w240", {}, "rolling", "none"),
        )
    ],
    "geometry": [
        {
            "gaits": 3,
            "wave_numbers": [1.0],
            "leads": 5,
            "front_waves": 1,
            "turns": 1,
            "cells": 6,
            "repeats": 1,
            "cycles": 2,
            "settling_cycles": 0,
            "gait": {"frequency": 0.8, "amplitude": 0.3},
            "robot": {
                "yaw": {"servo": servo, "fastest": 4.0},
                "pitch": {"kind": pitch},
                "elevation": {"kind": elevation},
                "imu": {"kind": "head"},
                "antenna": {"sensor": sensor},
                "legs": {"kind": kind, "servo": "xl430_w250"},
            },
            "physics": {"timestep": 0.004, "contact_time": 0.008},
            "rate": 50.0,
        }
        for servo, sensor, kind, pitch, elevation in (
            ("xl330_m288", OTHER_SENSOR, "lifting", "actuated", "pair"),
            ("xc430_w240", {}, "rolling", "locked", "none"),
        )
    ],
    "climb": [
        {
            "trials": 1,
            "heights": [0.05],
            "divisors": [256.0],
            "time_limit": 0.1,
            "robot": {
                "yaw": {"servo": servo},
                "legs": {"kind": kind, "servo": "xl430_w250"},
                "antenna": {"sensor": sensor},
            },
            "control": {"rate": 25.0, "conditioning": RISING if sensor else {}},
        }
        for servo, sensor, kind in (
            ("xl330_m288", OTHER_SENSOR, "lifting"),
            ("xc430_w240", {}, "rolling"),
        )
    ],
    "wall": [
        {
            "trials": 1,
            "profiles": ["descending"],
            "wall": {"travel": 0.03, "start": 0.002, "speed": 0.2},
        }
    ],
    "touch": [
        {
            "trials": 1,
            "speeds": [1.0],
            "profiles": ["stiff"],
            "averaging_times": [0.1],
            "antenna": {"sensor": sensor},
            "conditioning": RISING if sensor else {},
        }
        for sensor in (OTHER_SENSOR, {})
    ],
    "force": [
        {
            "traverses": 4,
            "loads": 2,
            "profiles": ["descending"],
            "place_step": 0.5,
            "speeds": [0.5],
            "hinge_limit_deg": 5.0,
            "antenna": {"sensor": sensor},
            "conditioning": RISING if sensor else {},
        }
        for sensor in (OTHER_SENSOR, {})
    ],
    "sweep": [
        {
            "profiles": ["descending"],
            "distances": [0.6],
            "centres": [1.2],
            "amplitudes": [0.5],
            "sweeps": 1,
            "sweep": {"frequency": 3.0},
            "physics": {"timestep": 0.002, "contact_time": 0.004},
            "estimate": {"trials": 6},
            "antenna": {"sensor": sensor},
        }
        for sensor in (OTHER_SENSOR, {})
    ],
    "calibrate": [
        {"rig": {"pushes": 2, "speeds": [0.3]}},
        {"rig": {"pushes": 2, "speeds": [0.3]}, "antenna": {"sensor": OTHER_SENSOR}},
        {"recording": "recording.csv"},
    ],
    "dataset": [
        {
            "trials": 10,
            "kinds": ["walk"] if sensor else ["walk", "gap", "push"],
            "walk": {"time": 2.5, "windows": 2, "stride": 0.5},
            "robot": {
                "yaw": {"servo": servo},
                "antenna": {"sensor": sensor},
                "legs": {"kind": kind, "servo": "xl430_w250"},
                "elevation": {"kind": "pair"},
                "imu": {"kind": "head"},
            },
            "physics": {"timestep": 0.0025, "contact_time": 0.005},
            "bench": {"timestep": 0.002, "contact_time": 0.004},
        }
        for servo, sensor, kind in (
            ("xl330_m288", OTHER_SENSOR, "lifting"),
            ("xc430_w240", {}, "rolling"),
        )
    ],
    "antenna": [
        {},
        {"hold_time": 1.0, "diameters_mm": [2.0, 1.0], "antenna": {"sensor": OTHER_SENSOR}},
    ],
    "servo": [
        {"recording": ["servo.json"], "fit": True},
        {"recording": ["silent.json"], "servo": "xc430_w240", "supply": 11.1},
        {"recording": ["silent.json"], "servo": "xl430_w250", "supply": 11.1},
    ],
    "tracks": [
        {"synthetic": {"trials": 1, "frames": 200}},
        *(
            {
                "files": ["tracks.csv"],
                "points": {"left": ["a", "b"], "right": ["none"], "tail": "b", "head": "a"},
                "rate": 100.0,
                "playback_rate": 50.0,
                "wall": wall,
            }
            for wall in (
                {"kind": "line", "line": [0.0, 9.0, 1.0, 9.0]},
                {"kind": "circle", "circle": [0.0, 0.0, 90.0]},
            )
        ),
    ],
    "fit": [
        {"log": ["small.mcap"], "robot": "small.toml", "robots": 20, "seed": 1},
        {"log": ["walk.mcap"], "robot": "small.toml", "robots": 20, "poses": ["take.csv"]},
    ],
    "reproduce": [{"quick": True}],
    "build": [
        {
            "robot": {
                "links": 2,
                "pitch": {"kind": kind},
                "elevation": {"kind": "pair"},
                "imu": {"kind": "head"},
                "antenna": {"active_coils": [3.0, 6.0], "length": 0.04, "sensor": sensor},
            }
        }
        for kind, sensor in (("locked", {"active_length": 0.03}), ("actuated", {}))
    ],
}
PARTS = {"antenna": {}, "calibrate": {"rig": {"pushes": 2, "speeds": [0.3]}}}
"""All that `reproduce` runs here."""


MARKS = {
    **dict.fromkeys(("geometry", "climb", "dataset", "sweep"), pytest.mark.slow),
    **dict.fromkeys(("compete", "tunnel", "fit", "build"), pytest.mark.ci),
}


@pytest.mark.ci
@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in TINY])
def test_every_parameter_of_an_experiment_is_read_or_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name == "study":
        pytest.importorskip("optuna", reason="the extra `design` is not installed")
    if name == "build":
        pytest.importorskip("build123d", reason="the extra `build` is not installed")
    monkeypatch.chdir(tmp_path)
    Path("recording.csv").write_text(RECORDING)
    told = of_twin(Path("servo.json"), 1200, 400, 0.5, 1.5).read_text()
    Path("silent.json").write_text(told.replace("input_volts", "volts"))
    Path("tracks.csv").write_text(TRACKS)
    Path("rows.csv").write_text(ROWS)
    Path("small.toml").write_text('links = 2\nmass = 0.8\nantennae.kind = "none"\n')
    small = RobotSpec.named("small.toml")
    steps = *sweeps(small, "leg_l0").steps, Step(maneuver="FORWARD", seconds=2.0)
    write(Path("small.mcap"), small, Protocol(steps=steps).made_for(small, CONTROL))
    walk(Path())
    monkeypatch.setattr(reproduce, "QUICK", PARTS)
    # a bisection that is given no configuration, and takes long
    monkeypatch.setattr(force, "largest_force", lambda chain, limit: 0.05)
    experiment = experiments.load(name)
    read: set[str] = set()
    for values in TINY[name]:
        config = experiment.config.model_validate(values)
        with recorded(config) as found:
            outcome = experiment.run(config, 1, lambda done, total: None, lambda row: None)
            outcome.result()
            if name == "tunnel" and config.control.rate < 50.0:
                for one in config.controllers:
                    act(one, config.control, config.robot)
            if name == "climb" or "climb" in getattr(config, "controllers", ()):
                meet_ground(config.control, config.robot)
        read |= found
    every = set(leaves(experiment.config))
    assert tried(every) - read == tried(set(experiment.config.unread) & every)
    assert set(experiment.config.unread) <= every


def test_all_experiments_of_ours_are_walked() -> None:
    assert set(TINY) == set(experiments.names())


def test_the_walk_sees_what_is_not_read() -> None:
    config = experiments.load("antenna").config()
    with recorded(config) as read:
        assert config.wire_mm > 0
        config.model_copy(update={"coil_mm": 3.0}).coil_mm  # noqa: B018
        config.model_dump()
    assert read == {"wire_mm", "coil_mm"}


def test_a_value_that_is_not_read_is_refused_in_a_file_too() -> None:
    config = experiments.load("wall").config
    default = config().antenna.base_angle
    assert config.model_validate({"antenna": {"base_angle": default}}) == config()
    with pytest.raises(ValidationError, match=r"antenna\.base_angle: expected .* not read here"):
        config.model_validate({"antenna": {"base_angle": 0.5}})
    with pytest.raises(ValidationError, match="columns: expected the default"):
        experiments.load("calibrate").config.model_validate({"columns": {"time_unit": "ms"}})
