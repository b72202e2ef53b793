"""Tests of interrupt, activate and parametervaluechange."""

from __future__ import annotations

import numpy as np
import pytest

from bml_schema import parse
from realizer.core.options import PlayOptions
from realizer.offline import realize
from realizer.playback.player import Player
from realizer.playback.scheduled_speech import render_utterance
from realizer.realization import Realization
from realizer.speech.silent import SilentVoice

BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'
SMILE = '<faceLexeme id="s" lexeme="SMILE" start="0" attackPeak="0.4" relax="4" end="5"/>'


def play(*inside: str) -> Realization:
    """Play blocks a, b, c ... that begin together."""
    documents = [
        f'<bml id="{name}" {BMLA}{text if text.startswith(" ") else ">" + text}</bml>'
        for name, text in zip("abcdef", inside, strict=False)
    ]
    return realize("".join(documents), voice=SilentVoice(), idle=False, fps=50)


def feedback_with(played: Realization, part: str) -> list[str]:
    return [f for f in played.feedback if part in f and "predictionFeedback" not in f]


def interrupt(more: str = "", start: float = 1.0, target: str = "a") -> str:
    return f'<bmla:interrupt id="i" target="{target}" start="{start}"{more}/>'


def test_interrupt_ends_the_whole_block_by_default() -> None:
    played = play(SMILE, interrupt())
    (end,) = feedback_with(played, '"a:end"')
    assert 'globalTime="1"' in end
    assert "INTERRUPTED" in end
    for point in ("relax", "end"):
        (feedback,) = feedback_with(played, f'"a:s:{point}"')
        assert 'globalTime="1"' in feedback


def test_interrupt_relaxes_the_face_without_a_jump() -> None:
    played = play(SMILE, interrupt())
    steps = np.abs(np.diff(played.aus.aus, axis=0)).max()
    assert played.aus.aus[49].max() > 0.3
    assert played.duration == pytest.approx(1.3)
    assert played.aus.aus[65].max() == 0
    assert steps < 0.12  # in a fiftieth of a second


def test_interrupt_of_some_behaviours_lets_the_block_go_on() -> None:
    nod = '<head id="n" lexeme="NOD" start="2"/>'
    played = play(SMILE + nod, interrupt(' include="s"'))
    (relax,), (end,) = feedback_with(played, "a:s:relax"), feedback_with(played, "a:s:end")
    assert 'time="1"' in relax
    assert 'time="1.3"' in end
    assert feedback_with(played, "a:n:end")
    assert "DONE" in feedback_with(played, '"a:end"')[0]
    assert played.schedules[0].at("s", "end") == pytest.approx(1.3)


def test_interrupt_spares_excluded_behaviours() -> None:
    nod = '<head id="n" lexeme="NOD" start="2"/>'
    played = play(SMILE + nod, interrupt(' exclude="s"'))
    assert not feedback_with(played, "a:n:")
    assert 'time="5"' in feedback_with(played, "a:s:end")[0]


def test_interrupt_of_all_remaining_behaviours_ends_the_block() -> None:
    played = play(SMILE + '<head id="n" lexeme="NOD"/>', interrupt(' include="s"', start=3.0))
    assert "INTERRUPTED" in feedback_with(played, '"a:end"')[0]


def test_interrupt_of_a_past_block_is_ignored_of_an_unknown_one_warned() -> None:
    assert not play('<wait id="w" duration="0.2"/>', interrupt()).warnings
    played = play(SMILE, interrupt(target="nobody"))
    assert [f for f in feedback_with(played, "warningFeedback") if "b:i" in f and "nobody" in f]


def test_interrupt_that_is_required_and_fails_ends_its_own_block() -> None:
    played = play(f"<required>{interrupt(target='nobody')}</required>{SMILE}")
    (end,) = feedback_with(played, '"a:end"')
    assert "INTERRUPTED" in end
    (warning,) = feedback_with(played, "warningFeedback")
    assert 'id="a"' in warning
    assert played.feedback.index(warning) < played.feedback.index(end)


