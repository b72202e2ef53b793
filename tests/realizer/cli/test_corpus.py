"""Tests of `realizer corpus`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from click.testing import CliRunner, Result

from realizer.cli import cli
from realizer.corpus.formats import read_part
from realizer.corpus.recording import read_recording, write_recording
from tests.realizer.corpus.test_learn import acted


def run(*args: object) -> Result:
    return CliRunner().invoke(cli, [*map(str, args)])


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
