"""The page in a real browser, against the real service: the face lives and documents play."""

from __future__ import annotations

import io
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from realizer.face.load import folder_of, list_faces, load_face
from tests.waiting import LIMIT

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,  # Without a graphics card, Chromium takes the cores from all that runs beside it.
    pytest.mark.xdist_group("browser"),
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt install chromium"),
    # Playwright's own event loop closes its pipes late.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
PATIENCE = 1000 * LIMIT  # ms
ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-gpu-compositing",  # which takes a core without a graphics card; WebGL stays
    "--disable-background-networking",
    "--autoplay-policy=no-user-gesture-required",
]


@contextmanager
def serving(command: list[str]) -> Iterator[str]:
    """The address of a service that this command starts; stopped by the signal its user would send."""
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert service.stdout is not None
    found = None
    while found is None:
        line = service.stdout.readline()
        assert line, "the service ended before it listened"
        found = re.search(r"http://127\.0\.0\.1:\d+", line)
    yield found.group()
    service.send_signal(signal.SIGINT)
    service.stdout.close()
    assert service.wait(LIMIT) == 0


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A service on a free port of loopback, without idle motion: pages draw only what a test moves."""
    with serving([sys.executable, "-m", "realizer", "serve", "--port", "0", "--no-idle"]) as address:
        yield address


@pytest.fixture(scope="module")
def browser() -> Iterator[object]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def opened(browser, address):  # type: ignore[no-untyped-def]
    """The page, open, and the errors of its console."""
    # Playwright's own predicates need eval, which the page's policy forbids.
    page = browser.new_page(viewport={"width": 1000, "height": 660}, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.goto(address)
    page.wait_for_selector('#status[data-state="live"]')
    page.wait_for_selector("#lights button")
    yield page, faults
    page.close()


@pytest.fixture
def page(opened):  # type: ignore[no-untyped-def]
    """The page as it was when it was opened; any error on its console fails the test."""
    page, faults = opened
    faults.clear()
    page.set_viewport_size({"width": 1000, "height": 660})
    page.evaluate("realizerPage.link.ask({ type: 'stop' })")
    page.click("#tab-script")
    for first in ("#lights button:first-child", "#faces button:first-child"):
        if page.get_attribute(first, "aria-pressed") == "false":
            page.click(first)
    page.click("#clear")
    yield page
    assert faults == []


def picture(page):  # type: ignore[no-untyped-def]
    from PIL import Image

    return Image.open(io.BytesIO(page.locator("#head").screenshot())).convert("RGB")


def pixel(image, across: float, down: float) -> tuple[int, int, int]:  # type: ignore[no-untyped-def]
    return image.getpixel((int(across * image.width), int(down * image.height)))  # type: ignore[no-any-return]


STILL = 480  # pixels: of the stage that is compared with a still
FROWN = {1: 1.0, 4: 1.0}
FACE = "mapped"


def mapped_face(folder: Path) -> None:
    """Write a face that has everything: ada, with maps across her front and a hair."""
    import numpy as np
    from PIL import Image

    shutil.copytree(folder_of("ada"), folder)
    for old in (*folder.glob("*.webp"), *folder.glob("cards.npz")):
        old.unlink()
    mesh = dict(np.load(folder / "mesh.npz"))
    flat = mesh["vertices"][:, :2] * (1, -1)
    low, high = flat.min(axis=0), flat.max(axis=0)
    mesh["uv"] = np.rint((flat - low) / (high - low) * 65535).astype(np.uint16)[mesh["triangles"]]
    mesh["fold_weights"] = np.full((len(flat), 2), 255, np.uint8)
    np.savez(folder / "mesh.npz", **{name: mesh[name] for name in mesh if name != "see_through"})
    y, x = np.mgrid[:512, :512]
    maps = {
        "albedo": [200 + 40 * np.sin(x / 20), 190 + 50 * np.sin(y / 15), 180 + 0 * x, 255 + 0 * x],
        "relief": [128 + 60 * np.sin(x / 6) * np.sin(y / 5)],
        "surface": [230 + 20 * np.sin(x / 40), 120 + 90 * np.sin(y / 50), 100 + 100 * np.sin(x / 30)],
        "folds": [128 + 100 * np.sin(x / 8)],
    }
    for name, channels in maps.items():
        picture = np.stack(channels, axis=2).astype(np.uint8).squeeze()
        Image.fromarray(picture).save(folder / f"{name}.webp", lossless=True)
    forehead = flat[:, 1].argsort()[len(flat) // 4]
    shares = np.tile(np.float32([1, 0, 0, 0]), (4, 1))
    places = np.array([[9000, 9000], [20000, 9000], [9000, 30000], [20000, 30000]], np.uint16)
    np.savez(
        folder / "cards.npz",
        roots=forehead + np.arange(16, dtype=np.int32).reshape(4, 4), weights=shares, ups=shares, uv=places,
        triangles=np.int32([[0, 1, 2], [2, 1, 3]]), colours=np.full((4, 3), 90, np.uint8),
        occlusion=np.full(4, 255, np.uint8), gloss=np.zeros(4, np.uint8),
    )  # fmt: skip
    table = (folder / "face.toml").read_text()
    table = re.sub(r"(?ms)^\[(maps|cards)\].*?(?=^\[|\Z)", "", table).replace('"ada"', f'"{FACE}"', 1)
    table += '\n[maps]\nrelief = 0.002\ntexel = 0.0002\nfolds = ["frown_left", "frown_right"]\n'
    table += "[cards]\nhair = [0, 4]\n"
    (folder / "face.toml").write_text(table)


def still(light: str, aus: dict[int, float]):  # type: ignore[no-untyped-def]
    """What the processor makes of these action units, (h, w, 3) float."""
    import numpy as np

    from realizer.animation.axis import au, axis
    from realizer.animation.frames import AUFrames
    from realizer.animation.pose import poses
    from realizer.face.load import input_names
    from tests.pictures import drawn_here

    row = np.zeros((1, len(axis())), np.float32)
    for number, amount in aus.items():
        row[0, [target.column for target in au(number)]] = amount
    pose = poses(AUFrames(np.zeros(1), row), input_names(FACE))
    return drawn_here(FACE, (STILL, STILL), pose, light=light, backend="onboard")[0].astype(float)


NEXT_PICTURE = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def stage_of(page):  # type: ignore[no-untyped-def]
    """The stage as (h, w, 3) float, square, once the picture stands still."""
    import numpy as np

    last = None
    for _ in range(40):
        page.evaluate(NEXT_PICTURE)
        image = np.asarray(picture(page), float)
        if last is not None and np.array_equal(image, last):
            break
        last = image
    side = (image.shape[1] - image.shape[0]) // 2
    return image[:, side : side + image.shape[0]]


@pytest.fixture(scope="module")
def quiet_page(browser, tmp_path_factory):  # type: ignore[no-untyped-def]
    """The page with all detail, and its stage as high as a still, with the face that has maps."""
    folder = tmp_path_factory.mktemp("faces")
    mapped_face(folder / FACE)
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--no-idle", "--face", FACE]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("REALIZER_FACES", str(folder))
        with serving([*command, "--voice", "silent"]) as address:
            opened = browser.new_page(viewport={"width": 960, "height": 540}, bypass_csp=True)
            opened.set_default_timeout(PATIENCE)
            opened.goto(f"{address}?detail=full")
            style = f"#stage {{ flex: none; width: {STILL + 60}px; height: {STILL}px; min-height: 0 }}"
            opened.add_style_tag(content=style + " .choice, #time { display: none !important }")
            opened.wait_for_function("realizerPage.stage.shownFrames > 0")
            yield opened
            opened.close()


def skin_of(image):  # type: ignore[no-untyped-def]
    """From the brows to the neck, the cheeks at the sides."""
    return image[int(0.30 * STILL) : int(0.78 * STILL), int(0.36 * STILL) : int(0.64 * STILL)]


def test_page_draws_skin_like_stills_in_every_light(quiet_page) -> None:  # type: ignore[no-untyped-def]
    import numpy as np

    from realizer.render.light import presets

    for light in presets():
        quiet_page.evaluate("name => realizerPage.stage.shine(name)", light)
        here, there = stage_of(quiet_page), still(light, {})
        assert np.abs(skin_of(here) - skin_of(there)).mean() < 3, light
        # The backdrop beside the head.
        assert np.abs(here[100:200, 5:40] - there[100:200, 5:40]).mean() < 12, light


@pytest.mark.long
def test_page_draws_folds_like_stills(quiet_page) -> None:  # type: ignore[no-untyped-def]
    import numpy as np

    quiet_page.evaluate("() => realizerPage.stage.shine('portrait')")
    calm = stage_of(quiet_page)
    parts = "".join(
        f'<faceFacs id="f{au}" au="{au}" amount="{amount}" start="0" end="600"/>'
        for au, amount in FROWN.items()
    )
    quiet_page.fill("#document", f'<bml id="frown">{parts}</bml>')
    quiet_page.click("#play")
    quiet_page.wait_for_selector("#log li:has-text('f4 attackPeak')")
    quiet_page.wait_for_function("realizerPage.stage.head.folds.shown")
    here, there = skin_of(stage_of(quiet_page)), skin_of(still("portrait", FROWN))
    assert np.abs(here - there).mean() < 3
    # The folds, which are everywhere on this face, show on a cheek that the brows do not move.
    assert np.abs(here - skin_of(calm))[80:120].mean() > 4


def test_page_carries_the_stream_to_what_is_drawn(quiet_page) -> None:  # type: ignore[no-untyped-def]
    import numpy as np

    from realizer.face.drawn_mesh import drawn_mesh
    from realizer.face.surface import normals

    def head(name: str):  # type: ignore[no-untyped-def]
        return np.reshape(quiet_page.evaluate(f"Array.from(realizerPage.stage.head.{name})"), (-1, 3))

    face, vertices = load_face(FACE), head("vertices").astype(np.float32)
    ups = normals(face, vertices[None])[0]
    mesh = drawn_mesh(face)
    assert head("attributes.position.array") == pytest.approx(mesh.places @ vertices, abs=1e-6)
    # Corners of triangles without area may have any normal.
    assert (np.abs(head("attributes.normal.array") - mesh.ups @ ups).max(axis=1) < 1e-3).mean() > 0.998
    strands, wanted = head("attributes.strand.array"), mesh.strands @ vertices
    assert np.abs(wanted).max() > 0
    assert strands == pytest.approx(wanted, abs=1e-3 * np.abs(wanted).max())


def test_page_without_a_gpu_draws_the_mesh_that_is_streamed(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.stage.shownFrames > 1")
    assert page.evaluate("realizerPage.stage.full") is False
    wanted = len(load_face(page.evaluate("realizerPage.stage.name")).triangles)
    counts = page.evaluate(
        "realizerPage.stage.head.groups.map((g) => (g.holes ? 0 : g.triangles.length / 3))"
    )
    assert 0.9 * wanted < sum(counts) <= wanted


def test_page_changes_the_light(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_selector("#lights button")
    pressed = "#lights button[aria-pressed='true']"
    assert page.locator(pressed).all_text_contents() == ["Portrait"]
    dark = pixel(picture(page), 0.03, 0.5)
    page.click("#lights button:has-text('Daylight')")
    page.wait_for_selector(f"{pressed}:has-text('Daylight')")
    assert page.locator(pressed).count() == 1
    assert sum(pixel(picture(page), 0.03, 0.5)) > sum(dark) + 200


def test_page_changes_the_face(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.stage.shownFrames > 1")
    names = [info.name for info in list_faces()]
    assert page.locator("#faces button").all_text_contents() == [name.capitalize() for name in names]
    mine = page.locator("#faces button[aria-pressed='true']").text_content().lower()
    other = next(name for name in names if name != mine)
    page.click(f"#faces button:has-text('{other.capitalize()}')")
    there = len(load_face(other).vertices)
    page.wait_for_function(f"realizerPage.stage.head?.vertices.length === {3 * there}")
    shown = page.evaluate("realizerPage.stage.shownFrames")
    page.wait_for_function(f"realizerPage.stage.shownFrames > {shown} + 5")


def test_page_shows_a_face_that_another_client_chose(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.stage.shownFrames > 1")
    mine = page.locator("#faces button[aria-pressed='true']").text_content().lower()
    other = next(info.name for info in list_faces() if info.name != mine)
    page.evaluate("(face) => realizerPage.link.ask({ type: 'character', face })", other)
    page.wait_for_selector(f"#faces button[aria-pressed='true']:has-text('{other.capitalize()}')")
    page.wait_for_function(f"realizerPage.stage.name === '{other}'")
    shown = page.evaluate("realizerPage.stage.shownFrames")
    page.wait_for_function(f"realizerPage.stage.shownFrames > {shown} + 5")
    width = float(load_face(other).vertices.max())
    # By the scale of that face, as soon as its own frames are drawn.
    page.wait_for_function(f"Math.abs(Math.max(...realizerPage.stage.head.vertices) - {width}) < 0.01")


def test_page_says_that_the_service_refuses_it(browser) -> None:  # type: ignore[no-untyped-def]
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent"]
    refused = {
        "": "token: wanted",
        "?token=x": "token: wanted",
        "?token=Xk-7&session=a%20b": "session: wanted",
    }
    with serving([*command, "--token", "Xk-7"]) as address:
        for query, reason in refused.items():
            page = browser.new_page(bypass_csp=True)
            page.goto(f"{address}/{query}")
            page.locator("#stage-note", has_text=reason).wait_for(timeout=PATIENCE)
            assert page.locator("#status-text").text_content() == "Refused"
            page.close()


def test_page_shows_a_moving_face(page) -> None:  # type: ignore[no-untyped-def]
    mine = page.locator("#faces button:first-child").text_content().lower()
    page.wait_for_function(f"realizerPage.stage.name === '{mine}' && realizerPage.stage.shownFrames > 5")
    rest = picture(page)
    skin = pixel(rest, 0.5, 0.5)
    assert skin[0] > skin[1] > skin[2], "skin is warmer than the backdrop"
    assert pixel(rest, 0.02, 0.02) != skin
    turned = '<head id="h" lexeme="SHAKE" repetition="9"/>'
    page.fill("#document", f'<bml id="moves">{turned}</bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('h stroke')")
    shown = [picture(page) for _ in range(3)]
    assert len({one.tobytes() for one in (rest, *shown)}) > 2


def test_page_plays_a_typed_document_and_shows_feedback(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.stage.shownFrames > 1")
    page.fill("#document", '<bml id="typed"><faceLexeme id="s" lexeme="SMILE" end="0.8"/></bml>')
    page.press("#document", "Control+Enter")
    page.wait_for_selector("#log li:has-text('typed ends')")
    lines = page.locator("#log li span").all_text_contents()
    wanted = ["typed starts", "s start", "s attackPeak", "s relax", "s end", "typed ends"]
    assert [line for line in lines if line in wanted] == wanted


def test_page_speaks_a_typed_text(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", "Hello **there**.")
    page.wait_for_selector("#problems-text:has-text('No faults')")
    assert page.locator(".cm-lintRange, .cm-lint-marker").count() == 0
    page.click("#play")
    page.wait_for_selector("#log .block:has-text('ends')")
    assert page.locator("#log :is(.warning, .error)").count() == 0


def test_page_reports_a_broken_document_and_goes_on(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="broken"><head')
    page.click("#play")
    page.wait_for_selector("#log .warning")
    page.fill("#document", '<bml id="well"><wait id="w" duration="0.1"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('well ends')")
    assert page.get_attribute("#status", "data-state") == "live"


def test_page_offers_the_examples(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_selector("#gallery button")
    names = page.locator("#gallery button b").all_text_contents()
    assert "Greeting" in names
    page.click("#gallery button:nth-child(2)")
    assert "really" in page.evaluate("realizerPage.editor.text")
    page.wait_for_selector("#gallery button:nth-child(2)[aria-pressed=true]")
    page.fill("#document", '<bml id="own"/>')
    page.wait_for_function("!document.querySelector('#gallery [aria-pressed=true]')")


@pytest.mark.parametrize("width", [1280, 1366, 1920])
def test_page_wraps_feedback_filters_in_whole_rows(page, width) -> None:  # type: ignore[no-untyped-def]
    page.set_viewport_size({"width": width, "height": 800})
    title, clear = (page.locator(f"#log-head {what}").bounding_box() for what in ("h2", "#clear"))
    assert abs(title["y"] + title["height"] / 2 - clear["y"] - clear["height"] / 2) < 2


def test_page_plays_a_document_again_while_it_plays(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="twice"><wait id="w" duration="600"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('twice starts')")
    page.click("#play")
    page.wait_for_selector("#log li:has-text('twice-1 starts')")
    assert page.locator("#log .warning").count() == 0


def test_page_replaces_and_stops_blocks(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="long"><wait id="w" duration="600"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('long starts')")
    page.fill("#document", '<bml id="other"><wait id="w" duration="600"/></bml>')
    page.click("#replace")
    page.wait_for_selector("#log li:has-text('long ends')")
    page.wait_for_selector("#log li:has-text('other starts')")
    page.click("#stop")
    page.wait_for_selector("#log li:has-text('other ends')")


def test_page_plays_speech_and_follows_its_clock(page) -> None:  # type: ignore[no-untyped-def]
    page.fill(
        "#document", '<bml id="talk"><speech id="s"><text>Hello there, how are you?</text></speech></bml>'
    )
    page.click("#play")
    page.wait_for_selector("#log li:has-text('talk starts')")
    page.wait_for_function("realizerPage.sound.playhead() !== null")
    page.wait_for_selector("#log li:has-text('talk ends')")
    assert page.get_attribute("#sound", "aria-pressed") == "true"


def test_page_reconnects_and_shows_missed_feedback(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="kept"><wait id="w" duration="0.3"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('kept starts')")
    closed = """() => new Promise((done) => {
      const status = document.getElementById("status");
      const report = (_, watch) => (watch.disconnect(), done(status.dataset.state));
      new MutationObserver(report).observe(status, { attributes: true });
      realizerPage.link.socket.close();
    })"""
    assert page.evaluate(closed) == "lost"
    page.wait_for_selector('#status[data-state="live"]')
    page.wait_for_selector("#log li:has-text('kept ends')")
    lines = page.locator("#log li span").all_text_contents()
    assert lines.count("kept starts") == lines.count("kept ends") == 1


def test_page_obeys_its_content_policy(browser, address) -> None:  # type: ignore[no-untyped-def]
    opened = browser.new_page()
    opened.set_default_timeout(PATIENCE)
    faults: list[str] = []
    opened.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    opened.goto(address)
    opened.wait_for_selector('#status[data-state="live"]')
    opened.wait_for_selector("#stage-note:empty", state="attached")
    opened.close()
    assert faults == []


def test_page_fits_a_phone(page) -> None:  # type: ignore[no-untyped-def]
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.locator("#play").is_visible()
    for tab in page.locator("#tabs button:visible").all():
        tab.click()
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), tab.text_content()


def test_page_passes_its_token_on(browser) -> None:  # type: ignore[no-untyped-def]
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--token", "a-word"]
    with serving([*command, "--voice", "silent", "--no-idle"]) as address:
        page = browser.new_page(bypass_csp=True)
        page.set_default_timeout(PATIENCE)
        faults: list[str] = []
        page.on("response", lambda answer: answer.status >= 400 and faults.append(answer.url))
        page.goto(f"{address}/?token=a-word")
        page.wait_for_selector('#status[data-state="live"]')
        page.wait_for_selector("#lights button", state="attached")  # the look of the face is there
        page.wait_for_load_state("networkidle")
        page.close()
    assert faults == []


def test_page_asks_again_for_what_a_busy_service_did_not_send(browser, address) -> None:  # type: ignore[no-untyped-def]
    page = browser.new_page(bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    for path in ("**/faces/*", "**/examples.json"):
        page.route(path, lambda route: route.abort(), times=1)
    page.goto(address)
    page.wait_for_function("document.getElementById('stage-note').textContent.includes('trying again')")
    page.wait_for_selector("#lights button")
    assert page.inner_text("#stage-note") == ""
    page.wait_for_selector("#gallery button")
    page.close()
