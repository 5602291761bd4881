"""What pip is told that shall install the root: a build backend that builds nothing."""

from __future__ import annotations

from typing import NoReturn


def _refuse(*_: object, **__: object) -> NoReturn:
    raise SystemExit("the root is no package: expected `pip install ./packages/*`")


get_requires_for_build_wheel = get_requires_for_build_sdist = get_requires_for_build_editable = (
    _refuse
)
build_wheel = build_sdist = build_editable = _refuse
