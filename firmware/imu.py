"""Reads ST's LSM6DSOX, three gyroscopes and three accelerometers, over I2C.

Registers and their bits are those of ST's own driver, lsm6dsox_reg.h. It measures up to 1000 deg/s
and 8 g, as the host's `robot.imu` says by default. A board without one needs no copy of this file.
"""

import struct

import antenna_frame as frame
import machine

WHO_AM_I = 0x0F
IDENTITY = 0x6C
CTRL1_XL = 0x10
CTRL2_G = 0x11
CTRL3_C = 0x12
OUTX_L_G = 0x22
"""First of twelve registers: angular velocity, then specific force."""
UP_TO_8_G = 3 << 2
UP_TO_1000_DPS = 2 << 2
WHOLE_READINGS = 0x44
"""No register changes while one of its pair is read, and addresses rise by themselves."""
SLOWEST = 4
"""Code of 104 Hz; each further one doubles the rate."""
FASTEST = 10
TIMEOUT_US = 20000
"""Two ticks of 10 ms, the default of ESP-IDF: one alone may be over at once."""
FAILURES = 5
"""Failures in a row after which it is asked once a second alone."""
ZEROS = 10
"""Samples of six zeros in a row after which it is set up anew: a sensor that has restarted answers
so until it is."""
SETTLING = 10
"""Part of a second after a set-up in which readings count as missing: 100 ms (assumed)."""


def require_rotation(axes):
    """Raise ValueError unless these are the axes of a sensor that is mounted in some way."""
    whole = all(isinstance(axis, int) for axis in axes)
    if whole and len(axes) == 3 and {abs(axis) for axis in axes} == {1, 2, 3}:
        x, y, z = axes
        a, b, c = abs(x), abs(y), abs(z)
        if (b - a) * (c - b) * (c - a) * x * y * z > 0:  # not a mirror image
            return
    raise ValueError(
        "config.py: expected IMU_AXES to be 1, 2 and 3 in some order and with signs, "
        f"as a rotation makes them, found {axes}"
    )


def sensor(config):
    """The sensor that these settings name; ValueError if they cannot be used."""
    sda, scl = config.PIN_SDA, config.PIN_SCL
    if sda is None or scl is None:
        raise ValueError("config.py: expected both of PIN_SDA and PIN_SCL, found one")
    if sda == scl or {sda, scl} & {config.PIN_LEFT, config.PIN_RIGHT, config.PIN_BUTTON}:
        raise ValueError("config.py: expected pins for PIN_SDA and PIN_SCL alone")
    if config.IMU_ADDRESS not in (0x6A, 0x6B):
        raise ValueError(
            f"config.py: expected IMU_ADDRESS 0x6A or 0x6B, found {config.IMU_ADDRESS}"
        )
    return Imu(sda, scl, config.IMU_ADDRESS, config.IMU_AXES, config.RATE)


class Imu:
    """The sensor behind two pins.

    `settings` are its pins, address and axes, for the hash of the greeting.
    """

    def __init__(self, sda, scl, address, axes, rate):
        require_rotation(axes)
        self._bus = machine.I2C(
            0, scl=machine.Pin(scl), sda=machine.Pin(sda), freq=400000, timeout=TIMEOUT_US
        )
        self.settings = (sda, scl, address, axes[0], axes[1], axes[2])
        self._address = address
        self._axes = axes
        self._code = SLOWEST
        while self._code < FASTEST and 104 << (self._code - SLOWEST) < rate:
            self._code += 1
        self._raw = bytearray(12)
        self._rate = rate
        self._wait = 0
        self._ready = False
        self._failures = 0
        self._zeros = 0
        self.misses = 0

    def read_into(self, target, at):
        """Write six readings along the axes of the head to a target from an index on."""
        if not self._read():
            self.misses += 1
            for i in range(6):
                target[at + i] = frame.IMU_NONE
            return
        readings = struct.unpack("<6h", self._raw)
        for i in range(6):
            axis = self._axes[i % 3]
            reading = readings[i - i % 3 + abs(axis) - 1]
            reading = reading if axis > 0 else -reading
            target[at + i] = max(-32767, min(32767, reading))

    def _read(self):
        """Whether readings have come."""
        if self._wait:
            self._wait -= 1
            return False
        try:
            if self._ready:
                self._bus.readfrom_mem_into(self._address, OUTX_L_G, self._raw)
                self._failures = 0
                return self._measures()
            self._ready = self._begin()
        except OSError:  # no answer
            self._ready = self._ready and self._failures + 1 < FAILURES
            self._fail()
            return False
        if self._ready:
            self._zeros = 0
            self._wait = -(-self._rate // SETTLING) - 1
        else:
            self._fail()
        return False

    def _fail(self):
        """Try again at the next sample, or a second later if that has not helped."""
        self._failures += 1
        if self._failures >= FAILURES:
            self._wait = self._rate - 1

    def _measures(self):
        """Whether these are readings: one that has restarted gives zeros, which never happen."""
        if any(self._raw):
            self._zeros = 0
            return True
        self._zeros += 1
        self._ready = self._zeros < ZEROS
        return False

    def _begin(self):
        """Set it up; False if another part answers."""
        if self._bus.readfrom_mem(self._address, WHO_AM_I, 1)[0] != IDENTITY:
            return False
        for register, value in (
            (CTRL3_C, WHOLE_READINGS),
            (CTRL1_XL, self._code << 4 | UP_TO_8_G),
            (CTRL2_G, self._code << 4 | UP_TO_1000_DPS),
        ):
            self._bus.writeto_mem(self._address, register, bytes([value]))
        return True
