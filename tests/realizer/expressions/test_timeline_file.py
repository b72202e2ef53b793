"""Tests of `realizer.expressions.timeline_file`."""

import json
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.errors import TableError
from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_file import (
    MAX_SECONDS,
    MIN_SECONDS,
    read_timeline,
    timeline_json,
    write_timeline,
)
from tests.rows import each_row

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
JSON = b'{"channel": [{"name": "2", "entries": [{"expression": "smile"}]}]}'


def test_read_timeline_takes_toml_and_json() -> None:
    read = read_timeline(FILE)
    brows = Track("brows", (Entry("template:surprise", 0.8, 1.2), Entry("Neutral")), "onset", "smooth", 0.5)
    assert read == Timeline((brows, Track("2", (Entry("smile"),))))
    assert read_timeline(b"\n" + JSON).tracks == read.tracks[1:]


def test_read_timeline_takes_mixer_and_order() -> None:
    read = read_timeline(b'mixer = "successive"\norder = [4, 1, 2]\n' + FILE)
    assert (read.mixer, read.order) == ("successive", (4, 1, 2))
    assert read.tracks == read_timeline(FILE).tracks
    assert read_timeline(b'{"order": [], ' + JSON[1:]) == read_timeline(JSON)


@pytest.mark.parametrize("content", [JSON[JSON.index(b"[") : -1], b"[]", b' [{"channel": []}]'])
def test_read_timeline_refuses_a_bare_list(content: bytes) -> None:
    with pytest.raises(TableError, match=r'^timeline: wanted \{"channel": \[\.\.\.\]\}, got a list$'):
        read_timeline(content)


ONE = b"[[channel]]\nentries = [{ expression = 'a' }]"
BAD = {
    b"mixer = 'sum'\n" + ONE: "timeline, mixer: wanted additive or successive, got 'sum'",
    b"mixer = ['additive']\n" + ONE: "timeline, mixer: wanted additive or successive, got ['additive']",
    b"order = 12\n" + ONE: "timeline, order: wanted a list of action units, such as [4, 1, 2], got 12",
    b"order = [4, 51]\n"
    + ONE: "order, place 2: wanted the number of an action unit that turns neither head nor eyes, got 51",
    b"order = [300]\n" + ONE: "order, place 1: wanted the number of an action unit",
    b"order = ['4']\n"
    + ONE: "order, place 1: wanted the number of an action unit that turns neither head nor eyes, got '4'",
    b"order = [true]\n" + ONE: "order, place 1: wanted the number",
    b"order = [4, 1, 4]\n" + ONE: "order, place 3: wanted each action unit once, got 4",
    ONE + b"\nmixer = 'successive'": "got 'mixer'; it belongs before all channels",
    ONE + b"\nstart = 1" + b"0" * 400: "got: it has an integer of more than 64 bits",
    ONE + b"\nstart = 1" + b"0" * 9000: "wanted a timeline in TOML or JSON",
    b"\xff": "wanted a timeline in TOML or JSON",
    b"{": "wanted a timeline in TOML or JSON",
    b"": "timeline: wanted channels, [[channel]] each, got nothing",
    b"channel = 3": "timeline: wanted channels",
    b"channel = [3]": "channel 1: wanted a table with entries, got 3",
    b"x = 1\n[[channel]]\nentries = [{ expression = 'a' }]": "wanted mixer, order, channel, got 'x'",
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


@each_row("text", BAD)
def test_read_timeline_names_channel_and_entry_of_a_fault(text: bytes) -> None:
    with pytest.raises(TableError) as caught:
        read_timeline(text)
    assert BAD[text] in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_read_timeline_reports_all_faults_at_once() -> None:
    with pytest.raises(TableError) as caught:
        read_timeline(
            b"[[channel]]\njoins = 1\nentries = [{}, { expression = 'a', intensity = 7 }]\n[[channel]]"
        )
    assert len(str(caught.value).splitlines()) == 4


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


@pytest.mark.parametrize(
    ("fields", "fault"),
    [
        ("faps = [31, 31], keys = [[0, 1, 1], [1, 0, 0]]", "faps: wanted FAPs 3..68, each once"),
        ("faps = [2], keys = [[0, 1], [1, 0]]", "faps: wanted FAPs 3..68"),
        (
            "faps = [31]",
            "keys: wanted rows of a time, rising from 0, and 1 numbers, at least two, got nothing",
        ),
        ("faps = [31], keys = [[0, 1], [0, 2]]", "rising from 0"),
        ("faps = [31], keys = [[0, 1], [1, 2, 3]]", "and 1 numbers"),
        ("faps = [31], keys = [[0, 1], [1, 1e9]]", "and 1 numbers"),
    ],
)
def test_read_timeline_says_what_is_wrong_with_keyframes(fields: str, fault: str) -> None:
    with pytest.raises(TableError, match=re.escape(fault)):
        read_timeline(f'[[channel]]\nentries = [{{ expression = "keyframes", {fields} }}]'.encode())


def test_read_timeline_wants_keys_only_in_keyframes() -> None:
    with pytest.raises(TableError, match=r"faps: wanted expression = .keyframes. beside it, got 'smile'"):
        read_timeline(b'[[channel]]\nentries = [{ expression = "smile", faps = [31] }]')
