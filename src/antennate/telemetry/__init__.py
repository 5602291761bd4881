"""What is kept of a drive: every tick in one file, and its replay as a third world."""
