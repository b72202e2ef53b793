"""Tests of every case of the corpus."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from bml_schema import (
    Behaviour,
    BlockProgress,
    PredictionFeedback,
    Speech,
    Sync,
    SyncPointProgress,
    WarningFeedback,
    parse,
    write,
)
from bml_schema.node_schema import schema_of
from realizer.animation.axis import AU_NAMES
from realizer.animation.curves import gain_at
from realizer.behaviours.registry import VOCABULARY
from tests.case_player import Played, play, play_in_session
from tests.cases import CASES, Case, Instant, LogLine
from tests.rows import each_row

WITHIN = 2e-6  # s; feedback has times to the microsecond


def plays_as_expected(case: Case) -> None:
    wanted = case.wanted
    assert wanted["says"], "a case says in a sentence what must be true"
    played = play(
        case, live_instants=case.live_instants, instants=[*case.live_instants, *case.smooth_instants]
    )
    texts = [w.text for w in played.warnings]
    if wanted.get("refused"):
        assert len(played.warnings) == 1, texts
        assert {line.kind for line in played.log} <= {"warning", "prediction"}
    elif "warnings" not in wanted and not {"contains", "path", "line"} & wanted.keys():
        assert not texts, "a case that expects warnings names them"
    if "warnings" in wanted:
        assert sorted([w.id, w.type] for w in played.warnings) == sorted(wanted["warnings"]), texts
    for key in ("path", "contains"):
        if key in wanted:
            assert any(str(wanted[key]) in text for text in texts), texts
    if "line" in wanted:
        assert any(f"line {wanted['line']}" in text for text in texts), texts
    check_schedule(case, played)
    check_log(case, played)
    check_faces(case, played)
    check_reading(case, played)
    check_meaning(case, played)


def check_schedule(case: Case, played: Played) -> None:
    wanted, within = case.wanted, case.wanted.get("within", WITHIN)
    for behaviour in wanted.get("dropped", ()):
        assert not any(behaviour in schedule.times for schedule in played.schedules.values())
    times = [played.time(point) for point in wanted.get("order", ())]
    assert times == sorted(times)
    for group in wanted.get("equal", ()):
        first, *rest = [played.time(point) for point in group]
        assert rest == pytest.approx([first] * len(rest), abs=within)
    for point, time in wanted.get("at", {}).items():
        assert played.time(point) == pytest.approx(time, abs=within), point
    for span, seconds in wanted.get("lasts", {}).items():
        first, last = map(played.time, span.split(".."))
        assert last - first == pytest.approx(seconds, abs=within), span
    for point, time in wanted.get("predicted", {}).items():
        assert played.predicted(point) == pytest.approx(time, abs=within), point
    for name, seconds in wanted.get("late", {}).items():
        assert played.late(name) == pytest.approx(seconds, abs=within), name


def check_log(case: Case, played: Played) -> None:
    wanted, within = case.wanted, case.wanted.get("within", WITHIN)
    log = "\n".join(map(str, played.log))
    if "log" in wanted:
        expected = [LogLine.read(line) for line in wanted["log"]]
        kinds = {line.kind for line in expected}
        got = [line for line in played.log if line.kind in kinds]
        same = len(got) == len(expected) and all(map(lambda g, e: g.matches(e, within), got, expected))
        assert same, f"wanted\n{chr(10).join(map(str, expected))}\n\ngot\n{chr(10).join(map(str, got))}"
    rest = iter(played.log)
    for line in map(LogLine.read, wanted.get("among", ())):
        assert any(got.matches(line, within) for got in rest), f"wanted {line} here, got\n{log}"
    for line in map(LogLine.read, wanted.get("once", ())):
        assert sum(got.matches(line, within) for got in played.log) == 1, f"wanted {line} once, got\n{log}"
    for line in map(LogLine.read, wanted.get("never", ())):
        assert not any(got.matches(line, within) for got in played.log), f"wanted no {line}, got\n{log}"
    if "characters" in wanted:
        assert {f.character_id or "" for f in played.feedback} == set(wanted["characters"])
    if "heard" in wanted:
        heard = [(s.start, min(s.until, s.start + s.utterance.duration)) for s in played.speeches]
        assert heard == [pytest.approx(span, abs=within) for span in wanted["heard"]]
    for time, part in wanted.get("loud", ()):
        (got,) = gain_at(played.speeches[0].gains, np.array([time]))
        assert got == pytest.approx(part, abs=1e-4), f"at {time}"


def check_faces(case: Case, played: Played) -> None:
    for instant, face in played.live_faces.items():
        assert played.faces[instant] == pytest.approx(face, abs=1e-5), "the same after the end"
    for face in case.wanted.get("face", ()):
        values = played.live_faces[Instant(float(face["at"]), face.get("character"))]
        for name, value in face["shows"].items():
            least, most = value if isinstance(value, list) else (value - 1e-4, value + 1e-4)
            assert least <= values[name] <= most, f"{name} at {face['at']}"
    for smooth in case.wanted.get("smooth", ()):
        instants = sorted({i for i in case.smooth_instants if i.character == smooth.get("character")})
        faces = [played.faces[i] for i in instants if smooth["from"] <= i.time <= smooth["to"]]
        names = smooth.get("of") or [name for name in faces[0] if name[0].isdigit()]
        rows = np.array([[values[name] for name in names] for values in faces])
        assert np.abs(np.diff(rows, axis=0)).max() <= smooth["most"], names


def check_reading(case: Case, played: Played) -> None:
    for path, value in case.wanted.get("reads", {}).items():
        owner, *steps = path.split(".")
        found = [b for b in played.blocks if b.id == owner]
        found += [node for block in played.blocks for node in block.behaviours if node.id == owner]
        assert found, f"{path}: no such block or behaviour"
        got = found[0] if steps else found[0].tag.rpartition("}")[2]
        for step in steps:
            got = got[int(step)] if step.isdigit() else getattr(got, field_of(got, step))
        assert (list(got) if isinstance(got, tuple) else got) == value, path


def field_of(node: object, name: str) -> str:
    """Return the field of an attribute; children and others keep their name."""
    spec = schema_of(type(node)).attributes.get(name)
    return spec.field if spec else name


def check_meaning(case: Case, played: Played) -> None:
    """Check that `as_if` is parsed and played the same, and that `unlike` is not."""
    if not {"as_if", "unlike"} & case.wanted.keys():
        return
    instants = [Instant(float(time)) for time in np.arange(0, min(played.end, 30) + 0.25, 0.1)]
    here = play(case, instants=instants)
    if "as_if" in case.wanted:
        other = play(case, case.wanted["as_if"].encode(), instants=instants)
        assert other.blocks == here.blocks
        assert all(line.matches(mine, WITHIN) for line, mine in zip(other.log, here.log, strict=True))
        assert all(other.faces[i] == pytest.approx(here.faces[i]) for i in instants)
    if "unlike" in case.wanted:
        other = play(case, case.wanted["unlike"].encode(), instants=instants)
        assert other.blocks != here.blocks
        assert other.log != here.log or any(other.faces[i] != pytest.approx(here.faces[i]) for i in instants)


@cache
def play_once(case: Case) -> Played:
    """Play a case without sampling its faces."""
    return play(case)


def feedback_is_ordered_and_complete(case: Case) -> None:
    """BML 1.0: progress is in order of time, occurs once, and lies between start and end of its block."""
    played = play_once(case)
    clock = 0.0
    start: dict[str, float] = {}  # of the blocks that play
    passed: dict[str, list[str]] = {}
    over: set[str] = set()
    for feedback in played.feedback:
        if isinstance(feedback, BlockProgress | SyncPointProgress):
            assert feedback.global_time >= clock - WITHIN, f"{feedback.id} is out of order"
            clock = max(clock, feedback.global_time)
        if isinstance(feedback, SyncPointProgress):
            block, rest = feedback.id.split(":", 1)
            assert block in start, f"{feedback.id} outside its block"
            assert feedback.time == pytest.approx(feedback.global_time - start[block], abs=WITHIN)
            assert rest not in passed[block], f"{feedback.id} occurs twice"
            passed[block].append(rest)
        elif isinstance(feedback, BlockProgress):
            block, _, point = feedback.id.rpartition(":")
            if point == "start":
                assert block not in start, f"{block} started twice"
                start[block], passed[block] = feedback.global_time, []
                over.discard(block)
                continue
            if feedback.status == "REVOKED":
                assert block not in start
            else:
                assert block in start, f"{block} ended without a start"
                del start[block]
            over.add(block)
        elif isinstance(feedback, PredictionFeedback):
            over -= {b.id for b in feedback.blocks}
        elif isinstance(feedback, WarningFeedback):
            assert feedback.id.partition(":")[0] not in over, f"a warning of {feedback.id} after its block"
    assert not start, "every block that started ends"


def predictions_equal_the_progress(case: Case) -> None:
    """Start and end of blocks, and every sync point of behaviours, come at their predicted times."""
    blocks: dict[str, tuple[float | None, float | None]] = {}
    points: dict[str, dict[str, float]] = {}
    played = play_once(case)
    described = {f"{b.id}:{node.id}" for b in played.blocks for node in b.behaviours if node.descriptions}
    for feedback in played.feedback:
        match feedback:
            case PredictionFeedback():
                blocks |= {b.id: (b.global_start, b.global_end) for b in feedback.blocks}
                points |= {node.id: predicted_points(node) for node in feedback.behaviours}
            case SyncPointProgress():
                behaviour = ":".join(feedback.id.split(":")[:2])
                point = feedback.id[len(behaviour) + 1 :]
                # A prediction cannot have the n-th stroke, and a mark that only a description has.
                if ":" not in point and (behaviour not in described or point in points[behaviour]):
                    assert points[behaviour][point] == pytest.approx(feedback.time, abs=WITHIN)
            case BlockProgress(status="IN_EXEC" | "DONE"):
                id, _, point = feedback.id.rpartition(":")
                expected = blocks[id][point == "end"]
                assert expected == pytest.approx(feedback.global_time, abs=WITHIN), feedback.id


def predicted_points(node: Behaviour) -> dict[str, float]:
    points = {name: ref.offset for name, ref in node.syncs.items()}
    if isinstance(node, Speech) and node.text is not None:
        points |= {p.id: p.ref.offset for p in node.text.parts if isinstance(p, Sync) and p.ref is not None}
    return points


def behaviours_have_one_warning(case: Case) -> None:
    """A behaviour has at most one warning, until its block has ended and its id may be used again."""
    warned: set[str] = set()
    for feedback in play_once(case).feedback:
        if isinstance(feedback, WarningFeedback) and ":" in feedback.id:
            assert feedback.id not in warned, feedback.text
            warned.add(feedback.id)
        elif isinstance(feedback, BlockProgress) and feedback.id.endswith(":end"):
            warned = {id for id in warned if not id.startswith(feedback.id.removesuffix("end"))}


def faces_never_jump(case: Case) -> None:
    """Faces change smoothly when a block starts or is replaced, a sync point passes or a plan changes."""
    if "behaviour.short" in case.proves:
        return  # very short behaviours change as fast as a jump
    played = play_once(case)
    times = {*case.wanted.get("sent", ()), *(time for line in played.log for time in line.times)}
    around = [(time - 1e-4, time + 1e-4) for time in sorted(times) if time > 0]
    for character in {f.character_id for f in played.feedback}:
        instants = [Instant(time, character) for pair in around for time in pair]
        faces = play(case, instants=instants).faces
        rows = np.array([[faces[instant][au] for au in AU_NAMES()] for instant in instants])
        jumps = np.abs(rows[1::2] - rows[::2])
        assert not (jumps > 0.02).any(), f"after {around[int(jumps.max(axis=1).argmax())][0]:.3f} s"


def blocks_pass_every_sync_point_in_order(case: Case) -> None:
    if b"interrupt" in case.document:
        return  # a behaviour that is interrupted does not pass all its points
    played = play_once(case)
    lines = [line for line in played.log if line.kind == "sync"]
    for id, schedule in played.schedules.items():
        if [b.id for b in played.blocks].count(id) > 1:
            continue  # its schedule is that of the last block with its id
        ends = [line for line in played.log if line.kind == "end" and line.id == id]
        if not ends or ends[0].words[:1] != ("DONE",):
            continue
        for behaviour, points in schedule.points.items():
            own = [line.id for line in lines if line.id.startswith(f"{id}:{behaviour}:")]
            assert own == [f"{id}:{behaviour}:{point}" for point in points]


def behaviours_that_began_end_before_their_block(case: Case) -> None:
    """Each sync point `start` of a behaviour has its `end`, also if the block is interrupted or replaced."""
    begun: set[str] = set()
    for feedback in play_once(case).feedback:
        behaviour, _, point = (
            feedback.id.rpartition(":") if isinstance(feedback, SyncPointProgress) else [""] * 3
        )
        if point == "start":
            begun.add(behaviour)
        elif point == "end":
            begun.remove(behaviour)
        elif isinstance(feedback, BlockProgress) and feedback.id.endswith(":end"):
            assert not [id for id in begun if id.startswith(feedback.id.removesuffix("end"))]
    assert not begun


def feedback_does_not_depend_on_the_calls_of_due(case: Case) -> None:
    """Live and offline agree: `due` is called at every deadline, or only when a document is sent."""
    punctual, seldom = play_once(case), play(case, punctual=False)
    assert list(map(str, seldom.log)) == list(map(str, punctual.log))


def sessions_play_it_as_it_is_played_offline(case: Case) -> None:
    """A session of the service gives the same feedback, with documents in messages and voices that answer."""
    if "ready" in case.wanted or case.is_bytes:
        return  # voices answer at once here
    lines = [line for line in play_once(case).log if line.kind != "prediction"]
    assert list(map(str, play_in_session(case))) == list(map(str, lines))


def documents_can_be_written_and_read_again(case: Case) -> None:
    for block in play_once(case).blocks:
        assert parse(write(block), VOCABULARY) == block


LAWS = (
    plays_as_expected,
    feedback_is_ordered_and_complete,
    predictions_equal_the_progress,
    behaviours_have_one_warning,
    faces_never_jump,
    blocks_pass_every_sync_point_in_order,
    behaviours_that_began_end_before_their_block,
    feedback_does_not_depend_on_the_calls_of_due,
    sessions_play_it_as_it_is_played_offline,
    documents_can_be_written_and_read_again,
)


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
@each_row("holds", LAWS)
def test_corpus_case_keeps_every_law(case: Case, holds: Callable[[Case], None]) -> None:
    holds(case)
