"""Tests of realize and schedule."""

from __future__ import annotations

import inspect
from dataclasses import fields

import pytest

from bml_schema import BMLError, parse
from realizer import realize, schedule
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech
from realizer.speech.silent import SilentVoice
from tests.cases import CASES
from tests.rows import each_row

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'


def test_realize_has_the_options_of_playing_with_their_defaults() -> None:
    parameters = inspect.signature(realize).parameters
    options = {name: p.default for name, p in parameters.items() if name not in ("documents", "voice")}
    assert options == {f.name: f.default for f in fields(PlayOptions)}


def test_realize_takes_one_text_or_several() -> None:
    one, two = realize(NOD, idle=False), realize([NOD, NOD.replace('"b"', '"c"')], idle=False)
    assert (len(one.schedules), len(two.schedules)) == (1, 2)


def test_realize_refuses_a_rate_that_is_not_above_0() -> None:
    with pytest.raises(ValueError, match="fps: wanted a number above 0, got 0"):
        realize(NOD, fps=0)


def test_schedule_has_the_times_that_realize_plays() -> None:
    (played,) = realize(NOD, idle=False).schedules
    assert schedule(NOD).behaviours == played.behaviours


@each_row("case", CASES[::12])
def test_schedule_is_what_a_player_plays(case) -> None:
    try:
        block = parse(case.document, VOCABULARY)
    except BMLError:
        with pytest.raises(BMLError):
            schedule(case.document)
        return
    voice = SilentVoice()
    played = submit_with_speech(Player(PlayOptions()), block, voice)
    scheduled = schedule(case.document, voice=voice)
    assert scheduled.to_json() == played.to_json()
    assert (scheduled.cost, scheduled.failed, scheduled.late) == (played.cost, played.failed, played.late)


def test_schedule_reads_dialects_unless_it_is_strict() -> None:
    draft = '<bml id="b"><head id="n" type="NOD"/></bml>'
    assert schedule(draft).behaviours == schedule(NOD).behaviours
    assert not schedule(draft, strict_bml=True).behaviours


def test_schedule_refuses_a_document_without_a_block() -> None:
    with pytest.raises(BMLError, match="id"):
        schedule("<bml/>")
