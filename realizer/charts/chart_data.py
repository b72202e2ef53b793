"""Chart data of the blocks that play."""

import math
from collections.abc import Callable, Iterable

from bml_schema import Behaviour, Block, Place
from bml_schema.node_schema import local
from realizer.charts.links import Link, links_of
from realizer.charts.timeline import BehaviourRow, BlockChart, Dropped, Gap, Point, WordSpan
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_links import ExternalTimes
from realizer.playback.block_store import BlockStore
from realizer.scheduling.timing import Schedule, Timing, Warning


def charts_of(cast: BlockStore, schedules: Iterable[Schedule]) -> list[BlockChart]:
    """Return the charts of a player's blocks, one for each schedule that `submit` returned."""
    playing = {id(p.first_schedule): p for p in cast.all()}
    found = ((schedule, playing.get(id(schedule))) for schedule in schedules)
    return [_refused(s) if known is None else chart_of(known, cast.schedule_of) for s, known in found]


def chart_of(playing: ActiveBlock, schedule_of: Callable[[str], Schedule | None]) -> BlockChart:
    """Return the chart of a block in its present state.

    Args:
        schedule_of: block id -> its schedule, for links to other blocks.
    """
    block, schedule = playing.block, playing.schedule.known
    known = playing.has_known_start
    start = schedule.start if known else None
    links = links_of(block, schedule, ExternalTimes(schedule_of, schedule.start if known else 0.0))
    own = tuple(
        _behaviour_row(playing, schedule, node, start, tuple(links.get(node.id, ())))
        for node in block.behaviours
        if node.id in schedule.times
    )
    warnings = tuple(dict.fromkeys((*playing.first_schedule.warnings, *schedule.warnings)))
    dropped = [d for w in warnings if (d := _dropped(w, block, schedule)) is not None]
    names = {d.id for d in dropped}
    dropped += [
        _cut(playing, id) for id in playing.first_schedule.times if id not in (*names, *schedule.times)
    ]
    end = (schedule.end if playing.stopped_at is None else playing.stopped_at) if known else None
    return BlockChart(
        block.id, block.character_id, playing.state.value, start, end, own, tuple(dropped), warnings
    )


def _behaviour_row(
    playing: ActiveBlock,
    schedule: Schedule,
    node: Behaviour,
    start: float | None,
    links: tuple[Link, ...],
) -> BehaviourRow:
    names, times = schedule.points[node.id], schedule.times[node.id].tolist()
    points = tuple(
        Point(name, time, None if start is None else start + time)
        for name, time in zip(names, times, strict=True)
    )
    utterance = playing.context.utterances.get(node.id)
    spans = (
        WordSpan(times[0] + w.start, times[0] + w.end, w.text)
        for w in (utterance.words if utterance is not None else ())
    )
    return BehaviourRow(
        node.id,
        local(node.tag),
        _element(playing.block.places.get(node.id))[1],
        node.id in playing.block.required,
        points,
        _gaps(names, times, playing.plan.timings.get(node.id)),
        links,
        tuple(span for span in spans if span.start < times[-1]),
    )


def _gaps(names: tuple[str, ...], times: list[float], timing: Timing | None) -> tuple[Gap, ...]:
    gaps = [
        Gap(begin, end, after - before)
        for begin, end, before, after in zip(names[:-1], names[1:], times[:-1], times[1:], strict=True)
    ]
    if timing is None or timing.points != names:
        return tuple(gaps)
    if timing.rigid:
        return tuple(
            g._replace(preferred=p, least=p, most=p, rigid=True)
            for g, p in zip(gaps, timing.preferred.tolist(), strict=True)
        )
    most = [math.inf] * len(gaps) if timing.most is None else timing.most.tolist()
    wants = zip(
        timing.preferred.tolist(), timing.least.tolist(), timing.stiffness.tolist(), most, strict=True
    )
    return tuple(
        g._replace(preferred=p, least=least, stiffness=a, most=limit if math.isfinite(limit) else None)
        for g, (p, least, a, limit) in zip(gaps, wants, strict=True)
    )


def _dropped(warning: Warning, block: Block, schedule: Schedule) -> Dropped | None:
    """Return the dropped behaviour of a warning, or None if the warning is about something that plays."""
    prefix = f"{block.id}:"
    id = warning.id.removeprefix(prefix) if warning.id.startswith(prefix) else ""
    problem = next((p for p in block.problems if (p.id, p.type) == (warning.id, warning.type)), None)
    if id in schedule.times if problem is None else not problem.dropped:
        return None
    place = Place(problem.line, problem.path) if problem is not None else block.places.get(id or warning.id)
    return Dropped(id or warning.id, *_element(place), warning.type, warning.text)


def _element(place: Place | None) -> tuple[str | None, int | None]:
    """Return the name of an element, and its line."""
    if place is None:
        return None, None
    return place.path.rpartition("/")[2].partition("[")[0].rpartition(":")[2] or None, place.line


def _cut(playing: ActiveBlock, id: str) -> Dropped:
    """Return a behaviour that was cut off before it began."""
    element, line = _element(playing.block.places.get(id))
    when = "" if playing.stopped_at is None else f" at {playing.stopped_at:.3f} s"
    # A block that waited is without it by now.
    tag = next((node.tag for node in playing.block.behaviours if node.id == id), None)
    element = element if tag is None else local(tag)
    return Dropped(id, element, line, playing.state.value, f"cut off{when}, before it began")


def _refused(schedule: Schedule) -> BlockChart:
    gone = tuple(Dropped(w.id, None, None, w.type, w.text) for w in schedule.warnings)
    start, warnings = schedule.start, schedule.warnings
    return BlockChart(schedule.block, schedule.character, "FAILED", start, start, (), gone, warnings)
