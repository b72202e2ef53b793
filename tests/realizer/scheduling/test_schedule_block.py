"""Tests of the scheduling of documents, with the figures 3.5 to 3.7 of Paul 2010."""

from collections.abc import Sequence

import numpy as np
import pytest

from bml_schema import parse
from realizer.scheduling import Schedule, Timing
from tests.realizer.scheduling.recipes import schedule_block

FACE = ("start", "attackPeak", "relax", "end")
NOD = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")


def timing(
    preferred: Sequence[float],
    *,
    points: Sequence[str] | None = None,
    least: float = 0.02,
    stiffness: float = 1.0,
    rigid: bool = False,
    most: Sequence[float] | None = None,
) -> Timing:
    k = len(preferred)
    bounds = None if most is None else np.array(most)
    names = tuple(points) if points is not None else {1: ("start", "end"), 3: FACE, 6: NOD}[k]
    return Timing(names, np.array(preferred), np.full(k, least), np.full(k, stiffness), rigid, bounds)


def speech(*marks: float) -> Timing:
    """A rigid speech with marks m1, m2, ... at these seconds; the last one is its end."""
    names = ("start", *(f"m{i}" for i in range(1, len(marks))), "end")
    return timing(np.diff([0.0, *marks]).tolist(), points=names, rigid=True)


def face(name: str, **syncs: str) -> str:
    return f'<faceLexeme id="{name}" lexeme="SMILE" {attributes(syncs)}/>\n'


def head(name: str, **syncs: str) -> str:
    return f'<head id="{name}" lexeme="NOD" {attributes(syncs)}/>\n'


def wait(name: str, **syncs: str) -> str:
    return f'<wait id="{name}" {attributes(syncs)}/>\n'


def saying(name: str, marks: int = 0, **syncs: str) -> str:
    text = "".join(f'word <sync id="m{i}"/> ' for i in range(1, marks + 1))
    return f'<speech id="{name}" {attributes(syncs)}><text>{text}end</text></speech>\n'


def constraint(inner: str, name: str = "") -> str:
    return f"<constraint{f' id={name!r}' if name else ''}>{inner}</constraint>\n"


def together(*refs: str) -> str:
    return f"<synchronize>{''.join(f'<sync ref={r!r}/>' for r in refs)}</synchronize>"


def after(ref: str, *later: str) -> str:
    return f"<after ref={ref!r}>{''.join(f'<sync ref={r!r}/>' for r in later)}</after>"


def before(ref: str, *sooner: str) -> str:
    return f"<before ref={ref!r}>{''.join(f'<sync ref={r!r}/>' for r in sooner)}</before>"


def required(inner: str) -> str:
    return f"<required>{inner}</required>\n"


def attributes(syncs: dict[str, str]) -> str:
    return " ".join(f'{point}="{ref}"' for point, ref in syncs.items())


def schedule(body: str, timings: dict[str, Timing], **more: object) -> Schedule:
    """The schedule of a block; its first behaviour is on line 2."""
    text = f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b1">\n{body}</bml>'
    return schedule_block(parse(text, strict=True), timings, **more)  # type: ignore[arg-type]


def dropped(found: Schedule) -> list[str]:
    assert all(w.type == "IMPOSSIBLE_TO_SCHEDULE" for w in found.warnings)
    return [w.id for w in found.warnings]


# Examples of Paul 2010.


def test_schedule_shifts_one_behaviour() -> None:
    """Paul's figure 3.5: one shared point, nothing is scaled."""
    found = schedule(wait("a") + wait("b", start="a:end"), {"a": timing([3.0]), "b": timing([2.0])})
    assert found["a"] == {"start": 0.0, "end": 3.0}
    assert found["b"] == pytest.approx({"start": 3.0, "end": 5.0})
    assert found.cost == pytest.approx(0, abs=1e-12)


def test_schedule_of_3_and_2_seconds_tied_at_both_ends_is_2_5_seconds() -> None:
    """Paul's figure 3.6, simple scale."""
    found = schedule(
        wait("a") + wait("b", start="a:start", end="a:end"), {"a": timing([3.0]), "b": timing([2.0])}
    )
    assert found["a"] == pytest.approx({"start": 0.0, "end": 2.5})
    assert found["b"] == pytest.approx({"start": 0.0, "end": 2.5})
    assert found.cost == pytest.approx(0.5)


