"""Heads without shapes become faces that zones move."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.face.load import load_face, load_folder
from realizer_studio.editors.face.bare_head import import_bare
from realizer_studio.faces.mpeg4.fap_scores import mean_score, score_faps
from tests.bare_heads import bare_head


@pytest.fixture(scope="module")
def imported(tmp_path_factory) -> tuple[Path, tuple[str, ...]]:  # type: ignore[no-untyped-def]
    place = tmp_path_factory.mktemp("bare")
    return place / "bare", import_bare(bare_head(place / "head.glb"), place / "bare", "bare")


def test_import_bare_finds_the_parts_and_the_scale(imported) -> None:  # type: ignore[no-untyped-def]
    face, ada = load_folder(imported[0], None), load_face("ada")
    assert set(face.parts) == set(ada.parts) - {"tears"}
    assert face.fapu.es0 == pytest.approx(ada.fapu.es0, abs=2e-3)
    assert face.fapu.mns0 == pytest.approx(ada.fapu.mns0, rel=0.02)


def test_import_bare_names_the_points_it_guesses(imported) -> None:  # type: ignore[no-untyped-def]
    words = imported[1]
    assert "guess 11.4" in words
    assert "guess 3.5" not in words


@pytest.mark.slow
def test_import_bare_makes_a_face_that_scores_well(imported) -> None:  # type: ignore[no-untyped-def]
    assert mean_score(score_faps(load_folder(imported[0], None))) > 2.7


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_import_bare_reads_meshes_without_names(tmp_path: Path, suffix: str) -> None:
    head = bare_head(tmp_path / f"head{suffix}", names=False)
    import_bare(head, tmp_path / "face", "face")
    assert {"skin", "left_eye", "right_eye", "lower_teeth"} <= set(load_folder(tmp_path / "face", None).parts)


def test_import_bare_refuses_a_face_without_eyes(tmp_path: Path) -> None:
    head = bare_head(tmp_path / "head.glb", without=["left_eye", "right_eye"])
    with pytest.raises(FaceError, match=r"wanted two eyeballs side by side.*name the eyes' meshes"):
        import_bare(head, tmp_path / "face", "face")
    assert not (tmp_path / "face").exists()


@pytest.mark.parametrize(
    ("name", "content"),
    [("head.fbx", b"?"), ("head.ply", b"ply\nno mesh"), ("head.glb", b"glTF"), ("head.obj", b"")],
)
def test_import_bare_refuses_what_is_no_mesh(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(FaceError, match=name):
        import_bare(tmp_path / name, tmp_path / "face", "face")
