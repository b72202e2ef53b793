"""Sessions by WebRTC: the picture and the sound of a face for a peer, such as a browser."""

import asyncio
import contextlib
import json
import logging
import os
from collections.abc import Mapping
from contextlib import AsyncExitStack
from http import HTTPStatus
from typing import Any

from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription

from realizer.core.json_reader import parse_json
from realizer.protocol.wire import unpack
from realizer.server.http.openapi import VIDEO
from realizer.server.http.tracks import RATE, PictureTrack, Playout, SoundTrack
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError

log = logging.getLogger(__name__)

PATIENCE = 30.0  # s; a peer that is not connected by then is given up
ANSWER = 10.0  # s; for the session to load a face
QUALITY = 95  # of the JPEG between the renderer and the encoder
# Encoding one peer's pictures takes about a quarter of a processor.
MOST_PEERS = 4 * (os.cpu_count() or 1)


class Peer:
    """An `Outbound` that passes the frames of a session on to the tracks of a WebRTC connection.

    Args:
        seconds_left: until its token expires; None: it does not.

    Attributes:
        number: of its connection to the session.
    """

    number = 0
    unsent_bytes = 0

    def __init__(self, session: str, seconds_left: float | None = None) -> None:
        self.session = session
        self.seconds_left = seconds_left
        self.tracks: dict[str, Any] = {}
        self.replies: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.ended = asyncio.Event()

    def send(self, data: str | bytes) -> None:
        if isinstance(data, bytes):
            frame = unpack(data)
            if (track := self.tracks.get(frame.stream)) is not None:
                track.put(frame)
        elif data.startswith("{") and not self.tracks:
            self.replies.put_nowait(json.loads(data))
        elif data.startswith("{") and (reply := json.loads(data))["type"] == "error":
            log.warning("a WebRTC peer is sent no more pictures: %s", reply["message"])

    def disconnect(self, code: int, reason: str) -> None:
        self.ended.set()