def test_activate_starts_a_preplanned_block() -> None:
    played = play(f' bmla:preplan="true">{SMILE}', '<bmla:activate id="x" target="a" start="2"/>')
    assert 'globalTime="2"' in feedback_with(played, '"a:start"')[0]
    assert played.schedules[0].start == 2.0
    assert played.duration == 7.0


def test_activate_of_a_block_that_does_not_wait_warns() -> None:
    played = play(SMILE, '<bmla:activate id="x" target="a" start="2"/>')
    assert [f for f in feedback_with(played, "warningFeedback") if "b:x" in f]


def change(parameter: str, trajectory: str, times: str, target: str = "a:s") -> str:
    return (
        f'<bmla:parametervaluechange id="p" target="{target}" paramId="{parameter}" {times}>'
        f"<bmla:trajectory {trajectory}/></bmla:parametervaluechange>"
    )


def strongest(played: Realization, time: float) -> float:
    return float(played.aus.aus[round(time * played.fps)].max())


def test_change_moves_an_amount_evenly_to_its_new_value() -> None:
    linear = change("amount", 'type="linear" targetValue="1"', 'start="1" end="3"')
    plain, played = play(SMILE), play(SMILE, linear)
    ratios = [strongest(played, t) / strongest(plain, t) for t in (1.0, 2.0, 3.0, 3.5)]
    assert ratios == pytest.approx([1.0, 1.5, 2.0, 2.0], abs=0.01)


def test_change_at_once_does_not_jump() -> None:
    played = play(SMILE, change("amount", 'type="instant" targetValue="0.1"', 'start="1"'))
    assert strongest(played, 1.2) == pytest.approx(strongest(played, 0.9) / 5, abs=0.01)
    assert np.abs(np.diff(played.aus.aus, axis=0)).max() < 0.2


def test_change_is_even_only_with_an_end() -> None:
    linear, instant = (
        change("amount", f'type="{type}" targetValue="0.1"', 'start="1"') for type in ("linear", "instant")
    )
    np.testing.assert_array_equal(play(SMILE, linear).aus.aus, play(SMILE, instant).aus.aus)
    to_the_end = change("amount", 'type="instant" targetValue="0.1"', 'start="1" end="3"')
    np.testing.assert_array_equal(play(SMILE, to_the_end).aus.aus, play(SMILE, instant).aus.aus)


def test_change_starts_with_the_initial_value() -> None:
    linear = change("amount", 'type="linear" initialValue="1" targetValue="0.5"', 'start="1" end="3"')
    plain, played = play(SMILE), play(SMILE, linear)
    assert strongest(played, 1.12) / strongest(plain, 1.12) == pytest.approx(2.0, abs=0.05)
    assert strongest(played, 3.0) / strongest(plain, 3.0) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(
    ("parameter", "target"), [("colour", "a:s"), ("amount", "a:nobody"), ("amount", "nobody:s")]
)
def test_change_of_an_unknown_parameter_warns(parameter: str, target: str) -> None:
    played = play(SMILE, change(parameter, 'type="instant" targetValue="1"', 'start="1"', target))
    assert [f for f in feedback_with(played, "warningFeedback") if "b:p" in f and "EXECUTION_FAILURE" in f]


@pytest.mark.espeak
def test_change_lowers_the_volume_of_a_speech() -> None:
    from realizer.speech.registry import find_voice

    voice = find_voice("espeak")
    try:
        player = Player(PlayOptions(idle=False), history=float("inf"))
        quiet = change("volume", 'type="linear" targetValue="0"', 'start="0.5" end="1"')
        for text in ('<speech id="s"><text>one two three four five six</text></speech>', quiet):
            name = "a" if "speech" in text else "b"
            block = parse(f'<bml id="{name}" {BMLA}>{text}</bml>')
            player.submit(block, 0.0, {b: voice.say(s) for b, s in player.speech_requests(block).items()})
        player.due(float("inf"))
        (speaking,) = player.speech()
        sound = np.abs(render_utterance(speaking, 22050))
        assert sound[: 22050 // 2].max() > 1000
        assert sound[22050 + 1 :].max() == 0
    finally:
        voice.close()
