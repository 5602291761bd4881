"""A TCP port as an endpoint: one client at a time, and one that goes away can come back."""

from __future__ import annotations

import selectors
import socket

from antennate.errors import BadInputError

_CHUNK = 4096


class TcpEndpoint:
    """Listens on a port; a client connects to `path`.

    Args:
        host: Address to listen on; only this one.
        port: TCP port, 0 for any that is free.

    Raises:
        BadInputError: The port cannot be had.
    """

    flag, scheme = "--tcp", "tcp"

    def __init__(self, host: str, port: int) -> None:
        try:
            self._listener = socket.create_server((host, port), backlog=4)
        except OSError as error:
            raise BadInputError(
                f"{self.flag}: expected a free port, found {host}:{port}: {error}"
            ) from None
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self._rest = b""
        self._ready = selectors.DefaultSelector()
        self._ready.register(self._listener, selectors.EVENT_READ)
        self.path = f"{self.scheme}://{host}:{self._listener.getsockname()[1]}"

    def fileno(self) -> int:
        """Ready to be read if a client comes, sends or goes."""
        return self._ready.fileno()

    def baud(self) -> int | None:
        """There is none."""
        return None

    def read(self) -> bytes:
        """Bytes that have come."""
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
        self._client, self._rest = client, b""
        self._ready.register(client, selectors.EVENT_READ)
        self._begin()
        return came

    def write(self, data: bytes) -> None:
        """Send all of it, or nothing where there is no room because nobody reads."""
        if self._client is None:
            return
        try:
            if self._rest:
                self._rest = self._rest[self._client.send(self._rest) :]
            if not self._rest:
                self._rest = data[self._client.send(data) :]
        except BlockingIOError:
            return
        except OSError:
            self._part(self._client)

    def close(self) -> None:
        """Close client and listener."""
        if self._client is not None:
            self._part(self._client)
        self._ready.close()
        self._listener.close()

    def _begin(self) -> None:
        """A client has come."""

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
        if client is not self._client:
            return
        self._ready.unregister(client)
        client.close()
        self._client = None
