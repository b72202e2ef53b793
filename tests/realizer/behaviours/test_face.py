"""Tests of faceLexeme, faceFacs, face and faceShift."""

import numpy as np
import pytest

from realizer.animation.axis import AU_NAMES
from realizer.animation.blend import blend
from realizer.offline import realize
from realizer.tables.lexemes import face_lexemes
from realizer.tables.templates import templates
from realizer.tables.timing import gaps
from tests.realizer.behaviours.elements import at, check, expand
from tests.rows import each_row

FOUR = (1.0, 1.4, 2.4, 3.0)


def test_face_lexeme_holds_its_amount_from_attack_peak_to_relax() -> None:
    smile = expand('<faceLexeme id="x" lexeme="smile" amount="0.5"/>', FOUR)
    full = face_lexemes()["SMILE"].aus[12, "BOTH"]
    assert at(smile, "12L", 0.99, 1.0, 1.4, 2.0, 2.4, 3.0) == pytest.approx(
        [0, 0, full / 2, full / 2, full / 2, 0], abs=1e-5
    )
    assert at(smile, "12R", 1.4) == at(smile, "12L", 1.4)


def test_face_facs_overshoots_at_attack_peak_and_settles() -> None:
    brow = expand('<ext:faceFacs id="x" au="4" side="LEFT" amount="0.5" overshoot="0.4"/>', FOUR)
    peak, settled, relax = at(brow, "4L", 1.4, 1.65, 2.4)
    assert peak == pytest.approx(0.7)
    assert settled == relax == pytest.approx(0.5)
    assert at(brow, "4R", 1.4) == [0]


def test_face_lexeme_of_one_side_moves_one_side() -> None:
    assert at(expand('<faceLexeme id="x" lexeme="RAISE_LEFT_BROW" amount="1"/>', FOUR), "2R", 1.4) == [0]
    assert at(expand('<faceLexeme id="x" lexeme="RAISE_LEFT_BROW" amount="1"/>', FOUR), "2L", 1.4) == [1]


@each_row("lexeme", sorted(face_lexemes()))
def test_face_lexeme_shows_exactly_its_action_units(lexeme: str) -> None:
    channels = expand(f'<faceLexeme id="x" lexeme="{lexeme.lower()}" amount="1"/>', FOUR)
    values = blend(channels, np.array([1.4])).aus[0]
    shown = {AU_NAMES()[k].rstrip("LR") for k in np.flatnonzero(values)}
    assert shown == {str(au) for au, _ in face_lexemes()[lexeme].aus}


def test_face_scales_its_parts_and_shows_the_stronger() -> None:
    face = expand(
        '<face id="x" amount="0.5"><faceLexeme lexeme="RAISE_MOUTH_CORNERS" amount="1"/>'
        '<ext:faceFacs au="12" amount="0.4"/><ext:faceFacs au="26" amount="0.8"/></face>',
        FOUR,
    )
    assert at(face, "12L", 1.4) == [0.5]
    assert at(face, "26", 1.4) == pytest.approx([0.4])


def test_face_shift_stays() -> None:
    mood = expand('<faceShift id="x" amount="1"><ext:faceFacs au="12" amount="0.3"/></faceShift>', (1, 2))
    assert at(mood, "12L", 1, 2, 100) == pytest.approx([0, 0.3, 0.3])


def test_face_lexeme_suggests_known_names_for_an_unknown_one() -> None:
    (fault,) = check('<faceLexeme id="x" lexeme="SMILLE"/>')
    assert fault.type == "CANNOT_CREATE_BEHAVIOR"
    assert fault.fatal
    assert "SMILE" in fault.text
    assert "'SMILLE'" in fault.text


def test_face_facs_refuses_an_unknown_action_unit_also_inside_a_face() -> None:
    for element in (
        '<ext:faceFacs id="x" au="3"/>',
        '<face id="x"><ext:faceFacs au="3"/></face>',
        '<faceShift id="x"><ext:faceFacs au="3"/></faceShift>',
    ):
        (fault,) = check(element)
        assert fault.type == "CANNOT_CREATE_BEHAVIOR"
        assert "got 3" in fault.text
        assert "4 (Brow lowerer)" in fault.text


def test_face_facs_warns_of_a_side_of_an_action_unit_without_sides() -> None:
    (fault,) = check('<ext:faceFacs id="x" au="26" side="LEFT"/>')
    assert not fault.fatal
    assert at(expand('<ext:faceFacs id="x" au="26" side="LEFT" amount="1"/>', FOUR), "26", 1.4) == [1]


@pytest.mark.parametrize(("au", "side"), [(12, "LEFT"), (12, "BOTH"), (26, "BOTH")])
def test_face_facs_accepts_the_sides_of_an_action_unit(au: int, side: str) -> None:
    assert check(f'<ext:faceFacs id="x" au="{au}" side="{side}"/>') == ()


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


@pytest.mark.parametrize(
    ("side", "lids", "open_"), [("BOTH", {19, 20}, set()), ("LEFT", {19}, {20}), ("RIGHT", {20}, {19})]
)
def test_blink_closes_and_opens_the_lids_of_its_side(
    play, side: str, lids: set[int], open_: set[int]
) -> None:
    played = play(f'<own:blink id="k" side="{side}" start="1"/>')
    times = played.times("k")
    for fap in lids:
        assert played.fap(fap, 0.99) == 0
        assert played.fap(fap, times["attackPeak"]) + played.fap(fap + 2, times["attackPeak"]) == 1024
        assert played.fap(fap, times["end"]) == 0
    for fap in open_:
        assert played.fap(fap, times["attackPeak"]) == 0


def test_blink_takes_the_time_of_a_blink(play) -> None:
    times = play('<own:blink id="k"/>').times("k")
    assert times["end"] == pytest.approx(sum(gap.preferred for gap in gaps("faceLexeme", "BLINK").gaps))
    assert times["end"] < 0.4


def test_blink_of_a_smaller_amount_is_partial(play) -> None:
    played = play('<own:blink id="k" amount="0.5" start="0" attackPeak="0.1" relax="0.3" end="0.5"/>')
    assert played.aus(0.2) == {"45L": 0.5, "45R": 0.5}


def test_face_repeated_blink_closes_the_eyes_three_times() -> None:
    times = np.arange(0, 2, 0.01)
    blinks = expand('<faceLexeme id="x" lexeme="repeated_blink" amount="1"/>', (0.0, 0.1, 1.0, 1.2))
    shut = np.array(at(blinks, "45L", *times)) > 0.5
    assert (np.diff(shut.astype(int)) == 1).sum() == 3
