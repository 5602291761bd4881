"""The antenna on a robot of one's own: it bends, touches, mirrors and reads as ours does."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from antennate import AntennaReader, AntennaSpec, attach_antenna, equilibrium
from antennate.antenna.sensor import counts
from antennate.antenna.statics import Chain
from antennate.errors import ConfigError
from antennate.sim.parts import mounting_quaternion

POST = '<geom name="post" type="capsule" fromto="{x} {y} -0.1 {x} {y} 0.1" size="0.005"/>'
WORLD = """
<mujoco>
  <compiler angle="{angle}"/>
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    {post}
    <body name="head">
      <joint name="x" type="slide" axis="1 0 0"/>
      <geom name="head" size="0.02" mass="10"/>
    </body>
  </worldbody>
</mujoco>
"""


def spec(post: str = "", angle: str = "radian") -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(WORLD.format(post=post, angle=angle))


@pytest.mark.parametrize("hinges", [1, 4, 6, 10])
@pytest.mark.parametrize("angle", ["radian", "degree"])
def test_the_compiled_model_holds_the_declared_numbers(hinges: int, angle: str) -> None:
    antenna = AntennaSpec(active_coils=tuple(3.0 + i for i in range(hinges)))
    own = spec(angle=angle)
    assert attach_antenna(own, "head", antenna) == "antenna_left"
    model = own.compile()
    for i in range(hinges):
        joint = model.joint(f"antenna_left/hinge{i}")
        assert joint.stiffness[0] == antenna.hinge_stiffness()[i]
        assert joint.range == pytest.approx([-antenna.range, antenna.range])
    names = {model.sensor(i).name for i in range(model.nsensor)}
    assert names == {
        f"antenna_left/{kind}{i}" for kind in ("angle", "touch") for i in range(hinges)
    }
    length = antenna.length / hinges
    assert model.body(f"antenna_left/hinge{hinges - 1}").pos[0] == pytest.approx(
        length if hinges > 1 else 0.0
    )


def test_a_plain_post_is_touched_and_bends_the_antenna() -> None:
    """A geom with MuJoCo's default bits; the head drives past it and the tip drags along."""
    own, antenna = spec(POST.format(x=0.1, y=0.05)), AntennaSpec()
    name = attach_antenna(own, "head", antenna, angle=math.radians(45))
    model = own.compile()
    data, reader = mujoco.MjData(model), AntennaReader(model, [name], antenna, 0.01)
    straight = reader.read(data).counts
    force = np.zeros(antenna.hinges)
    for i in range(900):
        data.qpos[0], data.qvel[0] = 1e-4 * i, 0.1
        mujoco.mj_step(model, data)
        force = np.maximum(force, reader.touch(data)[0])
    assert reader.flex(data)[0] > 0.3  # towards the tail
    assert force.max() > 0.01
    assert reader.read(data).counts[0, 0] < straight[0, 0] - 50


def test_without_an_obstacle_nothing_is_touched() -> None:
    """Not the head that carries it, not itself, and not the other antenna, however it bends."""
    own, antenna = spec(), AntennaSpec()
    names = [
        attach_antenna(own, "head", antenna, side, (0.01, y, 0.0), angle=0.0)
        for side, y in (("left", 0.001), ("right", -0.001))
    ]
    model = own.compile()
    data, reader = mujoco.MjData(model), AntennaReader(model, names, antenna, 0.01)
    for k in range(20):
        for name in names:
            for i in range(antenna.hinges):
                data.joint(f"{name}/hinge{i}").qpos = -0.07 * k
        mujoco.mj_forward(model, data)
        assert data.ncon == 0
        assert reader.flex(data) == pytest.approx([-0.07 * k * antenna.sensed_hinges] * 2)


