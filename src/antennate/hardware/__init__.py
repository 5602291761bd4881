"""The real world: bytes from the antenna board, bytes to and from the servos.

With the twin the only place for `serial`.
"""
