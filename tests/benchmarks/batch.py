"""Prints how much faster than it plays a document is realized: `python tests/benchmarks/batch.py`.

    text to FAP, without speech     nods, expressions, gazes and idle motion; the .fap file written
    text to FAP, silent voice       the same with sentences whose times come from rules
    text to FAP, espeak             with espeak-ng, which never says a sentence twice here
    film                            512x512 .mp4 by two workers (`--film`; takes minutes)

Each of documents of 4 s, as a dialogue has them, and of 30 s. By core: by the time this process and the
engines it started spent on one, which is what a batch on idle cores takes; at best: of the document that was
least disturbed, without the engine; by clock: with whatever else the machine did. Measures only; nothing
asserts a time.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator

os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})

from realizer.batch.processes import Processes
from realizer.batch.task import Options, Task
from realizer.batch.work import Worker

LENGTHS = (4, 30)  # s, about
DOCUMENTS = 40
FILMS = 6
SENTENCES = (
    "Good morning, this is number {k} speaking.",
    "I was wondering whether you had seen my umbrella.",
    "It must have been left behind on bus {k} yesterday.",
    "Well, never mind, it does not look like rain today.",
)


def document(k: int, seconds: int, *, speech: bool) -> bytes:
    """About so many seconds of talk or of play, never the same one twice."""
    parts = []
    for turn in range(max(1, seconds // 4)):
        at = 4 * turn + k / 1000
        if speech:
            words = SENTENCES[turn % len(SENTENCES)].format(k=1000 + 100 * turn + k)
            parts.append(
                f'<speech id="s{turn}" start="{at}"><text>{words}</text></speech>'
                f'<head id="h{turn}" lexeme="NOD" start="s{turn}:start+0.4"/>'
                f'<faceLexeme id="f{turn}" lexeme="SMILE" amount="0.6" start="s{turn}:start" '
                f'end="s{turn}:end"/>'
            )
        else:
            parts.append(
                f'<head id="h{turn}" lexeme="NOD" start="{at}"/>'
                f'<faceLexeme id="f{turn}" lexeme="SMILE" amount="0.6" start="{at}" end="{at + 3}"/>'
                f'<gaze id="g{turn}" target="cup" offsetAngle="10" start="{at + 1}" end="{at + 3}"/>'
                f'<faceFacs id="a{turn}" au="4" start="{at + 2}" end="{at + 3.9}"/>'
            )
    return f'<bml id="b{k}">{"".join(parts)}</bml>'.encode()


def tasks(count: int, seconds: int, *, speech: bool) -> Iterator[Task]:
    for k in range(count):
        yield Task(f"{k}", f"{k}", document(k, seconds, speech=speech), "")


def spent() -> float:
    """Seconds of processor time, of this process and of its children that ended."""
    own = os.times()
    return own.user + own.system + own.children_user + own.children_system


def fap(name: str, voice: str, seconds: int, *, speech: bool) -> None:
    options = Options(formats=(".fap",), voice=voice)
    first, *rest = tasks(DOCUMENTS + 1, seconds, speech=speech)
    warm = Worker(options)
    warm.perform(first)  # tables and face are read
    warm.close()
    worker = Worker(options)
    used, began, played, best = spent(), time.perf_counter(), 0.0, 0.0
    for task in rest:
        own = time.process_time()
        row = worker.perform(task).row
        own = time.process_time() - own
        assert row["status"] == "done", row
        played += row["duration"]
        best = max(best, row["duration"] / own)
    worker.close()
    used, clock = spent() - used, time.perf_counter() - began
    print(
        f"{name:32}{played / DOCUMENTS:7.1f} s{played / used:9.0f} x{best:9.0f} x{played / clock:9.0f} x"
        f"{1000 * used / DOCUMENTS:9.1f} ms a document",
        flush=True,
    )


def film() -> None:
    """Starting the two workers and what draws for them counts: it is a part of a batch, if of no long one."""
    crew = Processes(Options(formats=(".mp4",), voice="silent", size=(512, 512)), 2)
    used, began, played = spent(), time.perf_counter(), 0.0
    for outcome in crew.perform(tasks(FILMS, 8, speech=True)):
        assert outcome.row["status"] == "done", outcome.row
        played += outcome.row["duration"]
    used, clock = spent() - used, time.perf_counter() - began
    print(
        f"{'film, 512x512':32}{played / FILMS:7.1f} s{played / used:9.2f} x{'':11}{played / clock:9.2f} x"
        f"{used / FILMS:9.1f} s a film; by clock with two workers"
    )


def main() -> None:
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    print(f"load of the machine {load:.1f} a core before it began")
    print(f"{'':32}{'each':>9}{'by core':>11}{'at best':>11}{'by clock':>11}")
    for seconds in LENGTHS:
        fap("text to FAP, without speech", "silent", seconds, speech=False)
        fap("text to FAP, silent voice", "silent", seconds, speech=True)
        fap("text to FAP, espeak", "espeak", seconds, speech=True)
    if "--film" in sys.argv:
        film()


if __name__ == "__main__":
    main()
