import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.voice_activity import Turn, VoiceActivity, spans_of_voice

RATE = 16_000


def sound(*spans, rate=RATE):
    """Return noise; each span is (seconds, root mean square)."""
    random = np.random.default_rng(1)
    parts = [level * random.standard_normal(round(seconds * rate)) for seconds, level in spans]
    return np.concatenate(parts).clip(-32768, 32767).astype(np.int16)


TALK = sound((1.0, 30), (2.0, 3000), (0.5, 30), (1.0, 2000), (1.5, 30))


def turns(heard, rate=RATE, step=0.02):
    """Return (turn, seconds) at which each is known."""
    activity, size = VoiceActivity(rate), round(step * rate)
    return [
        (turn, round((at + size) / rate, 2))
        for at in range(0, len(heard), size)
        for turn in activity.add(heard[at : at + size])
    ]


def test_voice_activity_tells_begins_pauses_and_ends() -> None:
    assert turns(TALK) == [
        (Turn.BEGINS, 1.1), (Turn.PAUSES, 3.3), (Turn.PAUSES, 4.8), (Turn.ENDS, 5.4)
    ]  # fmt: skip


@pytest.mark.parametrize("rate", [8000, 44_100])
def test_voice_activity_is_the_same_at_other_rates(rate) -> None:
    spans = (1.0, 30), (2.0, 3000), (1.5, 30)
    assert [turn for turn, _ in turns(sound(*spans, rate=rate), rate)] == [
        Turn.BEGINS, Turn.PAUSES, Turn.ENDS
    ]  # fmt: skip


@given(st.lists(st.integers(0, 40_000), max_size=12))
def test_voice_activity_does_not_depend_on_the_pieces(cuts) -> None:
    pieces, activity = np.split(TALK, sorted(cuts)), VoiceActivity(RATE)
    assert [turn for piece in pieces for turn in activity.add(piece)] == [turn for turn, _ in turns(TALK)]


@pytest.mark.parametrize(("louder", "heard"), [(2.4, False), (4.2, True)])
def test_voice_activity_hears_a_voice_louder_than_the_room(louder, heard) -> None:
    found = turns(sound((3.0, 200), (1.0, 200 * louder), (1.5, 200)))
    assert bool(found) is heard


def test_voice_activity_gets_used_to_a_louder_background() -> None:
    fan = sound((0.5, 30), (20.0, 400))
    assert [turn for turn, _ in turns(fan)] == [Turn.BEGINS, Turn.PAUSES, Turn.ENDS]
    over = np.concatenate([fan, sound((1.0, 4000)), sound((1.5, 400))])
    assert [turn for turn, _ in turns(over)][3:] == [Turn.BEGINS, Turn.PAUSES, Turn.ENDS]


def test_voice_activity_ignores_clicks_and_offsets() -> None:
    assert turns(np.concatenate([sound((1.0, 30), (0.05, 9000), (1.0, 30)), sound((1.0, 30)) + 5000])) == []


def test_voice_activity_ends_a_turn_with_the_sound() -> None:
    activity = VoiceActivity(RATE)
    assert activity.end() == []
    activity.add(TALK[: 2 * RATE])
    assert activity.end() == [Turn.ENDS]


def test_spans_of_voice_are_louder_than_the_background() -> None:
    heard = sound((1.0, 300), (1.0, 3000), (1.0, 300), (0.02, 3000), (1.0, 300))
    assert spans_of_voice(heard, RATE) == [(pytest.approx(0.7, abs=0.02), pytest.approx(2.3, abs=0.02))]
    assert spans_of_voice(sound((2.0, 300)), RATE) == []
    assert spans_of_voice(sound((2.0, 0)), RATE) == []


def test_spans_of_voice_of_a_short_sound_are_all_of_it() -> None:
    assert spans_of_voice(sound((0.3, 300)), RATE) == [(0.0, 0.3)]
