"""Every document of the corpus is played, and what its .toml says must hold."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from bml_schema.feedback import BlockProgress, SyncPointProgress, parse_feedback
from realizer.pipeline import Realization, realize
from realizer.speech import SilentVoice

CORPUS = Path(__file__).parent / "corpus"
CASES = sorted(CORPUS.rglob("*.toml"))


def expectation(case: Path) -> dict[str, Any]:
    return tomllib.loads(case.read_text("utf-8"))


def play(case: Path) -> Realization:
    document = case.with_suffix(".xml").read_bytes()
    return realize(document, voice=SilentVoice(), idle=False, scene=expectation(case).get("scene"))


def time_of(realization: Realization, point: str) -> float:
    behaviour, sync = point.split(":", 1)
    return realization.schedules[0].at(behaviour, sync)


@pytest.mark.parametrize("case", CASES, ids=[str(c.relative_to(CORPUS).with_suffix("")) for c in CASES])
def test_case(case: Path) -> None:
    wanted = expectation(case)
    assert wanted["says"], "a case says in a sentence what it proves"
    played = play(case)
    within = wanted.get("within", 1e-6)

    if wanted.get("refused"):
        assert played.refused
        assert played.duration == 0
        text = played.refused[0]
        for key in ("line", "path", "contains"):
            if key in wanted:
                assert f"line {wanted[key]}" in text if key == "line" else str(wanted[key]) in text
        assert not any("blockProgress" in f for f in played.feedback)
        return

    assert not played.refused, played.refused
    if "warnings" in wanted:
        assert sorted([w.id, w.type] for w in played.warnings) == sorted(wanted["warnings"])
    for key in ("path", "contains"):
        if key in wanted:
            assert any(str(wanted[key]) in w.text for w in played.warnings), [w.text for w in played.warnings]
    if "line" in wanted:
        assert any(f"line {wanted['line']}" in w.text for w in played.warnings), [
            w.text for w in played.warnings
        ]
    schedule = played.schedules[0]
    for behaviour in wanted.get("dropped", ()):
        assert behaviour not in schedule.times
    times = [time_of(played, point) for point in wanted.get("order", ())]
    assert times == sorted(times)
    for group in wanted.get("equal", ()):
        first, *rest = [time_of(played, point) for point in group]
        assert rest == pytest.approx([first] * len(rest), abs=within)
    for point, time in wanted.get("at", {}).items():
        assert time_of(played, point) == pytest.approx(time, abs=within)


VALID = [case for case in CASES if not expectation(case).get("refused")]


@pytest.mark.parametrize("case", VALID, ids=[str(c.relative_to(CORPUS).with_suffix("")) for c in VALID])
def test_feedback_tells_the_schedule_once_and_in_order(case: Path) -> None:
    played = play(case)
    feedback = [parse_feedback(text) for text in played.feedback]
    schedule = played.schedules[0]
    starts = [f for f in feedback if isinstance(f, BlockProgress) and f.id == f"{schedule.block}:start"]
    ends = [f for f in feedback if isinstance(f, BlockProgress) and f.id == f"{schedule.block}:end"]
    assert len(starts) == len(ends) == 1
    points = [f for f in feedback if isinstance(f, SyncPointProgress)]
    told = [f.id for f in points]
    assert sorted(told) == sorted(
        f"{schedule.block}:{b}:{p}" for b, names in schedule.points.items() for p in names
    )
    assert [f.time for f in points] == sorted(f.time for f in points)
    where = feedback.index(starts[0]), feedback.index(ends[0])
    assert all(where[0] < feedback.index(f) < where[1] for f in points)
    for behaviour, names in schedule.points.items():
        own = [t for t in told if t.startswith(f"{schedule.block}:{behaviour}:")]
        assert own == [f"{schedule.block}:{behaviour}:{p}" for p in names]
