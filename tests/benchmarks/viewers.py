"""Prints how late frames come to each of many viewers of one session, and how many do not come.

Run: python tests/benchmarks/viewers.py [--viewers 20] [--seconds 15] [--streams fap mesh audio] [serve's own]

One more connection is the manager: it sends a spoken document with a face every 3 s. Each viewer gets all the
streams; the client is a process of its own on plain sockets. Lateness is from the time a frame is for to its
last byte; sound is sent up to 100 ms ahead, which counts as early. Noise is how late this machine wakes a
process that does nothing else.
"""

from __future__ import annotations

import argparse
import json
import select
import socket
import struct
import subprocess
import sys
import time
from collections import defaultdict
from typing import Any

import numpy as np
from listeners import POSIX, joined
from packets import encode_text, take_messages
from sessions import noise, served, spent

FPS = 25
EVERY = 3.0  # s between two documents
KINDS = {1: "fap", 2: "au", 4: "audio", 5: "mesh", 6: "arkit"}
BODY = (
    '<speech id="s"><text>Well, this is what I wanted <sync id="m"/>to tell you today.</text></speech>'
    '<head id="n" lexeme="NOD" stroke="s:m"/><faceLexeme id="f" lexeme="SMILE" start="s:start" end="s:end"/>'
)


def watch(url: str, viewers: int, seconds: float, streams: list[str]) -> dict[str, Any]:
    """Join, subscribe, play, listen: for each viewer and stream its lateness, and the numbers it lacks."""
    poll = select.epoll()
    manager = joined(url, "show", False)
    peers = [joined(url, "show", False) for _ in range(viewers)]
    by_number = {peer.socket.fileno(): peer for peer in (manager, *peers)}
    came: dict[tuple[int, str], list[tuple[int, float, float]]] = defaultdict(list)
    for peer in (manager, *peers):
        poll.register(peer.socket, select.EPOLLIN)
        peer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    for peer in peers:
        for stream in streams:
            rate = {} if stream == "audio" else {"fps": FPS}
            peer.socket.sendall(encode_text(json.dumps({"type": "subscribe", "stream": stream, **rate})))
    begun, due, documents, zero = time.time(), time.time() + 0.5, 0, None
    measured = begun + EVERY
    while (now := time.time()) < measured + seconds:
        if now >= due:
            due += EVERY
            documents += 1
            document = f'<bml id="b{documents}" composition="REPLACE">{BODY}</bml>'
            manager.socket.sendall(encode_text(document))
        for number, _ in poll.poll(0.002):
            peer = by_number[number]
            try:
                peer.data += peer.socket.recv(1 << 20)
            except BlockingIOError:
                continue
            here = time.time()
            for code, payload in take_messages(peer.data):
                if code == 2:
                    kind, _, _, frame, at = struct.unpack_from("<BBHId", payload)
                    if here >= measured and len(payload) > 16:
                        came[number, KINDS[kind]].append((frame, at, here))
                elif (found := POSIX.search(payload)) is not None:
                    zero = float(found[2]) / 1e3 - float(found[1])
    assert zero is not None
    told = []
    for peer in peers:
        row: dict[str, Any] = {}
        for stream in streams:
            frames = came[peer.socket.fileno(), stream]
            late = [1e3 * (here - at - zero) for _, at, here in frames]
            numbers = [frame for frame, _, _ in frames]
            # Of sound there is none in silence: only frames can be missing.
            whole = len(numbers) if stream == "audio" else numbers[-1] - numbers[0] + 1
            parts = [float(v) for v in np.percentile(late, (50, 99, 100))]
            row[stream] = {"frames": len(frames), "missing": whole - len(numbers), "late": parts}
        told.append(row)
    return {"viewers": told, "documents": documents}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--viewers", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=15.0)
    parser.add_argument("--streams", nargs="+", default=["fap", "mesh", "audio"])
    parser.add_argument("--watch", help=argparse.SUPPRESS)
    arguments, rest = parser.parse_known_args()
    if arguments.watch:
        print(json.dumps(watch(arguments.watch, arguments.viewers, arguments.seconds, arguments.streams)))
        return
    print("noise of this machine: p50 {:.2f}, p99 {:.2f} ms".format(*noise()))
    with served([sys.executable, "-m", "realizer", "serve", "--port", "0", *rest]) as (url, service):
        me = [sys.executable, __file__, "--watch", url, "--viewers", str(arguments.viewers)]
        me += ["--seconds", str(arguments.seconds), "--streams", *arguments.streams]
        begun, used = time.time(), spent(service)
        told = json.loads(subprocess.run(me, stdout=subprocess.PIPE, text=True, check=True).stdout)
        share = (spent(service) - used) / (time.time() - begun)
    count, documents = len(told["viewers"]), told["documents"]
    print(f"{count} viewers of one session, {documents} documents, the service {share:.0%} of a core; ms")
    heads = [f"   {stream + ': p50':>12} {'p99':>7} {'most':>7} missing" for stream in arguments.streams]
    print(f"{'viewer':>8}" + "".join(heads))
    for number, row in enumerate(told["viewers"], 1):
        cells = [
            f"   {r['late'][0]:12.2f} {r['late'][1]:7.2f} {r['late'][2]:7.1f} {r['missing']:3}/{r['frames']}"
            for r in row.values()
        ]
        print(f"{number:8}" + "".join(cells))


if __name__ == "__main__":
    main()
