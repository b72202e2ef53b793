"""Tests of channels that rise to a pose."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import au, fap
from realizer.animation.channel import Layer
from realizer.animation.curves import sample
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.pose_channels import (
    EASE,
    columns,
    express,
    expression_facts,
    hold,
    keep_base,
    order,
    track,
    unknown_word,
)
from realizer.tables import by_number

LEFT, RIGHT = au(12)


def test_columns_take_the_stronger_of_two_values_and_at_most_1() -> None:
    found = columns({(12, "BOTH"): 0.4, (12, "LEFT"): 0.6, (26, "BOTH"): 3.0}, 0.5)
    assert found == {LEFT: 0.3, RIGHT: 0.2, au(26)[0]: 1.0}


def test_hold_leaves_out_values_of_0() -> None:
    times = np.array([0.0, 1.0, 2.0, 3.0])
    (channel,) = hold({LEFT: 0.5, RIGHT: 0.0}, times, "x")
    assert channel.target == LEFT
    assert channel.values.tolist() == [0, 0.5, 0.5, 0]
    assert not channel.keeps_last


def test_keep_base_stays_also_at_0() -> None:
    channels = keep_base({LEFT: 0.5, RIGHT: 0.0}, np.array([0.0, 1.0]), "x")
    assert [c.values.tolist() for c in channels] == [[0, 0.5], [0, 0]]
    assert all(c.keeps_last and c.layer is Layer.BASE and c.source == "x" for c in channels)


def test_unknown_word_suggests_names_of_the_same_family() -> None:
    known = ["template:grief", "template:disbelief", "grieve"]
    fault = unknown_word("name", "template:greif", known)
    assert fault.fatal
    assert "wanted one of template:grief, template:disbelief, grieve" in fault.text
    assert fault.text.endswith("got 'template:greif', did you mean template:grief?")


def test_unknown_word_suggests_names_that_begin_alike() -> None:
    assert unknown_word("lexeme", "HAPPY", ["ANGER", "HAPPINESS"]).text.endswith("did you mean HAPPINESS?")
    assert "did you mean" not in unknown_word("lexeme", "NO", ["NOD_OFTEN_AND_LONG"]).text


def test_unknown_word_cuts_a_long_one() -> None:
    assert unknown_word("name", "x" * 99, ["nod"]).text.endswith(f"got '{'x' * 60}...'")


values = st.lists(st.floats(-1, 1), min_size=2, max_size=6)


def test_track_at_rest_at_both_ends_keeps_its_keys() -> None:
    channel = track(au(12, "LEFT")[0], np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.04]), "k")
    assert channel.times.tolist() == [1, 2, 3]
    assert channel.values.tolist() == [0, 1, 0.04]
    assert (channel.curve, channel.source) == ("linear", "k")


def test_track_not_at_rest_is_eased_at_both_ends() -> None:
    channel = track(au(12, "LEFT")[0], np.array([1.0, 3.0]), np.array([1.0, 0.5]), "k")
    assert channel.times == pytest.approx([1, 1 + EASE, 3 - EASE, 3])
    assert channel.values == pytest.approx([0, 1 - 0.25 * EASE, 0.5 + 0.25 * EASE, 0])


def test_track_of_a_fap_overrides_what_lies_below_with_eased_weight() -> None:
    channel = track(fap(31), np.array([0.0, 1.0, 2.0]), np.array([0.0, 100.0, 0.0]), "k")
    assert channel.layer is Layer.FAPS
    assert np.interp([0, EASE, 1, 2 - EASE, 2], channel.times, channel.weight) == pytest.approx(
        [0, 1, 1, 1, 0]
    )
    assert np.interp([0.5, 1, 1.5], channel.times, channel.values) == pytest.approx([50, 100, 50])


@given(values, st.sampled_from([0.1, 1.0, 10.0]))
def test_track_starts_and_ends_at_rest(heights: list[float], length: float) -> None:
    channel = track(au(4)[0], np.linspace(0, length, len(heights)), np.array(heights), "k")
    rest = 0.05 * max(map(abs, heights))
    assert abs(channel.values[0]) <= rest
    assert abs(channel.values[-1]) <= rest
    assert (np.diff(channel.times) >= 0).all()
    assert (channel.times[0], channel.times[-1]) == (0, length)


JOY = {6: 0.9, 12: 0.8, 25: 0.6}
LIVELY = PlanningContext(liveliness=1.0, seed=3)


def pose(aus=JOY):
    return {target: value for number, value in aus.items() for target in au(number)}


def smile(context=LIVELY, times=(0.0, 0.5, 2.5, 3.5), source="s", aus=JOY):
    return express(hold(pose(aus), np.array(times), source), context)


def values(channels, *times):
    return {c.target.name: row for c, row in zip(channels, sample(channels, np.array(times)), strict=True)}


def test_express_changes_nothing_without_liveliness() -> None:
    channels = hold(pose(), np.array([0.0, 0.5, 2.5, 3.5]), "s")
    assert express(channels, PlanningContext()) == channels
    assert express((), LIVELY) == ()


@given(
    st.lists(st.floats(0.0, 3.0), min_size=3, max_size=3),
    st.integers(0, 1000),
    st.text("abc", min_size=1),
    st.floats(0.01, 1.0),
)
def test_express_keeps_order_bounds_and_the_peak(gaps, seed, source, liveliness) -> None:
    times = np.concatenate([[0.0], np.cumsum(gaps)])
    channels = smile(PlanningContext(liveliness=liveliness, seed=seed), times, source)
    for channel in channels:
        assert (np.diff(channel.times) >= 0).all()
        assert channel.times[0] >= times[0] - 1e-12
        assert channel.times[-1] <= times[-1] + 1e-12
        assert channel.values.max() <= JOY[int(channel.target.name.rstrip("LR"))]
    assert max(channel.times[1] for channel in channels) == pytest.approx(times[1])
    assert min(channel.times[0] for channel in channels) == pytest.approx(times[0])
    assert min(channel.times[-2] for channel in channels) == pytest.approx(times[2])


def test_express_begins_with_the_cheeks_after_the_corners_of_the_mouth() -> None:
    begins = {channel.target.name: channel.times[0] for channel in smile()}
    assert begins["12L"] < begins["6L"] < begins["25"]
    apart = begins["25"] - begins["12L"]
    assert 0.04 <= apart <= 0.12


def test_express_makes_one_side_weaker_and_later() -> None:
    facts = expression_facts()["asymmetry"]
    sides = set()
    for number in range(40):
        at = values(smile(source=f"smile {number}"), 0.5)
        left, right = at["12L"][0], at["12R"][0]
        less = 1 - min(left, right) / max(left, right)
        assert facts["least"] <= less <= facts["most"]
        sides.add(left > right)
    assert sides == {True, False}


def test_express_prefers_the_side_of_the_face() -> None:
    stronger = [values(smile(source=f"smile {n}"), 0.5) for n in range(200)]
    left = np.mean([at["12L"][0] > at["12R"][0] for at in stronger])
    habit = expression_facts()["asymmetry"]["habit"]
    assert min(abs(left - habit), abs(1 - left - habit)) < 0.1


def test_express_never_holds_still() -> None:
    times = np.arange(0.5, 20.0, 0.04)
    for row in values(smile(times=(0.0, 0.5, 20.0, 21.0)), *times).values():
        is_flat = [np.ptp(row[k : k + 13]) < 1e-4 for k in range(len(row) - 13)]
        assert not any(is_flat)
        assert 0.02 <= 1 - row.min() / row.max() <= 0.06


def test_express_closes_the_eyes_on_both_sides() -> None:
    at = values(smile(times=(0.0, 0.2, 3.0, 3.2), aus={43: 1.0, 12: 0.5}), 0.2, 1.0, 2.0, 3.0)
    assert (at["43L"] == 1.0).all()
    assert (at["43R"] == 1.0).all()


def test_express_is_the_same_for_the_same_seed_and_id() -> None:
    once, again = ([channel.values.tolist() for channel in smile()] for _ in range(2))
    assert once == again
    other = smile(replace(LIVELY, seed=4))
    assert once != [channel.values.tolist() for channel in other]


def test_order_of_onsets_has_known_aus_from_0_to_1() -> None:
    places = order()
    assert set(places) <= set(by_number())
    assert (min(places.values()), max(places.values())) == (0.0, 1.0)
    assert places[5] < places[1] < places[12] < places[26]


def test_expression_facts_name_even_aus() -> None:
    assert {43, 45} <= set(expression_facts()["asymmetry"]["even"]) <= set(by_number())
