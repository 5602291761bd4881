"""The real world: bytes from the antenna board, bytes to and from the servos.

With `dxl.endpoints` the only place for `serial`.
"""
