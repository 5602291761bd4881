"""Topics of ROS 2 by DDS, without ROS: names, types and quality of service as its nodes have them.

Messages are bytes already: CDR, as a log holds them. So only what DDS says of a type is made here,
from the definition of its messages.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from antennate.errors import BadInputError
from antennate.messages import one_line

_LOCAL = """<CycloneDDS><Domain Id="any"><General><Interfaces>\
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General>\
<Discovery><ParticipantIndex>auto</ParticipantIndex>\
<MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>\
<Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
"""Configuration for this computer alone; nodes that look for others everywhere find it too."""
_KEPT = 100
"""Messages kept for a listener that falls behind: those of a second (assumed)."""
_TAKEN = 16
"""Most messages taken at once; of more the newest are left (assumed: twice what a peer sends)."""
_PRIMITIVES: dict[str, Any] = {
    "bool": bool,
    "string": str,
    **{
        name: getattr(types, name)
        for name in ("uint8", "int32", "uint32", "int64", "uint64", "float64")
    },
}
_PART = re.compile(r"^=+\nMSG: (\S+)\n", re.M)
_FIELD = re.compile(r"([\w/]+?)(\[(\d*)\])? +(\w+) *(?:#.*)?")


def message_type(name: str, schema: str) -> Any:
    """The type of DDS for messages of ROS 2.

    Args:
        name: Its name, such as `std_msgs/msg/String`.
        schema: Its definition, with those that it needs behind it.
    """
    own, *parts = _PART.split(schema)
    texts = dict(zip(parts[::2], parts[1::2], strict=True))
    made: dict[str, Any] = {}

    def kind_of(word: str) -> Any:
        if word in _PRIMITIVES:
            return _PRIMITIVES[word]
        if word not in made:
            made[word] = _struct(word, texts[word], kind_of)
        return made[word]

    return _of_bytes(_struct(name, own, kind_of))


def _of_bytes(kind: Any) -> Any:
    """The type, whose messages are now the bytes that they are sent as."""

    def deserialize(kind: Any, data: bytes, **how: Any) -> Any:
        return kind(data)

    kind.__init__ = lambda message, data: setattr(message, "data", data)
    kind.serialize = lambda message, **how: message.data
    kind.deserialize = classmethod(deserialize)
    return kind


def _struct(name: str, text: str, kind_of: Callable[[str], Any]) -> Any:
    package, *_, last = name.split("/")
    fields: dict[str, Any] = {}
    for line in filter(None, text.splitlines()):
        match = _FIELD.fullmatch(line)
        if match is None:
            raise BadInputError(f"ros: expected a field of a message, found {line!r}")
        word, many, number, field = match.groups("")
        kind = kind_of(word)
        many_of = types.array[kind, int(number)] if number else types.sequence[kind]
        fields[field] = many_of if many else kind
    return make_idl_struct(f"{last}_", f"{package}::msg::dds_::{last}_", fields)


class Topics:
    """Topics of one domain.

    Args:
        domain: Its number.
        network: Whether other computers may read along, as CYCLONEDDS_URI says, if it is set.

    Raises:
        BadInputError: The domain has no room.
    """

    def __init__(self, domain: int, network: bool = False) -> None:
        try:
            if not network:
                self._domain = Domain(domain, _LOCAL)
            self._participant = DomainParticipant(domain)
        except DDSException as error:
            raise BadInputError(
                f"ros: expected room in domain {domain}, found {one_line(str(error))}; "
                "choose another with --ros-domain"
            ) from None

    def writer(self, name: str, kind: str, schema: str, kept: bool = False) -> Writer:
        """What publishes a topic.

        Args:
            name: The topic, such as `/joint_states`.
            kind: The name of the type of its messages.
            schema: Their definition.
            kept: Whether a listener that comes later gets the newest message.
        """
        durability = Policy.Durability.TransientLocal if kept else Policy.Durability.Volatile
        history = Policy.History.KeepLast(1 if kept else _KEPT)
        qos = Qos(Policy.Reliability.Reliable(0), durability, history)  # a write never waits
        topic = Topic(self._participant, f"rt{name}", message_type(kind, schema))
        return Writer(DataWriter(self._participant, topic, qos))

    def reader(self, name: str, kind: str, schema: str) -> Callable[[], list[bytes]]:
        """What takes the messages of a topic that have come since the last call."""
        qos = Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(_TAKEN))
        topic = Topic(self._participant, f"rt{name}", message_type(kind, schema))
        reader: Any = DataReader(self._participant, topic, qos)
        return lambda: [each.data for each in reader.take(_TAKEN) if hasattr(each, "data")]


class Writer:
    """Publishes one topic; a listener that falls behind loses messages.

    Args:
        writer: That of DDS.
    """

    def __init__(self, writer: Any) -> None:
        self._writer = writer

    @property
    def heard(self) -> bool:
        """Whether anybody listens."""
        return bool(self._writer.get_matched_subscriptions())

    def write(self, data: bytes, time: int) -> None:
        """Publish a message of a time [ns]."""
        with suppress(DDSException):
            self._writer.write(self._writer.data_type(data), time)
