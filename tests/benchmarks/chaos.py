"""Prints what a service stands: many clients that come and go, and many documents in one moment.

Run: python -m tests.benchmarks.chaos [--many 20000] [--documents 400] [--sessions 200] [serve's own options]

A service of its own gets `--many` clients one after the other, of which each leaves in one of the ways in
which clients leave; then it has as many files and sessions open as before, or this ends with what is left
over. Then `--sessions` sessions that stream 25 FAP frames a second get `--documents` documents in one moment,
and every one of them must be played to its end and told of, each message once and in order.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import resource
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from urllib.parse import urlsplit

from tests.crowds import at_once, come_and_go, files_open, well_told

NAMES = 100
PATIENCE = 30.0  # s until what has left is gone


def health(port: int) -> dict[str, int]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=60) as answer:
        told: dict[str, int] = json.load(answer)
    return told


def resident(process: int) -> float:
    """MB."""
    status = Path(f"/proc/{process}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def passing(port: int, service: int, many: int) -> None:
    """Clients that come and go, and what they leave behind."""
    come_and_go(port, 10 * NAMES, NAMES)  # each session there is once, what is loaded late is there
    files, memory = files_open(service), resident(service)
    begun = time.perf_counter()
    come_and_go(port, many, NAMES)
    took = time.perf_counter() - begun
    end = time.monotonic() + PATIENCE
    while health(port)["connections"] or files_open(service) > files:
        if time.monotonic() > end:
            raise SystemExit(f"left over: {health(port)}, {files_open(service)} files, {files} before")
        time.sleep(0.1)
    told = health(port)
    print(
        f"{many} came and went, {many / took:.0f} a second: {told['sessions']} sessions and {files} files"
        f" open as before, {resident(service) - memory:+.1f} MB"
    )


def crowd(port: int, sessions: int, documents: int) -> None:
    """Many documents at once, while sessions stream."""
    begun = time.perf_counter()
    told = asyncio.run(at_once(port, sessions, documents))
    took = time.perf_counter() - begun
    for one in told:
        well_told(one, documents // sessions)
    count = sum(map(len, told))
    print(
        f"{documents} documents at once of {sessions} sessions that stream: all played, {count} messages"
        f" once and in order, in {took:.1f} s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--many", type=int, default=20_000)
    parser.add_argument("--documents", type=int, default=400)
    parser.add_argument("--sessions", type=int, default=200)
    arguments, rest = parser.parse_known_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", *rest]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as service:
        assert service.stdout is not None
        try:
            port = urlsplit(service.stdout.readline().split()[2].rstrip(",")).port
            assert port is not None
            passing(port, service.pid, arguments.many)
            crowd(port, arguments.sessions, arguments.documents)
        finally:
            service.terminate()


if __name__ == "__main__":
    main()
