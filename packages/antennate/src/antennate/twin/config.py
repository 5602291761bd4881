"""What `antennate twin` serves: the simulated robot in a trial, and how far it has come."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

from pydantic import model_validator

from antennate.errors import ConfigError
from antennate.params.base import Params, number, paths_of
from antennate.params.gaits import GaitParams, LiftParams
from antennate.params.hardware import BatteryParams
from antennate.robots.spec import RobotSpec
from antennate.sim.episode import Episode
from antennate.sim.scenes.scene import SceneInstance
from antennate.sim.sim_robot import SimRobot
from antennate.sim.trial import TrialConfig, draw_trial, require_room, scene_of
from antennate.sim.world import World
from antennate.twin.board import TouchStimulus
from antennate.twin.robot import TwinRobot
from antennate.twin.servos import factory_new


class TwinControlParams(Params):
    """What the twin needs of the control: it has no controller of its own."""

    rate: float = number(100.0, "Hz", "paper: about 100 Hz over serial", gt=0, le=1000)
    """Samples per second."""
    gait: GaitParams = GaitParams()

    @property
    def period(self) -> float:
        """Time between samples [s]."""
        return 1.0 / self.rate


class TwinConfig(TrialConfig):
    """The robot that `antennate twin` serves, and the trial at whose start it stands."""

    unread: ClassVar[tuple[str, ...]] = (
        *(
            f"control.gait.{name}"
            for name in (
                "frequency",
                "turn_offset",
                "offset_rate",
                "antenna_amplitude",
                "antenna_frequency",
            )
        ),
        *paths_of(LiftParams, "control.gait.lift"),
        "robot.antenna.sensor.rate",
    )
    trial: int = number(0, "1", "assumed: the first", ge=0)
    """Trial of the seed."""
    duration: float | None = number(None, "s", "assumed: until it is stopped", gt=0)
    """Time to serve."""
    fault: tuple[str, ...] = number((), "1", "assumed: nothing is broken")
    """Faults, such as servo:7=silent@3s."""
    touch: tuple[str, ...] = number((), "1", "assumed: no touch unless wanted")
    """Touches of the standing robot: left@2s or left:20mm@2s, from the beginning of each client."""
    push: tuple[str, ...] = number((), "1", "assumed: no touch unless wanted")
    """Joints without torque that are turned, such as yaw1=20deg@3s, from the first packet on."""
    mains: float = number(
        50.02, "Hz", "assumed: mains of 50 Hz wander by some hundredths", gt=0, le=1000
    )
    """Frequency of the hum on the readings, a fault."""
    factory: bool = number(False, "1", "assumed: they are set up")
    """Servos as delivered: all id 1 at 57600 bit/s."""
    plugged: tuple[str, ...] = number((), "1", "assumed: all")
    """Joints whose servos are on the bus at first, or `none`."""
    battery: BatteryParams = BatteryParams()
    robot: RobotSpec = RobotSpec()
    control: TwinControlParams = TwinControlParams()

    @model_validator(mode="before")
    @classmethod
    def _bench_on_a_flat_floor(cls, values: Any) -> Any:
        """Where nothing else is wished, a robot that does not walk stands on a flat floor."""
        if isinstance(values, dict):
            robot = values.get("robot")
            robot = robot.model_dump() if isinstance(robot, RobotSpec) else robot
            if isinstance(robot, dict) and (robot.get("legs") or {}).get("kind") == "none":
                return {"scene": "flat"} | values
        return values


class Passage:
    """Follows the head through a scene.

    Args:
        scene: Where the robot walks.

    Attributes:
        passed: Time of walking at which the head passed the exit [s], inf before.
        on_pass: Called when it does.
        on_tick: Called with the world after every tick.
    """

    def __init__(self, scene: SceneInstance) -> None:
        self._scene = scene
        self.on_pass: Callable[[], None] = lambda: None
        self.on_tick: Callable[[World], None] = lambda world: None
        self.reset()

    def reset(self) -> None:
        """The robot stands at the start again."""
        self._walk = Episode(self._scene, math.inf)
        self.passed = math.inf

    @property
    def progress(self) -> float:
        """How far the head has come [m]."""
        return self._walk.progress

    def watch(self, world: World) -> None:
        """Look at the world after a tick."""
        self.on_tick(world)
        self._walk.tick(world, look=self._look)
        if self._walk.error is not None:
            raise self._walk.error

    def _look(self, world: World) -> None:
        head = world.head[:2]
        self._walk.progress_of(head)
        if self.passed == math.inf and self._walk.judge.look(head) == "success":
            self.passed = world.t
            self.on_pass()

    @property
    def summary(self) -> str:
        """When the head passed the exit, or how far it came, in one sentence."""
        length = self._scene.length
        if self.passed < math.inf:
            return f"the head passed the exit after {self.passed:.1f} s of walking"
        return f"the head came {min(self.progress, length):.2f} m of {length:.2f} m"


def watched(config: TwinConfig, boot_id: int | None = None) -> tuple[TwinRobot, Passage]:
    """The robot at the start of its trial, and how far it comes.

    Each start of a real board has a boot id of its own.
    """
    if not config.robot.antenna_count:
        raise ConfigError(
            "expected a robot with antennae for the twin, found one without (antennae.kind)"
        )
    control, period = config.control, config.control.period
    scene = scene_of(config)
    start = draw_trial(config, scene, config.trial, control.gait, period)
    require_room(start.world)
    body = SimRobot(1, config.robot, period, config.physics.timestep)
    body.load(0, start.world, start.chance)
    boot = config.trial + 1 if boot_id is None else boot_id
    own = config.robot
    gain, count = own.antennae.right_gain, own.antenna_count
    touch = TouchStimulus(config.touch, own.antenna, own.right_antenna, gain, count)
    passage = Passage(start.scene)
    robot = TwinRobot(
        body,
        config.robot,
        period,
        boot,
        standing_noise=True,
        touch=touch,
        watch=passage.watch,
        battery=config.battery,
        servos=factory_new(config.robot) if config.factory else None,
        pushes=config.push,
        mains=config.mains,
    )
    robot.on_return = passage.reset
    robot.plugging.begin(config.plugged)
    return robot, passage
