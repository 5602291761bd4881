"""Robots with other antennae, and what they read: `python docs/science/sides.py PART`.

Parts: `designs` writes docs/science/sides_designs.json, the antennae and motions that are asked for
the side of the way. `trials FOLDER` runs `geometric` with each of them in the scenes with corners,
and keeps what a real frame has beside what is true; it goes on where it was stopped. What the
readings tell is judged by docs/science/sides_told.py, by the criterion of docs/science/sides.md.

A robot backs off when the rule of `geometric` calls its readings those of a jam (`felt`), or, so
that a design that feels no jam is asked all the same, when it has not got on for JAM_TIME by the
truth (`jam`). Each design has draws of its own, so that designs are as many samples of the places.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from antennate.control.conditioning import RepetitionDetector, RunningMean, level_and_fraction
from antennate.control.knowledge import Kind, Knowledge
from antennate.control.registry import make_controller
from antennate.experiments.tunnel.batch import run_trials
from antennate.experiments.tunnel.lockstep import Apparatus
from antennate.experiments.tunnel.physics import TrialMonitor, TunnelConfig
from antennate.params.control import ControlParams
from antennate.params.gaits import GaitParams
from antennate.robots.antenna import AntennaSpec, SensorParams
from antennate.robots.imu import ImuParams
from antennate.robots.spec import RobotSpec
from antennate.sim.scenes.registry import make_scene
from antennate.sim.sim_robot import SimRobot
from antennate.studies.plan import Range, make_points
from antennate.types import AntennaFrame, Bools, Floats, JointCommand, Maneuver

DESIGNS = Path(__file__).with_name("sides_designs.json")
SEEDS = {"smoke": 590_003, "screening": 590_301, "best": 590_202}
"""Of the draws of each plan; only the first was used while anything was chosen."""
EACH = 3
"""Episodes of each scene in a round of a design."""
MOST_DESIGNS = 100
"""In the file, so that a design more leaves the draws of the others as they are."""
LIMIT = 60.0
"""Time after which an episode ends [s]."""
FREQUENCY = 0.8
"""Of the gait [Hz]; its reason stands in sides.md."""
APPROACH = 0.4
"""From the start to the entrance [m]: antennae of 0.32 m touch nothing at the start."""
SCENES = ("tunnel", "corner", "uturn", "room", "deadend")
EVERY = 5
"""Ticks that one sample is the mean of: 20 Hz."""
JAM_TIME = 1.9
"""Time for which a robot is jammed before it is told [s]; the rule itself needs 1.5 gait cycles."""
LINK = 0.02
"""Link of the paper's antenna [m], of which coils and mass are known."""
AXES = {
    "length": Range(low=0.08, high=0.32),
    "angle": Range(low=20.0, high=85.0),
    "softness": Range(low=0.25, high=2.0, log=True),
    "taper": Range(low=1.0, high=9.0, log=True),
    "sensor": Range(low=0.3, high=1.0),
    "swing": Range(low=0.3, high=1.0),
    "seconds": Range(low=1.5, high=4.0),
    "motion": ["none", "sinusoid", "outwards", "look", "neck"],
}
KNOWN: tuple[Kind, ...] = ("side", "jam", "facing")
COLUMNS = (
    *("row", "t", "left", "right", "base_left", "base_right"),
    *(f"yaw{i}" for i in range(1, 6)),
    *(f"error{i}" for i in range(1, 6)),
    *("lag_left", "lag_right", "gyro", "maneuver", "stage", "phase"),
    *(*KNOWN, "felt", "x", "y", "heading"),
)
"""Of a sample. Counts, angles [rad], the yaw joints' error and the legs' lag [rad] and the rate of
yaw [rad/s] are means over EVERY ticks, the rest is of the last of them. `stage` is 1 while the
robot looks to its left before a turn, 2 while it looks to its right, `felt` whether the rule of
`geometric` would call it jammed, `side` and `jam` what a simulation tells."""


