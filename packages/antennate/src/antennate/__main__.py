"""`python -m antennate`, the same as `antennate`."""

import sys

from antennate.cli import main

if __name__ == "__main__":
    sys.exit(main())
