"""Lips: known phonemes, and laws for any sequence of them."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from realizer.animation.axis import fap
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.fap.conversion import to_fap
from realizer.animation.lips.lip_sync import LipStyle, lip_channels, opened
from realizer.animation.lips.visemes import ROLL, coarticulation
from realizer.speech.utterance import Phoneme
from realizer.tables import faps
from realizer.tables.phonemes import phoneme_features

IPA = sorted(phoneme_features())
MM = 55  # MNS units in a millimetre of the faces that ship
NUMBER = {row.name: row.fap for row in faps()}
BILABIALS = [s for s, f in phoneme_features().items() if f.place == "bilabial" and f.manner != "fricative"]


def say(text: str, length: float = 0.1, stressed: bool = True) -> tuple[Phoneme, ...]:
    """Phonemes of `length` seconds each; "_" is a pause of 0.3 s."""
    phonemes: list[Phoneme] = []
    for ipa in text.split():
        start = phonemes[-1].end if phonemes else 0.0
        pause = ipa == "_"
        end = start + (0.3 if pause else length)
        phonemes.append(Phoneme(start, end, "" if pause else ipa, int(stressed)))
    return tuple(phonemes)


def values(channels: tuple[Channel, ...], fap: int) -> np.ndarray:
    (found,) = (c.values for c in channels if NUMBER.get(c.target.name) == fap)
    return found


def gap(channels: tuple[Channel, ...]) -> np.ndarray:
    """Return the gap between the inner lips in MNS units; FAP 4 counts down, FAP 5 up."""
    return -values(channels, 4) - values(channels, 5)


def middle(text: str, fap: int) -> float:
    """The FAP's greatest deviation in "_ t X t _"."""
    found = values(lip_channels(say(f"_ t {text} t _", 0.14), 0.0), fap)
    return float(found[np.abs(found).argmax()])


def opening(text: str) -> float:
    return float(gap(lip_channels(say(f"_ t {text} t _", 0.14), 0.0)).max())


phonemes_of_speech = st.lists(
    st.tuples(
        st.sampled_from([*IPA, "", "", "oʊ", "aɪ", "əl", "ɔːɹ"]), st.floats(0.02, 0.5), st.integers(0, 2)
    ),
    min_size=1,
    max_size=25,
).map(
    lambda rows: tuple(
        Phoneme(sum(r[1] for r in rows[:k]), sum(r[1] for r in rows[: k + 1]), ipa, stress)
        for k, (ipa, _, stress) in enumerate(rows)
    )
)


@pytest.mark.parametrize("closed", BILABIALS)
@pytest.mark.parametrize("vowel", ["ɑ", "i", "u"])
def test_lip_channels_close_bilabials_in_a_frame_of_any_phase(closed: str, vowel: str) -> None:
    channels = lip_channels(say(f"_ {vowel} {closed} {vowel} _", 0.05), 0.0)
    faps_at = lambda t: to_fap(blend(channels, t)).integers()  # noqa: E731
    for phase in np.arange(0, 0.04, 0.005):
        times = np.arange(phase, 0.75, 0.04)
        frames = faps_at(times)
        inside = (times > 0.32) & (times < 0.43)
        for upper, lower in ((4, 5), (8, 10), (9, 11), (51, 52)):
            between = -frames[inside, upper - 1] - frames[inside, lower - 1]
            assert between.min() <= 0, (phase, upper)


@pytest.mark.parametrize("bitten", ["f", "v", "ɱ", "ʋ"])
def test_lip_channels_bring_the_lower_lip_to_the_teeth_for_f(bitten: str) -> None:
    channels = lip_channels(say(f"_ ɑ {bitten} ɑ _"), 0.0)
    inside = slice(43, 47)
    assert values(channels, 5)[inside].min() > 50  # raised
    assert values(channels, 4)[inside].max() < -50  # the upper lip clears the teeth
    assert gap(channels)[inside].min() > 70  # and the teeth show between
    assert gap(channels)[inside].max() < 130


def test_lip_channels_open_more_for_open_vowels() -> None:
    assert opening("ɑ") > opening("æ") > opening("ɛ") > opening("e") > opening("i") > opening("u")
    assert 11 * MM < opening("ɑ") < 14 * MM
    assert 3.5 * MM < opening("i") < 5.5 * MM
    assert 2 * MM < opening("u") < 4 * MM


def test_lip_channels_move_the_jaw_by_the_vowel() -> None:
    jaws = [middle(v, 3) for v in ("ɑ", "ɛ", "i")]
    assert jaws == sorted(jaws, reverse=True)
    assert middle("s", 3) < middle("k", 3)


