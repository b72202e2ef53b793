"""Tests of `realizer_studio.corpus.expressions`: what a film shows becomes an entry of the library."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import realizer
from bml_schema import parse
from realizer.animation.axis import AU_NAMES
from realizer.cli import cli
from realizer.expressions.library import library_of
from realizer_studio.corpus.expressions import found_expressions, units_of, write_expressions
from realizer_studio.corpus.face_map import features, template_faps
from realizer_studio.corpus.recording import Annotation, Recording, write_recording
from realizer_studio.corpus.statistics import Study
from tests.portraits import faps_of

FPS = 25.0
RISE, HOLD, FALL = 5, 20, 10  # frames


def winking(times: int = 9) -> Recording:
    """Somebody who winks at questions, quickly up and slowly down, the longer the later."""
    face = faps_of("default", AU4=0.7, AU20=0.5).astype(float)
    faps, labels, words = np.zeros((150 * times, 68)), [], []
    for k in range(times):
        at = 150 * k + 40
        shown = np.r_[np.linspace(0, 1, RISE), np.ones(HOLD + k), np.linspace(1, 0, FALL)]
        faps[at : at + len(shown)] = shown[:, None] * face
        labels.append(
            Annotation((at + RISE // 2) / FPS, (at + RISE + HOLD + k + FALL // 2) / FPS, "wink", "eva")
        )
        words.append(Annotation((at + 2) / FPS, (at + 12) / FPS, "really?", "subject"))
    return Recording("r", {}, tuple(labels), tuple(words), faps)


def test_found_expressions_have_units_and_timing() -> None:
    (wink,) = found_expressions(Study([winking()]))
    assert wink.aus == pytest.approx({"4": 0.7, "20": 0.5}, abs=0.12)
    assert wink.gaps[0] == pytest.approx(RISE / FPS, abs=0.06)
    assert wink.gaps[2] == pytest.approx(FALL / FPS, abs=0.08)
    assert wink.possible == pytest.approx((27 / FPS, 35 / FPS), abs=0.05)
    assert wink.probable is not None
    assert found_expressions(Study([Recording("r", {"frames": 99}, (Annotation(0, 1, "wink"),))])) == []


def test_units_of_a_template_are_its_own() -> None:
    faces = features(Recording("", faps=np.stack(list(template_faps().values()))))
    units = {name: units_of(face) for name, face in zip(template_faps(), faces, strict=True)}
    assert set(units["surprise"]) == {"1", "2"}
    assert set(units["disbelief"]) == {"4", "20"}
    assert set(units["disgust"]) == {"9"}
    left = features(Recording("", faps=faps_of("default", AU4=1.0)[None].astype(float)))[0]
    left[[31, 33, 35, 37]] = 0.0  # the right brow stays
    assert set(units_of(left)) == {"4L"}
    assert units_of(np.zeros(68)) == {}


def test_write_expressions_writes_a_folder_of_the_library(tmp_path: Path) -> None:
    assert write_expressions(tmp_path, Study([winking()])) == ["expressions/wink.toml"]
    library = library_of(tmp_path / "expressions")
    assert library["template:wink"].visible_duration == pytest.approx(31 / FPS, abs=0.05)
    assert library["template:wink"].means == ("wink",)


def test_an_expression_of_a_film_is_played_by_a_text(tmp_path: Path) -> None:
    def run(*args: object) -> str:
        done = CliRunner().invoke(cli, [*map(str, args)])
        assert done.exit_code == 0, done.output
        return done.stdout

    films, report = tmp_path / "films", tmp_path / "films" / "report"
    run("corpus", "init", films)
    write_recording(films / "eva", winking())
    run("corpus", "describe", films)
    run("enrich", "Is it true?", "--knowledge", report, "-o", tmp_path / "w.bml")
    block = parse((tmp_path / "w.bml").read_text())
    assert [node.name for node in block.behaviours if hasattr(node, "because")] == ["template:wink"]
    played = realizer.realize(
        tmp_path / "w.bml", idle=False, expressions=report / "expressions", voice="silent"
    )
    assert played.warnings == ()
    shown = played.aus.aus[:, AU_NAMES().index("4L")]
    assert shown.max() == pytest.approx(0.7 * 0.7, abs=0.1)  # enrich shows 0.7 of it
    run("check", tmp_path / "w.bml", "--expressions", report / "expressions")
