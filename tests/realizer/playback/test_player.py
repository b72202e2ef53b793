"""Tests of the player."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bml_schema import Block, parse
from bml_schema.feedback import (
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
)
from realizer.animation.axis import AU_NAMES
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.speech.silent import SilentVoice


def block(content: str, id: str = "b", attributes: str = "") -> Block:
    return parse(f'<bml id="{id}" {attributes}>{content}</bml>', VOCABULARY)


def submit(player: Player, *args: str, now: float = 0.0) -> None:
    made = block(*args)
    voice = SilentVoice()
    player.submit(made, now, {b: voice.say(say) for b, say in player.speech_requests(made).items()})


def progress(feedback: list[Feedback]) -> list[tuple[str, float]]:
    return [(f.id, f.global_time) for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)]


def au(player: Player, name: str, *times: float, character: int = 0) -> list[float]:
    values = player.frames(np.array(times), character).aus[:, AU_NAMES().index(name)]
    return [float(v) for v in values]


SMILE = '<faceLexeme id="s" lexeme="SMILE" amount="1" start="0" attackPeak="0.4" relax="2" end="2.6"/>'


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
    assert reported[:3] == ["first:end", "waiting:end", "second:start"]
    assert not any(id.startswith(("first:s", "waiting:s")) for id in reported)


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
    assert progress(player.due(1.0)) == [("b:end", 1.0)]
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


@given(st.integers(0, 2**31), st.floats(0, 200))
def test_frames_at_25_fps_are_every_second_of_50(seed: int, start: float) -> None:
    player = Player(PlayOptions(seed=seed))
    submit(player, SMILE, now=start)
    slow = player.frames(start + np.arange(40) / 25)
    fast = player.frames(start + np.arange(80) / 50)
    assert np.allclose(slow.values, fast.values[::2], atol=1e-6)


@given(st.lists(st.floats(0, 4), min_size=1, max_size=8))
def test_due_gives_the_same_feedback_however_often_it_is_called(asked: list[float]) -> None:
    def feedback_at(times: list[float]) -> list[str]:
        player = Player()
        submit(player, SMILE, "a")
        submit(player, SMILE, "c", 'composition="APPEND"')
        return [f.to_xml() for now in times for f in player.due(now)]

    assert feedback_at([*sorted(asked), 100.0]) == feedback_at([100.0])


# The parts that idle motion and prosody move: brows, lids, head, eyes.
OWN = ("1L", "1R", "2L", "2R", "45L", "45R", *map(str, range(51, 57)), *map(str, range(61, 65)))
WORDS = "Whoever follows the river to the tower, will discover a little door."
TALK = f'<speech id="t"><text>{WORDS}</text></speech>'
MOODS = [
    f'<faceShift id="m" end="0.4"><faceLexeme id="l" lexeme="{name}" amount="{amount}"/></faceShift>'
    for name, amount in (("JOY", 1.0), ("SADNESS", 0.1))
]


def test_prosody_off_leaves_a_speaking_face_as_idle_as_a_silent_one() -> None:
    times = np.arange(0.0, 8.0, 0.04)
    own = np.array([name in OWN for name in AU_NAMES()])
    silent, still, lively = (
        Player(PlayOptions(seed=4)),
        Player(PlayOptions(seed=4, prosody=False)),
        Player(PlayOptions(seed=4)),
    )
    submit(still, TALK)
    submit(lively, TALK)
    np.testing.assert_array_equal(still.frames(times).aus[:, own], silent.frames(times).aus[:, own])
    assert not np.array_equal(lively.frames(times).aus[:, own], silent.frames(times).aus[:, own])


def test_prosody_needs_idle_motion() -> None:
    times = np.arange(0.0, 8.0, 0.04)
    one, other = Player(PlayOptions(idle=False)), Player(PlayOptions(idle=False, prosody=False))
    submit(one, TALK)
    submit(other, TALK)
    np.testing.assert_array_equal(one.frames(times).values, other.frames(times).values)


def test_prosody_of_a_still_face_is_still() -> None:
    times = np.arange(0.2, 8.0, 0.04)
    still = '<own:idle id="i" blinks="0" motion="0" start="0" end="0.1"/>'
    player = Player()
    submit(player, still + TALK, "b", 'xmlns:own="urn:bml-realizer:1"')
    own = [AU_NAMES().index(name) for name in OWN]
    assert player.frames(times).aus[:, own].max() == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_prosody_leaves_a_nod_of_the_document_unchanged(seed: int) -> None:
    nod = '<head id="n" lexeme="NOD" start="1.5" end="3"/>'
    lively, still = Player(PlayOptions(seed=seed)), Player(PlayOptions(seed=seed, prosody=False))
    for player in (lively, still):
        submit(player, TALK + nod)
    heads = [AU_NAMES().index(str(number)) for number in range(51, 57)]
    during = np.arange(1.5, 3.001, 0.02)
    shown, wanted = (p.frames(during).aus[:, heads] for p in (lively, still))
    np.testing.assert_array_equal(shown, wanted)


def test_frames_of_the_head_in_speech_follow_the_mood() -> None:
    def lifted(*shifts: str) -> float:
        player = Player(PlayOptions(seed=3, liveliness=0.0))
        for shift in shifts:
            submit(player, shift, "a")
        submit(player, TALK, "b", now=1.0)
        up, down = (au(player, name, *np.arange(2.0, 4.0, 0.02)) for name in ("53", "54"))
        return float(np.mean(up) - np.mean(down))

    assert lifted(MOODS[0]) > lifted() + 0.01


@pytest.mark.parametrize("idle", [True, False])
def test_frames_of_the_mouth_in_speech_follow_what_the_face_shows(idle: bool) -> None:
    def open_jaw(lexeme: str) -> float:
        player = Player(PlayOptions(idle=idle, liveliness=0.0))
        submit(player, TALK + f'<faceLexeme id="f" lexeme="{lexeme}" start="t:start" end="t:end"/>')
        return float(player.frames(np.arange(0.0, 4.0, 0.04)).faps[:, 2].max())

    assert open_jaw("ANGER") > 1.1 * open_jaw("DISGUST") > 1.1 * open_jaw("SADNESS")


@settings(max_examples=12)
@given(
    st.integers(0, 1000),
    st.lists(st.floats(0.0, 12.0), min_size=1, max_size=3),
    st.floats(0.0, 12.0),
    st.lists(st.floats(0.0, 14.0), max_size=2),
)
def test_frames_while_speech_grows_are_those_of_the_playback(
    seed: int, starts: list[float], nod: float, moods: list[float]
) -> None:
    """Dropping ended blocks changes neither past nor future frames."""
    live, played = Player(PlayOptions(seed=seed)), Player(PlayOptions(seed=seed), history=float("inf"))
    others = [(nod, '<head id="n" lexeme="NOD"/>')]
    others += [(mood, MOODS[k]) for k, mood in enumerate(sorted(moods))]
    todo = sorted([(start, TALK) for start in starts] + others)
    own = [AU_NAMES().index(name) for name in OWN]
    seen = []
    times = np.arange(0.0, 26.0, 0.16)
    for number, now in enumerate(times):
        while todo and todo[0][0] <= now:
            _, content = todo.pop(0)
            for player in (live, played):
                submit(player, content, f"b{number}-{len(todo)}", now=float(now))
        for player in (live, played):
            player.due(float(now))
        seen.append(live.frames(np.array([now])).aus[0, own])
    np.testing.assert_array_equal(np.array(seen), played.frames(times).aus[:, own])


def test_resources_leave_out_behaviours_with_faults() -> None:
    lines = '<FaceInterpolator parts="31">0 zero</FaceInterpolator>'
    keys = f'<bmlt:facekeyframe id="k" type="FAPS">{lines}</bmlt:facekeyframe>'
    text = f'<bml id="b" xmlns:bmlt="http://hmi.ewi.utwente.nl/bmlt">{keys}<gaze id="g" target="x"/></bml>'
    assert Player().resources(parse(text, VOCABULARY)) == {"gaze"}
