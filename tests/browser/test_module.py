"""realizer.js in a page of somebody else's, in a real browser: another origin, the same service."""

from __future__ import annotations

import contextlib
import functools
import http.server
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from realizer.face.load import load_face
from realizer.face.surface import face_scale
from tests.browser.test_page import ARGUMENTS, CHROMIUM, browser, pytestmark, serving

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

PAGE = """<!doctype html><title>another page</title><script type="module">
import * as module from "{address}/realizer.js";
Object.assign(globalThis, module);
globalThis.realizer = new Realizer({{ session: "module" }});
globalThis.received = [];
realizer.onfeedback = (element, seq) => received.push(seq);
realizer.onlost = () => (globalThis.lost = true);
realizer.connect();
realizer.ask({{ type: "hello", version: VERSION }}).then((welcome) => (globalThis.welcome = welcome));
</script>"""
WAIT = '<bml id="{}"><wait id="w" duration="{}"/></bml>'


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        """Nothing on the tests' output."""


@contextlib.contextmanager
def hosted(folder: Path) -> Iterator[str]:
    """A web server of another origin."""
    handler = functools.partial(Quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,))
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}/"
        server.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving([sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent"]) as address:
        yield address


@pytest.fixture
def page(browser, address, tmp_path):  # type: ignore[no-untyped-def]
    (tmp_path / "index.html").write_text(PAGE.format(address=address), "utf-8")
    with hosted(tmp_path) as url:
        opened = browser.new_page()
        faults: list[str] = []
        opened.on("pageerror", lambda error: faults.append(str(error)))
        opened.goto(url)
        opened.wait_for_function("globalThis.welcome")
        yield opened
        opened.close()
    assert faults == []


def test_connect_resolves_with_the_capabilities(page) -> None:  # type: ignore[no-untyped-def]
    welcome = page.evaluate("welcome")
    assert (welcome["session"], welcome["version"]) == ("module", 1)
    assert {"NOD", "SHAKE"} <= set(welcome["capabilities"]["lexemes"]["head"])


def test_play_resolves_at_the_end_of_the_block(page) -> None:  # type: ignore[no-untyped-def]
    bml = WAIT.format("b", 0.1)
    assert page.evaluate("async (bml) => (await realizer.play(bml)).getAttribute('id')", bml) == "b:end"
    assert page.evaluate("received.length") >= 4


def test_play_before_the_connection_is_not_lost(page) -> None:  # type: ignore[no-untyped-def]
    script = """async (bml) => {
      const other = new realizer.constructor({ url: realizer.url.href, session: "early" });
      const end = other.play(bml);
      other.connect();
      const id = (await end).getAttribute("id");
      other.close();
      return id;
    }"""
    assert page.evaluate(script, WAIT.format("e", 0.1)) == "e:end"


@pytest.mark.parametrize("nothing", ["", " \n", "<!-- later -->"])
def test_play_refuses_an_empty_text(page, nothing) -> None:  # type: ignore[no-untyped-def]
    script = "(nothing) => realizer.play(nothing).catch((error) => [error.code, error.message])"
    assert page.evaluate(script, nothing) == ["refused", "wanted <bml>, got nothing"]


def test_play_does_not_wait_for_a_block_in_a_comment(page) -> None:  # type: ignore[no-untyped-def]
    bml = WAIT.format("real", 0.1) + "<!-- " + WAIT.format("not", 0.1) + " -->"
    assert page.evaluate("async (bml) => (await realizer.play(bml)).getAttribute('id')", bml) == "real:end"


def test_play_of_a_refused_block_rejects_with_its_warning(page) -> None:  # type: ignore[no-untyped-def]
    refused = '<bml id="no"><required><head id="n" lexeme="NONE"/></required></bml>'
    said = page.evaluate("(bml) => realizer.play(bml).catch((error) => [error.code, error.where])", refused)
    assert said == ["refused", "no"]


@pytest.mark.parametrize("encoding", ["binary", "json"])
@pytest.mark.parametrize(("method", "values"), [("faps", 68), ("arkit", 59)])
def test_frames_ahead_are_passed_on_one_by_one(page, method, values, encoding) -> None:  # type: ignore[no-untyped-def]
    script = """async ([method, encoding]) => {
      const frames = [];
      await new Promise((done, fail) => {
        const take = (frame) => {
          frames.push([frame.frame, frame.values().length]);
          if (frames.length === 5) realizer.send('<bml id="nod"><head id="n" lexeme="NOD"/></bml>');
          if (frames.length === 40) done();
        };
        realizer[method]({ fps: 50, encoding }, take).catch(fail);
      });
      realizer.unsubscribe(method.replace("faps", "fap"));
      return frames;
    }"""
    frames = page.evaluate(script, [method, encoding])
    first = frames[0][0]
    assert frames == [[first + k, values] for k in range(40)]


@pytest.mark.parametrize(
    ("stream", "options", "values", "kind"),
    [
        ("arkit", {"fps": 50}, 59, "Float32Array"),
        ("fap", {"fps": 50}, 68, "Int32Array"),
        ("arkit", {"fps": 50, "encoding": "json"}, 59, "Array"),
    ],
)
def test_subscribe_yields_frames_of_numbers(page, stream, options, values, kind) -> None:  # type: ignore[no-untyped-def]
    script = """async ([stream, options]) => {
      const frames = [];
      const first = new Promise((done) => (globalThis.take = (frame) => done(frame)));
      const { names } = await realizer.subscribe(stream, options, (frame) => take(frame));
      const frame = await first;
      realizer.unsubscribe(stream);
      return [names.length, frame.stream, frame.values().length, frame.values().constructor.name];
    }"""
    assert page.evaluate(script, [stream, options]) == [values, stream, values, kind]


def test_subscribe_yields_names_after_a_change_of_face(page) -> None:  # type: ignore[no-untyped-def]
    script = """async (faces) => {
      const shown = [];
      let done;
      const all = new Promise((resolve) => (done = resolve));
      realizer.ask({ type: "character", face: faces[0] });
      await realizer.subscribe("mesh", { fps: 30 }, ({ streamInfo, values }) => {
        shown.push([streamInfo.face, streamInfo.scale, values().length === 3 * streamInfo.vertices]);
        if (shown.length === 2) realizer.ask({ type: "character", face: faces[1] });
        if (streamInfo.face === faces[1]) done();
      });
      await all;
      realizer.unsubscribe("mesh");
      return [shown[0], shown.at(-1)];
    }"""
    before, after = page.evaluate(script, ["ada", "ben"])
    for name, (face, scale, whole) in zip(("ada", "ben"), (before, after), strict=True):
        assert (face, whole) == (name, True)
        assert scale == pytest.approx(float(face_scale(load_face(name))[0]))


def test_subscribe_yields_pictures_as_bytes(page) -> None:  # type: ignore[no-untyped-def]
    script = """async () => {
      const first = new Promise((done) => (globalThis.take = done));
      const options = { size: [64, 48], format: "webp", fps: 5 };
      const { media_type } = await realizer.subscribe("video", options, (frame) => take(frame));
      const frame = await first;
      realizer.unsubscribe("video");
      const picture = await createImageBitmap(new Blob([frame.values()], { type: media_type }));
      return [media_type, picture.width, picture.height];
    }"""
    assert page.evaluate(script) == ["image/webp", 64, 48]


def test_subscribe_rejects_with_code_and_place(page) -> None:  # type: ignore[no-untyped-def]
    script = "(m) => realizer.ask(m).then(() => null, (error) => [error.code, error.where])"
    smell = {"type": "subscribe", "stream": "smell"}
    assert page.evaluate(script, smell) == ["unsupported", "subscribe.stream"]
    assert page.evaluate(script, {"type": "hello", "version": 99}) == ["version", "hello.version"]


def test_connection_comes_back_with_streams_and_feedback(page) -> None:  # type: ignore[no-untyped-def]
    script = """async (bml) => {
      const frames = [];
      await realizer.subscribe("au", { fps: 20 }, (frame) => frames.push(frame.frame));
      const end = realizer.play(bml);
      realizer.socket.close();
      const id = (await end).getAttribute("id");
      const before = frames.length;
      while (frames.length < before + 3) await new Promise((done) => requestAnimationFrame(done));
      return [id, globalThis.lost, received.every((seq, k) => k === 0 || seq === received[k - 1] + 1)];
    }"""
    assert page.evaluate(script, WAIT.format("kept", 1)) == ["kept:end", True, True]
