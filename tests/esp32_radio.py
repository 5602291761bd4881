"""A WiFi network and a host for the stand-in board, in invented time."""

from __future__ import annotations

import errno
from collections.abc import Callable
from types import ModuleType, SimpleNamespace

import numpy as np
from esp32_board import Board

from antennate.hardware.esp32.wire import FrameDecoder, Hello, Sample
from antennate.hardware.ports.network import Verifier
from antennate.params.hardware import NetworkParams

KEY = bytes(range(32))
HOST = ("192.168.4.7", 50000)
JOIN_US = 2_000_000
"""Joining a network, or finding that it is not there, takes 2 s."""
CONNECTING, IDLE, MISSING = 1001, 1000, 201


class Radio:
    """The air between a board and one host.

    Attributes:
        present: Whether the network is there at a time [us].
        failing: Share of sends that raise at a time [us].
        samples: What the host got, with the time [us].
    """

    def __init__(self, board: Board) -> None:
        self.board = board
        self.present: Callable[[int], bool] = lambda us: True
        self.failing: Callable[[int], float] = lambda us: 0.0
        self.error = errno.ENOMEM
        self.host = Verifier(KEY, bytes(16), NetworkParams())
        self.samples: list[tuple[int, Sample]] = []
        self.greetings: list[Hello] = []
        self.asks: list[bytes] = []
        self.settings: dict[str, object] = {}
        self.attempts: list[int] = []
        self.bound: object = None
        self._decoder = FrameDecoder()
        self._began: int | None = None
        self._doomed = False
        self._again = False
        self._chance = np.random.default_rng(9)

    @property
    def joined(self) -> bool:
        """An attempt that at any time does not find the network comes to nothing."""
        self._doomed |= not self.present(self.board.us)
        done = self._began is not None and self.board.us - self._began >= JOIN_US
        if done and self._doomed:
            self._began = None
        return done and not self._doomed

    def status(self) -> int:
        if self.joined:
            return 1010
        return MISSING if self._began is None else CONNECTING

    def connect(self, name: str, password: str) -> None:
        assert (name, password) == ("lab", "secret of the lab")
        self.attempts.append(self.board.us)
        self._began = self.board.us
        self._doomed = False

    def disconnect(self) -> None:
        self._began = None
        raise OSError(errno.ENOTCONN)

    def receive(self, size: int) -> tuple[bytes, object]:
        now = self.board.us * 1e-6
        ask = self.host.ask() if self._again else self.host.due_ask(now)
        self._again = False
        if ask is None or not self.joined:
            raise OSError(errno.EAGAIN)
        self.asks.append(ask)
        assert len(ask) < size
        return ask, HOST

    def send(self, data: bytes | bytearray, receiver: object) -> int:
        assert receiver == HOST
        self.board.wait(1000)
        if not self.joined:
            raise OSError(errno.EHOSTUNREACH)
        if self._chance.random() < self.failing(self.board.us):
            raise OSError(self.error)
        frame, self._again = self.host.take(bytes(data), self.board.us * 1e-6)
        for found in self._decoder.feed(frame):
            if isinstance(found, Hello):
                self.greetings.append(found)
            else:
                assert isinstance(found, Sample)
                self.samples.append((self.board.us, found))
        return len(data)

    def network(self) -> ModuleType:
        """MicroPython's module of that name."""
        made = ModuleType("network")

        class WLAN:
            PM_NONE = 0
            active = staticmethod(lambda on: None)
            config = staticmethod(lambda **settings: self.settings.update(settings))
            isconnected = staticmethod(lambda: self.joined)
            status = staticmethod(self.status)
            connect = staticmethod(self.connect)
            disconnect = staticmethod(self.disconnect)

            def __init__(self, interface: int) -> None:
                assert interface == 0

        made.__dict__.update(WLAN=WLAN, STA_IF=0, STAT_CONNECTING=CONNECTING)
        return made

    def socket(self) -> SimpleNamespace:
        """MicroPython's module of that name."""

        def bind(address: object) -> None:
            self.bound = address

        made = SimpleNamespace(
            bind=bind, setblocking=lambda on: None, recvfrom=self.receive, sendto=self.send
        )
        return SimpleNamespace(
            AF_INET=2,
            SOCK_DGRAM=2,
            socket=lambda family, kind: made,
            getaddrinfo=lambda host, port: [(2, 2, 0, "", (host, port))],
        )
