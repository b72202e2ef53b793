"""Tests of the player."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import parse
from bml_schema.feedback import (
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
)
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.speech.silent import SilentVoice
from tests.realizer.playback.players import SMILE, au, block, submit


def progress(feedback: list[Feedback]) -> list[tuple[str, float]]:
    return [(f.id, f.global_time) for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)]


def test_player_refuses_options_of_another_type() -> None:
    with pytest.raises(TypeError, match="options: wanted PlayOptions, got 3"):
        Player(3)  # type: ignore[arg-type]


def test_player_acknowledges_predicts_starts_and_ends_a_block() -> None:
    player = Player()
    submit(player, SMILE, now=5.0)
    first, planned, *rest = player.due(100.0)
    assert isinstance(first, PredictionFeedback)
    assert first.blocks[0].global_start == 5.0
    assert first.blocks[0].global_end is None
    assert isinstance(planned, PredictionFeedback)
    assert planned.blocks[0].global_end == pytest.approx(7.6)
    assert progress(rest) == [
        ("b:start", 5.0),
        ("b:s:start", 5.0),
        ("b:s:attackPeak", pytest.approx(5.4)),
        ("b:s:relax", pytest.approx(7.0)),
        ("b:s:end", pytest.approx(7.6)),
        ("b:end", pytest.approx(7.6)),
    ]


def test_due_returns_feedback_at_its_time_and_once() -> None:
    player = Player()
    submit(player, SMILE)
    player.due(0.0)
    assert player.next_deadline() == pytest.approx(0.4)
    assert player.due(0.39) == []
    assert [f.id for f in player.due(0.41) if isinstance(f, SyncPointProgress)] == ["b:s:attackPeak"]
    assert player.due(0.41) == []
    rest = [
        f.id if isinstance(f, SyncPointProgress | BlockProgress) else "SUBSIDING" for f in player.due(10.0)
    ]
    assert rest == ["b:s:relax", "SUBSIDING", "b:s:end", "b:end"]
    assert player.next_deadline() is None


def test_player_starts_and_ends_an_empty_block_at_once() -> None:
    player = Player()
    submit(player, "", now=2.0)
    assert progress(player.due(2.0)) == [("b:start", 2.0), ("b:end", 2.0)]


def test_append_starts_after_the_reported_end_of_earlier_blocks() -> None:
    player = Player()
    submit(player, SMILE, "first")
    submit(player, SMILE, "second", 'composition="APPEND"')
    reported = progress(player.due(100.0))
    assert reported.index(("first:end", 2.6)) < reported.index(("second:start", 2.6))


def test_append_without_earlier_blocks_starts_now() -> None:
    player = Player()
    submit(player, SMILE, "a", 'composition="APPEND"', now=3.0)
    assert ("a:start", 3.0) in progress(player.due(3.0))


def test_merge_plays_beside_earlier_blocks() -> None:
    player = Player()
    submit(player, SMILE, "first")
    submit(player, SMILE, "second", now=1.0)
    reported = dict(progress(player.due(100.0)))
    assert reported["second:start"] == 1.0
    assert reported["first:end"] == pytest.approx(2.6)


def test_replace_ends_earlier_blocks_first_and_silences_them() -> None:
    player = Player()
    submit(player, SMILE, "first")
    submit(player, SMILE, "waiting", 'composition="APPEND"')
    player.due(1.0)
    submit(player, SMILE, "second", 'composition="REPLACE"', now=1.0)
    reported = [id for id, _ in progress(player.due(100.0))]
    assert reported[:5] == ["first:s:relax", "first:s:end", "first:end", "waiting:end", "second:start"]
    assert not any(id.startswith("waiting:s") for id in reported)


def test_player_allows_an_id_again_after_its_end_or_a_replace() -> None:
    player = Player()
    submit(player, SMILE, "b")
    player.due(1.0)
    submit(player, SMILE, "b", 'composition="REPLACE"', now=1.0)
    player.due(20.0)
    submit(player, SMILE, "b", now=20.0)
    reported = progress(player.due(100.0))
    assert ("b:start", 20.0) in reported


def test_player_refuses_an_id_that_still_plays() -> None:
    player = Player()
    submit(player, SMILE)
    player.due(0.5)
    submit(player, SMILE, now=1.0)
    feedback = player.due(1.0)
    warnings = [f for f in feedback if isinstance(f, WarningFeedback)]
    assert len(warnings) == 1
    assert "still in use" in warnings[0].text
    assert [id for id, _ in progress(player.due(100.0))][-1] == "b:end"


def test_stop_ends_a_block_without_a_jump_of_the_face() -> None:
    player = Player(PlayOptions(idle=False))
    submit(player, SMILE)
    player.due(1.0)
    before = au(player, "12L", 1.0)[0]
    assert player.stop(1.0) == ["b"]
    assert progress(player.due(1.0)) == [("b:s:relax", 1.0), ("b:s:end", 1.0), ("b:end", 1.0)]
    times = np.arange(1.0, 1.6, 0.01)
    values = np.array(au(player, "12L", *times))
    assert values[0] == pytest.approx(before, abs=1e-6)
    assert np.abs(np.diff(values)).max() < 0.1
    assert values[-1] == 0
    assert player.due(100.0) == []


def test_player_nods_on_the_word() -> None:
    player = Player(PlayOptions(idle=False))
    made = block(
        '<speech id="say"><text>Yes I <sync id="really"/>really do</text></speech>'
        '<head id="nod" lexeme="NOD" stroke="say:really"/>'
    )
    voice = SilentVoice()
    plan = player.submit(made, 0.0, {b: voice.say(s) for b, s in player.speech_requests(made).items()})
    assert plan.at("nod", "stroke") == pytest.approx(plan.at("say", "really"))
    assert au(player, "54", plan.at("nod", "stroke"))[0] > 0.05


def test_player_keeps_a_shift_until_the_next() -> None:
    player = Player(PlayOptions(idle=False))
    shift = '<faceShift id="{}" start="0" end="1"><faceLexeme lexeme="SMILE" amount="{}"/></faceShift>'
    submit(player, shift.format("f", 0.6), "one")
    player.due(5.0)
    smile = au(player, "12L", 5.0)[0]
    assert smile > 0.2
    submit(player, shift.format("f", 0), "two", now=10.0)
    player.due(10.0)
    assert au(player, "12L", 10.0)[0] == pytest.approx(smile, abs=1e-5)
    assert au(player, "12L", 11.5)[0] == pytest.approx(0, abs=1e-6)


def test_player_gives_the_first_name_to_the_first_character() -> None:
    player = Player(PlayOptions(idle=False))
    submit(player, SMILE, "a", 'characterId="Ann"')
    submit(player, SMILE, "b", 'characterId="Bob" composition="APPEND"')
    assert player.characters == ["Ann", "Bob"]
    assert au(player, "12L", 1.0, character=0)[0] > 0.4
    assert au(player, "12L", 1.0, character=1)[0] > 0.4


def test_player_fixes_a_reference_into_a_running_block() -> None:
    player = Player()
    submit(player, SMILE, "first")
    player.due(1.0)
    submit(player, '<head id="n" lexeme="NOD" stroke="first:s:end"/>', "second", now=1.0)
    reported = dict(progress(player.due(100.0)))
    assert reported["second:n:stroke"] == pytest.approx(2.6)


def test_player_refuses_a_block_with_a_failed_required_behaviour() -> None:
    player = Player()
    submit(player, f'{SMILE}<required><faceLexeme id="x" lexeme="WAGGLE_EARS"/></required>')
    feedback = player.due(100.0)
    assert progress(feedback) == []
    warnings = [f for f in feedback if isinstance(f, WarningFeedback)]
    assert [w.id for w in warnings] == ["b"]
    assert "WAGGLE_EARS" in warnings[0].text


def test_player_ends_a_block_without_its_dropped_behaviours() -> None:
    player = Player()
    submit(player, f'{SMILE}<faceLexeme id="x" lexeme="WAGGLE_EARS" start="0" end="60"/>')
    feedback = player.due(100.0)
    assert [f.id for f in feedback if isinstance(f, WarningFeedback)] == ["b:x"]
    assert progress(feedback)[-1] == ("b:end", pytest.approx(2.6))


def test_set_direct_holds_values_until_they_are_released() -> None:
    player = Player(PlayOptions(idle=False))
    player.set_direct({"12L": 0.8}, now=1.0)
    assert au(player, "12L", 1.0, 5.0) == pytest.approx([0, 0.8])
    player.set_direct({"12L": None}, now=6.0)
    assert au(player, "12L", 6.0, 8.0) == pytest.approx([0.8, 0])
    with pytest.raises(KeyError):
        player.set_direct({"99X": 1.0}, now=8.0)


def test_player_forgets_what_is_past_in_a_long_session() -> None:
    player = Player()
    for i in range(50):
        submit(player, SMILE, f"b{i}", now=10.0 * i)
        player.due(10.0 * i + 5)
    assert len(player.blocks.all()) <= 2
    assert player.state(500.0)["blocks"] == []


@given(st.lists(st.floats(0, 4), min_size=1, max_size=8))
def test_due_gives_the_same_feedback_however_often_it_is_called(asked: list[float]) -> None:
    def feedback_at(times: list[float]) -> list[str]:
        player = Player()
        submit(player, SMILE, "a")
        submit(player, SMILE, "c", 'composition="APPEND"')
        return [f.to_xml() for now in times for f in player.due(now)]

    assert feedback_at([*sorted(asked), 100.0]) == feedback_at([100.0])


def test_resources_leave_out_behaviours_with_faults() -> None:
    lines = '<FaceInterpolator parts="31">0 zero</FaceInterpolator>'
    keys = f'<bmlt:facekeyframe id="k" type="FAPS">{lines}</bmlt:facekeyframe>'
    text = f'<bml id="b" xmlns:bmlt="http://hmi.ewi.utwente.nl/bmlt">{keys}<gaze id="g" target="x"/></bml>'
    assert Player().resources(parse(text, VOCABULARY)) == {"gaze"}


@pytest.mark.parametrize(
    ("document", "language"),
    [
        ('<bml id="b" xml:lang="es"><speech id="s"><text>Hola</text></speech></bml>', "es"),
        ('<bml id="b" xml:lang="es"><speech id="s" xml:lang="nl"><text>Hola</text></speech></bml>', "nl"),
        ('<bml id="b"><speech id="s" xml:lang="nl"><text xml:lang="de">Hola</text></speech></bml>', "de"),
        (
            '<bml id="b" xml:lang="es"><speech id="s"><description priority="1" xml:lang="fr" '
            'type="application/ssml+xml"><speak xmlns="">Hola</speak></description></speech></bml>',
            "fr",
        ),
        (
            '<bml id="b" xml:lang="es"><speech id="s"><description priority="1" xml:lang="fr" '
            'type="application/ssml+xml"><speak xmlns="" xml:lang="th">Hola</speak></description>'
            "</speech></bml>",
            "th",
        ),
        ('<bml id="b"><speech id="s"><text>Hola</text></speech></bml>', "en-US"),
    ],
)
def test_speech_is_requested_in_the_nearest_language(document: str, language: str) -> None:
    requests = Player().speech_requests(parse(document, VOCABULARY))
    assert requests["s"].language == language