def test_schedule_stretches_the_less_stiff_behaviour_more() -> None:
    """Minimum of 3 (t - 3)^2 + (t - 2)^2 (Paul 2010, 3.3.3)."""
    found = schedule(
        wait("a") + wait("b", start="a:start", end="a:end"),
        {"a": timing([3.0], stiffness=3.0), "b": timing([2.0])},
    )
    assert found.duration == pytest.approx(2.75)


@pytest.mark.parametrize("length", [1.0, 2.0, 5.0])
def test_schedule_moves_three_interlocked_behaviours_together(length: float) -> None:
    """Paul's figure 3.7: 1 and 2 follow each other, 3 spans both, and 2 shares its end with 4."""
    found = schedule(
        wait("one") + wait("two", start="one:end") + wait("three", start="one:start", end="two:end"),
        {"one": timing([1.0]), "two": timing([1.0]), "three": timing([length])},
    )
    # One and two stretch equally, half as much each as both together: t minimises (t - L)^2 + (t - 2)^2 / 2.
    total = (2 * length + 2.0) / 3
    assert found.duration == pytest.approx(total)
    assert found.at("one", "end") == pytest.approx(total / 2)


def test_schedule_of_a_virtual_conductor_nods_on_every_beat() -> None:
    """Paul 3.3.2: the tempo has authority, nods are tied to it by their strokes."""
    beats = [0.5 * (k + 1) for k in range(8)]
    body = saying("tempo", marks=8) + "".join(head(f"n{k}", stroke=f"tempo:m{k + 1}") for k in range(8))
    nod = timing([0.1, 0.05, 0.1, 0.1, 0.05, 0.1])
    found = schedule(body, {"tempo": speech(*beats, 4.5), **{f"n{k}": nod for k in range(8)}})
    strokes = [found.at(f"n{k}", "stroke") for k in range(8)]
    np.testing.assert_allclose(np.diff(strokes), 0.5)
    assert found.cost == pytest.approx(0, abs=1e-12)


def test_schedule_of_a_conductor_of_waits_drives_head_and_face() -> None:
    """Paul 3.3.2 without a speech: the beats are tied to each other, and longer behaviours are shortened."""
    beats = "".join(
        wait(f"beat{k}", end=f"beat{k}:start + 0.5", **({"start": f"beat{k - 1}:end"} if k else {}))
        for k in range(6)
    )
    nods = "".join(head(f"n{k}", stroke=f"beat{k}:start") for k in range(6))
    smiles = "".join(face(f"f{k}", start=f"beat{k}:start", end=f"beat{k}:end") for k in range(6))
    nod = timing([0.1, 0.05, 0.1, 0.1, 0.05, 0.1])
    found = schedule(
        smiles + nods + beats,
        {
            **{f"beat{k}": timing([9.0]) for k in range(6)},
            **{f"n{k}": nod for k in range(6)},
            **{f"f{k}": timing([0.2, 0.5, 0.2]) for k in range(6)},
        },
    )
    assert not found.warnings
    # The first stroke is as early as its nod allows, and determines the tempo.
    for k in range(6):
        start = 0.25 + 0.5 * k
        assert found.at(f"n{k}", "stroke") == pytest.approx(start)
        np.testing.assert_allclose(np.diff(found.times[f"n{k}"]), nod.preferred)
        np.testing.assert_allclose(
            found.times[f"f{k}"], start + np.array([0, 0.2 / 3, 0.5 - 0.2 / 3, 0.5]), atol=1e-9
        )


# Chains and speech.


@pytest.mark.parametrize("backwards", [False, True])
def test_schedule_of_a_chain_of_offsets_in_either_document_order(backwards: bool) -> None:
    nodes = [face("f0")] + [face(f"f{k}", start=f"f{k - 1}:end + 0.5") for k in range(1, 50)]
    body = "".join(nodes[::-1] if backwards else nodes)
    found = schedule(body, {f"f{k}": timing([0.1, 0.3, 0.2]) for k in range(50)})
    for k in range(50):
        np.testing.assert_allclose(found.times[f"f{k}"], np.array([0, 0.1, 0.4, 0.6]) + 1.1 * k, atol=1e-9)


