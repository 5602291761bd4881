"""Make the film at the top of README: one tunnel without feedback, by the clock, and by touch.

Needs the extra `video`: `uv run --extra video docs/film.py`. It takes the first trial of the
default seed that `open` fails and `timed` and `closed` pass.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from antennate.experiments.tunnel.experiment import record
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.telemetry.film import RATE, Film, pictures, require_video

SHOWN = {"open": "timeout", "timed": "success", "closed": "success"}
"""Controllers, left to right, and how their trial ends."""
PLACE = Path(__file__).parent / "images" / "tunnel.webp"
SPEED = 3.0
EVERY = 2
"""Of the pictures every other one is shown."""
LIMIT = 40.0
"""Time after which a robot is taken for stuck [s]."""
WIDTH, HEIGHT = 400, 280
LARGEST = 3_000_000
"""Most bytes of the file."""


def main() -> None:
    """Find the trial, record it, and write the image."""
    require_video()
    films = next(filter(None, map(_telling, itertools.count())))
    end = max(film.t[-1] for film in films.values())
    shown = [pictures(_cut(film, name), WIDTH, HEIGHT) for name, film in films.items()]
    sides = [[Image.fromarray(picture) for picture in each] for each in shown]
    frames = [_beside(row) for row in _together(sides)]
    frames[0].save(
        PLACE,
        save_all=True,
        append_images=frames[1:],
        duration=round(1000 * EVERY / RATE),
        loop=0,
        quality=55,
        method=6,
    )
    size = PLACE.stat().st_size
    print(f"{PLACE}: {len(frames)} pictures, {size} bytes, {end:.1f} s at {SPEED:g}x")
    if size > LARGEST:
        raise SystemExit(f"{PLACE}: expected at most {LARGEST} bytes, found {size}")


def _telling(trial: int) -> dict[str, Film] | None:
    """The films of a trial that ends as it should, None of another."""
    config = TunnelConfig(time_limit=LIMIT)
    films = dict[str, Film]()
    for name, wanted in SHOWN.items():
        films[name] = record(config, name, trial, name, SPEED)
        ended = films[name].title.split(": ")[1].split()[0]
        print(f"trial {trial}: {name} {ended}")
        if ended != wanted:
            return None
    return films


def _together(sides: Sequence[Sequence[Image.Image]]) -> Iterator[list[Image.Image]]:
    """Pictures of all films; the last one of a shorter one, with its ending, stays."""
    for i in range(max(map(len, sides))):
        yield [each[min(i, len(each) - 1)] for each in sides]


def _cut(film: Film, name: str) -> Film:
    """Some pictures of a film, with the level alone."""
    shown = np.arange(0, len(film.t), EVERY)
    return dataclasses.replace(
        film,
        title=f"{name}, {SPEED:g}×",
        t=film.t[shown],
        positions=film.positions[shown],
        targets=film.targets[shown],
        traces=[dataclasses.replace(t, values=t.values[shown]) for t in film.traces[1:]],
        bands=[dataclasses.replace(b, states=b.states[shown]) for b in film.bands],
    )


def _beside(row: Sequence[Image.Image]) -> Image.Image:
    every = WIDTH + 10
    whole = Image.new("RGB", (every * len(row) - 10, row[0].height), "white")
    for place, picture in enumerate(row):
        whole.paste(picture, (every * place, 0))
    return whole


if __name__ == "__main__":
    main()
