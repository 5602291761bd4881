"""The real world: bytes from the board, bytes to the servos."""
