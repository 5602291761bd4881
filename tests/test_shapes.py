"""What of a model is sent to be drawn: shapes, places, forces; and what a person can move."""

import mujoco
import numpy as np
import pytest

from antennate.errors import BadInputError
from antennate.sim.shapes import BOX, CAPSULE, MESH, SPHERE, Shapes, VisibleModel, picture, snapshot

SIDES = ((0.0, 0.0, 1.0, 1.0), (1.0, 0.5, 0.0, 1.0))
OURS, OBSTACLE, FLOOR = 8, 2, 1
MODEL = f"""
<mujoco>
  <option cone="elliptic"/>
  <asset>
    <mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>
    <material name="red" rgba="1 0 0 1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1" pos="0 0 .25" contype="{FLOOR}" conaffinity="0"/>
    <geom type="box" size=".1 .2 .3" pos="2 0 1" contype="{OBSTACLE}" material="red"/>
    <geom type="mesh" mesh="wedge" pos="0 3 1" contype="{OBSTACLE}"/>
    <geom type="sphere" size=".1" group="3"/>
    <geom type="sphere" size=".1" rgba="1 1 1 0"/>
    <body name="ball" pos="0 0 1">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <geom type="sphere" size=".1" mass="1" contype="{OBSTACLE}" conaffinity="{OURS}"/>
    </body>
    <body name="link" pos="0 0 1.19">
      <freejoint name="link"/>
      <geom type="capsule" size=".1 .3" euler="0 90 0" mass="1" contype="{OURS}"
            conaffinity="{OBSTACLE}"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def made() -> tuple[mujoco.MjModel, mujoco.MjData, VisibleModel]:
    """A link of a robot that lies on a ball which slides."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data, VisibleModel(model, SIDES)


Made = tuple[mujoco.MjModel, mujoco.MjData, VisibleModel]


def test_shapes_are_those_that_a_viewer_shows(made: Made) -> None:
    """Planes, collision shapes and what is transparent are left out; sizes are as in the file."""
    shapes = made[2].shapes()
    assert shapes.kind.tolist() == [BOX, MESH, SPHERE, CAPSULE]
    assert shapes.size[0] == pytest.approx([0.1, 0.2, 0.3])
    assert shapes.colour[0].tolist() == [255, 0, 0, 255]
    assert shapes.robot.tolist() == [False, False, False, True]
    assert shapes.moves.tolist() == [False, False, True, True]
    assert (shapes.body >= 0).tolist() == [False, False, True, False]
    assert shapes.floor[0] == 0.25
    assert len(shapes.vertices) == 4
    assert shapes.ends.tolist() == [[4, 4]]


def test_shapes_come_back_from_bytes(made: Made) -> None:
    """Every number of them; anything else is refused."""
    shapes = made[2].shapes()
    back = Shapes.unpack(shapes.pack())
    assert all(np.array_equal(one, other) for one, other in zip(shapes, back, strict=True))
    for content in (b"", b"x" * 100, shapes.pack()[:-50]):
        with pytest.raises(BadInputError):
            Shapes.unpack(content)


def test_a_force_is_that_of_the_engine_on_the_robot(made: Made) -> None:
    """Its size is the engine's normal force, and it pushes the link away from the ball: upwards.

    A snapshot is a copy: what the engine does afterwards does not change it.
    """
    model, data, visible = made
    mujoco.mj_step(model, data, 5)
    wrench = np.zeros(6)
    mujoco.mj_contactForce(model, data, 0, wrench)
    place, t = data.contact.pos[0].copy(), data.time
    assert data.ncon == 1
    content = snapshot(data)
    mujoco.mj_step(model, data, 50)
    found = picture(content, visible.shapes())
    assert found is not None
    time, _, forces = found
    assert (time, len(forces)) == (t, 1)
    assert wrench[0] > 0
    assert forces[0, 3:] == pytest.approx([0, 0, wrench[0]], rel=1e-5, abs=1e-5)
    assert forces[0, :3] == pytest.approx(place)


def test_nothing_pushes_where_nothing_touches(made: Made) -> None:
    """No contact at all, and contacts of the robot with the floor alone."""
    model, data, visible = made
    for height, contacts in ((3.0, 0), (0.34, 2)):
        model.geom("floor").conaffinity = OURS
        data.joint("link").qpos[:3] = [-2.0, 0.0, height]
        mujoco.mj_forward(model, data)
        assert data.ncon == contacts
        found = picture(snapshot(data), visible.shapes())
        assert found is not None
        assert len(found[2]) == 0


def test_poses_are_those_of_the_geoms(made: Made) -> None:
    """Place and rotation matrix, row by row; a snapshot says the same."""
    _, data, visible = made
    poses = visible.poses(data)
    assert poses.shape == (4, 12)
    assert poses[2, :3] == pytest.approx([0, 0, 1])
    assert poses[2, 3:] == pytest.approx(np.eye(3).ravel())
    found = picture(snapshot(data), visible.shapes())
    assert found is not None
    assert np.array_equal(poses, found[1])


def test_what_is_no_snapshot_is_refused(made: Made) -> None:
    """Too short, and cut; one of another model, whose shapes did not come, is left out."""
    _, data, visible = made
    for content in (b"", b"x" * 10, snapshot(data)[:-100]):
        with pytest.raises(BadInputError, match="expected a snapshot"):
            picture(content, visible.shapes())
    more = MODEL.replace("<worldbody>", '<worldbody><geom size="1"/>')
    for text in ("<mujoco><worldbody/></mujoco>", more):
        other = mujoco.MjData(mujoco.MjModel.from_xml_string(text))
        assert picture(snapshot(other), visible.shapes()) is None


def test_only_what_slides_can_be_moved(made: Made) -> None:
    """The ball goes where it is put and is at rest there; walls and the robot stay."""
    model, data, visible = made
    ball = int(visible.shapes().body[2])
    data.qvel[:2] = 1.0
    assert visible.move(data, ball, 0.7, -0.3)
    assert data.xpos[ball].tolist() == pytest.approx([0.7, -0.3, 1.0])
    assert data.qvel[:2].tolist() == [0.0, 0.0]
    before = data.qpos.copy()
    for body in (0, model.body("link").id, -1, 99):
        assert not visible.move(data, body, 1.0, 1.0)
    assert np.array_equal(data.qpos, before)
