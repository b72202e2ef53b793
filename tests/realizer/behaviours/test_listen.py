import numpy as np
import pytest

from bml_schema import Listen
from realizer.animation.axis import au
from realizer.animation.curves import sample
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.listen import expand

NOD, BROWS, SMILE = (au(number)[0] for number in (54, 1, 12))
TIMES = np.arange(0.0, 600.0, 0.04)


def responses(intensity=1.0, id="x", seed=0, start=0.0, end=600.0):
    context = PlanningContext(seed=seed)
    return expand(Listen(id=id, intensity=intensity), np.array([start, end]), context)


def begins(channels, target):
    return np.array([channel.times[0] for channel in channels if channel.target == target])


def test_listen_nods_raises_brows_and_smiles_every_few_seconds() -> None:
    channels = responses()
    counts = [len(begins(channels, target)) for target in (NOD, BROWS, SMILE)]
    assert counts[0] > counts[1] > 10
    assert counts[2] > 10
    starts = np.sort(np.concatenate([begins(channels, target) for target in (NOD, BROWS, SMILE)]))
    assert 2.0 < np.diff(starts).mean() < 4.0
    assert np.diff(starts).min() > 1.39


def test_listen_keeps_within_its_time() -> None:
    for end in (0.1, 1.0, 3.0, 10.0):
        for channel in responses(start=2.0, end=2.0 + end):
            assert 2.0 < channel.times[0] < channel.times[-1] <= 2.0 + end


def test_listen_nods_by_some_degrees_and_keeps_its_eyes_on_the_other() -> None:
    channels = responses()
    down = sample([c for c in channels if c.target == NOD], TIMES).max(axis=0) * 40
    up = sample([c for c in channels if c.target == au(63)[0]], TIMES).max(axis=0) * 30
    assert 5.0 < down.max() <= 9.0
    assert up == pytest.approx(down, abs=1e-9)


@pytest.mark.parametrize("intensity", [0.2, 0.5])
def test_listen_responds_less_at_less_intensity(intensity) -> None:
    much, less = (responses(value) for value in (1.0, intensity))
    assert len(less) < (intensity + 0.2) * len(much)
    most = [max(channel.values.max() for channel in found) for found in (much, less)]
    assert most[1] < 1.1 * intensity * most[0]


def test_listen_does_nothing_at_intensity_zero() -> None:
    assert responses(0.0) == ()


def test_listen_depends_on_seed_and_id_alone() -> None:
    first, again, *others = (
        begins(responses(id=id, seed=seed), NOD).tolist()
        for id, seed in (("x", 0), ("x", 0), ("y", 0), ("x", 1))
    )
    assert first == again
    assert first not in others


def test_listen_begins_in_the_same_way_however_long_it_lasts() -> None:
    short, long = (begins(responses(end=end), NOD) for end in (60.0, 600.0))
    assert (short == long[: len(short)]).all()
