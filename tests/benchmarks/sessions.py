"""Prints how many sessions one service plays at once: lateness, processor time, memory.

Run: python tests/benchmarks/sessions.py [--sessions 1000] [--seconds 20] [--floor] [serve's own options]

Each session is a WebSocket of its own that gets 25 FAP frames a second and plays documents of head, face,
gaze and idle motion, one every 10 s. The client is a process of its own on plain sockets, so that it costs
little. `--floor` runs a server beside it that does nothing but send as many bytes as often (with the package
websockets), which no service can be better than. Noise is how late this machine wakes a process that does
nothing else.
"""

from __future__ import annotations

import argparse
import asyncio
import base64
import json
import os
import random
import re
import resource
import select
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from heapq import heappop, heappush
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

FPS = 25
EVERY = 10.0  # s between two documents of a session
SCENE = {"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}}
BODY = (
    '<head id="n" lexeme="NOD" start="0.5"/><head id="m" lexeme="SHAKE" start="n:end+2"/>'
    '<faceLexeme id="f" lexeme="SMILE" start="0.2" end="6"/>'
    '<faceLexeme id="w" lexeme="RAISE_BROWS" start="n:stroke" end="n:end+1"/>'
    '<gaze id="g" target="cup" start="1" end="3"/><realizer:emotion xmlns:realizer="urn:bml-realizer:1" '
    'id="e" name="joy" start="m:start" end="m:end+1"/>'
)
# Bytes of a frame of 68 FAPs with its WebSocket header; its number and time stand behind four more.
FRAME = 292
NUMBER = struct.Struct("<Id")
POSIX = re.compile(rb'globalTime="([0-9.]+)".*?posixTime="([0-9.]+)"')


@dataclass(eq=False)
class Peer:
    """One connection of the client."""

    socket: socket.socket
    data: bytearray = field(default_factory=bytearray)
    zero: float | None = None  # posix time of its session's 0
    sent: dict[str, float] = field(default_factory=dict)
    documents: int = 0
    frames: list[tuple[float, float]] = field(default_factory=list)  # (time on its clock, posix when it came)
    numbers: list[int] = field(default_factory=list)


def masked(text: str) -> bytes:
    """A WebSocket text message as a client sends it; the mask is 0, which changes nothing."""
    data = text.encode()
    head = bytes([0x81, 0x80 | len(data)]) if len(data) < 126 else struct.pack(">BBH", 0x81, 0xFE, len(data))
    return head + bytes(4) + data


def messages(data: bytearray) -> Iterator[tuple[int, bytes]]:
    """(opcode, payload) of all that have come whole; they are taken out of `data`."""
    at = 0
    while len(data) >= at + 2:
        size, head = data[at + 1] & 0x7F, 2
        if size == 126:
            if len(data) < at + 4:
                break
            size, head = struct.unpack_from(">H", data, at + 2)[0], 4
        elif size == 127:
            if len(data) < at + 10:
                break
            size, head = struct.unpack_from(">Q", data, at + 2)[0], 10
        if len(data) < at + head + size:
            break
        yield data[at] & 0x0F, bytes(data[at + head : at + head + size])
        at += head + size
    del data[:at]


def joined(url: str, session: str, plays: bool) -> Peer:
    """A connection that has opened and asked for frames."""
    parts = urlsplit(url)
    host, _, port = parts.netloc.rpartition(":")
    peer = socket.create_connection((host, int(port)), 20)
    peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    key = base64.b64encode(os.urandom(16)).decode()
    peer.sendall(
        f"GET /ws?session={session} HTTP/1.1\r\nHost: {parts.netloc}\r\nUpgrade: websocket\r\n"
        f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    data = bytearray()
    while b"\r\n\r\n" not in data:
        data += peer.recv(4096)
    head, _, rest = bytes(data).partition(b"\r\n\r\n")
    assert b" 101 " in head.split(b"\r\n")[0], head
    if plays:
        peer.sendall(masked(json.dumps(SCENE)))
        peer.sendall(masked(json.dumps({"type": "subscribe", "stream": "fap", "fps": FPS})))
    peer.setblocking(False)
    return Peer(peer, bytearray(rest))


def load(url: str, sessions: int, seconds: float, warm: float, plays: bool) -> dict[str, float]:
    """Connect, play, listen; what came, of the time after `warm`."""
    chance = random.Random(0)
    poll = select.epoll()
    peers: dict[int, Peer] = {}
    due: list[tuple[float, int]] = []  # when who sends its next document
    for k in range(sessions):
        peer = joined(url, f"load-{k}", plays)
        peers[peer.socket.fileno()] = peer
        poll.register(peer.socket, select.EPOLLIN)
        if plays:
            heappush(due, (time.time() + EVERY * chance.random(), peer.socket.fileno()))
    measured = time.time() + warm
    answers: list[float] = []
    quiet = True
    while (now := time.time()) < measured + seconds:
        if quiet and now >= measured:
            quiet = False
            begun, used = now, time.process_time()
            print("measuring", flush=True)
        for number, _ in poll.poll(0.002):
            peer = peers[number]
            try:
                data = peer.socket.recv(8192)
            except BlockingIOError:
                continue
            came = time.time()
            if len(data) == FRAME and not peer.data:  # nearly always: one frame, whole
                if came >= measured:
                    number, at = NUMBER.unpack_from(data, 8)
                    peer.frames.append((at, came))
                    peer.numbers.append(number)
                continue
            peer.data += data
            for code, payload in messages(peer.data):
                if code == 2 and payload[0] == 1:
                    if came >= measured:
                        number, at = NUMBER.unpack_from(payload, 4)
                        peer.frames.append((at, came))
                        peer.numbers.append(number)
                elif code == 1 and payload[:1] == b"<":
                    if (found := POSIX.search(payload)) is not None:
                        peer.zero = float(found[2]) / 1e3 - float(found[1])
                    for name in [name for name in peer.sent if f'"{name}"'.encode() in payload]:
                        waited = came - peer.sent.pop(name)
                        if came >= measured:
                            answers.append(waited)
        while due and due[0][0] <= now:
            when, number = heappop(due)
            peer = peers[number]
            name = f"b{peer.documents}"
            peer.documents += 1
            heappush(due, (when + EVERY, number))
            peer.sent[name] = time.time()
            peer.socket.sendall(masked(f'<bml id="{name}" composition="REPLACE">{BODY}</bml>'))
    zeros = {peer: 0.0 if not plays else peer.zero for peer in peers.values()}
    late = [came - at - zero for peer, zero in zeros.items() if zero is not None for at, came in peer.frames]
    gaps = sum(p.numbers[-1] - p.numbers[0] + 1 - len(p.numbers) for p in peers.values() if p.numbers)
    return {
        "frames": sum(len(peer.frames) for peer in zeros),
        "expected": sessions * seconds * FPS,
        "missing": gaps,
        **{name: 1e3 * float(np.percentile(late, part)) for name, part in PARTS.items()},
        "answers": len(answers),
        **{f"answer_{n}": 1e3 * float(np.percentile(answers or [0.0], part)) for n, part in PARTS.items()},
        "load": (time.process_time() - used) / (time.time() - begun),
    }


PARTS = {"p50": 50, "p99": 99, "most": 100}


def noise(seconds: float = 3.0) -> tuple[float, float]:
    """How late a process is woken that sleeps 5 ms at a time: median and p99, ms."""
    late = []
    end = time.perf_counter() + seconds
    while (begin := time.perf_counter()) < end:
        time.sleep(0.005)
        late.append(time.perf_counter() - begin - 0.005)
    return 1e3 * float(np.percentile(late, 50)), 1e3 * float(np.percentile(late, 99))


def processes(parent: int) -> list[int]:
    """A process and its children's, which are workers; not those it has put a voice in."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    names = {int(c): Path(f"/proc/{c}/cmdline").read_text() for c in children}
    return [parent, *(c for c, name in names.items() if "serve" in name or "spawn_main" in name)]


def spent(parent: int) -> float:
    """Processor seconds."""
    total = 0.0
    for process in processes(parent):
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return total


def resident(parent: int) -> float:
    """MB."""
    total = 0.0
    for process in processes(parent):
        status = Path(f"/proc/{process}/status").read_text()
        total += int(status.partition("VmRSS:")[2].split()[0]) / 1024
    return total


@contextmanager
def served(command: list[str]) -> Iterator[tuple[str, int]]:
    """The address and the process of a service that ends with the block."""
    service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert service.stdout is not None
    try:
        yield service.stdout.readline().split()[2].rstrip(","), service.pid
    finally:
        service.terminate()
        service.wait(30)


def floor() -> None:
    """A server that sends 288 bytes 25 times a second, each connection at times of its own."""
    from websockets.asyncio.server import ServerConnection, broadcast, serve

    async def handle(connection: ServerConnection) -> None:
        loop, zero = asyncio.get_running_loop(), time.time()
        begun = loop.time()

        def send(k: int) -> None:
            broadcast((connection,), struct.pack("<BBHId", 1, 1, 0, k, zero + k / FPS) + bytes(272))
            if connection.close_code is None:
                loop.call_at(begun + (k + 1) / FPS, send, k + 1)

        send(0)
        await connection.wait_closed()

    async def run() -> None:
        async with serve(handle, "127.0.0.1", 0, compression=None) as server:
            print(f"listening on ws://127.0.0.1:{server.sockets[0].getsockname()[1]}/ws", flush=True)
            await asyncio.get_running_loop().create_future()

    asyncio.run(run())


def measure(name: str, command: list[str], arguments: argparse.Namespace, plays: bool) -> None:
    with served(command) as (url, service):
        me = [sys.executable, __file__, "--load", url, "--sessions", str(arguments.sessions)]
        me += ["--seconds", str(arguments.seconds), "--warm", str(arguments.warm)]
        before = resident(service)
        client = subprocess.Popen([*me, *([] if plays else ["--floor"])], stdout=subprocess.PIPE, text=True)
        assert client.stdout is not None
        assert client.stdout.readline().strip() == "measuring"
        begun, used = time.time(), spent(service)
        told = json.loads(client.stdout.readline())
        used, memory = spent(service) - used, resident(service) - before
        took = time.time() - begun
        client.wait()
    print(
        f"{name}: {arguments.sessions} sessions, {told['frames']} frames of {told['expected']:.0f}, "
        f"{told['missing']} missing\n"
        f"  lateness ms     p50 {told['p50']:6.2f}  p99 {told['p99']:6.2f}  most {told['most']:6.1f}\n"
        f"  processor       {used / took:5.0%} of a core, {1e6 * used / max(told['frames'], 1):5.1f} us a"
        f" frame (the client {told['load']:.0%})\n"
        f"  memory          {memory:5.0f} MB more than without sessions"
    )
    if plays:
        print(
            f"  first feedback  p50 {told['answer_p50']:6.2f}  p99 {told['answer_p99']:6.2f} ms"
            f" of {told['answers']:.0f} documents"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sessions", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--warm", type=float, default=5.0, help="seconds before it is measured")
    parser.add_argument(
        "--floor", action="store_true", help="a plain fan-out of package websockets beside it"
    )
    parser.add_argument("--load", help=argparse.SUPPRESS)
    parser.add_argument("--serve-floor", action="store_true", help=argparse.SUPPRESS)
    arguments, rest = parser.parse_known_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    if arguments.serve_floor:
        floor()
    elif arguments.load:
        told = load(
            arguments.load, arguments.sessions, arguments.seconds, arguments.warm, not arguments.floor
        )
        print(json.dumps(told), flush=True)
    else:
        median, worst = noise()
        print(f"noise of this machine: p50 {median:.2f}, p99 {worst:.2f} ms")
        serve = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", *rest]
        measure("realizer", serve, arguments, plays=True)
        if arguments.floor:
            measure("plain websockets", [sys.executable, __file__, "--serve-floor"], arguments, plays=False)


if __name__ == "__main__":
    main()
