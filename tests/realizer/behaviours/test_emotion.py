"""Emotions by word and by place on the wheel, for a while and as a mood."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.behaviours.emotion import wheel
from realizer.tables.emotions import archetypes, words
from realizer.tables.lexemes import face_lexemes

AT = 'start="0" attackPeak="0.5" relax="1.5" end="2"'


def lexeme(name: str, scale: float = 1.0) -> dict[str, float]:
    aus = {}
    for (number, side), value in face_lexemes()[name].aus.items():
        known = {f"{number}L", f"{number}R"} if side == "BOTH" else {f"{number}{side[0]}"}
        aus |= dict.fromkeys(known, round(min(scale * value, 1.0), 4))
    return aus


def same(got: dict[str, float], wanted: dict[str, float]) -> bool:
    """Equal where an AU of the wanted ones has no sides too."""
    wide = {name: wanted.get(name, wanted.get(f"{name}L")) for name in got}
    return got == pytest.approx(wide, abs=2e-4) and len(got) == len({w.rstrip("LR") for w in wanted}) + sum(
        name.endswith("R") for name in got
    )


@pytest.mark.parametrize("name", ["anger", "DISGUST", "Fear", "HAPPINESS", "joy", "sadness", "SURPRISE"])
def test_a_word_shows_what_the_face_lexeme_of_its_name_shows(play, name: str) -> None:
    shown = play(f'<own:emotion id="e" name="{name}" intensity="0.6" {AT}/>')
    asked = play(f'<faceLexeme id="e" lexeme="{name}" amount="0.6" {AT}/>')
    assert shown.warnings == []
    for time in (0, 0.2, 0.5, 1.0, 1.5, 1.8, 2.0):
        assert shown.aus(time) == asked.aus(time)
    assert shown.aus(1.0)


@pytest.mark.parametrize("archetype", archetypes(), ids=lambda a: a.name)
def test_the_angle_of_an_archetype_shows_that_archetype_whatever_the_turn(play, archetype) -> None:
    by_name = play(f'<own:emotion id="e" name="{archetype.name}" intensity="1" {AT}/>').aus(1.0)
    for angle in (archetype.angle, archetype.angle - 360):
        assert play(f'<own:emotion id="e" angle="{angle}" intensity="1" {AT}/>').aus(1.0) == by_name


def test_between_two_archetypes_both_show_the_nearer_one_more(play) -> None:
    mixed = play(f'<own:emotion id="e" angle="102.3" intensity="1" {AT}/>').aus(1.0)
    near_sad = 0.8377  # (102.3 - 70.3) / (108.5 - 70.3)
    activation = 0.1623 * 4.9 + near_sad * 3.9
    assert mixed["15L"] == pytest.approx(0.85 * near_sad * activation / 3.9, abs=1e-3)  # only sadness has it
    assert mixed["20L"] == pytest.approx(0.8 * 0.1623 * activation / 4.9, abs=1e-3)  # only fear
    assert play(f'<own:emotion id="e" name="guilty" intensity="1" {AT}/>').aus(1.0)["15L"] == pytest.approx(
        0.85 * near_sad * 4.0 / 3.9, abs=1e-3
    )


def test_a_less_activated_emotion_is_a_weaker_one(play) -> None:
    worried = play(f'<own:emotion id="e" name="worried" intensity="1" {AT}/>').aus(1.0)
    afraid = play(f'<own:emotion id="e" name="fear" intensity="1" {AT}/>').aus(1.0)
    terrified = play(f'<own:emotion id="e" name="terrified" intensity="1" {AT}/>').aus(1.0)
    assert worried == pytest.approx({name: v * 3.9 / 4.9 for name, v in afraid.items()}, abs=2e-4)
    assert terrified["7L"] == pytest.approx(afraid["7L"] * 6.3 / 4.9, abs=2e-4)
    assert max(terrified.values()) == 1


@given(st.floats(-720, 720), st.floats(1, 7) | st.none())
def test_the_wheel_is_continuous(angle: float, activation: float | None) -> None:
    here, there = wheel(angle, activation), wheel(angle + 1e-6, activation)
    for name in here.keys() | there.keys():
        assert here.get(name, (0, 0)) == pytest.approx(there.get(name, (0, 0)), abs=1e-5)
    assert sum(share for share, _ in here.values()) == pytest.approx(1)
    assert 1 <= len(here) <= 2


def test_an_emotion_takes_its_time_as_its_face_lexeme_does_and_a_mix_a_time_between(play) -> None:
    lengths = {}
    for words_ in ('name="surprise"', 'angle="164"', 'name="disgust"'):
        lengths[words_] = play(f'<own:emotion id="e" {words_}/>').times("e")["end"]
    surprise, between, disgust = lengths.values()
    assert surprise == play('<faceLexeme id="f" lexeme="SURPRISE"/>').times("f")["end"]
    assert surprise < between < disgust


def test_an_unknown_word_is_dropped_and_what_was_meant_is_named(play) -> None:
    played = play('<own:emotion id="e" name="hapy"/><head id="h" lexeme="NOD"/>')
    assert played.warnings == [("b:e", "CANNOT_CREATE_BEHAVIOR")]
    assert "got 'hapy', did you mean HAPPY" in played.told
    assert played.times("h")


def test_a_profile_that_is_not_there_is_said_and_the_usual_one_shows(play) -> None:
    assert play(f'<own:emotion id="e" name="fear" profile="default" {AT}/>').warnings == []
    played = play(f'<own:emotion id="e" name="fear" profile="P_F(8)" {AT}/>')
    assert played.warnings == [("b:e", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED")]
    assert "P_F(8)" in played.told
    assert played.aus(1.0) == play(f'<own:emotion id="e" name="fear" {AT}/>').aus(1.0)


def test_a_mood_rises_and_stays_and_a_neutral_one_takes_it_back(play) -> None:
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


def test_a_mood_shows_under_an_expression(play) -> None:
    played = play(
        '<own:mood id="m" name="sadness" intensity="1" start="0" end="0.5"/>'
        f'<own:expression id="e" name="SMILE" intensity="1" {AT.replace("2", "3")}/>'
    )
    assert played.aus(1.0)["15L"] == pytest.approx(0.85)
    assert played.aus(1.0)["12L"] == pytest.approx(0.85)


@pytest.mark.parametrize("word", words())
def test_every_word_plays(play, word: str) -> None:
    played = play(f'<own:emotion id="e" name="{word.lower()}" {AT}/>')
    assert played.warnings == []
    assert bool(played.aus(1.0)) == (word != "NEUTRAL")
