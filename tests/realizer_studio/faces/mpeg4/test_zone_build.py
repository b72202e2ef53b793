"""Tests of the build of a face's fields from zones."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from realizer.cli.faces import faces
from realizer.core.errors import FaceError
from realizer.face.basis import BEYOND
from realizer.face.deform import deform
from realizer.face.load import folder_of, load_face
from realizer.face.model import Face
from realizer_studio.faces.check import check_face
from realizer_studio.faces.mpeg4.faceeditor import write_faceeditor
from realizer_studio.faces.mpeg4.fap_scores import mean_score, score_faps
from realizer_studio.faces.mpeg4.parameters import FILE, write_setup
from realizer_studio.faces.mpeg4.zone_build import (
    FILES,
    apply_zones,
    bind_to_skin,
    copy_with_zones,
    extend_field,
    setup_of,
)

pytestmark = pytest.mark.xdist_group("faces")


def copy(to: Path, fields: bool = False) -> Path:
    """The default face without what its shapes made."""
    source, folder = folder_of("default"), to / "plain"
    folder.mkdir()
    for name in FILES:
        if (source / name).is_file() and name != FILE and (fields or name != "fields.npz"):
            shutil.copy(source / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = copy(tmp_path_factory.mktemp("faces"))
    apply_zones(folder, setup_of(folder))
    return folder


def face_of(folder: Path) -> Face:
    return load_face(folder.name, folder.parent)


def test_apply_zones_makes_a_sound_face(plain: Path) -> None:
    assert check_face(plain.name, plain.parent) == ()


@pytest.mark.slow
def test_apply_zones_makes_true_faps(plain: Path) -> None:
    truths = score_faps(face_of(plain))
    assert mean_score(truths) > 2.75
    # Lips that are pushed back stop at the teeth.
    truths = tuple(t for t in truths if (t.fap, t.sign) not in ((16, -1), (17, -1)))
    assert min(t.score for t in truths) >= 2
    assert all(t.error < 0.02 and t.mirror < 0.01 and t.side_effect < 0.05 for t in truths)


def test_apply_zones_moves_a_lip_evenly_by_equal_faps(plain: Path) -> None:
    face = face_of(plain)
    row = np.zeros((1, 68), np.float32)
    row[0, [fap - 1 for fap in (5, 10, 11, 52, 57, 58)]] = -300
    move = (deform(face, row)[0] - face.vertices)[:, 1]
    points = [move[face.feature_points[name]] for name in ("2.8", "2.3", "2.9", "8.7", "8.2", "8.8")]
    assert np.ptp(points) < 0.02 * abs(points[1])
    assert move[slice(*face.parts["skin"])].min() > 1.04 * points[1]


def test_apply_zones_closes_the_lids_over_the_eyes(plain: Path) -> None:
    face = face_of(plain)
    row = np.zeros((1, 68), np.float32)
    row[0, [18, 19, 20, 21]] = [700, 700, 324, 324]
    at = deform(face, row)[0]
    for high, low in (("3.1", "3.3"), ("3.2", "3.4")):
        assert abs(at[face.feature_points[high], 1] - at[face.feature_points[low], 1]) < 0.0003
    for eye, (ball, centre) in enumerate(face.basis["eyes"]):
        lids = face.basis["lid"][face.basis["lid_eye"] == eye]
        # The white's: the cornea stands out before it.
        radius = np.linalg.norm(face.vertices[slice(*ball)] - centre, axis=1)[-26:].mean()
        assert np.linalg.norm(at[lids] - centre, axis=1).min() > radius - 0.0003


def test_apply_zones_twice_gives_the_same_bytes(plain: Path, tmp_path: Path) -> None:
    again = copy(tmp_path)
    apply_zones(again, setup_of(again))
    assert (again / "fields.npz").read_bytes() == (plain / "fields.npz").read_bytes()


def test_apply_zones_to_some_faps_keeps_the_others(tmp_path: Path) -> None:
    folder = copy(tmp_path, fields=True)
    own = load_face()
    apply_zones(folder, setup_of(folder), only={31, 32, 37, 38})
    mixed = face_of(folder)
    before, after = own.basis["fields"].toarray(), mixed.basis["fields"].toarray()
    changed = np.flatnonzero(np.abs(before - after).max(axis=0) > 1e-6) + 1
    assert changed.tolist() == [31, 32, 37, 38, BEYOND + 37, BEYOND + 38]
    assert check_face(folder.name, folder.parent) == ()


def test_setup_of_reads_the_folder_s_own_parameters(tmp_path: Path) -> None:
    folder = copy(tmp_path)
    setup = setup_of(folder)
    write_setup(folder / "mpeg4.toml", setup)
    text = (folder / "mpeg4.toml").read_text("utf-8")
    (folder / "mpeg4.toml").write_text(
        text.replace('fap = 31\nfalloff = "cosine"', 'fap = 31\nfalloff = "linear"')
    )
    changed = setup_of(folder)
    assert changed.zones[31].falloff == "linear"
    assert changed.zones[32].falloff == "linear"  # the sides go together
    assert changed.zones[33].falloff == "cosine"


def test_apply_zones_refuses_a_fap_without_a_zone(tmp_path: Path) -> None:
    folder = copy(tmp_path, fields=True)
    with pytest.raises(FaceError, match="no zone for FAP 3; add one"):
        apply_zones(folder, setup_of(folder), only={3})


def test_zones_command_makes_another_face(tmp_path: Path) -> None:
    folder = tmp_path / "zoe"
    some, xml = ["--fap", "31", "--fap", "32"], tmp_path / "zones.xml"
    ran = CliRunner().invoke(faces, ["zones", "default", "-o", str(folder), *some, "--xml", str(xml)])
    assert ran.exit_code == 0, ran.output
    assert face_of(folder).name == "zoe"
    assert (folder / "mpeg4.toml").is_file()
    assert check_face("zoe", tmp_path) == ()
    assert ran.stdout == f"{folder}: 2 zones\n"
    lost = write_faceeditor(tmp_path / "again.xml", setup_of(folder))
    assert lost
    assert ran.stderr.splitlines() == [f"{xml}: {line}" for line in lost]
    assert xml.is_file()


def test_with_brows_moves_what_grows_on_the_skin() -> None:
    at = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.001], [0.1, 0, 0.001], [0, 0.2, 0]])
    parts = {"skin": (0, 3), "beard": (3, 4), "lashes": (4, 5), "hair": (5, 6)}
    field = np.array([[0, 1.0, 0], [0, 2.0, 0], [0, 0, 0]])
    row = extend_field(at, parts, field, np.full((6, 3), 9.0))
    assert row[:3] == pytest.approx(field)
    assert row[3] == pytest.approx([0, 1, 0], abs=0.05)
    assert row[4] == pytest.approx([0, 2, 0], abs=0.05)
    assert (row[5] == 9).all()


def test_copy_with_zones_locates_missing_feature_points(tmp_path: Path) -> None:
    source = copy(tmp_path, fields=True)
    (source / "features.csv").unlink()
    folder = tmp_path / "found"
    _, guesses = copy_with_zones(source, folder, only={31})
    found = face_of(folder)
    assert set(guesses) < set(found.points)
    assert found.points["3.5"] == pytest.approx(load_face().points["3.5"], abs=0.005)


def test_grown_vertices_follow_the_nearest_skin() -> None:
    at = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.5]], float)
    vertex, near, share = bind_to_skin(at, {"skin": (0, 3), "brows": (3, 4)})
    assert vertex.tolist() == [3]
    assert near[0, 0] == 0
    assert share.sum() == 1
    assert len(bind_to_skin(at, {"skin": (0, 4)})[0]) == 0
