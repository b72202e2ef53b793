"""Feedback goes to everybody who takes it, each message once, in order, with its number."""

from __future__ import annotations

import pytest

from bml_schema import parse, parse_feedback
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings
from realizer.playback.player import Player
from realizer.server.documents.submission import Intake
from realizer.server.session.effects import Send
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.feedback_publisher import Telling
from realizer.server.streams.connection import Connection, FeedbackFilter

NOD = '<bml id="b"><head id="h" lexeme="NOD" start="0.5"/></bml>'


@pytest.fixture
def telling() -> Telling:
    player = Player(idle=False)
    intake = Intake("s", Settings(), player, lambda effects: None)
    player.submit(parse(NOD, VOCABULARY), 0.0)
    return Telling(player, intake, FeedbackLog())


def numbers(sends: list[Send], connection: int) -> list[int | None]:
    return [parse_feedback(str(send.data)).seq for send in sends if send.connection == connection]


def test_everybody_gets_what_is_due_once_and_in_order(telling: Telling) -> None:
    clients = [Connection(1, 1), Connection(2, 1)]
    sends = [send for t in (0.0, 0.3, 0.6, 9.0) for send in telling.publish(t, clients)]
    assert numbers(sends, 1) == numbers(sends, 2) == list(range(1, telling.log.newest + 1))
    assert telling.publish(9.0, clients) == []
    assert "b:end" in str(sends[-1].data)


def test_who_takes_some_of_it_gets_that_and_who_takes_none_nothing(telling: Telling) -> None:
    progress = Connection(1, 1, FeedbackFilter(frozenset({"blockProgress"})))
    nothing = Connection(2, 1, None)
    sends = telling.publish(9.0, [progress, nothing])
    assert [str(send.data).split(maxsplit=1)[0] for send in sends] == ["<blockProgress", "<blockProgress"]
    nothing.feedback = FeedbackFilter()
    assert telling.publish(9.0, [progress, nothing]) == []
    assert telling.catch_up(nothing) == []


def test_who_comes_back_gets_what_it_has_not_seen_and_then_what_follows(telling: Telling) -> None:
    telling.publish(0.6, [])
    told = telling.log.newest
    late = Connection(3, 2)
    assert numbers(telling.catch_up(late), 3) == list(range(2, told + 1))
    assert numbers(telling.publish(9.0, [late]), 3) == list(range(told + 1, telling.log.newest + 1))
