"""The process that serves the page, seen from the program that is shown."""

from __future__ import annotations

import contextlib
import json
import select
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from typing import NamedTuple

from antennate.errors import BadInputError, WorkerError, reason
from antennate.lookup import require_package
from antennate.telemetry.view.channel import END, FAILED, IDLE, READY, Channel

HOST = "127.0.0.1"
_ROS = "ros="
_STARTING = 60.0
"""Longest wait for the process to serve [s]: its imports on a busy machine; assumed."""
_ENDING = 2.0


class Place(NamedTuple):
    """Where topics of ROS 2 are.

    Attributes:
        domain: Number of the domain.
        network: Whether other computers may read along.
        accept: Whether goals of joints are taken.
    """

    domain: int
    network: bool = False
    accept: bool = False

    @classmethod
    def of(cls, words: Sequence[str]) -> Place | None:
        """The place in these words of the process, None if they have none."""
        found = next((word for word in words if word.startswith(_ROS)), None)
        return None if found is None else cls(*json.loads(found.removeprefix(_ROS)))


class ViewProcess:
    """Serves the page from a process of its own; a context.

    Args:
        port: Port of the page on this computer, 0 for any that is free; None without a page.
        module: What that process runs; its words are the files of the channel and of the page's
            socket, and the port for Foxglove, a hyphen for what is not wanted; then the words for
            `ros` and `idle`.
        foxglove: Port for Foxglove likewise, None without it.
        flag: The option that chooses the port of the page, for an error.
        on_lost: Called, in a thread of its own, with a line if it ends although nobody told it to.
        idle: Whether it gets a core only while nothing else wants one, once it serves.
        ros: Where topics of ROS 2 are, None without them.

    Attributes:
        channel: To it.
        port: The port of the page, 0 without one.
    """

    def __init__(
        self,
        port: int | None,
        module: str,
        foxglove: int | None = None,
        flag: str = "--view-port",
        on_lost: Callable[[str], None] = lambda line: None,
        idle: bool = False,
        ros: Place | None = None,
    ) -> None:
        if port is not None:
            require_package("viser", "view")
        if foxglove is not None:
            require_package("foxglove", "foxglove", package="foxglove-sdk")
        if ros is not None:
            require_package("cyclonedds", "ros")
        if port is not None and port == foxglove != 0:
            raise BadInputError(
                f"view: expected different ports for the page and for Foxglove, found "
                f"{port} twice; choose another with {flag} or --foxglove-port"
            )
        listener = socket.socket() if port is None else _listener(port, flag)
        self.port: int = 0 if port is None else listener.getsockname()[1]
        near, far = Channel.pair()
        with listener, far:
            files = [far.fileno()] + ([] if port is None else [listener.fileno()])
            words = [*map(str, files), *(["-"] if port is None else [])]
            words.append("-" if foxglove is None else str(foxglove))
            words += [] if ros is None else [_ROS + json.dumps(ros)]
            words += [IDLE] if idle else []
            self._process = subprocess.Popen(  # noqa: S603 our own words
                [sys.executable, "-m", module, *words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # viser prints there
                pass_fds=files,
                process_group=0,  # Ctrl-C in the terminal is for the program alone
            )
        self.channel, self._closing, self._why = Channel(near), False, ""
        try:
            self._wait()
        except BaseException:
            self.close()
            raise
        self._name = "view" if port is not None else "foxglove" if ros is None else "ros"
        threading.Thread(target=self._watch, args=(on_lost,), daemon=True).start()

    def _wait(self) -> None:
        """Until it serves."""
        ready, _, _ = select.select((self.channel,), (), (), _STARTING)
        kind, text = next(self.channel.receive() if ready else iter(()), (b"", b""))
        if kind == READY:
            return
        if kind == FAILED:
            raise BadInputError(text.decode())
        raise BadInputError(f"view: expected its process to serve, found that it {self._found()}")

    def _watch(self, on_lost: Callable[[str], None]) -> None:
        self._process.wait()
        if self._why:
            on_lost(f"{self._name}: given up, as {self._why}")
        elif not self._closing:
            on_lost(
                f"{self._name}: expected its process to serve until the end, found that it "
                f"{self._found()}; the run goes on without it"
            )

    def give_up(self, why: str) -> None:
        """End it at once, without waiting; `on_lost` is told why."""
        self._why = why
        self._process.kill()

    def lost(self) -> WorkerError:
        """What is raised when it ended although nobody told it to."""
        return WorkerError(
            "view: expected the process of its page to serve until Ctrl-C, found that it "
            f"{self._found()}"
        )

    def _found(self) -> str:
        """What became of a process that does not serve."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDING)
        code = self._process.poll()
        return "takes no messages" if code is None else f"ended with code {code}"

    def close(self) -> None:
        """End it."""
        self._closing = True
        self.channel.finish(END)
        self.channel.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDING)
        self._process.kill()
        self._process.wait()

    def __enter__(self) -> ViewProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _listener(port: int, flag: str) -> socket.socket:
    """A socket of this computer alone."""
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        listener.close()
        raise BadInputError(
            f"view: expected port {port} of {HOST} free, found: {reason(error)}; "
            f"choose another with {flag}, 0 takes any"
        ) from None
    return listener
