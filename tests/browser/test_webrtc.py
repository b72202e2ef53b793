"""A session by WebRTC in a real browser: frames come and move, sound comes, and lips keep to it.

`python -m tests.browser.test_webrtc [SIZE]` prints what it measures.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest

pytest.importorskip("aiortc", reason="needs the webrtc extra")

from playwright.sync_api import sync_playwright

from realizer.client import connect
from realizer.protocol.wire import PictureFrame
from realizer.server.http.webrtc import QUALITY
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark
from tests.programs import serving

__all__ = ["browser", "pytestmark"]

Curve = np.ndarray[Any, Any]
RATE = 24000
SETTLING = 8  # s; picture and sound are brought together step by step
BEEP = 0.24  # s
ENOUGH = 8  # pictures a second
STARTS = (0.5, 1.13, 1.71, 2.47, 3.02, 3.83, 4.36, 5.2, 5.71, 6.5, 7.03, 7.9)  # s; irregular
# Of the picture, where an open mouth is dark: left, top, width, height.
MOUTH = (0.4, 0.66, 0.2, 0.14)
WATCH = """(mouth) => {
  const video = document.getElementById("view"), [x, y, w, h] = mouth;
  const canvas = new OffscreenCanvas(32, 24), context = canvas.getContext("2d", { willReadFrequently: true });
  globalThis.seen = []; globalThis.heard = [];
  const frame = (_, { expectedDisplayTime, rtpTimestamp }) => {
    const { videoWidth: W, videoHeight: H } = video;
    context.drawImage(video, x * W, y * H, w * W, h * H, 0, 0, 32, 24);
    const { data } = context.getImageData(0, 0, 32, 24);
    let sum = 0;
    for (let k = 0; k < data.length; k += 4) sum += data[k + 1];
    seen.push([expectedDisplayTime / 1000, sum / (data.length / 4)]);
    video.requestVideoFrameCallback(frame);
  };
  video.requestVideoFrameCallback(frame);
  const sound = new AudioContext(), analyser = new AnalyserNode(sound, { fftSize: 256 });
  sound.createMediaStreamSource(video.srcObject).connect(analyser);
  const samples = new Float32Array(256);
  const receiver = connection.getReceivers().find(({ track }) => track.kind === "audio");
  let device = 0; // s between the track, which the times of its sources are those of, and the loudspeaker
  setInterval(async () => {
    for (const { type, totalPlayoutDelay, totalSamplesCount } of (await connection.getStats()).values())
      if (type === "media-playout" && totalSamplesCount) device = totalPlayoutDelay / totalSamplesCount;
  }, 500);
  setInterval(() => {
    for (const { timestamp, audioLevel } of receiver.getSynchronizationSources())
      heard.push([(timestamp - performance.timeOrigin) / 1000 + device, audioLevel ?? 0]);
    analyser.getFloatTimeDomainData(samples);
    globalThis.loudest = Math.max(globalThis.loudest ?? 0, ...samples.map(Math.abs));
  }, 4);
}"""
# The page keeps its connection to itself.
KEEP = """globalThis.RTCPeerConnection = class extends RTCPeerConnection {
  constructor(...options) { super(...options); globalThis.connection = this; }
};"""


@contextmanager
def application() -> Iterator[str]:
    """The address of a service whose faces do not move by themselves."""
    with serving("--no-idle") as (address, _):
        yield address.replace("ws:", "http:").removesuffix("/ws")


def beeps() -> bytes:
    """Return PCM of the beeps."""
    pcm = np.zeros(int((STARTS[-1] + 1) * RATE))
    time = np.arange(int(BEEP * RATE)) / RATE
    for start in STARTS:
        at = int(start * RATE)
        pcm[at : at + len(time)] = 9000 * np.sin(2 * np.pi * 440 * time)
    return pcm.astype("<i2").tobytes()


def light(picture: PictureFrame) -> float:
    """Return the mean of the green of the mouth."""
    (height, width, _), (x, y, w, h) = picture.pixels.shape, MOUTH
    box = picture.pixels[
        round(y * height) : round((y + h) * height), round(x * width) : round((x + w) * width), 1
    ]
    return float(box.mean())


async def curves(url: str, session: str, size: str) -> tuple[Curve, Curve]:
    """Make a session beep with an opening mouth; return rows of (time, value): the mouth, and the sound."""
    visemes = [pair for start in STARTS for pair in ((start, "aa"), (start + BEEP, "sil"))]
    mouth: list[tuple[float, float]] = []
    sound: list[tuple[float, float]] = []

    async def follow_mouth() -> None:
        # The same options as those of the page: the pictures are the same.
        side = [int(side) for side in size.split("x")]
        async for frame in client.pictures(size=side, quality=QUALITY):
            mouth.append((frame.time, light(frame)))

    async def follow_sound() -> None:
        async for frame in client.sound(rate=8000):
            sound.append((frame.time, float(np.abs(frame.values.astype(float)).max(initial=0))))

    async with connect(url.replace("http", "ws") + f"/ws?session={session}") as client:
        following = [asyncio.create_task(follow_mouth()), asyncio.create_task(follow_sound())]
        await client.say(beeps(), RATE, visemes=visemes)
        for task in following:
            task.cancel()
        await asyncio.gather(*following, return_exceptions=True)
    return np.array(mouth), np.array(sound)


def shift(seen: Curve, truth: Curve, around: float, within: float) -> float:
    """Return by how many seconds what was seen, rows of (time, value), is later than the truth."""
    shifts = np.arange(around - within, around + within, 0.002)

    def likeness(by: float) -> float:
        expected = np.interp(seen[:, 0] - by, *truth.T)
        return float(np.corrcoef(seen[:, 1], expected)[0, 1])

    return float(shifts[np.argmax([likeness(by) for by in shifts])])


def lips_offset(seen: Curve, heard: Curve, mouth: Curve, sound: Curve) -> float:
    """Return by how many seconds the lips are later than the sound."""
    onset = heard[np.argmax(heard[:, 1] > heard[:, 1].max() / 2), 0] - sound[np.argmax(sound[:, 1] > 0), 0]
    by_sound = shift(heard, sound, onset, 0.1)
    span = (by_sound + mouth[0, 0] < seen[:, 0]) & (seen[:, 0] < by_sound + mouth[-1, 0])
    return shift(seen[span], mouth, by_sound, 0.4) - by_sound


@contextmanager
def watched(browser, url: str, session: str, **options: str):  # type: ignore[no-untyped-def]
    """Open the page, and wait until it shows pictures."""
    page = browser.new_page(viewport={"width": 700, "height": 760}, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.add_init_script(KEEP)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(f"{url}/webrtc.html?{urlencode({'session': session, **options})}")
    page.wait_for_selector('#status[data-state="live"]')
    page.evaluate(WATCH, MOUTH)
    page.wait_for_function("seen.length > 30")
    yield page
    page.close()
    assert faults == []


def wait_for_pictures(page, seconds: float) -> None:  # type: ignore[no-untyped-def]
    """Wait until the page has seen pictures of as many further seconds."""
    page.wait_for_function("(until) => seen.at(-1)[0] > until", arg=page.evaluate("seen.at(-1)[0]") + seconds)


def measure(browser, url: str, size: str, shot: str | None = None) -> dict[str, Any]:  # type: ignore[no-untyped-def]
    """Return pictures a second, and the offset of the lips in ms, of pictures of a size."""
    with watched(browser, url, f"m{size}", size=size) as page:
        wait_for_pictures(page, SETTLING)
        with ThreadPoolExecutor(1) as pool:  # playwright has an event loop in this thread
            mouth, sound = pool.submit(asyncio.run, curves(url, f"m{size}", size)).result()
        wait_for_pictures(page, 1.5)
        seen, heard = np.array(page.evaluate("seen")), np.array(page.evaluate("heard"))
        loudest = page.evaluate("loudest")
        if shot is not None:
            page.screenshot(path=shot)
    recent = seen[seen[:, 0] > seen[-1, 0] - 8]
    offset = lips_offset(seen, heard, mouth, sound)
    return {
        "size": size,
        "pictures_per_second": len(recent) / 8,
        "lips_late_ms": round(1000 * offset),
        "change_of_light": float(np.ptp(recent[:, 1])),
        "loudest": loudest,
    }


@pytest.mark.long
def test_page_plays_a_session_by_webrtc_with_lips_and_sound(browser) -> None:  # type: ignore[no-untyped-def]
    with application() as url:
        found = measure(browser, url, "96x96")
    assert found["pictures_per_second"] > 2
    assert found["change_of_light"] > 5  # the mouth opens
    assert found["loudest"] > 0.1
    # The timestamps are exact, see test_tracks; what is left is the browser's, which few busy cores delay.
    if found["pictures_per_second"] < ENOUGH:
        pytest.skip(f"too busy to measure the lips: {found['pictures_per_second']:g} pictures a second")
    assert abs(found["lips_late_ms"]) < 200  # one of thirteen runs beside heavy work had 122


def test_page_says_what_is_wrong_with_an_option(browser) -> None:  # type: ignore[no-untyped-def]
    with application() as url:
        page = browser.new_page()
        page.goto(f"{url}/webrtc.html?camera=nowhere")
        page.wait_for_selector('#status[data-state="lost"]')
        assert page.text_content("#fault").startswith("camera: wanted one of")
        page.close()


if __name__ == "__main__":
    with sync_playwright() as playwright, application() as url:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for size in sys.argv[1:] or ["128x128"]:
            print(measure(opened, url, size, f"webrtc-{size}.png"))
        opened.close()
