"""Tests of the routes without a session."""

from __future__ import annotations

from typing import Any

import pytest

from tests.realizer.asgi.served import NOD


@pytest.mark.parametrize("body", [NOD.format("b"), "Hello there"])
def test_realize_returns_the_file_of_a_format(http: Any, body: str) -> None:
    made = http.post("/realize", content=body).json()
    assert {"fps", "schedule", "fap", "au"} <= made.keys()
    fap = http.post("/realize?format=fap&fps=50", content=body)
    assert fap.status_code == 200
    assert "text" in fap.headers["content-type"]
    assert len(fap.content) > 100


@pytest.mark.gl
def test_realize_draws_a_picture(http: Any) -> None:
    picture = http.post("/realize?format=png&at=0.1&size=64x48&light=studio", content=NOD.format("b"))
    assert picture.headers["content-type"] == "image/png"
    assert picture.content.startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("query", "body", "status", "words"),
    [
        ("", "<bml/>", 400, "id: wanted one"),
        ("", "", 400, "got nothing"),
        ("format=foo", "Hi", 400, "wanted a suffix"),
        ("face=adda", "Hi", 400, "face: wanted one of"),
        ("face=/etc/passwd", "Hi", 400, "face: wanted the name of a face"),
        ("format=png&background=/etc/passwd", "Hi", 400, "background: wanted a colour"),
        ("fps=x", "Hi", 400, "fps: wanted a number"),
        ("colour=red", "Hi", 400, "colour: wanted one of"),
        ("format=png&at=9", NOD.format("b"), 400, "at: wanted 0.."),
        ("format=png&size=4000x4000", "Hi", 413, "REALIZER_MAX_SIZE"),
        ("", '<bml id="b"><wait id="w" duration="90"/></bml>', 400, "wanted at most 20 s"),
        ("", "x" * 20_001, 413, "REALIZER_MAX_DOCUMENT"),
    ],
)
def test_realize_says_what_was_wanted(http: Any, query: str, body: str, status: int, words: str) -> None:
    answer = http.post(f"/realize?{query}", content=body)
    assert answer.status_code == status
    assert words in answer.json()["error"]


def test_check_returns_faults_with_their_places(http: Any) -> None:
    (fault,) = http.post("/check", content='<bml id="b">\n<head id="n" lexeme="NODD"/></bml>').json()
    assert (fault["line"], fault["id"]) == (2, "b:n")
    assert "NOD" in fault["help"]


def test_pages_metrics_and_faces_are_served(http: Any) -> None:
    assert http.get("/healthz").json()["status"] == "ok"
    assert "realizer_sessions" in http.get("/metrics").text
    assert http.get("/faces/ada").headers["content-type"] == "model/gltf-binary"
    assert http.get("/nowhere").status_code == 404
    assert http.get("/").status_code in (200, 503)
