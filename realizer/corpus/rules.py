"""What a corpus teaches: rules and durations for `enrich`, and profiles of emotions, from its statistics."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realizer.analysis.statistics import from_faces
from realizer.core.atomic_files import write_text
from realizer.corpus.statistics import (
    FEWEST,
    KINDS,
    SHORT,
    Study,
    Table,
    blends,
    categories,
    distances,
    emotional,
    lengths,
    neighbours,
    questions,
    shares,
)
from realizer.emotions.profile import Profile
from realizer.emotions.profile_file import write_profiles
from realizer.tables import faps
from realizer.tables.templates import FRAME, templates

OFTEN = 1 / 3  # share of occurrences from which an expression is a rule
MOSTLY = 1 / 2  # share of segments from which a neighbour or blend is a companion
APART = 1.0  # s; expressions that never follow another one within it stay apart
PROBABLE = 25, 75  # per cent of the segments are shorter than the ends of the probable range
HEAD = """\
# source: {} recordings, by `realizer corpus describe`
# units: seconds; frames at 25 fps
# licence: that of the recordings
"""


def write_rules(folder: Path, study: Study) -> list[str]:
    """Write knowledge.toml, templates.toml and profiles.txt, as far as there is data; return their names."""
    head = HEAD.format(len(study.recordings))
    files = {"knowledge.toml": knowledge_text(study), "templates.toml": templates_text(study)}
    found = {name: head + text for name, text in files.items() if text}
    if shown := profiles(study):
        found["profiles.txt"] = write_profiles(shown)
    for name, text in found.items():
        write_text(folder / name, text)
    return list(found)


def knowledge_text(study: Study) -> str:
    """Return rules for `enrich --knowledge`: placements, companions, distances and moods."""
    tables = [
        *_placements(study),
        *_companions(study),
        ("apart", dict(_apart(study))),
        ("pace", _pace(study)),
        ("mood", _moods(study)),
    ]
    return "\n".join(_toml(name, row) for name, row in tables)


def _placements(study: Study) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield rules for words of a category and for sentences whose expression is frequent and no chance."""
    for _, kind, name, count, linked, _, low, _ in categories(study).rows:
        if count >= FEWEST and linked >= OFTEN * count and low > 1:
            says = f"{name} at {linked} of {count} words of {kind} (corpus)"
            yield "[speaker]", {"when": kind, "show": [name], "says": says}
    table = questions(study)
    totals = {kind: table.column(kind)["all"] for kind in KINDS}
    for name in study.names:
        shown = {kind: table.column(kind)[name] for kind in KINDS}
        single, short, long, exclamation = KINDS
        for when, some, most in (
            ("question", (single, short), SHORT),
            ("question", (single, short, long), None),
            ("exclamation", (exclamation,), None),
        ):
            met, count = sum(shown[kind] for kind in some), sum(totals[kind] for kind in some)
            # A rule for short questions is needed where long ones have another share.
            long_share = shown[long] / max(totals[long], 1)
            if (
                count < FEWEST
                or met < OFTEN * count
                or (when == "question" and (most is None) != (long_share >= OFTEN))
            ):
                continue
            says = f"{name} at {met} of {count} {'short ' if most else ''}{when}s (corpus)"
            yield (
                "[speaker]",
                {"when": when, "show": [name], "says": says} | ({"most_words": most} if most else {}),
            )


