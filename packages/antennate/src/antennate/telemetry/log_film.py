"""Film of a log, drawn afterwards from what it tells of joints and coordinates."""

from __future__ import annotations

import math

from antennate.sim.world import World
from antennate.telemetry.film import MOST_PICTURES, Film, WalkRecorder
from antennate.telemetry.reader import LogReader
from antennate.telemetry.topics import COORDINATES
from antennate.telemetry.view.player import LogScene

_LONGEST = 0.1
"""Longest time between two ticks that is shown [s]: a twin that stands between two drives, and a
part of a log that is lost, are left out."""


def film_of(log: LogReader, arena: World | None, title: str) -> Film:
    """What a log shows, up to as many pictures as a film may have.

    Where the robot is on the floor is in logs of simulations alone; that of a robot stays in the
    middle.

    Args:
        log: The log; it is read.
        arena: The world in which it was simulated, None for a bare floor.
        title: What is shown, in a few words.
    """
    robot, threshold = log.header.robot, log.header.params.rule.threshold
    recorder, scene, placed = WalkRecorder(robot), LogScene(log.header, None), False
    t, before = 0.0, -math.inf
    for records, tick in log.groups():
        if tick is None:
            continue
        for record in records:
            if record.topic is COORDINATES:
                state = COORDINATES.decode(record.data)
                if not placed:  # what was drawn before has another world
                    scene, placed = LogScene(log.header, arena, len(state["position"])), True
                    recorder, t, before = WalkRecorder(robot), 0.0, -math.inf
                scene.take(tick.now, state["position"], state["robot"])
        t += min(max(0.0, tick.now - before), _LONGEST) if math.isfinite(before) else 0.0
        before = tick.now
        while recorder.due(t) and len(recorder) < MOST_PICTURES:
            if placed:
                scene.place(tick.now)
            else:
                scene.place_joints(tick)
            recorder.see(
                scene.world,
                t,
                counts=tick.reading,
                level=tick.level,
                contact=tick.contact,
                maneuver=tick.maneuver,
            )
        if len(recorder) >= MOST_PICTURES:
            break
    log.require_ticks()
    return recorder.decided(title, threshold)
