"""Tests of `realizer corpus`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from realizer.cli import cli
from realizer_studio.corpus.formats import read_part
from realizer_studio.corpus.recording import read_recording, write_recording
from tests.painted import acted as moved
from tests.painted import plain, truth
from tests.portraits import LITERT, faps_of, portrait
from tests.realizer_studio.corpus.test_face_map import acted


def run(*args: object) -> Result:
    return CliRunner().invoke(cli, [*map(str, args)])


def track(*args: object) -> Result:
    return CliRunner().invoke(cli, ["corpus", "track", *map(str, args)], standalone_mode=False)


@pytest.mark.slow
def test_corpus_goes_from_recordings_to_rules(tmp_path: Path) -> None:
    folder, part = tmp_path / "films", tmp_path / "part"
    write_recording(part, acted(1))
    (tmp_path / "words.csv").write_text("start,end,word,speaker\n1,1.2,really?,eva\n")
    assert run("corpus", "init", folder).exit_code == 0
    said = run("corpus", "add", folder, "one", part / "faps.csv", part / "labels.csv", "--mood", "anxiety")
    assert said.exit_code == 0, said.output
    assert "4000 frames" in said.stderr
    assert run("corpus", "add", folder, "one", tmp_path / "words.csv", "--person", "eva").exit_code == 0
    assert run("corpus", "learn", folder).exit_code == 0
    found = run("corpus", "find", folder)
    assert "% of frames" in found.stdout
    again = run("corpus", "find", folder)
    assert again.stdout == found.stdout
    one = read_recording(folder / "one")
    assert (one.meta["mood"], one.meta["person"], one.annotators) == ("anxiety", "eva", ["eva", "map"])
    done = run("corpus", "describe", folder, "--annotator", "eva")
    assert done.exit_code == 0, done.output
    report = folder / "report"
    assert {"6.3.csv", "report.html", "profiles.txt"} <= {path.name for path in report.iterdir()}
    assert "data:image/png" in (report / "report.html").read_text()
    rich = run("enrich", "Are you sure?", "--knowledge", report, "--mood", "anxiety")
    assert rich.exit_code == 0, rich.output
    assert run("emotion", "surprise", "--profiles", report / "profiles.txt").stdout.startswith("Surprise 0")
    assert run("corpus", "describe", folder, "--annotator", "eva").exit_code == 0  # with the report in it


def test_corpus_label_wants_a_recording_or_the_page(tmp_path: Path) -> None:
    run("corpus", "init", tmp_path / "c")
    said = run("corpus", "label", tmp_path / "c")
    assert said.exit_code == 2
    assert "wanted the NAME of a recording, or --page" in said.stderr
    assert "wanted a corpus" in run("corpus", "label", tmp_path, "--page").stderr


def test_corpus_exports_labels(tmp_path: Path) -> None:
    run("corpus", "init", tmp_path / "c")
    write_recording(tmp_path / "c" / "one", acted(1, 500))
    assert run("corpus", "export", tmp_path / "c", "one", "-o", tmp_path / "one.eaf").exit_code == 0
    back, wanted = read_part(tmp_path / "one.eaf").labels, acted(1, 500).labels
    assert [label.text for label in back] == [label.text for label in wanted]
    assert np.allclose([label.end for label in back], [label.end for label in wanted], atol=1e-3)


def test_corpus_refuses_what_is_none(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    run("corpus", "init", folder)
    (tmp_path / "x.csv").write_text("a\n1\n")
    for args, said in (
        (["corpus", "init", folder], "wanted a new folder, got a corpus"),
        (["corpus", "add", tmp_path, "x"], "wanted a corpus; make one by"),
        (["corpus", "add", folder, "../x"], "wanted a name without /"),
        (["corpus", "add", folder, "x", tmp_path / "x.csv"], "x.csv: wanted a file of one of the formats"),
        (["corpus", "learn", folder], "wanted a recording or more, got none"),
        (["corpus", "find", folder], "wanted a map, got"),
        (
            ["enrich", "hi", "--knowledge", folder],
            "knowledge.toml: wanted a table in the form of realizer/tables/knowledge.toml",
        ),
    ):
        done = run(*args)
        text = " ".join((done.output + str(done.exception)).split())
        assert done.exit_code
        assert said in text, text
    write_recording(folder / "one", acted(1, 200).__class__("one", {"frames": 10}))
    assert "wanted labels, got none" in run("corpus", "describe", folder).output


def film(path: Path, pictures: Iterable[Image.Image]) -> Path:
    av = pytest.importorskip("av", reason="needs the film extra")
    shown = list(pictures)
    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=25, options={"crf": "15"})
        (stream.width, stream.height), stream.pix_fmt = shown[0].size, "yuv420p"
        for picture in shown:
            file.mux(stream.encode(av.VideoFrame.from_image(picture)))
        file.mux(stream.encode())
    return path


def test_corpus_track_does_what_is_not_done_yet(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    run("corpus", "init", folder)
    dots = film(tmp_path / "dots.mp4", (one.image for one in plain(truth("ada", moved(8)))))
    assert run("corpus", "add", folder, "one", dots, "--person", "eva").exit_code == 0
    assert run("corpus", "label", folder, "one", "--add", "0", "0.2", "surprise").exit_code == 0
    (folder / "two.mp4").write_bytes(dots.read_bytes())
    (folder / "three.mp4").write_bytes(dots.read_bytes()[:3000])  # a film that is cut
    markers = ("--markers", "green,blue")
    done = track(folder, *markers)
    assert done.return_value == 1, done.output
    assert "three.mp4: wanted a film" in done.stderr
    assert "2 of 3 films tracked, 1 failed" in done.stderr
    one = read_recording(folder / "one")
    assert (one.frames, one.meta["person"], len(one.labels)) == (8, "eva", 1)
    assert one.points is not None
    assert one.points[0][19] == "20"
    before = (folder / "two" / "points.npz").stat().st_mtime_ns
    (folder / "one" / "meta.toml").unlink()  # half written
    assert run("corpus", "learn", folder).exit_code != 0
    again = track(folder, "one", "two", *markers)
    assert again.return_value == 0, again.output
    assert "1 of 3 films tracked, 0 failed" in again.stderr
    assert (folder / "two" / "points.npz").stat().st_mtime_ns == before
    assert read_recording(folder / "one").labels == one.labels
    assert "wanted recordings with a film, got 'four'" in run("corpus", "track", folder, "four").output


@LITERT
@pytest.mark.gl("onboard")
@pytest.mark.slow
def test_corpus_track_finds_faces_without_markers(tmp_path: Path) -> None:
    run("corpus", "init", tmp_path)
    smile = faps_of("ben", AU12=0.9)
    film(tmp_path / "ben.mp4", (portrait("ben", smile if k > 4 else None) for k in range(9)))
    film(tmp_path / "grey.mp4", [Image.new("RGB", (160, 160), (128, 128, 128))] * 3)
    done = track(tmp_path)
    assert done.return_value == 1, done.output
    assert "grey.mp4: wanted a face, found none in 3 pictures" in done.stderr
    faps = read_recording(tmp_path / "ben").faps
    assert faps is not None
    assert faps[8, 11] > faps[0, 11] + 60


def test_corpus_label_adds_removes_and_compares(tmp_path: Path) -> None:
    folder = tmp_path / "c"
    run("corpus", "init", folder)
    write_recording(folder / "one", acted(1, 500))
    first = acted(1, 500).labels[0]
    span = (first.start, first.end, first.text)
    done = run("corpus", "label", folder, "one", "--annotator", "bob", "--add", *span)
    assert done.exit_code == 0, done.output
    assert f"{first.text}  [bob]" in done.stdout
    assert "Krippendorff's alpha of bob, eva, all: " in done.stdout
    gone = run("corpus", "label", folder, "one", "--annotator", "bob", "--remove", *span)
    assert "[bob]" not in gone.stdout
    assert read_recording(folder / "one").labels == acted(1, 500).labels
    for label in acted(1, 500).labels:
        spans = ("--remove", label.start, label.end, label.text)
        assert run("corpus", "label", folder, "one", "--annotator", "eva", *spans).exit_code == 0
    assert run("corpus", "label", folder, "one").stdout == ""
    wrong = run("corpus", "label", folder, "one", "--add", 1, 900, "anger")
    assert wrong.exit_code == 2
    assert "wanted an end up to" in " ".join(wrong.stderr.split())
    assert "wanted meta.toml, got none" in " ".join(run("corpus", "label", folder, "two").stderr.split())
