from dataclasses import replace

import numpy as np
import pytest

from realizer.animation.axis import au
from realizer.animation.curves import sample
from realizer.animation.idle.speaking_head import head_channels
from realizer.animation.speaking_style import Style
from realizer.speech.utterance import Phoneme, Utterance, Word
from realizer.tables import by_number

TURNS = {"yaw": (51, 52), "pitch": (53, 54), "roll": (55, 56), "eyes": (63, 64)}


def said(seconds=6.0):
    """An utterance without sound: a stressed syllable every half second."""
    starts = np.arange(0.0, seconds, 0.25)
    phonemes = [Phoneme(t, t + 0.25, "a", k % 2) for k, t in enumerate(starts.tolist())]
    return Utterance(seconds, (Word(0.0, seconds, "word"),), tuple(phonemes), {})


def turned(channels, times):
    """Return direction -> signed degrees at the times."""
    rows = sample(channels, times)
    found = {name: np.zeros(len(times)) for name in TURNS}
    for name, pair in TURNS.items():
        for number, sign in zip(pair, (1, -1), strict=True):
            for channel, row in zip(channels, rows, strict=True):
                if channel.target == au(number)[0]:
                    found[name] += sign * by_number()[number].degrees * row
    return found


TIMES = np.arange(0.0, 8.0, 0.04)


def test_head_channels_move_while_somebody_speaks_and_settle() -> None:
    head = turned(head_channels(said(), 1.0, np.inf, seed=1), TIMES)
    for name, least, most in (("yaw", 1.0, 5.0), ("pitch", 1.5, 8.0), ("roll", 0.5, 4.0)):
        assert least <= np.ptp(head[name]) <= most, name
        assert not head[name][(TIMES < 1.0) | (TIMES > 7.5)].any()
    speed = np.hypot(np.gradient(head["pitch"], 0.04), np.gradient(head["yaw"], 0.04))
    speaking = (TIMES > 1.3) & (TIMES < 6.5)
    assert (speed[speaking] > 1.5).mean() > 0.7
    assert speed.max() < 60


def test_head_channels_move_faster_while_the_voice_is_loud() -> None:
    rate, quiet = 16_000, (2.0, 4.0)
    tone = 8000 * np.sin(np.arange(6 * rate) * 2 * np.pi * 120 / rate)
    tone[int(quiet[0] * rate) : int(quiet[1] * rate)] *= 0.1
    sound = replace(said(), sample_rate=rate, pcm=tone.astype(np.int16))
    speeds = []
    for seed in range(5):
        head = turned(head_channels(sound, 0.0, np.inf, seed), TIMES)
        speeds.append(
            np.linalg.norm([np.gradient(head[name], 0.04) for name in ("yaw", "pitch", "roll")], axis=0)
        )
    speed = np.mean(speeds, axis=0)
    inside = (quiet[0] + 0.6 < TIMES) & (quiet[1] - 0.6 > TIMES)
    loud = ((TIMES > 0.5) & (TIMES < 1.4)) | ((TIMES > 4.6) & (TIMES < 5.4))
    assert speed[loud].mean() > 3 * speed[inside].mean()


def test_head_channels_begin_at_rest_after_a_pause() -> None:
    late = tuple(replace(p, start=p.start + 2.0, end=p.end + 2.0) for p in said(4.0).phonemes)
    spoken = replace(said(), words=(Word(2.0, 6.0, "word"),), phonemes=(Phoneme(0.0, 2.0, ""), *late))
    times = np.array([2.0, 2.02, 3.0])
    for seed in range(5):
        head = turned(head_channels(spoken, 0.0, np.inf, seed), times)
        assert np.abs([head[name][:2] for name in TURNS]).max() < 0.1
        assert np.abs(head["yaw"][2]) > 0.1


def test_head_channels_leave_the_eyes_on_their_target() -> None:
    head = turned(head_channels(said(), 0.0, np.inf, seed=2), TIMES)
    assert head["eyes"] == pytest.approx(-head["pitch"], abs=1e-9)


def test_head_channels_depend_on_seed_and_start_alone() -> None:
    first, again, other = (
        turned(head_channels(said(), 0.0, np.inf, seed), TIMES)["yaw"] for seed in (1, 1, 2)
    )
    assert (first == again).all()
    assert np.abs(first - other).max() > 0.5


def test_head_channels_give_way_to_a_movement_and_come_back() -> None:
    free = turned(head_channels(said(), 0.0, np.inf, 1), TIMES)["pitch"]
    claimed = turned(head_channels(said(), 0.0, np.inf, 1, claims=[(0.0, 2.0, 3.0), (0.0, 2.5, 3.5)]), TIMES)
    claimed = claimed["pitch"]
    assert (claimed[TIMES < 1.7] == free[TIMES < 1.7]).all()
    assert not claimed[(TIMES >= 2.0) & (TIMES <= 3.5)].any()
    assert claimed[TIMES > 4.0] == pytest.approx(free[TIMES > 4.0])


def test_head_channels_change_nothing_before_a_movement_is_known() -> None:
    free, late = (
        turned(head_channels(said(), 0.0, np.inf, 1, claims=claims), TIMES)["pitch"]
        for claims in ((), [(2.4, 2.0, 3.0)])
    )
    assert (free == late)[TIMES <= 2.4].all()


def test_head_channels_end_when_the_speech_is_cut_off() -> None:
    free, cut = (turned(head_channels(said(), 0.0, until, 1), TIMES)["yaw"] for until in (np.inf, 2.0))
    assert (free == cut)[TIMES <= 2.0].all()
    assert not cut[TIMES > 2.5].any()


def test_head_channels_of_silence_are_none() -> None:
    assert head_channels(Utterance(1.0, (), (), {}), 0.0, np.inf, 1) == []


def test_head_channels_of_anger_move_more_than_those_of_sadness() -> None:
    anger, sadness = (
        turned(head_channels(said(), 0.0, np.inf, 1, style), TIMES)["yaw"]
        for style in (Style(1.5, 1.4, -2.0), Style(0.6, 0.6, -3.0))
    )
    assert np.abs(np.gradient(anger)).mean() > 2 * np.abs(np.gradient(sadness)).mean()
