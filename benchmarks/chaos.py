"""Measures a service under many short connections and under many simultaneous documents.

Run: python -m benchmarks.chaos [--clients 20000] [--documents 400] [--sessions 200] [options of serve]

The program starts a service. First `--clients` clients connect one after the other; each leaves in one of
five ways. Afterwards the service must have as many files and sessions open as before. Then `--sessions`
sessions that stream 25 FAP frames a second send `--documents` documents at the same time. Every block must be
played to its end, and every feedback message must arrive once and in order.
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

from tests.many_clients import check_feedback, connect_and_leave, open_files, send_simultaneously

SESSION_NAMES = 100
CLOSE_TIMEOUT = 30.0  # s until the service has closed the connections of clients that left


def health(port: int) -> dict[str, int]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/healthz", timeout=60) as answer:
        values: dict[str, int] = json.load(answer)
    return values


def resident(process: int) -> float:
    """Return the resident memory of a process in MB."""
    status = Path(f"/proc/{process}/status").read_text()
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def measure_short_connections(port: int, service: int, count: int) -> None:
    """Print the rate of clients that connect and leave, and check that nothing of them remains open."""
    # Afterwards all sessions exist, and modules that are imported late are loaded.
    connect_and_leave(port, 10 * SESSION_NAMES, SESSION_NAMES)
    files, memory = open_files(service), resident(service)
    begin = time.perf_counter()
    connect_and_leave(port, count, SESSION_NAMES)
    seconds = time.perf_counter() - begin
    deadline = time.monotonic() + CLOSE_TIMEOUT
    while health(port)["connections"] or open_files(service) > files:
        if time.monotonic() > deadline:
            raise SystemExit(f"left over: {health(port)}, {open_files(service)} files, {files} before")
        time.sleep(0.1)
    print(
        f"{count} clients connected and left, {count / seconds:.0f} a second: {health(port)['sessions']}"
        f" sessions and {files} files open as before, {resident(service) - memory:+.1f} MB"
    )


def measure_simultaneous_documents(port: int, sessions: int, documents: int) -> None:
    """Print how long many simultaneous documents take, and check their feedback."""
    begin = time.perf_counter()
    feedback = asyncio.run(send_simultaneously(port, sessions, documents))
    seconds = time.perf_counter() - begin
    for messages in feedback:
        check_feedback(messages, documents // sessions)
    print(
        f"{documents} documents at once of {sessions} sessions that stream: all played,"
        f" {sum(map(len, feedback))} messages once and in order, in {seconds:.1f} s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--clients", type=int, default=20_000)
    parser.add_argument("--documents", type=int, default=400)
    parser.add_argument("--sessions", type=int, default=200)
    arguments, serve_options = parser.parse_known_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", *serve_options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as service:
        assert service.stdout is not None
        try:
            port = urlsplit(service.stdout.readline().split()[2].rstrip(",")).port
            assert port is not None
            measure_short_connections(port, service.pid, arguments.clients)
            measure_simultaneous_documents(port, arguments.sessions, arguments.documents)
        finally:
            service.terminate()


if __name__ == "__main__":
    main()
