"""DYNAMIXEL servos: Protocol 2.0, control tables, and the master of a half-duplex bus."""
