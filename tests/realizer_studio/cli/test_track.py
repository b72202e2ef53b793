"""Tests of `realizer track`."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from realizer import realize
from realizer.animation.fap.fap_reader import read_fap
from realizer.cli import cli
from realizer.emotions.archetypes import archetypes
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer_studio.cli.track import Numbers, follow_markers, marker_settings
from tests.mesh_features import points_of
from tests.painted import acted as moved
from tests.painted import plain, truth
from tests.portraits import LITERT, faps_of, portrait


def run(*args: str) -> Result:
    return CliRunner().invoke(cli, ["track", *args])


def acted(path: Path, leave_out: tuple[str, ...] = ()) -> np.ndarray:
    """Writes what a tracker would see of a face that gets sad and turns its head; returns its FAPs."""
    face = load_face("ada")
    part = np.linspace(0, 1, 6, dtype=np.float32)[:, None]
    frames = part * archetypes("published")["sadness"][0].frame()
    frames[:, 48] = part[:, 0] * 10000
    points = points_of(face, deform(face, frames))
    lines = ["frame,point,x,y,z"]
    for name, way in points.items():
        if name not in leave_out:
            lines += [f"{k},{name},{x:.7f},{y:.7f},{z:.7f}" for k, (x, y, z) in enumerate(way) if k != 3]
    path.write_text("\n".join(lines) + "\n")
    return frames


def test_track_writes_a_fap_file_and_names_the_emotion(tmp_path: Path) -> None:
    frames = acted(tmp_path / "actor.csv")
    done = run(
        str(tmp_path / "actor.csv"), "--fps", "5", "-o", str(tmp_path / "a.fap"), "--profiles", "published"
    )
    assert done.exit_code == 0, done.output
    clip = read_fap((tmp_path / "a.fap").read_text())
    assert (clip.fps, len(clip.values)) == (5, 6)
    moved = [19, 20, 21, 22, 31, 32]
    # Frame 3 was lost, and lies between its neighbours.
    assert np.abs(clip.values[:, [n - 1 for n in moved]] - frames[:, [n - 1 for n in moved]]).max() <= 2
    assert np.abs(clip.values[:, 48] - frames[:, 48]).max() < 150
    assert done.stdout.splitlines()[0].split()[::2] == ["0.00", "neutral"]
    assert done.stdout.splitlines()[-1].split()[2] == "sadness"


def test_track_names_emotions_by_a_profile_file(tmp_path: Path) -> None:
    acted(tmp_path / "actor.csv")
    profile = archetypes("published")["sadness"][0]
    (tmp_path / "mine.txt").write_text(f"Gloom 0\n{profile}\n")
    options = ["--fps", "5", "-o", str(tmp_path / "a.fap"), "--profiles", str(tmp_path / "mine.txt")]
    done = run(str(tmp_path / "actor.csv"), *options)
    assert done.stdout.splitlines()[-1].split()[2] == "gloom", done.output


@pytest.mark.parametrize(
    ("leave_out", "output", "said"),
    [
        (("9.15",), "a.fap", "wanted point 9.15 in frame 0, to measure the face's proportions"),
        ((), "a.png", "a.png: wanted a name that ends in .fap"),
    ],
)
def test_track_refuses_missing_points_and_other_suffixes(
    tmp_path: Path, leave_out: tuple[str, ...], output: str, said: str
) -> None:
    acted(tmp_path / "actor.csv", leave_out)
    done = run(str(tmp_path / "actor.csv"), "-o", str(tmp_path / output))
    assert done.exit_code == 2
    assert said in " ".join(done.stderr.split())


def test_track_refuses_a_table_with_other_columns(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    done = run(str(tmp_path / "x.csv"), "-o", str(tmp_path / "x.fap"))
    assert done.exit_code == 2
    assert "wanted a first line frame,point,x,y,z, got 'a,b'" in " ".join(done.stderr.split())


def test_track_refuses_other_encodings_but_takes_a_byte_order_mark(tmp_path: Path) -> None:
    table = tmp_path / "actor.csv"
    table.write_bytes(b"frame,point,x,y,z\n0,\xe4,0,0,0\n")
    done = run(str(table), "-o", str(tmp_path / "a.fap"))
    assert done.exit_code == 2
    assert "actor.csv: wanted a table in UTF-8, got byte 0xE4 at 20" in " ".join(done.output.split())
    acted(table)
    table.write_bytes(b"\xef\xbb\xbf" + table.read_bytes())
    assert run(str(table), "-o", str(tmp_path / "a.fap")).exit_code == 0


@pytest.fixture(scope="module")
def smile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film of somebody who begins to smile."""
    av = pytest.importorskip("av", reason="needs the film extra")
    path = tmp_path_factory.mktemp("film") / "smile.mp4"
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 320, 320, "yuv420p"
        for strength in [0.0] * 5 + [0.9] * 7:
            picture = portrait("ben", faps_of("ben", AU12=strength) if strength else None)
            file.mux(stream.encode(av.VideoFrame.from_image(picture)))
        file.mux(stream.encode())
    return path


