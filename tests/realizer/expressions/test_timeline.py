"""Timeline files, good and bad, and when each of their entries shows."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.errors import TableError
from realizer.expressions import (
    Entry,
    Timeline,
    Track,
    evident,
    faults_of,
    lasts,
    read_timeline,
    shipped,
    spans,
)

FILE = b"""
[[channel]]
name = "brows"
joins = "onset"
curve = "smooth"
start = 0.5
entries = [{ expression = "template:surprise", intensity = 0.8, duration = 1.2 }, { expression = "Neutral" }]
[[channel]]
entries = [{ expression = "smile" }]
"""


def test_a_file_is_read_as_toml_and_as_json() -> None:
    read = read_timeline(FILE)
    brows = Track("brows", (Entry("template:surprise", 0.8, 1.2), Entry("Neutral")), "onset", "smooth", 0.5)
    assert read == Timeline((brows, Track("2", (Entry("smile"),))))
    json = b'\n{"channel": [{"name": "2", "entries": [{"expression": "smile"}]}]}'
    assert read_timeline(json).tracks == read.tracks[1:]


def test_an_entry_without_a_duration_lasts_as_its_expression_does() -> None:
    (span,) = spans(Track("a", (Entry("smile"),)), shipped())
    smile = shipped()["SMILE"]
    assert span.reached == pytest.approx(smile.onset)
    assert span.end - span.left == pytest.approx(smile.offset)
    assert lasts(Timeline((Track("a", (Entry("smile"),), start=1.0),)), shipped()) == pytest.approx(
        1 + smile.duration
    )


NAMES = [*shipped(), "neutral"]


@given(
    entries=st.lists(
        st.tuples(st.sampled_from(NAMES), st.one_of(st.none(), st.floats(0.04, 9))), min_size=1, max_size=6
    ),
    joins=st.sampled_from(["both", "onset", "offset"]),
    start=st.floats(0, 5),
)
def test_whatever_the_entries_time_goes_forward(entries, joins, start: float) -> None:
    track = Track(
        "a", tuple(Entry(name, 1.0, duration) for name, duration in entries), joins, "linear", start
    )
    shown = spans(track, shipped())
    times = [start]
    for span in shown:
        assert span.start == pytest.approx(times[-1]) or span.start <= span.reached
        assert span.start - 1e-9 <= span.reached <= span.left + 1e-9
        assert span.left <= span.end + 1e-9
        times.append(span.end)
    for one, other in pairwise(shown):
        assert one.end == pytest.approx(other.start)


def test_an_expression_is_evident_from_half_of_its_coming_to_half_of_its_going() -> None:
    track = Track("a", (Entry("template:surprise", 1.0, 1.0), Entry("neutral"), Entry("smile")))
    (place, one, begin, end), (_, other, _, _) = evident(Timeline((track,)), shipped())
    assert (place, one.name, other.name) == ("channel a, entry 1", "template:surprise", "SMILE")
    assert (begin, end) == pytest.approx((0.15, 0.75))


def test_names_that_nobody_knows_are_faults_and_breaks_are_not() -> None:
    track = Track("a", (Entry("nobody"), Entry("NEUTRAL"), Entry("smiel")))
    first, second = faults_of(Timeline((track,)), shipped())
    assert first.startswith("channel a, entry 1, expression: wanted a name")
    assert second.endswith("got 'smiel', did you mean SMILE?")


BAD = {
    b"\xff": "wanted a timeline in TOML or JSON",
    b"{": "wanted a timeline in TOML or JSON",
    b"": "timeline: wanted channels, [[channel]] each, got None",
    b"channel = 3": "timeline: wanted channels",
    b"channel = [3]": "channel 1: wanted a table with entries, got 3",
    b"x = 1\n[[channel]]\nentries = [{ expression = 'a' }]": "timeline: wanted channel, got 'x'",
    b"[[channel]]\nname = 3\nentries = [{ expression = 'a' }]": "channel 1, name: wanted a name, got 3",
    b"[[channel]]\nstart = -1\nentries = [{ expression = 'a' }]": "channel 1, start: wanted a number 0..3600",
    b"[[channel]]\njoins = 'x'\nentries = [{ expression = 'a' }]": "joins: wanted both or onset or offset",
    b"[[channel]]\ncurve = 'x'\nentries = [{ expression = 'a' }]": "curve: wanted linear or smooth, got 'x'",
    b"[[channel]]\nentries = ['a']": "entry 1: wanted { expression, intensity, duration }, got 'a'",
    b"[[channel]]\nentries = [{}]": "channel 1, entry 1, expression: wanted the name of an expression",
    b"[[channel]]\nentries = [{ expression = 'a', duration = nan }]": "entry 1, duration: wanted a number",
    b"[[channel]]\nentries = [{ expression = 'a', intensity = true }]": "entry 1, intensity: wanted a number",
    b"[[channel]]\nentries = [{ expression = 'a', durasion = 1 }]": "did you mean duration?",
}


@pytest.mark.parametrize("text", BAD)
def test_a_fault_is_told_with_its_channel_and_entry(text: bytes) -> None:
    with pytest.raises(TableError) as caught:
        read_timeline(text)
    assert BAD[text] in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_all_faults_are_told_at_once() -> None:
    with pytest.raises(TableError) as caught:
        read_timeline(
            b"[[channel]]\njoins = 1\nentries = [{}, { expression = 'a', intensity = 7 }]\n[[channel]]"
        )
    assert len(str(caught.value).splitlines()) == 4