def test_schedule_ties_several_behaviours_to_speech_marks() -> None:
    body = saying("s", marks=2) + head("n", stroke="s:m1") + face("f", start="s:m1", end="s:m2 + 0.1")
    found = schedule(body, {"s": speech(1.0, 2.0, 2.5), "n": timing([0.1] * 6), "f": timing([0.2, 0.6, 0.3])})
    assert found["s"] == pytest.approx({"start": 0, "m1": 1.0, "m2": 2.0, "end": 2.5})
    assert found.at("n", "stroke") == pytest.approx(1.0)
    assert found.at("n", "start") == pytest.approx(0.7)
    assert [found.at("f", p) for p in ("start", "end")] == pytest.approx([1.0, 2.1])


def test_schedule_ties_a_mark_from_inside_the_text() -> None:
    body = wait("w") + '<speech id="s"><text>One <sync id="m1" ref="w:end"/> two</text></speech>'
    found = schedule(body, {"w": timing([3.0]), "s": speech(1.0, 2.0)})
    assert found["s"] == pytest.approx({"start": 2.0, "m1": 3.0, "end": 4.0})


def test_schedule_delays_speech_for_an_early_stroke() -> None:
    body = saying("s", marks=1) + head("n", stroke="s:m1")
    found = schedule(body, {"s": speech(0.1, 2.0), "n": timing([0.1, 0.1, 0.2, 0.2, 0.1, 0.1])})
    assert found.at("n", "start") == 0
    assert found.at("n", "stroke") == pytest.approx(0.4)
    assert found.at("s", "start") == pytest.approx(0.3)
    assert found.cost == pytest.approx(0, abs=1e-12)


def test_schedule_shortens_a_nod_for_a_pinned_speech() -> None:
    body = saying("s", marks=1, start="0") + head("n", stroke="s:m1")
    found = schedule(body, {"s": speech(0.1, 2.0), "n": timing([0.1, 0.1, 0.2, 0.2, 0.1, 0.1])})
    assert found["s"] == pytest.approx({"start": 0, "m1": 0.1, "end": 2.0})
    # 0.3 s too much over three equal springs, of which two stop at their least gap of 0.02.
    np.testing.assert_allclose(np.diff(found.times["n"]), [0.02, 0.02, 0.06, 0.2, 0.1, 0.1], atol=1e-9)


def test_schedule_fixes_two_points_of_a_nod_to_two_marks() -> None:
    body = saying("s", marks=2) + head("n", strokeStart="s:m1", strokeEnd="s:m2")
    found = schedule(body, {"s": speech(1.0, 1.6, 2.0), "n": timing([0.2, 0.1, 0.1, 0.3, 0.1, 0.2])})
    # 0.6 s for what prefers 0.1 and 0.3: both 0.1 longer.
    np.testing.assert_allclose(found.times["n"], [0.7, 0.9, 1.0, 1.2, 1.6, 1.7, 1.9], atol=1e-9)


def test_schedule_gives_up_the_end_of_one_of_two_rigid_speeches_tied_at_both_ends() -> None:
    found = schedule(
        saying("s") + saying("r", start="s:start", end="s:end"), {"s": speech(1.0), "r": speech(2.0)}
    )
    assert dropped(found) == ["b1:r"]
    assert "s takes exactly 1 s" in found.warnings[0].text
    assert "r takes exactly 2 s" in found.warnings[0].text
    assert found.released == ("r:end",)
    assert "r:end is 1 s later" in found.warnings[0].text
    assert found["r"] == {"start": 0.0, "end": 2.0}


def test_schedule_has_absolute_times_and_the_start_of_the_block() -> None:
    body = face("a", start="1.5") + face("b", start="bml:start + 2", end="4") + face("c", end="a:start")
    found = schedule(body, {k: timing([0.2, 0.4, 0.4]) for k in "abc"})
    assert found.at("a", "start") == 1.5
    np.testing.assert_allclose(found.times["b"], [2, 2 + 1.6 / 3, 2 + 1.6 / 3 + 2.2 / 3, 4])
    np.testing.assert_allclose(found.times["c"], [0.5, 0.7, 1.1, 1.5])


