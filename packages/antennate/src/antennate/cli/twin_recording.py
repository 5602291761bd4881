"""Recordings of a twin: its log and its film."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from pydantic.dataclasses import dataclass

from antennate.cli.options import option
from antennate.cli.terminal import progress, stop_signals, write
from antennate.errors import ConfigError, LogError
from antennate.files import write_whole
from antennate.sim.world import World
from antennate.telemetry import FilmView
from antennate.telemetry.twin_log import TwinLog
from antennate.twin.config import Passage, TwinConfig
from antennate.twin.robot import TwinRobot

if TYPE_CHECKING:
    from antennate.telemetry.twin_film import TwinFilm


@dataclass(frozen=True)
class RecordOptions:
    """What of the twin is recording."""

    log: Path | None = option(None, "keep a log, .mcap", "FILE")
    video: Path | None = option(None, "film it, .mp4; drawn when it has ended", "FILE")
    video_view: FilmView = option("above", "from where --video looks", needs=["--video"])


def say(text: str) -> None:
    """Tell something in a line of its own."""
    write(f"{text}\n")


def _say_lost(failure: str) -> None:
    say(f"log: {failure}; the twin goes on without it")


class Recording:
    """Log and film of a twin; a context, to be left when nobody is served any more.

    That a log cannot be written any more is said at once, and ends nothing; it is an error when the
    twin has ended. No file is made before `begin`, when all else is ready.

    Attributes:
        watchers: What is to be called with the world after each tick.
    """

    def __init__(self, options: RecordOptions, robot: TwinRobot) -> None:
        self.watchers: list[Callable[[World], None]] = []
        self._options, self._robot = options, robot
        self._log: TwinLog | None = None
        self._film: TwinFilm | None = None
        for flag, path, ending in (
            ("--log", options.log, ".mcap"),
            ("--video", options.video, ".mp4"),
        ):
            if path is not None and path.suffix != ending:
                raise ConfigError(f"{flag}: expected a name with {ending}, found {path}")
        if (film := options.video) is not None:
            if film.exists():
                raise ConfigError(
                    f"--video: expected no such file yet, found {film}; choose another name"
                )
            if not film.parent.is_dir():
                raise ConfigError(f"--video: expected a folder for {film}, found none")
            from antennate.telemetry.film import require_video  # slow to import

            require_video()

    def begin(self, passage: Passage, config: TwinConfig) -> None:
        """Begin to keep what is served."""
        if self._options.log is not None:
            path, start = self._options.log, time.time_ns()
            self._log = TwinLog(path, self._robot, config, start, _say_lost)
            self.watchers.append(self._log.take)
        if self._options.video is not None:
            from antennate.telemetry.twin_film import TwinFilm  # slow to import

            self._film = TwinFilm(self._robot, passage, config)
            self.watchers.append(self._film.take)

    def event(self, text: str) -> None:
        """Keep in the log what happened now."""
        if self._log is not None:
            self._log.event(text, self._robot.t)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        failure = ""
        if self._log is not None:
            wrong = self._log.close()
            failure = self._log.failure
            if not failure:
                say(f"log: {self._log.path}{f': {wrong}' if wrong else ''}")
        if self._film is not None and self._options.video is not None:
            _draw(self._film, self._options.video, self._options.video_view)
        if failure and isinstance(error, KeyboardInterrupt | None):
            raise LogError(failure) from None


def _draw(recorded: TwinFilm, path: Path, view: FilmView) -> None:
    """Draw the film; a second Ctrl-C gives it up."""
    from antennate.telemetry.film import MOST_PICTURES, RATE, encoded

    film = recorded.film()
    if film is None:
        say("video: no servo had torque, so there is nothing to show")
        return
    if recorded.full:
        say(f"video: it ends after {MOST_PICTURES / RATE / 60:g} min, as long as a film may be")
    try:
        with progress("pictures of the film") as step, stop_signals():
            data = encoded(film.seen_from(view), step)
    except KeyboardInterrupt:
        say("video: interrupted: no film was written")
        return
    write_whole(path, data)
    say(f"video: {path}")
