"""Tests of reading the head in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.tables.arkit_names import shapes
from realizer_studio.faces.arkit.head import FAIR, GUESS, SURE, fap_sources, read_head, source_table

pytestmark = pytest.mark.xdist_group("fits")


def test_read_head_sorts_vertices_part_after_part(ada_glb: Path) -> None:
    head = read_head(ada_glb)
    ends = list(head.ranges.values())
    assert [first for first, _ in ends] == [0, *(last for _, last in ends[:-1])]
    assert ends[-1][1] == len(head.surface.vertices)
    eyes = [head.surface.vertices[slice(*head.ranges[name])] for name in ("left_eye", "right_eye")]
    assert np.mean([eye.mean(axis=0)[:2] for eye in eyes], axis=0) == pytest.approx([0, 0], abs=0.001)
    assert not head.painted


def test_fap_sources_tell_shapes_from_zones_and_guesses() -> None:
    sources = {one.fap: one for one in fap_sources({6, 31}, {"4.1", "9.1"}, {"skin"}, False)}
    assert list(sources) == list(range(3, 69))
    assert (sources[6].source, sources[6].certainty) == ("mouthSmileLeft mouthStretchLeft", SURE)
    assert sources[31].certainty == FAIR  # 4.1 is a guess
    assert sources[7].source.startswith("a zone around its point (its shapes mouthSmileRight")
    assert {sources[fap].certainty for fap in (61, 62)} == {GUESS, FAIR}
    assert sources[43].source == "nothing: there is no tongue"
    assert sources[23].source == "a turn or push of the eyeball"


def test_fap_sources_of_painted_eyes_are_shapes() -> None:
    sources = {one.fap: one for one in fap_sources((), (), ("tongue",), True)}
    assert sources[23].source == "eyeLook shapes"
    assert sources[27].certainty == FAIR


def test_source_table_puts_equal_sources_together() -> None:
    lines = source_table(fap_sources((), (), (), False))
    assert lines[0].split() == ["FAPs", "move", "by", "how", "sure"]
    assert any(line.startswith("23-28 ") and line.endswith("sure") for line in lines)
    assert len({line.rindex(" ") for line in lines[1:]}) == 1


def test_fap_sources_name_shapes_of_arkit() -> None:
    served = {3, *range(4, 23), *range(31, 37), *range(39, 43), *range(51, 61)}
    made = [one for one in fap_sources(served, (), (), False) if one.fap in served]
    assert {name for one in made for name in one.source.split()} <= shapes().keys()
