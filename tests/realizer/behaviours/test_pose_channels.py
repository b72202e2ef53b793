"""Tests of channels that rise to a pose."""

from __future__ import annotations

import numpy as np

from realizer.animation.axis import au
from realizer.animation.channel import Layer
from realizer.behaviours.pose_channels import columns, hold, keep_base, unknown_word

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


def test_unknown_word_cuts_a_long_one() -> None:
    assert unknown_word("name", "x" * 99, ["nod"]).text.endswith(f"got '{'x' * 60}...'")
