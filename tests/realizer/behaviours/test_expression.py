"""Tests of expression."""

from __future__ import annotations

import pytest

from realizer.offline import realize
from realizer.tables.lexemes import face_lexemes
from realizer.tables.templates import templates
from tests.rows import each_row

AT = 'start="0" attackPeak="0.5" relax="1.5" end="2"'


@pytest.mark.parametrize("template", templates().values(), ids=lambda t: t.name)
def test_expression_shows_the_action_units_of_a_template(play, template) -> None:
    played = play(f'<own:expression id="e" name="template:{template.name.lower()}" intensity="0.5" {AT}/>')
    assert played.warnings == []
    shown = {int(name.rstrip("LR")): value for name, value in played.aus(1.0).items()}
    assert shown == pytest.approx({au: value / 2 for (au, _), value in template.aus.items()})
    assert played.aus(2.0) == {}


@each_row("name", face_lexemes())
def test_expression_of_a_face_lexeme_is_the_same(play, name: str) -> None:
    shown = play(f'<own:expression id="e" name="{name.lower()}" intensity="0.7" {AT}/>')
    asked = play(f'<faceLexeme id="e" lexeme="{name}" amount="0.7" {AT}/>')
    assert shown.aus(1.0) == asked.aus(1.0)
    free = play(f'<own:expression id="e" name="{name}"/><faceLexeme id="f" lexeme="{name}"/>')
    assert free.times("e") == pytest.approx(free.times("f"))


def test_expression_of_a_template_differs_from_the_emotion_of_its_name(play) -> None:
    template = play(f'<own:expression id="e" name="template:anger" {AT}/>').aus(1.0)
    emotion = play(f'<own:expression id="e" name="anger" {AT}/>').aus(1.0)
    assert set(template) == {"4L", "4R"}
    assert set(template) < set(emotion)


@pytest.mark.parametrize(
    "name", ["TEMPLATE:Ironic_Smile", "template:ironic-smile", "template: ironic  smile"]
)
def test_expression_name_has_several_spellings(play, name: str) -> None:
    assert set(play(f'<own:expression id="e" name="{name}" {AT}/>').aus(1.0)) == {"10L", "10R", "12L", "12R"}


@pytest.mark.parametrize("template", templates().values(), ids=lambda t: t.name)
def test_expression_of_a_template_lasts_as_long_as_measured(play, template) -> None:
    times = play(f'<own:expression id="e" name="template:{template.name}"/>').times("e")
    half = (times["attackPeak"] - times["start"]) / 2, (times["end"] - times["relax"]) / 2
    evident = (times["end"] - half[1]) - (times["start"] + half[0])
    if template.probable:
        assert template.probable[0] <= evident <= template.probable[1] + 1e-9
    if not template.probable or template.probable[0] <= template.evident <= template.probable[1]:
        assert evident == pytest.approx(template.evident)


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("template:astonishmant", "did you mean template:astonishment?"),
        ("smiel", "did you mean SMILE"),
        ("grieff", "template:grief"),
        ("zzz", "template:grief"),
    ],
)
def test_expression_with_an_unknown_name_is_dropped_with_suggestions(play, name: str, meant: str) -> None:
    played = play(f'<own:expression id="e" name="{name}"/><head id="h" lexeme="NOD"/>')
    assert played.warnings == [("b:e", "CANNOT_CREATE_BEHAVIOR")]
    assert meant in played.warnings_text
    assert played.times("h")


def test_expression_of_the_user_is_played_by_both_elements(tmp_path) -> None:
    (tmp_path / "smirk.toml").write_text(
        "aus = { 12L = 0.6, 2R = 0.3 }\nonset = 0.2\napex = 0.5\noffset = 0.4\n", "utf-8"
    )
    body = '<own:expression xmlns:own="urn:bml-realizer:1" id="e" name="Smirk" intensity="1"/>'
    body += '<faceLexeme id="f" lexeme="SMIRK" amount="0.5" start="3"/>'
    played = realize(f'<bml id="b">{body}</bml>', fps=100, expressions=tmp_path, idle=False)
    assert played.warnings == ()
    names = played.to_json()["au"]["names"]
    shown = played.aus.before_rules[:, [names.index("12L"), names.index("2R"), names.index("12R")]]
    assert shown[40].tolist() == pytest.approx([0.6, 0.3, 0])
    assert shown[340].tolist() == pytest.approx([0.3, 0.15, 0])
    assert list(played.schedules[0]["e"].values()) == pytest.approx([0, 0.2, 0.7, 1.1])


def test_expression_of_a_template_may_be_a_lexeme(play) -> None:
    played = play(f'<faceLexeme id="f" lexeme="template:grief" amount="1" {AT}/>')
    assert played.warnings == []
    assert set(played.aus(1.0)) == {"1L", "1R"}
