"""Times for the same error, from runs at some spacings."""

from __future__ import annotations

import math
from typing import Any

import pytest

from validation.peers.report import OURS, at_widest, sooner


def runs(method: str, power: float, seconds: float, errors: list[float]) -> list[dict[str, Any]]:
    """Runs whose time grows with a power of the error, from a time for an error of 1."""
    return [
        {"part": "p", "operation": "round", "cells": n, "method": method, "rms": e, "seconds": seconds * e**power}
        for n, e in enumerate(errors)
    ]


def test_the_factor_is_that_of_the_times_where_both_errors_reach() -> None:
    rows = runs(OURS, -1.0, 1.0, [0.1, 1.0]) + runs("peer", -2.0, 3.0, [0.5, 2.0])
    # 3 e^-2 / e^-1 between 0.5 and 1: least at 1
    assert sooner(rows, "peer", "p", "round", "rms") == pytest.approx(3.0)
    assert at_widest(rows, rows[-1], "rms") == pytest.approx(0.75)


def test_there_is_no_factor_where_one_is_always_more_accurate() -> None:
    rows = runs(OURS, -1.0, 1.0, [0.1, 1.0]) + runs("peer", -1.0, 3.0, [2.0, 4.0])
    assert math.isnan(sooner(rows, "peer", "p", "round", "rms"))
    assert at_widest(rows, rows[-1], "rms") == pytest.approx(0.75)
    assert at_widest(rows, {**rows[-1], "rms": 0.01}, "rms") == 0
    assert math.isnan(sooner(rows[:2], "peer", "p", "round", "rms"))
