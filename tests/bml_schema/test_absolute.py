"""Tests of blocks with absolute times."""

import math
from collections.abc import Mapping
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import (
    BMLA,
    Behaviour,
    Block,
    Constraint,
    Speech,
    Sync,
    Synchronize,
    SyncRef,
    Wait,
    parse,
    read,
    with_absolute_times,
    write,
)
from realizer import schedule
from realizer.speech.silent import SilentVoice
from tests.rows import each_row
from tests.strategies import blocks, numbers

CORPUS = Path(__file__).parents[1] / "corpus"

Times = Mapping[str, Mapping[str, float]]


def points(node: Behaviour) -> list[str]:
    """Return the sync points of a behaviour, with strokes and syncs of speech."""
    times = getattr(node, "repetition", 1)
    strokes = [f"stroke:{n}" for n in range(1, min(times, 4) + 1)] if times > 1 else []
    return [*node.sync_points, *strokes, *(node.marked if isinstance(node, Speech) else ())]


@st.composite
def scheduled(draw: st.DrawFn) -> tuple[Block, Times]:
    """A block, and times for some of its behaviours."""
    block = draw(blocks())
    chosen = [b for b in block.behaviours if draw(st.integers(0, 4))]
    return block, {b.id: {p: draw(numbers) for p in points(b)} for b in chosen}


def times_of(block: Block) -> dict[str, dict[str, float]]:
    """Return the times that a block states as numbers."""
    found: dict[str, dict[str, float]] = {}
    for node in block.behaviours:
        syncs = dict(node.syncs)
        if isinstance(node, Speech) and node.text is not None:
            syncs |= {p.id: p.ref for p in node.text.parts if isinstance(p, Sync) and p.ref is not None}
        assert all(ref.behaviour is None for ref in syncs.values())
        found[node.id] = {p: ref.offset for p, ref in syncs.items()}
    for part in (p for c in block.constraints for p in c.parts if isinstance(p, Synchronize)):
        name, time = (*part.refs, None)[:2]
        if name and time and name.index is not None and time.behaviour is None and name.block is None:
            found[name.behaviour or ""].setdefault(f"{name.sync}:{name.index}", time.offset)
    return found


@given(scheduled())
def test_with_absolute_times_writes_every_time_exactly(given_: tuple[Block, Times]) -> None:
    block, times = given_
    result = with_absolute_times(block, times)
    back = parse(write(result))
    assert not back.problems
    assert back == result
    assert with_absolute_times(back, times) == back, "what says its times already stays as it is"
    assert [b.id for b in result.behaviours] == [b.id for b in block.behaviours if b.id in times]
    for id, at in times.items():
        assert {p: t for p, t in times_of(back)[id].items() if p in at and ":" not in p} == {
            p: t for p, t in at.items() if ":" not in p
        }


def test_with_absolute_times_is_readable() -> None:
    block = parse(
        f"<bml id='b' xmlns:a='{BMLA}' a:appendAfter='x'>"
        "<speech id='s' start='gone:end'><text>a<sync id='m'/></text></speech>"
        "<head id='h' lexeme='NOD' repetition='2' stroke='s:m'/><wait id='gone'/>"
        "<constraint id='k'><before ref='h:end'><sync ref='s:end'/></before></constraint>"
        "<constraint id='lost'><before ref='h:end'><sync ref='gone:end'/></before></constraint></bml>"
    )
    times = {
        "s": {"start": 0.0, "m": 0.1 + 0.2, "end": 1.0},
        "h": {"start": 0.0, "stroke:1": 0.25, "stroke:2": 0.5, "stroke": 0.5, "end": 1.5},
    }
    assert write(with_absolute_times(block, times)) == (
        '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" xmlns:bmla="http://www.asap-project.org/bmla"'
        ' id="b" bmla:appendAfter="x">\n'
        '  <speech id="s" start="0" end="1">\n'
        '    <text>a<sync id="m" ref="0.30000000000000004"/></text>\n'
        "  </speech>\n"
        '  <head id="h" lexeme="NOD" repetition="2" start="0" stroke="0.5" end="1.5"/>\n'
        '  <constraint id="k">\n'
        '    <before ref="h:end">\n'
        '      <sync ref="s:end"/>\n'
        "    </before>\n"
        "  </constraint>\n"
        "  <constraint>\n"
        "    <synchronize>\n"
        '      <sync ref="h:stroke:1"/>\n'
        '      <sync ref="0.25"/>\n'
        "    </synchronize>\n"
        "    <synchronize>\n"
        '      <sync ref="h:stroke:2"/>\n'
        '      <sync ref="0.5"/>\n'
        "    </synchronize>\n"
        "  </constraint>\n"
        "</bml>\n"
    )


