"""The law of live and offline: a session plays documents as `realize` does, and its feedback is in order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence

import pytest
from hypothesis import given, settings
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
from realizer.speech.utterance import Voice
from tests.wake_times import next_wake

NAMES = "abcdefg"
BODIES = (
    '<wait id="w" duration="0.5"/>',
    '<head id="n" lexeme="NOD"/>',
    '<gaze id="g" target="cup" start="0.2" end="1.4"/>',
    '<speech id="s"><text>One <sync id="m"/>two.</text></speech>',
    '<speech id="s"><text>Three</text></speech><head id="n" lexeme="NOD" stroke="s:end"/>',
    '<head id="n" lexeme="SHAKE" start="{other}:n:start"/><wait id="w" duration="0.3"/>',
    '<faceLexeme id="f" lexeme="SMILE" start="{other}:s:m" end="{other}:bml:end"/>',
    '<bmla:interrupt id="i" target="{other}"/><speech id="s" start="i:end"><text>Yes</text></speech>',
    '<bmla:activate id="i" target="{other}" start="0.4"/>',
    '<speech id="s"><text>Four</text></speech><speech id="t" start="0.35"><text>Five six</text></speech>',
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
    ),
    *(f'bmla:{name}="{{other}}"' for name in ("appendAfter", "chunkAfter", "interrupt", "onStart")),
    *(f'bmla:{name}="{{other}}"' for name in ("prependBefore", "chunkBefore")),
    'bmla:preplan="true"',
)


@st.composite
def sessions(draw: st.DrawFn) -> list[str]:
    """Return 2 to 7 documents that name earlier ones."""
    documents = []
    for n, id in enumerate(NAMES[: draw(st.integers(2, 7))]):
        other = draw(st.sampled_from((*NAMES[:n], "nobody")))
        body = "".join(draw(st.lists(st.sampled_from(BODIES), max_size=2, unique=True)))
        text = f'<bml xmlns:bmla="http://www.asap-project.org/bmla" id="{id}" {draw(st.sampled_from(HEADS))}>'
        documents.append(f"{text}{body}</bml>".replace("{other}", other))
    return documents


def offline(documents: Sequence[str], voice: Voice) -> list[Feedback]:
    """Return the feedback of documents that are submitted at 0 s, one after the other."""
    player = Player(PlayOptions(idle=False), history=float("inf"))
    plan(documents, player, voice)
    return player.due(float("inf"))


def live(messages: Sequence[str], voice: Voice) -> list[Feedback]:
    """Return the feedback of a session whose clock stands still until all messages have been planned."""
    session = Session("test", Settings(idle=False), 0.0)
    session.connect(1, 0.0)
    now, got = 0.0, list[str]()

    def collect() -> None:
        while effects := session.take_effects():
            for effect in effects:
                if isinstance(effect, Speak):
                    session.on_speech(effect.id, speak_to_length(voice, effect.request), now)
                elif isinstance(effect, Send) and isinstance(effect.data, str):
                    got.append(effect.data)

    for message in messages:
        session.receive(1, message, now)
        collect()
    while (deadline := next_wake(session)) < float("inf"):
        now = max(now, deadline)
        session.tick(now)
        collect()
    return [parse_feedback(text) for text in got]


def ended_at_once(feedback: Sequence[Feedback]) -> set[str]:
    """Return the blocks that ended at 0 s. Those that wait for their voice are revoked before they start."""
    ends = (f for f in feedback if isinstance(f, BlockProgress) and f.global_time == 0)
    return {f.id.partition(":")[0] for f in ends if f.id.endswith(":end")}


def events(feedback: Sequence[Feedback], without: Collection[str]) -> Counter[tuple[str, str, float]]:
    """Return what happened: the points of blocks and behaviours with their times, and the warnings."""
    said: Counter[tuple[str, str, float]] = Counter()
    for message in feedback:
        if getattr(message, "id", "").partition(":")[0] in without:
            continue
        if isinstance(message, BlockProgress | SyncPointProgress):
            said[type(message).__name__, message.id, round(message.global_time, 4)] += 1
        elif isinstance(message, WarningFeedback):
            said[message.type, message.id, 0.0] += 1
    return said


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
    @given(sessions())
    def law(documents: list[str]) -> None:
        expected = offline(documents, voice)
        in_order(expected)
        for messages in (documents, ["".join(documents)]):
            feedback = live(messages, voice)
            in_order(feedback)
            gone = ended_at_once(feedback) | ended_at_once(expected)
            assert events(feedback, gone) == events(expected, gone)

    try:
        law()
    finally:
        voice.close()