def test_lip_channels_spread_and_round_the_lips() -> None:
    assert middle("i", 6) > 30
    assert middle("u", 6) < -60
    assert middle("u", 17) > 100 > abs(middle("i", 17))
    assert middle("y", 17) > 100
    assert middle("ʃ", 17) > 60


def test_lip_channels_show_the_tongue_for_th_and_raise_it_for_l() -> None:
    assert middle("θ", 45) > 2 * abs(middle("k", 45))
    assert middle("l", 44) > 100
    assert middle("k", 46) > 80


def test_lip_channels_round_the_lips_before_the_vowel() -> None:
    plain = lip_channels(say("_ t s t i _"), 0.0)
    round_ = lip_channels(say("_ t s t u _"), 0.0)
    before = slice(40, 50)  # the s, 0.1 to 0.2 s before the vowel
    assert (values(round_, 17)[before] > values(plain, 17)[before] + 10).all()


def test_lip_channels_give_h_the_mouth_of_its_neighbour() -> None:
    channels = lip_channels(say("_ h ɑ _", 0.12), 0.0)
    assert gap(channels)[36] > 0.5 * gap(channels).max()


def test_lip_channels_open_further_for_stressed_vowels() -> None:
    strong = gap(lip_channels(say("_ t ɑ t _"), 0.0)).max()
    weak = gap(lip_channels(say("_ t ɑ t _", stressed=False), 0.0)).max()
    assert 0.7 * strong < weak < 0.95 * strong


@pytest.mark.parametrize("vowel", ["ɑ", "ɛ", "ɪ"])
def test_lip_channels_undershoot_short_vowels(vowel: str) -> None:
    """Undershoot grows as vowels get shorter, and faster the shorter they are."""
    lengths = (0.03, 0.05, 0.08, 0.12, 0.18, 0.27)
    opened, jaw = np.array(
        [
            (gap(said).max(), values(said, 3).max())
            for said in (lip_channels(say(f"_ t {vowel} t {vowel} t _", length), 0.0) for length in lengths)
        ]
    ).T
    for reached in (opened, jaw):
        assert (np.diff(reached) > 0).all()
        assert (np.diff(np.diff(reached) / np.diff(lengths)) < 0).all()
        assert 0.5 < reached[1] / reached[-1] < 0.85


def test_lip_channels_close_the_lips_in_fast_speech() -> None:
    for length in (0.03, 0.05, 0.1):
        assert gap(lip_channels(say("_ ɑ p ɑ _", length), 0.0))[30:].min() <= 0


def loud(text: str, volume: float) -> tuple[Channel, ...]:
    return lip_channels(tuple(replace(p, volume=volume) for p in say(text)), 0.0)


def test_lip_channels_open_further_for_loud_vowels() -> None:
    volumes = (0.0, 0.5, 1.0, 1.4, 2.0, 4.0)
    said = [loud("_ t ɑ t _", volume) for volume in volumes]
    for reached in ([gap(s).max() for s in said], [values(s, 3).max() for s in said]):
        assert reached == sorted(reached)
        assert reached[1] < 0.9 * reached[2]
        assert reached[4] > 1.15 * reached[2]
    assert gap(said[0]).max() > 0.5 * gap(said[2]).max()  # a whisper is still visible
    assert gap(said[-1]).max() < 17 * MM


@pytest.mark.parametrize("volume", [0.0, 0.25, 4.0])
def test_lip_channels_keep_rounding_and_closures_at_any_volume(volume: float) -> None:
    usual, other = loud("_ u p ɑ f ɑ _", 1.0), loud("_ u p ɑ f ɑ _", volume)
    assert np.array_equal(values(usual, 53), values(other, 53))
    for number in (16, 17):  # lips that press roll in, from where they meet
        assert np.allclose(values(usual, number), values(other, number), atol=15)
    p, f = slice(44, 47), slice(64, 67)
    assert gap(other)[p].max() <= 0
    assert values(other, 5)[f].min() > 50
    assert np.allclose(gap(usual)[f], gap(other)[f], atol=25)


def styled(text: str, jaw: float, lips: float) -> tuple[Channel, ...]:
    return lip_channels(say(text, 0.14), 0.0, style=LipStyle(jaw, lips))


def test_lip_style_is_usual_where_it_is_not_given() -> None:
    assert LipStyle(jaw=0.5) == (0.5, 1.0)
    assert LipStyle(lips=0.5) == (1.0, 0.5)


