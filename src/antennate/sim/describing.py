"""Whether this process only describes a command, as `--help` does: then no engine is refused."""

_only = [False]


def describe_only(asked: bool) -> None:
    """Say so before the engine is imported."""
    _only[0] = asked


def is_described() -> bool:
    """Whether nothing is simulated."""
    return _only[0]
