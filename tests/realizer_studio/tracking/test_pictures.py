"""Tests of readers of films and pictures."""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import RealizerError
from realizer_studio.tracking.network import TrackingError
from realizer_studio.tracking.pictures import LARGEST, read_pictures


def write_film(path: Path, times: list[int], codec: str = "libx264") -> Path:
    """Write a film of grey pictures at times in 1/100 s; of rising brightness."""
    av = pytest.importorskip("av", reason="needs the film extra")
    from fractions import Fraction

    with av.open(str(path), "w") as file:
        stream = file.add_stream(codec, rate=100)
        stream.width, stream.height, stream.pix_fmt = 96, 64, "yuv420p"
        stream.codec_context.time_base = stream.time_base = Fraction(1, 100)
        for k, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(np.full((64, 96, 3), 10 * k % 256, np.uint8))
            frame.pts, frame.time_base = time, Fraction(1, 100)
            file.mux(stream.encode(frame))
        file.mux(stream.encode())
    return path


def test_pictures_of_a_film_have_its_own_times(tmp_path: Path) -> None:
    count, pictures = read_pictures(write_film(tmp_path / "film.mp4", [0, 4, 8, 20, 50]))
    found = list(pictures)
    assert count == 5
    assert [picture.time for picture in found] == pytest.approx([0, 0.04, 0.08, 0.2, 0.5])
    assert found[4].image.size == (96, 64)


def test_a_film_that_is_cut_gives_what_came_before(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = write_film(tmp_path / "film.mkv", list(range(0, 400, 4)), "mpeg4")
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    _, pictures = read_pictures(path)
    assert 10 < len(list(pictures)) < 100


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("film.mp4", b"no film", "wanted a film or a picture, got: "),
        ("face.jpg", b"no picture", "wanted a picture, got: "),
        (
            "talk.wav",
            b"RIFF\x24\0\0\0WAVEfmt \x10\0\0\0\1\0\1\0@\x1f\0\0\x80>\0\0\2\0\x10\0data\0\0\0\0",
            "wanted a film",
        ),
    ],
)
def test_what_is_no_film_is_refused_with_its_name(
    tmp_path: Path, name: str, content: bytes, said: str
) -> None:
    pytest.importorskip("av", reason="needs the film extra")
    (tmp_path / name).write_bytes(content)
    with pytest.raises(TrackingError, match=f"{name}: .*{said}"):
        list(read_pictures(tmp_path / name)[1])


def test_a_film_that_is_damaged_in_the_middle_keeps_its_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = write_film(tmp_path / "film.mp4", list(range(0, 400, 4)))
    content = bytearray(path.read_bytes())
    begin = content.index(b"mdat") + 4
    length = int.from_bytes(content[begin - 8 : begin - 4], "big")
    content[begin + length // 2 : begin + length * 3 // 4] = bytes(length * 3 // 4 - length // 2)
    path.write_bytes(content)
    found = [picture.time for picture in read_pictures(path)[1]]
    assert found[0] == 0
    assert found[-1] == pytest.approx(3.96)
    assert "parts of it are broken" in caplog.text


def test_a_film_that_ends_early_is_warned_of(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = write_film(tmp_path / "film.mkv", list(range(0, 400, 4)), "mpeg4")
    list(read_pictures(path)[1])
    assert caplog.text == ""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    list(read_pictures(path)[1])
    assert "film.mkv: its pictures end at" in caplog.text


def test_a_film_of_an_unknown_codec_is_refused(tmp_path: Path) -> None:
    path = write_film(tmp_path / "film.mkv", [0, 4], "mpeg4")
    path.write_bytes(path.read_bytes().replace(b"V_MPEG4/ISO/ASP", b"V_QQQQQ/ISO/ASP"))
    with pytest.raises(TrackingError, match=r"film\.mkv: .*got an unknown codec: .*; convert it to H\.264"):
        list(read_pictures(path)[1])


def test_an_empty_film_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("av", reason="needs the film extra")
    (tmp_path / "film.mp4").touch()
    with pytest.raises(TrackingError, match=r"film\.mp4: .*got an empty file"):
        read_pictures(tmp_path / "film.mp4")


def test_a_broken_picture_of_a_folder_is_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    for k in (1, 2, 3):
        Image.new("RGB", (20, 20)).save(tmp_path / f"{k}.png")
    (tmp_path / "2.png").write_bytes(b"no picture")
    assert [picture.time for picture in read_pictures(tmp_path, 10)[1]] == [0.0, 0.2]
    assert "2.png: wanted a picture" in caplog.text
    for k in (1, 3):
        (tmp_path / f"{k}.png").write_bytes(b"no picture")
    with pytest.raises(TrackingError, match=r"3\.png"):
        list(read_pictures(tmp_path)[1])


def test_an_empty_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TrackingError, match="wanted a folder of pictures"):
        read_pictures(tmp_path)


def test_pictures_of_a_folder_are_ordered_by_number(tmp_path: Path) -> None:
    for k in (1, 2, 10):
        Image.new("L", (20, 20), 20 * k).save(tmp_path / f"{k}.png")
    (tmp_path / "notes.txt").write_text("none")
    count, pictures = read_pictures(tmp_path, 10)
    found = [(picture.time, picture.image.getpixel((0, 0))) for picture in pictures]
    assert count == 3
    assert found == [(0.0, (20, 20, 20)), (0.1, (40, 40, 40)), (0.2, (200, 200, 200))]


def test_a_photograph_is_turned_and_reduced(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x112] = 6  # turn by 90 degrees
    Image.new("RGB", (4000, 3000)).save(tmp_path / "large.jpg", exif=exif)
    _, (picture,) = read_pictures(tmp_path / "large.jpg")
    assert picture.image.size[1] == LARGEST
    assert picture.image.size[0] < LARGEST


def test_pictures_of_grey_and_glass_become_rgb(tmp_path: Path) -> None:
    Image.fromarray(np.full((8, 8), 51400, np.uint16)).save(tmp_path / "grey.png")
    Image.new("RGBA", (8, 8), (255, 0, 0, 0)).save(tmp_path / "glass.png")
    for name, colour in (("grey", (200, 200, 200)), ("glass", (0, 0, 0))):
        _, (picture,) = read_pictures(tmp_path / f"{name}.png")
        assert picture.image.getpixel((0, 0)) == pytest.approx(colour, abs=1)


def test_films_need_pyav(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "film.mp4").touch()
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(RealizerError, match="pip install"):
        read_pictures(tmp_path / "film.mp4")


def test_a_film_that_a_telephone_took_upright_is_turned(tmp_path: Path) -> None:
    path = write_film(tmp_path / "film.mp4", [0, 4])
    content = path.read_bytes()
    at = content.index(
        struct.pack(">9i", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30), content.index(b"tkhd")
    )
    turned = struct.pack(">9i", 0, 1 << 16, 0, -1 << 16, 0, 0, 64 << 16, 0, 1 << 30)
    path.write_bytes(content[:at] + turned + content[at + len(turned) :])
    _, pictures = read_pictures(path)
    assert next(pictures).image.size == (64, 96)