def rows_of(path: Path) -> list[dict[str, float]]:
    with path.open() as file:
        return [{name: float(cell) for name, cell in row.items() if cell} for row in csv.DictReader(file)]


@LITERT
@pytest.mark.gl("onboard")
def test_track_writes_the_action_units_of_a_film(smile: Path, tmp_path: Path) -> None:
    done = run(str(smile), "-o", str(tmp_path / "smile.csv"))
    assert done.exit_code == 0, done.output
    rows = rows_of(tmp_path / "smile.csv")
    assert [row["time"] for row in rows] == pytest.approx(np.arange(12) / 10)
    assert rows[1]["AU12L"] < 0.2
    assert rows[10]["AU12L"] > 0.5
    assert max(rows[10]["AU4L"], rows[10]["AU15L"]) < 0.3
    assert all(0 <= value <= 1 for row in rows for name, value in row.items() if name != "time")


@LITERT
@pytest.mark.gl("onboard")
def test_track_writes_a_document_that_plays_the_film_again(smile: Path, tmp_path: Path) -> None:
    for name in ("smile.bml", "smile.fap", "smile.json"):
        assert run(str(smile), "-o", str(tmp_path / name)).exit_code == 0
    clip = read_fap((tmp_path / "smile.fap").read_text())
    again = realize((tmp_path / "smile.bml").read_text(), fps=10, idle=False)
    assert again.warnings == ()
    assert len(clip.values) == 12
    assert again.faps.values[8, [11, 12]] == pytest.approx(clip.values[8, [11, 12]], abs=40)
    assert clip.values[10, 11] > 150
    content = json.loads((tmp_path / "smile.json").read_text())
    assert content["fap"]["values"][10][11] == clip.values[10, 11]
    assert content["frames"] == len(content["au"]["values"]) == 12


@LITERT
@pytest.mark.gl("onboard")
def test_track_reads_a_picture_against_a_neutral_one(tmp_path: Path) -> None:
    portrait("ada", faps_of("ada", AU4=0.9)).convert("L").save(tmp_path / "frown.png")
    portrait("ada").save(tmp_path / "rest.png")
    rest = ("--neutral", str(tmp_path / "rest.png"))
    assert run(str(tmp_path / "frown.png"), "-o", str(tmp_path / "x.csv"), *rest).exit_code == 0
    (row,) = rows_of(tmp_path / "x.csv")
    assert min(row["AU4L"], row["AU4R"]) > 0.4
    assert max(row["AU12L"], row["AU2L"]) < 0.3


@LITERT
@pytest.mark.gl("onboard")
def test_track_follows_one_of_two_people(tmp_path: Path) -> None:
    both = Image.new("RGB", (640, 320))
    both.paste(portrait("ada", faps_of("ada", AU12=1.0)), (0, 0))
    both.paste(portrait("ben").resize((280, 280)), (330, 20))
    both.save(tmp_path / "both.png")
    units = []
    for person in ("1", "2"):
        done = run(str(tmp_path / "both.png"), "-o", str(tmp_path / "x.csv"), "--person", person)
        assert "2 people" in done.stderr
        units.append(rows_of(tmp_path / "x.csv")[0]["AU12L"])
    assert units[0] > units[1] + 0.2
    done = run(str(tmp_path / "both.png"), "-o", str(tmp_path / "x.csv"), "--person", "3")
    assert done.exit_code == 2
    assert "there are 2 people" in " ".join(done.stderr.split())


@LITERT
def test_track_says_which_file_has_no_face(tmp_path: Path) -> None:
    Image.new("RGB", (200, 200), (90, 120, 70)).save(tmp_path / "meadow.png")
    done = run(str(tmp_path / "meadow.png"), "-o", str(tmp_path / "x.csv"))
    assert done.exit_code == 2
    assert "meadow.png: wanted a face, found none in 1 picture" in " ".join(done.stderr.split())
    assert not (tmp_path / "x.csv").exists()


