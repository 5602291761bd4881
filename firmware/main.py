"""Reads two flex sensors at a steady rate and sends frames over the USB serial port or over UDP.

MicroPython for the ESP32 runs this file after a reset. A timer takes the samples; the loop sends
them, over USB also a greeting once a second and whenever the host asks. Holding the BOOT button
ends it and gives the prompt back. What the host sends is compared with known requests, and never
executed.
"""

import array
import binascii
import os
import select
import sys
import time

import antenna_frame as frame
import config
import machine
import micropython

SLOTS = 8
"""Samples that wait for sending; then the oldest is dropped and counted."""
GREETING_MS = 1000


class Sampler:
    """Takes samples in the timer's callback; keeps the newest SLOTS.

    The callback writes only `head` and slots, the loop only `tail` and `drops`, so neither waits.
    """

    def __init__(self, left, right, imu=None):
        self._left = left
        self._right = right
        self._imu = imu
        self._bursts = (
            array.array("H", [0] * config.BURST),
            array.array("H", [0] * config.BURST),
        )
        self._ticks = array.array("I", [0] * SLOTS)
        self._counts = array.array("H", [0] * (2 * SLOTS))
        self._flags = bytearray(SLOTS)
        self._motion = array.array("h", [0] * (6 * SLOTS if imu else 0))
        self._misses = array.array("I", [0] * SLOTS)
        self._longest = 1500000 // config.RATE
        self._last = None
        self.head = 0
        self.tail = 0
        self.drops = 0

    @property
    def moves(self):
        """Whether samples hold readings of an inertial sensor."""
        return self._imu is not None

    @property
    def imu_settings(self):
        """Settings of the inertial sensor for the hash of the greeting; none without one."""
        return () if self._imu is None else self._imu.settings

    def sample(self, _timer):
        """Read both antennae in turn; the time is that of the first reading."""
        ticks = time.ticks_us() & frame.TICK_MASK  # pyright: ignore[reportOperatorIssue]  (an int)
        lefts, rights = self._bursts
        for i in range(config.BURST):
            insert(lefts, i, self._left.read_u16() >> 4)
            insert(rights, i, self._right.read_u16() >> 4)
        left = lefts[config.BURST // 2]
        right = rights[config.BURST // 2]
        slot = self.head % SLOTS
        if self._imu is not None:
            self._imu.read_into(self._motion, 6 * slot)
            self._misses[slot] = self._imu.misses
        self._ticks[slot] = ticks
        self._counts[2 * slot] = left
        self._counts[2 * slot + 1] = right
        self._flags[slot] = self._flag(ticks, left, right)
        self.head += 1

    def _flag(self, ticks, left, right):
        flags = 0
        if left == 0 or left == frame.FULL_SCALE:
            flags |= frame.FLAG_LEFT_RAIL
        if right == 0 or right == frame.FULL_SCALE:
            flags |= frame.FLAG_RIGHT_RAIL
        if self._last is not None and (ticks - self._last) & frame.TICK_MASK > self._longest:
            flags |= frame.FLAG_LATE
        self._last = ticks
        return flags

    def encode_next_into(self, encoder, buffer):
        """Write the oldest waiting sample as a frame; False if none waits."""
        while self.tail != self.head:
            self._drop()
            seq = self.tail
            slot = seq % SLOTS
            encoder.encode_sample_into(
                buffer,
                seq,
                self._ticks[slot],
                self._counts[2 * slot],
                self._counts[2 * slot + 1],
                self._flags[slot],
                self.drops,
                self._felt(slot),
                self._misses[slot],
            )
            if self.head - seq <= SLOTS:  # else the callback has overwritten the slot meanwhile
                self.tail = seq + 1
                return True
        return False

    def _felt(self, slot):
        """Readings of the inertial sensor in a slot."""
        return tuple(self._motion[6 * slot : 6 * slot + 6]) if self._motion else ()

    def put_back(self):
        """The sample encoded last could not be sent: it waits again."""
        self.tail -= 1

    def _drop(self):
        late = self.head - self.tail - SLOTS
        if late > 0:
            self.tail += late
            self.drops += late


def insert(burst, filled, reading):
    """Keep the first readings of a burst sorted while one is added."""
    while filled and burst[filled - 1] > reading:
        burst[filled] = burst[filled - 1]
        filled -= 1
    burst[filled] = reading


class Requests:
    """Compares incoming bytes with the one request known; keeps nothing but how many match."""

    def __init__(self):
        self._expected = frame.encode_request()
        self._matched = 0

    def feed(self, byte):
        """Take a byte; True if it completes a request."""
        if byte == self._expected[self._matched]:
            self._matched += 1
        else:
            self._matched = 1 if byte == 0 else 0
        if self._matched < len(self._expected):
            return False
        self._matched = 1  # its last delimiter may be the first of the next
        return True


def reset_reason():
    """Why the board started, in the numbers of the frame."""
    cause = machine.reset_cause()
    for name, reason in (
        ("PWRON_RESET", frame.RESET_POWER_ON),
        ("HARD_RESET", frame.RESET_HARD),
        ("WDT_RESET", frame.RESET_WATCHDOG),
        ("DEEPSLEEP_RESET", frame.RESET_DEEP_SLEEP),
        ("SOFT_RESET", frame.RESET_SOFT),
    ):
        if cause == getattr(machine, name, None):
            return reason
    return frame.RESET_UNKNOWN


def random_id():
    """Random 32 bits; the time since start is mixed in, as without a radio the source is weak."""
    return frame.crc32(os.urandom(8) + str(time.ticks_us()).encode()) & 0xFFFFFFFF


def channel(pin):
    """Converter of one antenna, for up to about 2.45 V."""
    return machine.ADC(machine.Pin(pin), atten=machine.ADC.ATTN_11DB)


class Silent:
    """In place of an inertial sensor that cannot be used: it never answers."""

    settings = (0, 0, 0, 0, 0, 0)

    def __init__(self):
        self.misses = 0

    def read_into(self, target, at):
        """Write that there are no readings to a target from an index on."""
        self.misses += 1
        for i in range(6):
            target[at + i] = frame.IMU_NONE


def inertial():
    """The inertial sensor that the settings name, None for none.

    One that cannot be used is told in a line, and stops no antenna.
    """
    if config.PIN_SDA is None and config.PIN_SCL is None:
        return None
    try:
        import imu  # a board without one needs no copy of it

        return imu.sensor(config)
    except Exception as error:  # noqa: BLE001  (antennae come first)
        print("no inertial sensor:", error)  # noqa: T201
        return Silent()


def greeting(boot_id, imu_settings):
    """Frame that says who speaks, since when and with which settings."""
    settings = frame.config_hash(
        config.RATE, config.BURST, config.PIN_LEFT, config.PIN_RIGHT, imu_settings
    )
    return frame.encode_hello(boot_id, reset_reason(), settings, machine.unique_id(), config.RATE)


class Usb:
    """The serial port as the way out."""

    def __init__(self, hello):
        self._out = sys.stdout.buffer
        self._poller = select.poll()
        self._poller.register(sys.stdin, select.POLLIN)
        self._requests = Requests()
        self._hello = hello
        self._greet()

    def send(self, sample):
        """Send a frame; waits until it has left."""
        self._out.write(sample)
        return True

    def tend(self):
        """Greet if it is time to, or if the host asks."""
        due = time.ticks_diff(time.ticks_ms(), self._greeted) >= GREETING_MS
        if self._asked() or due:
            self._greet()

    def _greet(self):
        self._out.write(self._hello)
        self._greeted = time.ticks_ms()

    def _asked(self):
        """Look at one byte from the host, if there is one; True if it completes a request."""
        for _ in self._poller.ipoll(0):
            byte = sys.stdin.buffer.read(1)
            return bool(byte) and self._requests.feed(byte[0])
        return False


def joined():
    """The network that the settings name, None for USB."""
    if not config.WIFI:
        return None
    import wifi  # a board on USB needs no copy of it

    return wifi.Station(config.WIFI, config.PASSWORD)


def outlet(station, boot_id, hello, size):
    """The way out of frames of this size, greeting first."""
    if station is None:
        return Usb(hello)
    import wifi

    key = binascii.unhexlify(config.KEY)
    return wifi.Outlet(station, config.UDP_PORT, key, boot_id, hello, size)


def stream(sampler, button):
    """Send until the button is held."""
    station = joined()  # before numbers are drawn: its noise makes them random
    boot_id = random_id()
    encoder = frame.SampleEncoder(boot_id, sampler.moves)
    hello = greeting(boot_id, sampler.imu_settings)
    way = outlet(station, boot_id, hello, encoder.size)
    buffer = bytearray(encoder.size)
    while button.value():
        if not sampler.encode_next_into(encoder, buffer):
            time.sleep_ms(1)
        elif not way.send(buffer):
            sampler.put_back()
            time.sleep_ms(1)
        way.tend()


def main():
    """Set up the board and stream; the serial port is a prompt again afterwards."""
    sampler = Sampler(channel(config.PIN_LEFT), channel(config.PIN_RIGHT), inertial())
    button = machine.Pin(config.PIN_BUTTON, machine.Pin.IN, machine.Pin.PULL_UP)
    timer = machine.Timer(0)
    micropython.kbd_intr(-1)  # a byte 3 from the host is no keyboard interrupt
    try:
        timer.init(freq=config.RATE, mode=machine.Timer.PERIODIC, callback=sampler.sample)
        stream(sampler, button)
    finally:
        timer.deinit()
        micropython.kbd_intr(3)


if __name__ == "__main__":
    main()
