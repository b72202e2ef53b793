"""Whatever can come in, broken in every way: a seed in, an exception out where something does not stand it.

Run: python -m tests.fuzz [--minutes 10] [--seed 0] [--only documents tasks heads ...]

Each try prints nothing; one that fails prints its target and its seed, with which it fails again.
"""

from __future__ import annotations

import argparse
import itertools
import json
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import TypeVar
from urllib.parse import quote

import numpy as np

from bml_schema import Block, BlockProgress, BMLError, WarningFeedback, read
from bml_schema.feedback import parse_feedback
from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import RealizerError
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings
from realizer.outputs.fap_text import encode
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech
from realizer.protocol.messages.parse import parse_control
from realizer.protocol.messages.replies import ErrorMessage
from realizer.server.http.http_site import HttpSite
from realizer.server.session.effects import Send
from realizer.server.session.session import Session
from realizer.server.transports.message_formats import Disconnect, Inbound
from realizer.server.transports.xface.attachments import prepare
from realizer.server.transports.xface.tasks import ABLE, UNABLE, Answer, TaskRunner
from realizer.server.transports.xface.wire import Fault, Task, TaskReader, pack_task, read_notes
from realizer.speech.silent import SilentVoice
from tests.fuzz_files import FILES, file_tried
from tests.interleavings import CONTROLS, FILTERS, Interleaving, no_error
from tests.mutants import mutants

T = TypeVar("T")

__all__ = ["TARGETS", "corpus", "no_hang", "plays", "tried"]

CORPUS = Path(__file__).parent / "corpus"
# s of CPU for one try: far above the 0.1 s that is aimed at, so that a busy machine is no fault.
HANG = 100.0  # s of CPU time, hundreds of times what a try takes
LIMIT = 20_000  # bytes of an Xface task
STEPS = 40  # of an interleaving
# What stands in the place of a value of a control message.
VALUES = (None, True, 0, -1, 1e308, 2**70, "", "x" * 300, "\ud800", [], {}, [[]], {"a": {}}, ["a", 1], "12L")


class HangError(Exception):
    """A try hangs."""


@contextmanager
def no_hang(what: object) -> Iterator[None]:
    """Interrupt code that hangs."""

    def ring(*_: object) -> None:
        raise HangError(what)

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, HANG)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


@cache
def corpus() -> tuple[bytes, ...]:
    """The documents of the tests."""
    return tuple(path.read_bytes() for path in sorted(CORPUS.rglob("*.xml")))


def tried(target: str, seeds: range) -> None:
    """Try a target with each of the seeds.

    Raises:
        AssertionError: one failed; with its seed.
    """
    for seed in seeds:
        sound = SOURCES.get(target)
        mutant = b"" if sound is None else next(mutants(sound(), 1, seed))
        try:
            with no_hang(f"{target} {seed}"):
                TARGETS[target](seed, mutant)
        except Exception as wrong:
            raise AssertionError(f"python -m tests.fuzz --only {target} --seed {seed}") from wrong


def _or_words(read: Callable[[], T]) -> T | RealizerError:
    """Return the result of reading, or the error."""
    try:
        return read()
    except RealizerError as error:
        wrong = error
    assert "wanted" in str(wrong), wrong
    return wrong


# documents --------------------------------------------------------------------------------------


def documents(seed: int, mutant: bytes) -> None:
    """Check that a broken document gives blocks and errors, and that the blocks play to their end."""
    items = list(read(mutant, VOCABULARY))
    assert all(isinstance(item, Block | BMLError) for item in items), mutant
    plays(items, faces=seed % 20 == 0)


def plays(items: list[Block | BMLError], *, faces: bool) -> None:
    """Submit the blocks, and advance time from deadline to deadline until the end."""
    player = Player(PlayOptions(idle=False))
    for item in items:
        if isinstance(item, Block):
            schedule = submit_with_speech(player, item, SilentVoice())
            for points in schedule.times.values():
                assert np.isfinite(points).all()
                assert (np.diff(points) >= 0).all()
    if faces:
        frames = player.frames(np.linspace(0, min(player.end, 1e5), 5))
        assert np.isfinite(frames.values).all()
    for _ in range(100_000):
        deadline = player.next_deadline()
        if deadline is None:
            break
        for feedback in player.due(max(deadline, 0.0)):
            assert feedback.to_xml()
    else:
        raise AssertionError("it goes on for ever")
    waiting = [b for b in player.state(1e6)["blocks"] if b["status"] not in ("PENDING", "LURKING")]
    assert not waiting


# FAP files --------------------------------------------------------------------------------------


