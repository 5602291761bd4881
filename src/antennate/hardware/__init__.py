"""The real world: servos on a bus, bytes in and out. With the twin the only place for `serial`."""