@LITERT
@pytest.mark.gl("onboard")
def test_track_names_the_emotion_of_pictures(tmp_path: Path) -> None:
    folder = tmp_path / "pictures"
    folder.mkdir()
    joy = next(iter(archetypes("own")["joy"].values())).frame()
    for k in range(16):
        portrait("ida", joy if k > 7 else None).save(folder / f"{k}.png")
    done = run(
        str(folder), "-o", str(tmp_path / "x.fap"), "--fps", "10", "--profiles", "own", "--face", "ida"
    )
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1].split()[2] == "joy"


@pytest.fixture(scope="module")
def dots(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of pictures with painted markers."""
    folder = tmp_path_factory.mktemp("dots")
    for k, picture in enumerate(plain(truth("ada", moved(8)))):
        picture.image.save(folder / f"{k}.png")
    return folder


def test_track_follows_painted_markers(dots: Path, tmp_path: Path) -> None:
    colours = ("--markers", "green,blue")
    at = truth("ada", moved(1))[0] + (0, 2)
    done = run(str(dots), *colours, "-o", str(tmp_path / "dots.csv"))
    assert done.exit_code == 0, done.output
    assert "8 frames, 31 markers, 100.0% of them seen" in done.stderr
    assert len((tmp_path / "dots.csv").read_text().splitlines()) == 1 + 8 * 31
    clicks = [part for k in (0, 7, 9) for part in ("--marker-at", "{:.0f},{:.0f}".format(*at[k]))]
    done = run(str(dots), *clicks, "-o", str(tmp_path / "dots.fap"), "--profiles", "own")
    assert done.exit_code == 0, done.output
    assert read_fap((tmp_path / "dots.fap").read_text()).values[2, 30] > 50
    assert done.stdout


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["--markers", "mauve"], "wanted some of red, yellow"),
        (["--markers", "red"], "found 0 in most pictures; click on some by --marker-at"),
        (["--marker-at", "5"], "wanted X,Y in pixels, got '5'"),
        (["--marker-at", "1,1", "--neutral", "99"], "there is no picture 99"),
        (["--markers", "green", "--region", "9,9,5,5"], "wanted a left below the right"),
        (["--region", "1,1,5,5"], "--layout and --region are for markers"),
        (["--markers", "green,blue", "--region", "250,60,470,200", "--profiles", "own"], "see --layout"),
    ],
)
def test_track_says_which_marker_option_is_wrong(
    dots: Path, tmp_path: Path, args: list[str], said: str
) -> None:
    done = run(str(dots), *args, "-o", str(tmp_path / "x.csv"))
    assert done.exit_code == 2, done.output
    assert said in " ".join(done.stderr.split())


NONE = {"markers": None, "marker_colour": (), "marker_at": (), "layout": None, "region": None}


def test_numbers_are_pixels_with_commas() -> None:
    assert Numbers("X,Y").convert("12, 7", None, None) == (12, 7)
    for text in ("1", "1,2,3", "a,b", "-1,2", ""):
        with pytest.raises(click.BadParameter, match=r"wanted X,Y in pixels"):
            Numbers("X,Y").convert(text, None, None)


@pytest.mark.parametrize(
    ("chosen", "names"),
    [
        ({}, None),
        ({"markers": "green, blue"}, ["green", "blue"]),
        ({"marker_colour": ("120,50,50",)}, ["120,50,50"]),
        ({"markers": "red", "marker_at": ((5, 5),)}, ["red", "hue 239"]),
    ],
)
def test_look_of_has_the_colours(tmp_path: Path, chosen: dict[str, Any], names: list[str] | None) -> None:
    Image.new("RGB", (10, 10), (20, 20, 200)).save(tmp_path / "blue.png")
    look = marker_settings(tmp_path / "blue.png", NONE | chosen, None)
    assert (None if look is None else [colour.name for colour in look.colours]) == names


def test_follow_reads_the_film(tmp_path: Path) -> None:
    for k, picture in enumerate(plain(truth("ada", moved(3)))):
        picture.image.save(tmp_path / f"{k}.png")
    look = marker_settings(tmp_path, NONE | {"markers": "green,blue"}, 0)
    assert look is not None
    with click.Context(click.Command("track")):
        assert follow_markers(tmp_path, look, 10).pixels.shape == (3, 31, 2)
