"""The eight steps of a document, each described by what came out of it."""

from base64 import b64encode
from collections.abc import Callable, Iterator
from dataclasses import replace
from html import escape
from typing import NamedTuple

import numpy as np

from bml_schema.node_schema import local
from realizer.animation.axis import AU_NAMES
from realizer.charts.chart_data import charts_of
from realizer.charts.picture import timeline
from realizer.charts.scale import scale_of
from realizer.charts.shapes import Picture
from realizer.charts.svg import svg
from realizer.core.array_types import Float64
from realizer.core.errors import RealizerError
from realizer.face.deform import deform
from realizer.outputs.png import encode_png
from realizer.playback.active_block import ActiveBlock
from realizer.result import Realization
from realizer.scheduling.problem import Member, problem_of
from realizer.tables import faps
from realizer_studio.document_panels import Panel, panels

MOST = 8  # action units, FAPs and keys that are listed


class Step(NamedTuple):
    """A step: its name, where it is done, what it does, and lines about this document."""

    name: str
    place: str
    description: str
    lines: list[str]


def steps_of(played: Realization) -> list[Step]:
    """Return the eight steps of what was realized; those of the last three are of the first character."""
    active = [] if played.blocks is None else list(played.blocks.all())
    return [
        Step("parse", "bml_schema", "reads XML into typed nodes", _each(active, _nodes)),
        Step("time", "realizer.behaviours", "states the gaps that each prefers", _each(active, _timings)),
        Step("schedule", "realizer.scheduling", "finds all times by least squares", _each(active, _schedule)),
        Step("expand", "realizer.behaviours", "gives key times and values of targets", _each(active, _keys)),
        Step(
            "blend", "realizer.animation", "adds layers, idle motion and lips: action units", _units(played)
        ),
        Step("map", "realizer.animation.fap", "turns action units into 68 FAPs", _faps(played)),
        Step("deform", "realizer.face", "moves the vertices of the face", _vertices(played)),
        Step("draw", "realizer.render", "draws a picture of each frame", _frames(played)),
    ]


def as_text(steps: list[Step]) -> str:
    """Return the steps as text."""
    parts = []
    for number, step in enumerate(steps, 1):
        parts += [
            f"{number} {step.name} ({step.place}): {step.description}",
            *(f"    {x}" for x in step.lines),
        ]
    return "\n".join(parts) + "\n"


def as_html(steps: list[Step], played: Realization) -> str:
    """Return the steps as a page, with a timeline in step 3, and a picture in step 8 if it can be drawn."""
    parts = ["<!doctype html><meta charset='utf-8'><title>The eight steps</title>"]
    for number, step in enumerate(steps, 1):
        parts.append(
            f"<h2>{number} {step.name}</h2><p>{escape(step.description)} (<code>{step.place}</code>)"
        )
        parts.append(f"<pre>{escape(chr(10).join(step.lines))}</pre>")
        if step.name == "schedule" and played.blocks is not None:
            accepted = [active.first_schedule for active in played.blocks.all()]
            parts.append(svg(timeline(charts_of(played.blocks, accepted))))
        if step.name == "draw":
            try:
                data = b64encode(encode_png(played.picture(_shown_at(played)))).decode()
                parts.append(f'<img alt="the face" src="data:image/png;base64,{data}">')
            except RealizerError as error:
                parts.append(f"<p>{escape(str(error))}")
    return "\n".join(parts) + "\n"


def as_picture(steps: list[Step], played: Realization) -> Picture:
    """Return a picture of the steps: their lines, the timeline of step 3, the curves of steps 5 and 6."""
    blocks = [] if played.blocks is None else list(played.blocks.all())
    charts = [] if played.blocks is None else charts_of(played.blocks, [b.first_schedule for b in blocks])
    times = np.arange(played.frames) / played.fps
    curves = {"blend": played.aus.aus, "map": played.faps.values}
    parts = []
    for number, step in enumerate(steps, 1):
        part = Panel(f"{number} {step.name}", f"{step.description} ({step.place})", step.lines)
        if step.name == "schedule":
            part = replace(part, inset=timeline(charts))
        if step.name in curves:
            values = np.asarray(curves[step.name], np.float64)
            part = replace(part, curves=values[:, _largest(values)], times=times)
        parts.append(part)
    return panels("The eight steps", parts, scale_of(charts))


