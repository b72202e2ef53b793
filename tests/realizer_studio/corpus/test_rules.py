"""Tests of `realizer_studio.corpus.rules`: what a corpus shows becomes rules that `enrich` applies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import realizer
from bml_schema import write
from realizer.emotions.archetypes import archetypes
from realizer.emotions.words import emotion
from realizer.knowledge.enrich import Enricher, template_of
from realizer.knowledge.sentences import sentences
from realizer.tables.emotional_words import word_list
from realizer.tables.emotions import statistics as published
from realizer.tables.knowledge import Mood, read_knowledge
from realizer.tables.templates import read_templates, templates
from realizer_studio.corpus.recording import Annotation, Recording
from realizer_studio.corpus.rules import from_faces, from_statistics, profiles, statistics, write_rules
from realizer_studio.corpus.statistics import Study

FPS = 25.0


def acted() -> Recording:
    """Short questions end with grief, sad words come with disgust, within anger; happiness stands apart."""
    labels, words, at = [], [], 100

    def show(name: str, first: int, length: int) -> None:
        labels.append(Annotation(first / FPS, (first + length) / FPS, name, "eva"))

    for k in range(20):
        for text in ("why", "not?") if k % 2 else ("it", "is", "sad."):
            words.append(Annotation(at / FPS, (at + 10) / FPS, text, "anna"))
            at += 10
        if k % 2:
            show("grief", at - 8, 20 + k)
        else:
            show("anger", at - 9, 24)
            show("disgust", at - 5, 12)
        at += 100
        words.append(Annotation(at / FPS, (at + 10) / FPS, "well.", "bob"))
        if k % 3 == 0:
            show("happiness", at + 60, 40)
        at += 160
    faps = np.zeros((at, 68))
    chance = np.random.default_rng(0)
    for label in labels:
        first, last = round(label.start * FPS), round(label.end * FPS)
        faps[first:last, 30] += (100 if label.text == "grief" else 0) + chance.normal(0, 10)
    return Recording("r", {"person": "anna", "mood": "sulky, glum"}, tuple(labels), tuple(words), faps)


@pytest.fixture(scope="module")
def study() -> Study:
    return Study([acted()], words=word_list("en"))


@pytest.fixture(scope="module")
def folder(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rules")
    tables = ["knowledge.toml", "templates.toml", "profiles.txt"]
    assert write_rules(path, study) == [*tables, "expressions/grief.toml"]
    return path


def test_write_rules_places_what_the_corpus_shows(folder: Path) -> None:
    rules = read_knowledge(folder / "knowledge.toml")
    placed = {(rule.when, *rule.show) for rule in rules.placings["speaker"]}
    assert ("question", "grief") in placed
    assert {("sorrow", "anger"), ("sorrow", "disgust")} <= placed
    assert ("question", "anger") not in placed
    assert not any("happiness" in rule.show for rule in rules.placings["speaker"])
    company = {(rule.of, rule.other): rule.by for rule in rules.companies}
    assert company["disgust", "anger"] == "around"
    assert rules.apart["happiness"] == 1.0
    assert rules.mood("glum") == Mood("glum", rules.moods["sulky"].distance, 1.0, "glum")
    assert rules.listener_distance >= rules.usual_distance > 1


def test_enrich_applies_the_rules_and_durations_of_a_corpus(folder: Path) -> None:
    rules = read_knowledge(folder / "knowledge.toml")
    durations = read_templates(folder / "templates.toml")
    block = Enricher(rules=rules, durations=durations).text("Why is it so? It is sad.")
    names = [template_of(node) for node in block.behaviours]
    assert names.count("grief") == 1
    assert "disgust" in names
    grief = next(node for node in block.behaviours if template_of(node) == "grief")
    # 29 frames on average, seen from half of the onset to half of the offset.
    assert durations["GRIEF"].evident == pytest.approx(30 / FPS, abs=1 / FPS)
    assert grief.syncs["relax"].offset == pytest.approx(30 / FPS - 0.45, abs=0.25)
    assert durations["GRIEF"].aus == templates()["GRIEF"].aus
    assert durations["GRIEF"].possible == (21 / FPS, 39 / FPS)


def played(number: int) -> Recording:
    """What our own rules show in one of ten texts, at the times of the silent voice."""
    things = ["bread", "stone", "water", "paper", "glass", "iron", "silver", "timber", "cotton", "leather"]
    thing = things[number]
    text = (
        f"We went out to buy some {thing} in the morning. Is it {thing}? They say it lasts for many years. "
        f"This is nonsense, and the others there know it too. He has another piece of {thing} at home. "
        f"It was a terrible story about {thing}. We walked along the river until late in the evening. "
        f"Do you know who of them sold the {thing} to us there? The day was long and we came home by train. "
        "Take it away! Then we had tea and looked at the garden for a while."
    )
    block = Enricher().text(text)
    times = realizer.schedule(write(block), voice="silent").times
    labels = []
    for node in block.behaviours:
        if name := template_of(node):
            start, peak, relax, end = times[node.id].tolist()
            labels.append(Annotation((start + peak) / 2, (relax + end) / 2, name, "rules"))
    begin = float(times["speech1"][0])
    words = [
        Annotation(begin + word.start, begin + word.end, word.text + sign)
        for sentence in sentences(text)
        for word in sentence.words
        for last in [word is sentence.words[-1]]
        for sign in [("?" if sentence.question else "!" if sentence.exclamation else ".") if last else ""]
    ]
    return Recording(f"t{number}", {}, tuple(labels), tuple(words))


def test_rules_of_what_enrich_plays_are_its_own(tmp_path: Path) -> None:
    study = Study([played(number) for number in range(10)], words=word_list("en"))
    write_rules(tmp_path, study)
    found = {(r.when, *r.show): r for r in read_knowledge(tmp_path / "knowledge.toml").placings["speaker"]}
    assert found["question", "surprise"].most_words == 5
    assert {
        ("disapproval", "anger"),
        ("fright", "surprise"),
        ("fright", "grief"),
        ("exclamation", "anger"),
    } <= set(found)
    assert ("disapproval", "surprise") not in found
    assert ("exclamation", "surprise") not in found


def test_profiles_are_ranges_of_a_deviation_around_the_mean(study: Study, folder: Path) -> None:
    grief = {profile.name: profile for profile in profiles(study)}["grief 0"]
    (row,) = [row for row in statistics(study).rows if row[1] == "grief"]
    assert (row[2], row[3]) == (31, 10)
    assert grief.ranges[31] == pytest.approx((row[4] - row[5], row[4] + row[5]))
    assert 90 < row[4] < 110
    assert emotion("grief", str(folder / "profiles.txt")).ranges[31] == pytest.approx(
        grief.ranges[31], abs=0.1
    )


def test_write_rules_writes_only_what_there_is_data_for(tmp_path: Path) -> None:
    bare = Recording("r", {"frames": 100}, (Annotation(0, 1, "wink", "eva"),))
    assert write_rules(tmp_path, Study([bare])) == ["knowledge.toml"]
    assert read_knowledge(tmp_path / "knowledge.toml").placings["speaker"] == ()


def published_statistics(emotion: str, raw: bool = False) -> dict[int, tuple[float, float]]:
    """Return FAP -> (mean, deviation) of an emotion (table 4), as printed or with the signs of MPEG-4."""
    found = {}
    for row in published():
        mean = row.raw_mean if raw else row.mean
        if row.emotion == emotion and mean is not None and row.deviation is not None:
            found[row.fap] = mean, row.deviation
    return found


@pytest.mark.parametrize(("profiles", "raw"), [("raw", True), ("published", False)])
@pytest.mark.parametrize("emotion", ["anger", "sadness", "joy", "disgust", "fear", "surprise"])
def test_from_statistics_gives_the_first_published_profile(emotion: str, profiles: str, raw: bool) -> None:
    made = from_statistics(emotion, published_statistics(emotion, raw))
    printed = archetypes(profiles)[emotion][0]
    assert made.ranges.keys() == printed.ranges.keys()
    for fap, ends in printed.ranges.items():
        # Anger's F31 and disgust's F33 and F34 are misprinted by 10.
        assert made.ranges[fap] == pytest.approx(ends, abs=10 if raw else 2), fap


def test_from_statistics_keeps_the_direction_of_a_fap() -> None:
    made = from_statistics("sigh", {3: (100, 150), 41: (-10, 5), 4: (100, 150)})
    assert dict(made.ranges) == {3: (0, 250), 4: (-50, 250), 41: (0, 0)}


def test_from_faces_of_a_profile_gives_ranges_within_it() -> None:
    joy = archetypes("own")["joy"][0]
    chance = np.random.default_rng(0)
    made = from_faces("joy", np.stack([joy.draw(chance) for _ in range(400)]))
    assert made.ranges.keys() == joy.ranges.keys()
    for fap, (low, high) in joy.ranges.items():
        # A uniform draw deviates by its width / sqrt(12).
        deviation = (high - low) / 12**0.5
        middle = (low + high) / 2
        assert made.ranges[fap] == pytest.approx(
            (middle - deviation, middle + deviation), abs=0.1 * (high - low)
        )


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        (np.zeros((1, 68)), r"at least two faces \(n, 68\), got \(1, 68\)"),
        (np.zeros((4, 15)), r"at least two faces \(n, 68\), got \(4, 15\)"),
        (np.full((4, 68), np.nan), "finite values"),
    ],
)
def test_from_faces_refuses_invalid_frames(frames: np.ndarray, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        from_faces("x", frames)


def test_from_statistics_refuses_an_invalid_deviation() -> None:
    with pytest.raises(ValueError, match="x, FAP 4: wanted a deviation of 0 or more, got -1"):
        from_statistics("x", {4: (3, -1)})
