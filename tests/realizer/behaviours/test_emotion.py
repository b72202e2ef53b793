"""Tests of emotion and mood."""

import math
from pathlib import Path

import numpy as np
import pytest

from realizer.emotions.wheel import affect
from realizer.emotions.wheel import wheel as place_on
from realizer.emotions.words import emotion, known_words
from realizer.tables.emotions import emotion_faces, ring, whissell_words
from realizer.tables.lexemes import face_lexemes
from tests.rows import each_row

AT = 'start="0" attackPeak="0.5" relax="1.5" end="2"'
SAD = emotion_faces()["sadness"].aus[15, "BOTH"]


def lexeme(name: str, scale: float = 1.0) -> dict[str, float]:
    aus = {}
    for (number, side), value in face_lexemes()[name].aus.items():
        known = {f"{number}L", f"{number}R"} if side == "BOTH" else {f"{number}{side[0]}"}
        aus |= dict.fromkeys(known, round(min(scale * value, 1.0), 4))
    return aus


def asked(played, time: float) -> dict[str, float]:
    """Return AU -> 0..1 before the co-occurrence rules."""
    names = played.realization.to_json()["au"]["names"]
    values = played.realization.aus.before_rules[round(time * 100)]
    return {name: round(float(v), 4) for name, v in zip(names, values, strict=True) if v > 1e-6}


def same(got: dict[str, float], wanted: dict[str, float]) -> bool:
    """Whether two sets of AUs are equal, where wanted AUs without sides match both."""
    wide = {name: wanted.get(name, wanted.get(f"{name}L")) for name in got}
    return got == pytest.approx(wide, abs=2e-4) and len(got) == len({w.rstrip("LR") for w in wanted}) + sum(
        name.endswith("R") for name in got
    )


@pytest.mark.parametrize("name", ["anger", "DISGUST", "Fear", "HAPPINESS", "joy", "sadness", "SURPRISE"])
def test_emotion_of_a_word_shows_the_face_lexeme_of_its_name(play, name: str) -> None:
    shown = play(f'<own:emotion id="e" name="{name}" intensity="0.6" {AT}/>')
    asked = play(f'<faceLexeme id="e" lexeme="{name}" amount="0.6" {AT}/>')
    assert shown.warnings == []
    for time in (0, 0.2, 0.5, 1.0, 1.5, 1.8, 2.0):
        assert shown.aus(time) == asked.aus(time)
    assert shown.aus(1.0)


@pytest.mark.parametrize("name", emotion_faces())
def test_emotion_at_the_angle_of_an_archetype_shows_that_archetype(play, name: str) -> None:
    by_name = asked(play(f'<own:emotion id="e" name="{name}" intensity="1" {AT}/>'), 1.0)
    place = ring("paul")[name].angle
    for angle in (place, place - 720, place + 1080):
        assert asked(play(f'<own:emotion id="e" angle="{angle}" intensity="1" {AT}/>'), 1.0) == by_name


def test_emotion_between_two_archetypes_shows_the_nearer_one_more(play) -> None:
    mixed = asked(play(f'<own:emotion id="e" angle="123.75" intensity="1" {AT}/>'), 1.0)
    assert mixed["15L"] == pytest.approx(0.75 * SAD, abs=1e-3)  # only sadness has it
    assert mixed["2L"] == pytest.approx(0.25 * 1.0, abs=1e-3)  # only surprise
    less = asked(play(f'<own:emotion id="e" angle="123.75" activation="3.5" intensity="1" {AT}/>'), 1.0)
    assert less == pytest.approx({au: value / 2 for au, value in mixed.items()}, abs=1e-3)
    by_name = asked(play(f'<own:emotion id="e" name="disapproval" intensity="1" {AT}/>'), 1.0)
    assert by_name == asked(play(f'<own:emotion id="e" angle="112.5" intensity="1" {AT}/>'), 1.0)


def test_emotion_of_a_rated_word_is_on_plutchiks_ring(play) -> None:
    near_sad = 0.8377  # (102.3 - 70.3) / (108.5 - 70.3)
    activation = 0.1623 * 4.9 + near_sad * 3.9
    guilty = asked(play(f'<own:emotion id="e" name="guilty" intensity="1" {AT}/>'), 1.0)
    assert guilty["15L"] == pytest.approx(SAD * near_sad * 4.0 / activation, abs=1e-3)
    assert guilty["20L"] == pytest.approx(
        emotion_faces()["fear"].aus[20, "BOTH"] * (1 - near_sad) * 4.0 / activation, abs=1e-3
    )


