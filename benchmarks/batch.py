"""Measures how much faster than real time documents are realized: `python benchmarks/batch.py`.

    text to FAP, without speech     nods, expressions, gazes and idle motion; the bytes of the .fap file
    text to FAP, silent voice       the same with sentences whose times come from rules
    text to FAP, espeak             with espeak-ng; no sentence occurs twice
      espeak-ng alone               the lower bound: the engine speaks the same sentences in one process
    openfacefx, text to curves      the sentences of the silent voice with their lengths, by another program
    film                            512x512 .mp4 by two workers (`--films 16` takes a minute)

The documents last 4 s, as in dialogues, and 30 s. "By core" uses the processor time of this process and of
the speech engine. "Less noise" is an estimate for a machine that is always as fast as at its best in this
run. "By clock" uses elapsed time. "Engine" is the time of the engine's process, which forks for each
sentence, so that speech does not depend on earlier speech. "Noise" is how much more processor time a fixed
piece of work took between the documents than at its best, as median and 90th percentile: at 100 % the machine
was half as fast. openfacefx makes 15 visemes, blinks, brows and head from text and a length, without BML,
planning or blending.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from itertools import islice
from multiprocessing import get_context
from pathlib import Path

os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})

from stopwatch import Noise

from realizer.speech.espeak.espeak_worker import load
from realizer.speech.espeak.voice import WORDS_A_MINUTE
from realizer_studio.batch.process_pool import ProcessPool
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Worker

LENGTHS = (4, 30)  # s, about
DOCUMENTS = 40
FILM = 8  # s
FPS = 25
ENGLISH = "gmw/en-US"  # the engine's name of the voice
SENTENCES = (
    "Good morning, this is number {k} speaking.",
    "I was wondering whether you had seen my {size} {colour} umbrella.",
    "It must have been left behind on bus {k} yesterday.",
    "Well, never mind the {size} {colour} one, it does not look like rain.",
)
SIZES = ("old", "new", "big", "small", "long", "short", "light", "heavy", "torn")
COLOURS = ("red", "blue", "green", "yellow", "white", "black", "brown", "grey", "pink", "golden", "silver")


def sentences(k: int, seconds: int) -> list[str]:
    """Return one sentence for every 4 s; other documents have other sentences."""
    return [
        SENTENCES[turn % len(SENTENCES)].format(
            k=1000 + 100 * turn + k, size=SIZES[(k + turn) % len(SIZES)], colour=COLOURS[k % len(COLOURS)]
        )
        for turn in range(max(1, seconds // 4))
    ]


def document(k: int, seconds: int, *, speech: bool) -> bytes:
    """Return a document of about `seconds` seconds with speech or movement; each `k` gives another one."""
    parts = []
    for turn, words in enumerate(sentences(k, seconds)):
        at = 4 * turn + k / 1000
        if speech:
            start = f"s{turn - 1}:end+0.4" if turn else str(at)
            parts.append(
                f'<speech id="s{turn}" start="{start}"><text>{words}</text></speech>'
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


def spent_by(pid: int | None) -> float:
    """Return the processor seconds of a process and of its ended children; 0 if they are unknown."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")


def spent() -> float:
    """Return the processor seconds of this process and of its ended descendants."""
    own = os.times()
    return own.user + own.system + own.children_user + own.children_system


def row(name: str, works: Iterator[Callable[[], float]], engine: Callable[[], float] = float) -> float:
    """Print the speed of pieces of work, which return their seconds of play; return the speed by core.

    Args:
        engine: returns the processor seconds of the speech engine.
    """
    played: list[float] = []
    own: list[float] = []
    noise, noise_seconds = Noise(), 0.0
    before, begin = engine(), time.perf_counter()
    for work in works:
        own.append(time.process_time())
        played.append(work())
        own[-1] = time.process_time() - own[-1]
        noise_seconds += noise.sample()
    others, clock = (engine() - before) / len(played), time.perf_counter() - begin - noise_seconds
    used = sum(own) + others * len(played)
    print(
        f"{name:30}{statistics.mean(played):7.1f} s{sum(played) / used:9.0f} x"
        f"{sum(played) / used * noise.factor:9.0f} x"
        f"{sum(played) / clock:9.0f} x{1000 * used / len(played):9.1f} ms{1000 * others:7.1f} ms{noise}",
        flush=True,
    )
    return sum(played) / used


