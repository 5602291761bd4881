"""The live sink for Foxglove and Lichtblick: our topics with our definitions, and their layout."""

import contextlib
import json
import re
import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest
from view_rig import shown
from websockets.sync.client import ClientConnection, connect

from antennate.sim.shapes import VisibleModel
from antennate.telemetry.topics import ANTENNA, TICK_TOPICS, TOPICS
from antennate.telemetry.view.channel import POSES, SCENE, Poses
from antennate.telemetry.view.foxglove import FoxgloveSink, layout

PATIENCE = 60.0
HEAD = struct.Struct("<BIQ")
"""Begin of a message: kind 1, subscription and time, as the Foxglove WebSocket protocol has it."""


def advertised(connection: ClientConnection) -> dict[str, dict[str, str]]:
    """The channels that a server offers, by topic."""
    while True:
        message = json.loads(connection.recv(PATIENCE))
        if message["op"] == "advertise":
            return {channel["topic"]: channel for channel in message["channels"]}


@pytest.mark.ci
def test_a_running_simulation_can_be_read_live(tmp_path: Path) -> None:
    """Another program gets the topics of a log, in the same form, while the trial runs."""
    words = "tunnel --controllers open --trials 1 --scene flat --time-limit 3600 --foxglove"
    with shown(*words.split(), "--foxglove-port", "0", folder=tmp_path) as view:
        address = re.search(r"ws://\S+?(?=,)", view.said("foxglove: "))
        assert address is not None
        assert address[0].startswith("ws://127.0.0.1:")
        how = {"subprotocols": ["foxglove.sdk.v1"], "proxy": None}
        with connect(address[0], **how) as connection:  # type: ignore[arg-type]
            found = advertised(connection)
            assert set(found) >= {topic.name for topic in TOPICS} | {"/scene"}
            for topic in TICK_TOPICS:
                channel = found[topic.name]
                assert (channel["schemaName"], channel["encoding"]) == (topic.type.name, "cdr")
                assert channel["schema"] == topic.type.schema
            ask = {"id": 1, "channelId": found[ANTENNA.name]["id"]}
            connection.send(json.dumps({"op": "subscribe", "subscriptions": [ask]}))
            times = list[float]()
            while len(times) < 3:
                data = connection.recv(PATIENCE)
                if isinstance(data, bytes) and HEAD.unpack_from(data)[:2] == (1, 1):
                    times.append(ANTENNA.type.decode(data[HEAD.size :])["t"])
            assert times == sorted(times)
            assert times[0] < times[-1]


def test_a_force_of_zero_has_no_arrow() -> None:
    """It has no direction. The scene is that without it; that of another force is longer."""
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
    )
    shapes = VisibleModel(model, ((0, 0, 1, 1), (1, 0, 0, 1))).shapes()
    sink = FoxgloveSink(0)
    sink.take(SCENE, shapes.pack())
    poses = np.array([[0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]], np.float32)
    with connect(sink.address, subprotocols=["foxglove.sdk.v1"], proxy=None) as connection:  # type: ignore[list-item]
        ask = {"id": 1, "channelId": advertised(connection)["/scene"]["id"]}
        connection.send(json.dumps({"op": "subscribe", "subscriptions": [ask]}))

        def scene(forces: list[list[float]]) -> bytes:
            made = Poses(0.0, poses, np.array(forces, np.float32).reshape(-1, 6))
            while True:
                sink.take(POSES, made.pack())
                with contextlib.suppress(TimeoutError):  # it was not subscribed yet
                    while not isinstance(data := connection.recv(1.0), bytes):
                        pass
                    return data

        bare = scene([])
        assert scene([[1, 2, 3, 0, 0, 0]]) == bare
        assert len(scene([[1, 2, 3, 0, 0, 0], [1, 2, 3, 0, 4, 0]])) > len(bare)


def test_the_layout_shows_what_there_is() -> None:
    """Each topic and each field that a panel names is one of ours."""
    table = json.loads(layout().read_text())
    fields = {topic.name: {field.name for field in topic.type.fields} for topic in TOPICS}
    panels = table["configById"]
    for panel in panels.values():
        for path in panel.get("paths", []):
            topic, name = re.fullmatch(r"(/\w+)\.(\w+)(?:\[[01]\])?", path["value"]).groups()  # type: ignore[union-attr]
            assert name in fields[topic]
        for key in ("topicPath", "topicToRender"):
            assert panel.get(key, "/events") in fields

    def placed(node: dict[str, dict[str, str]] | str) -> set[str]:
        if isinstance(node, str):
            return {node}
        return placed(node["first"]) | placed(node["second"])

    assert placed(table["layout"]) == set(panels)
