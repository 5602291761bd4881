"""Films: a trial that was recorded while it ran, drawn picture by picture and written as mp4.

Recording costs a copy of the coordinates for each picture. Everything else is done afterwards.
"""

from __future__ import annotations

import importlib
import io
import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from antennate.errors import BadInputError, MissingPackageError
from antennate.figures import MANEUVER_COLOURS, MANEUVER_NAMES, SERIES, rgba
from antennate.messages import extra
from antennate.robots.spec import RobotSpec
from antennate.sim import engine_setup
from antennate.sim.camera import Camera, Picture, Shot
from antennate.sim.world import World
from antennate.telemetry import FilmView
from antennate.telemetry.strip import Band, Strip, Trace, with_word
from antennate.types import Contact, Floats, Ints, Maneuver

RATE = 25
"""Pictures a second."""
MOST_PICTURES = 10 * 60 * RATE
"""Pictures of a film whose length nobody sets: ten minutes, 100 MB of coordinates (assumed)."""
WIDTH, HEIGHT, STRIP = 880, 496, 150
"""Size of the picture, and height of the strip below it [pixels]."""
PICTURE_SIZE = 4000.0
"""Room that a picture of a film takes on disk [byte]: measured 2.8 kB for a trial in the tunnel."""
_QUALITY = 25
"""Constant rate factor of x264: 18 is said to be lossless to the eye, 28 is poor."""
_ENCODERS = ("libx264", "libopenh264")
_ROUNDING = 1e-9
_CONTACTS = {
    int(Contact.FREE): ("free", "#DDDDDD"),
    int(Contact.CONTACT): ("contact", "#222222"),
    int(Contact.UNKNOWN): ("unknown", "#CC79A7"),
}
_LENGTHS = 2.8
"""Distance of the camera over the length of the robot."""
_NEARER = 0.55
"""Distance from the side over that from above: its height needs no room in the picture."""
_LOW = 14.0
"""Elevation of the camera at the side [deg]: above the next step, 0.2 m higher, yet low."""
_MANEUVERS = {int(m): (MANEUVER_NAMES[m], MANEUVER_COLOURS[m]) for m in Maneuver}


@dataclass(frozen=True, slots=True)
class Film:
    """A recorded trial.

    Attributes:
        title: What it shows, in a few words.
        model: The compiled model.
        shot: From where the camera looks.
        t: Times of the pictures [s], shape (n,).
        positions: Coordinates of the model, shape (n, nq).
        targets: What is in the middle [m], shape (n, 3).
        traces, bands: What the strip shows, with n entries each.
        ending: A word on the outcome, shown at the end for a second; empty for none.
    """

    title: str
    model: Any
    shot: Shot
    t: Floats
    positions: Floats
    targets: Floats
    traces: Sequence[Trace]
    bands: Sequence[Band]
    ending: str = ""

    def seen_from(self, view: FilmView) -> Film:
        """The film of a walk, seen from this side."""
        if view == "above":
            return self
        near = replace(self.shot, distance=_NEARER * self.shot.distance, elevation=_LOW)
        return replace(self, shot=near)

    @property
    def held(self) -> int:
        """Pictures of its ending."""
        return RATE if self.ending else 0


class FilmRecorder:
    """Keeps what a film needs at the times of its pictures.

    Args:
        speed: How many times faster than real time the film is.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._step = speed / RATE
        self._kept: list[tuple[float, Floats, Floats]] = []
        self._values: dict[str, list[Any]] = {}

    def take(self, t: float, position: Floats, target: Sequence[float], **values: Any) -> None:
        """Offer a moment [s]; it is copied if it is time for a picture.

        Args:
            t: Time since the trial began [s].
            position: Coordinates of the model, shape (nq,).
            target: Where to look [m], 2 or 3 numbers.
            values: Whatever else is to be shown, numbers or arrays.
        """
        if not self.due(t):
            return
        where = np.array([*target, 0.0][:3], dtype=float)
        self._kept.append((t, np.array(position), where))
        for name, value in values.items():
            self._values.setdefault(name, []).append(np.array(value))

    def due(self, t: float) -> bool:
        """Whether it is time for a picture."""
        return t + _ROUNDING >= len(self._kept) * self._step

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self._kept)

    @property
    def t(self) -> Floats:
        """Times of the pictures [s], shape (n,)."""
        return np.array([t for t, _, _ in self._kept])

    def values(self, name: str) -> Any:
        """What was kept under a name, shape (n, ...)."""
        return np.array(self._values[name])

    def film(
        self,
        title: str,
        model: Any,
        shot: Shot,
        traces: Sequence[Trace],
        bands: Sequence[Band],
        ending: str = "",
    ) -> Film:
        """The film of what was kept; the camera follows gently."""
        if not self._kept:
            raise _nothing(title)
        targets = _smooth(np.array([where for *_, where in self._kept]), RATE)
        positions = np.array([position for _, position, _ in self._kept])
        return Film(title, model, shot, self.t, positions, targets, traces, bands, ending)


class WalkRecorder(FilmRecorder):
    """Keeps what a film of a walking robot needs.

    Args:
        robot: The robot.
        speed: How many times faster than real time the film is.
    """

    def __init__(self, robot: RobotSpec, speed: float = 1.0) -> None:
        super().__init__(speed)
        self._shot, self._model = Shot(_LENGTHS * robot.length), None

    def see(self, world: World, t: float, **values: Any) -> None:
        """Offer a moment [s] with `counts` and whatever else is to be shown; see `take`."""
        self._model = world.model
        self.take(t, world.data.qpos, world.link_places().mean(axis=0), **values)

    def walk(
        self, title: str, traces: Sequence[Trace], bands: Sequence[Band], ending: str = ""
    ) -> Film:
        """The film: readings before the other traces."""
        counts = counts_trace(self.values("counts"))
        return self.film(title, self._model, self._shot, [counts, *traces], bands, ending)

    def decided(self, title: str, threshold: float | None, ending: str = "") -> Film:
        """The film of a walk with `level`, `contact` and `maneuver`, -1 where it is not known."""
        if not len(self):
            raise _nothing(title)
        maneuver = self.values("maneuver")
        decides = bool((maneuver >= 0).any())
        return self.walk(
            title,
            [level_trace(self.values("level"), threshold)],
            [
                *([maneuver_band(maneuver)] if decides else ()),
                *contact_bands(self.values("contact"), ("left", "right")),
            ],
            ending,
        )


def _nothing(title: str) -> BadInputError:
    """What is raised where there is nothing to see."""
    return BadInputError(f"video: {title}: expected a trial that begins, found no tick")


def _smooth(path: Floats, half: int) -> Floats:
    """The mean over `half` entries to either side, of a path of shape (n, 3)."""
    padded = np.concatenate([path[:1].repeat(half, 0), path, path[-1:].repeat(half, 0)])
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(padded, axis=0)])
    return (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)


def trace(label: str, values: Floats, form: str = ".2f") -> Trace:
    """A chart of shape (n, lines) whose axis is as wide as its values."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    margin = 0.05 * (high - low) or 1.0
    return Trace(label, values, low - margin, high + margin, form)