def _each(active: list[ActiveBlock], lines: Callable[[ActiveBlock], Iterator[str]]) -> list[str]:
    return [line for block in active for line in lines(block)]


def _nodes(active: ActiveBlock) -> Iterator[str]:
    block = active.block
    yield f"{block.id}: {len(block.behaviours)} behaviours, {len(block.constraints)} constraints"
    for node in block.behaviours:
        syncs = "".join(f' {name}="{ref}"' for name, ref in node.syncs.items())
        yield f"  {local(node.tag)} {node.id}{syncs}"
    yield from (f"  {'dropped' if problem.dropped else 'warning'}: {problem}" for problem in block.problems)


def _timings(active: ActiveBlock) -> Iterator[str]:
    for id, timing in active.plan.timings.items():
        sign = "=" if timing.rigid else "~"
        pairs = zip(timing.points[1:], timing.preferred.tolist(), strict=True)
        gaps = "".join(f" {sign}{length:.2f} {point}" for point, length in pairs)
        yield f"{active.block.id}:{id}: {timing.points[0]}{gaps}"


def _schedule(active: ActiveBlock) -> Iterator[str]:
    block, schedule = active.block, active.schedule
    problem = problem_of((Member(block, active.plan.timings),))
    counts = f"{len(problem.owner)} points, {len(problem.equalities)} equations, {len(problem.orders)} orders"
    yield f"{block.id}: problem of {counts}; cost {schedule.cost:.4g}"
    for u, v, seconds, part, words in problem.equalities:
        if words[1] != "rigid":
            offset = f" {seconds:+.3f}" if seconds else ""
            yield f"  {problem.name_of(u)} = {problem.name_of(v)}{offset} (line {part.line})"
    for id, points in schedule.behaviours.items():
        yield f"  {id}: " + "  ".join(f"{name} {time:.3f}" for name, time in points.items())
    yield from (f"  {warning.type}: {warning.text}" for warning in schedule.warnings)


def _keys(active: ActiveBlock) -> Iterator[str]:
    for id, channels in active.plan.channels.items():
        yield f"{active.block.id}:{id}: {len(channels)} channels"
        for channel in channels[:MOST]:
            keys = list(zip(channel.times.tolist(), channel.values.tolist(), strict=True))
            shown = "  ".join(f"{time:.2f}:{value:.2f}" for time, value in keys[:MOST])
            yield f"  {channel.target.name:<6} {shown}{' ...' if len(keys) > MOST else ''}"
        if len(channels) > MOST:
            yield f"  and {len(channels) - MOST} more"


def _units(played: Realization) -> list[str]:
    return _strongest(AU_NAMES(), np.asarray(played.aus.aus, np.float64), played.fps, "{:.2f}")


def _faps(played: Realization) -> list[str]:
    names = tuple(f"F{row.fap} {row.name}" for row in faps())
    return _strongest(names, np.asarray(played.faps.values, np.float64), played.fps, "{:.0f} FAPU")


def _strongest(names: tuple[str, ...], values: Float64, fps: float, form: str) -> list[str]:
    peaks = np.abs(values).argmax(axis=0)
    lines = [
        f"{names[c]:<26} {form.format(values[peaks[c], c])} at {peaks[c] / fps:.2f} s"
        for c in _largest(values)
    ]
    return [f"{len(values)} frames of {values.shape[1]} values, the largest:", *lines]


def _largest(values: Float64) -> list[int]:
    """Return the columns with the largest peaks that are not 0."""
    sizes = np.abs(values).max(axis=0)
    return [int(column) for column in np.argsort(-sizes)[:MOST] if sizes[column] > 0]


def _vertices(played: Realization) -> list[str]:
    k = round(_shown_at(played) * played.fps)
    moved = np.linalg.norm(deform(played.face, played.poses[k : k + 1])[0] - played.face.vertices, axis=1)
    count = int((moved > 1e-4).sum())
    return [f"{played.face_name}: {count} of {len(moved)} vertices move, by up to {moved.max() * 1e3:.1f} mm"]


def _frames(played: Realization) -> list[str]:
    return [f"{played.frames} pictures of {played.duration:.2f} s; shown: that of {_shown_at(played):.2f} s"]


def _shown_at(played: Realization) -> float:
    """Return the time of the frame whose action units are the strongest in all."""
    return float(np.asarray(played.aus.aus).sum(axis=1).argmax() / played.fps)