def test_lip_channels_open_and_round_by_the_style_of_jaw_and_lips() -> None:
    text = "_ t ɑ t u t i _"
    usual = lip_channels(say(text, 0.14), 0.0)
    for one, other in zip(usual, styled(text, 1, 1), strict=True):
        assert np.array_equal(one.values, other.values)
    for number, way in ((3, "jaw"), (16, "lips"), (6, "lips")):
        few, many = (np.ptp(values(styled(text, **{"jaw": 1, "lips": 1, way: x}), number)) for x in (0.3, 2))
        assert few < 0.5 * np.ptp(values(usual, number)) < 0.6 * many
    for jaw, lips in ((0.3, 1), (1, 0.3)):
        assert gap(styled(text, jaw, lips)).max() < gap(usual).max()
    assert gap(styled(text, 0, 0)).max() < 1.5 * MM


@pytest.mark.parametrize("style", [(0, 0), (0, 2), (2, 0), (2, 2)])
def test_lip_channels_close_the_lips_in_any_style(style: tuple[float, float]) -> None:
    found = styled("_ ɑ p ɑ m ɑ f ɑ _", *style)
    for k in (2, 4):
        assert gap(found)[round(100 * (0.3 + 0.14 * (k - 0.5)))] <= 0
    assert values(found, 5)[round(100 * (0.3 + 0.14 * 5.5))] > 50
    assert gap(found).max() < 28 * MM


def test_lip_channels_press_lips_by_sound_and_stress() -> None:
    depth = {
        (ipa, stressed): gap(lip_channels(say(f"_ ɑ {ipa} ɑ _", stressed=stressed), 0.0))[42:48].min()
        for ipa in "pbm"
        for stressed in (True, False)
    }
    assert -37 <= depth["p", True] < depth["b", True] < depth["m", True] < 0
    assert all(depth[ipa, True] < depth[ipa, False] < 0 for ipa in "pbm")
    flat = gap(lip_channels(say("_ ɑ p ɑ _", 0.16), 0.0))
    assert len(np.unique(flat[flat < 0].round(3))) > 5  # no plateau


def test_lip_channels_flare_and_hide_the_teeth_of_rounded_lips() -> None:
    for sound in ("u", "w", "o"):
        assert min(middle(sound, 16), middle(sound, 17)) > 4 * MM
    assert middle("u", 4) >= 0  # the upper lip stays before the teeth
    assert middle("ʃ", 17) > 3 * MM
    assert middle("ʃ", 51) < middle("ʃ", 4) < 0  # its outer contour turns out


def test_lip_channels_release_the_lips_in_long_pauses_only() -> None:
    first = say("ɑ t ɑ")
    for pause, free in ((0.2, False), (0.35, False), (0.8, True)):
        start = first[-1].end + pause
        second = tuple(Phoneme(p.start + start, p.end + start, p.ipa, 1) for p in first)
        channels = lip_channels((*first, Phoneme(first[-1].end, start, ""), *second), 0.0)
        lips = next(c for c in channels if c.target.name == "lips")
        inside = lips.values[(lips.times > first[-1].end) & (lips.times < start)]
        assert (inside.min() == 0) == free
        between = gap(channels)[(lips.times > first[-1].end) & (lips.times < start)]
        # They are parted in a pause between sounds.
        assert 0.5 * MM < between.min() < 2.5 * MM


def test_lip_channels_of_pauses_are_empty() -> None:
    assert lip_channels((), 0.0) == ()
    assert lip_channels(say("_ _"), 0.0) == ()
    assert lip_channels(say("ʔ h"), 0.0) == ()


def test_lip_channels_shift_with_the_start() -> None:
    for here, later in zip(lip_channels(say("ɑ p"), 0.0), lip_channels(say("ɑ p"), 2.5), strict=True):
        assert np.allclose(later.times, here.times + 2.5)
        assert np.array_equal(later.values, here.values)
        assert here.layer is Layer.SPEECH


@given(phonemes_of_speech)
@example((Phoneme(0, 0.021484375, "f", 0),))
def test_lip_channels_begin_and_end_at_rest_without_jumps(phonemes: tuple[Phoneme, ...]) -> None:
    speed = coarticulation()["speed"]
    for channel in lip_channels(phonemes, 0.0):
        assert np.isfinite(channel.values).all()
        assert channel.values[0] == pytest.approx(0, abs=1e-9)
        assert channel.values[-1] == pytest.approx(0, abs=1e-9)
        assert (np.diff(channel.times) > 0).all()
        assert channel.times[-1] <= max(phonemes[-1].end, 0.02) + 1e-9
        slope = np.abs(np.diff(channel.values) / np.diff(channel.times)).max()
        if channel.target.name == "open_jaw":
            assert slope <= speed["jaw"] * 1.001
        elif channel.target.name == "tongue_roll":
            assert slope <= speed["lips"] * ROLL * 1.001
        elif channel.target.name != "lips":
            # The lower lip that stops at the upper one may add the speed of both, and so may pressed lips.
            assert slope <= 4 * speed["lips"] * 1.001