@dataclass(frozen=True)
class Design:
    """An antenna and how it is moved.

    Attributes:
        name: A number, or a word.
        length: Of the antenna [m].
        angle: From the heading to its base [deg].
        softness: Coils of its first spring for each of the paper's, on links as long.
        taper: Coils of the last spring for one of the first.
        sensor: Share of its length that is sensed, from the base.
        motion: `none`; `sinusoid`, always; `outwards` and in while backing off; `look`: one antenna
            after the other goes out and in before a turn; `neck`: the front three joints bend to
            the left and then to the right before a turn.
        swing: Share of the largest motion: 0.7 rad of a sinusoid, 0.9 rad else, the whole bend of
            a joint of the neck.
        seconds: Time out and in, or of one side [s].
    """

    name: str
    length: float = 0.12
    angle: float = 47.0
    softness: float = 1.0
    taper: float = 3.0
    sensor: float = 0.794
    motion: str = "none"
    swing: float = 1.0
    seconds: float = 2.0

    @property
    def robot(self) -> RobotSpec:
        """`scuttle` with these antennae and an inertial sensor."""
        links = min(12, max(4, round(self.length / 0.025)))
        link = self.length / links
        coils = 3.0 * self.softness * self.taper ** ((np.arange(links) + 0.5) / links)
        antenna = AntennaSpec(
            active_coils=tuple((coils * link / LINK).clip(0.25).round(4).tolist()),
            sensor_stiffness_n_mm_per_deg=0.048 * LINK / link,
            length=self.length,
            link_mass=0.0008 * link / LINK,
            base_angle=math.radians(self.angle),
            sensor=SensorParams(active_length=self.sensor * self.length),
        )
        if self.name.startswith("today"):
            antenna = AntennaSpec()
        return RobotSpec(antenna=antenna, imu=ImuParams(kind="head"))

    @property
    def control(self) -> ControlParams:
        """The numbers of `geometric`."""
        amplitude = 0.7 * self.swing if self.motion == "sinusoid" else 0.0
        return ControlParams(gait=GaitParams(frequency=FREQUENCY, antenna_amplitude=amplitude))


def designs() -> dict[str, Design]:
    """All designs of the file, by name."""
    return {d["name"]: Design(**d) for d in json.loads(DESIGNS.read_text())}


def propose() -> None:
    """Write the designs: today's antenna with four motions, and 60 of Sobol's points."""
    today = [Design("today"), *(Design(f"today-{m}", motion=m) for m in AXES["motion"][2:])]
    points = make_points("sobol", AXES, 60, 59)
    found = [asdict(d) for d in today]
    for number, point in enumerate(points):
        rounded: dict[str, Any] = {
            k: round(v, 4) if isinstance(v, float) else v for k, v in point.items()
        }
        found.append(asdict(Design(f"{number:02d}", **rounded)))
    DESIGNS.write_text("[\n" + ",\n".join(f" {json.dumps(design)}" for design in found) + "\n]\n")


def scene_name(rng: np.random.Generator) -> str:
    """The scene that a draw begins with."""
    return SCENES[int(rng.integers(len(SCENES)))]


class Approached:
    """One of the scenes, drawn by chance; the robot starts before its entrance."""

    random = True

    def draw(self, robot: RobotSpec, rng: np.random.Generator) -> Any:
        """Draw one, with cylinders where today's robot would have them."""
        name = scene_name(rng)
        return Begun(make_scene(name).draw(RobotSpec(), rng), name)


class Begun:
    """A drawn scene that begins before its entrance.

    Attributes:
        name: Of the scene.
    """

    start = (-APPROACH, 0.0, 0.0)

    def __init__(self, drawn: Any, name: str) -> None:
        self._drawn, self.name = drawn, name

    def __getattr__(self, name: str) -> Any:
        return getattr(self._drawn, name)


def _chance(seed: int, number: int) -> np.random.Generator:
    """What a draw of that number begins with."""
    return np.random.default_rng(np.random.SeedSequence([seed, number]).spawn(3)[0])


@cache
def drawn(seed: int, number: int) -> Begun:
    """The scene of a draw."""
    return Approached().draw(RobotSpec(), _chance(seed, number))


def numbers_of(seed: int, each: int, block: int) -> list[int]:
    """Draws of a block: so many of each scene, which no other block has."""
    of: dict[str, list[int]] = {scene: [] for scene in SCENES}
    number = 0
    while min(map(len, of.values())) < (block + 1) * each:
        of[scene_name(_chance(seed, number))].append(number)
        number += 1
    some = [numbers[block * each : (block + 1) * each] for numbers in of.values()]
    return [number for numbers in zip(*some, strict=True) for number in numbers]


