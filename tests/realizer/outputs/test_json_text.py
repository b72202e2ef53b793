"""Tests of the output .json."""

from __future__ import annotations

import json

import numpy as np
import pytest

from realizer.outputs.json_text import encode_json


def test_json_is_the_realization_in_one_line(realization) -> None:
    text = encode_json(realization)
    assert json.loads(text) == json.loads(json.dumps(realization.to_json()))
    assert text.index("\n") == len(text) - 1


def test_json_refuses_numbers_that_are_not_finite(realization) -> None:
    realization.aus.values[0, 0] = np.nan
    with pytest.raises(ValueError, match="JSON"):
        encode_json(realization)
