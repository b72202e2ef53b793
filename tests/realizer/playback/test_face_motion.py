"""Tests of the motion of faces."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realizer.animation.axis import AU_NAMES
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from tests.realizer.playback.players import SMILE, au, submit

# The parts that idle motion and prosody move: brows, lids, head, eyes.
OWN = ("1L", "1R", "2L", "2R", "45L", "45R", *map(str, range(51, 57)), *map(str, range(61, 65)))
WORDS = "Whoever follows the river to the tower, will discover a little door."
TALK = f'<speech id="t"><text>{WORDS}</text></speech>'
MOODS = [
    f'<faceShift id="m" end="0.4"><faceLexeme id="l" lexeme="{name}" amount="{amount}"/></faceShift>'
    for name, amount in (("JOY", 1.0), ("SADNESS", 0.1))
]


@given(st.integers(0, 2**31), st.floats(0, 200))
def test_frames_at_25_fps_are_every_second_of_50(seed: int, start: float) -> None:
    player = Player(PlayOptions(seed=seed))
    submit(player, SMILE, now=start)
    slow = player.frames(start + np.arange(40) / 25)
    fast = player.frames(start + np.arange(80) / 50)
    assert np.allclose(slow.values, fast.values[::2], atol=1e-6)


def test_prosody_off_leaves_a_speaking_face_as_idle_as_a_silent_one() -> None:
    times = np.arange(0.0, 8.0, 0.04)
    own = np.array([name in OWN for name in AU_NAMES()])
    silent, still, lively = (
        Player(PlayOptions(seed=4)),
        Player(PlayOptions(seed=4, prosody=False)),
        Player(PlayOptions(seed=4)),
    )
    submit(still, TALK)
    submit(lively, TALK)
    np.testing.assert_array_equal(still.frames(times).aus[:, own], silent.frames(times).aus[:, own])
    assert not np.array_equal(lively.frames(times).aus[:, own], silent.frames(times).aus[:, own])


def test_prosody_needs_idle_motion() -> None:
    times = np.arange(0.0, 8.0, 0.04)
    one, other = Player(PlayOptions(idle=False)), Player(PlayOptions(idle=False, prosody=False))
    submit(one, TALK)
    submit(other, TALK)
    np.testing.assert_array_equal(one.frames(times).values, other.frames(times).values)


def test_prosody_of_a_still_face_is_still() -> None:
    times = np.arange(0.2, 8.0, 0.04)
    still = '<own:idle id="i" blinks="0" motion="0" start="0" end="0.1"/>'
    player = Player()
    submit(player, still + TALK, "b", 'xmlns:own="urn:bml-realizer:1"')
    own = [AU_NAMES().index(name) for name in OWN]
    assert player.frames(times).aus[:, own].max() == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_prosody_leaves_a_nod_of_the_document_unchanged(seed: int) -> None:
    nod = '<head id="n" lexeme="NOD" start="1.5" end="3"/>'
    lively, still = Player(PlayOptions(seed=seed)), Player(PlayOptions(seed=seed, prosody=False))
    for player in (lively, still):
        submit(player, TALK + nod)
    heads = [AU_NAMES().index(str(number)) for number in range(51, 57)]
    during = np.arange(1.5, 3.001, 0.02)
    shown, wanted = (p.frames(during).aus[:, heads] for p in (lively, still))
    np.testing.assert_array_equal(shown, wanted)


def test_frames_of_the_head_in_speech_follow_the_mood() -> None:
    def lifted(*shifts: str) -> float:
        player = Player(PlayOptions(seed=3, liveliness=0.0))
        for shift in shifts:
            submit(player, shift, "a")
        submit(player, TALK, "b", now=1.0)
        up, down = (au(player, name, *np.arange(2.0, 4.0, 0.02)) for name in ("53", "54"))
        return float(np.mean(up) - np.mean(down))

    assert lifted(MOODS[0]) > lifted() + 0.01


@pytest.mark.parametrize("idle", [True, False])
def test_frames_of_the_mouth_in_speech_follow_what_the_face_shows(idle: bool) -> None:
    def open_jaw(lexeme: str) -> float:
        player = Player(PlayOptions(idle=idle, liveliness=0.0))
        submit(player, TALK + f'<faceLexeme id="f" lexeme="{lexeme}" start="t:start" end="t:end"/>')
        return float(player.frames(np.arange(0.0, 4.0, 0.04)).faps[:, 2].max())

    assert open_jaw("ANGER") > 1.1 * open_jaw("DISGUST") > 1.1 * open_jaw("SADNESS")


@settings(max_examples=12)
@given(
    st.integers(0, 1000),
    st.lists(st.floats(0.0, 12.0), min_size=1, max_size=3),
    st.floats(0.0, 12.0),
    st.lists(st.floats(0.0, 14.0), max_size=2),
)
def test_frames_while_speech_grows_are_those_of_the_playback(
    seed: int, starts: list[float], nod: float, moods: list[float]
) -> None:
    """Dropping ended blocks changes neither past nor future frames."""
    live, played = Player(PlayOptions(seed=seed)), Player(PlayOptions(seed=seed), history=float("inf"))
    others = [(nod, '<head id="n" lexeme="NOD"/>')]
    others += [(mood, MOODS[k]) for k, mood in enumerate(sorted(moods))]
    todo = sorted([(start, TALK) for start in starts] + others)
    own = [AU_NAMES().index(name) for name in OWN]
    seen = []
    times = np.arange(0.0, 26.0, 0.16)
    for number, now in enumerate(times):
        while todo and todo[0][0] <= now:
            _, content = todo.pop(0)
            for player in (live, played):
                submit(player, content, f"b{number}-{len(todo)}", now=float(now))
        for player in (live, played):
            player.due(float(now))
        seen.append(live.frames(np.array([now])).aus[0, own])
    np.testing.assert_array_equal(np.array(seen), played.frames(times).aus[:, own])
