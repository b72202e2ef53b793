"""The task runner of an Xface client: tasks to documents, feedback to notifications."""

import json
import logging
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from bml_schema import BlockProgress, PredictionFeedback, WarningFeedback
from bml_schema.feedback import parse_feedback
from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours.keyframes import document_of
from realizer.core.errors import RealizerError
from realizer.server.transports.message_formats import Disconnect, Inbound
from realizer.server.transports.xface.attachments import Attachment, MissingAttachment, Script
from realizer.server.transports.xface.wire import Status, Task, pack_note
from realizer.tables import faps

log = logging.getLogger(__name__)

Answer = bytes | Inbound | Disconnect
ERROR = pack_note("ERROR", 0, 0, Status.ERROR)
# Tasks of Xface's own player for its meshes, scripts and films, which have no equivalent here.
UNABLE = (
    "LOAD_WAV", "LOAD_PHO", "LOAD_ANIM", "LOAD_FDP", "UPLOAD_WAV", "UPLOAD_PHO", "UPLOAD_ANIM", "UPLOAD_FDP",
    "UPLOAD_APML", "SAVE_AVI",
)  # fmt: skip
ABLE = (
    "UPLOAD_FAP", "LOAD_FAP", "UPLOAD_SCRIPT", "RESUME_PLAYBACK", "STOP_PLAYBACK", "REWIND_PLAYBACK",
    "PAUSE_PLAYBACK", "RENDER_FRAME", "ADVANCE_FRAME", "KILL_APP",
)  # fmt: skip
_NAMES = tuple(row.name for row in faps()[2:])
MAX_WAITING = 100  # queued tasks of a client


@dataclass(eq=False, slots=True)
class _RunningTask:
    """A task whose blocks play, or will: of a clip, or of a script. `planned` blocks were accepted."""

    task: Task
    blocks_left: set[str]
    clip: FAPClip | None = None
    planned: set[str] = field(default_factory=set)
    started: bool = False
    began: float = 0.0  # s