@given(phonemes_of_speech)
def test_lip_channels_are_symmetrical_and_within_ranges(phonemes: tuple[Phoneme, ...]) -> None:
    channels = lip_channels(phonemes, 0.0)
    if not channels:
        return
    for row in faps():
        if any(NUMBER.get(c.target.name) == row.fap for c in channels):
            found = values(channels, row.fap)
            assert np.array_equal(found, row.sign * values(channels, row.mirror))
            assert found.min() >= row.least
            assert found.max() <= row.most
    assert gap(channels).min() >= -37  # lips press; they do not pass through each other
    assert gap(channels).max() < 14 * MM


@given(phonemes_of_speech)
def test_lip_channels_close_every_bilabial(phonemes: tuple[Phoneme, ...]) -> None:
    channels = lip_channels(phonemes, 0.0)
    for phoneme in phonemes:
        if phoneme.ipa in BILABIALS:
            times = channels[0].times
            centre = (phoneme.start + phoneme.end) / 2
            near = np.abs(times - centre) <= 0.0225
            assert gap(channels)[near].max() <= 1e-6


@pytest.mark.parametrize("room", [0.0, 0.05, 0.1, 2.0])
def test_lip_channels_prepare_a_first_closure_if_there_is_room(room: float) -> None:
    lips, *_ = lip_channels(say("b ɑ t _", 0.08), 3.0, room=room)
    early = min(room, coarticulation()["pauses"]["attack"])
    assert lips.times[0] == pytest.approx(3.0 - early)
    assert lips.values[0] == 0
    begins = lips.times < 3.05
    steepest = np.diff(lips.values[begins]) / np.diff(lips.times[begins])
    # With more room they move more slowly.
    assert steepest.max() < 1.6 / max(early, coarticulation()["pauses"]["least"])
    assert lips.values[(lips.times > 3.025) & (lips.times < 3.2)].min() == pytest.approx(1, abs=1e-6)


SOUNDS = ("", "ɑ", "p", "ɑ", "f", "u", "m", "i", "")
USUAL = lip_channels([Phoneme(0.15 * k, 0.15 * (k + 1), ipa, 1) for k, ipa in enumerate(SOUNDS)], 0.0)


def moved(channels, number: int) -> np.ndarray:
    return next(channel.values for channel in channels if channel.target == fap(number))


def mouth_gap(channels) -> np.ndarray:
    return -moved(channels, 4) - moved(channels, 5)


@pytest.mark.parametrize("factor", [0.6, 0.8, 1.3, 1.6])
def test_opened_scales_the_mouth_and_leaves_closures(factor: float) -> None:
    usual, other = mouth_gap(USUAL), mouth_gap(opened(USUAL, factor))
    assert other.max() == pytest.approx(factor * usual.max())
    assert moved(opened(USUAL, factor), 3) == pytest.approx(factor * moved(USUAL, 3))
    raised = moved(USUAL, 5) > 0  # the lower lip, to the upper one or to the teeth
    assert raised.sum() > 20
    assert np.array_equal(moved(opened(USUAL, factor), 5)[raised], moved(USUAL, 5)[raised])
    assert other[raised & (usual <= 0)].max() <= 0
    for number in (6, 16, 17, 44):
        assert np.array_equal(moved(opened(USUAL, factor), number), moved(USUAL, number))


def test_opened_remembers_its_result() -> None:
    assert opened(USUAL, 1.0) is USUAL
    assert all(one is same for one, same in zip(opened(USUAL, 1.3), opened(USUAL, 1.3), strict=True))
    other = opened(USUAL, 0.7)
    assert isinstance(other[0], Channel)
    assert mouth_gap(other).max() < mouth_gap(opened(USUAL, 1.3)).max()


def test_opened_keeps_no_channels_that_nothing_else_uses() -> None:
    channels = tuple(channel.changed({"source": "other"}) for channel in USUAL)
    known = [weakref.ref(channel) for channel in (*channels, *opened(channels, 1.3))]
    del channels
    gc.collect()
    assert [ref() for ref in known if ref() is not None] == []
