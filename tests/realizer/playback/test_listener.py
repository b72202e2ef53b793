import numpy as np
import pytest

from realizer.animation.axis import au
from realizer.behaviours.kind import PlanningContext
from realizer.playback.listener import responses
from realizer.playback.player import Player

CONTEXT = PlanningContext(seed=2)
TARGETS = {au(54)[0]: "nod", au(1)[0]: "brows", au(12)[0]: "smile"}


def hear(known=(), now=10.0, text=None, is_speaking=True):
    return responses(known, now, CONTEXT, is_speaking=is_speaking, text=text)


def shown(channels, before=np.inf):
    return [(TARGETS[c.target], c.times[0]) for c in channels if c.target in TARGETS and c.times[0] < before]


@pytest.mark.parametrize(
    ("text", "response"),
    [("Well,", "nod"), ("I was there. ", "nod"), ("Really?", "brows"), ("What luck!", "smile")],
)
def test_responses_follow_the_end_of_a_piece_of_text(text, response) -> None:
    assert shown(hear(text=text), before=11.0) == [(response, pytest.approx(10.25))]


def test_responses_wait_while_a_piece_goes_on() -> None:
    for text in (None, "", "I was"):
        assert shown(hear(text=text), before=11.5) == []


def test_responses_come_of_themselves_while_the_other_speaks() -> None:
    times = [time for _, time in shown(hear())]
    assert len(times) > 5
    assert 11.5 < min(times) < max(times) < 71.6


def test_responses_end_with_the_turn_and_a_nod() -> None:
    listening = hear()
    ended = hear(listening, now=30.0, is_speaking=False)
    late = [item for item in shown(ended) if item[1] > 30.0]
    assert late in ([("nod", pytest.approx(30.25))], [])
    eyes, *shown_before = (c for c in listening if c.times[0] <= 30.0)
    assert {id(c) for c in shown_before} <= {id(c) for c in ended}
    assert [c.until for c in ended if c.target == eyes.target] == [30.0]


def test_responses_that_have_begun_are_not_doubled() -> None:
    nodding = hear(text="Yes.")
    again = hear(nodding, now=10.3, text="Yes.")
    assert len(shown(again, before=11.5)) == 1


def test_hear_moves_the_face_and_leaves_the_past() -> None:
    times = np.arange(0.0, 5.0, 0.04)
    still, player = Player(), Player()
    player.hear(1.0, is_speaking=True, text="Is it?")
    after = player.frames(times).aus
    assert (after == still.frames(times).aus)[times <= 1.25].all()
    assert np.abs(after - still.frames(times).aus)[times > 1.3].max() > 0.1
    version = player.version
    player.hear(2.0, is_speaking=False)
    assert player.version != version
    assert (player.frames(times).aus == after)[times <= 2.0].all()