class Moved:
    """`geometric` with moved antennae or a neck that looks; it is told of a jam, and recorded.

    Args:
        design: What it carries and does.
        control: Its numbers.
        robot: The robot.
        batch: Rows.
        bodies: The simulated robots.
    """

    knows = needs = KNOWN

    def __init__(
        self, design: Design, control: ControlParams, robot: RobotSpec, batch: int, bodies: Any
    ) -> None:
        self._made: Any = make_controller("geometric", control, robot, batch)
        self._design, self._bodies, self._limit = design, bodies, robot.yaw_limit
        self._curve, self._mean = (
            control.conditioning,
            RunningMean(control.conditioning, batch, control.period),
        )
        self._detector = RepetitionDetector(
            control.repetition, batch, control.period, control.gait.frequency
        )
        self._truth, self._felt = Knowledge(), np.zeros(batch, bool)
        self._patience, self._jammed = control.search.patience, np.full(batch, np.inf)
        self._walks = np.zeros(batch)
        self._before = np.zeros(batch, int)
        self._since = np.full(batch, np.nan)
        self._looked = np.full(batch, np.inf)
        self._sums: dict[int, list[Floats]] = {row: [] for row in range(batch)}
        self.numbers: dict[int, int] = {}
        self.samples: list[Any] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self._made, name)

    @property
    def maneuver(self) -> Any:
        """`HOLD` while it looks."""
        return np.where(np.isfinite(self._looked), int(Maneuver.HOLD), self._made.maneuver)

    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        """Start rows anew."""
        self._made.reset(rows, phase)
        self._mean.reset(rows)
        self._detector.reset(rows)
        self._before[rows], self._since[rows], self._looked[rows] = 0, np.nan, np.inf
        self._jammed[rows], self._walks[rows], self._felt[rows] = np.inf, 0.0, False
        for row in np.arange(len(self._before))[rows]:
            self._sums[int(row)] = []

    def know(self, knowledge: Knowledge) -> None:
        """Keep the truth."""
        self._truth = knowledge

    def step(self, frame: AntennaFrame) -> JointCommand:
        """One control period: the rule, then the motion."""
        t, looking = frame.t, np.isfinite(self._looked)
        _, flex = level_and_fraction(self._curve, self._mean.step(frame.counts))
        walking = (self._before == int(Maneuver.FORWARD)) & ~looking
        self._walks = np.where(walking, self._walks, t)
        felt = self._detector.step(flex, walking) & (t - self._walks >= self._patience)
        jam = self._truth.jam if self._truth.jam is not None else np.zeros(len(t), bool)
        self._jammed = np.where(jam & walking, np.minimum(self._jammed, t), np.inf)
        self._felt = np.where(walking, felt, self._felt)
        self._made.know(Knowledge(jam=felt | (t - self._jammed >= JAM_TIME)))
        counts = np.where(looking[:, None], np.nan, frame.counts)  # so that it holds, and waits
        command = self._made.step(replace(frame, counts=counts))
        self._mark(frame.t, self._made.maneuver, looking)
        command = self._moved(frame.t, command)
        self._keep(frame, command)
        return command

    def _mark(self, t: Floats, maneuver: Any, looking: Bools) -> None:
        """Note when rows begin to back off, and when looks begin and end."""
        now = np.where(looking, self._before, maneuver)
        now = np.where(now == int(Maneuver.HOLD), self._before, now)
        reverse = int(Maneuver.REVERSE)
        self._since = np.where((now == reverse) & (self._before != reverse), t, self._since)
        self._since = np.where(now == reverse, self._since, np.nan)
        if self._design.motion in ("look", "neck"):
            begins = (self._before == reverse) & (now != reverse)
            self._looked = np.where(begins, t, self._looked)
            over = t - self._looked >= 2.0 * self._design.seconds
            self._looked = np.where(over, np.inf, self._looked)
        self._before = now

    def stage(self, t: Floats) -> Any:
        """1 while rows look to their left, 2 while to their right, else 0."""
        gone = (t - self._looked) / self._design.seconds
        return np.where(np.isfinite(self._looked), 1 + (gone >= 1.0), 0)

    def _moved(self, t: Floats, command: JointCommand) -> JointCommand:
        """The command with the motion of the design."""
        design, stage = self._design, self.stage(t)
        if design.motion == "outwards":
            angle = 0.9 * design.swing * np.sin(2.0 * math.pi * (t - self._since) / design.seconds)
            return replace(command, antenna=command.antenna + np.nan_to_num(angle)[:, None])
        if not stage.any():
            return command
        gone = np.where(stage > 0, (t - np.where(stage > 0, self._looked, t)), 0.0)
        hump = np.sin(math.pi * (gone / design.seconds % 1.0)) ** 2 * (stage > 0)
        if design.motion == "look":
            each = np.stack([hump * (stage == 1), hump * (stage == 2)], axis=1)
            return replace(command, antenna=command.antenna + 0.9 * design.swing * each)
        yaw = command.yaw.copy()
        goal = np.where(stage == 1, -1.0, 1.0) * design.swing * self._limit
        yaw[:, :3] += hump[:, None] * (goal[:, None] - yaw[:, :3])
        return replace(command, yaw=yaw)

    def _keep(self, frame: AntennaFrame, command: JointCommand) -> None:
        yaws = command.yaw.shape[1]
        error = command.yaw - frame.positions[:, :yaws]
        legs = command.leg - frame.positions[:, yaws : yaws + command.leg[0].size].reshape(
            command.leg.shape
        )
        bases = frame.positions[:, yaws + command.leg[0].size :]
        means = np.concatenate(
            [
                *(frame.counts, bases, frame.positions[:, :yaws], error, legs.mean(axis=1)),
                frame.angular_velocity[:, 2:],
            ],
            axis=1,
        )
        stage, truth = self.stage(frame.t), self._truth
        for row in np.flatnonzero(np.isfinite(frame.t)).tolist():
            self._sums[row].append(means[row])
            if len(self._sums[row]) < EVERY:
                continue
            world = self._bodies.world(row)
            known = [float(getattr(truth, kind)[row]) for kind in KNOWN]
            sample = (
                *(self.numbers[row], frame.t[row], *np.mean(self._sums[row], axis=0)),
                *(self._before[row], stage[row], self._made.phase[row], *known, self._felt[row]),
                *(*world.head[:2], world.heading),
            )
            self.samples.append(np.array(sample, np.float32))
            self._sums[row] = []


