"""Usual ports of the live view."""

PAGE = 8777
"""The page (assumed: nothing known uses it)."""
FOXGLOVE = 8765
"""The WebSocket of Foxglove."""
