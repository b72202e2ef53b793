"""Prints how many sessions one service plays at once: lateness, processor time, memory.

Run: python tests/benchmarks/sessions.py [--sessions 1000] [--every 10] [--floor] [serve's own options]
     python tests/benchmarks/sessions.py --sessions 125,250,500,1000     how it grows
     python tests/benchmarks/sessions.py --sessions 200 --minutes 30     whether it stays as it is

Each session is a WebSocket of its own that gets 25 FAP frames a second and plays documents of head, face,
gaze and idle motion, which last six seconds, one `--every` ten. The client is a process of its own on plain
sockets, so that it costs little. `--floor` runs a server beside it that does nothing but send as many bytes
as often (with the package websockets). Noise is how late this machine wakes a process that does nothing else.
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
from listeners import FPS, Crowd
from plot import bars, exponent


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
    """Processor seconds, to the nanosecond: what clock ticks sample is wrong of who wakes with them."""
    threads = (t for process in processes(parent) for t in Path(f"/proc/{process}/task").iterdir())
    return sum(int((thread / "schedstat").read_text().split()[0]) for thread in threads) / 1e9


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


def measured(
    command: list[str],
    sessions: int,
    seconds: float,
    warm: float,
    times: int,
    plays: bool,
    every: float = 10.0,
) -> Iterator[dict[str, float]]:
    """What a service does and costs in each of some stretches of so many seconds."""
    with served(command) as (url, service):
        me = [sys.executable, __file__, "--load", url, "--sessions", str(sessions), "--seconds", str(seconds)]
        me += ["--warm", str(warm), "--times", str(times), "--every", str(every)]
        me += [] if plays else ["--floor"]
        idle = resident(service)
        client = subprocess.Popen(me, stdout=subprocess.PIPE, text=True)
        assert client.stdout is not None
        assert client.stdout.readline().strip() == "measuring"
        for _ in range(times):
            begun, used = time.time(), spent(service)
            told = json.loads(client.stdout.readline())
            told["cpu"] = (spent(service) - used) / (time.time() - begun)
            told["frame"] = 1e6 * told["cpu"] * seconds / max(told["frames"], 1)
            told["memory"] = resident(service) - idle
            yield told
        client.wait()


def tell(name: str, sessions: int, told: dict[str, float], plays: bool) -> None:
    print(
        f"{name}: {sessions} sessions, {told['frames']} frames of {told['expected']:.0f}, "
        f"{told['missing']} missing\n"
        f"  lateness ms     p50 {told['p50']:6.2f}  p99 {told['p99']:6.2f}  most {told['most']:6.1f}\n"
        f"  processor       {told['cpu']:5.0%} of a core, {told['frame']:5.1f} us a frame"
        f" (the client {told['load']:.0%})\n"
        f"  memory          {told['memory']:5.0f} MB more than without sessions"
    )
    if plays:
        print(
            f"  first feedback  p50 {told['answer_p50']:6.2f}  p99 {told['answer_p99']:6.2f} ms"
            f" of {told['answers']:.0f} documents"
        )
    sys.stdout.flush()


def soak(command: list[str], sessions: int, minutes: int, warm: float, every: float) -> None:
    """Minute by minute, and what the second half has more than the first."""
    print("minute  memory MB  lateness p50    p99 ms  first feedback p50    p99 ms  us a frame")
    rows = []
    for minute, told in enumerate(measured(command, sessions, 60.0, warm, minutes, True, every), 1):
        rows.append(told)
        print(
            f"{minute:6}  {told['memory']:9.1f}  {told['p50']:12.2f}  {told['p99']:8.2f}"
            f"  {told['answer_p50']:18.2f}  {told['answer_p99']:8.2f}  {told['frame']:10.1f}",
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
    parser.add_argument("--minutes", type=int, help="for so long, minute by minute")
    parser.add_argument("--warm", type=float, default=12.0, help="seconds before it is measured")
    parser.add_argument("--floor", action="store_true", help="a plain server of package websockets beside it")
    parser.add_argument("--load", help=argparse.SUPPRESS)
    parser.add_argument("--times", type=int, default=1, help=argparse.SUPPRESS)
    parser.add_argument("--serve-floor", action="store_true", help=argparse.SUPPRESS)
    given, rest = parser.parse_known_args()
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    if given.serve_floor:
        floor()
        return
    counts = [int(part) for part in given.sessions.split(",")]
    if given.load:
        crowd = Crowd(given.load, counts[0], not given.floor, given.every)
        crowd.listen(given.warm)
        print("measuring", flush=True)
        for _ in range(given.times):
            print(json.dumps(crowd.listen(given.seconds)), flush=True)
        return
    median, worst = noise()
    print(f"noise of this machine: p50 {median:.2f}, p99 {worst:.2f} ms", flush=True)
    serve = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", *rest]
    if given.minutes:
        soak(serve, counts[0], given.minutes, given.warm, given.every)
        return
    rows: list[dict[str, float]] = []
    for count in counts:
        rows += measured(serve, count, given.seconds, given.warm, 1, True, given.every)
        tell("realizer", count, rows[-1], plays=True)
    if len(counts) > 1:
        for name, unit in (("cpu", "of a core"), ("memory", "MB"), ("p99", "ms late")):
            values = [row[name] for row in rows]
            print(f"{name}, {unit}: grows as sessions ^ {exponent(counts, values):.2f}")
            print(bars(counts, values))
    if given.floor:
        command = [sys.executable, __file__, "--serve-floor"]
        (told,) = measured(command, counts[-1], given.seconds, given.warm, 1, plays=False)
        tell("plain websockets", counts[-1], told, plays=False)
        print(f"a frame costs {rows[-1]['frame'] / told['frame']:.2f} times what it costs plain websockets")


if __name__ == "__main__":
    main()