def test_with_absolute_times_puts_marks_of_descriptions_into_a_constraint() -> None:
    speak = "<speak xmlns='http://www.w3.org/2001/10/synthesis'>a<mark name='m'/>b</speak>"
    inside = f"<description priority='1' type='application/ssml+xml'>{speak}</description>"
    block = parse(f"<bml id='b'><speech id='s'>{inside}</speech></bml>")
    result = with_absolute_times(block, {"s": {"start": 0.0, "m": 0.5, "end": 1.0}})
    refs = (SyncRef(behaviour="s", sync="m"), SyncRef(offset=0.5))
    assert result.constraints == (Constraint(parts=(Synchronize(refs=refs),)),)
    assert not parse(write(result)).problems


@pytest.mark.parametrize("time", [math.nan, math.inf, 86401.0, -1e9])
def test_with_absolute_times_refuses_times_beyond_a_day(time: float) -> None:
    with pytest.raises(ValueError, match="w:end: wanted at most 86400 seconds, got"):
        with_absolute_times(Block(id="b", children=(Wait(id="w"),)), {"w": {"start": 0.0, "end": time}})


def test_with_absolute_times_removes_a_constraint_that_the_times_break() -> None:
    block = parse(
        "<bml id='b'><wait id='w'/>"
        "<constraint id='k'><synchronize><sync ref='w:end'/><sync ref='2'/></synchronize></constraint>"
        "<constraint id='l'><after ref='w:end'><sync ref='bml:start+2'/></after></constraint>"
        "<constraint id='m'><before ref='x:w:end'><sync ref='w:start'/></before></constraint></bml>"
    )
    assert [c.id for c in with_absolute_times(block, {"w": {"start": 0.0, "end": 1.0}}).constraints] == [
        "l",
        "m",
    ]
    assert [c.id for c in with_absolute_times(block, {"w": {"start": 0.0, "end": 2.0}}).constraints] == [
        "k",
        "l",
        "m",
    ]
    assert [c.id for c in with_absolute_times(block, {"w": {"start": 0.0, "end": 2.5}}).constraints] == ["m"]


CASES = sorted(p for folder in ("core", "constraints", "ext") for p in (CORPUS / folder).glob("*.xml"))


@each_row("case", CASES)
def test_with_absolute_times_is_scheduled_to_the_same_times(case: Path) -> None:
    for block in read(case.read_bytes()):
        assert isinstance(block, Block)
        first = schedule(write(block), voice=SilentVoice())
        text = write(with_absolute_times(block, first.behaviours))
        again = schedule(text, voice=SilentVoice())
        assert again.behaviours == {id: pytest.approx(at, abs=1e-9) for id, at in first.behaviours.items()}, (
            text
        )
        assert {(w.id, w.type) for w in again.warnings} <= {(w.id, w.type) for w in first.warnings}


def test_with_absolute_times_keeps_the_language_of_a_text() -> None:
    block = parse("<bml id='b'><speech id='s'><text xml:lang='nl'>a<sync id='m'/></text></speech></bml>")
    speech = with_absolute_times(block, {"s": {"start": 0.0, "m": 0.5, "end": 1.0}})["s"]
    assert isinstance(speech, Speech)
    assert speech.text is not None
    assert speech.text.language == "nl"
