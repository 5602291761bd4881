"""The entry keeps the protocol of controllers, and answers by what it feels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from antennate.control.policy.controller import Policy
from antennate.testing import check_controller

pytest.importorskip("onnxruntime")
FILE = Path(__file__).with_name("policy.onnx")


def test_it_keeps_the_protocol() -> None:
    check_controller(str(FILE))


def test_it_answers_by_what_it_feels() -> None:
    policy, rng = Policy(FILE), np.random.default_rng(8)
    names = [quantity.name for quantity in policy.contract.observations]
    felt = [i for i, name in enumerate(names) if name.startswith("flex")]
    own = rng.normal(0.0, 1.0, (200, len(names))).astype(np.float32)
    other = own.copy()
    other[:, felt] = rng.normal(0.5, 1.0, (200, len(felt)))
    before, after = (
        [policy.answer(x[None], policy.start())[0] for x in seen] for seen in (own, other)
    )
    assert (np.array(before) != np.array(after)).any()