def test_schedule_delays_a_behaviour_for_a_negative_offset() -> None:
    found = schedule(wait("a") + wait("b", start="a:start - 2"), {"a": timing([1.0]), "b": timing([1.0])})
    assert found.at("b", "start") == 0
    assert found.at("a", "start") == pytest.approx(2)


def test_schedule_starts_nothing_before_the_earliest_time() -> None:
    body = face("a") + face("b", start="a:start - 0.5")
    found = schedule(body, {k: timing([0.2, 0.4, 0.4]) for k in "ab"}, earliest=3.0)
    assert found.at("b", "start") == 3.0
    assert found.at("a", "start") == pytest.approx(3.5)


def test_schedule_allows_a_behaviour_to_refer_to_itself() -> None:
    found = schedule(face("a", end="a:start + 3"), {"a": timing([0.2, 0.4, 0.4])})
    np.testing.assert_allclose(found.times["a"], [0, 0.2 + 2 / 3, 0.6 + 4 / 3, 3.0])


def test_schedule_of_zero_length_behaviours() -> None:
    body = wait("a") + wait("b", start="a:end", end="a:end") + wait("c", start="b:end")
    found = schedule(body, {"a": timing([0.0], least=0), "b": timing([1.0], least=0), "c": timing([1.0])})
    assert found["b"] == {"start": 0.0, "end": 0.0}
    assert found["c"] == {"start": 0.0, "end": 1.0}


def test_schedule_of_zero_length_behaviours_passes_orders_on() -> None:
    body = wait("a") + wait("b") + wait("c")
    body += constraint(after("a:end", "b:start") + after("b:end", "c:start"))
    found = schedule(body, {"a": timing([1.0]), "b": timing([0.0], least=0), "c": timing([1.0])})
    assert found["b"] == pytest.approx({"start": 1.0, "end": 1.0})
    assert found["c"] == pytest.approx({"start": 1.0, "end": 2.0})


def test_schedule_shortens_a_behaviour_with_an_early_end() -> None:
    found = schedule(wait("a", end="0.5") + wait("b", start="a:start"), {k: timing([1.0]) for k in "ab"})
    assert found["a"] == {"start": 0.0, "end": 0.5}
    assert found["b"] == {"start": 0.0, "end": 1.0}


def test_schedule_drops_a_rigid_behaviour_with_an_early_end() -> None:
    found = schedule(
        saying("s", end="0.5") + wait("b", start="s:start"), {"s": speech(1.0), "b": timing([1.0])}
    )
    assert dropped(found) == ["b1:s"]
    assert "s:end = 0.5 (line 2)" in found.warnings[0].text
    assert "s:start is not before 0 s" in found.warnings[0].text
    assert found["b"] == {"start": 0.0, "end": 1.0}


def test_schedule_prefers_a_stated_length_to_least_gaps() -> None:
    found = schedule(face("a", start="1", end="1.03"), {"a": timing([0.2, 0.4, 0.4], least=0.1)})
    assert not found.warnings
    assert found.at("a", "end") == pytest.approx(1.03)
    assert (np.diff(found.times["a"]) >= 0).all()


def test_schedule_of_two_hundred_behaviours_on_one_point() -> None:
    body = saying("s", marks=1) + "".join(face(f"f{k}", attackPeak="s:m1") for k in range(200))
    timings = {f"f{k}": timing([0.001 * (k + 1), 0.5, 0.5], least=0) for k in range(200)}
    found = schedule(body, {"s": speech(0.05, 1.0), **timings})
    assert {found.at(f"f{k}", "attackPeak") for k in range(200)} == {found.at("s", "m1")}
    assert found.at("f199", "start") == 0
    assert found.at("s", "start") == pytest.approx(0.15)
    assert found.cost == pytest.approx(0, abs=1e-12)


def test_schedule_of_an_empty_block() -> None:
    found = schedule("", {})
    assert found.duration == 0
    assert not found.failed
    assert not found.times


# Before and after.


def test_schedule_ignores_an_inactive_after() -> None:
    body = wait("a") + wait("b", start="5")
    found = schedule(body + constraint(after("a:end", "b:start")), {k: timing([1.0]) for k in "ab"})
    assert found["a"] == {"start": 0.0, "end": 1.0}
    assert found["b"] == {"start": 5.0, "end": 6.0}


