"""Measures a service with many sessions: lateness, processor time, memory.

Run: python benchmarks/sessions.py [--sessions 1000] [--every 10] [--floor] [options of serve]
     python benchmarks/sessions.py --sessions 125,250,500,1000     growth
     python benchmarks/sessions.py --sessions 200 --minutes 30     drift over time
     python benchmarks/sessions.py --ahead 0.2 --floor             frames ahead, and each in time

Each session is a WebSocket that receives 25 FAP frames a second, and plays a document of head, face, gaze and
idle motion of six seconds every ten seconds. The clients are one process with plain sockets, which costs
little. `--floor` also measures a server that only sends the same bytes with the package websockets. Noise is
how late this machine wakes an idle process.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import resource
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from listeners import FPS, ClientGroup
from plot import bars, exponent


def noise(seconds: float = 3.0) -> tuple[float, float]:
    """Return how late a process wakes from 5 ms of sleep: median and p99 in ms."""
    late = []
    end = time.perf_counter() + seconds
    while (begin := time.perf_counter()) < end:
        time.sleep(0.005)
        late.append(time.perf_counter() - begin - 0.005)
    return 1e3 * float(np.percentile(late, 50)), 1e3 * float(np.percentile(late, 99))


def processes(parent: int) -> list[int]:
    """Return a service's process and its workers, without the processes of voices."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    names = {int(c): Path(f"/proc/{c}/cmdline").read_text() for c in children}
    return [parent, *(c for c, name in names.items() if "serve" in name or "spawn_main" in name)]


def processor_seconds(parent: int) -> float:
    """Return the processor seconds of a service.

    The sampled times of `stat` are wrong for processes that wake at clock ticks; `schedstat` is exact.
    """
    threads = (t for process in processes(parent) for t in Path(f"/proc/{process}/task").iterdir())
    return sum(int((thread / "schedstat").read_text().split()[0]) for thread in threads) / 1e9


def resident(parent: int) -> float:
    """Return the resident memory of a service in MB."""
    total = 0.0
    for process in processes(parent):
        status = Path(f"/proc/{process}/status").read_text()
        total += int(status.partition("VmRSS:")[2].split()[0]) / 1024
    return total


@contextmanager
def running_service(command: list[str]) -> Iterator[tuple[str, int]]:
    """Run a service during the block; yield its address and its process."""
    service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert service.stdout is not None
    try:
        yield service.stdout.readline().split()[2].rstrip(","), service.pid
    finally:
        service.terminate()
        service.wait(30)


def floor() -> None:
    """Run a server that sends 288 bytes 25 times a second to each connection."""
    from websockets.asyncio.server import ServerConnection, broadcast, serve

    async def handle(connection: ServerConnection) -> None:
        loop, zero = asyncio.get_running_loop(), time.time()
        begin = loop.time()

        def send(k: int) -> None:
            broadcast((connection,), struct.pack("<BBHId", 1, 1, 0, k, zero + k / FPS) + bytes(272))
            if connection.close_code is None:
                loop.call_at(begin + (k + 1) / FPS, send, k + 1)

        send(0)
        await connection.wait_closed()

    async def run() -> None:
        async with serve(handle, "127.0.0.1", 0, compression=None) as server:
            print(f"listening on ws://127.0.0.1:{server.sockets[0].getsockname()[1]}/ws", flush=True)
            await asyncio.get_running_loop().create_future()

    asyncio.run(run())


def measure(
    command: list[str],
    sessions: int,
    seconds: float,
    warm: float,
    times: int,
    plays: bool,
    every: float = 10.0,
    ahead: float = 0.0,
) -> Iterator[dict[str, float]]:
    """Yield the measurements of a service for each of `times` spans of `seconds` seconds."""
    with running_service(command) as (url, service):
        me = [sys.executable, __file__, "--load", url, "--sessions", str(sessions), "--seconds", str(seconds)]
        me += ["--warm", str(warm), "--times", str(times), "--every", str(every), "--ahead", str(ahead)]
        me += [] if plays else ["--floor"]
        idle = resident(service)
        client = subprocess.Popen(me, stdout=subprocess.PIPE, text=True)
        assert client.stdout is not None
        assert client.stdout.readline().strip() == "measuring"
        for _ in range(times):
            begin, used = time.time(), processor_seconds(service)
            result = json.loads(client.stdout.readline())
            result["cpu"] = (processor_seconds(service) - used) / (time.time() - begin)
            result["frame"] = 1e6 * result["cpu"] * seconds / max(result["frames"], 1)
            result["memory"] = resident(service) - idle
            yield result
        client.wait()


