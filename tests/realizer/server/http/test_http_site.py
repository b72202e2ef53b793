"""HTTP beside the WebSocket: the page, faces, the light, the examples; and nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import realizer
from realizer.core.settings import Settings
from realizer.face.load import list_faces
from realizer.server.http.http_site import NAME, NOT_BUILT, HttpSite

SITE = HttpSite()
BUILT = SITE.answer("/").status_code == 200


def test_site_has_examples_with_titles() -> None:
    rows = json.loads(SITE.answer("/examples.json").body)
    assert len(rows) >= 4
    assert all(row["title"] and "<bml" in row["bml"] for row in rows)


def test_site_describes_the_protocol() -> None:
    answer = SITE.answer("/asyncapi.json")
    assert (answer.status_code, json.loads(answer.body)["asyncapi"]) == (200, "3.0.0")


def test_site_has_faces_as_glb_and_no_unknown_face() -> None:
    answer = SITE.answer("/faces/default")
    assert (answer.status_code, answer.media_type, answer.body[:4]) == (200, "model/gltf-binary", b"glTF")
    assert SITE.answer("/faces/default.glb").body == answer.body
    missing = SITE.answer("/faces/nobody")
    assert missing.status_code == 404
    assert b"nobody" in missing.body


def test_site_has_the_documentation_once_it_is_built(tmp_path: Path) -> None:
    assert b"mkdocs build" in HttpSite().answer("/docs/").body or (SITE.answer("/docs").status_code == 302)
    (tmp_path / "how-to").mkdir()
    (tmp_path / "index.html").write_text("<p>Words</p>", "utf-8")
    (tmp_path / "how-to" / "embed.html").write_text("<p>Embed</p>", "utf-8")
    site = HttpSite()
    site._documentation = tmp_path
    assert site.answer("/docs").headers["location"] == "/docs/index.html"
    assert site.answer("/docs/how-to/embed.html").body == b"<p>Embed</p>"
    assert site.answer("/docs/index.html").media_type == "text/html; charset=utf-8"
    outside = site.answer("/docs/../http_site.py")
    assert (outside.status_code, b"/docs/../http_site.py is not here" in outside.body) == (404, True)
    assert site.answer("/docs/how-to/missing.html").status_code == 404
    assert site.is_public("/docs/how-to/embed.html")


def test_site_sends_a_face_once_to_who_keeps_it() -> None:
    first = SITE.answer("/faces/default")
    tag = first.headers["etag"]
    again = SITE.answer("/faces/default", f'"other", {tag}')
    assert (again.status_code, again.body) == (304, b"")
    assert SITE.answer("/faces/default", '"other"').body == first.body


def test_site_has_the_light_of_stills() -> None:
    look = json.loads(SITE.answer("/look.json?face=default").body)
    assert look["light"] == "portrait"
    assert look["lights"]["portrait"]["uniforms"] != look["lights"]["evening"]["uniforms"]
    assert len(look["lights"]["portrait"]["uniforms"]["ambientLight"]) == 27
    assert look["camera"]["fovy"] > 0
    assert look["background"] is None
    assert SITE.answer("/look.json?face=nobody").status_code == 404


def test_site_has_the_environment_of_each_light() -> None:
    look = json.loads(SITE.answer("/look.json").body)
    for light in look["lights"]:
        texels = np.frombuffer(SITE.answer(f"/mirror?light={light}").body, "<f2")
        levels = texels.reshape(-1, look["mirror"], look["mirror"], 4)
        assert levels.max() > 0
        assert np.isfinite(levels).all()
        assert (levels[..., 3] == 1).all()
    assert SITE.answer("/mirror?light=none").status_code == SITE.answer("/mirror").status_code == 404


def test_site_has_the_picture_behind_the_face(tmp_path: Path) -> None:
    (tmp_path / "beach.png").write_bytes(b"a picture")
    site = HttpSite(Settings(background=str(tmp_path / "beach.png")))
    assert json.loads(site.answer("/look.json").body)["background"] == "/background"
    answer = site.answer("/background")
    assert (answer.status_code, answer.media_type, answer.body) == (200, "image/png", b"a picture")
    (tmp_path / "beach.png").unlink()
    assert site.answer("/background").status_code == 500
    assert SITE.answer("/background").status_code == 404
    assert not site.is_public("/background")


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
    assert answer.status_code == 200
    assert answer.media_type.startswith(media_type)
    assert answer.headers["Content-Security-Policy"].startswith("default-src 'self'")


@pytest.mark.parametrize(
    "path", ["/nothing", "/../serve.py", "/%2e%2e/serve.py", "/static/app.js", "/web/package.json", "//"]
)
def test_site_serves_no_other_files(path) -> None:
    assert SITE.answer(path).status_code == 404


def test_site_without_a_bundle_says_how_to_build_it(tmp_path, monkeypatch) -> None:
    site = HttpSite()
    monkeypatch.setattr(site, "_static", tmp_path / "static")
    answer = site.answer("/")
    assert (answer.status_code, answer.body) == (503, NOT_BUILT.encode())


def test_site_answers_the_tools_of_the_page_and_their_errors() -> None:
    assert json.loads(SITE.answer("/vocabulary.json").body)["elements"]
    shown = SITE.answer("/feeling.json?of=" + quote('{"name": "joy"}'))
    assert json.loads(shown.body)["values"]
    file = SITE.answer("/pose.fap?face=ada&set=" + quote('{"type": "set", "aus": {"12": 0.5}}'))
    assert file.body.startswith(b"2.1 pose 25 1\n")
    assert "pose.fap" in file.headers["Content-Disposition"]
    for target in ("/feeling.json", "/pose.fap", "/pose.fap?set=x", "/feeling.json?of=%00"):
        assert SITE.answer(target).status_code == 400


ROUTES = (
    "/",
    "/faces/",
    "/look.json?face=",
    "/mirror?light=",
    "/pose.fap?face=",
    "/feeling.json?of=",
    "/pose.fap?set=",
    "/x/",
)
VALUES = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers(-(10**400), 10**400) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=4,
)
FEELINGS = st.dictionaries(
    st.sampled_from(["angle", "activation", "name", "profile", "type", "aus", "faps", "emotion"]), VALUES
).map(lambda fields: quote(json.dumps(fields | {"type": "set"})))


def check(target: str) -> None:
    answer = SITE.answer(target)
    assert answer.status_code in (200, 400, 404) or not BUILT
    assert str(Path(realizer.__path__[0]).parent).encode() not in answer.body


@pytest.mark.parametrize(
    "target",
    [
        "/faces/..",
        "/faces/ada%00",
        "/faces/%61da",
        "/faces/Ada",
        "/faces/" + 5000 * "a",
        "/faces/ada/face.toml",
        "/faces/",
        "/look.json?face=..",
        "/pose.fap?face=%2e%2e&set=%7B%22type%22:%22set%22%7D",
        "/index.html%00",
        "//[",
    ],
)
def test_site_names_no_folder_for_a_name_that_is_none(target: str) -> None:
    check(target)
    assert SITE.answer(target).status_code == 404


@pytest.mark.parametrize(
    "of", [{"angle": 10**400, "activation": 5}, {"name": ["a"]}, {"angle": {}}, {"profile": 7}]
)
def test_site_refuses_what_is_no_emotion(of: dict[str, object]) -> None:
    assert SITE.answer("/feeling.json?of=" + quote(json.dumps(of))).status_code == 400


@given(st.sampled_from(ROUTES), st.text() | st.text(alphabet='./%&=?#{}[]"a0') | FEELINGS)
@example("/feeling.json?of=", quote('{"angle": 1e999, "activation": 1}'))
def test_site_answers_any_target_without_an_error(route: str, rest: str) -> None:
    check(route + rest)


@given(st.text(alphabet="/.%abfces012e_-?", max_size=30))
def test_site_answers_any_path_without_an_error(path: str) -> None:
    check("/" + path)


def test_site_reaches_every_shipped_face_by_its_name() -> None:
    assert all(NAME.fullmatch(info.name) for info in list_faces())


@pytest.mark.skipif(not BUILT, reason="the page was not bundled: build the package where npm is")
def test_site_has_its_page_for_everybody() -> None:
    for path in ("/", "/app.js", "/style.css", "/realizer.js"):
        assert SITE.is_public(path)
    for path in (
        "/metrics",
        "/faces/ada",
        "/look.json",
        "/vocabulary.json",
        "/asyncapi.json",
        "/nothing",
        "/.",
    ):
        assert not SITE.is_public(path)


def test_site_lists_its_files_once(tmp_path, monkeypatch) -> None:
    site = HttpSite()
    monkeypatch.setattr(site, "_static", tmp_path)
    (tmp_path / "page.js").write_text("1")
    assert site.is_public("/page.js")
    (tmp_path / "page.js").rename(tmp_path / "other.js")
    assert site.is_public("/page.js")
    assert not site.is_public("/other.js")
    assert site.answer("/page.js").status_code == 404
