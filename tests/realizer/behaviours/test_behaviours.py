"""Each behaviour wants time as its table says and shows what it means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import VOCABULARY as CORE
from bml_schema import Behaviour, parse
from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import sample
from realizer.behaviours.kind import Fault, PlanningContext
from realizer.behaviours.registry import KINDS, VOCABULARY
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance
from realizer.tables.lexemes import face_lexemes, head_lexemes

EXT = 'xmlns:ext="http://www.bml-initiative.org/bml/coreextensions-1.0"'
NOWHERE = PlanningContext()


def node(element: str) -> Behaviour:
    return parse(f'<bml id="b" {EXT}>{element}</bml>', VOCABULARY).behaviours[0]


def timing(element: str, world: PlanningContext = NOWHERE) -> Timing:
    one = node(element)
    return KINDS[one.tag].timing(one, world)


def check(element: str, world: PlanningContext = NOWHERE) -> tuple[Fault, ...]:
    one = node(element)
    return KINDS[one.tag].check(one, world)


def keys(wanted: Timing) -> Float64:
    return np.concatenate([[0.0], np.cumsum(wanted.preferred)])


def expand(
    element: str, times: Sequence[float] | None = None, world: PlanningContext = NOWHERE
) -> tuple[Channel, ...]:
    one = node(element)
    kind = KINDS[one.tag]
    at = keys(kind.timing(one, world)) if times is None else np.array(times, np.float64)
    return kind.expand(one, at, world)


def at(channels: Sequence[Channel], name: str, *times: float) -> list[float]:
    frames = blend(channels, np.array(times))
    return [round(float(v), 5) for v in frames.values[:, axis()[name].column]]


def degrees(channels: Sequence[Channel], part: str, *times: float) -> list[tuple[float, float]]:
    """(yaw to the left, pitch up) of eyes or head."""
    left, right, up, down = {"eyes": ("61", "62", "63", "64"), "head": ("51", "52", "53", "54")}[part]
    yaw, pitch = (40, 30) if part == "eyes" else (60, 40)
    values = {name: at(channels, name, *times) for name in (left, right, up, down)}
    return [
        (yaw * (values[left][k] - values[right][k]), pitch * (values[up][k] - values[down][k]))
        for k in range(len(times))
    ]


def test_every_core_element_and_facefacs_has_a_kind() -> None:
    # A behaviour beyond these has its class in its own module, or in a plug-in.
    assert {tag: VOCABULARY.get(tag) for tag in CORE} == dict(CORE)
    assert set(KINDS) == set(VOCABULARY)


ELEMENTS = [
    '<faceLexeme id="x" lexeme="SMILE"/>',
    '<ext:faceFacs id="x" au="4"/>',
    '<face id="x"><faceLexeme lexeme="RAISE_BROWS"/><ext:faceFacs au="26"/></face>',
    '<faceShift id="x"><faceLexeme lexeme="SMILE"/></faceShift>',
    '<gaze id="x" target="0.5,0.1,1"/>',
    '<gazeShift id="x" target="0.5,0.1,1" influence="HEAD"/>',
    '<head id="x" lexeme="NOD"/>',
    '<head id="x" lexeme="SHAKE" repetition="3"/>',
    '<headDirectionShift id="x" target="-1,0,1"/>',
    '<wait id="x" duration="2"/>',
    '<gesture id="x" lexeme="BEAT"/>',
    '<pointing id="x" target="cup"/>',
    '<posture id="x"><stance type="SITTING"/></posture>',
    '<postureShift id="x"><stance type="SITTING"/></postureShift>',
    '<locomotion id="x" target="door"/>',
]


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_behaviour_has_the_sync_points_of_the_standard_and_sensible_gaps(element: str) -> None:
    one, wanted = node(element), timing(element)
    assert [p for p in wanted.points if ":" not in p] == list(one.sync_points)
    assert np.all(wanted.preferred >= wanted.least)
    assert np.all(wanted.least >= 0)
    assert np.all(wanted.stiffness > 0)
    assert not check(element)


@pytest.mark.parametrize("element", ELEMENTS)
def test_channels_start_at_rest_and_end_there_or_hold(element: str) -> None:
    times = keys(timing(element))
    for channel in expand(element):
        assert channel.source == "x"
        assert channel.times[0] >= times[0]
        assert channel.times[-1] == times[-1]
        assert channel.values[0] == 0
        assert channel.keeps_last == (KINDS[node(element).tag].region is not None)
        assert channel.values[-1] == 0 or channel.keeps_last
        assert (channel.layer is Layer.BASE) == channel.keeps_last


@pytest.mark.parametrize("element", ELEMENTS)
@given(gaps=st.lists(st.sampled_from([0.0, 0.001, 0.3, 5.0]), min_size=12, max_size=12))
def test_any_rising_times_give_finite_rising_keys(element: str, gaps: list[float]) -> None:
    count = len(timing(element).points)
    for channel in expand(element, np.cumsum(gaps[:count]).tolist()):
        assert np.all(np.diff(channel.times) >= 0)
        assert np.all(np.isfinite(channel.values))
        assert np.all(np.isfinite(sample([channel], np.linspace(0, 60, 100))))


# --- faces

FOUR = (1.0, 1.4, 2.4, 3.0)


def test_an_expression_reaches_its_amount_at_attack_peak_holds_to_relax_and_is_gone_at_end() -> None:
    smile = expand('<faceLexeme id="x" lexeme="smile" amount="0.5"/>', FOUR)
    full = face_lexemes()["SMILE"].aus[12, "BOTH"]
    assert at(smile, "12L", 0.99, 1.0, 1.4, 2.0, 2.4, 3.0) == pytest.approx(
        [0, 0, full / 2, full / 2, full / 2, 0], abs=1e-5
    )
    assert at(smile, "12R", 1.4) == at(smile, "12L", 1.4)


def test_overshoot_is_above_the_amount_at_attack_peak_and_settles_soon() -> None:
    brow = expand('<ext:faceFacs id="x" au="4" side="LEFT" amount="0.5" overshoot="0.4"/>', FOUR)
    peak, settled, relax = at(brow, "4L", 1.4, 1.65, 2.4)
    assert peak == pytest.approx(0.7)
    assert settled == relax == pytest.approx(0.5)
    assert at(brow, "4R", 1.4) == [0]


def test_one_side_moves_one_side() -> None:
    assert at(expand('<faceLexeme id="x" lexeme="RAISE_LEFT_BROW" amount="1"/>', FOUR), "2R", 1.4) == [0]
    assert at(expand('<faceLexeme id="x" lexeme="RAISE_LEFT_BROW" amount="1"/>', FOUR), "2L", 1.4) == [1]


@pytest.mark.parametrize("lexeme", sorted(face_lexemes()))
def test_every_lexeme_shows_exactly_its_action_units(lexeme: str) -> None:
    channels = expand(f'<faceLexeme id="x" lexeme="{lexeme.lower()}" amount="1"/>', FOUR)
    values = blend(channels, np.array([1.4])).aus[0]
    shown = {AU_NAMES()[k].rstrip("LR") for k in np.flatnonzero(values)}
    assert shown == {str(au) for au, _ in face_lexemes()[lexeme].aus}


def test_a_compound_scales_its_parts_and_the_stronger_shows() -> None:
    face = expand(
        '<face id="x" amount="0.5"><faceLexeme lexeme="RAISE_MOUTH_CORNERS" amount="1"/>'
        '<ext:faceFacs au="12" amount="0.4"/><ext:faceFacs au="26" amount="0.8"/></face>',
        FOUR,
    )
    assert at(face, "12L", 1.4) == [0.5]
    assert at(face, "26", 1.4) == pytest.approx([0.4])


def test_a_face_shift_stays() -> None:
    mood = expand('<faceShift id="x" amount="1"><ext:faceFacs au="12" amount="0.3"/></faceShift>', (1, 2))
    assert at(mood, "12L", 1, 2, 100) == pytest.approx([0, 0.3, 0.3])


def test_an_unknown_lexeme_is_refused_and_the_nearest_are_named() -> None:
    (fault,) = check('<faceLexeme id="x" lexeme="SMILLE"/>')
    assert fault.type == "CANNOT_CREATE_BEHAVIOR"
    assert fault.fatal
    assert "SMILE" in fault.text
    assert "'SMILLE'" in fault.text


def test_an_unknown_action_unit_is_refused_also_inside_a_face() -> None:
    for element in (
        '<ext:faceFacs id="x" au="3"/>',
        '<face id="x"><ext:faceFacs au="3"/></face>',
        '<faceShift id="x"><ext:faceFacs au="3"/></faceShift>',
    ):
        (fault,) = check(element)
        assert fault.type == "CANNOT_CREATE_BEHAVIOR"
        assert "got 3" in fault.text
        assert "4 (Brow lowerer)" in fault.text


def test_a_side_of_an_action_unit_without_sides_is_said_but_plays() -> None:
    (fault,) = check('<ext:faceFacs id="x" au="26" side="LEFT"/>')
    assert not fault.fatal
    assert at(expand('<ext:faceFacs id="x" au="26" side="LEFT" amount="1"/>', FOUR), "26", 1.4) == [1]


# --- head

SEVEN = (0.0, 0.2, 0.2, 0.5, 0.8, 0.8, 1.0)


def test_a_nod_is_lowest_exactly_at_its_stroke() -> None:
    nod = expand('<head id="x" lexeme="nod" amount="1"/>', SEVEN)
    times = np.linspace(0, 1, 1001)
    pitch = np.array(degrees(nod, "head", *times))[:, 1]
    assert times[pitch.argmin()] == pytest.approx(0.5, abs=0.005)
    assert pitch[500] == pytest.approx(-head_lexemes()["NOD"].stroke[54], abs=1e-3)
    assert pitch[0] == pitch[-1] == 0
    assert pitch.max() > 0  # the head comes up a little before it goes down


def test_the_eyes_stay_with_their_partner_while_the_head_nods() -> None:
    nod = expand('<head id="x" lexeme="NOD" amount="1"/>', SEVEN)
    head, eyes = degrees(nod, "head", 0.5)[0][1], degrees(nod, "eyes", 0.5)[0][1]
    assert eyes == pytest.approx(-head_lexemes()["NOD"].eyes * head, abs=1e-3)
    assert degrees(nod, "eyes", 1.0) == [(0, 0)]


def test_a_repeated_nod_has_a_numbered_stroke_each_and_is_down_at_each() -> None:
    element = '<head id="x" lexeme="NOD" repetition="3" amount="1"/>'
    wanted = timing(element)
    assert wanted.points == (
        *("start", "ready", "strokeStart", "stroke:1", "stroke:2", "stroke:3"),
        *("stroke", "strokeEnd", "relax", "end"),
    )
    times = dict(zip(wanted.points, keys(wanted), strict=True))

    def pitch(t: float) -> float:
        return degrees(expand(element), "head", t)[0][1]

    for k in (1, 2, 3):
        here = times[f"stroke:{k}"]
        assert pitch(here) < pitch(here - 0.05)
        assert pitch(here) < pitch(here + 0.05)
    assert times["stroke"] == times["stroke:3"]
    assert pitch((times["stroke:1"] + times["stroke:2"]) / 2) == pytest.approx(0, abs=1e-3)


def test_a_shake_goes_to_one_side_and_then_to_the_other() -> None:
    shake = expand('<head id="x" lexeme="SHAKE" amount="1"/>', SEVEN)
    (first, _), (second, _), (rest, _) = degrees(shake, "head", 0.5, 0.8, 1.0)
    assert first > 10
    assert second < -10
    assert rest == 0


def test_a_tilt_is_held_from_stroke_to_relax() -> None:
    tilt = expand('<head id="x" lexeme="TILT" amount="1"/>', (0, 0.1, 0.1, 0.5, 0.7, 1.5, 2))
    stroke, held, relax, end = at(tilt, "55", 0.5, 1.0, 1.5, 2.0)
    assert stroke > held == relax > 0.3
    assert end == 0


def test_the_amount_scales_a_nod() -> None:
    half = degrees(expand('<head id="x" lexeme="NOD"/>', SEVEN), "head", 0.5)[0][1]
    full = degrees(expand('<head id="x" lexeme="NOD" amount="1"/>', SEVEN), "head", 0.5)[0][1]
    assert half == pytest.approx(full / 2, abs=1e-3)


def test_an_unknown_head_lexeme_is_refused() -> None:
    (fault,) = check('<head id="x" lexeme="NODD"/>')
    assert fault.fatal
    assert "NOD" in fault.text


def test_a_head_turns_to_its_target_and_stays() -> None:
    turned = expand('<headDirectionShift id="x" target="-1,0,1"/>', (0, 1))
    assert degrees(turned, "head", 5)[0] == pytest.approx((-45, 0), abs=0.01)
    behind = expand('<headDirectionShift id="x" target="0.1,0,-1"/>', (0, 1))
    assert degrees(behind, "head", 5)[0] == pytest.approx((60, 0), abs=0.01)


# --- gaze

LOOK = (0.0, 0.5, 1.5, 2.0)
SCENE = PlanningContext(scene={"cup": (0.5, 0.0, 1.0), "Door": (-2.0, 0.0, 1.0)})


def gaze(target: str, attributes: str = "", world: PlanningContext = NOWHERE) -> tuple[Channel, ...]:
    return expand(f'<gaze id="x" target="{target}" {attributes}/>', LOOK, world)


def total(channels: Sequence[Channel], *times: float) -> list[tuple[float, float]]:
    eyes, head = degrees(channels, "eyes", *times), degrees(channels, "head", *times)
    return [(a + c, b + d) for (a, b), (c, d) in zip(eyes, head, strict=True)]


@pytest.mark.parametrize("influence", ["", "EYES", "HEAD", "NECK", "SHOULDER", "WAIST", "WHOLE", "TAIL"])
def test_eyes_and_head_together_look_at_the_target(influence: str) -> None:
    look = gaze("0.4,0.2,1", f'influence="{influence}"' if influence else "")
    wanted = (np.degrees(np.arctan2(0.4, 1)), np.degrees(np.arctan2(0.2, np.hypot(0.4, 1))))
    assert total(look, 0.5)[0] == pytest.approx(wanted, abs=0.01)
    assert total(look, 1.5)[0] == pytest.approx(wanted, abs=0.01)
    assert total(look, 2.0)[0] == (0, 0)


def test_the_eyes_lead_and_turn_back_by_as_much_as_the_head_follows() -> None:
    look = gaze("0.4,0,1", 'influence="HEAD"')
    times = np.linspace(0.1, 0.5, 41)
    assert degrees(look, "head", 0.1)[0] == (0, 0)
    assert degrees(look, "head", 0.5)[0][0] > 5
    yaw = [angle[0] for angle in total(look, *times)]
    assert yaw == pytest.approx([yaw[-1]] * len(yaw), abs=0.01)


def test_influence_shares_the_angle() -> None:
    parts = [
        degrees(gaze("0.4,0,1", f'influence="{word}"'), "head", 0.5)[0][0]
        for word in ("EYES", "HEAD", "WHOLE")
    ]
    assert parts[0] == 0 < parts[1] < parts[2]


def test_the_head_takes_what_the_eyes_cannot_and_nothing_turns_too_far() -> None:
    look = gaze("2,0,1")
    assert abs(degrees(look, "eyes", 0.5)[0][0]) <= 35.001
    assert total(look, 0.5)[0][0] == pytest.approx(np.degrees(np.arctan2(2, 1)), abs=0.01)
    behind = gaze("0.01,0,-1")
    assert total(behind, 0.5)[0][0] == pytest.approx(95, abs=0.01)
    only_eyes = gaze("2,0,1", 'influence="EYES"')
    assert total(only_eyes, 0.5)[0][0] == pytest.approx(35, abs=0.01)


@pytest.mark.parametrize(
    ("direction", "wanted"),
    [("RIGHT", (-10, 0)), ("LEFT", (10, 0)), ("UP", (0, 10)), ("DOWN", (0, -10)), ("UPLEFT", (7.07, 7.07))],
)
def test_an_offset_turns_the_gaze_by_degrees(direction: str, wanted: tuple[float, float]) -> None:
    look = gaze("user", f'offsetAngle="10" offsetDirection="{direction}"')
    assert total(look, 0.5)[0] == pytest.approx(wanted, abs=0.01)


def test_names_are_found_in_the_scene_in_either_case() -> None:
    assert total(gaze("cup", world=SCENE), 0.5)[0][0] == pytest.approx(26.565, abs=0.01)
    assert total(gaze("door", world=SCENE), 0.5)[0][0] < -50
    assert not check('<gaze id="x" target="door"/>', SCENE)


def test_without_a_scene_any_target_is_straight_ahead_silently() -> None:
    assert not check('<gaze id="x" target="nobody"/>')
    assert total(gaze("nobody"), 0.5) == [(0, 0)]


@pytest.mark.parametrize("element", ["gaze", "gazeShift", "headDirectionShift"])
def test_an_unknown_name_in_a_scene_is_said_and_it_still_plays(element: str) -> None:
    (fault,) = check(f'<{element} id="x" target="cupp"/>', SCENE)
    assert fault.type == "NO_SUCH_TARGET"
    assert not fault.fatal
    assert "wanted one of cup" in fault.text
    assert "'cupp'" in fault.text
    assert not check(f'<{element} id="x" target="1, -2.5, .5"/>', SCENE)


def test_an_empty_scene_knows_nobody() -> None:
    (fault,) = check('<gaze id="x" target="cup"/>', PlanningContext(scene={}))
    assert "0,0,1" in fault.text


def test_near_things_make_the_eyes_converge() -> None:
    near, far = at(gaze("0,0,0.3"), "66", 0.5)[0], at(gaze("0,0,5"), "66", 0.5)[0]
    assert near > 0.3 > 0.05 > far


def test_a_gaze_takes_eyes_and_head_from_the_base_gaze_and_gives_them_back() -> None:
    away = expand('<gazeShift id="s" target="-0.6,0,1" influence="HEAD"/>', (0, 0.1))
    look = [*away, *(channel.shifted(1.0) for channel in gaze("0.4,0,1"))]
    base = total(away, 5)[0]
    assert total(look, 1.0)[0] == pytest.approx(base)
    assert total(look, 2.0)[0] == pytest.approx((np.degrees(np.arctan2(0.4, 1)), 0), abs=0.01)
    assert total(look, 3.0)[0] == pytest.approx(base)


def test_a_gaze_of_the_eyes_is_quick() -> None:
    assert timing('<gaze id="x" target="a" influence="EYES"/>').preferred[0] <= 0.15


# --- speech


def spoken(duration: float, **marks: float) -> PlanningContext:
    phonemes = (Phoneme(0.1, 0.4, "m"), Phoneme(0.4, duration, "ɑː"))
    return PlanningContext(utterances={"x": Utterance(duration, (), phonemes, marks)})


def say(element: str, world: PlanningContext = NOWHERE) -> SpeechRequest:
    one = node(element)
    kind = KINDS[one.tag]
    assert kind.speech_request is not None
    said = kind.speech_request(one, world)
    assert said is not None
    return said


SPEECH = '<speech id="x"><text>A &lt;b&gt; &amp; <sync id="m"/>c<sync id="n"/></text>{}</speech>'
SSML = """<description priority="{}" type="application/ssml+xml"><speak xml:lang="de-DE"
    xmlns="http://www.w3.org/2001/10/synthesis">Eins &amp; <emphasis>zwei <mark name="m"/></emphasis>
    drei</speak></description>"""


def test_text_becomes_ssml_with_its_syncs_as_marks() -> None:
    assert say(SPEECH.format("")) == SpeechRequest(
        'A &lt;b&gt; &amp; <mark name="m"/>c<mark name="n"/>', ("m", "n"), "en-US"
    )
    assert say(SPEECH.format(""), PlanningContext(language="fr-FR")).language == "fr-FR"


def test_the_ssml_description_of_highest_priority_replaces_the_text() -> None:
    low = SSML.format(1).replace("Eins", "Null")
    said = say(SPEECH.format(low + SSML.format(3)))
    assert said.ssml.startswith("Eins &amp; <emphasis>zwei <mark name=")
    assert "xmlns" not in said.ssml
    assert said.marks == ("m",)
    assert said.language == "de-DE"


def test_a_description_that_is_not_known_leaves_the_text() -> None:
    other = '<description priority="9" type="audio/x-unknown">nothing</description>'
    assert say(SPEECH.format(other)).marks == ("m", "n")


def test_speech_is_rigid_and_its_syncs_come_at_their_times() -> None:
    wanted = timing(SPEECH.format(""), spoken(2.0, m=0.75, n=2.0))
    assert wanted.rigid
    assert wanted.points == ("start", "m", "n", "end")
    assert wanted.preferred.tolist() == [0.75, 1.25, 0.0]


def test_syncs_stand_in_the_order_of_their_times() -> None:
    wanted = timing(SPEECH.format(""), spoken(2.0, m=1.5, n=0.5))
    assert wanted.points == ("start", "n", "m", "end")


def test_a_sync_that_the_ssml_left_out_comes_as_far_into_the_sound_as_into_the_text() -> None:
    wanted = timing(SPEECH.format(SSML.format(1)), spoken(4.0, m=1.0))
    assert wanted.points == ("start", "m", "n", "end")
    assert keys(wanted) == pytest.approx([0, 1, 4, 4])


def test_marks_beyond_the_sound_are_kept_within_it() -> None:
    assert keys(timing(SPEECH.format(""), spoken(1.0, m=-0.1, n=1.2))).tolist() == [0, 0, 1, 1]


def test_a_speech_without_anything_to_say_is_refused() -> None:
    (fault,) = check('<speech id="x"/>')
    assert fault.fatal
    assert "<text>" in fault.text


def test_speech_moves_the_lips_from_its_start_on() -> None:
    channels = expand(SPEECH.format(""), (3.0, 3.5, 4.0, 4.0), spoken(1.0))
    assert {channel.layer for channel in channels} == {Layer.SPEECH}
    assert {channel.source for channel in channels} == {"x"}
    assert at(channels, "lips", 2.9, 3.6) == [0, 1]


# --- wait and the body


def test_a_wait_lasts_its_duration_or_nothing() -> None:
    assert timing('<wait id="x" duration="1.5"/>').preferred.tolist() == [1.5]
    assert timing('<wait id="x"/>').preferred.tolist() == [0]


@pytest.mark.parametrize("element", [e for e in ELEMENTS if e.startswith(("<ge", "<po", "<lo", "<wa"))])
def test_the_body_shows_nothing_on_a_face(element: str) -> None:
    assert expand(element) == ()
