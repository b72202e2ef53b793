"""Draws the row of one behaviour: its name, coloured gaps, sync points and words."""

import math
import re
from collections.abc import Iterable, Sequence

from realizer.charts.diverging_scale import FAINT, INK, LOST, PAPER, RIGID, colour_of, on
from realizer.charts.scale import Scale
from realizer.charts.shapes import Box, Path, Picture, Text, cut, cut_inside, fold, hatch, width_of
from realizer.charts.timeline import BehaviourRow, Dropped, Gap

HEIGHT = 46.0
# Pins and arrows are above the bar, the names of sync points below it.
ABOVE, BAR = 13.0, 18.0
NAME = 62.0  # left edge of ids; kinds are to the left of them
SMALL, PLAIN = 9.5, 12.5
TOLERANCE = 1e-6  # s; rounding errors of the begins of words and sync points
MAX_REASON = 4  # lines
_PLACE = re.compile(r"line \d+, /\S*: ")


def draw_row(
    picture: Picture, scale: Scale, line: BehaviourRow, start: float, top: float, linked: frozenset[str]
) -> None:
    """Draw the row of a behaviour.

    Args:
        start: start of its block, seconds on the session clock.
        top: top of the row in pixels.
        linked: its sync points that belong to a link; their names have priority.
    """
    _name(picture, line.id, _about(line), top, INK, FAINT)
    bar = top + ABOVE
    xs = [scale.x(start + point.time) for point in line.points]
    for gap, left, right in zip(line.gaps, xs[:-1], xs[1:], strict=True):
        picture.add(Box(left, bar, right - left, BAR, colour(gap), tip=_tip(line, gap)))
    picture.add(Box(xs[0], bar, max(xs[-1] - xs[0], 1.0), BAR, None, "#4b5563"))
    if line.words:
        _words(picture, scale, line, start, bar)
    else:
        for gap, left, right in zip(line.gaps, xs[:-1], xs[1:], strict=True):
            _percent(picture, gap, left, right, bar)
    for point, x in zip(line.points, xs, strict=True):
        tip = f"{line.id}:{point.name} {point.time:.3f} s"
        picture.add(Path(((x, bar - 3), (x, bar + BAR + 3)), INK, 1.3, tip=tip))
    _names(picture, [p.name for p in line.points], xs, bar + BAR + 13, linked, scale.right)


def height_of(dropped: Dropped, scale: Scale) -> float:
    """Return the height of the row of dropped behaviours."""
    return 22.0 + 13.0 * max(1, len(_reason(dropped, scale)))


def draw_dropped(picture: Picture, scale: Scale, dropped: Dropped, top: float, height: float) -> None:
    """Draw dropped behaviours, with the reasons."""
    where = "" if dropped.line is None else f", line {dropped.line}"
    _name(picture, dropped.id, f"{dropped.element or 'dropped'}{where}", top - 6, LOST, LOST)
    width = width_of(cut_inside(dropped.id, PLAIN, scale.left - NAME - 12), PLAIN)
    picture.add(Path(((NAME, top + 12), (NAME + width, top + 12)), LOST, 1.0))
    picture.add(Box(scale.left, top + 3, scale.right - scale.left, height - 6, "#f3f4f6", radius=3))
    picture.add(*hatch(scale.left, top + 3, 16, height - 6, LOST, 6))
    picture.add(Text(scale.left + 24, top + 17, dropped.type.replace("_", " ").lower(), SMALL, FAINT))
    for k, text in enumerate(_reason(dropped, scale)):
        picture.add(Text(scale.left + 24, top + 30 + 13 * k, text, 10.5, "#4b5563"))


def colour(gap: Gap) -> str:
    """Return the colour of a gap: grey if it cannot stretch, otherwise by its stretch."""
    if gap.rigid or gap.preferred is None:
        return RIGID
    if gap.preferred == 0:
        return colour_of(1.0 if gap.actual < 1e-6 else math.inf)
    return colour_of(gap.actual / gap.preferred)


