"""Settings of one antenna board; the host compares their hash."""

RATE = 100
"""Samples per second [Hz]."""
BURST = 15
"""Readings of each antenna per sample; their median is sent. Odd."""
PIN_LEFT = 34
"""GPIO of the left antenna. Only 32 to 39 have ADC1, which works beside WiFi."""
PIN_RIGHT = 35
"""GPIO of the right antenna."""
PIN_BUTTON = 0
"""GPIO of the button that stops the program (BOOT on most boards)."""

PIN_SDA: int | None = None
"""GPIO of the data line of an inertial sensor, LSM6DSOX; None: there is none."""
PIN_SCL: int | None = None
"""GPIO of its clock line."""
IMU_ADDRESS = 0x6A
"""Its address on I2C; 0x6B if its pin SA0 is high."""
IMU_AXES = (1, 2, 3)
"""Which of its axes (1 is x) point forward, to the left and up; negative: the other way. After a
quarter turn of the sensor to the right it is (2, -1, 3)."""

WIFI = ""
"""Name of the network to join; empty: frames go over USB, and no radio is switched on."""
PASSWORD = ""
"""Of that network."""
UDP_PORT = 4210
"""Port on which the board is asked for frames."""
KEY = ""
"""64 hexadecimal digits that only this board and its host have; empty: anybody can imitate it."""
