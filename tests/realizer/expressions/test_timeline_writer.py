"""Tests of `realizer.expressions.timeline_writer`."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_reader import MAX_SECONDS, MIN_SECONDS, read_timeline
from realizer.expressions.timeline_writer import timeline_json, write_timeline

seconds = st.none() | st.floats(MIN_SECONDS, MAX_SECONDS)
text = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)
names = text.filter(lambda word: word.strip() != "")
entries = st.builds(Entry, names, st.floats(0, 1), seconds, seconds, seconds, st.none() | text)
tracks = st.builds(
    Track,
    names,
    st.lists(entries, min_size=1, max_size=4).map(tuple),
    st.sampled_from(["both", "onset", "offset"]),
    st.sampled_from(["linear", "smooth"]),
    st.floats(0, MAX_SECONDS),
)
timelines = st.builds(
    Timeline,
    st.lists(tracks, min_size=1, max_size=3).map(tuple),
    st.sampled_from(["additive", "successive"]),
    st.lists(st.sampled_from([1, 2, 4, 12]), unique=True).map(tuple),
)


@given(timelines)
def test_write_timeline_keeps_every_field_as_toml_and_as_json(timeline: Timeline) -> None:
    assert read_timeline(write_timeline(timeline).encode()) == timeline
    assert read_timeline(json.dumps(timeline_json(timeline)).encode()) == timeline


def test_write_timeline_leaves_out_what_is_as_usual() -> None:
    written = write_timeline(Timeline((Track("brows", (Entry("smile"), Entry("neutral", duration=0.4))),)))
    assert written == (
        '[[channel]]\nname = "brows"\nentries = [\n    { expression = "smile" },\n'
        '    { expression = "neutral", duration = 0.4 },\n]\n'
    )