def test_the_right_antenna_is_the_mirror_image() -> None:
    own, antenna = spec(), AntennaSpec()
    for side in ("left", "right"):
        attach_antenna(own, "head", antenna, side, (0.02, 0.0, 0.0))
    model = own.compile()
    data = mujoco.MjData(model)
    for side in ("left", "right"):
        for i in range(antenna.hinges):
            data.joint(f"antenna_{side}/hinge{i}").qpos = 0.1 * i
    mujoco.mj_forward(model, data)
    tips = [data.body(f"antenna_{side}/hinge5").xpos.copy() for side in ("left", "right")]
    assert tips[0][1] > 0.01
    assert tips[1] == pytest.approx(tips[0] * [1, -1, 1], abs=1e-12)
    assert tips[0][0] < 0.02 + 0.1 * math.cos(antenna.base_angle)  # bent towards the tail


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_mounting_quaternion_turns_as_the_closed_form_says(side: str) -> None:
    """x points outwards by the angle; on the right, y points backwards-outwards mirrored."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, np.array(mounting_quaternion(0.5, side)))  # pyright: ignore[reportArgumentType]
    x, y, z = rotation.reshape(3, 3).T
    sign = 1 if side == "left" else -1
    assert x == pytest.approx([math.cos(0.5), sign * math.sin(0.5), 0], abs=1e-15)
    assert y == pytest.approx([-math.sin(0.5), sign * math.cos(0.5), 0], abs=1e-15)
    assert z == pytest.approx([0, 0, sign], abs=1e-15)


def test_a_force_bends_it_as_statics_says() -> None:
    own, antenna = spec(), AntennaSpec(active_coils=(3.0, 6.0, 9.0))
    name = attach_antenna(own, "head", antenna, angle=0.0)
    model = own.compile()
    data, reader = mujoco.MjData(model), AntennaReader(model, [name], antenna, 0.01)
    tip, force = np.array([0.12, 0.0, 0.0]), np.array([0.0, 0.02, 0.0])
    last = model.body(f"{name}/hinge2").id
    for _ in range(4000):
        data.qfrc_applied[:] = 0.0
        data.qpos[0] = data.qvel[0] = 0.0
        point = data.xpos[last] + data.xmat[last].reshape(3, 3) @ [0.04, 0.0, 0.0]
        mujoco.mj_applyFT(model, data, force, np.zeros(3), point, last, data.qfrc_applied)
        mujoco.mj_step(model, data)
    rest = equilibrium(Chain.of(antenna), tip[:1], force[None, :2])
    assert reader.angles(data)[0] == pytest.approx(rest.angles[0], rel=0.02)


def test_counts_follow_the_sensor() -> None:
    """Straight for long, the reading is the static one; with a seed there is repeatable noise."""
    own, antenna = spec(), AntennaSpec()
    name = attach_antenna(own, "head", antenna)
    model = own.compile()
    data = mujoco.MjData(model)
    quiet = AntennaReader(model, [name], antenna, 0.01)
    frame = quiet.read(data)
    assert frame.counts == counts(antenna.sensor, np.zeros((1, 1)))
    assert (frame.t.shape, frame.counts.shape) == ((1,), (1, 1))
    noisy = [AntennaReader(model, [name], antenna, 0.01, seed=s) for s in (1, 1, 2)]
    one, same, other = ([r.read(data).counts[0, 0] for _ in range(20)] for r in noisy)
    assert one == same != other
    assert np.std(one) > 0


def test_a_reader_forgets() -> None:
    own, antenna = spec(), AntennaSpec()
    name = attach_antenna(own, "head", antenna)
    model = own.compile()
    data, reader = mujoco.MjData(model), AntennaReader(model, [name], antenna, 0.01)
    fresh = reader.read(data).counts
    data.joint(f"{name}/hinge0").qpos = 1.2
    mujoco.mj_forward(model, data)
    for _ in range(100):
        reader.read(data)
    mujoco.mj_resetData(model, data)
    mujoco.mj_forward(model, data)
    assert reader.read(data).counts != fresh  # hysteresis and creep
    reader.reset()
    assert reader.read(data).counts == fresh


def test_what_cannot_be_attached_is_one_line() -> None:
    own, antenna = spec(), AntennaSpec()
    with pytest.raises(ConfigError, match=r"body: expected the name of a body, .*head, found neck"):
        attach_antenna(own, "neck", antenna)
    with pytest.raises(ConfigError, match="side: expected left or right, found up"):
        attach_antenna(own, "head", antenna, "up")  # pyright: ignore[reportArgumentType]
    for position in ((math.nan, 0, 0), (0, math.inf, 0), (0, 0)):
        with pytest.raises(ConfigError, match=r"position: expected 3 finite numbers \[m\], found"):
            attach_antenna(own, "head", antenna, position=position)
    with pytest.raises(ConfigError, match=r"angle: expected a finite number \[rad\], found nan"):
        attach_antenna(own, "head", antenna, angle=math.nan)
    name = attach_antenna(own, "head", antenna)
    with pytest.raises(ConfigError, match="expected one that is not taken, found antenna_left"):
        attach_antenna(own, "head", antenna)
    model = own.compile()
    for names, kind in ((["feeler"], antenna), ([name], AntennaSpec(active_coils=(3.0,) * 7))):
        with pytest.raises(ConfigError, match=r"names: expected antennae of . hinges") as error:
            AntennaReader(model, names, kind, 0.01)
        assert "\n" not in str(error.value)
    with pytest.raises(ConfigError, match="found one of 4 hinges for 6"):
        AntennaReader(model, [name], AntennaSpec(active_coils=(3.0, 6.0, 9.0, 9.0)), 0.01)