def counts_trace(counts: Floats) -> Trace:
    """Readings of the antennae, shape (n, sides)."""
    return trace("reading [counts]", counts, ".0f")


def level_trace(level: Floats, threshold: float | None) -> Trace:
    """Bending levels of shape (n, sides), and theta."""
    mark = "" if threshold is None else f"θ = {threshold:g}"
    return Trace("level b", level, 0.0, 1.0, ".2f", threshold, mark)


def contact_bands(contact: Ints, names: Sequence[str]) -> list[Band]:
    """A band for each column of `Contact`, shape (n, bands)."""
    return [Band(name, contact[:, k], _CONTACTS) for k, name in enumerate(names)]


def maneuver_band(maneuver: Ints) -> Band:
    """`Maneuver`, shape (n,)."""
    return Band("maneuver", maneuver, _MANEUVERS)


def require_video() -> None:
    """Find out whether films can be made here, before anything is run."""
    _encoder()
    engine_setup.backend()


def _encoder() -> str:
    try:
        av = importlib.import_module("av")
    except ImportError:
        raise MissingPackageError(
            f"video: expected the package PyAV, found none; install it with {extra('video')}"
        ) from None
    encoders = [name for name in _ENCODERS if name in av.codecs_available]
    if not encoders:
        raise BadInputError(
            f"video: expected PyAV with an encoder for H.264 ({', '.join(_ENCODERS)}), found none; "
            "install PyAV from its wheel with `pip install --force-reinstall av`"
        )
    return encoders[0]


def pictures(film: Film, width: int = WIDTH, height: int = HEIGHT) -> Iterator[Picture]:
    """Every picture of a film with its strip, shape (height + STRIP, width, 3), then its ending."""
    strip = Strip(film.title, film.t, film.traces, film.bands, width, STRIP)
    sides = (rgba(SERIES[0]), rgba(SERIES[1]))
    last: tuple[Picture, Picture] | None = None
    with Camera(film.model, film.shot, (width, height), sides) as camera:
        for i, (position, target) in enumerate(zip(film.positions, film.targets, strict=True)):
            last = camera.picture(position, target), np.asarray(strip.picture(i))
            yield np.concatenate(last)
    if film.ending and last:
        view, below = last
        ending = np.concatenate([with_word(view, film.ending), below])
        yield from itertools.repeat(ending, film.held)


def encoded(film: Film, on_step: Callable[[int, int], None] = lambda done, total: None) -> bytes:
    """The film as mp4, H.264.

    Args:
        film: What to draw.
        on_step: Called with how many of how many pictures are drawn.
    """
    name, av = _encoder(), importlib.import_module("av")
    file = io.BytesIO()
    try:
        with av.open(file, "w", format="mp4") as container:
            stream = container.add_stream(name, rate=Fraction(RATE))
            stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT + STRIP, "yuv420p"
            stream.options = {"crf": str(_QUALITY), "preset": "medium"}
            for done, picture in enumerate(pictures(film), start=1):
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
                container.mux(stream.encode(frame))
                on_step(done, len(film.t) + film.held)
            container.mux(stream.encode())
    except av.FFmpegError as error:
        raise BadInputError(f"video: expected to encode it with {name}, found: {error}") from None
    return file.getvalue()
