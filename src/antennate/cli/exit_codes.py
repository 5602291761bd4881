"""The exit codes of every command."""

from __future__ import annotations

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130
