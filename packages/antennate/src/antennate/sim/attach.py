"""Our antenna on anybody's robot: a part of one's own `MjSpec`, and its readings from `MjData`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from antennate import checks
from antennate.antenna.sensor import SensorChain, reading_noise
from antennate.errors import ConfigError
from antennate.messages import shown
from antennate.robots.antenna import AntennaSpec
from antennate.sim.engine import mujoco
from antennate.sim.parts import Side, build_antenna, mounting_quaternion
from antennate.types import AntennaFrame, Floats, Ints

_MOST_BITS = 2**31 - 1
"""MuJoCo keeps collision bits in a signed number of 32 bits."""
_TOUCH_MARGIN = 1.5
"""Radius of a touch sensor's volume over that of its link: contacts lie inside it."""

_PARTS = {
    "spring": mujoco.mjtDisableBit.mjDSBL_SPRING,
    "damper": mujoco.mjtDisableBit.mjDSBL_DAMPER,
    "constraint": mujoco.mjtDisableBit.mjDSBL_CONSTRAINT,
    "limit": mujoco.mjtDisableBit.mjDSBL_LIMIT,
    "actuation": mujoco.mjtDisableBit.mjDSBL_ACTUATION,
    "sensor": mujoco.mjtDisableBit.mjDSBL_SENSOR,
}
"""What an antenna is made of, by the attribute of `<flag>` that switches it off."""


def attach_antenna(
    spec: mujoco.MjSpec,
    body: str,
    antenna: AntennaSpec,
    side: Side = "left",
    position: Sequence[float] = (0.0, 0.0, 0.0),
    angle: float | None = None,
    name: str | None = None,
    contype: int = 0,
    conaffinity: int = 1,
) -> str:
    """Add one antenna with its base servo and its sensors to a body of your own model.

    The antenna bends in the x-y plane of the body, whose x is the heading and y the left. Positive
    hinge angles bend it towards the tail, on both sides. Everything it adds is named
    `NAME/…`: joints and actuator `base`, joints and geoms `hinge0`, … from base to tip, sensors
    `angle0`, … [rad] and `touch0`, … [N, sum of normal forces on that link].

    Args:
        spec: Your model; it is changed.
        body: Name of the body that carries the antenna. The two never collide with each other.
        antenna: The antenna.
        side: The right antenna is the mirror image of the left one.
        position: Of the antenna's base in the frame of the body [m], shape (3,).
        angle: From the heading outwards [rad]; None for the antenna's own mounting angle.
        name: First part of all names; None for `antenna_left` or `antenna_right`.
        contype: Collision bits of the links, as of `mjsGeom`. With the default pair they meet every
            geom whose `contype` has bit 1, MuJoCo's default, and never another antenna.
        conaffinity: The same.

    Returns:
        The name.

    Raises:
        ConfigError: There is no such body, the name is taken or is no text, the side is unknown,
            the position or the angle is not finite, collision bits are no whole numbers of 0 to
            2**31 - 1, the model sets the total mass or switches springs, dampers, limits, actuators
            or sensors off, or the model or the antenna is none. The model is left as it was.
    """
    checks.instance("spec", spec, mujoco.MjSpec)
    checks.instance("antenna", antenna, AntennaSpec)
    _require_whole(spec)
    outwards = antenna.base_angle if angle is None else checks.real("angle", angle, "rad")
    quaternion = mounting_quaternion(outwards, side)
    name = checks.text("name", f"antenna_{side}" if name is None else name)
    carrier = _carrier(spec, checks.text("body", body), name)
    place = checks.array("position", position, (3,), "m")
    contype = checks.whole("contype", contype, most=_MOST_BITS)
    conaffinity = checks.whole("conaffinity", conaffinity, most=_MOST_BITS)
    part = build_antenna(antenna, side=side)
    for geom in part.geoms:
        if geom.name:  # the links; the base is no obstacle to anything
            geom.contype, geom.conaffinity = contype, conaffinity
    add_sensors(part, antenna)
    frame = carrier.add_frame(pos=place, quat=quaternion)
    spec.attach(part, frame=frame, prefix=f"{name}/")
    for link in [b.name for b in spec.bodies if b.name.startswith(f"{name}/")]:
        spec.add_exclude(name=f"{link}-{body}", bodyname1=body, bodyname2=link)
    return name


def _require_whole(spec: mujoco.MjSpec) -> None:
    """Refuse a model in which an antenna would have another mass, or lack what it is made of."""
    if spec.compiler.settotalmass > 0:
        raise ConfigError(
            f"spec: expected a <compiler> without settotalmass, which scales the antenna too, "
            f"found {spec.compiler.settotalmass:g}"
        )
    off = [name for name, bit in _PARTS.items() if spec.option.disableflags & int(bit)]
    off += ["actuatorgroupdisable=0"] if spec.option.disableactuator & 1 else []
    if off:
        raise ConfigError(
            f"spec: expected an <option> with {', '.join(_PARTS)} enabled, of which the antenna is "
            f"made, found {', '.join(off)} disabled"
        )


