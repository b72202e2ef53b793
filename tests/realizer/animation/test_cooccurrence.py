"""Co-occurrence rules."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from realizer.animation.axis import AU_NAMES
from realizer.animation.cooccurrence import bounds
from realizer.core.array_types import Float32
from realizer.tables.cooccurrence import Rule, rules
from tests.rows import each_row

NAMES = AU_NAMES()
INTENSITIES = arrays(
    np.float32, (len(NAMES), 4), elements=st.sampled_from([0.0, 0.125, 0.25, 0.5, 0.625, 0.75, 1.0])
)


def apply_rules(aus: Float32) -> tuple[Float32, Float32]:
    """Return the intensities that are scored, and those that move the face without being scored."""
    known = bounds(rules())
    moving = known.moving(aus)
    scored = known.scored(aus, moving)
    return scored, moving - scored


def shown(**asked: float) -> dict[str, float]:
    """Return the intensities that the rules leave of requested action units, such as "12L"."""
    values = np.zeros((len(NAMES), 1), np.float32)
    for name, value in asked.items():
        values[NAMES.index(name[2:])] = value
    left = apply_rules(values)[0][:, 0]
    return {name: round(float(left[NAMES.index(name[2:])]), 4) for name in asked}


def names(number: int) -> list[str]:
    return [name for name in NAMES if name.rstrip("LR") == str(number)]


@each_row("rule", rules().rules)
def test_rules_silence_weaker_units_at_full_strength(rule: Rule) -> None:
    asked = {
        f"AU{name}": 1.0 for unit in (rule.weaker, *(s.au for s in rule.stronger)) for name in names(unit)
    }
    left = shown(**asked)
    assert all(left[f"AU{name}"] == 0.0 for name in names(rule.weaker))


@each_row("rule", rules().rules)
def test_rules_keep_every_unit_that_is_alone(rule: Rule) -> None:
    assert set(shown(**{f"AU{name}": 0.75 for name in names(rule.weaker)}).values()) == {0.75}


def test_domination_weakens_a_unit() -> None:
    assert shown(AU5L=0.9, AU63=0.3) == {"AU5L": 0.7, "AU63": 0.3}


def test_domination_by_a_combination_needs_both_units() -> None:
    assert shown(AU16L=1.0, AU12L=0.8, AU22=0.3)["AU16L"] == 0.7


def test_domination_by_a_strong_unit_starts_in_the_middle() -> None:
    assert shown(AU12L=1.0, AU15L=0.5)["AU12L"] == 1.0
    assert shown(AU12L=1.0, AU15L=0.75)["AU12L"] == 0.5


def test_exclusion_allows_a_unit_while_the_other_is_small() -> None:
    assert shown(AU12L=0.25, AU20L=1.0)["AU20L"] == 0.5
    assert shown(AU12L=0.5, AU20L=1.0)["AU20L"] == 0.0


def test_opposition_leaves_the_difference() -> None:
    assert shown(AU51=0.75, AU52=0.25) == {"AU51": 0.5, "AU52": 0.0}


def test_rules_apply_to_each_side_by_itself() -> None:
    assert shown(AU12L=1.0, AU12R=1.0, AU15R=1.0) == {"AU12L": 1.0, "AU12R": 0.0, "AU15R": 1.0}


def test_rules_reduce_midline_units_by_the_stronger_side() -> None:
    assert shown(AU18=1.0, AU20L=0.25, AU20R=0.5, AU23=1.0)["AU18"] == 0.5


def test_inclusion_keeps_the_movement_that_is_not_scored() -> None:
    values = np.zeros((len(NAMES), 1), np.float32)
    values[[NAMES.index("25"), NAMES.index("26")]] = 1.0
    scored, unscored = apply_rules(values)
    assert [scored[NAMES.index(name), 0] for name in ("25", "26")] == [0.0, 1.0]
    assert unscored[NAMES.index("25"), 0] == 1.0


@given(INTENSITIES)
def test_rules_change_nothing_in_a_second_pass(aus: Float32) -> None:
    once, _ = apply_rules(aus)
    assert np.array_equal(apply_rules(once)[0], once)


@given(INTENSITIES)
def test_rules_never_increase_a_unit(aus: Float32) -> None:
    scored, unscored = apply_rules(aus)
    assert (unscored >= 0).all()
    assert (scored >= 0).all()
    assert (scored + unscored <= aus + 1e-6).all()


@given(INTENSITIES, arrays(np.float32, (len(NAMES), 4), elements=st.sampled_from([-1.0, 0.0, 1.0])))
def test_rules_are_continuous(aus: Float32, step: Float32) -> None:
    moved = np.clip(aus + step / 1024, 0, 1, dtype=np.float32)
    assert np.abs(apply_rules(moved)[0] - apply_rules(aus)[0]).max() <= 2 / 1024 + 1e-6


@given(INTENSITIES)
def test_rules_are_symmetrical(aus: Float32) -> None:
    twin = [NAMES.index(name.translate(str.maketrans("LR", "RL"))) for name in NAMES]
    assert np.array_equal(apply_rules(aus[twin])[0], apply_rules(aus)[0][twin])
