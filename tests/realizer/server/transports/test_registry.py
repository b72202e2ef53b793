"""Which transports the settings ask for."""

from __future__ import annotations

import sys

import pytest

from realizer.core.settings import Settings
from realizer.server.transports.registry import TRANSPORTS, requested
from realizer.server.transports.xface.server import XfaceTransport


def test_transports_are_opened_as_the_settings_ask() -> None:
    assert list(requested(Settings())) == []
    assert list(requested(Settings(xface_port=0))) == [XfaceTransport]


def test_transports_are_named_after_settings() -> None:
    assert all(hasattr(Settings(), name) for name in TRANSPORTS)


def test_a_transport_of_a_plugin_is_always_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TRANSPORTS._ours, "bell", "tests_bell:make")  # type: ignore[index]
    monkeypatch.setitem(sys.modules, "tests_bell", type(sys)("tests_bell"))
    sys.modules["tests_bell"].make = print  # type: ignore[attr-defined]
    assert list(requested(Settings())) == [print]
