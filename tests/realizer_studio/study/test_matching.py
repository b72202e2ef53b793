"""Tests of `realizer_studio.study.matching`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import RealizerError, TableError
from realizer_studio.study.drawing import Drawer, Variant
from realizer_studio.study.matching import ADDED, LEAST_ADDED, _fewer, _more, matching, references

JOY = {(6, "BOTH"): 0.9, (12, "BOTH"): 1.0, (12, "LEFT"): 0.2}


@pytest.fixture
def photographs(tmp_path: Path) -> Path:
    image = Image.new("RGB", (900, 1200), "tan")
    exif = Image.Exif()
    exif[0x010E] = "joy"
    for name in ("a.jpg", "rest.jpg"):
        image.save(tmp_path / name, exif=exif)
    (tmp_path / "labels.csv").write_text("file,aus\na.jpg,6+12L:0.5\nrest.jpg,\n")
    return tmp_path


def test_fewer_leaves_out_one_unit_with_its_sides() -> None:
    assert _fewer(JOY) == {6: {(12, "BOTH"): 1.0, (12, "LEFT"): 0.2}, 12: {(6, "BOTH"): 0.9}}


def test_more_adds_units_that_co_occurrence_lets_be_seen() -> None:
    found = {number for seed in range(30) for number in _more(JOY, np.random.default_rng(seed))}
    assert found <= set(ADDED) - {6, 12}
    assert len(found) > 8
    for number, units in _more(JOY, np.random.default_rng(1)).items():
        assert LEAST_ADDED <= units[number, "BOTH"] <= 1
        assert JOY.items() <= units.items()
    # Closed eyes hide how wide they open.
    assert 5 not in {n for seed in range(30) for n in _more({(43, "BOTH"): 1.0}, np.random.default_rng(seed))}


def test_references_are_photographs_with_their_labels(photographs: Path) -> None:
    with Drawer() as draw:
        (found,) = references(str(photographs), draw)
    assert (found.name, found.units) == ("a.jpg", {(6, "BOTH"): 1.0, (12, "LEFT"): 0.5})
    assert found.rest is not None
    assert b"joy" not in found.picture + found.rest


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        ("file,aus\na.jpg,smile\n", "line 2, aus: wanted units such as 1"),
        ("file,aus\na.jpg,399\n", "399"),
        ("picture,aus\na.jpg,6\n", "wanted the columns file,aus"),
        ("file,aus\na.jpg,\n", "at least one photograph"),
        ("file,aus\nnone.jpg,6\n", "none.jpg"),
        (None, "labels.csv"),
    ],
)
def test_references_refuse_wrong_labels(labels: str | None, said: str, photographs: Path) -> None:
    (photographs / "labels.csv").unlink()
    if labels is not None:
        (photographs / "labels.csv").write_text(labels)
    with pytest.raises((TableError, RealizerError), match=said), Drawer() as draw:
        references(str(photographs), draw)


@pytest.mark.gl
@pytest.mark.long
@pytest.mark.slow
def test_matching_has_two_triples_of_each_reference_without_a_common_file() -> None:
    with Drawer() as draw:
        shown = [one for one in references("ben", draw) if one.name in ("surprise", "basic disgust")]
        found = list(matching(("visual", "emotional"), Variant("ada"), shown, draw, np.random.default_rng(1)))
    assert [one.kind for one in found] == ["visual", "emotional"] * 4
    files = [content for one in found[::2] for content in one.options.values()]
    assert len(set(files)) == 12
    assert found[0].truth["added"] != found[2].truth["added"]
    assert {tuple(one.options) for one in found} == {("right", "removed", "added")}
    assert set(found[0].shown) == {"reference", "rest", "neutral"}
