"""Write docs/causes.md from antennate.hardware.safety; with --check only compare it."""

from generated import finish, heads, row

from antennate.hardware.safety.causes import Cause

PAGE = """\
# States and causes

Every cause that `drive`, its log and the status line may name, the mildest first. What the robot
does in each state: [States](hardware.md#states).

{table}
"""


def main() -> None:
    """Write the page, or compare it."""
    rows = [row(f"`{c.name}`", c.severity.name, c.text, c.cure) for c in Cause]
    finish(__file__, PAGE.format(table="\n".join([heads("cause", "state", "means", "do"), *rows])))


if __name__ == "__main__":
    main()
