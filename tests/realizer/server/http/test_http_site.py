"""HTTP beside the WebSocket: the page, faces, the light, the examples; and nothing else."""

from __future__ import annotations

import json
from urllib.parse import quote

import pytest

from realizer.server.http.http_site import NOT_BUILT, HttpSite

SITE = HttpSite(lambda: {"sessions": 2})
BUILT = SITE.answer("/").status == 200


def test_site_reports_health() -> None:
    answer = SITE.answer("/healthz")
    assert json.loads(answer.body) == {"status": "ok", "sessions": 2}


def test_site_has_examples_with_titles() -> None:
    rows = json.loads(SITE.answer("/examples.json").body)
    assert len(rows) >= 4
    assert all(row["title"] and "<bml" in row["bml"] for row in rows)


def test_site_describes_the_protocol() -> None:
    answer = SITE.answer("/asyncapi.json")
    assert (answer.status, json.loads(answer.body)["asyncapi"]) == (200, "3.0.0")


def test_site_has_faces_as_glb_and_no_unknown_face() -> None:
    answer = SITE.answer("/faces/default")
    assert (answer.status, answer.media_type, answer.body[:4]) == (200, "model/gltf-binary", b"glTF")
    assert SITE.answer("/faces/default.glb").body == answer.body
    missing = SITE.answer("/faces/nobody")
    assert missing.status == 404
    assert b"nobody" in missing.body


def test_site_has_the_light_of_stills() -> None:
    look = json.loads(SITE.answer("/look.json?face=default").body)
    assert {"key", "fill", "rim"} <= set(look["light"])
    assert look["camera"]["fovy"] > 0
    assert look["light"] == look["lights"]["portrait"] != look["lights"]["evening"]
    assert len(look["furrows"]["points"]) == len(look["furrows"]["tones"]) > 100
    assert len(look["glints"]["eyes"]) == 2
    assert look["background"] is None
    assert SITE.answer("/look.json?face=nobody").status == 404


@pytest.mark.skipif(not BUILT, reason="the page was not bundled: build the package where npm is")
@pytest.mark.parametrize(
    ("path", "media_type"),
    [
        ("/", "text/html"),
        ("/app.js", "text/javascript"),
        ("/style.css", "text/css"),
        ("/realizer.js", "text/javascript"),
    ],
)
def test_site_serves_the_page_with_its_media_types(path, media_type) -> None:
    answer = SITE.answer(path + "?session=x")
    assert answer.status == 200
    assert answer.media_type.startswith(media_type)
    assert dict(answer.headers)["Content-Security-Policy"].startswith("default-src 'self'")


@pytest.mark.parametrize(
    "path", ["/nothing", "/../serve.py", "/%2e%2e/serve.py", "/static/app.js", "/web/package.json", "//"]
)
def test_site_serves_no_other_files(path) -> None:
    assert SITE.answer(path).status == 404


def test_site_without_a_bundle_says_how_to_build_it(tmp_path, monkeypatch) -> None:
    site = HttpSite(dict)
    monkeypatch.setattr(site, "_static", tmp_path / "static")
    answer = site.answer("/")
    assert (answer.status, answer.body) == (503, NOT_BUILT.encode())


def test_site_answers_the_tools_of_the_page_and_their_errors() -> None:
    assert json.loads(SITE.answer("/vocabulary.json").body)["elements"]
    shown = SITE.answer("/feeling.json?of=" + quote('{"name": "joy"}'))
    assert json.loads(shown.body)["values"]
    file = SITE.answer("/pose.fap?face=ada&set=" + quote('{"type": "set", "aus": {"12": 0.5}}'))
    assert file.body.startswith(b"2.1 pose 25 1\n")
    assert "pose.fap" in dict(file.headers)["Content-Disposition"]
    for target in ("/feeling.json", "/pose.fap", "/pose.fap?set=x", "/feeling.json?of=%00"):
        assert SITE.answer(target).status == 400
