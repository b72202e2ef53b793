"""Tests of `realizer faces`."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from realizer import tables
from realizer.cli.faces import mapping
from realizer.face.load import list_faces
from realizer.tables.mappings import read_mapping
from tests.commands import run

IMPORTER = "realizer_studio.faces.arkit.importer"
PHOTO_BUILD = "realizer_studio.faces.photo.photo_build.build_from_photographs"


def test_faces_list_has_a_line_for_each_face_with_its_licence() -> None:
    lines = run("faces", "list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == [face.name for face in list_faces()]
    assert all(f"[{face.licence}]" in line for face, line in zip(list_faces(), lines, strict=True))


def test_faces_list_names_what_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "face.toml").write_text("name = 3\n")
    monkeypatch.setenv("REALIZER_FACES", str(tmp_path))
    done = run("faces", "list")
    assert done.returncode == 0
    assert "broken: cannot be read; run realizer faces check broken" in done.stderr


def test_mapping_prints_the_text_form() -> None:
    said = CliRunner().invoke(mapping, ["ada"])
    assert said.exit_code == 0
    assert said.stdout.startswith("# AU to FAP: ada: au_to_fap.csv\n")
    assert "# Lip corner puller\n12\tL\n" in said.stdout
    assert "# Head forward; FAPs turn the head and do not move it\n57\n" in said.stdout


@pytest.mark.parametrize("form", ["txt", "csv"])
def test_mapping_writes_the_table_with_the_users_rows(tmp_path: Path, form: str) -> None:
    (tmp_path / "mine.txt").write_text("26\n3 0 1 0 111\n", "utf-8")
    asked = ["ada", "-o", str(tmp_path / f"all.{form}"), "--mapping", str(tmp_path / "mine.txt")]
    said = CliRunner().invoke(mapping, asked)
    assert said.exit_code == 0, said.output
    units = read_mapping(tmp_path / f"all.{form}")
    assert [(row.fap, row.fap_to) for row in units[26, ""]] == [(3, 111)]
    others = sorted((row for (au, _), unit in units.items() for row in unit if au != 26), key=repr)
    assert others == sorted((row for row in tables.au_to_fap() if row.au != 26), key=repr)


def test_mapping_refuses_an_unknown_suffix(tmp_path: Path) -> None:
    said = CliRunner().invoke(mapping, ["ada", "-o", str(tmp_path / "all.xml")])
    assert said.exit_code == 2
    assert "wanted a name that ends in .txt or .csv" in said.output
