"""Tests of the fit of a model of action units to landmarks."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.au.file import read_model
from realizer.face.au.model import Model
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer_studio.faces.au.measure import read_measurements, read_shapes
from realizer_studio.faces.au.unit_fit import fit_models, left_out_text, table, table_text

pytestmark = pytest.mark.xdist_group("fits")

HEAD = "# source: made for tests\n# units: metres\n# licence: MIT\nau,x,y,z,dx,dy,dz\n"


@pytest.fixture(scope="module")
def known() -> Model:
    path = next(info.path for info in list_faces() if info.name == load_face().name)
    return read_model(path / "au_published.toml")


def landmarks(model: Model, aus: tuple[int, ...], count: int = 120) -> str:
    """A measurements file: what the model does to landmarks on the left half of the face, as hers were."""
    first, last = load_face().parts["skin"]
    skin = load_face().vertices[first:last].astype(np.float64)
    front = skin[(skin[:, 0] >= 0) & (skin[:, 2] > -0.03) & (skin[:, 1] > -0.11)]
    lines = []
    for au in aus:
        moves = model.displacement(au, front)
        long = np.linalg.norm(moves, axis=1)
        order = np.argsort(-long)
        some = np.r_[order[: 4 * count : 4], order[4 * count :: 12]]
        lines += [f"{au}," + ",".join(f"{v:.6f}" for v in (*front[i], *moves[i])) for i in some]
    return HEAD + "\n".join(lines) + "\n"


@pytest.mark.slow
def test_fit_models_recovers_a_published_unit(known: Model, tmp_path: Path) -> None:
    path = tmp_path / "landmarks.csv"
    path.write_text(landmarks(known, (1, 15), 60))
    measured = read_measurements(path)
    lines: list[str] = []
    model = fit_models(load_face(), measured, ("published",), lines.append)["published"]
    rows = table(model, measured)
    assert [row.au for row in rows] == [1, 15]
    assert max(row.ratio for row in rows) < 0.02, table_text(rows)
    assert [line.split(":")[0] for line in lines] == ["AU1", "AU15"]
    # Only one side was measured; the other follows.
    corner = np.asarray(load_face().points["8.4"], np.float64)[None]
    assert model.displacement(15, corner) == pytest.approx(known.displacement(15, corner), abs=5e-4)


def test_table_text_prints_wojdel_s_columns(known: Model) -> None:
    measured = read_shapes(next(i.path for i in list_faces() if i.name == load_face().name) / "au_shapes.npz")
    rows = table(known, measured)
    text = table_text(rows)
    assert text.splitlines()[0].split() == ["AU", "n", "d", "d_max", "e", "e_max", "e/d_max", "e_max/d_max"]
    assert len(text.splitlines()) == 24
    for row in rows:
        assert row.e <= row.e_max
        assert row.d <= row.d_max
        assert row.n > 100


@pytest.mark.long
@pytest.mark.slow
def test_fit_models_come_nearer_with_more_gaussians() -> None:
    folder = next(info.path for info in list_faces() if info.name == load_face().name)
    measured = {1: read_shapes(folder / "au_shapes.npz")[1]}
    models = fit_models(load_face(), measured)
    (few,), (many,) = (table(models[form], measured) for form in ("published", "extended"))
    assert many.ratio < 0.95 * few.ratio
    assert len(models["extended"].units[1].motions["whole"].gaussians) <= 4


@pytest.mark.long
@pytest.mark.slow
def test_fit_command_fits_landmarks_and_prints_the_table(known: Model, tmp_path: Path) -> None:
    (tmp_path / "landmarks.csv").write_text(landmarks(known, (2,), 30))
    command = [sys.executable, "-m", "realizer", "faces", "fit", "default", "--from", "landmarks.csv"]
    done = subprocess.run(
        [*command, "--form", "published", "-o", "mine.toml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "AU2" in done.stdout
    assert "e/d_max" in done.stdout
    assert "1/1 AU2" in done.stderr
    assert "published: e/d_max 0.0" in done.stdout.splitlines()[-1]
    assert done.stdout.splitlines()[-1].endswith("on landmarks left out")
    assert set(read_model(tmp_path / "mine.toml").units) == {2}


@pytest.mark.slow
def test_left_out_text_warns_of_more_figures_than_measurements(known: Model, tmp_path: Path) -> None:
    lines = landmarks(known, (2,), 4).splitlines(keepends=True)
    (tmp_path / "few.csv").write_text("".join(lines[: HEAD.count("\n") + 8]))
    measured = read_measurements(tmp_path / "few.csv")
    said = left_out_text(load_face(), measured, {"published": known})
    assert re.search(r"AU2 .*on landmarks left out; \d+ figures for \d+ numbers, measure more", said), said


@pytest.fixture(scope="module")
def fitted(known: Model, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Model]]:
    """Landmarks of one unit, and a model of them that serves as either form."""
    path = tmp_path_factory.mktemp("fit") / "landmarks.csv"
    path.write_text(landmarks(known, (2,), 30))
    model = fit_models(load_face(), read_measurements(path), ("published",))["published"]
    return path, {"published": model, "extended": model}


@pytest.mark.parametrize(
    ("words", "files"),
    [
        ([], ["au_published.toml", "au_extended.toml"]),
        (["--form", "extended"], ["au_extended.toml"]),
        (["--form", "both"], ["au_published.toml", "au_extended.toml"]),
    ],
)
@pytest.mark.slow
def test_fit_command_writes_a_file_for_each_form(
    fitted: tuple[Path, dict[str, Model]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    files: list[str],
) -> None:
    from click.testing import CliRunner

    from realizer_studio.cli.fit_face import fit_face

    path, models = fitted

    def fit_again(face: Face, measured: object, forms: tuple[str, ...], *_: object) -> dict[str, Model]:
        return {form: models[form] for form in forms}

    monkeypatch.setattr("realizer_studio.faces.au.unit_fit.fit_models", fit_again)
    monkeypatch.setattr("realizer_studio.faces.au.unit_fit.left_out_text", lambda *_: "")  # fits again
    given = ["default", "--from", str(path), "-o", str(tmp_path)]
    done = CliRunner().invoke(fit_face, [*given, *words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert sorted(file.name for file in tmp_path.glob("*.toml")) == sorted(files)


@pytest.mark.parametrize("output", ["mine.toml", "nowhere"])
def test_fit_command_needs_a_folder_for_two_forms(tmp_path: Path, output: str) -> None:
    from click.testing import CliRunner

    from realizer_studio.cli.fit_face import fit_face

    done = CliRunner().invoke(fit_face, ["default", "--form", "both", "-o", str(tmp_path / output)])
    assert done.exit_code == 2
    assert "wanted a folder" in done.output


def test_fit_command_asks_for_data_without_shapes(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from realizer_studio.cli.fit_face import fit_face

    folder = next(info.path for info in list_faces() if info.name == load_face().name)
    copy = Path(shutil.copytree(folder, tmp_path / "bare"))
    (copy / "au_shapes.npz").unlink()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("REALIZER_FACES", str(tmp_path))
        done = CliRunner().invoke(fit_face, ["bare", "-o", str(tmp_path / "model.toml")])
    assert isinstance(done.exception, FaceError)
    assert "--from" in str(done.exception)
    assert not (tmp_path / "model.toml").exists()


def test_fit_models_refuses_an_unknown_form() -> None:
    with pytest.raises(FaceError, match="published, extended"):
        fit_models(load_face(), {}, ("secret",))
