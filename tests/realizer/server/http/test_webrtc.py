"""Sessions by WebRTC, with aiortc as the peer."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable, Iterator
from typing import Any

import numpy as np
import pytest

pytest.importorskip("aiortc", reason="needs the webrtc extra")

from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

from realizer.client import connect
from realizer.server.http import webrtc
from realizer.server.http.webrtc import offer_of, video_fields
from realizer.server.runtime.session_registry import JoinError
from tests.realizer.server.http.conftest import LIMIT, Served
from tests.waiting import wait_for

RATE = 16000


@pytest.fixture(scope="module")
def app(open_service) -> Iterator[Served]:
    with open_service(idle=False) as served:
        yield served


def connections(app: Served) -> int:
    return int(json.loads(app("GET", "/healthz")[2])["connections"])


def with_peer(
    app: Served, path: str, kinds: tuple[str, ...], act: Callable[[RTCPeerConnection], Awaitable[Any]]
) -> Any:
    """Connect a peer that receives such tracks, and return the result of `act`."""

    async def run() -> Any:
        peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        try:
            for kind in kinds:
                peer.addTransceiver(kind, "recvonly")
            await peer.setLocalDescription(await peer.createOffer())
            offer = {"type": "offer", "sdp": peer.localDescription.sdp}
            status, _, body = await asyncio.to_thread(app, "POST", path, json.dumps(offer))
            if status != 200:
                return status, json.loads(body)["error"]
            await peer.setRemoteDescription(RTCSessionDescription(**json.loads(body)))
            async with asyncio.timeout(LIMIT):
                return await act(peer)
        finally:
            await peer.close()

    return asyncio.run(run())


def track(peer: RTCPeerConnection, kind: str) -> Any:
    return next(each.receiver.track for each in peer.getTransceivers() if each.kind == kind)


def refusal(app: Served, path: str, kinds: tuple[str, ...] = ("video",)) -> tuple[int, str]:
    return with_peer(app, path, kinds, lambda peer: asyncio.sleep(0))


def wait_until_none_is_left(app: Served) -> None:
    asyncio.run(wait_for(lambda: connections(app) == 0))


def test_webrtc_sends_the_sound_of_a_session(app) -> None:
    pcm = (8000 * np.sin(np.arange(RATE) * 0.2)).astype("<i2").tobytes()

    async def act(peer: RTCPeerConnection) -> int:
        heard, sound = 0, track(peer, "audio")
        async with connect(app.url.replace("http", "ws") + "/ws?session=sound") as client:
            saying = asyncio.create_task(client.say(pcm, RATE))
            while heard < 40:
                heard += int(np.abs((await sound.recv()).to_ndarray().astype(int)).max() > 2000)
            await saying
        return heard

    assert with_peer(app, "/sessions/sound/webrtc", ("audio",), act) == 40
    wait_until_none_is_left(app)


@pytest.mark.gl
@pytest.mark.slow
def test_webrtc_sends_pictures_that_move(app) -> None:
    async def act(peer: RTCPeerConnection) -> tuple[int, int, float]:
        pictures = track(peer, "video")
        first = (await pictures.recv()).to_ndarray(format="gray")
        nod = '<bml id="a"><head id="n" lexeme="NOD" amount="1" start="0" end="4"/></bml>'
        await asyncio.to_thread(app, "POST", "/sessions/nod/bml", nod)
        most = 0.0
        while most < 3:
            moved = (await pictures.recv()).to_ndarray(format="gray")
            most = max(most, float(np.abs(moved.astype(float) - first).mean()))
        return (*first.shape, most)

    height, width, moved = with_peer(app, "/sessions/nod/webrtc?size=160x128&fps=10", ("video", "audio"), act)
    assert (height, width, moved >= 3) == (128, 160, True)


def test_webrtc_answers_sdp_by_sdp_and_frees_a_peer_that_is_deleted(app) -> None:
    async def offered() -> str:
        peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        peer.addTransceiver("audio", "recvonly")
        await peer.setLocalDescription(await peer.createOffer())
        sdp = peer.localDescription.sdp
        await peer.close()
        return str(sdp)

    sdp = asyncio.run(offered())
    wait_until_none_is_left(app)  # of other tests
    status, headers, body = app("POST", "/sessions/w/webrtc", sdp, **{"Content-Type": "application/sdp"})
    headers = {name.lower(): value for name, value in headers.items()}
    assert (status, headers["content-type"], body[:4]) == (201, "application/sdp", b"v=0\r")
    assert connections(app) == 1
    place = headers["location"]
    assert app.error("DELETE", place.replace("/w/", "/v/"))[0] == 404
    assert app("DELETE", place)[0] == 204
    wait_until_none_is_left(app)
    assert app.error("DELETE", place)[0] == 404


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("size=5", "size: "),
        ("size=9000x9000", "size: wanted sides"),
        ("fps=x", "fps: wanted a number"),
        ("camera=nowhere", "camera: wanted one of"),
        ("colour=red", "wanted one of character, size"),
    ],
)
def test_webrtc_refuses_wrong_options_and_keeps_no_connection(app, query, words) -> None:
    status, got = refusal(app, f"/sessions/s/webrtc?{query}")
    assert (status, got[: len(words)]) == (400, words)
    wait_until_none_is_left(app)


def test_webrtc_refuses_offers_that_are_none(app) -> None:
    for body in ("hello", '{"type": "answer", "sdp": ""}', '{"type": "offer"}', "v=0"):
        status, words = app.error("POST", "/sessions/s/webrtc", body)
        assert (status, words[:6]) == (400, "offer:")
    assert app.error("POST", "/sessions/a%20b/webrtc", "v=0")[0] == 400


def test_webrtc_refuses_more_peers_than_it_can_encode(app, monkeypatch) -> None:
    monkeypatch.setattr(webrtc, "MOST_PEERS", 0)
    assert refusal(app, "/sessions/s/webrtc") == (503, "0 WebRTC peers are connected: wanted fewer")


def test_webrtc_counts_the_connections_of_an_address(open_service) -> None:
    with open_service(max_connections=1) as app:

        async def act(peer: RTCPeerConnection) -> tuple[int, str]:
            return await asyncio.to_thread(app.error, "POST", "/sessions/s/webrtc", "v=0")

        status, words = with_peer(app, "/sessions/s/webrtc", ("audio",), act)
        assert (status, words[:18]) == (429, "1 connections from")


def test_webrtc_needs_the_token_of_the_service(open_service) -> None:
    with open_service(token="secret") as app:
        assert refusal(app, "/sessions/s/webrtc")[0] == 401
        assert app("GET", "/webrtc.html")[0] in (200, 404)  # the page, if it was bundled, is public
        heard = with_peer(
            app, "/sessions/s/webrtc?token=secret", ("audio",), lambda peer: track(peer, "audio").recv()
        )
        assert heard.sample_rate == 48000


def test_webrtc_gives_up_a_peer_that_never_connects(open_service, monkeypatch) -> None:
    monkeypatch.setattr(webrtc, "PATIENCE", 0.05)
    with open_service() as app:
        path = "/sessions/s/webrtc"
        assert asyncio.run(_offer_and_leave(app, path)) == 201
        wait_until_none_is_left(app)


async def _offer_and_leave(app: Served, path: str) -> int:
    peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
    peer.addTransceiver("audio", "recvonly")
    await peer.setLocalDescription(await peer.createOffer())
    status, _, _ = await asyncio.to_thread(app, "POST", path, peer.localDescription.sdp)
    await peer.close()
    return status


def test_offer_of_reads_json_and_sdp() -> None:
    assert offer_of(b'{"type": "offer", "sdp": "v=0"}') == ("v=0", True)
    assert offer_of(b"v=0\r\n") == ("v=0\r\n", False)


def test_video_fields_are_those_of_the_stream() -> None:
    fields = video_fields({"size": "320x240", "fps": "12.5", "token": "t", "camera": "front"})
    assert fields["size"] == [320, 240]
    assert (fields["fps"], fields["camera"], "token" in fields) == (12.5, "front", False)
    with pytest.raises(JoinError, match="size: wanted WIDTHxHEIGHT"):
        video_fields({"size": "wide"})
