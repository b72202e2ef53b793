"""Tests of random valid documents, and of the laws that their feedback must keep."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from bml_schema import (
    VOCABULARY,
    Block,
    BlockProgress,
    Feedback,
    Interrupt,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
    read,
    with_absolute_times,
    write,
)
from realizer.animation.fap.conversion import to_fap
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech
from realizer.scheduling.timing import Schedule
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import STRETCH
from tests.grammar import KINDS, texts

LATEST = 600.0  # s; no document of the grammar takes so long
APART = 0.3  # s between the documents of a text


def test_grammar_documents_play_to_their_end_with_complete_feedback(pytestconfig: pytest.Config) -> None:
    wanted = pytestconfig.getoption("documents") or 5 * settings().max_examples

    @settings(max_examples=wanted, suppress_health_check=list(HealthCheck))
    @given(texts())
    def holds(text: str) -> None:
        plays(text)

    holds()


def test_grammar_writes_every_behaviour() -> None:
    assert KINDS.keys() == {tag.rpartition("}")[2] for tag in VOCABULARY}


SOUND = """<bml id="b"><head id="n" lexeme="NOD"/><wait id="w" start="n:end" duration="1"/>
<faceLexeme id="x" lexeme="NOPE"/></bml>"""


def feedback_of(text: str) -> tuple[Block, Schedule, list[Feedback]]:
    player = Player(PlayOptions(idle=False))
    (block,) = read(text)
    assert isinstance(block, Block)
    schedule = player.submit(block, 0.0)
    return block, schedule, run(player, LATEST)


def test_check_feedback_accepts_sound_feedback() -> None:
    well_reported(*feedback_of(SOUND), calm=True)


def test_check_feedback_notices_missing_repeated_and_late_messages() -> None:
    block, schedule, feedback = feedback_of(SOUND)
    for n, message in enumerate(feedback):
        if isinstance(message, PredictionFeedback):
            continue  # there may be several, whenever the plan changes
        rest = feedback[:n] + feedback[n + 1 :]
        last = n + 1 == len(feedback)
        for wrong in (rest, [*rest, message, message], [message, *rest] if last else [*rest, message]):
            with pytest.raises(AssertionError):
                well_reported(block, schedule, wrong, calm=True)


def plays(text: str) -> None:
    """Read, submit and play to the end; check all laws of valid texts."""
    player = Player(PlayOptions(idle=False))
    blocks: list[Block] = []
    schedules: list[Schedule] = []
    feedback: list[Feedback] = []
    now = 0.0
    for item in read(text, VOCABULARY):
        assert isinstance(item, Block), item
        # A foreign attribute may be a word of a dialect.
        assert {p.type for p in item.problems} <= {"CUSTOM_ATTRIBUTE_NOT_SUPPORTED", "NOT_BML_1_0"}, (
            item.problems
        )
        assert list(read(write(item), VOCABULARY)) == [item], "written back, it means the same"
        feedback += run(player, now)
        blocks.append(item)
        schedules.append(submit_with_speech(player, item, SilentVoice(), now))
        now += APART
    assert blocks
    if not schedules[0].failed and can_be_asked_for(blocks[0], schedules[0]):
        stays(blocks[0], schedules[0])
    calm = not any(map(ends_or_withholds, blocks))
    latest = [player.latest(schedule) for schedule in schedules]
    faces(player)
    feedback += run(player, LATEST)
    done = {f.id.rpartition(":")[0] for f in feedback if isinstance(f, BlockProgress) and f.status == "DONE"}
    for block, planned, moved in zip(blocks, schedules, latest, strict=True):
        # A later block may have moved an earlier one, and dropped what cannot follow.
        schedule = moved if calm and block.id in done else planned
        well_reported(block, schedule, feedback, calm)
        if calm:
            well_predicted(block, feedback)
    well_composed(blocks, feedback)
    progress = [f.global_time for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)]
    assert progress == sorted(progress)


def can_be_asked_for(block: Block, schedule: Schedule) -> bool:
    """Whether a document may state the lengths that the voice chose between the syncs of its speeches.

    A voice that speaks a text faster shortens some parts more than `STRETCH` allows a document to state.
    """
    for id, say in Player(PlayOptions(idle=False)).speech_requests(block).items():
        if id not in schedule.times:
            continue
        spoken = SilentVoice().say(say)
        ends = [0.0, *sorted(spoken.marks.values()), spoken.duration]
        shares = np.diff(schedule.times[id]) / np.maximum(np.diff(ends), 1e-9)
        if len(say.marks) and not (STRETCH[0] <= shares.min() and shares.max() <= STRETCH[1]):
            return False
    return True


def stays(block: Block, schedule: Schedule) -> None:
    """Check that a block written back with its times is scheduled to the same times."""
    (again,) = read(write(with_absolute_times(block, schedule.behaviours)), VOCABULARY)
    assert isinstance(again, Block)
    player = Player(PlayOptions(idle=False))
    second = submit_with_speech(player, again, SilentVoice())
    assert second.times.keys() == schedule.times.keys()
    for behaviour, times in schedule.times.items():
        assert np.abs(second.times[behaviour] - times).max() < 1e-6


def ends_or_withholds(block: Block) -> bool:
    """Whether it may end blocks early, or not start on its own."""
    interrupts = block.interrupt or any(isinstance(node, Interrupt) for node in block.behaviours)
    return bool(interrupts) or block.composition == "REPLACE" or block.preplan


def run(player: Player, until: float) -> list[Feedback]:
    """Return everything that is due up to `until`, from deadline to deadline."""
    feedback: list[Feedback] = []
    for _ in range(10_000):
        deadline = player.next_deadline()
        if deadline is None or deadline > until:
            return feedback
        feedback += player.due(max(deadline, 0.0))
    raise AssertionError("it goes on for ever")


def faces(player: Player) -> None:
    """Check the ranges of every face at a few instants."""
    times = np.linspace(0, max(player.end, 0.1), 4)
    for character in range(len(player.characters)):
        frames = player.frames(times, character)
        assert np.isfinite(frames.values).all()
        assert frames.aus.min() >= 0
        assert frames.aus.max() <= 1
        assert np.isfinite(to_fap(frames).values).all()


def well_reported(block: Block, schedule: Schedule, feedback: list[Feedback], calm: bool) -> None:
    """Check that the feedback of one block is complete, without repetition, and in order.

    Args:
        calm: nothing in the text ends or withholds blocks early.
    """
    own = [f for f in feedback if block.id in ids(f)]
    starts = [n for n, f in enumerate(own) if isinstance(f, BlockProgress) and f.id == f"{block.id}:start"]
    ends = [n for n, f in enumerate(own) if isinstance(f, BlockProgress) and f.id == f"{block.id}:end"]
    points = [(n, f) for n, f in enumerate(own) if isinstance(f, SyncPointProgress)]
    warnings = Counter(f.id for f in own if isinstance(f, WarningFeedback))
    if schedule.failed:
        assert warnings[block.id] == 1
        assert not starts
        assert not points
        return
    predictions = [n for n, f in enumerate(own) if isinstance(f, PredictionFeedback)]
    assert predictions, "a block is acknowledged by a prediction"
    assert len(starts) <= 1
    assert len(ends) <= 1
    end = own[ends[0]] if ends else None
    done = isinstance(end, BlockProgress) and end.status == "DONE"
    if calm:
        assert done or warnings[block.id] == 1, "a block is played to its end, or says why not"
    if not starts:
        assert not points
        return
    (start,) = starts
    first = own[start]
    assert isinstance(first, BlockProgress)
    assert predictions[0] < start
    assert all(n > start for n, _ in points)
    assert all(n < ends[0] for n, _ in points for _ in ends)
    assert len({f.id for _, f in points}) == len(points), "each once"
    times = [f.time for _, f in points]
    assert times == sorted(times)
    for _, f in points:
        assert math.isclose(f.global_time, first.global_time + f.time, abs_tol=1e-6)
    order = {f"{block.id}:{b}:{p}": n for b, names in schedule.points.items() for n, p in enumerate(names)}
    per: dict[str, list[int]] = {}
    for _, f in points:
        per.setdefault(f.id.split(":")[1], []).append(order[f.id])
    for behaviour, told_points in per.items():
        assert told_points == sorted(told_points)
        if calm and done:
            assert told_points == list(range(len(schedule.points[behaviour])))
    dropped = {node.id for node in block.behaviours} - schedule.times.keys()
    for behaviour in dropped:
        assert warnings[f"{block.id}:{behaviour}"] == 1, f"{behaviour} is dropped with one warning"
    if calm and done:
        assert per.keys() == schedule.times.keys()
    last = ends[0] if ends else len(own)
    assert all(n < last for n, f in enumerate(own) if isinstance(f, WarningFeedback))


def well_predicted(block: Block, feedback: list[Feedback]) -> None:
    """Check that the last prediction of a played block is what happened."""
    start: float | None = None
    times: dict[str, float] = {}
    happened: dict[str, float] = {}
    for f in feedback:
        if isinstance(f, PredictionFeedback):
            start = next((b.global_start for b in f.blocks if b.id == block.id), start)
            for node in f.behaviours:
                if node.id.startswith(f"{block.id}:"):
                    times |= {f"{node.id}:{p}": ref.offset for p, ref in node.syncs.items()}
        elif isinstance(f, BlockProgress) and f.id == f"{block.id}:start":
            assert start == pytest.approx(f.global_time, abs=1e-6)
        elif isinstance(f, SyncPointProgress) and f.id.startswith(f"{block.id}:"):
            happened[f.id] = f.time
    for point in times.keys() & happened.keys():
        assert times[point] == pytest.approx(happened[point], abs=1e-5), point


def well_composed(blocks: list[Block], feedback: list[Feedback]) -> None:
    """Check that dependencies of APPEND, and blocks that REPLACE replaces, have ended."""
    starts = {f.id.rpartition(":")[0]: (n, f) for n, f in enumerate(feedback) if started(f)}
    ends = {f.id.rpartition(":")[0]: (n, f) for n, f in enumerate(feedback) if ended(f)}
    first = next((b.character_id for b in blocks if b.character_id), None)
    idle: set[str] = set()  # blocks that wait for an activation, or for a block that does
    for block in blocks:
        if block.preplan or idle & {*block.append_after, *block.chunk_after}:
            idle.add(block.id)
    for n, block in enumerate(blocks):
        if block.composition == "MERGE" or block.id not in starts:
            continue
        for earlier in blocks[:n]:
            if earlier.id in idle:
                continue  # no block waits for it
            if (earlier.character_id or first) == (block.character_id or first) and earlier.id in starts:
                assert ends[earlier.id][0] < starts[block.id][0], (
                    f"{earlier.id} ends before {block.id} starts"
                )


def started(f: Feedback) -> bool:
    return isinstance(f, BlockProgress) and f.id.endswith(":start")


def ended(f: Feedback) -> bool:
    return isinstance(f, BlockProgress) and f.id.endswith(":end")


def ids(feedback: Feedback) -> set[str]:
    """Return the ids of the blocks that a message is about."""
    if isinstance(feedback, PredictionFeedback):
        return {block.id for block in feedback.blocks}
    return {feedback.id.split(":")[0]}
