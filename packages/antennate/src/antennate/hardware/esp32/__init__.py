"""The antenna board: its frames, their decoder, and its clock seen from the host."""
