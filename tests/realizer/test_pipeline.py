"""Tests of the pipeline: examples, golden values, sound and lips."""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bml_schema import write
from realizer import pipeline, realize
from realizer.core.options import PlayOptions
from realizer.examples import examples
from realizer.face.deform import deform
from realizer.playback import block_planner
from realizer.realization import Realization
from realizer.speech.silent import SilentVoice
from realizer.tables import faps

GOLDEN = Path(__file__).parent.parent / "golden"
HELLO = examples()["greeting"]


@pytest.mark.parametrize("name", examples())
def test_play_examples_without_a_warning(name: str) -> None:
    played = realize(examples()[name], voice=SilentVoice())
    assert played.warnings == ()
    assert played.duration > 1


def test_play_composes_several_documents() -> None:
    nod = '<bml id="{}" composition="APPEND"><head id="n" lexeme="NOD"/></bml>'
    played = realize([nod.format("a"), nod.format("b")])
    first, second = played.schedules
    assert second.start == pytest.approx(first.end)
    assert played.duration == pytest.approx(second.end)


def test_play_two_characters_side_by_side() -> None:
    nod = '<bml id="{0}" characterId="{0}"><head id="n" lexeme="NOD"/></bml>'
    played = realize([nod.format("Ann"), nod.format("Bob")])
    assert list(played.characters) == ["Ann", "Bob"]
    assert set(played.to_json()["characters"]) == {"Bob"}


def test_play_refuses_a_broken_document_and_plays_the_next() -> None:
    played = realize(['<bml id="x"><head', '<bml id="b"><head id="n" lexeme="NOD"/></bml>'])
    assert len(played.refusals) == 1
    assert played.duration > 0


def test_play_gives_the_same_frames_for_the_same_seed_only() -> None:
    document = '<bml id="b"><wait id="w" duration="12"/></bml>'
    one, two, other = (realize(document, seed=s).faps.values for s in (1, 1, 2))
    assert np.array_equal(one, two)
    assert not np.array_equal(one, other)


def test_play_without_idle_is_neutral_between_behaviours() -> None:
    played = realize('<bml id="b"><wait id="w" duration="3"/></bml>', idle=False)
    assert not played.faps.values.any()


def test_play_long_documents_without_a_seam_between_windows() -> None:
    document = (
        '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="8" attackPeak="10" relax="12" end="14"/></bml>'
    )
    values = realize(document, idle=False).faps.values
    assert np.abs(np.diff(values, axis=0)).max() < 40


@pytest.mark.parametrize("name", ["greeting", "nod-on-a-word", "gaze-and-back"])
def test_play_gives_the_golden_frames(name: str, request: pytest.FixtureRequest) -> None:
    """FAP frames at 25 fps as text, one frame a line, so that a change is a readable diff."""
    played = realize(examples()[name], voice=SilentVoice())
    used = [i for i in range(68) if played.faps.integers()[:, i].any()]
    lines = [" ".join(["frame", *(faps()[i].name for i in used)])]
    lines += [" ".join(map(str, [k, *row[used]])) for k, row in enumerate(played.faps.integers())]
    golden = GOLDEN / f"{name}.fap.txt"
    if request.config.getoption("--update-golden"):
        golden.write_text("\n".join(lines) + "\n")
    head, *rows = golden.read_text().splitlines()
    assert lines[0] == head
    ours = np.array([line.split() for line in lines[1:]], int)
    theirs = np.array([row.split() for row in rows], int)
    assert ours.shape == theirs.shape
    # One unit of tolerance for rounding on other machines.
    assert np.abs(ours - theirs).max() <= 1


NOD = (
    '<bml id="b"><speech id="s"><text>Well <sync id="now"/> yes.</text></speech>'
    '<head id="n" lexeme="NOD" stroke="s:now"/><faceLexeme id="f" lexeme="SMILE" start="n:end"/></bml>'
)