def print_result(name: str, sessions: int, result: dict[str, float], plays: bool) -> None:
    print(
        f"{name}: {sessions} sessions, {result['frames']} frames of {result['expected']:.0f}, "
        f"{result['missing']} missing, {result['refused']} sessions refused\n"
        f"  lateness ms     p50 {result['p50']:6.2f}  p99 {result['p99']:6.2f}  most {result['most']:6.1f}\n"
        f"  processor       {result['cpu']:5.0%} of a core, {result['frame']:5.1f} us a frame"
        f" (the client {result['load']:.0%})\n"
        f"  memory          {result['memory']:5.0f} MB more than without sessions"
    )
    if result["early"]:
        rows, replaced = max(result["timed"], 1), max(result["replaced"], 1)
        print(
            f"  ahead           {result['early'] / rows:.2%} of the rows early by at least half of it,"
            f" {result['after']} after their time;\n"
            f"                  {result['taken_back']} take-backs replace {result['replaced']} rows,"
            f" {result['replaced_after'] / replaced:.2%} of them after their time"
        )
    if plays:
        print(
            f"  first feedback  p50 {result['answer_p50']:6.2f}  p99 {result['answer_p99']:6.2f} ms"
            f" of {result['answers']:.0f} documents"
        )
    sys.stdout.flush()


def soak(command: list[str], sessions: int, minutes: int, warm: float, every: float) -> None:
    """Print the measurements of each minute, and compare the two halves."""
    print("minute  memory MB  lateness p50    p99 ms  first feedback p50    p99 ms  us a frame")
    rows = []
    for minute, result in enumerate(measure(command, sessions, 60.0, warm, minutes, True, every), 1):
        rows.append(result)
        print(
            f"{minute:6}  {result['memory']:9.1f}  {result['p50']:12.2f}  {result['p99']:8.2f}"
            f"  {result['answer_p50']:18.2f}  {result['answer_p99']:8.2f}  {result['frame']:10.1f}",
            flush=True,
        )
    half = len(rows) // 2
    for name in ("memory", "p50", "p99", "answer_p50", "frame"):
        first, second = (float(np.median([r[name] for r in part])) for part in (rows[:half], rows[half:]))
        print(f"{name:10}  median of the first half {first:8.2f}, of the second {second:8.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sessions", default="1000", help="how many, or several numbers with commas")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument(
        "--every", type=float, default=10.0, help="seconds between two documents of a session"
    )
    parser.add_argument("--minutes", type=int, help="measure this long, minute by minute")
    parser.add_argument("--warm", type=float, default=12.0, help="seconds before the measurement")
    parser.add_argument("--ahead", type=float, default=0.0, help="seconds that frames are sent ahead")
    parser.add_argument(
        "--floor", action="store_true", help="also measure a plain server of the package websockets"
    )
    parser.add_argument("--load", help=argparse.SUPPRESS)
    parser.add_argument("--times", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--serve-floor", action="store_true", help=argparse.SUPPRESS)
    options, rest = parser.parse_known_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    if options.serve_floor:
        floor()
        return
    counts = [int(part) for part in options.sessions.split(",")]
    if options.load:
        crowd = ClientGroup(options.load, counts[0], not options.floor, options.every, options.ahead)
        crowd.listen(options.warm)
        print("measuring", flush=True)
        for _ in range(options.times):
            print(json.dumps(crowd.listen(options.seconds)), flush=True)
        return
    median, worst = noise()
    print(f"noise of this machine: p50 {median:.2f}, p99 {worst:.2f} ms", flush=True)
    serve = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", *rest]
    if options.minutes:
        soak(serve, counts[0], options.minutes, options.warm, options.every)
        return
    rows: list[dict[str, float]] = []
    for count in counts:
        rows += measure(serve, count, options.seconds, options.warm, 1, True, options.every, options.ahead)
        print_result("realizer", count, rows[-1], plays=True)
    if options.ahead:
        (timely,) = measure(serve, counts[-1], options.seconds, options.warm, 1, True, options.every)
        print_result("realizer, each frame in time", counts[-1], timely, plays=True)
        print(f"a frame ahead costs {rows[-1]['frame'] / timely['frame']:.2f} times what it costs in time")
    if len(counts) > 1:
        for name, unit in (("cpu", "of a core"), ("memory", "MB"), ("p99", "ms late")):
            values = [row[name] for row in rows]
            print(f"{name}, {unit}: grows as sessions ^ {exponent(counts, values):.2f}")
            print(bars(counts, values))
    if options.floor:
        command = [sys.executable, __file__, "--serve-floor"]
        (result,) = measure(command, counts[-1], options.seconds, options.warm, 1, plays=False)
        print_result("plain websockets", counts[-1], result, plays=False)
        print(f"a frame costs {rows[-1]['frame'] / result['frame']:.2f} times what it costs plain websockets")


if __name__ == "__main__":
    main()