def test_schedule_ignores_an_inactive_before() -> None:
    body = wait("a") + wait("b", start="5") + constraint(before("b:end - 1", "a:end"))
    found = schedule(body, {k: timing([1.0]) for k in "ab"})
    assert found["a"] == {"start": 0.0, "end": 1.0}
    assert found["b"] == {"start": 5.0, "end": 6.0}


def test_schedule_delays_the_later_behaviour_for_an_active_before() -> None:
    found = schedule(
        wait("a") + wait("b") + constraint(before("b:start", "a:end")), {k: timing([1.0]) for k in "ab"}
    )
    assert found["a"] == {"start": 0.0, "end": 1.0}
    assert found["b"] == pytest.approx({"start": 1.0, "end": 2.0})


def test_schedule_slides_for_an_active_after_without_cost() -> None:
    body = wait("a") + wait("b") + constraint(after("a:end + 1", "b:start + 0.25"))
    found = schedule(body, {k: timing([1.0]) for k in "ab"})
    assert found["b"] == pytest.approx({"start": 1.75, "end": 2.75})
    assert found.cost == pytest.approx(0, abs=1e-12)


def test_schedule_shortens_for_a_before_of_a_pinned_point() -> None:
    body = wait("a") + wait("b", start="2") + constraint(before("b:start", "a:end"))
    found = schedule(body, {"a": timing([3.0]), "b": timing([1.0])})
    assert found["a"] == pytest.approx({"start": 0.0, "end": 2.0})
    assert found["b"] == {"start": 2.0, "end": 3.0}
    assert found.cost == pytest.approx(1.0)


def test_schedule_of_orders_with_numbers() -> None:
    body = wait("a") + wait("b") + constraint(after("2", "a:start") + before("1.5", "b:end"))
    found = schedule(body, {"a": timing([1.0]), "b": timing([3.0])})
    assert found.at("a", "start") == 2
    assert found.at("b", "end") == pytest.approx(1.5)


def test_schedule_shares_the_strain_of_a_circle_of_orders() -> None:
    """One behaviour inside another at both ends: the cheapest lengths, as early as possible."""
    body = (
        wait("one") + wait("two") + constraint(after("one:start", "two:start") + before("one:end", "two:end"))
    )
    found = schedule(body, {"one": timing([2.0]), "two": timing([3.0])})
    assert found["one"] == pytest.approx({"start": 0.0, "end": 2.5})
    assert found["two"] == pytest.approx({"start": 0.0, "end": 2.5})


def test_schedule_of_a_long_chain_of_orders() -> None:
    n = 100
    body = "".join(wait(f"w{k}") for k in range(n))
    body += "".join(constraint(after(f"w{k}:end", f"w{k - 1}:start")) for k in range(1, n))
    found = schedule(body, {f"w{k}": timing([0.1]) for k in range(n)})
    assert found.at("w0", "end") == pytest.approx(0.1 * n)
    assert found.cost == pytest.approx(0)


# Bounded gaps.


def bounded(least: float, preferred: float, most: float) -> Timing:
    return timing([preferred], least=least, most=[most])


def test_schedule_stretches_a_bounded_gap_to_its_bound() -> None:
    body = wait("a") + wait("b", start="a:start", end="a:end")
    found = schedule(body, {"a": bounded(0.5, 1.0, 1.2), "b": timing([2.0])})
    assert found["a"] == found["b"] == pytest.approx({"start": 0.0, "end": 1.2}, abs=1e-9)
    assert found.cost == pytest.approx(0.2**2 + 0.8**2)
    found = schedule(body, {"a": bounded(0.5, 1.0, 9.0), "b": timing([2.0])})
    assert found.duration == pytest.approx(1.5)


def test_schedule_shares_a_stretch_among_bounded_gaps() -> None:
    points = ("start", "m1", "m2", "end")
    voice = Timing(points, np.ones(3), np.full(3, 0.8), np.ones(3), most=np.array([1.1, 3.0, np.inf]))
    found = schedule(wait("a", start="0", end="4"), {"a": voice})
    np.testing.assert_allclose(found.times["a"], [0, 1.1, 2.55, 4.0], atol=1e-9)


