"""The action units of the Face tab: markers, fits to markers that were moved, and what is saved of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer.face.au.deformer import LIDS
from realizer.face.deform import deform
from realizer.face.load import load_folder
from realizer_studio.editors.face import unit_fits
from tests.bare_heads import bare_head
from tests.realizer_studio.editors.face.test_studio import Asking

SMILE = 12


@pytest.fixture(scope="module")
def ada(tmp_path_factory):  # type: ignore[no-untyped-def]
    """A studio with a face, the description of its head, and its smile."""
    asking = Asking(tmp_path_factory.mktemp("edit"))
    head = asking("open", face="ada")
    yield asking, head, asking("unit", au=SMILE, setup=head["setup"])
    asking.studio.close()


def further(rows: list[list[float]], factor: float, count: int = 99) -> list[list[float]]:
    """Markers of which the first ones go further."""
    return [[*row[:3], *(factor * x for x in row[3:])] if k < count else row for k, row in enumerate(rows)]


def moves(folder: Path, *names: str) -> Any:
    """How far a face with its model moves by action units and sides, (n_vertices, 3) metres."""
    face = load_folder.__wrapped__(folder, "au")
    row = np.zeros((1, len(face.inputs)), np.float32)
    row[0, [face.inputs.index(name) for name in names]] = 1
    return deform(face, row)[0] - face.vertices


def test_unit_has_markers_where_the_face_moves(ada) -> None:  # type: ignore[no-untyped-def]
    _, head, smile = ada
    rows, field = np.array(smile["markers"]), smile["field"].reshape(-1, 3)
    assert rows.shape == (unit_fits.MARKERS, 6)
    assert (rows[:, 0] >= 0).all()
    assert np.abs(field[head["parts"]["shirt"][0] :]).max() == 0
    corner = rows[rows[:, 4].argmax()]
    assert corner[3] > 0.002, "a smile draws the corner outwards"
    assert corner[4] > 0.004, "and up"


# Units of the brows: elsewhere teeth push the lips, eyeballs the lids, and the jaw turns.
@pytest.mark.parametrize("au", [1, 4])
def test_unit_shows_what_the_face_with_its_model_shows(ada, au: int) -> None:  # type: ignore[no-untyped-def]
    asking, head, _ = ada
    shown = moves(asking.studio._head, f"{au}L", f"{au}R")
    field = asking("unit", au=au, setup=head["setup"])["field"].reshape(-1, 3)
    skin = slice(*head["parts"]["skin"])
    assert np.abs(shown[skin] - field[skin]).max() < 1e-6


def test_unit_follows_markers_that_were_moved(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head, smile = ada
    rows = further(smile["markers"], 1.5)
    bigger = asking("unit", au=SMILE, setup=head["setup"], markers=rows)
    before, after = (np.abs(one["field"]).max() for one in (smile, bigger))
    assert 1.2 * before < after < 1.6 * before
    assert np.allclose(bigger["markers"], rows, atol=1e-6)
    assert bigger["errors"]["e"] < 0.2 * bigger["errors"]["d_max"]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"au": 99}, "au: wanted one of 1, 2, 4"),
        ({"au": None}, "au: wanted one of"),
        ({"au": [12]}, "au: wanted one of"),
        ({"au": 12, "markers": [[0, 0, 0, 0, 0, 0]] * 3}, "wanted 8 to 200 markers of six numbers"),
        ({"au": 12, "markers": "all"}, "wanted 8 to 200 markers of six numbers, got all"),
        ({"au": 12, "markers": [[0, 0, 0, 0, 0, None]] * 9}, "wanted 8 to 200 markers of six numbers"),
        ({"au": 12, "markers": [[0, 0, 0, 0, 0, float("nan")]] * 9}, "wanted 8 to 200 markers of six"),
        ({"au": 12, "markers": [[0, 0, 0, 0, 0, 0]] * 9}, "wanted markers of which one moves"),
        ({"au": 12, "markers": [[0, 0, 0, 0, 1, 0]] * 9}, "marker 1 moves 1000.0 mm"),
        ({"au": 12, "markers": {"a": 1}}, "wanted 8 to 200 markers of six numbers"),
    ],
)  # fmt: skip
def test_unit_says_what_it_wanted(ada, fields: dict[str, Any], words: str) -> None:  # type: ignore[no-untyped-def]
    asking, head, _ = ada
    assert words in asking("unit", setup=head["setup"], **fields)["error"]


def test_unit_of_a_face_without_shapes_begins_with_its_faps(tmp_path: Path) -> None:
    asking = Asking(tmp_path)
    name, data = "bare.glb", bare_head(tmp_path / "bare.glb").read_bytes()
    head = asking("import", data, name=name)
    jaw = asking("unit", au=27, setup=head["setup"])
    assert len(jaw["markers"]) >= unit_fits.FEWEST
    assert jaw["field"].reshape(-1, 3)[:, 1].min() < -0.01, "the mouth opens"
    asking.studio.close()


def test_lids_of_a_unit_slide_over_the_eyeballs(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head, smile = ada
    assert not smile["lids"]
    for au in LIDS:
        assert asking("unit", au=au, setup=head["setup"])["lids"]


def test_edited_units_are_saved_and_opened_again(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head, smile = ada
    rows = further(smile["markers"], 1.4)
    saved = asking("save", name="smiler", setup=head["setup"], keep=True, units={str(SMILE): rows})
    assert saved["saved"] == "faces/smiler"
    folder = asking.studio._edit / "smiler"
    before = moves(asking.studio._head, f"{SMILE}L")
    after = moves(folder, f"{SMILE}L")
    assert 1.15 * np.abs(before).max() < np.abs(after).max() < 1.5 * np.abs(before).max()
    assert np.allclose(moves(folder, "1L"), moves(asking.studio._head, "1L"), atol=1e-6)
    again = Asking(asking.studio._edit.parent)
    opened = again("open", face="smiler")
    smile = again("unit", au=SMILE, setup=opened["setup"])
    assert np.allclose(np.abs(smile["field"]).max(), np.abs(after).max(), rtol=0.1)
    again.studio.close()


def test_bad_markers_save_nothing(ada) -> None:  # type: ignore[no-untyped-def]
    asking, head, _ = ada
    for units, words in (({"12": [[1, 2]]}, "AU12: wanted"), ({"99": []}, "au: wanted")):
        answer = asking("save", name="torn", setup=head["setup"], keep=True, units=units)
        assert words in answer["error"]
        assert not (asking.studio._edit / "torn").exists()