def _carrier(spec: mujoco.MjSpec, body: str, name: str) -> mujoco.MjsBody:
    """The body of this name, if an antenna of that name can be added."""
    carrier = spec.body(body)
    if carrier is None:
        known = ", ".join(b.name for b in spec.bodies if b.name) or "none"
        raise ConfigError(f"body: expected the name of a body, {known}, found {body}")
    if spec.body(f"{name}/base") is not None:
        raise ConfigError(f"name: expected one that is not taken, found {name} twice")
    return carrier


def add_sensors(spec: mujoco.MjSpec, antenna: AntennaSpec, prefix: str = "") -> None:
    """Add a position and a touch sensor for each hinge of an antenna and its link.

    Args:
        spec: Where the antenna is; it is changed.
        antenna: The antenna.
        prefix: Before all names of the antenna, those of the sensors too.
    """
    for i, hinge in enumerate(antenna.hinge_names):
        link = spec.body(prefix + hinge)
        link.add_site(
            name=f"{prefix}touch{i}",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=[0, 0, 0, antenna.link_length, 0, 0],
            size=[_TOUCH_MARGIN * antenna.radius, 0, 0],
            group=4,  # not drawn by default
        )
        spec.add_sensor(
            name=f"{prefix}angle{i}",
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=prefix + hinge,
        )
        spec.add_sensor(
            name=f"{prefix}touch{i}",
            type=mujoco.mjtSensor.mjSENS_TOUCH,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=f"{prefix}touch{i}",
        )


class AntennaReader:
    """Reads attached antennae of one kind as their electronics would: in counts, with memory.

    Args:
        model: Your compiled model.
        names: Names that `attach_antenna` returned, left before right.
        antenna: What was attached, with its sensor.
        period: Time between two calls of `read` [s].
        seed: Seed of the sensor noise, None for none.

    Raises:
        ConfigError: The model has no such antenna, there are no names, the period is no finite
            number above 0, or the seed is no whole number of at least 0.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        names: Sequence[str],
        antenna: AntennaSpec,
        period: float,
        seed: int | None = None,
    ) -> None:
        checks.instance("model", model, mujoco.MjModel)
        checks.instance("antenna", antenna, AntennaSpec)
        checks.real("period", period, "s", above=0.0)
        if isinstance(names, str) or not isinstance(names, Sequence) or not names:
            raise ConfigError(f"names: expected a list of names, found {shown(names)}")
        for name in names:
            checks.text("names", name)
        self._angle = _sensor_addresses(model, names, "angle", antenna.hinges)
        self._touch = _sensor_addresses(model, names, "touch", antenna.hinges)
        _require_no_more(model, names, antenna.hinges)
        self._covered = antenna.sensed_hinges
        self._sensor = antenna.sensor
        self._chain = SensorChain(antenna.sensor, (1, len(names)), period)
        self._rng = None
        if seed is not None:
            self._rng = np.random.default_rng(checks.whole("seed", seed))

    def angles(self, data: mujoco.MjData) -> Floats:
        """Hinge angles [rad], base to tip, shape (antennae, hinges)."""
        return data.sensordata[self._angle]

    def touch(self, data: mujoco.MjData) -> Floats:
        """Normal force on each link [N], base to tip, shape (antennae, hinges)."""
        return data.sensordata[self._touch]

    def flex(self, data: mujoco.MjData) -> Floats:
        """Summed angle of the hinges under the flex sensor [rad], shape (antennae,)."""
        return self.angles(data)[:, : self._covered].sum(axis=1)

    def read(self, data: mujoco.MjData) -> AntennaFrame:
        """Sample all flex sensors once: counts of shape (1, antennae) at t [s] of shape (1,).

        Call it once every period: hysteresis, creep and noise go on with each call.
        """
        noise: Floats | float = 0.0
        if self._rng is not None:
            noise = reading_noise(self._sensor, self._rng, (1, len(self._angle)))
        counts = self._chain.step(self.flex(data)[None, :], noise)
        return AntennaFrame(t=np.array([data.time]), counts=counts)

    def reset(self) -> None:
        """Let the sensors forget what they felt, as after `mj_resetData`."""
        self._chain.reset(0)


def _sensor_addresses(model: mujoco.MjModel, names: Sequence[str], kind: str, count: int) -> Ints:
    """Index into `sensordata` of each sensor, shape (antennae, hinges)."""
    try:
        return np.array(
            [[model.sensor(f"{name}/{kind}{i}").adr[0] for i in range(count)] for name in names]
        )
    except KeyError as error:
        raise ConfigError(
            f"names: expected antennae of {count} hinges that attach_antenna added, found "
            f"{', '.join(names)}: {str(error.args[0]).splitlines()[0]}"
        ) from None


def _require_no_more(model: mujoco.MjModel, names: Sequence[str], count: int) -> None:
    """Check that no antenna has more hinges than these."""
    known = {model.sensor(i).name for i in range(model.nsensor)}
    for name in names:
        more = sum(f"{name}/angle{i}" in known for i in range(count, model.nsensor))
        if more:
            raise ConfigError(
                f"antenna: expected the AntennaSpec that was attached as {name}, found one of "
                f"{count} hinges for {count + more}"
            )
