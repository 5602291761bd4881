"""The text beside exported files: what they hold, and what the simulator does that they do not."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from antennate.params.base import meaning
from antennate.params.scene import VariationParams
from antennate.robots.spec import RobotSpec
from antennate.sim.export.urdf import BETWEEN_INERTIA, BETWEEN_MASS, LACKS
from antennate.sim.parts import (
    ANTENNA_BIT,
    BODY_BIT,
    FLOOR_BIT,
    GROUND_BIT,
    LEG_BIT,
    OBSTACLE_BIT,
)

_MJCF = """\
{title}

robot.xml  the robot alone, to attach to a world of your own
scene.xml  the robot in the scene {scene}, with the keyframe `start`
gait.csv   goals of all servos [rad] in each control period, and where the head is then [m]
walk.py    a short example, which drives scene.xml by gait.csv

Units: m, kg, s, rad, N, N·m. x ahead, y left, z up.

How exact it is
---------------
`python walk.py` needs the packages mujoco, 3.4 or newer, and numpy. When these files were
written, with {engine}, the head of scene.xml was {apart:.2g} m from that of the simulator at
most, over {ticks} control periods. 0 means: the same to the last bit. Another version of the
engine or another processor rounds otherwise, and contacts make that grow.
Arrays of the model that are not those of the simulator to the bit, and by how much:
{difference}

What the files hold
-------------------
Bodies    link0 is the head, behind it link1 and so on; leg_l0, leg_r0, ...; of antennae, if there
          are any, antenna_l_base, antenna_l_hinge0 and so on to the tip, antenna_r_... likewise
Joints    as their bodies; between links yaw1, ... and pitch1, ...; the free joint is root;
          yaw1_play, ... is the play behind the horn of a servo that has backlash
Servos    actuators with the names of their joints; ctrl is the goal [rad]. The torque is
          gain (ctrl - angle), limited to that at standstill, less the joint's damping times its
          speed: the line of torque and speed of the servo. One with a delay takes ctrl so much
          later, in mujoco 3.17 or newer; walk.py lets it hold its angle until then
Sensors   JOINT_angle [rad], JOINT_speed [rad/s], JOINT_torque [N·m] of each servo;
          antenna_l_angle0 [rad], ... of the hinges; antenna_l_touch0 [N], ... sum of the normal
          forces on a link; antenna_l_flex [rad], the sum of the hinges under the flex sensor;
          head_position, head_orientation, head_gyro, head_accelerometer at the site head
Numbers   numerics control_period [s], and gear_friction of each actuator where one has any
Solver    <option>; a world to which robot.xml is attached keeps its own, and MuJoCo warns of that
Contact   a geom touches another if the contype of one meets the conaffinity of the other;
          contype is {floor} of floors that legs alone touch, {ground} of ground that body and
          antennae touch too, {obstacle} of obstacles, {leg} of legs, {body} of the body,
          {antenna} of antennae. A floor of your own takes contype {floor} or {ground} and
          conaffinity 0, a wall of your own contype {obstacle} and conaffinity {wall}

What the simulator does beside them
-----------------------------------
Friction of gears that grows with the load, as a share of the motor's torque. walk.py does it:
{gears}
Limits of goals, and how fast goals move. ctrlrange holds the first; the engine does not enforce it:
{goals}
Chance of a trial; there is none of it in gait.csv. An error of a joint's zero is added to its goal:
{chance}
From antenna_l_flex to the counts of a board: hysteresis, creep, divider, converter and noise of the
flex sensor. In Python that is antennate.antenna.sensor.SensorChain. It takes antenna_r_flex times
{gain:g}, what the right sensor feels over the left one.
Servos without torque, or with other gains and limits: the twin alone sets them.
"""
_URDF = """\
{title}

robot.urdf  links, joints, limits, masses, inertias and shapes; all links weigh {mass:g} kg

Units: m, kg, s, rad, N·m. x ahead, y left, z up.

Names are those of MJCF (antennate robot --export mjcf). The frame of a link lies on its joint.
effort     torque of the servo at standstill; 0 of the sprung hinges of antennae, which have none
velocity   fastest that a goal moves; of a hinge 1000 rad/s, which it does not reach
dynamics   damping and friction of the joint with its servo
{pitch}
A capsule is a cylinder and two spheres. A leg is a cylinder, without its crown.

URDF cannot hold
----------------
{lacks}
"""


def mjcf_readme(
    title: str,
    engine: str,
    scene: str,
    robot: RobotSpec,
    shares: Mapping[str, float],
    difference: Mapping[str, float],
    ticks: int,
    apart: float,
) -> str:
    """The text beside MJCF.

    Args:
        title: Its first line.
        engine: Name and version of the engine.
        scene: Name of the scene.
        robot: The robot.
        shares: Friction of gears as a share of the motor's torque, by joint, without zeros.
        difference: Arrays in which the model of the file differs, as `Mjcf` has it.
        ticks: Length of the walk in control periods.
        apart: Largest distance of the head from that of the simulator on the walk [m].
    """
    goals = zip(robot.joint_names, robot.limits, robot.fastest, strict=True)
    fields = VariationParams.model_fields.items()
    return _MJCF.format(
        title=title,
        engine=engine,
        scene=scene,
        ticks=ticks,
        apart=apart,
        difference=_lines(f"{name}: {value:.2g}" for name, value in difference.items()),
        gears=_lines(f"{name}: {share:g}" for name, share in shares.items()),
        goals=_lines(f"{name}: {_limit(angle)}, {speed:g} rad/s" for name, angle, speed in goals),
        chance=_lines(f"{n} = {f.default}: {meaning(VariationParams, n)}" for n, f in fields),
        gain=robot.antennae.right_gain,
        floor=FLOOR_BIT,
        ground=FLOOR_BIT | GROUND_BIT,
        obstacle=OBSTACLE_BIT,
        leg=LEG_BIT,
        body=BODY_BIT,
        antenna=ANTENNA_BIT,
        wall=FLOOR_BIT | OBSTACLE_BIT,
    )


def urdf_readme(title: str, robot: RobotSpec) -> str:
    """The text beside URDF."""
    pitch = "A locked pitch joint is left out: the link is rigid about pitch."
    if robot.pitch_count:
        pitch = (
            f"Between yaw and pitch stands a link of {BETWEEN_MASS:g} kg and {BETWEEN_INERTIA:g} "
            "kg·m², as readers want some.\nThe simulated robot has none there: the link behind it "
            "has so much less, so all of it\nweighs the same."
        )
    return _URDF.format(title=title, mass=robot.mass, pitch=pitch, lacks=_lines(LACKS))


def _lines(words: Iterable[str]) -> str:
    return "\n".join(f"  {word}" for word in words) or "  none"


def _limit(angle: float) -> str:
    return f"{angle:.4g} rad either way" if math.isfinite(angle) else "no limit"
