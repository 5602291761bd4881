"""The simulated world: parts built as MjSpec, compiled once, stepped fast."""
