"""Measures lateness and loss of frames for each of many viewers of one session.

Run: python benchmarks/viewers.py [--viewers 20] [--seconds 15] [--streams fap mesh audio] [...]

Further options are those of `serve`. One more connection sends a document with speech and an expression every
3 s. Each viewer receives all streams; the viewers are one process with plain sockets. Lateness is the time
from a frame's instant to the receipt of its last byte; sound is sent up to 100 ms ahead, so its lateness is
negative. Noise is how late this machine wakes an idle process.
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
from listeners import POSIX, open_peer
from packets import encode_text, take_messages
from sessions import noise, processor_seconds, running_service

FPS = 25
EVERY = 3.0  # s between two documents
KINDS = {1: "fap", 2: "au", 4: "audio", 5: "mesh", 6: "arkit"}
BODY = (
    '<speech id="s"><text>Well, this is what I wanted <sync id="m"/>to tell you today.</text></speech>'
    '<head id="n" lexeme="NOD" stroke="s:m"/><faceLexeme id="f" lexeme="SMILE" start="s:start" end="s:end"/>'
)


def watch(url: str, viewers: int, seconds: float, streams: list[str]) -> dict[str, Any]:
    """Connect viewers and play documents; return lateness and missing frames of each viewer and stream."""
    poll = select.epoll()
    manager = open_peer(url, "show", False)
    peers = [open_peer(url, "show", False) for _ in range(viewers)]
    by_number = {peer.socket.fileno(): peer for peer in (manager, *peers)}
    received: dict[tuple[int, str], list[tuple[int, float, float]]] = defaultdict(list)
    for peer in (manager, *peers):
        poll.register(peer.socket, select.EPOLLIN)
        peer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    for peer in peers:
        for stream in streams:
            rate = {} if stream == "audio" else {"fps": FPS}
            peer.socket.sendall(encode_text(json.dumps({"type": "subscribe", "stream": stream, **rate})))
    begin, due, documents, zero = time.time(), time.time() + 0.5, 0, None
    measured = begin + EVERY
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
                        received[number, KINDS[kind]].append((frame, at, here))
                elif (match := POSIX.search(payload)) is not None:
                    zero = float(match[2]) / 1e3 - float(match[1])
    assert zero is not None
    rows = []
    for peer in peers:
        row: dict[str, Any] = {}
        for stream in streams:
            frames = received[peer.socket.fileno(), stream]
            late = [1e3 * (here - at - zero) for _, at, here in frames]
            numbers = [frame for frame, _, _ in frames]
            # Sound has no packets in silence, so that only frames can be missing.
            whole = len(numbers) if stream == "audio" else numbers[-1] - numbers[0] + 1
            parts = [float(v) for v in np.percentile(late, (50, 99, 100))]
            row[stream] = {"frames": len(frames), "missing": whole - len(numbers), "late": parts}
        rows.append(row)
    return {"viewers": rows, "documents": documents}


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
    with running_service([sys.executable, "-m", "realizer", "serve", "--port", "0", *rest]) as (url, service):
        command = [sys.executable, __file__, "--watch", url, "--viewers", str(arguments.viewers)]
        command += ["--seconds", str(arguments.seconds), "--streams", *arguments.streams]
        begin, used = time.time(), processor_seconds(service)
        result = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
        share = (processor_seconds(service) - used) / (time.time() - begin)
    count, documents = len(result["viewers"]), result["documents"]
    print(f"{count} viewers of one session, {documents} documents, the service {share:.0%} of a core; ms")
    heads = [f"   {stream + ': p50':>12} {'p99':>7} {'most':>7} missing" for stream in arguments.streams]
    print(f"{'viewer':>8}" + "".join(heads))
    for number, row in enumerate(result["viewers"], 1):
        cells = [
            f"   {r['late'][0]:12.2f} {r['late'][1]:7.2f} {r['late'][2]:7.1f} {r['missing']:3}/{r['frames']}"
            for r in row.values()
        ]
        print(f"{number:8}" + "".join(cells))


if __name__ == "__main__":
    main()
