"""Everything that ships has a licence, and one file names all of them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests import licences

pytestmark = pytest.mark.skipif(
    not licences.FILE.is_file() or not (licences.ROOT / ".git").exists() or not shutil.which("git"),
    reason="the list of files is in the checkout alone",
)


def test_licences_file_is_what_the_script_writes() -> None:
    found, _, page = licences.FILE.read_text("utf-8").partition(f"\n{licences.PAGE}")
    assert found == licences.text(), "python -m tests.licences"
    assert "## three" in page
    if (licences.WEB / "node_modules").is_dir():
        assert f"\n{licences.PAGE}{page}" == licences.page(), "python -m tests.licences"


def test_licences_refuse_a_file_that_names_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(licences, "shipped", lambda: ["realizer/tables/other.npz"])
    with pytest.raises(ValueError, match=r"other\.npz"):
        licences.text()


def test_licences_refuse_a_table_without_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "mine.csv").write_text("# source: mine\na,b\n")
    monkeypatch.setattr(licences, "ROOT", tmp_path)
    monkeypatch.setattr(licences, "shipped", lambda: ["mine.csv"])
    with pytest.raises(ValueError, match=r"mine\.csv: wanted a line `# licence"):
        licences.text()
