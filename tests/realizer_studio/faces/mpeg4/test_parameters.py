"""Tests of the file of the MPEG-4 deformer's parameters."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.face.load import folder_of
from realizer_studio.faces.mpeg4.parameters import read_setup, write_setup
from realizer_studio.faces.mpeg4.zone_build import setup_of


def test_read_setup_returns_what_write_setup_wrote(tmp_path: Path) -> None:
    setup = setup_of(folder_of("default"))
    write_setup(tmp_path / "one.toml", setup)
    again = read_setup(tmp_path / "one.toml")
    write_setup(tmp_path / "two.toml", again)
    assert (tmp_path / "one.toml").read_text() == (tmp_path / "two.toml").read_text()
    assert again.synced == setup.synced
    assert {fap: mask.tolist() for fap, mask in again.masks.items()} == {
        fap: mask.tolist() for fap, mask in setup.masks.items()
    }
    for fap, zone in setup.zones.items():
        assert again.zones[fap].radii == pytest.approx(zone.radii, rel=1e-6)


def test_read_setup_returns_points(tmp_path: Path) -> None:
    (tmp_path / "points.toml").write_text('[points]\n"2.1" = [0, -0.1, 0.02]\n')
    assert read_setup(tmp_path / "points.toml").points == {"2.1": (0, -0.1, 0.02)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("zone = 3", "zone: wanted a list, got 3"),
        ("zones = []", "wanted joined, synced, whole, points, zone, masks; got zones"),
        ('[[zone]]\nfap = 31\nfalloff = "cosine"', "zone 1: size is missing"),
        ('[[zone]]\nfap = 31\nfalloff = "cosine"\nsize = "x"', "zone 1: size: wanted a number, got 'x'"),
        ('[[zone]]\nfap = 31\nfalloff = "cosine"\nsize = 1\nscale = [1]', "scale: wanted three numbers"),
        ('[[zone]]\nfap = 2\nfalloff = "cosine"\nsize = 1', "wanted a FAP from 3 to 68"),
        ('[masks]\n"4 x" = "1-3"', "wanted a FAP's number, got 'x'"),
        ('[[zone]]\nfap = inf\nfalloff = "cosine"\nsize = 1', "wanted a FAP's number, got inf"),
        ('[masks]\n"4" = "1-b"', "wanted ranges such as '3-5 9', got '1-b'"),
        ('[masks]\n"4" = "5-99999999999"', "wanted ranges such as '3-5 9', got '5-99999999999'"),
        ('[masks]\n"4" = "5-3"', "wanted ranges such as '3-5 9', got '5-3'"),
        ('[masks]\n"4" = "-3"', "wanted ranges such as '3-5 9', got '-3'"),
        ('[[zone]]\nfap = 31\nfalloff = "x"\nsize = 1', "zone 1: zone of FAP 31: falloff: wanted one of"),
        ("a = ", "Invalid value"),
    ],
)
def test_read_setup_names_what_is_wrong(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "mpeg4.toml"
    path.write_text(text)
    with pytest.raises(FaceError) as raised:
        read_setup(path)
    assert message in str(raised.value)
    assert str(path) in str(raised.value)