@pytest.mark.parametrize("profile", ["published", "raw"])
def test_emotion_with_a_published_profile_plays_as_faps_only(play, profile: str) -> None:
    played = play(f'<own:emotion id="e" name="afraid" profile="{profile}" intensity="0.5" {AT}/>')
    assert played.warnings == []
    assert played.aus(1.0) == {}
    shown = [played.fap(number, 1.0) for number in range(1, 69)]
    assert shown == pytest.approx(list(emotion("afraid", profile).frame() / 2), abs=0.1)
    at = f'<own:emotion id="e" angle="67.5" activation="5" profile="{profile}" intensity="1" {AT}/>'
    assert play(at).fap(3, 1.0) == pytest.approx(place_on(67.5, 5, profile).frame()[2], abs=0.1)


def test_emotion_with_less_activation_is_weaker(play) -> None:
    worried = asked(play(f'<own:emotion id="e" name="worried" intensity="1" {AT}/>'), 1.0)
    afraid = asked(play(f'<own:emotion id="e" name="fear" intensity="1" {AT}/>'), 1.0)
    terrified = asked(play(f'<own:emotion id="e" name="terrified" intensity="1" {AT}/>'), 1.0)
    assert worried == pytest.approx({name: v * 3.9 / 4.9 for name, v in afraid.items()}, abs=2e-4)
    assert terrified["2L"] == pytest.approx(afraid["2L"] * 6.3 / 4.9, abs=2e-4)
    assert max(terrified.values()) == 1


def test_emotion_timing_is_of_its_face_lexeme_or_between_two(play) -> None:
    lengths = {}
    for words_ in ('name="surprise"', 'angle="247.5"', 'name="anger"'):
        lengths[words_] = play(f'<own:emotion id="e" {words_}/>').times("e")["end"]
    surprise, between, anger = lengths.values()
    assert surprise == play('<faceLexeme id="f" lexeme="SURPRISE"/>').times("f")["end"]
    assert surprise < between < anger


def test_emotion_of_an_unknown_word_is_dropped_with_a_suggestion(play) -> None:
    played = play('<own:emotion id="e" name="hapy"/><head id="h" lexeme="NOD"/>')
    assert played.warnings == [("b:e", "CANNOT_CREATE_BEHAVIOR")]
    assert "got 'hapy', did you mean happy" in played.warnings_text
    assert played.times("h")


def test_emotion_with_an_unknown_profile_warns_and_shows_the_default(play) -> None:
    assert play(f'<own:emotion id="e" name="fear" profile="default" {AT}/>').warnings == []
    played = play(f'<own:emotion id="e" name="fear" profile="P_F(8)" {AT}/>')
    assert played.warnings == [("b:e", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert "P_F(8)" in played.warnings_text
    assert played.aus(1.0) == play(f'<own:emotion id="e" name="fear" {AT}/>').aus(1.0)


def test_emotion_shows_fully_without_an_intensity(play) -> None:
    """The strength of a word is in the word; half of anger would be read as no emotion."""
    full = play(f'<own:emotion id="e" name="anger" {AT}/>')
    assert full.aus(1.0) == play(f'<own:emotion id="e" name="anger" intensity="1" {AT}/>').aus(1.0)


def test_emotion_by_valence_and_arousal_is_a_place(play) -> None:
    row = whissell_words()["joyful"]
    away = {"valence": (row.evaluation - 4) / 3, "arousal": (row.activation - 4) / 3}
    length = math.hypot(*away.values())
    place = " ".join(f'{name}="{value / length:.6f}"' for name, value in away.items())
    joy = asked(play(f'<own:emotion id="e" {place} {AT}/>'), 1.0)
    assert {au: value for au, value in joy.items() if value > 0.02} == pytest.approx(
        asked(play(f'<own:emotion id="e" name="joy" {AT}/>'), 1.0), abs=0.02
    )
    half = " ".join(f'{name}="{value / length / 2:.6f}"' for name, value in away.items())
    assert asked(play(f'<own:emotion id="e" {half} {AT}/>'), 1.0)["6L"] == pytest.approx(0.5, abs=0.02)
    middle = play(f'<own:emotion id="e" valence="0" arousal="0" {AT}/>')
    assert (middle.warnings, middle.aus(1.0)) == ([], {})
    resting = play(f'<own:emotion id="e" valence="0" arousal="-1" {AT}/>')
    assert (resting.warnings, resting.aus(1.0)) == ([], {})
    published = play(f'<own:emotion id="e" valence="-0.6" arousal="0.4" profile="published" {AT}/>')
    shown = [published.fap(number, 1.0) for number in range(1, 69)]
    assert shown == pytest.approx(list(affect(-0.6, 0.4, "published").frame()), abs=0.1)


def test_emotion_of_an_archetype_and_a_number_is_a_published_profile(play) -> None:
    played = play(f'<own:emotion id="e" name="Fear 3" profile="published" {AT}/>')
    assert played.warnings == []
    shown = [played.fap(number, 1.0) for number in range(1, 69)]
    assert shown == pytest.approx(list(emotion("fear 3", "published").frame()), abs=0.1)
    own = play(f'<own:emotion id="e" name="fear 0" {AT}/>')
    assert own.aus(1.0) == play(f'<own:emotion id="e" name="fear" {AT}/>').aus(1.0)


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ('name="fear 33" profile="published"', "got 'fear 33', did you mean fear 9?"),
        ('name="feer 8" profile="raw"', "got 'feer 8', did you mean fear 8"),
        ('name="fear 8"', "got 'fear 8'; the published profiles have it"),
        ('name="accepting"', "accepting: its activation was never rated"),
    ],
)
def test_emotion_with_an_unknown_number_is_dropped_with_a_suggestion(
    play, attributes: str, said: str
) -> None:
    played = play(f'<own:emotion id="e" {attributes}/>')
    assert played.warnings == [("b:e", "CANNOT_CREATE_BEHAVIOR")]
    assert said in played.warnings_text


