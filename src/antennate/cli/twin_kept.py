"""What `antennate twin` leaves behind: a log while it serves, a film when it has ended."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from pydantic.dataclasses import dataclass

from antennate.cli.options import option
from antennate.cli.progress import progress, stop_signals
from antennate.cli.status import write
from antennate.errors import ConfigError, LogError
from antennate.files import write_whole
from antennate.sim.world import World
from antennate.telemetry.twin_log import TwinLog
from antennate.twin.config import Passage, TwinConfig
from antennate.twin.robot import TwinRobot

if TYPE_CHECKING:
    from antennate.telemetry.log_film import TwinFilm


@dataclass(frozen=True)
class KeptOptions:
    """Whether to keep something."""

    log: Path | None = option(None, "keep a log, .mcap", "FILE")
    video: Path | None = option(None, "film it, .mp4; drawn when it has ended", "FILE")


class Kept:
    """Log and film of a twin; a context, to be left when nobody is served any more.

    A log that cannot be written any more is told at once, and ends nothing; it is an error when the
    twin has ended.

    Args:
        options: What is wanted.
        robot: The twin.

    Attributes:
        watchers: What is to be called with the world after each tick.

    Raises:
        ConfigError: A file has another ending, or a film exists.
        MissingPackageError: A package of the extra `video` is missing.
        BadInputError: Nothing here can draw.
    """

    def __init__(self, options: KeptOptions, robot: TwinRobot) -> None:
        self.watchers: list[Callable[[World], None]] = []
        self._options, self._robot = options, robot
        self._log: TwinLog | None = None
        self._film: TwinFilm | None = None
        _require_ending("--log", options.log, ".mcap")
        _require_ending("--video", options.video, ".mp4")
        if options.video is not None:
            _require_new(options.video)
            from antennate.telemetry.film import require_video  # slow to import

            require_video()

    def begin(self, passage: Passage, config: TwinConfig) -> None:
        """Begin, once all else is ready: before that no file is made.

        Args:
            passage: How far the twin has come; its `on_tick` and `on_pass` are the caller's.
            config: What is served.

        Raises:
            LogError: The log cannot be begun.
        """
        if self._options.log is not None:
            path, start = self._options.log, time.time_ns()
            self._log = TwinLog(path, self._robot, config, start, _tell)
            self.watchers.append(self._log.take)
        if self._options.video is not None:
            from antennate.telemetry.log_film import TwinFilm  # slow to import

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
                write(f"log: {self._log.path}{f': {wrong}' if wrong else ''}\n")
        if self._film is not None and self._options.video is not None:
            _draw(self._film, self._options.video)
        if failure and isinstance(error, KeyboardInterrupt | None):
            raise LogError(failure) from None


def _tell(failure: str) -> None:
    write(f"log: {failure}; the twin goes on without it\n")


def _require_ending(flag: str, path: Path | None, ending: str) -> None:
    """Check the name of a file that is to be written."""
    if path is not None and path.suffix != ending:
        raise ConfigError(f"{flag}: expected a name with {ending}, found {path}")


def _require_new(film: Path) -> None:
    """Check a film, which is not made before the end."""
    if film.exists():
        raise ConfigError(f"--video: expected no such file yet, found {film}; choose another name")
    if not film.parent.is_dir():
        raise ConfigError(f"--video: expected a folder for {film}, found none")


def _draw(kept: TwinFilm, path: Path) -> None:
    """Draw the film; a second Ctrl-C gives it up."""
    from antennate.telemetry.film import MOST_PICTURES, RATE, encoded

    film = kept.film()
    if film is None:
        write("video: no servo had torque, so there is nothing to show\n")
        return
    if kept.full:
        write(f"video: it ends after {MOST_PICTURES / RATE / 60:g} min, as long as a film may be\n")
    try:
        with progress("pictures of the film") as step, stop_signals():
            data = encoded(film, step)
    except KeyboardInterrupt:
        write("video: interrupted: no film was written\n")
        return
    write_whole(path, data)
    write(f"video: {path}\n")
