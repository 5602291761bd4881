"""A cable that can be pulled: a TCP port that passes bytes on to another one, or does not."""

import contextlib
import select
import socket
import threading

from antennate.host import LEVEL, claim


class Cable:
    """Between one client and one server, while it is entered.

    Args:
        address: Of the server, as tcp://HOST:PORT.

    Attributes:
        address: What the client opens.
    """

    def __init__(self, address: str) -> None:
        host, port = address.removeprefix("tcp://").rsplit(":", 1)
        self._server = (host, int(port))
        self._door = socket.create_server(("127.0.0.1", 0))
        self.address = f"tcp://127.0.0.1:{self._door.getsockname()[1]}"
        self._pair: list[socket.socket] = []
        self._plugged = True
        self._end = False
        self._thread = threading.Thread(target=self._pass_on, daemon=True)

    def __enter__(self) -> "Cable":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end = True
        self._thread.join()
        self._door.close()

    def pull(self) -> None:
        """Both sides see the connection end, and none comes about."""
        self._plugged = False

    def plug(self) -> None:
        """Let the client connect again."""
        self._plugged = True

    def _pass_on(self) -> None:
        claim(LEVEL + 2)  # a wire waits for no program
        while not self._end:
            if not self._plugged:
                self._close()
            waits = [self._door, *self._pair]
            for ready in select.select(waits, [], [], 0.02)[0]:
                if ready is self._door:
                    self._connect()
                elif ready in self._pair:
                    self._move(ready)
        self._close()

    def _connect(self) -> None:
        client = self._door.accept()[0]
        if not self._plugged or self._pair:
            client.close()
            return
        try:
            server = socket.create_connection(self._server, timeout=1.0)
        except OSError:
            client.close()
            return
        for one in (client, server):
            one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._pair = [client, server]

    def _move(self, one: socket.socket) -> None:
        other = self._pair[1 - self._pair.index(one)]
        try:
            data = one.recv(65536)
            other.sendall(data)
        except OSError:
            data = b""
        if not data:
            self._close()

    def _close(self) -> None:
        for one in self._pair:
            with contextlib.suppress(OSError):
                one.close()
        self._pair = []
