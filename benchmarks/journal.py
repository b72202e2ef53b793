"""Measures journals: the time per document, and the size and time of a takeover after many documents.

Run: python -m benchmarks.journal [--documents 10000] [--apart 8] [--kinds SQLite Redis record]

A session with a simulated clock and a silent voice plays five kinds of documents in turn, one every `--apart`
seconds. The kinds of journals are a file (SQLite) and Redis, if its server is installed, each with and
without checkpoints, and a recording, which has no checkpoints. Times of documents and takeovers are CPU times
of this process, without that of a Redis server; times of single calls are elapsed times.
"""

from __future__ import annotations

import argparse
import shutil
import socket
import statistics
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest.mock import patch

from realizer.core.settings import Settings
from realizer.server.journal import Entry, Journal, SavedSession, journal_at
from realizer.server.journal import session_journal as thresholds
from realizer.server.journal.recordings import RecordingFolder
from realizer.server.journal.replay import restore_session
from realizer.server.session.effects import Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Utterance

SETTINGS = Settings(voice="silent")
DOCUMENTS = (
    '<bml id="b{k}"><speech id="s"><text>Good morning <sync id="m"/>to you</text></speech>'
    '<head id="n" lexeme="NOD" stroke="s:m"/></bml>',
    '<bml id="b{k}"><faceLexeme id="f" lexeme="SMILE" end="2"/><gaze id="g" target="cup" end="1.5"/></bml>',
    '<bml id="b{k}"><head id="n" lexeme="SHAKE"/></bml>',
    '<bml id="b{k}"><faceShift id="f" lexeme="RAISE_BROWS" end="1"/></bml>',
    '<bml id="b{k}"><speech id="s"><text>And who are you, if I may ask?</text></speech></bml>',
)


class TimedJournal:
    """A journal that records the seconds of each call of `add`."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self.adds: list[float] = []
        self.begin, self.take, self.end, self.close = journal.begin, journal.claim, journal.end, journal.close
        self.compact = journal.compact

    def add(self, session: str, entry: Entry) -> None:
        with _timed(self.adds):
            self._journal.add(session, entry)


@contextmanager
def _timed(spent: list[float]) -> Iterator[None]:
    begin_time = time.perf_counter()
    yield
    spent.append(time.perf_counter() - begin_time)


@contextmanager
def timed_checkpoints() -> Iterator[list[float]]:
    """Collect the seconds of each checkpoint, from the state of the session to the written entry."""
    seconds: list[float] = []
    compact = Session._compact

    def timed(session: Session, t: float) -> bool:
        begin_time = time.perf_counter()
        if done := compact(session, t):
            seconds.append(time.perf_counter() - begin_time)
        return done

    with patch.object(Session, compact.__name__, timed):
        yield seconds


def speak(order: Speak) -> Utterance:
    return speak_to_length(SilentVoice(), order.request)


def open_session() -> Session:
    return Session("long", SETTINGS, 0.0, named=True, epoch=0.0)


def play(
    documents: int, apart: float, journal: Journal | None, record: RecordingFolder | None = None
) -> float:
    """Play documents; return the CPU milliseconds of one."""
    session = open_session()
    session.journal.open(journal, record)
    session.journal.begin(0.0)
    session.connect(1, 0.0)
    session.receive(1, '{"type":"scene","objects":{"cup":{"x":0.2,"y":-0.1,"z":0.5}}}', 0.0)
    begin_time = time.process_time()
    for k in range(documents):
        session.receive(1, DOCUMENTS[k % len(DOCUMENTS)].replace("{k}", str(k)), apart * k)
        now = apart * k
        while True:
            for effect in session.take_effects():
                if isinstance(effect, Speak):
                    session.on_speech(effect.id, speak(effect), now)
            due = 0.0 if session.has_documents else session.next_due()
            if due > apart * (k + 1):
                break
            now = max(now, due)
            session.tick(now)
    return 1000 * (time.process_time() - begin_time) / documents


def size(saved: SavedSession) -> int:
    """Return the bytes of a saved session."""
    return sum(len(entry.line().encode()) for entry in saved.entries) + sum(
        len(text.encode()) for text in saved.parts.values()
    )


def report(name: str, where: str, documents: int, apart: float, no_journal: float) -> None:
    journal = TimedJournal(journal_at(where))
    with timed_checkpoints() as taken:
        cost = play(documents, apart, journal)
    begin_time = time.process_time()
    saved = journal.take("long")
    assert saved is not None
    session = open_session()
    restore_session(session, saved, speak)
    seconds = time.process_time() - begin_time
    entries = len(journal.adds) / documents
    compacts = ""
    if taken:
        compacts = f"; {len(taken)} checkpoints, {1000 * statistics.median(taken):.1f} ms each (median),"
        compacts += f" {1000 * max(taken):.1f} at most"
    print(
        f"{name}: {cost - no_journal:+.2f} ms a document ({entries:.1f} entries,"
        f" {1e6 * statistics.median(journal.adds):.0f} us each); at the end {len(saved.entries)} entries,"
        f" {size(saved) / 1000:.0f} kB, taken over in {seconds:.2f} s{compacts}",
        flush=True,
    )


@contextmanager
def redis(folder: Path) -> Iterator[str | None]:
    """Start a Redis server that writes once a second, as in docker/; yield its URL, or None without Redis."""
    if (program := shutil.which("redis-server")) is None:
        yield None
        return
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = [program, "--port", str(port), "--bind", "127.0.0.1", "--save", "", "--appendonly", "yes"]
    with subprocess.Popen([*command, "--dir", str(folder)], stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        for line in server.stdout:
            if "Ready to accept connections" in line:
                break
        try:
            yield f"redis://127.0.0.1:{port}"
        finally:
            server.kill()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--documents", type=int, default=10_000)
    parser.add_argument("--apart", type=float, default=8.0, help="seconds")
    parser.add_argument("--kinds", nargs="+", default=["SQLite", "Redis", "record"])
    options = parser.parse_args()
    documents, apart = options.documents, options.apart
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        folder = Path(name)
        url = stack.enter_context(redis(folder))
        play(100, apart, None)  # loads modules and tables
        no_journal = play(documents, apart, None)
        print(f"no journal: {no_journal:.2f} ms a document", flush=True)
        never = patch.multiple(thresholds, ENTRIES=10**9, BYTES=10**18)
        for kind, places in (
            ("SQLite", (folder / "whole.db", folder / "short.db")),
            ("Redis", (f"{url}/0", f"{url}/1")),
        ):
            if kind not in options.kinds or (kind == "Redis" and url is None):
                continue
            with never:
                report(f"{kind}, no checkpoints", str(places[0]), documents, apart, no_journal)
            report(f"{kind}, checkpoints", str(places[1]), documents, apart, no_journal)
        for path in sorted(folder.glob("*.db")):
            print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")
        if "record" not in options.kinds:
            return
        record = RecordingFolder(folder / "records", {})
        cost = play(documents, apart, None, record)
        record.close()
        (path,) = (folder / "records").iterdir()
        print(f"record: {cost - no_journal:+.2f} ms a document; {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