@cache
def fap_files() -> tuple[bytes, ...]:
    """Return valid files of both versions: with few FAPs and all, one frame and many, and with visemes."""
    found = [path.read_bytes() for path in sorted(CORPUS.rglob("*.fap"))]
    random = np.random.default_rng(0)
    for count, mask in ((1, [2]), (3, [0, 2, 3]), (5, range(68)), (40, [1, 18, 19, 47])):
        used = np.isin(np.arange(68), mask)
        values = np.where(used, random.integers(-900, 900, (count, 68)), 0).astype(np.int32)
        values[:, :2] = 0
        visemes = np.full((count, 4), 3 if used[0] else 0, np.int32)
        expressions = np.full((count, 6), 1 if used[1] else 0, np.int32)
        clip = FAPClip("x", 25.0, values, used, visemes, expressions)
        found += [encode(clip).encode(), encode(clip.from_frame(count // 2)).encode()]
    return tuple(found)


def faps(seed: int, mutant: bytes) -> None:
    """Check that a broken FAP file is a clip that plays and can be written, or a clear error."""
    clip = _or_words(lambda: read_fap(mutant))
    if not isinstance(clip, FAPClip):
        return
    count = len(clip.values)
    assert clip.values.shape == (count, 68)
    assert clip.mask.shape == (68,)
    assert np.isfinite(clip.frames().values).all()
    assert read_fap(encode(clip)).values.shape == clip.values.shape
    if 0 < count < 200:
        assert clip.resampled(30.0).values.shape[1:] == (68,)


# Xface tasks ------------------------------------------------------------------------------------


@cache
def task_streams() -> tuple[bytes, ...]:
    """Return streams of clients of the player, with several tasks each."""
    texts = [file.decode() for file in fap_files()]
    script = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'
    streams = []
    for n, text in enumerate(texts):
        tasks = [
            Task("UPLOAD_FAP", 1, n, (text,)),
            Task("RESUME_PLAYBACK", 1, n + 1),
            Task("UPLOAD_SCRIPT", 1, n + 2, (f"<![CDATA[{script}]]>", "BML")),
            *(Task(name, n % 2, 9) for name in sorted(ABLE + UNABLE) if name != "UPLOAD_WAV"),
            Task("UPLOAD_WAV", 1, 3, ("x.wav", "5")),
        ]
        streams.append(b"".join(pack_task(task) for task in tasks[n % 3 :]) + b"RIFF\0")
    return tuple(streams)


def tasks(seed: int, mutant: bytes) -> None:
    """Check that broken tasks are found however the stream is cut, and that a player answers them."""
    random, reader, whole = Random(seed), TaskReader(LIMIT), TaskReader(LIMIT)
    found: list[Task | Fault] = []
    at = 0
    while at < len(mutant):
        size = random.choice((1, 7, 100, 1000, 10_000))
        found += reader.feed(mutant[at : at + size])
        at += size
    once = whole.feed(mutant)
    # A text that is too long is let go of when it is too long: how much of it is shown depends on the cuts.
    if not any(isinstance(one, Fault) for one in (*found, *once)):
        assert found == once, mutant
    desk, now, settings = TaskRunner(1), 0.0, Settings(media=CORPUS / "media")
    for one in found[:60]:
        if isinstance(one, Task):
            _answered(desk, list(desk.accept(one)), now)
            brought = _or_words(lambda one=one: prepare(one, settings))
            _answered(desk, list(desk.run(one, brought, now)), now)
            now += random.choice((0.0, 0.1, 3.0))


def _answered(desk: TaskRunner, answers: list[Answer], now: float) -> None:
    """Check notes and messages to the session, and the answers to them."""
    for answer in answers:
        if isinstance(answer, bytes):
            assert len(read_notes(bytearray(answer))) == 1, answer
        elif isinstance(answer, Inbound) and answer.text.startswith("{"):
            control = parse_control(answer.text)
            assert not isinstance(control, ErrorMessage), control
        elif isinstance(answer, Inbound):
            for item in read(answer.text, VOCABULARY):
                if isinstance(item, Block):
                    refused = WarningFeedback(id=item.id, type="IMPOSSIBLE_TO_SCHEDULE", text="no")
                    start = BlockProgress(id=f"{item.id}:start", global_time=now)
                    reply = refused if len(item.id) % 2 else start
                    _answered(desk, list(desk.on_feedback(reply.to_xml(), now)), now)
        else:
            assert isinstance(answer, Disconnect)


# control messages -------------------------------------------------------------------------------


def controls(seed: int, _: bytes) -> None:
    """Check that control messages with random values are followed or answered by one error."""
    random = Random(seed)
    session = Session("fuzz", Settings(), 0.0, named=True)
    session.connect(1, 0.0)
    texts = [json.dumps(message).encode() for message in (*CONTROLS, *FILTERS)]
    broken = mutants(texts, 10, seed)
    now = 0.0
    with no_error():
        for _step in range(10):
            if random.random() < 0.5:
                text = next(broken).decode("utf-8", "replace")
                if not text.lstrip("\ufeff \t\r\n").startswith("{"):
                    continue
            else:
                message = json.loads(random.choice(texts))
                for _change_of in range(random.choice((1, 1, 2, 3))):
                    _change(message, random)
                text = json.dumps(message)
            session.receive(1, text, now)
            now += random.choice((0.0, 0.05, 1.0))
            session.tick(now)
            _sent(session)
        session.receive(1, '{"type":"ping","id":"last"}', now)
        assert '"last"' in _sent(session)


def _change(message: dict[str, object], random: Random) -> None:
    """Change a random place of a value, at any depth."""
    place: object = message
    while isinstance(place, dict) and place:
        key = random.choice(list(place))
        if not isinstance(place[key], dict) or not place[key] or random.random() < 0.3:
            value = deepcopy(random.choice(VALUES))
            place[key if random.random() < 0.8 else random.choice(("type", "x", "", "a:b"))] = value
            return
        place = place[key]


def _sent(session: Session) -> str:
    """Return all readable messages to a client."""
    messages = [effect.data for effect in session.take_effects() if isinstance(effect, Send)]
    for data in messages:
        if isinstance(data, str) and data.startswith("<"):
            assert "internal error" not in data, data
            parse_feedback(data)
        elif isinstance(data, str):
            json.loads(data)
    return "\n".join(data for data in messages if isinstance(data, str))


# sessions ---------------------------------------------------------------------------------------


def sessions(seed: int, _: bytes) -> None:
    """Check the laws of sessions with random actions; the journal of a third of them fails."""
    Interleaving(seed, corpus(), full=0.2 if seed % 3 == 2 else 0.0).run(STEPS)


# addresses --------------------------------------------------------------------------------------


@cache
def site() -> HttpSite:
    return HttpSite()


@cache
def addresses() -> tuple[bytes, ...]:
    """Return addresses that compute, with their queries."""
    queries = {
        "/pose.fap?face=ada&set=": {"type": "set", "aus": {"12": 0.5, "2L": 1}, "faps": {"open_jaw": 300}},
        "/pose.fap?set=": {"type": "set", "emotion": {"name": "joy"}},
        "/feeling.json?of=": {"angle": 67.5, "activation": 5, "profile": "own"},
        "/look.json?light=evening&face=": "ada",
        "/faces/": "ada.glb",
    }
    texts = (
        start + quote(rest if isinstance(rest, str) else json.dumps(rest)) for start, rest in queries.items()
    )
    return tuple(text.encode() for text in texts)


def urls(seed: int, mutant: bytes) -> None:
    """Check that a broken address is answered, and that no answer names a folder."""
    answer = site().answer(mutant.decode("latin-1"))
    assert answer.status_code in (200, 400, 404), answer
    if answer.status_code != 200:
        assert str(CORPUS.parents[1]).encode() not in answer.body, answer


# files ------------------------------------------------------------------------------------------


def files(kind: str, seed: int, _: bytes) -> None:
    """Check that a broken file of a kind is read, or refused by a message that says which file."""
    file_tried(FILES[kind], seed)


# What is broken for a target.
SOURCES: Mapping[str, Callable[[], tuple[bytes, ...]]] = {
    "documents": corpus,
    "faps": fap_files,
    "tasks": task_streams,
    "urls": addresses,
}
TARGETS: Mapping[str, Callable[[int, bytes], None]] = {
    "documents": documents,
    "faps": faps,
    "tasks": tasks,
    "controls": controls,
    "sessions": sessions,
    "urls": urls,
    **{kind: partial(files, kind) for kind in FILES},
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="of CPU time; 0: one try")
    parser.add_argument("--seed", type=int, default=0, help="to begin with")
    parser.add_argument("--only", nargs="+", choices=TARGETS, default=list(TARGETS))
    arguments = parser.parse_args()
    done: Counter[str] = Counter()
    failed = 0
    printed = end = time.process_time()
    end += 60 * arguments.minutes
    for seed in itertools.count(arguments.seed):
        for target in arguments.only:
            try:
                tried(target, range(seed, seed + 1))
            except AssertionError:
                traceback.print_exc()
                failed += 1
            done[target] += 1
        if (now := time.process_time()) >= end or now >= printed + 20:
            printed = now
            print(f"seeds {arguments.seed}..{seed}: {dict(done)}, {failed} failed", flush=True)
        if now >= end:
            break
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
