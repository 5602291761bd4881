"""Write docs/topics.md from antennate.telemetry.topics."""

from collections.abc import Iterator

from generated import finish, heads, row

from antennate.telemetry.topics import HEADER_TOPICS, TICK_TOPICS, TOPICS, Topic

PAGE = """\
# Log topics

What the messages of a [log](log.md) hold. A topic written every tick has one message for each tick
of the control loop, with the number of the tick as sequence number. The time of a message is that
of the loop: counted from Unix time on a robot, and from 0 in a simulation. The definitions stand in
each file, too. Floats come back bit by bit, NaN as well.

{index}

{sections}
"""


def how_often(topic: Topic) -> str:
    """When messages of a topic are written."""
    if topic in HEADER_TOPICS:
        return "once, first"
    return "every tick" if topic in TICK_TOPICS else "where there is something to say"


def fields(definition: str) -> Iterator[tuple[str, str, str]]:
    """Type, name and meaning of each field; of a nested definition the outermost ones."""
    for line in definition.split("=" * 80)[0].splitlines():
        field, _, meaning = line.partition("#")
        kind, name = field.split()
        yield kind, name, meaning.strip()


def section(topic: Topic) -> str:
    """The part of one topic."""
    rows = (row(f"`{n}`", f"`{k}`", m) for k, n, m in fields(topic.type.schema))
    head = f"## `{topic.name}`\n\n{topic.meaning[0].upper()}{topic.meaning[1:]}."
    name = topic.type.name.replace("/msg/", "/")
    table = "\n".join([heads("field", "type", "meaning"), *rows])
    return f"{head} Type `{name}`, {how_often(topic)}.\n\n{table}"


def main() -> None:
    """Write the page."""
    rows = [row(f"[`{t.name}`](#{t.name.strip('/')})", how_often(t), t.meaning) for t in TOPICS]
    index = "\n".join([heads("topic", "written", "what"), *rows])
    sections = "\n\n".join(map(section, TOPICS))
    finish(__file__, PAGE.format(index=index, sections=sections))


if __name__ == "__main__":
    main()
