"""Read tracks, clean them, and classify the shapes of the antennae."""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from antennate.errors import BadInputError
from antennate.messages import shortened
from antennate.studies.pool import Workers
from antennate.studies.pooling import frame, mean, pooled
from antennate.studies.trials import OnRow, OnStep, no_row, no_step
from antennate.types import Ints
from antennate_lab.tracks import measures, synthetic
from antennate_lab.tracks.cleaning import Antennae, Handled, clean
from antennate_lab.tracks.config import TracksConfig
from antennate_lab.tracks.readers import read
from antennate_lab.tracks.result import Seen, TrackRow, TracksResult, Unseen, WallFound
from antennate_lab.tracks.track import Track

_RATES_AGREE = 0.02
"""Relative difference of two frame rates that are the same."""


@dataclass
class TracksOutcome:
    """Everything that was measured, file by file.

    Attributes:
        config: What was asked, with the points and the wall of the synthetic animal if it was one.
        rows: A row for each antenna.
        antennae: The antennae in the same order.
        walls: The wall of each file.
        skipped: Animals known in too few frames.
        unseen: Antennae that were hardly seen, and animals that were left out.
        files: The file of each animal, by a hash of its points.
    """

    config: TracksConfig
    rows: list[TrackRow] = field(default_factory=list[TrackRow])
    antennae: list[measures.Antenna] = field(default_factory=list[measures.Antenna])
    walls: dict[str, measures.Wall] = field(default_factory=dict[str, measures.Wall])
    skipped: int = 0
    unseen: list[Unseen] = field(default_factory=list[Unseen])
    files: dict[bytes, str] = field(default_factory=dict[bytes, str])

    def add(
        self, name: str, tracks: Sequence[Track], truth: Ints | None = None
    ) -> Sequence[TrackRow]:
        """Measure the animals of one file; `truth` are the shapes of the left antenna."""
        config, before = self.config, len(self.rows)
        cleaned = self._cleaned(tracks)
        self._refuse_again(name, [animal.track for animal in cleaned])
        self.walls[name] = wall = _wall(config, cleaned)
        trial = self.rows[-1].trial + 1 if self.rows else 0
        for number, animal in enumerate(cleaned, trial):
            for side in config.points.sides:
                antenna = measures.measured(number, side, animal, wall)
                self.rows.append(_row(config, animal, antenna, truth if side == "left" else None))
                self.antennae.append(antenna)
        return self.rows[before:]

    def _cleaned(self, tracks: Sequence[Track]) -> list[Antennae]:
        """The antennae of the animals that are known in enough frames."""
        config, cleaned = self.config, list[Antennae]()
        for track in tracks:
            antennae = clean(config, track, frame_rate(config, track), config.y_down)
            known = {side: antennae.known(side) for side in antennae.sides}
            few = {s: n for s, n in known.items() if n < config.cleaning.least_frames}
            for side, count in few.items():
                parts = {part for name in config.points.of(side) for part in name.split("+")}
                of = parts | {*config.points.tail.split("+"), *config.points.head.split("+")}
                empty = tuple(name for name in antennae.empty if name in of)
                unseen = Unseen(
                    file=track.file,
                    animal=track.animal,
                    side=side,
                    frames=antennae.frames,
                    known=count,
                    empty=empty,
                    left_out=len(few) == len(known),
                )
                self.unseen.append(unseen)
            if len(few) == len(known):
                self.skipped += 1
            else:
                cleaned.append(antennae)
        return cleaned

    def _refuse_again(self, name: str, tracks: Sequence[Track]) -> None:
        """Refuse an animal that another file holds too: one recording would count as two."""
        hashes: dict[bytes, str] = {}
        for track in tracks:  # a hash of the points, the same in every format
            points = np.stack(list(track.points.values()))
            content = np.where(np.isnan(points), np.nan, points).tobytes()
            hashes[hashlib.sha256(content).digest()] = track.animal
        for content, animal in hashes.items():
            if content in self.files:
                raise BadInputError(
                    f"{name}: expected another recording than {self.files[content]}, found the "
                    f"same points{f' of {animal}' if animal else ''}; give each recording once"
                )
        self.files |= dict.fromkeys(hashes, name)

    def result(self) -> TracksResult:
        """What they come to."""
        config, criteria = self.config, self.config.criteria
        rows = frame(self.rows, TrackRow)
        animals = rows.drop_duplicates("trial")
        return TracksResult(
            seed=config.seed,
            source="files" if config.files else "synthetic",
            synthetic_shapes=None if config.files else config.synthetic.shapes,
            classified_by="bend" if config.points.count > 2 else "direction",
            wall={name: self._found(name, wall) for name, wall in self.walls.items()},
            frames=pooled(Seen, rows),
            animals=len(animals),
            skipped=self.skipped,
            handled=pooled(Handled, animals),
            unseen=self.unseen,
            trials_in_contact=len(measures.by_trial(criteria, self.antennae)),
            shapes=measures.over_trials(criteria, self.antennae),
            vary=config.vary,
            sensitivity=measures.sensitivity(config, self.antennae),
            curvature_rad=measures.curvatures(criteria, self.antennae),
            correct=mean(rows, "correct"),
        )

    def _found(self, name: str, wall: measures.Wall) -> WallFound:
        """The wall of a file, and how near to it its antennae came."""
        pairs = zip(self.rows, self.antennae, strict=True)
        near = [a.distance[a.known] for row, a in pairs if row.file == name]
        joined = np.concatenate([np.zeros(0), *near])
        nearest = beyond = None
        if wall.kind in ("line", "circle") and len(joined):
            nearest, beyond = float(joined.min()), float((joined < -measures.NEAR).mean())
        return WallFound(**vars(wall), nearest=nearest, beyond=beyond)

    def frames_csv(self) -> str:
        """Every frame of every antenna: angles, curvature and shape."""
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        inner = self.config.points.count - 2
        bends = [f"curvature{i}_rad" for i in range(1, inner + 1)]
        writer.writerow(
            ["trial", "side", "frame", "time_s", "angle_rad", "flex_rad", *bends, "shape"]
        )
        for antenna in self.antennae:
            shapes, angles = measures.shapes_of(self.config.criteria, antenna), antenna.outline
            columns = np.column_stack([angles.direction, angles.flex, angles.curvature]).round(5)
            rows = zip(columns.tolist(), shapes.tolist(), strict=True)
            for i, (numbers, shape) in enumerate(rows):
                cells = ["" if math.isnan(v) else v for v in numbers[: 2 + inner]]
                time = f"{i / antenna.rate:.6f}"
                writer.writerow(
                    [antenna.trial, antenna.side, i, time, *cells, measures.NAMES[shape]]
                )
        return file.getvalue()


