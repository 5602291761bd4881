"""What an adapter hears of itself: requests that come back before their answers.

The bus has one wire for both ways. An adapter whose receiver stays on while it sends gives the
master each of its own packets. They are safe to drop: only a whole request, byte for byte as it was
sent, is taken for an echo, and none can be an answer, whose instruction byte is 0x55.
"""

from __future__ import annotations

from collections import deque

_MOST = 8
"""Requests whose echo may still come: more than are sent before the master reads again."""


class Echo:
    """Takes echoes out of what comes.

    Attributes:
        requests: Requests that came back so far.
    """

    def __init__(self) -> None:
        self.requests = 0
        self._sent: deque[bytes] = deque(maxlen=_MOST)
        self._begun = b""

    def expect(self, request: bytes) -> None:
        """This is about to be sent."""
        self._sent.append(request)

    def remove(self, data: bytes) -> bytes:
        """The rest of these bytes; what may be the beginning of an echo waits for the next ones."""
        data, self._begun = self._begun + data, b""
        while self._sent and data:
            request = self._sent[0]
            if request.startswith(data) and len(data) < len(request):
                self._begun, data = data, b""
                break
            self._sent.popleft()
            if data.startswith(request):
                self.requests += 1
                data = data[len(request) :]
        return data
