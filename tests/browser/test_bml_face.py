"""The element <bml-face> of the npm package, by the example page, in a real browser."""

from __future__ import annotations

import io
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import realizer
from tests import avatars
from tests.browser.test_module import hosted
from tests.browser.test_page import ARGUMENTS, CHROMIUM, browser, pytestmark, serving

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

PAGE = Path(__file__).parents[2] / "examples" / "avatar.html"
OPEN = '<bml id="{}"><faceLexeme id="f" lexeme="OPEN_MOUTH" amount="1" start="0" end="30"/></bml>'
LOOK = '<bml id="look"><gaze id="g" target="LEFT" start="0" end="30"/></bml>'
# The greatest weight of a shape in a mesh of the avatar.
WEIGHT = """(shape) => {
  let most = 0;
  face.avatar.scene.traverse((mesh) => {
    const index = mesh.morphTargetDictionary?.[shape];
    if (index !== undefined) most = Math.max(most, mesh.morphTargetInfluences[index]);
  });
  return most;
}"""
# How far, as a sine, the plate and the left eye have turned to the left.
TURN = """() => {
  const plate = face.avatar.scene.getObjectByName("Face");
  const corner = (k) => plate.getVertexPosition(k, plate.position.clone());
  const corners = [0, 1].map((k) => corner(k).applyMatrix4(plate.matrixWorld));
  const [right, left] = corners.sort((a, b) => a.x - b.x);
  return (right.z - left.z) / right.distanceTo(left);
}"""
GAZE = """() => {
  const eye = face.avatar.scene.getObjectByName("leftEye");
  const way = eye.getWorldDirection(eye.position.clone());
  return way.z > 0 ? way.x : -way.x;
}"""


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", "--no-idle"]
    with serving(command) as address:
        yield address


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Iterator[str]:  # type: ignore[no-untyped-def]
    """The example page with avatars beside it."""
    folder = tmp_path_factory.mktemp("site")
    shutil.copy(PAGE, folder)
    expressions = {"aa": "a", "happy": "b"}
    for name, content in {
        "plate.glb": avatars.avatar(twist=1),
        "perfect.vrm": avatars.avatar(("a", "jawOpen"), vrm=1, expressions={"JawOpen": "a"}),
        "vowels.vrm": avatars.avatar(("a", "b"), vrm=1, expressions=expressions, twist=2),
        "vowels0.vrm": avatars.avatar(("a", "b"), vrm=0, expressions=expressions),
        "foreign.glb": avatars.avatar(("grin",)),
        "broken.glb": avatars.avatar()[:300],
    }.items():
        (folder / name).write_bytes(content)
    realizer.realize("Hi", fps=2, voice="silent").save(folder / "ada.glb", morphs="arkit")
    with hosted(folder) as url:
        yield url


@pytest.fixture
def show(browser, address, site):  # type: ignore[no-untyped-def]
    """Return a function that opens the example page with an avatar."""
    pages = []

    def open_page(avatar: str, service: str = address):  # type: ignore[no-untyped-def]
        page = browser.new_page(viewport={"width": 480, "height": 640})
        pages.append(page)
        page.faults = []
        page.on("pageerror", lambda error: page.faults.append(str(error)))
        page.goto(f"{site}avatar.html?avatar={avatar}&service={service}&session={avatar.partition('.')[0]}")
        page.evaluate("globalThis.face = document.querySelector('bml-face')")
        return page

    yield open_page
    for page in pages:
        page.close()
        assert page.faults == []


def loaded(page, wanted: str = "face.avatar && face.realizer?.open"):  # type: ignore[no-untyped-def]
    page.wait_for_function(wanted)
    return page


def picture(page) -> np.ndarray:  # type: ignore[no-untyped-def]
    shot = Image.open(io.BytesIO(page.locator("bml-face").screenshot()))
    return np.asarray(shot.convert("RGB"), np.int16)


