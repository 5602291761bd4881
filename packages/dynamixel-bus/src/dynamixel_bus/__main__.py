"""`python -m dynamixel_bus` is the command `dynamixel-bus`."""

import sys

from dynamixel_bus.command import main

if __name__ == "__main__":
    sys.exit(main())
