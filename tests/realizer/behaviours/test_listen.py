import numpy as np
import pytest

from bml_schema import Listen, parse
from realizer.animation.axis import AU_NAMES, au, mask_channel
from realizer.animation.curves import sample
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.listen import expand, responses
from realizer.behaviours.registry import VOCABULARY
from realizer.playback.player import Player

EYES = mask_channel("listening")
NOD, BROWS, SMILE = (au(number)[0] for number in (54, 1, 12))
TIMES = np.arange(0.0, 600.0, 0.04)


def given_responses(intensity=1.0, id="x", seed=0, start=0.0, end=600.0):
    context = PlanningContext(seed=seed)
    return expand(Listen(id=id, intensity=intensity), np.array([start, end]), context)


def begins(channels, target):
    return np.array([channel.times[0] for channel in channels if channel.target == target])


def test_listen_nods_raises_brows_and_smiles_every_few_seconds() -> None:
    channels = given_responses()
    counts = [len(begins(channels, target)) for target in (NOD, BROWS, SMILE)]
    assert counts[0] > counts[1] > 10
    assert counts[2] > 10
    starts = np.sort(np.concatenate([begins(channels, target) for target in (NOD, BROWS, SMILE)]))
    assert 2.0 < np.diff(starts).mean() < 4.0
    assert np.diff(starts).min() > 1.39


def test_listen_keeps_within_its_time() -> None:
    for end in (0.1, 1.0, 3.0, 10.0):
        eyes, *channels = given_responses(start=2.0, end=2.0 + end)
        assert (eyes.times == [2.0, 2.0 + end]).all()
        for channel in channels:
            assert 2.0 < channel.times[0] < channel.times[-1] <= 2.0 + end


def test_listen_nods_by_some_degrees_and_keeps_its_eyes_on_the_other() -> None:
    channels = given_responses()
    down = sample([c for c in channels if c.target == NOD], TIMES).max(axis=0) * 40
    up = sample([c for c in channels if c.target == au(63)[0]], TIMES).max(axis=0) * 25
    assert 5.0 < down.max() <= 9.0
    assert up == pytest.approx(down, abs=1e-9)


@pytest.mark.parametrize("intensity", [0.2, 0.5])
def test_listen_responds_less_at_less_intensity(intensity) -> None:
    much, less = ([c for c in given_responses(value) if c.target != EYES] for value in (1.0, intensity))
    assert len(less) < (intensity + 0.2) * len(much)
    most = [max(channel.values.max() for channel in found) for found in (much, less)]
    assert most[1] < 1.1 * intensity * most[0]


def test_listen_does_nothing_at_intensity_zero() -> None:
    assert given_responses(0.0) == ()


def test_listen_depends_on_seed_and_id_alone() -> None:
    first, again, *others = (
        begins(given_responses(id=id, seed=seed), NOD).tolist()
        for id, seed in (("x", 0), ("x", 0), ("y", 0), ("x", 1))
    )
    assert first == again
    assert first not in others


def test_listen_begins_in_the_same_way_however_long_it_lasts() -> None:
    short, long = (begins(given_responses(end=end), NOD) for end in (60.0, 600.0))
    assert (short == long[: len(short)]).all()


def test_listen_looks_at_the_speaker_as_listening_idle_eyes_do() -> None:
    rows = [row for row, name in enumerate(AU_NAMES()) if name in ("61", "62", "63", "64")]
    looks = {}
    for name, body in {
        "listen": '<listen xmlns="urn:bml-realizer:1" id="x" intensity="0.001" start="0" end="25"/>',
        "idle": '<idle xmlns="urn:bml-realizer:1" id="x" eyes="LISTENING" start="0" end="0"/>',
        "usual": '<wait id="x" duration="25"/>',
    }.items():
        player = Player()
        player.submit(parse(f'<bml id="b">{body}</bml>', VOCABULARY), 0.0)
        looks[name] = player.frames(TIMES[50:600]).aus[:, rows]
    assert np.abs(looks["listen"] - looks["idle"]).max() < 1e-6
    assert np.abs(looks["listen"] - looks["usual"]).max() > 0.05


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
