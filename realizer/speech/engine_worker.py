"""A process around one engine: JSON requests on stdin; JSON headers and bodies (PCM) on stdout.

    arguments        the engine's file, [--no-fork], and arguments of the engine
    first line out   the engine's description of itself, or {"error": text}
    line in          {"op": one of the engine's operations, ...}
    line out         {"bytes": n, "last": whether the process ends now, ...} and n bytes; or {"error": text}

The engine's file defines `load(arguments)`, which returns an object with `hello()`, `operations` (functions
by name, from the request to the head and the parts of the body) and `drifts`: whether its results depend on
earlier requests. If so, the engine is loaded once and each request is served by a fork of it (or, on systems
without fork, by a new process). Nothing of the realizer is imported, for a fast start and for the licences.
"""

import ctypes
import importlib.util
import json
import os
import select
import signal
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

PARENT_DEATH_SIGNAL = 1  # prctl
PATIENCE = 5.0  # s between checks whether the parent is alive


def answer(engine: Any, request: dict[str, Any], out: int, last: bool = False) -> None:
    try:
        head, body = engine.operations[request["op"]](request)
    except Exception as error:
        head, body = {"error": str(error) or type(error).__name__}, []
    write(out, {"bytes": sum(map(len, body)), **head, "last": last}, body)


def write(out: int, head: dict[str, Any], body: Sequence[bytes] = ()) -> None:
    # Not joined, because a fork pays for each page of memory that it writes first.
    for part in (json.dumps(head).encode() + b"\n", *body):
        data = memoryview(part)
        while data:
            data = data[os.write(out, data) :]


def requests() -> Iterator[dict[str, Any]]:
    """Yield the requests on stdin until it or the parent ends.

    They are parsed before the fork, which would pay for each page of memory that it touches first.
    """
    parent = os.getppid()
    pending = b""
    while os.getppid() == parent:
        if b"\n" in pending:
            line, _, pending = pending.partition(b"\n")
            yield json.loads(line)
        # Waiting for end of file is not enough: another child of the parent may hold the pipe open.
        elif not hasattr(os, "fork") or select.select([0], [], [], PATIENCE)[0]:
            read = os.read(0, 1 << 16)
            if not read:
                return
            pending += read


def serve_in_forks(engine: Any, out: int) -> None:
    """Serve each request in a fork, so that all start from the same state."""
    libc = ctypes.CDLL(None) if sys.platform == "linux" else None
    for request in requests():
        child = os.fork()
        if child == 0:
            if libc is not None:
                libc.prctl(PARENT_DEATH_SIGNAL, signal.SIGKILL)
            try:
                answer(engine, request, out)
            finally:
                os._exit(0)
        status = os.waitpid(child, 0)[1]
        if status:
            write(out, {"bytes": 0, "error": f"it crashed (status {status})", "last": False})


def loaded(arguments: list[str]) -> Any:
    spec = importlib.util.spec_from_file_location("engine", Path(arguments[0]))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.load(arguments[1:])


def main(arguments: list[str]) -> None:
    forks = hasattr(os, "fork") and "--no-fork" not in arguments
    # Ctrl-C is for the parent. Libraries may print to stdout, so answers use a copy of it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    out = os.dup(1)
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        engine = loaded([argument for argument in arguments if argument != "--no-fork"])
        hello = engine.hello()
    except Exception as error:
        write(out, {"error": str(error) or type(error).__name__})
        return
    write(out, hello)
    if engine.drifts and forks:
        serve_in_forks(engine, out)
        return
    for request in requests():
        answer(engine, request, out, last=engine.drifts)
        if engine.drifts:
            return


if __name__ == "__main__":
    main(sys.argv[1:])