def run(
    config: TracksConfig,
    workers: int | Workers = 1,
    on_step: OnStep = no_step,
    on_row: OnRow = no_row,
) -> TracksOutcome:
    """Classify the shapes of the antennae in every file."""
    del workers  # reading and measuring take less time than starting processes
    outcome = TracksOutcome(config)
    if not config.files:
        outcome.config = config.model_copy(
            update={"points": synthetic.POINTS, "wall": synthetic.WALL, "y_down": False}
        )
    names = config.files or [f"synthetic{k}" for k in range(config.synthetic.trials)]
    for number, name in enumerate(names):
        if config.files:
            tracks = read(Path(name), config.points.parts, config.columns)
            if not tracks:
                raise BadInputError(f"{name}: expected an animal with the named points, found none")
            rows = outcome.add(name, [track.in_order() for track in tracks])
        else:
            track, truth = synthetic.animal(config.synthetic, config.criteria, config.seed, number)
            rows = outcome.add(name, [track], truth)
        for row in rows:
            on_row(row)
        on_step(number + 1, len(names))
    if not outcome.rows:
        empty = {f"{p} has no value in {a.file}": 0 for a in outcome.unseen for p in a.empty}
        why = shortened(", ".join(empty)) if empty else "are the points right"
        raise BadInputError(
            f"{', '.join(names)}: expected an animal known in {config.cleaning.least_frames} "
            f"frames, found none; {why}, and is --cleaning.likelihood not too high?"
        )
    return outcome


def _wall(config: TracksConfig, animals: Sequence[Antennae]) -> measures.Wall:
    """The wall of a file, from its animals."""
    if not animals:
        return measures.Wall(kind="none")
    places = [antenna for animal in animals for antenna in animal.places.values()]
    lengths = [measures.length_of(side) for animal in animals for side in animal.sides.values()]
    usual, file = float(np.nanmedian(lengths)), animals[0].track.file
    wall = measures.wall_of(config.wall, file, np.concatenate([p[:, -1] for p in places]), usual)
    measures.require_inside(file, wall, np.concatenate([p[:, 0] for p in places]))
    return wall


def frame_rate(config: TracksConfig, track: Track) -> float:
    """Frames a second at which a track was recorded [Hz]."""
    stated = track.rate
    if stated is None:
        if config.rate is None:
            raise BadInputError(
                f"{track.file}: expected a frame rate, found none in the file; give --rate"
            )
        if config.playback_rate is not None:
            raise BadInputError(
                f"{track.file}: expected a file that states --playback-rate "
                f"{config.playback_rate:g}, found none stated; leave the flag out"
            )
        return config.rate
    if not 0.0 < stated < math.inf:
        raise BadInputError(f"{track.file}: expected a frame rate above 0, found {stated:g}")
    wanted = config.playback_rate or config.rate
    if wanted is not None and abs(stated / wanted - 1.0) > _RATES_AGREE:
        raise BadInputError(
            f"{track.file}: expected the frame rate {wanted:g} Hz, found {stated:g} Hz in the "
            f"file; if it was recorded at {config.rate:g} Hz and the file states another rate, add "
            f"--playback-rate {stated:g}"
        )
    return config.rate or stated


def _row(
    config: TracksConfig, animal: Antennae, antenna: measures.Antenna, truth: Ints | None
) -> TrackRow:
    shape = measures.shapes_of(config.criteria, antenna)
    contact, angles = shape >= 0, antenna.outline
    direction, flex = (
        float(np.median(values[contact])) if contact.any() else None
        for values in (angles.direction, angles.flex)
    )
    shares = zip(measures.SHAPES, measures.shares([shape]).tolist(), strict=True)
    return TrackRow(
        seed=config.seed,
        trial=antenna.trial,
        file=animal.track.file,
        animal=animal.track.animal,
        side=antenna.side,
        status="contact" if contact.any() else "no_contact",
        rate_hz=antenna.rate,
        frames=animal.frames,
        unknown=int((shape == measures.UNKNOWN).sum()),
        free=int((shape == measures.FREE).sum()),
        contact=int(contact.sum()),
        angle_median_rad=direction,
        flex_median_rad=flex,
        correct=None if truth is None else float((shape == truth).mean()),
        **{name: None if math.isnan(share) else share for name, share in shares},
        **vars(animal.handled),
    )
