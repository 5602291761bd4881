"""Every physical number of the system: its value, its unit, and where it comes from.

Each class groups the numbers of one part as a frozen model: unknown keys, non-finite numbers and
values out of bounds are refused. A source begins with one of `paper` (arXiv:2603.07795),
`datasheet`, `measured`, `fitted` (by which command) or `assumed` (why; the paper does not
say). Derived numbers are properties, computed here and never typed.

Import a group from its module: a command then builds the models that it has, and no others.
"""
