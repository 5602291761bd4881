"""How near does a healthy robot come to the bounds by which a joint that does not follow is named?

Trials of `tunnel` in simulation: in every tick the simulated servos tell goal, position and drive,
as real ones would, and `Following` judges them. Below 1 nothing is named:

    python benchmarks/following.py --trials 200 --seed 1 --json > margins.json

With `--hold 4` the robot stands for 4 s after every 4 s of its walk, as in HOLD.
"""

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np

from antennate.control.loop import run_loop
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.hardware.joints import Joints
from antennate.hardware.safety.following import Following
from antennate.params.safety import FollowingParams
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import draw_trial, scene_of
from antennate.types import AntennaFrame, Controller, JointCommand
from dynamixel_bus.model import FULL_DRIVE


class Holding:
    """A controller whose command stands still for a time [s] after each such time of walking."""

    def __init__(self, control: Controller, time: float) -> None:
        self._control, self._time = control, time
        self._command: JointCommand | None = None

    def step(self, frame: AntennaFrame) -> JointCommand:
        if self._command is None or not self._time or float(frame.t[0]) // self._time % 2 == 0:
            self._command = self._control.step(frame)
        return self._command


class Trial:
    """One trial, judged tick by tick.

    Attributes:
        following: The judge.
        saturated: Ticks in which a joint that was judged had full drive.
        status: How it ended.
    """

    def __init__(
        self, config: TunnelConfig, body: SimRobot, name: str, number: int, hold: float
    ) -> None:
        scene, period = scene_of(config), config.control.period
        start = draw_trial(config, scene, number, config.control.gait, period)
        body.load(0, start.world, start.chance)
        self._config, self._body, self._joints = config, body, Joints(config.robot)
        self._control = make_controller(name, config.control, config.robot)
        self._control.reset(np.array([0]), start.phase)
        self._monitor = TrialMonitor(start.episode(config.time_limit), name)
        self._stall = np.array([servo.stall_torque for servo in config.robot.joint_servos])
        self.following = Following(self._joints, FollowingParams())
        self._goals = self._joints.positions(body.world(0).drives())
        self.following.arm(self._goals, dict.fromkeys(config.robot.ids, FULL_DRIVE))
        self.ticks = self.saturated = 0
        self.status = ""
        run_loop(body, Holding(self._control, hold), period, self._go_on)

    def _go_on(self, frame: AntennaFrame, command: JointCommand) -> bool:
        """The last goals have moved the joints; judge that, and take the next ones."""
        world, self.ticks = self._body.world(0), self.ticks + 1
        positions = np.rint(self._joints.positions(world.drives()))
        sign = np.array(self._config.robot.directions)
        pwm = np.rint(FULL_DRIVE * sign * world.drive_torques() / self._stall).astype(int)
        self.following.step((world.t, world.t), self._goals, positions)
        for at in self.following.suspects:
            self.following.drive(world.t, at, int(pwm[at]), int(positions[at]))
            self.saturated += abs(int(pwm[at])) >= FULL_DRIVE - 1
        self._goals = self._joints.ticks(command).astype(float)
        maneuver = int(self._control.maneuver[0])
        self.status = self._monitor.tick(world, maneuver, self._body.failures.get(0)) or ""
        return not self.status


def trials(seed: int, numbers: range, name: str, hold: float) -> Iterator[dict[str, Any]]:
    """Each trial: how it ended, its margins, and the causes that were named."""
    config = TunnelConfig(seed=seed)
    body = SimRobot(1, config.robot, config.control.period, config.physics.timestep)
    for number in numbers:
        trial = Trial(config, body, name, number, hold)
        faults = {key: words for key, words in asdict(trial.following.faults).items() if words}
        margins = {key: round(share, 4) for key, share in asdict(trial.following.margins).items()}
        yield {
            "trial": number,
            "status": trial.status,
            "ticks": trial.ticks,
            "at_full_drive": trial.saturated,
            "margins": margins,
            "named": faults,
        }


def main() -> None:
    """Run the trials and print the largest share of each bound."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--controller", default="closed")
    parser.add_argument("--hold", type=float, default=0.0, help="time to walk and to stand [s]")
    parser.add_argument("--json", action="store_true", help="print one JSON object and no lines")
    args = parser.parse_args()
    rows: list[dict[str, Any]] = []
    numbers = range(args.first, args.first + args.trials)
    for row in trials(args.seed, numbers, args.controller, args.hold):
        rows.append(row)
        if not args.json:
            print(row, flush=True)
    found = {
        "trials": len(rows),
        "ticks": sum(row["ticks"] for row in rows),
        "ticks_at_full_drive": sum(row["at_full_drive"] for row in rows),
        "named": sum(bool(row["named"]) for row in rows),
        "largest": {key: max(row["margins"][key] for row in rows) for key in rows[0]["margins"]},
    }
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
