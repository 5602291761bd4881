"""Stand-ins for the antenna board, under CPython in invented time and under MicroPython."""

from __future__ import annotations

import struct
from collections.abc import Callable
from types import ModuleType

BYTES_PER_S = 11_520
"""115 200 baud with start and stop bits."""


class Board:
    """An ESP32 in invented time: sleeping and sending take time, and the timer fires in it."""

    def __init__(self, ticks: int = 0) -> None:
        self.us = 0
        self.first_ticks = ticks
        self.sent = bytearray()
        self.received = bytearray()
        self.until_us = 1_000_000
        self.stall_us: dict[int, int] = {}
        self.readings: Callable[[int, int], int] = lambda pin, count: 100 * pin
        self.reads = 0
        self.interrupts: list[int] = []
        self.callback: Callable[[object], None] | None = None
        self.period_us = 0
        self.due_us = 0

    def ticks_us(self) -> int:
        return (self.first_ticks + self.us) % 2**30

    def wait(self, us: int) -> None:
        """Let time pass; the callback runs whenever it is due."""
        end = self.us + us
        while self.callback is not None and self.due_us <= end:
            self.us = max(self.us, self.due_us)
            self.due_us += self.period_us
            self.callback(None)
        self.us = max(self.us, end)

    def write(self, data: bytes | bytearray) -> int:
        self.sent += data
        self.wait(len(data) * 1_000_000 // BYTES_PER_S)
        for at in [at for at in self.stall_us if at <= self.us]:
            self.wait(self.stall_us.pop(at))
        return len(data)

    def read(self, count: int) -> bytes:
        taken, self.received = self.received[:count], self.received[count:]
        return bytes(taken)

    def read_u16(self, pin: int) -> int:
        self.reads += 1
        counts = self.readings(pin, self.reads)
        return counts << 4 | counts >> 8

    def start(self, freq: int, mode: int, callback: Callable[[object], None]) -> None:
        assert mode == 1
        self.period_us = 1_000_000 // freq
        self.due_us = self.us + self.period_us
        self.callback = callback

    def stop(self) -> None:
        self.callback = None


def machine_of(board: Board, cause: int) -> ModuleType:
    """MicroPython's machine module for this board."""
    machine = ModuleType("machine")

    class Pin:
        IN, PULL_UP = 0, 2

        def __init__(self, number: int, *_: int) -> None:
            self.number = number

        def value(self) -> int:
            return int(self.number != 0 or board.us < board.until_us)

    class ADC:
        ATTN_11DB = 3

        def __init__(self, pin: Pin, atten: int) -> None:
            assert pin.number in range(32, 40)
            assert atten == self.ATTN_11DB
            self.read_u16 = lambda: board.read_u16(pin.number)

    class Timer:
        PERIODIC = 1

        def __init__(self, number: int) -> None:
            assert number == 0
            self.init = board.start
            self.deinit = board.stop

    names = ("PWRON_RESET", "HARD_RESET", "WDT_RESET", "DEEPSLEEP_RESET", "SOFT_RESET")
    constants = {name: number for number, name in enumerate(names, 1)}
    parts = {"Pin": Pin, "ADC": ADC, "Timer": Timer, **constants}
    machine.__dict__.update(parts)
    machine.__dict__["reset_cause"] = lambda: cause
    machine.__dict__["unique_id"] = lambda: b"\x24\x0a\xc4\x01\x02\x03"
    return machine


ON_BOARD = """\
import binascii, gc, sys
sys.path.insert(0, {folder!r})
import antenna_frame as frame
encoder, buffer = frame.SampleEncoder({boot}), bytearray(frame.SAMPLE_FRAME_SIZE)
for seq in range(100):
    encoder.encode_sample_into(buffer, seq, seq * 10000, seq * 7, seq * 13, seq % 8, 0)
    print(binascii.hexlify(buffer).decode())
gc.collect()
gc.disable()
before = gc.mem_alloc()
for seq in range(1000):
    encoder.encode_sample_into(buffer, seq, seq * 10000, 1, 2, 3, 4)
print(gc.mem_alloc() - before)
print(frame.crc32(b"123456789"))
"""

WHOLE_PROGRAM = """\
import sys, time
sys.path.insert(0, {folder!r})


class Pin:
    IN = PULL_UP = 0
    started = due = None

    def __init__(self, number, *_):
        self.number = number

    def value(self):
        now = time.ticks_ms()
        if Pin.started is None:
            Pin.started = Pin.due = now
        if Timer.callback and time.ticks_diff(now, Pin.due) >= 0:
            Pin.due += 10
            Timer.callback(None)
        return time.ticks_diff(now, Pin.started) < 500


class ADC:
    ATTN_11DB = 3

    def __init__(self, pin, atten):
        self.number = pin.number

    def read_u16(self):
        return self.number * 1600


class Timer:
    PERIODIC = 1
    callback = None

    def __init__(self, number):
        pass

    def init(self, freq, mode, callback):
        Timer.callback = callback

    def deinit(self):
        Timer.callback = None


class Machine:
    pass


machine = Machine()
machine.Pin, machine.ADC, machine.Timer, machine.PWRON_RESET = Pin, ADC, Timer, 1
machine.reset_cause = lambda: 1
machine.unique_id = lambda: b"serial"
sys.modules["machine"] = machine
import main
main.main()
"""

ON_NETWORK = """\
import sys


class WLAN:
    PM_NONE = 0

    def __init__(self, interface):
        pass

    def __getattr__(self, name):
        return lambda *_, **__: True


class Network:
    pass


network = Network()
network.WLAN, network.STA_IF, network.STAT_CONNECTING = WLAN, 0, 1001
sys.modules["network"] = network
"""
"""Before WHOLE_PROGRAM: a network that is always joined."""

INERTIAL = """\
import struct


class I2C:
    reads = 0

    def __init__(self, number, scl, sda, freq, timeout):
        self.registers = {}

    def readfrom_mem(self, address, register, count):
        return bytes([0x6C])

    def writeto_mem(self, address, register, data):
        self.registers[register] = data[0]

    def readfrom_mem_into(self, address, register, into):
        I2C.reads += 1
        if 10 < I2C.reads <= 20:
            raise OSError(19)
        into[:] = struct.pack("<6h", 1, -2, 3, -400, 500, -32768)


import config
config.PIN_SDA, config.PIN_SCL, config.IMU_AXES = 21, 22, (2, -1, 3)
machine.I2C = I2C
"""
"""Into WHOLE_PROGRAM, before it imports main: an inertial sensor that is silent for a while."""


class Lsm6dsox:
    """An I2C bus with one inertial sensor.

    Attributes:
        identity: What it says it is.
        silent: Whether it answers nothing.
        registers: What was written, by address.
        readings: Angular velocity, then specific force, along its own axes [counts].
    """

    def __init__(self) -> None:
        self.identity, self.silent = 0x6C, False
        self.registers: dict[int, int] = {}
        self.readings = (1, -2, 3, -400, 500, -32768)
        self.tries = 0

    def answer(self, address: int) -> None:
        self.tries += 1
        if self.silent or address != 0x6A:
            raise OSError(19)

    def readfrom_mem(self, address: int, register: int, count: int) -> bytes:
        self.answer(address)
        assert (register, count) == (0x0F, 1)
        return bytes([self.identity])

    def writeto_mem(self, address: int, register: int, data: bytes) -> None:
        self.answer(address)
        self.registers[register] = data[0]

    def readfrom_mem_into(self, address: int, register: int, into: bytearray) -> None:
        self.answer(address)
        assert register == 0x22
        into[:] = struct.pack("<6h", *self.readings)
