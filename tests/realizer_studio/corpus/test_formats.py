"""Tests of `realizer_studio.corpus.formats`."""

import json
from pathlib import Path

import numpy as np
import pytest

from realizer import realize
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.tables import by_number, faps
from realizer.tables.arkit_names import shapes
from realizer_studio.corpus.formats import merged, read_part, write_annotations
from realizer_studio.corpus.recording import Annotation, CorpusError, Recording
from tests.mesh_features import points_of

LABELS = (
    Annotation(0.0, 1.0, "surprise", "eva"),
    Annotation(0.5, 1.5, 'grief "so"', "eva"),
    Annotation(0.2, 0.4, "anger", "otto"),
)
WORDS = (Annotation(0.0, 0.5, "oh", "anna"), Annotation(0.6, 1.0, "<no>", "bob"))


def fap(recording: Recording, name: str) -> np.ndarray:
    assert recording.faps is not None
    return recording.faps[:, next(row.fap for row in faps() if row.name == name) - 1]


@pytest.mark.parametrize("suffix", [".eaf", ".TextGrid"])
def test_write_annotations_is_read_back(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    write_annotations(path, Recording("x", {}, LABELS, WORDS))
    back = read_part(path)
    assert sorted(back.labels, key=str) == sorted(LABELS, key=str)
    assert sorted(back.words, key=str) == sorted(WORDS, key=str)


def test_write_annotations_refuses_other_formats(tmp_path: Path) -> None:
    with pytest.raises(CorpusError, match=r"x\.doc: wanted a name that ends in \.eaf or \.TextGrid"):
        write_annotations(tmp_path / "x.doc", Recording("x"))


def test_read_part_of_textgrid_is_read_by_others(tmp_path: Path) -> None:
    textgrid = pytest.importorskip("praatio.textgrid")
    write_annotations(tmp_path / "x.TextGrid", Recording("x", {"frames": 50}, LABELS, WORDS))
    grid = textgrid.openTextgrid(str(tmp_path / "x.TextGrid"), includeEmptyIntervals=False)
    assert set(grid.tierNames) == {"eva", "words anna", "otto", "eva (2)", "words bob"}


def test_read_part_takes_open_face(tmp_path: Path) -> None:
    head = "frame, timestamp, AU01_r, AU12_r, X_0, X_1, Y_0, Y_1, Z_0, Z_1"
    rows = ["1, 0.0, 0, 5, 1, 2, 3, 4, 5, 6", "2, 0.04, 2.5, 0, 1, 2, 3, 4, 5, 6"]
    (tmp_path / "x.csv").write_text("\n".join([head, *rows]) + "\n")
    found = read_part(tmp_path / "x.csv")
    assert found.fps == 25
    assert fap(found, "raise_l_i_eyebrow")[0] == 0 < fap(found, "raise_l_i_eyebrow")[1]
    assert fap(found, "raise_r_cornerlip")[0] > 100 > fap(found, "raise_r_cornerlip")[1]
    assert found.points is not None
    assert found.points[0] == ("0", "1")
    assert found.points[1][0].tolist() == [[1, -3, -5], [2, -4, -6]]


def test_read_part_takes_live_link(tmp_path: Path) -> None:
    head = ["Timecode", "BlendShapeCount", *(name[:1].upper() + name[1:] for name in shapes())]
    values = ["1.0" if name == "BrowOuterUpLeft" else "0.0" for name in head[2:]]
    (tmp_path / "x.csv").write_text(",".join(head) + "\n" + ",".join(["00:00:01:00", "61", *values]) + "\n")
    found = read_part(tmp_path / "x.csv")
    assert found.fps == 60
    assert fap(found, "raise_l_o_eyebrow")[0] > 50
    assert fap(found, "raise_r_o_eyebrow")[0] == 0


def test_read_part_takes_media_pipe_and_lost_frames(tmp_path: Path) -> None:
    shown = {
        "faceLandmarks": [[{"x": 0.1, "y": 0.2, "z": 0.3}]],
        "faceBlendshapes": [{"categories": [{"categoryName": "jawOpen", "score": 0.5}]}],
    }
    frames = [shown | {"timestamp": 0}, {"faceLandmarks": [], "faceBlendshapes": [], "timestamp": 50}]
    (tmp_path / "x.json").write_text(json.dumps(frames))
    found = read_part(tmp_path / "x.json")
    assert found.fps == 20
    assert found.points is not None
    assert np.isnan(found.points[1][1]).all()
    assert fap(found, "open_jaw")[0] > 100 > fap(found, "open_jaw")[1]


def test_read_part_takes_words_of_align_and_our_points(tmp_path: Path) -> None:
    (tmp_path / "w.json").write_text(json.dumps({"words": [{"start": 0.1, "end": 0.2, "text": "hi"}]}))
    assert read_part(tmp_path / "w.json").words == (Annotation(0.1, 0.2, "hi"),)
    (tmp_path / "p.csv").write_text("frame,point,x,y,z\n0,4.1,0,0,0\n1,4.1,0,1,0\n")
    points = read_part(tmp_path / "p.csv").points
    assert points is not None
    assert (points[0], points[1].shape) == (("4.1",), (2, 1, 3))


def test_read_part_takes_what_track_and_realize_write(tmp_path: Path) -> None:
    document = '<bml id="b"><faceLexeme id="f" lexeme="RAISE_BROWS" start="0.2" end="2"/></bml>'
    made = realize(document, fps=20, idle=False)
    for name in ("x.csv", "x.fap"):
        made.save(tmp_path / name)
    table, clip = (read_part(tmp_path / name) for name in ("x.csv", "x.fap"))
    assert table.fps == clip.fps == 20
    assert np.allclose(table.faps, made.faps.values, atol=1)
    assert np.allclose(clip.faps, made.faps.values, atol=1)
    (tmp_path / "units.csv").write_text("time,AU1L,AU12\n0.0,0.5,0\n0.1,0.0,1\n")
    units = read_part(tmp_path / "units.csv")
    assert units.fps == 10
    assert fap(units, "raise_l_i_eyebrow")[0] > 50 > fap(units, "raise_r_i_eyebrow")[0]
    assert fap(units, "raise_r_cornerlip")[1] > 100


def test_read_part_measures_the_faps_of_points(tmp_path: Path) -> None:
    face = load_face("ada")
    raised = np.zeros((3, 68), np.float32)
    raised[1:, 30] = 150
    rows = ["frame,point,x,y,z"]
    for name, way in points_of(face, deform(face, raised)).items():
        rows += [f"{k},{name},{x:.6f},{y:.6f},{z:.6f}" for k, (x, y, z) in enumerate(way)]
    (tmp_path / "points.csv").write_text("\n".join(rows))
    found = read_part(tmp_path / "points.csv")
    assert fap(found, "raise_l_i_eyebrow") == pytest.approx([0, 150, 150], abs=20)
    assert found.points is not None


def test_merged_adds_labels_and_words_once() -> None:
    both = merged(
        Recording("x", {"person": "anna"}, LABELS[:2]), Recording("y", {"fps": 50.0}, LABELS[1:], WORDS)
    )
    assert (both.name, both.labels, both.words, both.meta) == (
        "x",
        LABELS,
        WORDS,
        {"person": "anna", "fps": 50.0},
    )


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("x.doc", "", r"x\.doc: wanted a file that ends in \.csv, \.fap, \.json, \.eaf, \.textgrid"),
        ("x.csv", "a,b\n1,2\n", r"x\.csv: wanted .* in docs/corpus\.md, got: no column time"),
        ("x.csv", "a,b\n1,2\n", r"named as FAPs, but a,b"),
        ("x.csv", " \n", r"x\.csv: .* got: an empty file; save or copy it again"),
        ("x.csv", "frame,point,x,y,z\n", r"x\.csv: .* got: points without a row"),
        (
            "x.csv",
            "time,open_jaw\n0,1\n0.04\n",
            r"x\.csv: .* got: line 3 with 1 cells, where the first has 2",
        ),
        ("x.csv", "frame,AU01_r\n1\n", r"x\.csv: wanted"),
        ("x.csv", "start,end,expression,annotator\n2,1,x,y\n", r"x\.csv: wanted .*line 2: .*later end"),
        ("x.csv", "frame,point,x,y,z\n0,1,nan,0,0\n", r"x\.csv: .*finite places"),
        ("x.fap", "3.1 x 25 1", r"x\.fap: wanted"),
        ("x.json", "{}", r"x\.json: wanted"),
        ("x.json", "[1]", r"x\.json: wanted"),
        ("x.eaf", "<a>", r"x\.eaf: wanted"),
        ("x.eaf", "<a/>", r"x\.eaf: wanted .*no interval"),
        ("x.TextGrid", "nothing", r"x\.TextGrid: wanted .*no interval"),
    ],
)
def test_read_part_names_what_is_wanted(tmp_path: Path, name: str, content: str, said: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(CorpusError, match=said):
        read_part(tmp_path / name)


def test_action_units_of_shapes_are_known() -> None:
    assert {shape.au for shape in shapes().values()} - {0} <= set(by_number())


def test_read_part_takes_points_of_any_names(tmp_path: Path) -> None:
    (tmp_path / "dots.csv").write_text("frame,point,x,y,z\n0,nose,1,2,0\n1,nose,3,2,0\n0,31,5,5,0\n")
    names, places = read_part(tmp_path / "dots.csv").points or ((), np.zeros(0))
    assert names == ("nose", "31")
    assert places[1, 0].tolist() == [3, 2, 0]
    assert np.isnan(places[1, 1]).all()
