"""The real world: bytes from the antenna board, bytes to and from the servos.

With `dynamixel_bus` the only place for `serial`.
"""
