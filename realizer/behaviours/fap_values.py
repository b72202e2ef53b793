"""faps, fapFile: a pose or a file of facial animation parameters as channels."""

import numpy as np

from bml_schema import FapFile, Faps
from realizer import tables
from realizer.animation.axis import fap
from realizer.animation.channel import Channel, Layer
from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours import media
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext, table_timing
from realizer.behaviours.pose_channels import track
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing

# 1/s^2; a recording is stiffer than an expression, and less stiff than speech.
RECORDED = 100.0
MAX_BYTES = 8 * 2**20  # of text; about ten minutes, read in about a second


def expand(node: Faps, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels with these FAPs from attackPeak to relax; they override other behaviours."""
    weight = np.array([0.0, 1.0, 1.0, 0.0])
    return tuple(
        Channel(fap(part.number), times, part.value * weight, layer=Layer.FAPS, weight=weight, source=node.id)
        for part in node.values
    )


def check(node: Faps, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: a repeated number is fatal, a value out of range is not."""
    rows = tables.faps()
    seen: set[int] = set()
    faults: list[Fault] = []
    for part in node.values:
        row = rows[part.number - 1]
        if part.number in seen:
            text = f"fap: wanted each number once, got {part.number} ({row.name}) twice"
            return (Fault("CANNOT_CREATE_BEHAVIOR", text),)
        seen.add(part.number)
        faults += out_of_range(part.number, part.value, part.value)
    return tuple(faults)


def claims(node: Faps, context: PlanningContext) -> frozenset[str]:
    return frozenset(f"FAP {part.number}" for part in node.values)


def timing_of_file(node: FapFile, context: PlanningContext) -> Timing:
    clip = media.load(node.file_name, context, read)
    length = (len(clip.values) - 1) / clip.fps
    return Timing(("start", "end"), np.array([length]), np.zeros(1), np.array([RECORDED]))


def expand_file(node: FapFile, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return its frames from start to end, instead of other behaviours, with a smooth beginning and end."""
    clip = media.load(node.file_name, context, read)
    keys = np.linspace(times[0], times[-1], len(clip.values))
    return tuple(
        track(fap(number), keys, clip.values[:, number - 1].astype(np.float64), node.id)
        for number in moved(clip)
    )


def check_file(node: FapFile, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: an unreadable file is fatal; wrong values of FAPs are not."""
    if faults := media.faults(node.file_name, context, read):
        return faults
    clip = media.load(node.file_name, context, read)
    words = [note for note in clip.notes if note.startswith(("FAP 1:", "FAP 2:"))]
    least, most = clip.values.min(axis=0).tolist(), clip.values.max(axis=0).tolist()
    far = [n for n in moved(clip) if out_of_range(n, least[n - 1], most[n - 1])]
    if far:
        words.append(f"FAP {', '.join(map(str, far))} beyond the range of the standard are limited to it")
    text = f"fileName: {node.file_name}: {'; '.join(words)}"
    return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", text, fatal=False),) if words else ()


def claims_of_file(node: FapFile, context: PlanningContext) -> frozenset[str]:
    return frozenset(f"FAP {number}" for number in moved(media.load(node.file_name, context, read)))


def read(content: bytes) -> FAPClip:
    """Read the clip of a file, and expand its visemes and expressions.

    Raises:
        MediaError: fewer than two frames, or too much text.
        RealizerError: no FAP text.
    """
    if len(content) > MAX_BYTES:
        raise media.MediaError(
            f"wanted at most {MAX_BYTES // 2**20} MiB of FAP text, got {len(content)} bytes"
        )
    # Few documents play files; the reader of their text is long.
    from realizer.animation.fap.fap_reader import read_fap
    from realizer.behaviours.fap_visemes import expand_compound

    clip = expand_compound(read_fap(content))
    if len(clip.values) < 2:
        raise media.MediaError(f"wanted at least two frames, got {len(clip.values)}")
    return clip


def moved(clip: FAPClip) -> list[int]:
    """Return the FAPs from 3 on that are not always 0."""
    return [int(column) + 1 for column in np.flatnonzero(clip.values.any(axis=0)) if column >= 2]


def out_of_range(number: int, least: float, most: float) -> tuple[Fault, ...]:
    """Return a fault, not fatal, if values are beyond the range of a FAP."""
    row = tables.faps()[number - 1]
    if row.least <= least and most <= row.most:
        return ()
    got = most if most > row.most else least
    text = f"FAP {number} ({row.name}): wanted {row.least:g}..{row.most:g}, got {got:g}; limited to it"
    return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", text, fatal=False),)


KINDS = (
    BehaviourKind(Faps, table_timing("faps"), expand, check, claims=claims, parameters={"amount": 1.0}),
    BehaviourKind(
        FapFile, timing_of_file, expand_file, check_file, claims=claims_of_file, parameters={"amount": 1.0}
    ),
)