class Peers:
    """The WebRTC connections of an application."""

    def __init__(self, sessions: SessionHost) -> None:
        self._sessions = sessions
        self._serving: dict[Peer, asyncio.Task[None]] = {}

    def check_room(self) -> None:
        """Raise JoinError (503) if there are too many peers."""
        if len(self._serving) >= MOST_PEERS:
            words = f"{MOST_PEERS} WebRTC peers are connected: wanted fewer"
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words)

    async def answer(
        self, offer: str, options: Mapping[str, str], peer: Peer, entered: AsyncExitStack
    ) -> str:
        """Return the SDP that answers an offer, and serve the peer until it goes away.

        Args:
            options: of the stream `video`, as in a query.
            entered: what ends with the connection, such as the peer's place in the session.

        Raises:
            JoinError: 400, the offer or an option is wrong; 503, the session does not answer.
        """
        connection = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        entered.push_async_callback(connection.close)
        try:
            await connection.setRemoteDescription(RTCSessionDescription(offer, "offer"))
        except Exception as error:  # the library raises whatever its parser meets
            raise JoinError(HTTPStatus.BAD_REQUEST, f"offer: wanted SDP, got what has {error!r}") from None
        kinds = {each.kind for each in connection.getTransceivers()}
        if not kinds:
            words = "offer: wanted audio or video that is received, got neither"
            raise JoinError(HTTPStatus.BAD_REQUEST, words)
        opened = await self._subscribe(peer, kinds, video_fields(options))
        playout = Playout(opened, asyncio.get_running_loop().time())
        if "video" in kinds:
            peer.tracks["video"] = PictureTrack(playout)
        if "audio" in kinds:
            peer.tracks["audio"] = SoundTrack(playout)
        for track in peer.tracks.values():
            connection.addTrack(track)
        await connection.setLocalDescription(await connection.createAnswer())
        serving = asyncio.create_task(self._serve(connection, peer, entered.pop_all()))
        self._serving[peer] = serving
        serving.add_done_callback(lambda _: self._serving.pop(peer))
        return str(connection.localDescription.sdp)

    def end(self, session: str, number: int) -> bool:
        """Disconnect a peer. Return False if the session has none of that number."""
        found = [peer for peer in self._serving if (peer.session, peer.number) == (session, number)]
        for peer in found:
            peer.ended.set()
        return bool(found)

    async def close(self) -> None:
        """Disconnect all peers."""
        for peer in self._serving:
            peer.ended.set()
        await asyncio.gather(*self._serving.values(), return_exceptions=True)

    async def _subscribe(self, peer: Peer, kinds: set[str], video: dict[str, Any]) -> float:
        """Subscribe to the streams that a peer wants; return when the session's clock was at 0."""
        wanted: list[dict[str, Any]] = [{"type": "unsubscribe", "stream": "feedback"}]
        wanted += [{"type": "subscribe", "stream": "audio", "rate": RATE}] if "audio" in kinds else []
        wanted += [video] if "video" in kinds else []
        for message in wanted:
            self._sessions.receive(peer.number, json.dumps(message))
        opened = 0.0
        for _ in kinds & {"audio", "video"}:
            try:
                async with asyncio.timeout(ANSWER):
                    while (reply := await peer.replies.get())["type"] not in ("subscribed", "error"):
                        pass
            except TimeoutError:
                words = f"the session has not answered for {ANSWER:g} s: wanted one that is not busy"
                raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words) from None
            if reply["type"] == "error":
                where = (reply.get("where") or "").removeprefix("subscribe.")
                raise JoinError(HTTPStatus.BAD_REQUEST, f"{where}: {reply['message']}".removeprefix(": "))
            opened = asyncio.get_running_loop().time() - reply["frame"] / reply["fps"]
        return opened

    async def _serve(self, connection: RTCPeerConnection, peer: Peer, entered: AsyncExitStack) -> None:
        """Keep what a peer has entered until it goes away, or is disconnected."""
        began = asyncio.get_running_loop().time()

        @connection.on("connectionstatechange")
        def changed() -> None:
            if connection.connectionState == "connected":
                limit.reschedule(None if peer.seconds_left is None else began + peer.seconds_left)
            elif connection.connectionState in ("failed", "closed"):
                peer.ended.set()

        async with entered:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(PATIENCE) as limit:
                    await peer.ended.wait()


def offer_of(body: bytes) -> tuple[str, bool]:
    """Return the SDP of an offer, and whether the body is JSON, as that of a browser's RTCSessionDescription.

    Raises:
        JoinError: 400, the body is neither.
    """
    text = body.decode("utf-8", "replace").strip()
    if not text.startswith("{"):
        return text + "\r\n", False
    with contextlib.suppress(ValueError):
        offer = parse_json(text)
        if offer.get("type") == "offer" and isinstance(offer.get("sdp"), str):
            return offer["sdp"], True
    words = f'offer: wanted SDP, or {{"type": "offer", "sdp": "..."}}, got {text[:80]!r}'
    raise JoinError(HTTPStatus.BAD_REQUEST, words)


def video_fields(options: Mapping[str, str]) -> dict[str, Any]:
    """Return the message that subscribes to pictures with the options of a query.

    Raises:
        JoinError: 400, an option is unknown or has a wrong form.
    """
    fields: dict[str, Any] = {name: value for name, value in options.items() if name != "token"}
    for name, value in fields.items():
        if name not in VIDEO:
            raise JoinError(HTTPStatus.BAD_REQUEST, f"wanted one of {', '.join(VIDEO)}, got {name[:80]!r}")
        try:
            if name == "size":
                width, height = value.split("x")
                fields[name] = [int(width), int(height)]
            elif name == "fps":
                fields[name] = float(value)
        except ValueError:
            wanted = "WIDTHxHEIGHT in pixels" if name == "size" else "a number"
            raise JoinError(HTTPStatus.BAD_REQUEST, f"{name}: wanted {wanted}, got {value[:80]!r}") from None
    return {"type": "subscribe", "stream": "video", "quality": QUALITY, **fields}