def test_schedule_cuts_a_preferred_length_to_its_bound() -> None:
    found = schedule(wait("a") + wait("b", start="a:end"), {"a": bounded(0, 2.0, 1.5), "b": timing([1.0])})
    assert found["a"] == pytest.approx({"start": 0.0, "end": 1.5}, abs=1e-9)
    assert found["b"] == pytest.approx({"start": 1.5, "end": 2.5}, abs=1e-9)


def test_schedule_keeps_bounds_without_room_exactly() -> None:
    found = schedule(
        wait("a") + wait("b", start="a:start", end="a:end"), {"a": bounded(1.0, 1.0, 1.0), "b": timing([2.0])}
    )
    assert found["b"] == pytest.approx({"start": 0.0, "end": 1.0}, abs=1e-9)


def test_schedule_of_orders_with_bounds_moves_what_is_not_bounded() -> None:
    body = wait("a", start="0") + wait("b") + constraint(after("a:end", "b:start") + before("2.5", "b:end"))
    found = schedule(body, {"a": bounded(1.0, 2.0, 3.0), "b": timing([1.0], least=0.9)})
    assert found["a"] == pytest.approx({"start": 0.0, "end": 1.6}, abs=1e-9)
    assert found["b"] == pytest.approx({"start": 1.6, "end": 2.5}, abs=1e-9)


@pytest.mark.parametrize(("end", "words"), [("9", "at most 3 s"), ("0.2", "at least 1 s")])
def test_schedule_keeps_bounds_against_a_stated_length(end: str, words: str) -> None:
    found = schedule(wait("a", start="0", end=end) + wait("b"), {"a": bounded(1, 2, 3), "b": timing([1.0])})
    assert dropped(found) == ["b1:a"]
    assert f"a takes {words} from start to end" in found.warnings[0].text
    assert f"a:end = {end} (line 2)" in found.warnings[0].text


def test_schedule_adds_up_successive_lengths_in_a_warning() -> None:
    expression = Timing(FACE, np.ones(3), np.full(3, 0.8), np.ones(3), most=np.array([1.1, 1.2, 1.3]))
    found = schedule(face("a", start="0", relax="5"), {"a": expression})
    assert dropped(found) == ["b1:a"]
    assert "a takes at most 2.3 s from start to relax" in found.warnings[0].text


# Conflicts.


def test_schedule_keeps_a_cycle_that_closes() -> None:
    body = wait("a", start="b:end - 1") + wait("b", start="a:end - 1")
    found = schedule(body, {"a": timing([1.0]), "b": timing([1.0])})
    assert not found.warnings
    assert found["a"] == found["b"] == pytest.approx({"start": 0.0, "end": 1.0})


def test_schedule_drops_the_later_behaviour_of_an_impossible_cycle() -> None:
    body = head("nod1", start="nod2:end") + head("nod2", start="nod1:end")
    found = schedule(body, {k: timing([0.1] * 6) for k in ("nod1", "nod2")})
    assert dropped(found) == ["b1:nod2"]
    text = found.warnings[0].text
    assert "nod1:start = nod2:end (line 2)" in text
    assert "nod2:start = nod1:end (line 3)" in text
    assert "nod2 was dropped because it comes later" in text
    np.testing.assert_allclose(found.times["nod1"], np.arange(7) * 0.1)


def test_schedule_drops_a_behaviour_with_contradicting_equalities() -> None:
    body = face("a", start="b:start + 1", end="b:start") + face("b")
    found = schedule(body, {k: timing([0.2, 0.4, 0.4]) for k in "ab"})
    assert dropped(found) == ["b1:a"]
    assert list(found.times) == ["b"]


def test_schedule_drops_a_behaviour_before_the_block() -> None:
    found = schedule(wait("a", start="-1") + wait("b", start="a:start"), {k: timing([1.0]) for k in "ab"})
    assert dropped(found) == ["b1:a"]
    assert "a:start = -1 (line 2)" in found.warnings[0].text
    assert found["b"] == {"start": 0.0, "end": 1.0}


