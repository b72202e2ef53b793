"""Which transports the settings ask for."""

from __future__ import annotations

import sys

import pytest

from realizer.core.settings import Settings
from realizer.server.transports.transport import TRANSPORTS, requested
from realizer.server.transports.xface.server import XfaceTransport


def test_registry_returns_the_transports_that_settings_request() -> None:
    assert list(requested(Settings())) == []
    assert list(requested(Settings(xface_port=0))) == [XfaceTransport]


def test_registry_names_transports_after_settings() -> None:
    assert all(hasattr(Settings(), name) for name in TRANSPORTS)


def test_registry_always_requests_the_transport_of_a_plugin(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(TRANSPORTS._ours, "bell", "tests_bell:make")  # type: ignore[index]
    monkeypatch.setitem(sys.modules, "tests_bell", type(sys)("tests_bell"))
    sys.modules["tests_bell"].make = lambda host, settings: host  # type: ignore[attr-defined]
    (make,) = requested(Settings())
    assert make("the host", Settings()) == "the host"


def test_registry_leaves_out_a_transport_of_a_plugin_that_fails(monkeypatch, caplog) -> None:
    def fail(host: object, settings: object) -> None:
        raise RuntimeError("no port")

    monkeypatch.setattr(TRANSPORTS, "working", lambda names: [("oops", fail)])
    (make,) = requested(Settings())
    assert make(None, Settings()) is None
    (record,) = caplog.records
    assert record.getMessage() == "the transport of the plug-in oops is not open: RuntimeError: no port"