@pytest.mark.long
def test_bml_face_moves_the_mouth_of_our_own_face(show) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("ada.glb"))
    assert len(page.evaluate("face.avatar.shapes")) == 52
    before = picture(page)
    page.evaluate("(bml) => void face.realizer.play(bml)", OPEN.format("open"))
    page.wait_for_function(f"({WEIGHT})('jawOpen') > 0.5")
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    after = picture(page)
    changed = np.abs(after - before).max(axis=2) > 30
    rows, columns = np.nonzero(changed)
    assert changed.mean() > 0.005
    # The mouth is in the middle, below the middle of the picture.
    assert 0.5 < rows.mean() / len(before) < 0.85
    assert 0.4 < columns.mean() / before.shape[1] < 0.6


def speckles(shot: np.ndarray) -> int:
    """How many pixels of the brows are much lighter or much darker than both of their neighbours."""
    rows = shot[int(0.32 * len(shot)) : int(0.4 * len(shot))].sum(axis=2)
    steps = np.diff(rows, axis=1)
    before, after = steps[:, :-1], steps[:, 1:]
    return int(((np.minimum(np.abs(before), np.abs(after)) > 60) & (before * after < 0)).sum())


@pytest.mark.long
def test_bml_face_shows_our_own_face_as_stills_do(show) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("ada.glb"))
    drawn = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
    page.evaluate(drawn)
    shot = picture(page)
    still = realizer.realize("Hi", voice="silent").picture(
        at=0, size=shot.shape[1::-1], background="transparent"
    )
    covers = np.abs(shot - shot[:, :1]).max(axis=2) > 40, still[..., 3] > 127
    crown, still_crown = (int(np.argmax(cover[:, len(cover) // 2])) / len(cover) for cover in covers)
    assert crown == pytest.approx(still_crown, abs=0.03)
    width, still_width = (cover[len(cover) // 3].mean() for cover in covers)
    assert width == pytest.approx(still_width, abs=0.03)
    page.evaluate(
        "face.avatar.scene.traverse(({ material }) => material?.[1] && (material[1].visible = false))"
    )
    page.evaluate(drawn)
    assert speckles(shot) < 0.7 * speckles(picture(page)), "hair has smooth edges"


def test_bml_face_says_what_is_typed_with_sound(show) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("plate.glb"))
    page.fill("input", "Papa & Mama <spoke>")
    page.click("form button")
    page.wait_for_function(f"({WEIGHT})('jawOpen') > 0.05")


@pytest.mark.parametrize(
    ("avatar", "opened"),
    [
        ("plate.glb", f"({WEIGHT})('jawOpen')"),
        ("perfect.vrm", f"({WEIGHT})('a')"),
        ("vowels.vrm", f"({WEIGHT})('a')"),
        ("vowels0.vrm", f"({WEIGHT})('a')"),
    ],
)
def test_bml_face_drives_shapes_eyes_and_head(show, avatar, opened) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show(avatar))
    page.evaluate("(bml) => void face.realizer.play(bml)", OPEN.format("open"))
    page.evaluate("(bml) => void face.realizer.play(bml)", LOOK)
    page.wait_for_function(f"{opened} > 0.3")
    # To the character's left, which is +x for who looks along +z.
    page.wait_for_function(f"({TURN})() > 0.15")
    page.wait_for_function(f"({GAZE})() > 0.45")


def test_bml_face_says_what_failed_and_recovers(show, site) -> None:  # type: ignore[no-untyped-def]
    page = show("foreign.glb")
    said = "() => face.shadowRoot.querySelector('[part=error]').textContent"
    page.evaluate("face.addEventListener('error', ({ message }) => (globalThis.heard = message))")
    page.wait_for_function("face.shadowRoot?.querySelector('[part=error]').textContent")
    assert "wanted morph targets with ARKit's names, such as jawOpen" in page.evaluate(said)
    assert page.evaluate(said).endswith("got grin")
    for avatar in ("broken.glb", "none.glb", ""):
        page.evaluate("(avatar) => face.setAttribute('avatar', avatar)", avatar)
        page.wait_for_function("(avatar) => globalThis.heard?.includes(avatar || 'got none')", arg=avatar)
        assert "avatar: " in page.evaluate(said)
    page.evaluate("face.setAttribute('avatar', 'plate.glb')")
    loaded(page)
    assert page.evaluate(said) == ""


def test_bml_face_says_that_there_is_no_service(show, site) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("plate.glb"))
    page.evaluate("globalThis.said = []; face.addEventListener('error', ({ message }) => said.push(message))")
    page.evaluate("face.setAttribute('url', 'ws://127.0.0.1:1/ws')")
    page.wait_for_function("said.length > 1")
    (said,) = set(page.evaluate("said"))
    assert said == "no service at ws://127.0.0.1:1, or it refuses this page; trying again"
    assert page.evaluate("face.shadowRoot.querySelector('[part=error]').textContent") == said
    page.evaluate("face.setAttribute('url', 'ftp:nowhere')")
    page.wait_for_function("face.shadowRoot.querySelector('[part=error]').textContent.includes('ftp')")


SAID = "face.shadowRoot?.querySelector('[part=error]').textContent"


def test_bml_face_says_that_a_token_is_missing_or_wrong(show) -> None:  # type: ignore[no-untyped-def]
    command = [
        sys.executable,
        "-m",
        "realizer",
        "serve",
        "--port",
        "0",
        "--voice",
        "silent",
        "--token",
        "Xk-secret-7",
    ]
    with serving(command) as service:
        page = show("plate.glb", service)
        page.wait_for_function(f"{SAID}?.includes('REALIZER_TOKEN), got none')")
        page.evaluate("face.setAttribute('token', 'wrong')")
        page.wait_for_function(f"{SAID}.includes('REALIZER_TOKEN), got another one')")
        played = "face.realizer.play('<bml id=\"b\"/>').catch(({ code }) => code)"
        assert page.evaluate(played) == "token"
        page.evaluate("face.setAttribute('token', 'Xk-secret-7')")
        loaded(page)
        page.wait_for_function(f"{SAID} === ''")
        page.evaluate("face.setAttribute('session', 'a b')")
        page.wait_for_function(f"{SAID}.startsWith('session: wanted')")


def test_bml_face_says_that_its_page_was_opened_as_a_file(browser, address) -> None:  # type: ignore[no-untyped-def]
    page = browser.new_page()
    page.goto(f"{PAGE.as_uri()}?service={address}&avatar=none.glb")
    page.evaluate("globalThis.face = document.querySelector('bml-face')")
    page.wait_for_function(f"{SAID}?.includes('opened as a file')")
    page.close()


def test_bml_face_shows_words_as_they_are_spoken(show) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("plate.glb"))
    page.evaluate("""face.setAttribute('captions', '');
      globalThis.lines = new Set();
      const captions = face.shadowRoot.querySelector('[part=captions]');
      new MutationObserver(() => lines.add(captions.textContent)).observe(captions, { childList: true });""")
    text = "This is a sentence which is longer than a line of captions."
    page.evaluate(
        f'void face.realizer.play(\'<bml id="c"><speech id="s"><text>{text}</text></speech></bml>\')'
    )
    page.wait_for_function("lines.has('')")  # after the last word
    lines = page.evaluate("[...lines]")
    assert "This is a sentence" in lines
    assert lines[-2:] == ["line of captions", ""]
    assert max(map(len, lines)) <= 42


def test_bml_face_follows_its_attributes_and_size(show) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("plate.glb"))
    page.evaluate("globalThis.before = face.realizer; face.setAttribute('session', 'other')")
    page.wait_for_function("face.realizer !== before && face.realizer.open && !before.open")
    assert page.evaluate("face.realizer.session") == "other"
    page.evaluate("face.style.cssText = 'width: 200px; height: 100px'")
    size = (
        "(() => { const c = face.shadowRoot.querySelector('canvas'); return [c.width, c.height].join() })()"
    )
    page.wait_for_function(f"{size} === '200,100'")


def test_bml_face_lets_go_of_everything_when_removed(show) -> None:  # type: ignore[no-untyped-def]
    page = loaded(show("plate.glb"))
    page.evaluate("globalThis.before = face.realizer; face.remove()")
    page.wait_for_function("before.socket.readyState === WebSocket.CLOSED")
    assert page.evaluate("[face.realizer, face.avatar]") == [None, None]
    page.evaluate("document.body.prepend(face)")
    loaded(page)
    assert page.evaluate("face.shadowRoot.querySelectorAll('canvas').length") == 1