def run_round(folder: Path, plan: str, name: str, number: int, each: int = EACH) -> str:
    """Run a round of episodes of a design, and write their rows and samples."""
    path = folder / f"{name}_{number}.npz"
    if path.exists():
        return f"{path.stem}: done before"
    known, seed = designs(), SEEDS[plan]
    design, block = known[name], [*known].index(name) + number * MOST_DESIGNS
    config = TunnelConfig(
        seed=seed, robot=design.robot, control=design.control, time_limit=LIMIT, knows=("jam",)
    )
    robots: list[SimRobot] = []
    made: list[Moved] = []
    numbers: dict[int, int] = {}

    def bodies(batch: int) -> Any:
        robots.append(SimRobot(batch, config.robot, config.control.period, config.physics.timestep))
        return Approached(), robots[-1]

    def make(_: str, control: Any, robot: Any, batch: int) -> Any:
        made.append(Moved(design, control, robot, batch, robots[-1]))
        made[-1].numbers = numbers
        return made[-1]

    def monitor(row: int, episode: Any) -> TrialMonitor:
        numbers[row] = episode.number
        return TrialMonitor(episode, name)

    rows: list[dict[str, Any]] = []
    trials = numbers_of(seed, each, block)
    run_trials(
        *(config, "geometric", trials, lambda found: rows.append(asdict(found[0]))),
        batch=len(trials),
        apparatus=Apparatus(make, bodies, monitor),
    )
    folder.mkdir(parents=True, exist_ok=True)
    short = path.with_suffix(".part")
    with short.open("wb") as file:
        np.savez_compressed(
            file, samples=np.array(made[0].samples), rows=json.dumps(rows), plan=plan
        )
    short.rename(path)
    lost = sum(row["outcome"] == "invalid" for row in rows)
    return f"{path.stem}: {len(rows)} episodes, {lost} invalid"


def main(argv: list[str]) -> None:
    """Do what is asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=["designs", "trials"])
    parser.add_argument("folder", type=Path, nargs="?", help="of trials: where they go")
    parser.add_argument("--plan", choices=list(SEEDS), default="screening")
    parser.add_argument("--names", nargs="*", default=[], help="designs; all if none is named")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--each", type=int, default=EACH, help="episodes of a scene in a round")
    parser.add_argument("--workers", type=int, default=1)
    asked = parser.parse_args(argv)
    if asked.part == "designs":
        propose()
        return
    if asked.folder is None:
        parser.error("expected a folder for the trials")
    names = asked.names or list(designs())
    with ProcessPoolExecutor(asked.workers) as pool:
        tasks = [
            pool.submit(run_round, asked.folder, asked.plan, name, number, asked.each)
            for number in range(asked.rounds)
            for name in names
        ]
        for task in tasks:
            print(task.result(), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
