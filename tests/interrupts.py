"""Commands that a signal ends while they work."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from pathlib import Path

from tests.programs import running
from tests.waiting import LIMIT, wait_for

__all__ = ["SIGNALS", "check_interrupted"]

# Signal, exit status, last line on standard error.
SIGNALS = [(signal.SIGINT, 130, "realizer: interrupted"), (signal.SIGTERM, 143, "realizer: terminated")]
LONG = '<bml id="b"><head id="h" lexeme="NOD"/><wait id="w" duration="500"/></bml>'


def check_interrupted(
    arguments: tuple[str, ...], event: str, ending: tuple[signal.Signals, int, str], folder: Path
) -> None:
    """Run a command in a folder with `long.bml`, end it when a file like `event` is there, and check."""
    number, status, words = ending
    (folder / "long.bml").write_text(LONG)
    for name in ("film.mp4", "demo.mp4", "demo.fap"):
        (folder / name).write_text("before")
    environment = {**os.environ, "REALIZER_VOICE": "silent"}
    command = [sys.executable, "-m", "realizer", *arguments]
    with running(
        command, cwd=folder, env=environment, stderr=subprocess.PIPE, start_new_session=True
    ) as program:
        asyncio.run(wait_for(lambda: [*folder.glob(event)] or program.poll() is not None))
        assert program.poll() is None
        # Ctrl-C reaches all processes of a terminal's group.
        (os.killpg if number == signal.SIGINT else os.kill)(program.pid, number)
        _, error = program.communicate(timeout=LIMIT)
    # A progress bar without a terminal is an empty line.
    found = program.returncode, error.strip().splitlines()
    assert found == (status, [words]), found
    assert not [*folder.rglob(".*.mp4*"), *folder.rglob(".*.fap")]
    assert (folder / "film.mp4").read_text() == (folder / "demo.mp4").read_text() == "before"
