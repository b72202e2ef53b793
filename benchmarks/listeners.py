"""Runs many clients of a service in one thread with plain sockets, and measures what they receive."""

from __future__ import annotations

import json
import random
import re
import select
import socket
import struct
import time
from collections import Counter
from dataclasses import dataclass, field
from heapq import heappop, heappush
from urllib.parse import urlsplit

import numpy as np
from packets import encode_text, handshake, take_messages

__all__ = ["FPS", "POSIX", "ClientGroup", "open_peer"]

FPS = 25
UNMEASURED = 0.5  # s before a measurement
PING, PONG = 9, 10
SCENE = {"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}}
BODY = (
    '<head id="n" lexeme="NOD" start="0.5"/><head id="m" lexeme="SHAKE" start="n:end+2"/>'
    '<faceLexeme id="f" lexeme="SMILE" start="0.2" end="6"/>'
    '<faceLexeme id="w" lexeme="RAISE_BROWS" start="n:stroke" end="n:end+1"/>'
    '<gaze id="g" target="cup" start="1" end="3"/><realizer:emotion xmlns:realizer="urn:bml-realizer:1" '
    'id="e" name="joy" start="m:start" end="m:end+1"/>'
)
# Bytes of a frame of 68 FAPs with its WebSocket header. Number and time follow four bytes of the frame.
FRAME = 292
HEADER, ROW, FLUSH = 16, 272, 0x100
NUMBER = struct.Struct("<Id")
POSIX = re.compile(rb'globalTime="([0-9.]+)".*?posixTime="([0-9.]+)"')


@dataclass(eq=False)
class Peer:
    """One connection."""

    socket: socket.socket
    data: bytearray = field(default_factory=bytearray)
    zero: float | None = None  # POSIX time of the session's second 0
    sent: dict[str, float] = field(default_factory=dict)
    documents: int = 0
    newest: int | None = None  # number of its newest frame


def open_peer(url: str, session: str, plays: bool, ahead: float = 0.0) -> Peer:
    """Open a connection, and subscribe to frames if it plays."""
    host, _, port = urlsplit(url).netloc.rpartition(":")
    peer = socket.create_connection((host, int(port)), 20)
    peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    rest = handshake(peer, session)
    if plays:
        peer.sendall(encode_text(json.dumps(SCENE)))
        subscribe = {"type": "subscribe", "stream": "fap", "fps": FPS, "ahead": ahead}
        peer.sendall(encode_text(json.dumps(subscribe)))
    peer.setblocking(False)
    return Peer(peer, rest)


class ClientGroup:
    """Clients with a session each, which receive frames and send documents.

    Args:
        url: address of the service.
        sessions: number of clients.
        plays: whether clients send documents, or only listen to a server whose frames have POSIX times.
        every: seconds between two documents of a session; a document plays for six.
        ahead: seconds that frames are sent before their time.
    """

    def __init__(self, url: str, sessions: int, plays: bool, every: float = 10.0, ahead: float = 0.0) -> None:
        chance = random.Random(0)
        self._poll = select.epoll()
        self._peers: dict[int, Peer] = {}
        self._due: list[tuple[float, int]] = []  # (time of the next document, socket)
        self._plays = plays
        self._every = every
        self._late: list[float] = []
        self._answers: list[float] = []
        self._frames = self._missing = 0
        self._refused = 0  # sessions
        self._ahead = ahead
        # Rows that came early by at least half of `ahead`, and after their time; rows that replace others,
        # and those of them after their time; messages with such rows.
        self._rows = Counter[str]()
        for k in range(sessions):
            try:
                peer = open_peer(url, f"load-{k}", plays, ahead)
            except ConnectionRefusedError:  # the service is overloaded
                self._refused = sessions - k
                break
            if not plays:
                peer.zero = 0.0
            self._peers[peer.socket.fileno()] = peer
            self._poll.register(peer.socket, select.EPOLLIN)
            if plays:
                heappush(self._due, (time.time() + every * chance.random(), peer.socket.fileno()))

    def listen(self, seconds: float) -> dict[str, float]:
        """Play and listen for some seconds; return counts, and lateness and response times in ms."""
        self._run(UNMEASURED)  # frames that waited in the sockets do not count
        self._frames = self._missing = 0
        self._rows.clear()
        self._late.clear()
        self._answers.clear()
        begin, used = time.time(), time.process_time()
        self._run(seconds)
        late, answers = self._late or [0.0], self._answers or [0.0]
        return {
            "frames": self._frames,
            "expected": len(self._peers) * seconds * FPS,
            "missing": self._missing,
            "refused": self._refused,
            **{name: 1e3 * float(np.percentile(late, part)) for name, part in PERCENTILES.items()},
            **{name: self._rows[name] for name in COUNTED},
            "timed": len(self._late),
            "answers": len(self._answers),
            **{f"answer_{n}": 1e3 * float(np.percentile(answers, part)) for n, part in PERCENTILES.items()},
            "load": (time.process_time() - used) / (time.time() - begin),
        }

    def _run(self, seconds: float) -> None:
        end = time.time() + seconds
        while (now := time.time()) < end:
            for number, _ in self._poll.poll(0.002):
                self._read(self._peers[number])
            while self._due and self._due[0][0] <= now:
                self._send()

    def _read(self, peer: Peer) -> None:
        try:
            data = peer.socket.recv(8192)
        except BlockingIOError:
            return
        received = time.time()
        if len(data) == FRAME and not peer.data:  # the usual case: one complete frame
            self._frame(peer, data, 8, received)
            return
        peer.data += data
        for code, payload in take_messages(peer.data):
            if code == PING:  # clients that do not answer are disconnected
                peer.socket.sendall(bytes([0x80 | PONG, 0x80 | len(payload)]) + bytes(4) + payload)
            elif code == 2 and payload[0] == 1 and self._ahead:
                self._batch(peer, payload, received)
            elif code == 2 and payload[0] == 1:
                self._frame(peer, payload, 4, received)
            elif code == 1 and payload[:1] == b"<":
                if (found := POSIX.search(payload)) is not None:
                    peer.zero = float(found[2]) / 1e3 - float(found[1])
                for name in [name for name in peer.sent if f'"{name}"'.encode() in payload]:
                    self._answers.append(received - peer.sent.pop(name))

    def _frame(self, peer: Peer, data: bytes, at: int, received: float) -> None:
        number, instant = NUMBER.unpack_from(data, at)
        self._frames += 1
        if peer.newest is not None:
            self._missing += number - peer.newest - 1
        peer.newest = number
        if peer.zero is not None:
            self._late.append(received - instant - peer.zero)

    def _batch(self, peer: Peer, data: bytes, received: float) -> None:
        """Count the rows of a message that were sent ahead."""
        first, instant = NUMBER.unpack_from(data, 4)
        newest = first - 1 if peer.newest is None else peer.newest
        self._missing += max(0, first - newest - 1)
        self._rows["taken_back"] += int.from_bytes(data[2:4], "little") & FLUSH > 0
        for number in range(first, first + (len(data) - HEADER) // ROW):
            is_new = number > newest
            self._frames += is_new
            late = 0.0 if peer.zero is None else received - instant - (number - first) / FPS - peer.zero
            if is_new and peer.zero is not None:
                self._late.append(late)
                self._rows["early"] += late <= -self._ahead / 2
                self._rows["after"] += late > 0
            self._rows["replaced"] += not is_new
            self._rows["replaced_after"] += not is_new and late > 0
        peer.newest = max(newest, number)

    def _send(self) -> None:
        instant, number = heappop(self._due)
        heappush(self._due, (instant + self._every, number))
        peer = self._peers[number]
        name = f"b{peer.documents}"
        peer.documents += 1
        peer.sent[name] = time.time()
        peer.socket.sendall(encode_text(f'<bml id="{name}" composition="REPLACE">{BODY}</bml>'))


COUNTED = ("early", "after", "replaced", "replaced_after", "taken_back")
PERCENTILES = {"p50": 50, "p99": 99, "most": 100}
