"""The simulated robot behind real bytes, with faults on demand."""
