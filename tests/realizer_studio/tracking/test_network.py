"""Tests of the networks that find faces."""

from __future__ import annotations

import sys

import pytest
from PIL import Image

from realizer.core.errors import RealizerError
from realizer_studio.tracking.network import Network
from tests.portraits import LITERT


@LITERT
def test_network_takes_a_square_picture() -> None:
    model = Network("face_landmark")
    outputs = model(Image.new("RGB", (model.size, model.size)))
    assert sorted(value.size for value in outputs.values()) == [1, 1404]


def test_network_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ai_edge_litert", None)
    with pytest.raises(RealizerError, match=r"pip install 'bml-realizer\[track\]'"):
        Network("face_landmark")
