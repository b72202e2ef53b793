"""TalkingHead's JSON, as TalkingHead takes it."""

from __future__ import annotations

import base64
import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS, output_for
from realizer.tables.arkit_names import shapes

READERS = Path(__file__).parent / "readers"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
ARGUMENTS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
KINDS = {".html": "text/html", ".js": "text/javascript", ".mjs": "text/javascript"}


def written(realization, tmp_path):
    path = tmp_path / "x.talkinghead.json"
    assert output_for(path) is OUTPUTS[".talkinghead.json"]
    output_for(path).write(realization, path, RenderSettings())
    return json.loads(path.read_text("utf-8"))


@pytest.fixture
def head() -> Iterator[object]:
    """A page with TalkingHead in it, from its own package."""
    if CHROMIUM is None or not (READERS / "node_modules").is_dir():
        pytest.skip(f"needs Chromium and: npm ci --prefix {READERS}")
    from playwright.sync_api import sync_playwright

    def answer(route):  # type: ignore[no-untyped-def]
        path = READERS / route.request.url.removeprefix("http://readers.test/")
        if path.is_file():
            route.fulfill(body=path.read_bytes(), content_type=KINDS.get(path.suffix, "text/plain"))
        else:
            route.fulfill(status=404)

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        page = browser.new_page()
        page.route("**/*", answer)
        page.goto("http://readers.test/talkinghead.html")
        page.wait_for_function("window.speak !== undefined")
        yield page
        browser.close()


@pytest.mark.browser
@pytest.mark.xdist_group("browser")
@pytest.mark.filterwarnings("ignore::ResourceWarning")  # Playwright's own event loop closes its pipes late
def test_talkinghead_queues_every_word_viseme_and_frame(realization, tmp_path, head):
    said = written(realization, tmp_path)
    queued = head.evaluate("said => window.speak(said)", said)
    subtitles = [(part["ts"], part["vs"]) for part in queued["anim"] if part["name"] == "subtitles"]
    assert subtitles == [
        ([250], {"subtitles": [" Hello"]}),
        ([650], {"subtitles": [" R&D <team>"]}),
    ]
    lips = [part for part in queued["anim"] if part["name"] == "viseme"]
    assert [next(iter(part["vs"])).removeprefix("viseme_") for part in lips] == said["visemes"]
    assert set(said["visemes"]) <= set(queued["visemes"])
    middles = [t + d / 2 for t, d in zip(said["vtimes"], said["vdurations"], strict=True)]
    assert [part["ts"][1] for part in lips] == pytest.approx(middles)
    (face,) = [part for part in queued["anim"] if part["name"] == "performance"]
    assert face["ts"] == pytest.approx([40 * k for k in range(38)])
    assert face["vs"]["mouthSmileLeft"][1:38] == pytest.approx(np.linspace(0, 1, 38)[1:], abs=0.02)
    assert queued["seconds"] == pytest.approx(1.5, abs=0.01)
    assert queued["peak"] > 0.2


def test_talkinghead_visemes_are_those_of_the_sounds(tmp_path):
    document = (
        '<bml id="a" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
        '<speech id="s" start="0.5"><text>Papa thinks of five blue boats</text></speech></bml>'
    )
    played = realize(document, voice="silent", idle=False)
    said = written(played, tmp_path)
    assert said["words"] == ["Papa", "thinks", "of", "five", "blue", "boats"]
    assert said["visemes"][0] == "PP"
    assert {"PP", "aa", "TH", "FF", "U"} <= set(said["visemes"])
    starts, lengths = np.array(said["vtimes"]), np.array(said["vdurations"])
    assert starts[0] >= 500
    assert (lengths > 0).all()
    assert (starts[1:] >= (starts + lengths)[:-1] - 0.11).all()
    assert len(base64.b64decode(said["audio"])) == 2 * round(played.duration * said["sampleRate"])


def test_talkinghead_animates_the_face_apart_from_the_mouth(turn, tmp_path):
    played = realize(turn, voice="silent")
    anim = written(played, tmp_path)["anim"]
    assert len(anim["dt"]) == played.frames - 1
    assert {len(values) for values in anim["vs"].values()} == {played.frames - 1}
    known = {*shapes(), "eyesLookDown", "eyesLookUp", "headRotateX", "headRotateY", "headRotateZ"}
    assert set(anim["vs"]) <= known
    assert {"mouthSmileLeft", "cheekSquintRight", "headRotateY", "eyeLookOutLeft"} <= set(anim["vs"])
    assert not {"jawOpen", "mouthPucker", "mouthFunnel"} & set(anim["vs"])


def test_talkinghead_has_sync_points_as_markers(realization, tmp_path):
    said = written(realization, tmp_path)
    assert dict(zip(said["markers"], said["mtimes"], strict=True)) == {
        "greeting:nod:start": 200, "greeting:nod:stroke": 810, "greeting:nod:end": 1400
    }  # fmt: skip