def _name(picture: Picture, id: str, about: str, top: float, ink: str, faint: str) -> None:
    room = Scale(0, 1, 1).left - NAME - 12
    picture.add(Text(NAME, top + 22, cut_inside(id, PLAIN, room), PLAIN, ink))
    picture.add(Text(NAME, top + 35, cut(about, SMALL, room), SMALL, faint))


def _about(line: BehaviourRow) -> str:
    words = [line.element]
    if line.line is not None:
        words.append(f"line {line.line}")
    if line.required:
        words.append("required")
    return ", ".join(words)


def _tip(line: BehaviourRow, gap: Gap) -> str:
    words = [f"{line.id}: {gap.begin} to {gap.end} {gap.actual:.3f} s"]
    if gap.rigid:
        words.append("rigid")
    elif gap.preferred is not None:
        words.append(f"preferred {gap.preferred:.3f} s")
        if gap.least:
            words.append(f"least {gap.least:.3f} s")
        if gap.most is not None:
            words.append(f"most {gap.most:.3f} s")
        words.append(f"cost {gap.cost:.4g}")
    return ", ".join(words)


def _percent(picture: Picture, gap: Gap, left: float, right: float, bar: float) -> None:
    """Draw the length of a gap and, if it is stretched, the ratio to its preferred length."""
    ink = on(colour(gap))
    seconds = f"{gap.actual:.2f} s"
    stretched = gap.stretch is not None and not gap.rigid and abs(gap.stretch - 1) >= 0.005
    percent = f"{gap.stretch or 0:.0%}" if stretched else ""
    for words in filter(None, (f"{seconds}, {percent}" if percent else "", percent or seconds)):
        if width_of(words, SMALL) <= right - left - 6:
            picture.add(Text((left + right) / 2, bar + 12.5, words, SMALL, ink, "middle"))
            return


def _words(picture: Picture, scale: Scale, line: BehaviourRow, start: float, bar: float) -> None:
    """Draw each word at its time, or if they do not fit, the words between two sync points as one text."""
    spans = [(scale.x(start + w.start), scale.x(start + w.end), w.text) for w in line.words]
    if all(width_of(text, 10.5) <= max(right - left, 12) + 3 for left, right, text in spans):
        for left, right, text in spans:
            picture.add(Text((left + right) / 2, bar + 13, text, 10.5, INK, "middle"))
        return
    for begin, end in zip(line.points[:-1], line.points[1:], strict=True):
        left, right = scale.x(start + begin.time), scale.x(start + end.time)
        spoken = " ".join(
            w.text for w in line.words if begin.time - TOLERANCE <= w.start < end.time - TOLERANCE
        )
        if text := cut(spoken, SMALL, right - left - 6):
            picture.add(Text(left + 4, bar + 12.5, text, SMALL, INK))


def _names(
    picture: Picture, names: Sequence[str], xs: Sequence[float], y: float, linked: frozenset[str], edge: float
) -> None:
    """Draw the names that fit below their ticks: first of linked points, then of both ends, then others."""
    order = sorted(range(len(names)), key=lambda k: (names[k] not in linked, 0 < k < len(names) - 1, k))
    taken: list[tuple[float, float]] = []
    for k in order:
        width = width_of(names[k], SMALL)
        for shift in _shifts(width, k, len(names)):
            left = xs[k] + shift
            if left + width > edge + 20 or left < Scale(0, 1, 1).left - 8:
                continue
            if all(left > b + 3 or left + width < a - 3 for a, b in taken):
                taken.append((left, left + width))
                ink = INK if names[k] in linked else FAINT
                picture.add(Text(left, y, names[k], SMALL, ink, halo=PAPER))
                break


def _shifts(width: float, k: int, count: int) -> Iterable[float]:
    first = (-2.0, -width / 2) if k == 0 else (-width + 2, -width / 2) if k == count - 1 else (-width / 2,)
    return (*first, -2.0, -width + 2)


def _reason(dropped: Dropped, scale: Scale) -> Sequence[str]:
    # The place in the document is shown below the name.
    text = _PLACE.sub("", dropped.text)
    return fold(text, 10.5, scale.right - scale.left - 36, MAX_REASON)