class TaskRunner:
    """The player as one client sees it: its loaded clip, what plays, and what is queued.

    A FAP file plays as a BML block with a generated id. A pose is held by a `set` message that releases all
    other FAPs, since each frame of a player stands alone. The FAPs of the frame before are set to 0 first,
    because released ones fade slowly.
    """

    def __init__(self, owner: int) -> None:
        self.owner = owner
        self._clip: FAPClip | None = None
        self._first = 0  # the frame where playback begins
        self._moved: dict[str, float] = {}  # names of the FAPs of the held pose -> 0
        self._playing: _RunningTask | None = None
        self._waiting: deque[Task] = deque()
        self._scripts: list[_RunningTask] = []
        self._count = 0

    def accept(self, task: Task) -> Iterator[Answer]:
        """Yield the answers to a task that has arrived, before it runs."""
        if task.name not in ABLE + UNABLE:
            log.info("xface: wanted a task of the player, got %s", task.name)
            yield from self.refuse(task)
        elif task.name != "KILL_APP":
            yield from _notes(task, Status.QUEUED)

    def refuse(self, task: Task) -> Iterator[Answer]:
        """Yield the answers to an unknown or unreadable task."""
        if task.name in ABLE + UNABLE:
            yield from _notes(task, Status.ERROR)
        else:
            yield pack_note("ERROR", task.owner, task.id, Status.ERROR)

    def run(self, task: Task, attachment: Attachment, now: float) -> Iterator[Answer]:
        """Run an accepted task and yield the answers.

        Args:
            attachment: that `prepare` returned, or its error.
        """
        if isinstance(attachment, RealizerError) or task.name in UNABLE:
            log.info("xface: %s: %s", task.name, attachment or "not something this player does")
            yield from _notes(task, Status.ERROR)
            # Clients of Xface's own player rely on the second note.
            if "FAP" in task.name and not isinstance(attachment, MissingAttachment):
                yield from _notes(task, Status.FINISHED)
            return
        match task.name, attachment:
            case (("UPLOAD_FAP" | "LOAD_FAP"), FAPClip()):
                yield from _notes(task, Status.STARTED)
                self._clip, self._first = attachment, 0
                if len(attachment.values) == 1 and self._playing is None:
                    yield self._show(0)  # at once; Xface's own player waits for a stop
                yield from _notes(task, Status.FINISHED)
            case "UPLOAD_SCRIPT", Script(text, blocks):
                self._scripts.append(_RunningTask(task, set(blocks)))
                yield Inbound(text)
            case "RESUME_PLAYBACK", _:
                yield from self._resume(task)
            case (("STOP_PLAYBACK" | "REWIND_PLAYBACK"), _):
                yield from self._stop(rewind=True)
                yield from _notes(task, Status.FINISHED)
            case "PAUSE_PLAYBACK", _:
                running, clip = self._playing, self._clip
                if running is not None and clip is not None and running.clip is clip and running.started:
                    passed = int((now - running.began) * clip.fps)
                    self._first = min(self._first + max(passed, 0), len(clip.values) - 1)
                yield from self._stop(rewind=False)
                yield from _notes(task, Status.FINISHED)
            case "ADVANCE_FRAME", _:
                if self._clip is not None and self._playing is None:
                    self._first = min(self._first + 1, len(self._clip.values) - 1)
                    yield self._show(self._first)
            case "KILL_APP", _:
                yield from _notes(task, Status.FINISHED)
                yield Disconnect()

    def on_feedback(self, text: str, now: float) -> Iterator[Answer]:
        """Yield the answers to a message of the session."""
        if not text.startswith("<"):
            return
        all_running = [*self._scripts, *([self._playing] if self._playing is not None else [])]
        if not all_running:
            return
        match parse_feedback(text):
            case PredictionFeedback(blocks=blocks):
                for running in all_running:
                    running.planned |= {b.id for b in blocks if b.status != "IN_PREP"} & running.blocks_left
            case BlockProgress(id=id):
                block, _, point = id.rpartition(":")
                for running in [r for r in all_running if block in r.blocks_left]:
                    if point == "start" and not running.started:
                        running.started, running.began = True, now
                        yield from _notes(running.task, Status.STARTED)
                    elif point == "end":
                        yield from self._ended(running, block)
            case WarningFeedback(id=block, text=reason):
                for running in [r for r in all_running if block in r.blocks_left - r.planned]:
                    log.info("xface: %s: %s: %s", running.task.name, block, reason)
                    yield from self._ended(running, block)

    def _ended(self, running: _RunningTask, block: str) -> Iterator[Answer]:
        """Handle the end, or the refusal, of a block, and of its task with the last one."""
        running.blocks_left.discard(block)
        if running.blocks_left:
            return
        yield from _notes(running.task, Status.FINISHED if running.started else Status.ERROR)
        if running is not self._playing:
            self._scripts.remove(running)
            return
        self._playing, self._first = None, 0
        while self._waiting and self._playing is None:
            yield from self._resume(self._waiting.popleft())

    def _resume(self, task: Task) -> Iterator[Answer]:
        if self._playing is not None and len(self._waiting) < MAX_WAITING:
            self._waiting.append(task)
        elif self._clip is None or self._playing is not None:
            yield from _notes(task, Status.ERROR)
        elif len(self._clip.values) - self._first < 2 or not self._clip.mask[2:].any():
            yield from _notes(task, Status.STARTED)
            yield self._show(self._first)
            yield from _notes(task, Status.FINISHED)
        else:
            self._count += 1
            block = f"xface-{self.owner}-{self._count}"
            document = document_of(self._clip.from_frame(self._first), block)
            self._playing = _RunningTask(task, {block}, self._clip)
            self._moved = {}
            yield _hold_faps({})
            yield Inbound(document)

    def _stop(self, *, rewind: bool) -> Iterator[Answer]:
        """End all tasks that play or wait, and show the frame where playback would begin."""
        ended = [] if self._playing is None else [self._playing]
        self._playing = None
        if rewind:
            self._first = 0
            ended += self._scripts
            self._scripts = []
        if ended:
            blocks = {block for running in ended for block in running.blocks_left}
            yield Inbound(json.dumps({"type": "stop", "blocks": sorted(blocks)}))
        for running in ended:
            if not running.started:
                yield from _notes(running.task, Status.STARTED)
            yield from _notes(running.task, Status.FINISHED)
        waiting, self._waiting = self._waiting, deque()
        for task in waiting:
            yield from _notes(task, Status.FINISHED)
        if self._clip is not None:
            yield self._show(self._first)

    def _show(self, frame: int) -> Inbound:
        assert self._clip is not None
        values: dict[str, float] = {}
        for row, value in zip(faps(), self._clip.values[frame].tolist(), strict=True):
            if value:
                values[row.name] = max(row.least, min(row.most, float(value)))
        message = _hold_faps(self._moved | values)
        self._moved = dict.fromkeys(values, 0.0)
        return message


def _hold_faps(values: dict[str, float]) -> Inbound:
    return Inbound(json.dumps({"type": "set", "faps": dict.fromkeys(_NAMES) | values}))


def _notes(task: Task, status: Status) -> Iterator[bytes]:
    if task.owner:
        yield pack_note(task.name, task.owner, task.id, status)
