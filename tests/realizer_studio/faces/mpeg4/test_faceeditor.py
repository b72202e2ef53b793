"""Tests of reading and writing FaceEditor's files."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from realizer.cli.faces import faces
from realizer.core.errors import FaceError
from realizer.face.load import folder_of, load_face
from realizer_studio.faces.mpeg4.faceeditor import fitted, read_faceeditor, write_faceeditor
from realizer_studio.faces.mpeg4.fap_scores import mean_score, score_faps
from realizer_studio.faces.mpeg4.zone_build import setup_of
from realizer_studio.faces.mpeg4.zones import Setup, Zone

FILE = """<?xml version="1.0"?>
<!DOCTYPE faceeditor-parameters [
<!ELEMENT vertex-mask (#PCDATA)>
<!ATTLIST vertex-mask fap CDATA #REQUIRED>
]>
<faceeditor-parameters>
  <fp-positions>
    <fp-position fp="3.4" x="-2.8" y="-0.6" z="1.4"/>
    <fp-position fp="4.1" x="1.5" y="1.7" z="2.7"/>
  </fp-positions>
  <keep-syncs>21 22 31 32</keep-syncs>
  <deformers>
    <ease-deformer x="-2.8" y="-0.6" z="1.4" fap="22" size="1.3" scalex="1.0" scaley="0.8" scalez="2.0"
      use-vertex-mask="true" invert-vertex-mask="false" ease="30"/>
    <smooth-deformer x="1.5" y="1.7" z="2.7" fap="31" size="2.0" scalex="1.0" scaley="0.5" scalez="1.0"
      use-vertex-mask="false" invert-vertex-mask="false" smooth-center="25" smooth-side="50"/>
    <deformer x="0.0" y="-10.0" z="1.2" fap="3"/>
  </deformers>
  <vertex-masks><vertex-mask fap="22">17 4
    5</vertex-mask></vertex-masks>
</faceeditor-parameters>
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "face.xml"
    path.write_text(text, "utf-8")
    return path


def same(one: Setup, two: Setup) -> bool:
    masks = {fap: mask.tolist() for fap, mask in one.masks.items()} == {
        fap: mask.tolist() for fap, mask in two.masks.items()
    }
    rest = dataclasses.replace(one, masks={}) == dataclasses.replace(two, masks={})
    return masks and rest


def test_read_faceeditor_returns_the_parameters(tmp_path: Path) -> None:
    setup = read_faceeditor(written(tmp_path, FILE))
    lid, brow = setup.zones[22], setup.zones[31]
    assert (lid.falloff, lid.ease, lid.size, lid.scale, lid.use_mask) == ("ease", 30, 1.3, (1, 0.8, 2), True)
    assert (brow.falloff, brow.smooth_centre, brow.smooth_side) == ("smooth", 0.25, 0.5)
    assert setup.masks[22].tolist() == [4, 5, 17]
    assert setup.synced == {21, 22, 31, 32}
    assert setup.rigid == {3}
    assert setup.points["2.1"] == (0.0, -10.0, 1.2)


def test_write_faceeditor_round_trips(tmp_path: Path) -> None:
    setup = read_faceeditor(written(tmp_path, FILE))
    assert write_faceeditor(tmp_path / "again.xml", setup) == ()
    again = read_faceeditor(tmp_path / "again.xml")
    assert same(setup, again)
    write_faceeditor(tmp_path / "third.xml", again)
    assert (tmp_path / "again.xml").read_bytes() == (tmp_path / "third.xml").read_bytes()


def test_write_faceeditor_approximates_a_raised_cosine(tmp_path: Path) -> None:
    zone = Zone(31, "cosine", 0.02)
    write_faceeditor(tmp_path / "a.xml", Setup({"4.1": (0, 0, 0)}, {31: zone}))
    back = read_faceeditor(tmp_path / "a.xml").zones[31]
    away = np.linspace(0, 0.025, 200)
    off = zone.influence(away / zone.size) - back.influence(away / back.size)
    assert np.abs(off).max() < 0.01


def test_write_faceeditor_returns_what_is_lost(tmp_path: Path) -> None:
    setup = Setup({"9.1": (0, 0, 0)}, {61: Zone(61, "cosine", 0.01, radial=0.5)})
    (lost,) = write_faceeditor(tmp_path / "a.xml", setup)
    assert lost.startswith("FAP 61: slide and radial")


@pytest.mark.parametrize(("size", "flip"), [(100, 1), (0.37, -1)])
def test_fitted_converts_units_and_a_mirrored_axis(size: float, flip: int) -> None:
    ours = setup_of(folder_of("default"))
    there = [100.0, -3.0, 7.0]
    theirs = dataclasses.replace(
        ours,
        points={
            name: tuple(v * size * s + o for v, s, o in zip(place, (flip, 1, 1), there, strict=True))
            for name, place in ours.points.items()
        },
        zones={fap: dataclasses.replace(zone, size=zone.size * size) for fap, zone in ours.zones.items()},
    )
    back = fitted(theirs, ours.points)
    for name, place in ours.points.items():
        assert back.points[name] == pytest.approx(place, abs=1e-9)
    assert back.zones[31].size == pytest.approx(ours.zones[31].size)


@pytest.mark.slow
def test_read_faceeditor_makes_a_face_as_true(tmp_path: Path) -> None:
    xml = tmp_path / "zones.xml"
    for arguments in (
        ["zones", "default", "-o", str(tmp_path / "one"), "--xml", str(xml)],
        ["zones", "default", "-o", str(tmp_path / "two"), "--parameters", str(xml)],
    ):
        ran = CliRunner().invoke(faces, arguments)
        assert ran.exit_code == 0, ran.output
    truths = score_faps(load_face("two", tmp_path))
    assert mean_score(truths) > 2.6
    # Lips that are pushed back stop at the teeth.
    assert {(t.fap, t.sign) for t in truths if t.error >= 0.02} <= {(16, -1), (17, -1)}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<keep-syncs>21 22 31 32</keep-syncs>", "", "once each and in order"),
        ('ease="30"', 'ease="much"', "<ease-deformer> ease: wanted a number, got 'much'"),
        ('ease="30"', 'ease="nan"', "ease: wanted a number, got 'nan'"),
        ('ease="30"', 'ease="300"', "ease: wanted -100..100, got 300.0"),
        (' ease="30"', "", "wanted <ease-deformer> with"),
        ('fap="31"', 'fap="1"', "wanted a FAP from 3 to 68, got '1'"),
        ('fap="31"', 'fap="22"', "FAP 22 has two deformers"),
        ('use-vertex-mask="true"', 'use-vertex-mask="yes"', "wanted true or false, got 'yes'"),
        ("17 4", "17 -4", "vertex-mask of FAP 22: wanted indices"),
        ("<deformer x", "<spring x", "deformers: wanted ease-deformer"),
        ("</faceeditor-parameters>", "", "wanted well-formed XML"),
        ("<!ELEMENT vertex-mask (#PCDATA)>", '<!ENTITY a "aa">', "no entities"),
    ],
)
def test_read_faceeditor_names_what_is_wrong(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in FILE
    with pytest.raises(FaceError) as raised:
        read_faceeditor(written(tmp_path, FILE.replace(old, new, 1)))
    assert message in str(raised.value)
    assert "face.xml" in str(raised.value)


def test_fitted_needs_a_file_and_common_points(tmp_path: Path) -> None:
    with pytest.raises(FaceError, match=r"none\.xml: wanted a file of FaceEditor, got No such file"):
        read_faceeditor(tmp_path / "none.xml")
    with pytest.raises(FaceError, match="at least three feature points"):
        fitted(read_faceeditor(written(tmp_path, FILE)), {"4.1": (0, 0, 0)})
