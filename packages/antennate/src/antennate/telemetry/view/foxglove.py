"""The topics of a log, live, for Foxglove and Lichtblick.

foxglove-sdk takes any Host and Origin and knows no token, so that any page that is open in a
browser of this computer can read along. Nothing can be sent back.
"""

from __future__ import annotations

from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from antennate.errors import BadInputError
from antennate.lookup import require_package
from antennate.sim import shapes
from antennate.sim.shapes import Shapes, picture
from antennate.telemetry.topics import TOPICS
from antennate.telemetry.view.channel import POSES, SCENE, SNAPSHOT, Poses
from antennate.telemetry.view.live import LiveTopics

_HOST = "127.0.0.1"
_IDLE = 0.1
_ARROW = (0.05, 0.003, 0.01, 0.008)
"""Length for 1 N [m], diameter of the shaft, length and diameter of the head [m]."""


def layout() -> Path:
    """The layout file that shows these topics, for `Import layout from file`."""
    return Path(str(files("antennate.telemetry.view").joinpath("foxglove-layout.json")))


class FoxgloveSink:
    """Serves the messages that a log would have, and the scene.

    Args:
        port: Port on this computer, 0 for any that is free.
    """

    def __init__(self, port: int) -> None:
        require_package("foxglove", "foxglove", package="foxglove-sdk")
        sdk = import_module("foxglove")
        self._messages: Any = import_module("foxglove.messages")
        self._context = context = sdk.Context()  # channels close with it
        try:
            self._server = sdk.start_server(
                name="antennate", host=_HOST, port=port, context=context
            )
        except (OSError, RuntimeError) as error:
            raise BadInputError(
                f"foxglove: expected port {port} of {_HOST} free, found: {error}; "
                "choose another with --foxglove-port, 0 takes any"
            ) from None
        self._channels = {
            topic: sdk.Channel(
                topic.name,
                message_encoding="cdr",
                schema=sdk.Schema(
                    name=topic.type.name, encoding="ros2msg", data=topic.type.schema.encode()
                ),
                context=context,
            )
            for topic in TOPICS
        }
        self._scene_channel = import_module("foxglove.channels").SceneUpdateChannel(
            "/scene", context=context
        )
        self._topics = LiveTopics()
        self._shapes: Shapes | None = None

    @property
    def address(self) -> str:
        """What to open as a Foxglove WebSocket."""
        return f"ws://{_HOST}:{self._server.port}"

    def draw(self, now: float) -> float:
        """Time until the next picture [s]; nothing waits to be drawn."""
        return _IDLE

    def end(self) -> None:
        """What was sent stays with who reads."""

    def take(self, kind: bytes, content: bytes) -> None:
        """Send a message on."""
        for topic, data in self._topics.messages(kind, content):
            self._channels[topic].log(data, log_time=self._topics.now)
        if kind == POSES and self._shapes is not None:
            self._scene(self._shapes, Poses.unpack(content))
        elif kind == SNAPSHOT and self._shapes is not None:
            if (now := picture(content, self._shapes)) is not None:
                self._scene(self._shapes, Poses(*now))
        elif kind == SCENE:
            self._shapes = Shapes.unpack(content)

    def _scene(self, what: Shapes, now: Poses) -> None:
        made = self._messages
        turned = Rotation.from_matrix(now.poses[:, 3:].reshape(-1, 3, 3))
        poses = [
            made.Pose(position=_vector(made, at), orientation=_quaternion(made, q))
            for at, q in zip(now.poses[:, :3].tolist(), turned.as_quat().tolist(), strict=True)
        ]
        colours = [made.Color(r=r, g=g, b=b, a=a) for r, g, b, a in (what.colour / 255).tolist()]
        entity: dict[str, list[Any]] = {"cubes": [], "spheres": [], "cylinders": []}
        for i, (kind, size) in enumerate(zip(what.kind.tolist(), what.size.tolist(), strict=True)):
            name, full = _primitive(kind, size)
            more = {"bottom_scale": 1.0, "top_scale": 1.0} if name == "cylinders" else {}
            make = getattr(made, _PRIMITIVES[name])
            shape = make(pose=poses[i], size=_vector(made, full), color=colours[i], **more)
            entity[name].append(shape)
        arrows = [_arrow(made, each) for each in now.forces if each[3:].any()]
        time = self._topics.now
        stamp = made.Timestamp(sec=time // 10**9, nsec=time % 10**9)
        self._scene_channel.log(
            made.SceneUpdate(
                entities=[
                    made.SceneEntity(
                        timestamp=stamp, frame_id="world", id="world", arrows=arrows, **entity
                    )
                ]
            ),
            log_time=time,
        )


_PRIMITIVES = {"cubes": "CubePrimitive", "spheres": "SpherePrimitive"}
_PRIMITIVES |= {"cylinders": "CylinderPrimitive"}


def _primitive(kind: int, size: list[float]) -> tuple[str, list[float]]:
    """The nearest primitive of a shape, and its whole size [m]; a capsule has flat ends."""
    if kind in (shapes.CAPSULE, shapes.CYLINDER):
        return "cylinders", [2 * size[0], 2 * size[0], 2 * size[1]]
    if kind == shapes.SPHERE:
        return "spheres", [2 * size[0]] * 3
    if kind == shapes.ELLIPSOID:
        return "spheres", [2 * each for each in size]
    return "cubes", [2 * each for each in size]


def _arrow(made: Any, force: Any) -> Any:
    """The arrow of a force, which has a direction only if it is not zero."""
    length = float(np.linalg.norm(force[3:]))
    turned = Rotation.align_vectors([force[3:] / length], [[1.0, 0.0, 0.0]])[0]
    pose = made.Pose(
        position=_vector(made, force[:3].tolist()),
        orientation=_quaternion(made, turned.as_quat().tolist()),
    )
    scale, shaft, head, wide = _ARROW
    return made.ArrowPrimitive(
        pose=pose,
        shaft_length=scale * length,
        shaft_diameter=shaft,
        head_length=head,
        head_diameter=wide,
        color=made.Color(r=0.84, g=0.37, b=0.0, a=1.0),
    )


def _vector(made: Any, values: list[float]) -> Any:
    x, y, z = values
    return made.Vector3(x=x, y=y, z=z)


def _quaternion(made: Any, values: list[float]) -> Any:
    x, y, z, w = values
    return made.Quaternion(x=x, y=y, z=z, w=w)