def test_play_passes_the_golden_values_between_steps(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every step is called by its name, in order, with the values of the golden file."""
    passed: dict[str, Any] = {}

    def note(step: str, holder: Any, name: str, describe: Any) -> None:
        run = getattr(holder, name)

        def noted(*args: Any, **kwargs: Any) -> Any:
            result = run(*args, **kwargs)
            passed[step] = describe(result, *args)
            return result

        monkeypatch.setattr(holder, name, noted)

    def read(result: Any, *_: Any) -> str:
        (block,) = result
        return write(block)

    builder = block_planner._PlanBuilder
    run_read = pipeline.read
    monkeypatch.setattr(pipeline, "read", lambda *args, **options: list(run_read(*args, **options)))
    note("parse", pipeline, "read", read)
    note(
        "time",
        builder,
        "find_timings",
        lambda _, own: {b: rounded(t.preferred) for b, t in own.timings.items()},
    )
    note("schedule", builder, "schedule", lambda got, *_: {b: rounded(t) for b, t in got[0].times.items()})
    note("expand", builder, "expand", lambda got, *_: {b: described(cs) for b, cs in got.items()})
    note("blend", pipeline, "blend", lambda got, *_: rounded(got.aus.max(axis=0)))
    note("map", pipeline, "to_fap", lambda frames, *_: rounded(np.abs(frames.values).max(axis=0), 1))
    played = pipeline.play([NOD], PlayOptions(idle=False), SilentVoice())
    moved = deform(played.face, played.poses[::10]) - played.face.vertices
    passed["deform"] = rounded(np.abs(moved).max(axis=(0, 1)) * 1000)  # millimetres
    assert list(passed) == ["parse", "time", "schedule", "expand", "blend", "map", "deform"]
    golden = GOLDEN / "steps.json"
    if request.config.getoption("--update-golden"):
        lines = (f"{json.dumps(step)}: {json.dumps(value)}" for step, value in passed.items())
        golden.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    expected = json.loads(golden.read_text())
    for step, value in passed.items():
        assert flat(value) == pytest.approx(flat(expected[step]), rel=1e-3, abs=2e-3), step


def rounded(values: Any, digits: int = 4) -> list[float]:
    return [round(float(v), digits) for v in values]


def described(channels: Any) -> dict[str, list[float]]:
    """Return {target: first key, last key, greatest value} of the last channel of each target."""
    ends = {c.target.name: (c.times[0], c.times[-1], np.abs(c.values).max()) for c in channels}
    return {name: rounded(values) for name, values in ends.items()}


def flat(value: Any, path: str = "") -> dict[str, Any]:
    """Return {path: number or text} of all parts of a value."""
    if isinstance(value, str):
        return {f"{path}={value}": 0.0}
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return {key: one for name, part in items for key, one in flat(part, f"{path}/{name}").items()}
    return {path: value}


@pytest.mark.gl
def test_pictures_draw_the_given_frames() -> None:
    from realizer.render.renderer import Renderer

    played = pipeline.play([NOD], PlayOptions(idle=False), SilentVoice())
    frames = [0, played.frames // 2]
    with Renderer(size=(64, 64)) as renderer:
        drawn = [picture.copy() for picture in pipeline.pictures(played, renderer, frames)]
        alone = renderer.draw(played.poses[frames[1:]])
    assert np.array_equal(drawn[1], alone[0])
    assert not np.array_equal(drawn[0], drawn[1])


@pytest.fixture
def spoken() -> Realization:
    """Play the nod on a word with a real voice and without idle motion."""
    if find_spec("espeakng_loader") is None:
        pytest.skip("no speech extra: pip install 'bml-realizer[speech]'")
    return realize(examples()["nod-on-a-word"], voice="espeak", idle=False)


@pytest.mark.espeak
def test_play_nods_deepest_on_the_word(spoken: Realization) -> None:
    planned = spoken.schedules[0]
    (start, utterance), word = spoken.speech[0], planned.at("yes", "really")
    heard = next(w for w in utterance.words if w.text.strip(".,").lower() == "really")
    assert start + heard.start == pytest.approx(word, abs=0.005)
    pitch = spoken.faps.values[:, 47]  # FAP 48, down is positive
    assert abs(spoken.faps.times[np.argmax(pitch)] - word) <= 1 / spoken.fps


@pytest.mark.espeak
def test_play_gives_sound_as_long_as_the_words(spoken: Realization) -> None:
    (start, utterance), sound = spoken.speech[0], spoken.sound(22050)
    assert utterance.pcm is not None
    assert len(sound) == round(spoken.duration * 22050)
    loud = np.flatnonzero(np.abs(sound) > 300) / 22050
    voiced = [p for p in utterance.phonemes if p.ipa]
    assert loud[0] == pytest.approx(start + voiced[0].start, abs=0.08)
    assert loud[-1] <= start + utterance.duration


@pytest.mark.espeak
def test_play_closes_the_lips_in_every_p_b_m_as_streamed() -> None:
    document = '<bml id="b"><speech id="s"><text>My baby came up to me, maybe.</text></speech></bml>'
    played = realize(document, voice="espeak", idle=False)
    ((start, utterance),) = played.speech
    faps = played.faps.values
    gap = -faps[:, 3] - faps[:, 4]  # FAP 4 moves the upper lip down, FAP 5 the lower lip up; MNS / 1024
    bilabial = [p for p in utterance.phonemes if p.ipa and p.ipa.strip("ˈˌ")[:1] in "pbm"]
    assert len(bilabial) >= 6
    for phoneme in bilabial:
        inside = (played.faps.times >= start + phoneme.start - 0.04) & (
            played.faps.times <= start + phoneme.end + 0.04
        )
        assert gap[inside].min() < 0.03 * 1024, phoneme
    assert gap.max() > 150, "between them the mouth opens"


def test_play_collects_warnings_that_arise_while_blocks_play() -> None:
    bmla = 'xmlns:bmla="http://www.asap-project.org/bmla"'
    played = realize(f'<bml id="b" {bmla} bmla:onStart="q"><bmla:interrupt id="i" target="nobody"/></bml>')
    assert [(w.id, w.type) for w in played.warnings] == [
        ("b", "EXECUTION_FAILURE"),
        ("b:i", "EXECUTION_FAILURE"),
    ]