def test_schedule_starts_each_behaviour_before_the_block_with_the_block() -> None:
    body = "".join(wait(f"w{k}", start="-1" if k % 2 else "1") for k in range(10))
    found = schedule(body, {f"w{k}": timing([1.0]) for k in range(10)})
    assert sorted(dropped(found)) == [f"b1:w{k}" for k in range(1, 10, 2)]
    assert [found.at(f"w{k}", "start") for k in range(10)] == [1.0, 0.0] * 5


def test_schedule_drops_a_nod_too_early_for_a_pinned_speech() -> None:
    body = saying("s", marks=1, start="0") + head("n", stroke="s:m1")
    found = schedule(body, {"s": speech(0.1, 2.0), "n": timing([0.2] * 6, least=0.05)})
    assert dropped(found) == ["b1:n"]
    assert "n takes at least 0.15 s from start to stroke" in found.warnings[0].text


def test_schedule_drops_an_optional_constraint_before_any_behaviour() -> None:
    body = wait("a", start="1") + wait("b", start="2") + constraint(together("a:start", "b:start"), "same")
    found = schedule(body, {k: timing([1.0]) for k in "ab"})
    assert dropped(found) == ["b1:same"]
    assert "constraint same, line 4" in found.warnings[0].text
    assert found["b"] == {"start": 2.0, "end": 3.0}


def test_schedule_names_a_constraint_without_id_by_its_block() -> None:
    body = wait("a", start="1") + wait("b", start="2") + constraint(after("b:start", "a:start"))
    found = schedule(body, {k: timing([1.0]) for k in "ab"})
    assert dropped(found) == ["b1"]
    assert not found.failed
    assert "a:start is not before b:start" in found.warnings[0].text
    assert found["a"] == {"start": 1.0, "end": 2.0}


def test_schedule_drops_the_later_behaviour_of_a_required_constraint() -> None:
    body = wait("a", start="1") + wait("b", start="2")
    found = schedule(
        body + required(constraint(together("a:start", "b:start"))), {k: timing([1.0]) for k in "ab"}
    )
    assert dropped(found) == ["b1:b"]
    assert found["a"] == {"start": 1.0, "end": 2.0}


def test_schedule_keeps_the_required_behaviour() -> None:
    body = wait("a", start="b:end") + required(wait("b", start="a:end"))
    found = schedule(body, {k: timing([1.0]) for k in "ab"})
    assert dropped(found) == ["b1:a"]
    assert "required" in found.warnings[0].text
    assert list(found.times) == ["b"]


def test_schedule_drops_the_lowest_priority() -> None:
    body = wait("a", start="b:end") + wait("b", start="a:end")
    found = schedule(body, {k: timing([1.0]) for k in "ab"}, priorities={"a": -1.0})
    assert dropped(found) == ["b1:a"]
    assert "its priority is the lowest" in found.warnings[0].text


def test_schedule_fails_if_everything_in_a_conflict_is_required() -> None:
    body = required(wait("a", start="b:end") + wait("b", start="a:end")) + wait("c")
    found = schedule(body, {k: timing([1.0]) for k in "abc"})
    assert found.failed
    assert not found.times
    assert dropped(found) == ["b1"]


def test_schedule_ignores_references_to_absent_behaviours() -> None:
    body = wait("a", start="gone:end + 7", end="c:end") + wait("gone") + wait("c")
    body += constraint(after("gone:end", "c:start") + after("4", "c:start"))
    found = schedule(body, {k: timing([1.0]) for k in "ac"})
    assert not found.warnings
    assert found["a"] == found["c"] == {"start": 0.0, "end": 1.0}


def test_schedule_drops_the_constraints_of_a_dropped_behaviour() -> None:
    body = wait("a", end="-1") + wait("b") + constraint(after("a:end + 5", "b:start"))
    found = schedule(body, {k: timing([1.0]) for k in "ab"})
    assert dropped(found) == ["b1:a"]
    assert found["b"] == {"start": 0.0, "end": 1.0}


def test_schedule_warns_of_each_of_several_conflicts_once() -> None:
    pairs = "".join(wait(f"a{k}", start=f"b{k}:end") + wait(f"b{k}", start=f"a{k}:end") for k in range(20))
    timings = {f"{c}{k}": timing([1.0]) for c in "ab" for k in range(20)}
    found = schedule(pairs, timings)
    assert sorted(dropped(found)) == sorted(f"b1:b{k}" for k in range(20))


