"""Make the film at the top of README: a robot without feedback and one with our controller.

Needs the extra `video`: `uv run --extra video docs/film.py`. It takes the first trial of the
default seed that `open` fails and `closed` passes.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from antennate.experiments.tunnel.config import TunnelConfig
from antennate.experiments.tunnel.film import record
from antennate.telemetry.film import RATE, Film, pictures, require_video

PLACE = Path(__file__).parent / "images" / "tunnel.webp"
SPEED = 3.0
EVERY = 2
"""Of the pictures every other one is shown."""
LIMIT = 40.0
"""Time after which a robot is taken for stuck [s]."""
WIDTH, HEIGHT = 430, 300
LARGEST = 3_000_000
"""Most bytes of the file."""


def main() -> None:
    """Find the trial, record both, and write the image."""
    require_video()
    films = next(filter(None, map(_telling, itertools.count())))
    end = max(film.t[-1] for film in films.values())
    shown = [pictures(_cut(film, name), WIDTH, HEIGHT) for name, film in films.items()]
    sides = [[Image.fromarray(picture) for picture in each] for each in shown]
    frames = [_beside(*pair) for pair in _together(*sides)]
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
    """Both films of a trial that only `closed` passes, None of another."""
    config = TunnelConfig(time_limit=LIMIT)
    films = {name: record(config, name, trial, name, SPEED) for name in ("open", "closed")}
    blind, touching = (film.title.split(": ")[1].split()[0] for film in films.values())
    print(f"trial {trial}: open {blind}, closed {touching}")
    return films if (blind, touching) == ("timeout", "success") else None


def _together(left: list[Image.Image], right: list[Image.Image]) -> Iterator[Sequence[Image.Image]]:
    """Pictures of both films; the last one of the shorter, with its ending, stays."""
    for i in range(max(len(left), len(right))):
        yield [each[min(i, len(each) - 1)] for each in (left, right)]


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


def _beside(left: Image.Image, right: Image.Image) -> Image.Image:
    both = Image.new("RGB", (left.width + right.width + 10, left.height), "white")
    both.paste(left, (0, 0))
    both.paste(right, (left.width + 10, 0))
    return both


if __name__ == "__main__":
    main()
