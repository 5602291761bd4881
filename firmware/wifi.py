"""Joins a WiFi network and sends signed frames over UDP; see antenna_datagram.py for the protocol.

Nothing here waits, and no trouble of the network raises: sampling goes on whatever happens.
"""

import socket
import time

import antenna_datagram as datagram
import network

LOOK_MS = 250
"""Pause between looks at the state of the network."""
JOIN_MS = 4000
"""Longest that one attempt to join may take."""


class Station:
    """Keeps the board in its network."""

    def __init__(self, name, password):
        self._name = name
        self._password = password
        self._wlan = network.WLAN(network.STA_IF)
        self._wlan.active(True)
        self._wlan.config(pm=self._wlan.PM_NONE)  # asleep between beacons, it receives late
        self._looked = time.ticks_ms()
        self._tried = self._looked
        self._join()

    def tend(self):
        """Join again if the network is lost; looks only now and then."""
        now = time.ticks_ms()
        if time.ticks_diff(now, self._looked) < LOOK_MS:
            return
        self._looked = now
        if self._wlan.isconnected():
            return
        busy = self._wlan.status() == network.STAT_CONNECTING
        if not busy or time.ticks_diff(now, self._tried) >= JOIN_MS:
            self._tried = now
            self._join()

    def _join(self):
        for step in (self._wlan.disconnect, self._connect):
            try:  # noqa: SIM105  (MicroPython has no contextlib)
                step()
            except OSError:  # no network now, or none to leave
                pass

    def _connect(self):
        self._wlan.connect(self._name, self._password)


def now_ms() -> int:
    """Time [ms], modulo 2**30; the stubs would have it opaque."""
    return time.ticks_ms()  # pyright: ignore[reportReturnType]


class Outlet:
    """Where frames go: to the host that last proved to have the key and to hear this board."""

    def __init__(self, station, port, key, boot_id, hello, size):
        self._station = station
        self._speaker = datagram.Speaker(datagram.Signer(key), boot_id, hello, size)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(socket.getaddrinfo("0.0.0.0", port)[0][-1])  # noqa: S104  (its one address)
        self._socket.setblocking(False)

    def send(self, sample):
        """Send a frame; False if that failed or nobody listens."""
        signed = self._speaker.sign(sample, now_ms())
        return signed is not None and self._say(signed, self._speaker.listener)

    def tend(self):
        """Look at one datagram, if there is one, and at the network."""
        self._station.tend()
        try:
            asked, sender = self._socket.recvfrom(datagram.ASK_SIZE + 1)
        except OSError:  # nothing has come
            return
        answer = self._speaker.answer(asked, sender, now_ms())
        if answer is not None:
            self._say(answer, sender)

    def _say(self, data, receiver):
        try:
            return self._socket.sendto(data, receiver) == len(data)
        except OSError:  # out of buffers, no network, nobody there
            return False
