"""Motion that accompanies speech: small, smooth, seeded, and never in conflict with a document."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import AU_NAMES, au, fap
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.fap.conversion import to_fap
from realizer.animation.idle.idle_face import idle_face
from realizer.animation.idle.prosody import KnownMotion, SpeechSpan, phrase_ends, prosody_channels
from realizer.core.array_types import Float64
from realizer.speech.accents import phrases, prosody_facts
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word

SAID = SilentVoice().say(
    SpeechRequest(
        "Good morning, I am really glad to see everybody here today. Whoever follows the river to the "
        "tower, will discover a little door, and nobody remembers where it was hidden before."
    )
)
FOREVER = float("inf")
NOD = prosody_facts()["nod"]
LID = au(45, "LEFT")[0].column
SEEDS = st.integers(0, 2**40)


def talk(start: float = 0.0, until: float = FOREVER, said: Utterance = SAID) -> SpeechSpan:
    return SpeechSpan(start, until, said)


def shown(
    talks: Sequence[SpeechSpan], seed: int, times: Float64, asked: Sequence[KnownMotion] = ()
) -> dict[str, Float64]:
    """Degrees of the head (down positive) and of the eyes, and how far the brows are up, by gestures."""
    channels = prosody_channels(talks, float(times[0]), float(times[-1]), seed, asked)
    frames = blend([channel for channel in channels if channel.curve != "linear"], times)
    faps = to_fap(frames).values.astype(np.float64)
    degrees = np.degrees(faps * 1e-5)
    brows = frames.aus[:, [AU_NAMES().index(name) for name in ("1L", "1R", "2L", "2R")]]
    return {
        "head": degrees[:, 47],
        "turn": np.abs(degrees[:, 48:50]).max(axis=1),
        "yaw": degrees[:, 22],
        "pitch": degrees[:, 24],
        "brows": brows.max(axis=1).astype(np.float64),
    }


def whole(seed: int, *, step: float = 0.01, asked: Sequence[KnownMotion] = ()) -> dict[str, Float64]:
    return shown([talk()], seed, np.arange(0.0, SAID.duration + 1.0, step), asked)


def held(number: int, begin: float, end: float, known: float = 0.0, layer: Layer = Layer.HEAD) -> KnownMotion:
    keys = np.array([begin, (begin + end) / 2, end])
    return KnownMotion(known, Channel(au(number)[0], keys, np.array([0.0, 0.5, 0.0]), layer=layer))


@given(SEEDS, st.floats(0.0, 10_000.0))
def test_prosody_stays_within_the_limits_of_the_table(seed: int, start: float) -> None:
    facts = prosody_facts()
    times = start + np.arange(0.0, SAID.duration + 1.0, 0.01)
    seen = shown([talk(start)], seed, times)
    assert seen["head"].min() >= -1e-3
    assert seen["head"].max() <= NOD["most"] + 1e-3
    assert seen["turn"].max() == 0.0
    assert seen["brows"].max() <= facts["brows"]["most"] + 1e-6
    assert np.abs(seen["yaw"]).max() <= facts["aside"]["yaw"][1] + 0.01
    most = max(np.abs(facts["aside"]["pitch"])) + NOD["most"]
    assert np.abs(seen["pitch"]).max() <= most + 0.01


@given(SEEDS)
def test_prosody_moves_head_and_brows_smoothly(seed: int) -> None:
    """At 25 fps, by the largest slope of a course of minimum jerk, 15/8 of its mean."""
    seen = whole(seed, step=0.04)
    brows = prosody_facts()["brows"]
    assert np.abs(np.diff(seen["head"])).max() <= 1.875 * NOD["most"] * 0.04 / NOD["attack"] + 0.01
    assert np.abs(np.diff(seen["brows"])).max() <= 1.875 * brows["most"] * 0.04 / brows["attack"] + 1e-3


@given(SEEDS, st.floats(0.5, 10.0))
def test_prosody_agrees_in_overlapping_windows(seed: int, cut: float) -> None:
    times = np.arange(0.0, 11.0, 0.04)
    first = int(np.searchsorted(times, cut))
    one = shown([talk()], seed, times)
    for part in (times[:first], times[first:]):
        part_of = (times >= part[0]) & (times <= part[-1])
        for name, values in shown([talk()], seed, part).items():
            np.testing.assert_allclose(values, one[name][part_of], atol=1e-4)


def test_prosody_depends_on_the_seed() -> None:
    one, same, other = whole(3), whole(3), whole(4)
    assert all(np.array_equal(one[name], same[name]) for name in one)
    assert not np.array_equal(one["head"], other["head"])


def test_prosody_depends_on_the_start_of_a_speech() -> None:
    times = np.arange(0.0, SAID.duration, 0.04)
    one, again = shown([talk()], 0, times), shown([talk(20.0)], 0, times + 20.0)
    assert not np.allclose(one["head"], again["head"], atol=0.05)


@given(SEEDS)
def test_prosody_nods_in_the_middle_of_a_stressed_vowel(seed: int) -> None:
    seen, times = whole(seed)["head"], np.arange(0.0, SAID.duration + 1.0, 0.01)
    inner = seen[1:-1]
    lows = times[1:-1][(inner > seen[:-2]) & (inner >= seen[2:]) & (inner > 0.3)]
    accents = np.array([max(a.time, NOD["attack"]) for p in phrases(SAID) for a in p.accents])
    assert len(lows) >= 1
    assert np.abs(lows[:, None] - accents).min(axis=1).max() <= 0.011


@given(SEEDS)
def test_prosody_shows_the_nuclear_accent_in_head_or_brows(seed: int) -> None:
    seen, last = whole(seed), -FOREVER
    for phrase in phrases(SAID):
        time = max(phrase.accents[-1].time, NOD["attack"])
        near = slice(round((time - 0.1) * 100), round((time + 0.1) * 100))
        if time - last >= NOD["apart"]:  # two that are nearer share one
            assert max(seen["head"][near].max(), 10 * seen["brows"][near].max()) > 0.8
        last = time


@given(SEEDS)
def test_prosody_keeps_nods_apart(seed: int) -> None:
    head = whole(seed)["head"]
    inner = head[1:-1]
    lows = np.flatnonzero((inner > head[:-2]) & (inner >= head[2:]) & (inner > 0.3))
    assert (np.diff(lows) * 0.01 >= NOD["apart"] - 0.02).all()


def test_prosody_nods_keep_the_direction_of_the_eyes() -> None:
    times = np.arange(0.0, 2.0, 0.01)
    said = SilentVoice().say(SpeechRequest("Hello everybody"))  # too short to look aside
    for seed in range(5):
        seen = shown([talk(said=said)], seed, times)
        np.testing.assert_allclose(seen["pitch"], -seen["head"], atol=0.01)


def test_prosody_looks_aside_and_back_before_a_phrase_ends() -> None:
    away, times = [], np.arange(0.0, SAID.duration + 1.0, 0.01)
    for seed in range(100):
        aside = np.abs(whole(seed)["yaw"]) > 1.0
        away.append(aside[times < SAID.duration].mean())
        ends = np.array([round(phrase.end * 100) for phrase in phrases(SAID)])
        assert not aside[ends].any()
    # Argyle & Cook: at most 59 % of the time.
    assert 0.1 < np.mean(away) < 0.4
    assert np.max(away) < 0.59


def test_prosody_does_not_look_aside_in_a_short_speech() -> None:
    said = SilentVoice().say(SpeechRequest("Good morning, everybody"))
    for seed in range(50):
        assert np.abs(shown([talk(said=said)], seed, np.arange(0, 3, 0.01))["yaw"]).max() == 0.0


def test_prosody_listener_does_not_look_aside() -> None:
    assert prosody_channels([], 0.0, 100.0, 0) == []


@given(SEEDS, st.floats(0.0, 11.0), st.floats(0.2, 3.0))
def test_prosody_does_not_nod_during_a_nod_of_a_document(seed: int, begin: float, length: float) -> None:
    asked = [held(53, begin, begin + length)]
    times = np.arange(0.0, 12.0, 0.01)
    inside = (times >= begin) & (times <= begin + length)
    assert np.abs(whole_at(times, seed, asked)["head"][inside]).max(initial=0.0) == 0.0


def whole_at(times: Float64, seed: int, asked: Sequence[KnownMotion]) -> dict[str, Float64]:
    return shown([talk()], seed, times, asked)


@pytest.mark.parametrize(
    ("channel", "part"),
    [
        (Channel(au(2)[0], np.array([0.0, 12.0]), np.array([0.5, 0.5])), "brows"),
        *(
            (Channel(fap(number), np.array([0.0, 12.0]), np.array([90.0, 90.0]), layer=Layer.FAPS), "brows")
            for number in range(31, 39)
        ),
        (Channel(au(1)[0], np.array([0.0]), np.array([0.2]), layer=Layer.BASE, keeps_last=True), "brows"),
        (Channel(au(61)[0], np.array([0.0, 12.0]), np.array([0.2, 0.2]), layer=Layer.GAZE), "yaw"),
        (Channel(au(62)[0], np.array([0.0]), np.array([0.2]), layer=Layer.BASE, keeps_last=True), "yaw"),
        (Channel(au(55)[0], np.array([0.0, 12.0]), np.array([0.2, 0.2]), layer=Layer.HEAD), "head"),
    ],
    ids=["raise", *(f"FAP {number}" for number in range(31, 39)), "mood", "gaze", "base gaze", "tilt"],
)
def test_prosody_yields_only_parts_that_a_document_moves(channel: Channel, part: str) -> None:
    for seed in range(10):
        alone, beside = whole(seed), whole(seed, asked=[KnownMotion(0.0, channel)])
        assert np.abs(beside[part]).max() == 0.0
        for name in {"head", "brows", "yaw"} - {part}:
            np.testing.assert_array_equal(alone[name], beside[name])


def test_prosody_raises_brows_less_in_a_frown() -> None:
    frown = KnownMotion(0.0, Channel(au(4)[0], np.array([0.0, 12.0]), np.array([0.5, 0.5])))
    alone, beside = (
        np.stack([whole(seed, asked=asked)["brows"] for seed in range(5)]) for asked in ([], [frown])
    )
    np.testing.assert_allclose(beside, prosody_facts()["brows"]["frown"] * alone, atol=1e-6)
    assert alone.max() > 0.2


def units(number: int, times: Float64, asked: Sequence[KnownMotion] = (), seed: int = 0) -> Float64:
    channels = prosody_channels([talk()], 0.0, float(times[-1]), seed, asked)
    return blend(channels, times).aus[:, AU_NAMES().index(au(number)[0].name)].astype(np.float64)


def test_prosody_inhales_in_pauses_between_phrases() -> None:
    sounds = [
        (0.0, 1.0, "a"),
        (1.0, 1.2, ""),
        (1.2, 2.0, "a"),
        (2.0, 2.5, ""),
        (2.5, 3.5, "a"),
        (3.5, 4.5, ""),
    ]
    words = (Word(0.0, 4.5, "words"),)
    said = Utterance(5.5, words, tuple(Phoneme(*one, 1) for one in (*sounds, (4.5, 5.5, "a"))), {})
    times = np.arange(0.0, 6.0, 0.01)
    channels = prosody_channels([talk(said=said)], 0.0, 6.0, 0)
    flared = blend(channels, times).aus[:, AU_NAMES().index("38L")]
    seen = times[flared > 0.05]
    assert flared.max() == pytest.approx(prosody_facts()["breath"]["most"], rel=0.02)
    assert seen[np.diff(seen, prepend=-1) > 0.1] == pytest.approx([2.1, 4.0], abs=0.05)
    assert seen[np.diff(seen, append=9) > 0.1] == pytest.approx([2.5, 4.5], abs=0.1)


def test_prosody_moistens_the_lips_after_a_turn_unless_they_move() -> None:
    times = np.arange(0.0, SAID.duration + 2.0, 0.01)
    seen = np.stack([units(28, times, seed=seed) for seed in range(20)])
    assert 3 < (seen.max(axis=1) > 0.2).sum() < 17
    assert seen[:, times < phrases(SAID)[-1].end].max() == seen[:, -1].max() == 0
    smile = KnownMotion(0.0, Channel(au(12)[0], np.array([0.0, 14.0]), np.array([0.5, 0.5])))
    assert max(units(28, times, [smile], seed).max() for seed in range(20)) == 0


def test_prosody_goes_on_with_a_smile_and_a_base_head_direction() -> None:
    keys, values = np.array([0.0, 12.0]), np.array([0.5, 0.5])
    asked = [KnownMotion(0.0, Channel(au(12)[0], keys, values))]
    asked.append(KnownMotion(0.0, Channel(au(53)[0], keys, values, layer=Layer.BASE)))
    alone, beside = whole(1), whole(1, asked=asked)
    assert all(np.array_equal(alone[name], beside[name]) for name in alone)


@given(SEEDS, st.floats(0.0, 10.0))
def test_prosody_yields_to_a_late_document_without_a_jump(seed: int, now: float) -> None:
    before, after = whole(seed), whole(seed, asked=[held(53, now, now + 2.0, known=now)])
    past = np.arange(0.0, SAID.duration + 1.0, 0.01) <= now
    np.testing.assert_array_equal(before["head"][past], after["head"][past])
    assert np.abs(np.diff(after["head"])).max() < 0.6  # 2.6 degrees in 0.2 s, on a falling course
    gone = np.arange(0.0, SAID.duration + 1.0, 0.01) >= now + prosody_facts()["yield"]["fade"] + 0.01
    until = np.arange(0.0, SAID.duration + 1.0, 0.01) <= now + 2.0
    assert np.abs(after["head"][gone & until]).max(initial=0.0) < 1e-3


@given(SEEDS, st.floats(0.0, 10.0))
def test_prosody_ends_with_an_interrupted_speech_without_a_jump(seed: int, now: float) -> None:
    times = np.arange(0.0, 12.0, 0.01)
    seen = shown([talk(until=now)], seed, times)
    assert np.abs(np.diff(seen["head"])).max() < 0.6
    for name in ("head", "brows", "yaw", "pitch"):
        assert np.abs(seen[name][times > now + 0.21]).max() < 1e-3


def blinks(seed: int, until: float, talks: Sequence[SpeechSpan]) -> Float64:
    return np.sort(idle_face(0.0, until, seed, phrase_ends(talks)).blinks.onsets)


@given(SEEDS, st.lists(st.floats(0.2, 4.0), max_size=5))
def test_phrase_ends_move_blinks_and_add_none(seed: int, waits: list[float]) -> None:
    talks, now = [], 0.0
    for wait in waits:
        talks.append(talk(now + wait))
        now += wait + SAID.duration
    idle, moved = blinks(seed, now + 20.0, []), blinks(seed, now + 20.0, talks)
    facts = prosody_facts()["blinks"]
    count = min(len(idle), len(moved))
    assert abs(len(idle) - len(moved)) <= 1  # one may have been moved across the end of the window
    assert np.abs(idle[:count] - moved[:count]).max() <= facts["reach"] + facts["delay"] + 1e-9
    assert np.diff(moved).min() >= 1.0 - 1e-9
    ends = np.array([end.at for end in phrase_ends(talks)])
    for one, other in zip(idle[:count], moved[:count], strict=True):
        if one != other:
            late = other - ends
            assert ((late >= -1e-9) & (late <= facts["delay"] + 1e-9)).any()


def test_phrase_ends_attract_most_blinks() -> None:
    ends = np.array([end.at for end in phrase_ends([talk()])])
    found = np.concatenate([blinks(seed, SAID.duration, [talk()]) for seed in range(200)])
    found = found[found > 0.7]
    near = np.abs(found[:, None] - ends).min(axis=1) <= 0.11
    assert near.mean() > 0.5


def test_phrase_ends_do_not_move_blinks_before_the_speech() -> None:
    for seed in range(50):
        idle = blinks(seed, 20.0, [])
        late = talk(float(idle[1]) + 0.01)
        assert blinks(seed, 20.0, [late])[1] == idle[1]


def test_prosody_moves_the_head_with_the_melody_and_gives_way_to_documents() -> None:
    times = np.arange(0.0, 4.0, 0.04)
    said = talk()

    def pitch(asked: Sequence[KnownMotion] = ()) -> Float64:
        channels = prosody_channels([said], 0.0, 4.0, 1, asked)
        moving = [channel for channel in channels if channel.curve == "linear"]
        return to_fap(blend(moving, times)).values[:, 47].astype(np.float64)

    free = pitch()
    assert np.ptp(np.degrees(free * 1e-5)) > 1.0
    nod = Channel(au(54)[0], np.array([1.0, 1.3, 1.6]), np.array([0.0, 0.3, 0.0]), layer=Layer.HEAD)
    beside = pitch([KnownMotion(0.0, nod)])
    assert not beside[(times > 1.0) & (times < 1.6)].any()
    assert beside[times > 2.0] == pytest.approx(free[times > 2.0])