def test_emotion_with_a_seed_varies_a_published_profile_reproducibly(play) -> None:
    def faps(seed: int) -> list[float]:
        played = play(f'<own:emotion id="e" name="fear 8" profile="published" seed="{seed}" {AT}/>')
        assert played.warnings == []
        return [played.fap(number, 1.0) for number in range(1, 69)]

    one, other = faps(3), faps(4)
    assert one == pytest.approx(list(emotion("fear 8", "published").draw(3)), abs=0.1)
    assert one == faps(3)
    assert one != other
    for fap, (low, high) in emotion("fear 8", "published").ranges.items():
        assert low - 0.1 <= one[fap - 1] <= high + 0.1


def test_emotion_with_a_seed_varies_action_units_equally_on_both_sides(play) -> None:
    middle = asked(play(f'<own:emotion id="e" name="joy" intensity="0.5" {AT}/>'), 1.0)
    draws = [
        asked(play(f'<own:emotion id="e" name="joy" seed="{seed}" intensity="0.5" {AT}/>'), 1.0)
        for seed in (1, 1, 2)
    ]
    assert draws[0] == draws[1] != draws[2]
    # Of every process: the numbers of seed 1.
    factors = np.random.default_rng(1).uniform(0.85, 1.15, 6)
    wanted = {au: middle[au] * factors[k] for k, au in enumerate(["1L", "2L", "6L", "12L", "25", "26"])}
    assert {au: draws[0][au] for au in wanted} == pytest.approx(wanted, abs=2e-4)
    assert draws[0]["12L"] == draws[0]["12R"]


def test_mood_rises_and_stays_and_a_neutral_one_ends_it(play) -> None:
    sad = '<own:mood id="m" name="sadness" intensity="1" start="0" end="1"/><wait id="w" duration="5"/>'
    played = play(sad)
    assert played.aus(0) == {}
    assert 0 < played.aus(0.5)["15L"] < played.aus(1.0)["15L"]
    assert played.aus(1.0) == played.aus(5.0)
    assert same(played.aus(1.0), lexeme("SADNESS"))
    back = play(sad + '<own:mood id="n" name="neutral" start="2" end="3"/>')
    assert back.warnings == []
    assert back.aus(2.0) == played.aus(2.0)
    assert 0 < back.aus(2.5)["15L"] < back.aus(2.0)["15L"]
    assert back.aus(3.5) == {}


def test_mood_is_below_an_expression(play) -> None:
    played = play(
        '<own:mood id="m" name="sadness" intensity="1" start="0" end="0.5"/>'
        f'<own:expression id="e" name="SMILE" intensity="1" {AT.replace("2", "3")}/>'
    )
    assert asked(played, 1.0)["15L"] == pytest.approx(SAD)
    assert asked(played, 1.0)["12L"] == pytest.approx(1.0)


@each_row("word", known_words())
def test_emotion_plays_every_word_in_any_case(play, word: str) -> None:
    played = play(f'<own:emotion id="e" name="{word.upper()}" {AT}/>')
    assert played.warnings == []
    assert bool(played.aus(1.0)) == (word != "neutral")


def test_emotion_plays_a_profile_file_of_the_media_folder(play, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("Fear 9\nF31 [100, 200]\nSmug 0\nF12 [100, 200]\n")
    element = f'<own:emotion id="e" name="{{}}" profile="mine.txt" intensity="1" {AT}/>'
    assert play(element.format("fear"), media=tmp_path).fap(31, 1.0) == pytest.approx(150, abs=1)
    assert play(element.format("smug"), media=tmp_path).fap(12, 1.0) == pytest.approx(150, abs=1)
    assert play(element.format("smug")).warnings == [("b:e", "CANNOT_CREATE_BEHAVIOR")]
    (tmp_path / "x").mkdir()
    outside = play(element.format("smug").replace("mine", "../mine"), media=tmp_path / "x")
    assert outside.warnings == [("b:e", "CANNOT_CREATE_BEHAVIOR")]
