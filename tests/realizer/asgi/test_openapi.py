"""Tests of the description of the routes."""

from __future__ import annotations

from typing import Any

from realizer.asgi.documents import QUERY
from tests.realizer.asgi.served import NOD  # skips without the extras


def test_openapi_describes_every_route(http: Any) -> None:
    described = http.get("/openapi.json").json()
    assert described["openapi"].startswith("3.")
    assert {(path, method) for path, methods in described["paths"].items() for method in methods} == {
        ("/realize", "post"),
        ("/check", "post"),
        ("/sessions/{session}/bml", "post"),
        ("/sessions/{session}/feedback", "get"),
        ("/sessions/{session}", "delete"),
    }


def test_openapi_names_every_option_of_realize(http: Any) -> None:
    route = http.get("/openapi.json").json()["paths"]["/realize"]["post"]
    assert [parameter["name"] for parameter in route["parameters"]] == ["format", *QUERY]
    assert http.post("/realize", content=NOD.format("b")).status_code == 200
