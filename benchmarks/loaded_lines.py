"""Counts the lines that a process loads: `python benchmarks/loaded_lines.py [CHECKOUT]`.

    realize             `realizer.realize` of one speech
    realize, a picture  `realizer realize -o x.png`, without the modules of the command line (realizer/cli)
    serve               `realizer.serve` with one client that gets FAPs and has sent one speech

Each row is a new process; the processes that draw and speak are not counted. Only modules of bml_schema and
realizer count, with all lines of their files.

    subscribe arkit     CPU milliseconds of the longest callback in the event loop of that service when a
                        client subscribes to `arkit` for the first and for the second time, and the lines
                        that this loads
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from asyncio.events import Handle
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SPEECH = '<bml id="b"><speech id="s"><text>Hello there.</text></speech></bml>'
ARKIT = b"\x06"  # the first byte of its messages


# In the process that is measured ---------------------------------------------------------------------


def loaded() -> dict[str, int]:
    """Count the modules of bml_schema and realizer in this process, and their lines."""
    files = {
        Path(module.__file__)
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] in ("bml_schema", "realizer") and getattr(module, "__file__", None)
    }
    own = [file for file in files if file.suffix == ".py" and file.parent.name != "cli"]
    return {"modules": len(own), "lines": sum(len(file.read_text("utf-8").splitlines()) for file in own)}


def report(result: object) -> None:
    """Send a result to the process that measures."""
    print(f"measured {json.dumps(result)}", flush=True)


def realize() -> None:
    import realizer

    realizer.realize(SPEECH)
    report(loaded())


def picture() -> None:
    from realizer.__main__ import main

    with tempfile.TemporaryDirectory() as folder:
        document = Path(folder, "speech.bml")
        document.write_text(SPEECH, "utf-8")
        sys.argv = ["realizer", "-q", "realize", str(document), "-o", str(document.with_suffix(".png"))]
        try:
            main()
        finally:
            report(loaded())


def serve() -> None:
    """Serve; at each SIGUSR1 report the loaded modules, and the longest callback since the last SIGUSR1."""
    import realizer

    longest = 0.0
    run = Handle._run

    def timed(handle: Handle) -> None:
        nonlocal longest
        began = time.thread_time()
        run(handle)
        longest = max(longest, time.thread_time() - began)

    def reset() -> None:
        nonlocal longest
        longest = 0.0

    def on_signal(loop: asyncio.AbstractEventLoop) -> None:
        report({**loaded(), "longest": 1000 * longest})
        loop.call_soon(reset)  # after this callback, which is long

    async def main() -> None:
        loop = asyncio.get_running_loop()
        loop.add_signal_handler(signal.SIGUSR1, on_signal, loop)
        await realizer.serve(realizer.Settings(port=0))

    setattr(Handle, "_run", timed)  # noqa: B010
    asyncio.run(main())


WORK = {"realize": realize, "picture": picture, "serve": serve}


# In the process that measures ------------------------------------------------------------------------


@contextmanager
def start_work(what: str, checkout: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a process that does a piece of work with a checkout."""
    environment = os.environ | {"PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, str(Path(__file__).resolve()), "--work", what]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, env=environment, cwd=checkout
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def answer(process: subprocess.Popen[str], begin: str = "measured ") -> str:
    """Return the rest of the next line that begins with `begin`."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(begin):
            return line.removeprefix(begin).strip()
    raise SystemExit(f"the process ended with {process.wait()}")


def measure_service(checkout: Path) -> list[dict[str, Any]]:
    """Return the results of a service before, after the first and after the second subscription to arkit."""
    from websockets.sync.client import connect

    with start_work("serve", checkout) as process:
        url = answer(process, "listening on ")

        def measured() -> dict[str, Any]:
            process.send_signal(signal.SIGUSR1)
            return dict(json.loads(answer(process)))

        with connect(url) as socket, connect(url) as other:
            socket.send('{"type":"subscribe","stream":"fap"}')
            socket.send(SPEECH)
            while b'id="b:end"' not in socket.recv(30, decode=False):
                pass
            found = [measured()]
            for one in (socket, other):
                one.send('{"type":"subscribe","stream":"arkit"}')
                while one.recv(30, decode=False)[:1] != ARKIT:
                    pass
                found.append(measured())
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    root = Path(__file__).resolve().parents[1]
    parser.add_argument("checkout", type=Path, nargs="?", default=root, metavar="CHECKOUT")
    parser.add_argument("--repeats", type=int, default=3, help="services that are started to measure arkit")
    parser.add_argument("--work", choices=WORK, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        WORK[options.work]()
        return
    checkout = options.checkout.resolve()
    print(f"{'':<22}{'lines':>8}{'modules':>9}")
    for name, what in (("realize", "realize"), ("realize, a picture", "picture")):
        with start_work(what, checkout) as process:
            found = json.loads(answer(process))
        print(f"{name:<22}{found['lines']:>8,}{found['modules']:>9}", flush=True)
    services = [measure_service(checkout) for _ in range(options.repeats)]
    before, after, _ = services[0]
    print(f"{'serve':<22}{before['lines']:>8,}{before['modules']:>9}")
    first, second = (statistics.median(service[k]["longest"] for service in services) for k in (1, 2))
    new = f"{after['lines'] - before['lines']:,} lines, {after['modules'] - before['modules']} modules"
    print(f"subscribe arkit       {first:>8.1f} ms the first time, {second:.1f} ms the second; loads {new}")


if __name__ == "__main__":
    main()