def test_schedule_drops_one_of_three_in_a_circle() -> None:
    body = wait("a", start="c:end") + wait("b", start="a:end") + wait("c", start="b:end")
    found = schedule(body, {k: timing([1.0]) for k in "abc"})
    assert dropped(found) == ["b1:c"]
    assert found["a"] == {"start": 0.0, "end": 1.0}
    assert found["b"] == {"start": 1.0, "end": 2.0}


# Statements that are given up, so that behaviours stay.


def test_schedule_gives_up_the_last_reference_of_speech_before_its_start() -> None:
    body = saying("s", marks=1, start="1", end="1.5")
    found = schedule(body, {"s": speech(0.5, 2.0)})
    assert found["s"] == {"start": 1.0, "m1": 1.5, "end": 3.0}
    assert found.released == ("s:end",)
    assert "s:end = 1.5 was given up" in found.warnings[0].text
    assert "s:end is 1.5 s later" in found.warnings[0].text


def test_schedule_drops_what_contradicts_speech_that_states_nothing_else() -> None:
    body = wait("w", start="s:end", end="1") + saying("s", start="0")
    found = schedule(body, {"s": speech(2.0), "w": timing([1.0])})
    assert dropped(found) == ["b1:w"]
    assert found["s"] == {"start": 0.0, "end": 2.0}


def test_schedule_gives_up_a_start_of_speech_that_goes_in_a_circle() -> None:
    body = wait("w", start="s:end") + saying("s", start="w:end")
    found = schedule(body, {"s": speech(2.0), "w": timing([1.0])})
    assert found.released == ("s:start",)
    assert found["w"] == {"start": 2.0, "end": 3.0}


def test_schedule_gives_up_references_of_speech_that_have_no_time() -> None:
    body = saying("s", start="b9:x:end") + wait("w", start="b9:x:end")
    found = schedule(body, {"s": speech(2.0), "w": timing([1.0])})
    assert sorted(dropped(found)) == ["b1:s", "b1:w"]
    assert list(found.times) == ["s"]
    assert "s:start was given up" in next(w.text for w in found.warnings if w.id == "b1:s")


def test_schedule_refuses_a_block_whose_required_speech_contradicts_itself() -> None:
    body = f"<required>{saying('s', start='0', end='0.5')}</required>"
    assert schedule(body, {"s": speech(2.0)}).failed


@pytest.mark.parametrize("syncs", [{"start": "w:end"}, {"end": "w:start"}, {"end": "w:start - 1"}])
def test_schedule_leaves_a_behaviour_its_length(syncs: dict[str, str]) -> None:
    found = schedule(wait("w", **syncs), {"w": timing([1.0])})
    assert found["w"] == {"start": 0.0, "end": 1.0}
    assert "would leave it no length" in found.warnings[0].text


# Other blocks.


def test_schedule_fixes_points_of_other_blocks() -> None:
    times = {"b0:x:end": 2.0}
    found = schedule(
        wait("a", start="b0:x:end + 1"),
        {"a": timing([1.0])},
        outside=lambda ref: times[f"{ref.block}:{ref.behaviour}:{ref.sync}"] + ref.offset,
    )
    assert found.at("a", "start") == 3.0


def test_schedule_drops_a_reference_to_an_unknown_point_of_another_block() -> None:
    found = schedule(wait("a", start="b0:x:end") + wait("b"), {k: timing([1.0]) for k in "ab"})
    assert dropped(found) == ["b1:a"]
    assert "b0:x:end" in found.warnings[0].text
    assert "line 2" in found.warnings[0].text


def test_schedule_drops_a_reference_to_an_unknown_mark() -> None:
    body = saying("s", marks=1) + head("n", stroke="s:m1")
    found = schedule(body, {"s": timing([1.0], rigid=True), "n": timing([0.1] * 6)})
    assert dropped(found) == ["b1:n"]
    assert "s has no m1, only start, end" in found.warnings[0].text


def test_schedule_fails_for_an_unknown_reference_of_a_required_behaviour() -> None:
    found = schedule(required(wait("a", start="b0:x:end")) + wait("b"), {k: timing([1.0]) for k in "ab"})
    assert found.failed
    assert dropped(found) == ["b1"]
