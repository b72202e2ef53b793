"""Tests of the check of a face folder."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from realizer.cli.faces import faces
from realizer.core.errors import FaceError
from realizer.face.load import folder_of, load_face
from realizer_studio.faces.check import check_face
from realizer_studio.faces.mpeg4.parameters import write_setup
from realizer_studio.faces.mpeg4.zone_build import setup_of


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return Path(shutil.copytree(folder_of("ada"), tmp_path / "broken"))


def faults(folder: Path) -> tuple[str, ...]:
    return check_face(folder.name, folder.parent)


def rewrite(path: Path, **change: Callable[[np.ndarray], np.ndarray]) -> None:
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(path, **(arrays | {name: make(arrays[name].copy()) for name, make in change.items()}))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


def skin_of(folder: Path) -> slice:
    return slice(*load_face(folder.name, folder.parent).parts["skin"])


def changed(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)


def hollow(path: Path) -> None:
    path.unlink()
    path.mkdir()


def turned(triangles: np.ndarray) -> np.ndarray:
    triangles[40] = triangles[40, ::-1]
    return triangles


def masked(folder: Path) -> None:
    setup = setup_of(folder)
    write_setup(folder / "mpeg4.toml", setup)
    path = folder / "mpeg4.toml"
    line = next(
        line for line in path.read_text("utf-8").splitlines() if line.strip().endswith('"') and "-" in line
    )
    key = line.split("=")[0]
    edit(path, line, f'{key}= "999990-999999"')


BROKEN: dict[str, tuple[Callable[[Path], object], tuple[str, ...]]] = {
    "an unknown key": (
        lambda f: edit(f / "face.toml", "licence =", 'lisence = "x"\nlicence ='),
        ("face.toml: 'lisence'", "did you mean licence?"),
    ),
    "an unknown part": (
        lambda f: edit(f / "face.toml", "tongue =", "tung ="),
        ("'tung'", "did you mean tongue?"),
    ),
    "no skin": (lambda f: edit(f / "face.toml", "skin =", "shirt2 ="), ("wanted 'skin', got none",)),
    "parts that overlap": (
        lambda f: edit(f / "face.toml", "\nshirt = [", "\nshirt = [0, 50]\nother = ["),
        ("overlap", "face.toml"),
    ),
    "colours above 255": (
        lambda f: rewrite(f / "mesh.npz", colours=lambda a: a.astype(np.int32) * 300),
        ("mesh.npz: colours: wanted 0..255",),
    ),
    "gloss of another kind": (
        lambda f: rewrite(f / "mesh.npz", gloss=lambda a: a.astype(float) / 255),
        ("mesh.npz: gloss: wanted bytes",),
    ),
    "an inverted triangle": (
        lambda f: rewrite(f / "mesh.npz", triangles=turned),
        ("mesh.npz: skin: 1 triangles are inverted",),
    ),
    "fields of another mesh": (
        lambda f: rewrite(f / "fields.npz", head=lambda a: a[:-7]),
        ("fields.npz: head: wanted", "one a vertex"),
    ),
    "fields that are not finite": (
        lambda f: rewrite(f / "fields.npz", move=lambda a: np.where(a > 0, np.nan, a)),
        ("fields.npz: move: wanted finite",),
    ),
    "fields cut short": (
        lambda f: rewrite(f / "fields.npz", start=lambda a: a[:-1]),
        ("fields.npz: start: wanted",),
    ),
    "two mappings": (
        lambda f: [(f / f"au_to_fap.{form}").touch() for form in ("csv", "txt")],
        ("wanted one of au_to_fap.txt and au_to_fap.csv, got both",),
    ),
    "a mask out of range": (masked, ("mpeg4.toml", "wanted vertices of the skin", "999990")),
    "zones that are no zones": (
        lambda f: (f / "mpeg4.toml").write_text("# source: x\n# units: y\n# licence: z\nzone = 7\n") and None,
        ("mpeg4.toml",),
    ),
    "a model with an unknown unit": (
        lambda f: edit(f / "au_published.toml", "[degrees]", "[degrees]\nAU99 = 3.0\n#"),
        ("[AU99]", "no such unit"),
    ),
    "a model with NaN": (
        lambda f: edit(f / "au_published.toml", "[neck]", "[neck]\ntop = nan\n[old]"),
        ("au_published.toml: neck",),
    ),
    "a table that is no model": (
        lambda f: (
            (f / "au_mine.toml").write_text("# source: x\n# units: y\n# licence: z\nbrows = 2\n") and None
        ),
        ("au_mine.toml",),
    ),
    "shapes of another kind": (
        lambda f: rewrite(f / "au_shapes.npz", moves=lambda a: a[:, :-1]),
        ("au_shapes.npz: wanted moves",),
    ),
    "an archive cut short": (
        lambda f: (f / "fields.npz").write_bytes((f / "fields.npz").read_bytes()[:20000]) and None,
        ("fields.npz: wanted an .npz file, got one that is cut short",),
    ),
    "an empty archive": (
        lambda f: (f / "mesh.npz").write_bytes(b"") and None,
        ("mesh.npz: wanted an .npz file",),
    ),
    "an archive with a byte changed": (
        lambda f: changed(f / "fields.npz"),
        ("fields.npz: ", "is damaged"),
    ),
    "an array that is no archive": (
        lambda f: (f / "au_shapes.npz").write_bytes(b"\x93NUMPY\x01\x00" + bytes(64)) and None,
        ("au_shapes.npz: wanted an .npz file",),
    ),
    "vertices that are words": (
        lambda f: rewrite(f / "mesh.npz", vertices=lambda a: a.astype(str)),
        ("mesh.npz: vertices: wanted numbers, got",),
    ),
    "feature points that are no text": (
        lambda f: (f / "features.csv").write_bytes(bytes(range(256))) and None,
        ("features.csv: wanted a CSV file with the 84 feature points, got bytes that are no UTF-8",),
    ),
    "a folder where a file should be": (
        lambda f: hollow(f / "features.csv"),
        ("features.csv: wanted a CSV file with the 84 feature points, got Is a directory",),
    ),
    "lids over a third eye": (
        lambda f: rewrite(f / "fields.npz", lid_eye=lambda a: a + 7),
        ("fields.npz: lid_eye: wanted 0 or 1, got 7..8",),
    ),
    "eyes that are exchanged": (
        lambda f: rewrite(f / "fields.npz", eye_centre=lambda a: a[::-1]),
        ("fields.npz: eye_centre: wanted the left eye's middle, then the right's",),
    ),
    "a field that throws a vertex off": (
        lambda f: rewrite(f / "fields.npz", move=lambda a: np.where(a == a.max(), 600, a)),
        ("fields.npz: move: wanted at most", "got 600"),
    ),
    "a deformer that there is not": (
        lambda f: edit(f / "face.toml", "[parts]", 'deformer = "muscle"\n\n[parts]'),
        ("face.toml: deformer: wanted mpeg4 or au, got 'muscle'",),
    ),
    "a licence that is missing": (
        lambda f: edit(f / "face.toml", "licence =", "says2 ="),
        ('face.toml: wanted licence = "...", got none',),
    ),
    "a line for the list that is a number": (
        lambda f: edit(f / "face.toml", "says =", "says = 3\nsays2 ="),
        ('face.toml: wanted says = "...", got 3',),
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_check_face_names_the_file_and_the_remedy(folder: Path, name: str) -> None:
    spoil, words = BROKEN[name]
    spoil(folder)
    found = "\n".join(faults(folder))
    for word in words:
        assert word in found, found


def test_check_face_lists_every_fault(folder: Path) -> None:
    for name in ("an unknown key", "colours above 255", "fields of another mesh", "a model with NaN"):
        BROKEN[name][0](folder)
    (folder / "features.csv").unlink()
    found = faults(folder)
    assert len(found) >= 5
    for file in ("face.toml", "mesh.npz", "fields.npz", "features.csv", "au_published.toml"):
        assert any(file in fault for fault in found), file


def test_check_face_names_a_point_on_no_surface(folder: Path) -> None:
    path = folder / "mesh.npz"
    cheek = load_face("ada").feature_points["5.1"]
    rewrite(path, triangles=lambda a: a[(a != cheek).all(axis=1)])
    found = "\n".join(faults(folder))
    assert "5.1: vertex" in found
    assert "no triangle has it" in found
    assert "skin: it has 1 hole beside" in found
    assert "open edges at vertex" in found


def test_load_face_names_the_first_fault_and_the_check(folder: Path) -> None:
    (folder / "mesh.npz").unlink()
    with pytest.raises(FaceError, match=r"mesh\.npz.*run realizer faces check broken"):
        load_face("broken", folder.parent)


UNUSABLE: dict[str, tuple[Callable[[Path], object], str]] = {
    "a vertex that is NaN": (
        lambda f: rewrite(f / "mesh.npz", vertices=lambda a: np.where(a == a.max(), np.nan, a)),
        r"mesh\.npz: vertices: 1 are not finite",
    ),
    "flat vertices": (
        lambda f: rewrite(f / "mesh.npz", vertices=lambda a: a[:, :2]),
        r"mesh\.npz: vertices: wanted 3 columns, got 2",
    ),
    "a triangle of no vertex": (
        lambda f: rewrite(f / "mesh.npz", triangles=lambda a: a - 1),
        r"mesh\.npz: triangles: wanted indices",
    ),
    "half a part": (
        lambda f: edit(f / "face.toml", "skin = [0,", "skin = ["),
        r"face\.toml: parts: skin: wanted \[first, last \+ 1\]",
    ),
    "no left eye": (
        lambda f: edit(f / "face.toml", "left_eye =", "other ="),
        r"face\.toml: parts: wanted 'left_eye', got none",
    ),
}


@pytest.mark.parametrize("name", UNUSABLE)
def test_load_face_refuses_what_cannot_be_drawn(folder: Path, name: str) -> None:
    spoil, words = UNUSABLE[name]
    spoil(folder)
    with pytest.raises(FaceError, match=words):
        load_face("broken", folder.parent)


def test_load_face_refuses_a_model_with_an_unknown_unit(folder: Path) -> None:
    edit(folder / "au_extended.toml", "[degrees]", "[degrees]\nAU99 = 3.0")
    with pytest.raises(FaceError, match=r"au_extended\.toml: \[AU99\]: there is no such unit"):
        load_face("broken", folder.parent, "au")


def test_check_command_does_not_advise_to_check(folder: Path) -> None:
    BROKEN["a deformer that there is not"][0](folder)
    assert not any("run realizer faces check" in fault for fault in faults(folder))


@pytest.mark.slow
def test_list_faces_leaves_out_damaged_faces_alone(folder: Path) -> None:
    (folder / "face.toml").write_text("name = 3\n")
    ran = CliRunner(env={"REALIZER_FACES": str(folder.parent)})
    listed = ran.invoke(faces, ["list"])
    assert listed.exit_code == 0
    assert "Ada, a woman" in listed.output
    assert "broken: cannot be read; run realizer faces check broken" in listed.output
    checked = ran.invoke(faces, ["check"], standalone_mode=False)
    assert checked.return_value == 1
    assert 'face.toml: wanted name = "...", got 3' in checked.output


def test_check_command_takes_the_path_of_an_import(folder: Path) -> None:
    (folder / "mesh.npz").unlink()
    checked = CliRunner().invoke(faces, ["check", str(folder)], standalone_mode=False)
    assert checked.return_value == 1
    assert "mesh.npz: wanted this file, found none" in checked.output
    with pytest.raises(FaceError, match=r"mesh\.npz: wanted this file, found none"):
        load_face(str(folder))


@pytest.mark.slow
def test_check_command_without_a_name_checks_every_face(folder: Path) -> None:
    (folder / "mesh.npz").unlink()
    ran = CliRunner(env={"REALIZER_FACES": str(folder.parent)}).invoke(
        faces, ["check"], standalone_mode=False
    )
    assert ran.return_value == 1
    assert "ada: sound" in ran.output
    assert "mesh.npz" in ran.output


def test_check_names_maps_that_are_no_pictures(folder: Path) -> None:
    with np.load(folder / "mesh.npz") as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(folder / "mesh.npz", **arrays | {"uv": np.zeros((len(arrays["triangles"]), 3, 2), np.uint16)})
    Image.new("RGBA", (7, 5)).save(folder / "albedo.webp")
    (folder / "surface.webp").write_bytes(b"RIFF")
    (found,) = faults(folder)
    assert found.startswith(f"{folder / 'surface.webp'}: wanted a picture")
