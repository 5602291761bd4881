"""A TCP port as one end of a twin: one client at a time, and one that goes away can come back."""

from __future__ import annotations

import selectors
import socket

from antennate.errors import BadInputError

_CHUNK = 4096


class TcpEnd:
    """Listens on a port; whoever connects to `path` talks to us.

    Args:
        host: Address to listen on; only this one.
        port: TCP port, 0 for any that is free.

    Raises:
        BadInputError: The port cannot be had.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            self._listener = socket.create_server((host, port), backlog=4)
        except OSError as error:
            raise BadInputError(
                f"--tcp: expected a free port, found {host}:{port}: {error}"
            ) from None
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._listener, selectors.EVENT_READ)
        self.path = f"tcp://{host}:{self._listener.getsockname()[1]}"

    def fileno(self) -> int:
        """Ready to be read if a client comes, says something or goes."""
        return self._ready.fileno()

    def baud(self) -> int | None:
        """There is none."""
        return None

    def read(self) -> bytes:
        """What has come."""
        came = b"" if self._client is None else self._receive(self._client)
        try:
            client, _ = self._listener.accept()
        except OSError:  # nobody, or somebody who is gone already
            return came
        if self._client is not None:
            client.close()
            return came
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client = client
        self._ready.register(client, selectors.EVENT_READ)
        return came

    def write(self, data: bytes) -> int:
        """Say it; what finds no room because nobody listens is lost, as on a real line."""
        if self._client is None:
            return 0
        try:
            return self._client.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self._part(self._client)
            return 0

    @property
    def taken(self) -> bool:
        """A client is connected."""
        return self._client is not None

    def clear(self) -> None:
        """Nothing: a connection begins empty."""

    def close(self) -> None:
        """Client and listener."""
        if self._client is not None:
            self._part(self._client)
        self._ready.close()
        self._listener.close()

    def _receive(self, client: socket.socket) -> bytes:
        try:
            if data := client.recv(_CHUNK):
                return data
        except BlockingIOError:
            return b""
        except OSError:
            pass
        self._part(client)
        return b""

    def _part(self, client: socket.socket) -> None:
        self._ready.unregister(client)
        client.close()
        self._client = None
