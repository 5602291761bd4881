"""The real world: bytes from the antenna board, bytes to and from the servos.

The only place for `serial`.
"""
