"""Tests of the result of `realizer.realize`."""

import base64
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import realizer
from realizer.core.errors import RealizerError
from realizer.outputs.registry import OUTPUTS

BML = '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="0" end="1"/></bml>'


@pytest.fixture(scope="module")
def played() -> realizer.Realization:
    return realizer.realize(BML, idle=False)


@pytest.mark.parametrize("suffix", [s for s, output in OUTPUTS.items() if not output.needs])
def test_save_writes_every_suffix_and_returns_the_path(
    played: realizer.Realization, tmp_path: Path, suffix: str
) -> None:
    path = played.save(str(tmp_path / f"x{suffix}"))
    assert path == tmp_path / f"x{suffix}"
    assert path.stat().st_size or suffix == ".srt"  # nobody speaks


@pytest.mark.gl
@pytest.mark.slow
def test_save_draws_with_camera_light_and_size(played: realizer.Realization, tmp_path: Path) -> None:
    path = played.save(tmp_path / "x.png", at=0.5, camera="profile", light="studio", size=(64, 48))
    with Image.open(path) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    assert pixels.shape == (48, 64, 3)
    assert (pixels == played.picture(0.5, camera="profile", light="studio", size=(64, 48))).all()


@pytest.mark.gl
def test_picture_shows_an_instant(played: realizer.Realization) -> None:
    rest, smile = (played.picture(at=at, size=(64, 48)) for at in (0.0, 0.5))
    assert rest.shape == (48, 64, 3)
    assert rest.dtype == np.uint8
    assert (rest != smile).any()
    assert played.picture(0.5, size=(32, 32), background="transparent").shape == (32, 32, 4)


@pytest.mark.parametrize(
    ("file", "options", "words"),
    [
        ("x.foo", {}, "wanted a suffix of"),
        ("x", {}, "got none"),
        ("x.png", {"camera": "frnt"}, "camera: wanted one of front"),
        ("x.mp4", {"light": "noon"}, "light: wanted one of portrait"),
        ("x.png", {"at": 9}, r"at: wanted 0\.\.1\.00 s, got 9"),
        ("x.fap", {"at": 0.5}, r"at: wanted a \.png file"),
        ("x.glb", {"morphs": "vrm"}, "morphs: wanted fap or arkit"),
        ("x.wav", {"visemes": True}, r"visemes: wanted a \.fap file"),
        ("x.mp4", {"background": "transparent"}, "background: wanted a colour"),
        ("x.png", {"size": (2, 2)}, "size: wanted"),
    ],
)
def test_save_refuses_what_does_not_suit(
    played: realizer.Realization, tmp_path: Path, file: str, options: dict[str, object], words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        played.save(tmp_path / file, **options)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("options", [{"size": "64x64"}, {"camera": 3}, {"at": "1"}, {"light": 5}])
def test_save_refuses_other_types(
    played: realizer.Realization, tmp_path: Path, options: dict[str, object]
) -> None:
    with pytest.raises(TypeError, match=f"{next(iter(options))}: wanted"):
        played.save(tmp_path / "x.png", **options)  # type: ignore[arg-type]


def test_save_reports_a_missing_folder(played: realizer.Realization, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="nowhere"):
        played.save(tmp_path / "nowhere" / "x.fap")


def test_save_writes_nothing_if_no_block_plays(tmp_path: Path) -> None:
    failed = realizer.realize('<bml id="b"><required><head id="h"/></required></bml>')
    with pytest.raises(RealizerError, match="not written, as no block plays: "):
        failed.save(tmp_path / "x.fap")
    assert not list(tmp_path.iterdir())


def test_repr_is_one_line(played: realizer.Realization) -> None:
    assert repr(played) == "<Realization of b: 1.00 s, 26 frames at 25 fps, face ada>"
    text = "".join(f"<bml id='{k}'><head id='h' lexeme='NOD' amount='7'/></bml>" for k in "abcd")
    assert re.search(
        r"of a, b, c and 1 more: .*; 4 warnings; nothing is heard or moves>", repr(realizer.realize(text))
    )


@pytest.mark.gl
@pytest.mark.long
@pytest.mark.slow
def test_repr_html_has_a_sheet_a_timeline_and_a_player(played: realizer.Realization) -> None:
    shown = played._repr_html_()
    sheet, film = (base64.b64decode(d) for d in re.findall(r'src="data:[a-z0-9/]+;base64,([^"]+)"', shown))
    assert sheet.startswith(b"\x89PNG")
    assert film[4:8] == b"ftyp"
    assert "<video controls" in shown
    assert "Timeline of b" in shown
