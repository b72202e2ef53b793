"""The law of live and offline: a session plays documents as `realize` does, and its feedback is in order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from random import Random
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bml_schema import BlockProgress, Feedback, SyncPointProgress, WarningFeedback, parse_feedback
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings
from realizer.pipeline import plan
from realizer.playback.player import Player
from realizer.server.session.effects import Send, Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.registry import find_voice
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Voice
from tests.wake_times import next_wake

NAMES = "abcdefg"
FRAMES = 30  # of a session
# {other} may be a block that arrives later, {earlier} not: commands look for their target when they act.
BODIES = (
    '<wait id="w" duration="0.5"/>',
    '<head id="n" lexeme="NOD"/>',
    '<gaze id="g" target="cup" start="0.2" end="1.4"/>',
    '<speech id="s"><text>One <sync id="m"/>two.</text></speech>',
    '<speech id="s"><text>Three</text></speech><head id="n" lexeme="NOD" stroke="s:end"/>',
    '<head id="n" lexeme="SHAKE" start="{other}:n:start"/><wait id="w" duration="0.3"/>',
    '<faceLexeme id="f" lexeme="SMILE" start="{other}:s:m" end="{other}:bml:end"/>',
    '<bmla:interrupt id="i" target="{earlier}"/><speech id="s" start="i:end"><text>Yes</text></speech>',
    '<bmla:activate id="i" target="{earlier}" start="0.4"/>',
    '<speech id="s"><text>Four</text></speech><speech id="t" start="0.35"><text>Five six</text></speech>',
    '<required><head id="n" lexeme="NOD" start="{other}:s:end"/></required>',
    '<required><speech id="s"><text>Must be said</text></speech></required>',
    '<gazeShift id="h" target="RIGHT" start="{other}:bml:end"/>',
    '<bmla:parametervaluechange id="p" target="{earlier}:s" paramId="volume" start="0.1">'
    '<bmla:trajectory type="instant" targetValue="20"/></bmla:parametervaluechange>',
)
VISIBLE = (
    *BODIES,
    '<gazeShift id="h" target="LEFT" end="0.6"/><faceFacs id="u" au="4" amount="0.5" start="0.2" end="1"/>',
    '<bmla:interrupt id="j" target="{earlier}" start="0.3"/>',
)
HEADS = (
    *(
        "",
        "",
        "",
        'composition="APPEND"',
        'composition="APPEND"',
        'composition="REPLACE"',
        'characterId="Ann"',
        'characterId="Ann" composition="REPLACE"',
        'characterId="Bob" composition="APPEND"',
    ),
    *(f'bmla:{name}="{{other}}"' for name in ("appendAfter", "chunkAfter", "interrupt")),
    'bmla:onStart="{earlier}"',
    *(f'bmla:{name}="{{other}}"' for name in ("prependBefore", "chunkBefore")),
    'bmla:preplan="true"',
)

# The second speech has begun to move the lips when an interrupt cancels it.
CUT_BEFORE_SECOND_SPEECH = [
    f'<bml id="a">{BODIES[9]}</bml>',
    '<bml xmlns:bmla="http://www.asap-project.org/bmla" id="b">'
    '<bmla:interrupt id="i" target="a" start="0.3"/></bml>',
]
# A gaze moves the head sooner than it was planned, because what it waits for is interrupted.
MOVED_BY_A_CUT = [*CUT_BEFORE_SECOND_SPEECH, f'<bml id="c" composition="APPEND">{BODIES[2]}</bml>']


@st.composite
def sessions(draw: st.DrawFn, heads: Sequence[str] = HEADS, bodies: Sequence[str] = BODIES) -> list[str]:
    """Return 2 to 7 documents that name earlier ones, and sometimes the next one."""
    documents = []
    for n, id in enumerate(NAMES[: draw(st.integers(2, 7))]):
        earlier = draw(st.sampled_from((*NAMES[:n], "nobody")))
        other = draw(st.sampled_from((earlier, *NAMES[n + 1 : n + 2])))
        body = "".join(draw(st.lists(st.sampled_from(bodies), max_size=2, unique=True)))
        text = f'<bml xmlns:bmla="http://www.asap-project.org/bmla" id="{id}" {draw(st.sampled_from(heads))}>'
        documents.append(f"{text}{body}</bml>".replace("{other}", other).replace("{earlier}", earlier))
    return documents


def offline(documents: Sequence[str], voice: Voice) -> list[Feedback]:
    """Return the feedback of documents that are submitted at 0 s, one after the other."""
    player = Player(PlayOptions(idle=False), history=float("inf"))
    plan(documents, player, voice)
    return player.due(float("inf"))


def live(messages: Sequence[str], voice: Voice, order: Random | None = None) -> list[Feedback]:
    """Return the feedback of a session whose clock stands still until all messages have been planned."""
    return played(Session("test", Settings(idle=False), 0.0), messages, voice, order)


def played(
    session: Session,
    messages: Sequence[str],
    voice: Voice,
    order: Random | None = None,
    looks: Mapping[float, Callable[[], None]] = MappingProxyType({}),
) -> list[Feedback]:
    """Play messages in a session whose clock stands still until all have been planned; return the feedback.

    Args:
        order: the voices answer in a random order, before or after the next message; None: at once.
        looks: times, and what is then called.
    """
    session.connect(1, 0.0)
    now, got, requests = 0.0, list[str](), list[Speak]()
    coming = sorted(looks, reverse=True)

    def collect() -> None:
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                requests.append(effect)
            elif isinstance(effect, Send) and isinstance(effect.data, str):
                got.append(effect.data)

    def answer(least: int = 0) -> None:
        while len(requests) > least:
            speak = requests.pop(0 if order is None else order.randrange(len(requests)))
            session.on_speech(speak.id, speak_to_length(voice, speak.request), now)
            collect()

    def read() -> None:
        while session.has_documents:
            session.tick(now)
            collect()

    for message in messages:
        session.receive(1, message, now)
        collect()
        read()
        answer(0 if order is None else order.randint(0, len(requests)))
    while requests:
        answer()
        read()
    while (deadline := next_wake(session)) < float("inf") or coming:
        looks_first = bool(coming) and coming[-1] < deadline
        now = max(now, coming[-1] if looks_first else deadline)
        session.tick(now)
        collect()
        answer()
        if looks_first:
            looks[coming.pop()]()
    return [parse_feedback(text) for text in got]


def revoked(feedback: Sequence[Feedback]) -> set[str]:
    """Return the blocks that were ended before they started."""
    ends = (f for f in feedback if isinstance(f, BlockProgress) and f.status == "REVOKED")
    return {f.id.removesuffix(":end") for f in ends}


def events(feedback: Sequence[Feedback], unplanned: Collection[str] = ()) -> Counter[tuple[str, str, float]]:
    """Return what happened: the points of blocks and behaviours with their times, and the warnings.

    Args:
        unplanned: blocks that were perhaps revoked before their voice came: nothing but a start counts.
    """
    seen: Counter[tuple[str, str, float]] = Counter()
    kinds = BlockProgress | SyncPointProgress | WarningFeedback
    for message in (f for f in feedback if isinstance(f, kinds)):
        if message.id.partition(":")[0] in unplanned and not message.id.endswith(":start"):
            continue
        if isinstance(message, WarningFeedback):
            seen[message.type, message.id, 0.0] += 1
        else:
            seen[type(message).__name__, message.id, round(message.global_time, 4)] += 1
    return seen


def in_order(feedback: Sequence[Feedback]) -> None:
    """Feedback rises in time; each point comes once, between the start and the end of its block."""
    progress = [f for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)]
    times = [f.global_time for f in progress]
    assert times == sorted(times)
    assert max(Counter(f.id for f in progress).values(), default=1) == 1
    begun, ended = set[str](), set[str]()
    for message in progress:
        block, _, point = message.id.partition(":")
        if isinstance(message, SyncPointProgress):
            assert block in begun
            assert block not in ended
        else:
            (begun if point == "start" else ended).add(block)
    assert begun <= ended


@pytest.mark.parametrize(("name", "share"), [("silent", 1), ("espeak", 10)])
def test_session_equals_offline(request: pytest.FixtureRequest, name: str, share: int) -> None:
    voice = find_voice(name)

    @settings(max_examples=request.config.getoption("--sessions") // share)
    @given(sessions(), st.booleans(), st.none() | st.randoms(use_true_random=False))
    def law(documents: list[str], at_once: bool, order: Random | None) -> None:
        expected = offline(documents, voice)
        feedback = live(["".join(documents)] if at_once else documents, voice, order)
        in_order(expected)
        in_order(feedback)
        unplanned = revoked(feedback) | revoked(expected)
        assert events(feedback, unplanned) == events(expected, unplanned)

    try:
        law()
    finally:
        voice.close()


def test_session_shows_the_frames_of_offline(request: pytest.FixtureRequest) -> None:
    voice = SilentVoice()

    @settings(max_examples=request.config.getoption("--sessions") // 10)
    @given(sessions(bodies=VISIBLE))
    @example(CUT_BEFORE_SECOND_SPEECH)
    @example(MOVED_BY_A_CUT)
    def law(documents: list[str]) -> None:
        player = Player(PlayOptions(seed=3), history=float("inf"))
        plan(documents, player, voice)
        player.due(float("inf"))
        faces = range(len(player.characters))
        times = np.linspace(0.0, player.end + 0.7, FRAMES)
        session, shown = Session("test", Settings(seed=3), 0.0), list[Sequence[np.ndarray]]()

        def look(time: float) -> None:
            shown.append([session.player.frames(np.array([time]), face).values[0] for face in faces])

        played(session, documents, voice, looks={time: partial(look, time) for time in times.tolist()})
        for face in faces:
            expected = player.frames(times, face).values
            assert np.abs(expected - [frames[face] for frames in shown]).max() < 1e-4

    law()
