"""The film of a log, drawn from what it tells of joints and coordinates."""

from __future__ import annotations

import math

from antennate.sim.camera import Shot
from antennate.sim.world import World
from antennate.telemetry import film
from antennate.telemetry.film import MOST_PICTURES, Film, FilmRecorder
from antennate.telemetry.header import Header
from antennate.telemetry.log_scene import LogScene
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import COORDINATES

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

    Raises:
        LogError: It has no ticks.
    """
    recorder, scene, placed = FilmRecorder(), LogScene(log.header, None), False
    t, before = 0.0, -math.inf
    for records, tick in log.groups():
        if tick is None:
            continue
        for record in records:
            if record.topic is COORDINATES:
                found = COORDINATES.decode(record.data)
                if not placed:  # what was drawn before has another world
                    scene, placed = LogScene(log.header, arena, len(found["position"])), True
                    recorder, t, before = FilmRecorder(), 0.0, -math.inf
                scene.take(tick.now, found["position"], found["robot"])
        t += min(max(0.0, tick.now - before), _LONGEST) if math.isfinite(before) else 0.0
        before = tick.now
        while recorder.due(t) and len(recorder) < MOST_PICTURES:
            if placed:
                scene.place(tick.now)
            else:
                scene.place_joints(tick)
            _keep(recorder, scene.world, tick, t)
        if len(recorder) >= MOST_PICTURES:
            break
    log.require_ticks()
    return _film(recorder, scene.world, log.header, title)


def _keep(recorder: FilmRecorder, world: World, tick: Tick, t: float) -> None:
    recorder.take(
        *(t, world.data.qpos, world.links().mean(axis=0)),
        counts=tick.reading,
        level=tick.level,
        contact=tick.contact,
        maneuver=tick.maneuver,
    )


def _film(recorder: FilmRecorder, world: World, header: Header, title: str) -> Film:
    maneuver = recorder.values("maneuver")
    known = bool((maneuver >= 0).any())  # a twin does not know it
    return recorder.film(
        title,
        world.model,
        Shot(2.8 * header.robot.length),
        [
            film.counts_trace(recorder.values("counts")),
            film.level_trace(recorder.values("level"), header.params.rule.threshold),
        ],
        [
            *([film.maneuver_band(maneuver)] if known else ()),
            *film.contact_bands(recorder.values("contact"), ("left", "right")),
        ],
    )