def _companions(study: Study) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield expressions with which most segments of another one share frames, or which they adjoin."""
    totals = {name: sum(segment.text == name for segment in study.every) for name in study.names}
    table = blends(study)
    for _, a, b, count, *_, a_then_b, b_then_a, b_in_a, a_in_b, same in table.rows:
        for of, other, around in ((a, b, a_in_b), (b, a, b_in_a)):
            if totals[of] >= FEWEST and count >= MOSTLY * totals[of]:
                by = "around" if around > (a_then_b + b_then_a + same) / 2 else "with"
                says = f"{count} of {totals[of]} of {of} share frames with {other} (corpus)"
                yield "[company]", {"of": of, "is": other, "by": by, "lead": 0.12, "says": says}
    for _, of, other, count, before, after, *_ in neighbours(study).rows:
        blended = {(a, b) for _, a, b, shared, *_ in table.rows if shared >= MOSTLY * totals[of]}
        if count < FEWEST or of == other or {(of, other), (other, of)} & blended:
            continue
        sides = [side for side, share in (("before", before), ("after", after)) if share >= 100 * MOSTLY]
        if sides:
            by = "around" if len(sides) == 2 else sides[0]
            says = f"{other} stands {by} {of} in {max(before, after):.0f} % of {count} (corpus)"
            yield (
                "[company]",
                {"of": of, "is": other, "by": by, "lead": 0.12 if by == "around" else 0.6, "says": says},
            )


def _apart(study: Study) -> Iterator[tuple[str, float]]:
    table = neighbours(study)
    for name in study.names:
        count = sum(segment.text == name for segment in study.every)
        if count >= FEWEST and not any(
            row[1] == name and row[table.columns.index("percent before within 1 s")] for row in table.rows
        ):
            yield name, APART


def _pace(study: Study) -> dict[str, float]:
    usual = [gap for gap in distances(study).rows[0][1:] if gap is not None and np.isfinite(gap)]
    speaker = float(np.mean(usual)) if usual else 0.0
    percent = emotional(study).column("percent linked")
    listener = speaker * percent["subject"] / percent["other"] if percent["other"] else speaker
    return {"speaker": round(speaker, 2), "listener": round(listener, 2)}


def _moods(study: Study) -> dict[str, Any]:
    found: dict[str, Any] = {"mean": round(float(np.mean([len(s) for s in study.every] or [1])), 2)}
    cells: dict[str, list[tuple[float, float]]] = {}
    for (_, moods, _, mean), distance in zip(shares(study).rows, distances(study).rows[0][1:], strict=True):
        if mean is not None and np.isfinite(distance):
            for mood in filter(None, (part.strip().lower() for part in moods.split(","))):
                cells.setdefault(mood, []).append((distance, mean))
    for mood, some in cells.items():
        distance, mean = np.mean(some, axis=0).tolist()
        found[mood] = {"distance": round(distance, 2), "frames": round(mean, 2)}
    return found


def templates_text(study: Study) -> str:
    """Return templates with the durations of a corpus, of expressions that are templates."""
    rate = study.recordings[0].fps
    parts = []
    for name, least, most, mean, deviation in lengths(study).rows:
        template = templates().get(name.upper())
        if template is None:
            continue
        own = [len(segment) / rate for segment in study.every if segment.text == name]
        low, high = np.percentile(own, PROBABLE).tolist()
        aus = {
            f"{au}{'' if side == 'BOTH' else side[0]}": value for (au, side), value in template.aus.items()
        }
        row: dict[str, Any] = {
            "features": template.features,
            "aus": aus,
            "frames": round(mean / (rate * FRAME), 2),
        }
        if deviation is not None:
            row["deviation"] = round(deviation / (rate * FRAME), 2)
        if len(own) >= FEWEST:
            row |= {"possible": [least / rate, most / rate], "probable": [round(low, 3), round(high, 3)]}
        parts.append(_toml(json.dumps(name.upper()), row))
    return "\n".join(parts)


def statistics(study: Study) -> Table:
    """Table 4 of Raouzaiou et al. 2002: mean and deviation of each FAP in segments of each expression."""
    rows = []
    for name, shown in _faces(study).items():
        means = shown.mean(axis=0)
        deviations = shown.std(axis=0, ddof=1) if len(shown) > 1 else np.full(68, np.nan)
        for row, mean, deviation in zip(faps(), means.tolist(), deviations.tolist(), strict=True):
            if abs(mean) >= 1:
                rows.append((f"{name}, {row.name}", name, row.fap, len(shown), mean, deviation))
    columns = "pair", "expression", "fap", "segments", "mean", "deviation"
    return Table(
        "fap-statistics", "FAPs of expressions (Raouzaiou et al. 2002, table 4)", columns, tuple(rows)
    )


def profiles(study: Study) -> list[Profile]:
    """Return a profile of each expression with two segments or more (Raouzaiou et al. 2002, eq. 1 to 3)."""
    found = [from_faces(f"{name} 0", shown) for name, shown in _faces(study).items() if len(shown) > 1]
    return [profile for profile in found if profile.ranges]


def _faces(study: Study) -> dict[str, Any]:
    """Return expression -> (segments, 68), the median FAPs of each segment."""
    found: dict[str, list[Any]] = {}
    for recording, segments in zip(study.recordings, study.segments, strict=True):
        for one in segments:
            if recording.faps is not None and one.first < len(recording.faps):
                frames = recording.faps[one.first : one.last + 1]
                found.setdefault(one.text, []).append(np.median(frames, axis=0))
    return {name: np.stack(rows) for name, rows in found.items()}


def _toml(name: str, row: Mapping[str, Any]) -> str:
    """Return a table of TOML; a name in brackets is one of several tables of that name."""
    return f"[{name}]\n" + "".join(f"{_key(key)} = {_value(value)}\n" for key, value in row.items())


def _key(key: str) -> str:
    return key if key.isascii() and key.isalnum() else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)