def fap(name: str, voice: str, seconds: int, *, speech: bool) -> float:
    worker = Worker(Options(formats=(".fap",), voice=voice))

    def played(task: Task) -> Callable[[], float]:
        def play() -> float:
            result = worker.perform(task).row
            assert (result["status"], result["dropped"]) == ("done", []), result
            return float(result["duration"])

        return play

    first, *rest = (played(task) for task in tasks(DOCUMENTS + 1, seconds, speech=speech))
    first()  # reads tables and face, and starts the voice
    cost = row(name, iter(rest), lambda: spent_by(getattr(worker._speaker._voice, "pid", None)))
    worker.close()
    return cost


def floor(seconds: int, least: float) -> None:
    """Print the speed of espeak-ng alone; call it in a separate process.

    Args:
        least: the least time of `Noise` so far.
    """
    Noise.least = least
    engine = load([])
    worker = Worker(Options(formats=(".vtt",), voice="espeak"))

    def speak(k: int) -> Callable[[], float]:
        (task,) = islice(tasks(k + 1, seconds, speech=True), k, None)
        length = float(worker.perform(task).row["duration"])
        texts = [f"<speak>{words}</speak>" for words in sentences(k, seconds)]

        def say() -> float:
            for text in texts:
                engine.say({"text": text, "voice": ENGLISH, "wpm": WORDS_A_MINUTE})
            return length

        return say

    works = [speak(k) for k in range(1, DOCUMENTS + 1)]
    worker.close()
    row("  espeak-ng alone", iter(works))


def peer(seconds: int, ours: float) -> None:
    """Print the speed of openfacefx on the same sentences, from text and a length to a clip as JSON."""
    if find_spec("openfacefx") is None:
        print("openfacefx is not installed: pip install openfacefx")
        return
    openfacefx = import_module("openfacefx")
    worker = Worker(Options(formats=(".vtt",), voice="silent"))
    reader = openfacefx.G2P()

    def convert(task: Task, k: int) -> Callable[[], float]:
        length = worker.perform(task).row["duration"]
        texts = sentences(k, seconds)

        def make() -> float:
            for words in texts:
                track = openfacefx.generate_naive(words, length / len(texts), FPS, g2p=reader, gestures=True)
                json.dumps(openfacefx.to_dict(track))
            return float(length)

        return make

    works = [convert(task, k) for k, task in enumerate(tasks(DOCUMENTS + 1, seconds, speech=True))]
    works[0]()
    theirs = row("openfacefx, text to curves", iter(works[1:]))
    print(f"{'  ours with the silent voice':30}{'':9}{ours / theirs:9.2f} times as fast")
    worker.close()


def film(count: int) -> None:
    """Print the speed of films by two workers, with their start and after the first film of each."""
    pool = ProcessPool(Options(formats=(".mp4",), voice="silent", size=(512, 512)), 2)
    used, begin = spent(), time.perf_counter()
    done: list[tuple[float, float]] = []
    noise = Noise()
    for outcome in pool.perform(tasks(count, FILM, speech=True)):
        assert outcome.row["status"] == "done", outcome.row
        done.append((time.perf_counter(), outcome.row["duration"]))
        noise.sample()
    played, used = sum(length for _, length in done), spent() - used
    steady = sum(length for _, length in done[2:]) / (done[-1][0] - done[1][0])
    print(f"film, 512x512, {FPS} fps, {count} of {done[0][1]:.1f} s by two workers")
    print(f"{'  by clock, once both work':46}{steady:6.2f} x")
    print(f"{'  by clock, with their start':46}{played / (done[-1][0] - begin):6.2f} x")
    print(f"{'  by core, with their start':46}{played / used:6.2f} x")
    print(f"{'  noise, median and nine in ten':44}{noise}")


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    reader.add_argument("--films", type=int, metavar="N", help="measure N films instead of documents")
    films = reader.parse_args().films
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    calm = Noise()
    for _ in range(1000):
        calm.sample()
    print(f"load of the machine {load:.1f} a core before it begin")
    if films:
        film(films)
        return
    heads = (
        f"{'by core':>11}{'less noise':>11}{'by clock':>11}{'a document':>12}{'engine':>10}"
        f"{'noise':>9}{'nine in ten':>12}"
    )
    print(f"{'':30}{'each':>9}{heads}")
    for seconds in LENGTHS:
        fap("text to FAP, without speech", "silent", seconds, speech=False)
        silent = fap("text to FAP, silent voice", "silent", seconds, speech=True)
        fap("text to FAP, espeak", "espeak", seconds, speech=True)
        alone = get_context("spawn").Process(target=floor, args=(seconds, Noise.least))
        alone.start()
        alone.join()
        peer(seconds, silent)


if __name__ == "__main__":
    main()
