"""The simulated robot on serial ports, with the bytes of a real one, and faults on demand."""
