"""What a corpus teaches: rules and durations for `enrich`, and profiles of emotions, from its statistics."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.atomic_files import write_text
from realizer.emotions.profile import Profile, write_profiles
from realizer.tables import faps
from realizer.tables.templates import FRAME, templates
from realizer_studio.analysis.statistics import from_faces
from realizer_studio.corpus.expressions import found_expressions, write_expressions
from realizer_studio.corpus.statistics import (
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

OFTEN = 1 / 3  # share of occurrences from which an expression is a rule
MOSTLY = 1 / 2  # share of segments from which a neighbour or blend is a companion
APART = 1.0  # s; expressions that never follow another one within it stay apart
PROBABLE = 25, 75  # per cent of the segments are shorter than the ends of the probable range
LEAD, BEFORE = 0.12, 0.6  # s by which a companion is longer at either end, or begins before; ours
HEAD = """\
# source: {} recordings, by `realizer corpus describe`
# units: seconds; frames at 25 fps
# licence: that of the recordings
"""
Rules = Iterator[tuple[str, dict[str, Any]]]


def write_rules(folder: Path, study: Study) -> list[str]:
    """Write rules, durations, profiles and expressions as far as there is data; return the files' names."""
    tables = [*_placements(study), *_companions(study), *_paces(study)]
    texts = {"knowledge.toml": _toml(tables), "templates.toml": _toml(_durations(study))}
    found = {name: HEAD.format(len(study.recordings)) + text for name, text in texts.items() if text}
    if shown := profiles(study):
        found["profiles.txt"] = write_profiles(shown)
    for name, text in found.items():
        write_text(folder / name, text)
    return [*found, *write_expressions(folder, study)]


def _placements(study: Study) -> Rules:
    """Yield rules for words of a category and for sentences whose expression is frequent and no chance."""
    for _, kind, name, count, linked, _, low, _ in categories(study).rows:
        if count >= FEWEST and linked >= OFTEN * count and low > 1:
            says = f"{name} at {linked} of {count} words of {kind} (corpus)"
            yield "[speaker]", {"when": kind, "show": [name], "says": says}
    *rows, (_, *totals) = questions(study).rows
    for name, *shown in rows:
        often = [met >= OFTEN * max(count, 1) for met, count in zip(shown, totals, strict=True)]
        # Questions of more words have a rule too if they show the expression as often.
        most = 3 if often[2] else 2
        for when, part, more in (
            ("question", slice(most), {} if often[2] else {"most_words": SHORT}),
            ("exclamation", slice(len(KINDS) - 1, None), {}),
        ):
            met, count = sum(shown[part]), sum(totals[part])
            if count >= FEWEST and met >= OFTEN * count:
                says = f"{name} at {met} of {count} {'short ' * bool(more)}{when}s (corpus)"
                yield "[speaker]", {"when": when, "show": [name], "says": says} | more


def _companions(study: Study) -> Rules:
    """Yield expressions with which most segments of another one share frames, or which they adjoin."""
    blended = set()
    for _, a, b, count, *_, a_then_b, b_then_a, b_in_a, a_in_b, same in blends(study).rows:
        for of, other, around in ((a, b, a_in_b), (b, a, b_in_a)):
            if study.totals[of] >= FEWEST and count >= MOSTLY * study.totals[of]:
                blended |= {(of, other), (other, of)}
                by = "around" if around > (a_then_b + b_then_a + same) / 2 else "with"
                says = f"{count} of {study.totals[of]} of {of} share frames with {other} (corpus)"
                yield "[company]", {"of": of, "is": other, "by": by, "lead": LEAD, "says": says}
    for _, of, other, count, *shares_of, _, _ in neighbours(study).rows:
        sides = [
            side for side, share in zip(("before", "after"), shares_of, strict=True) if share >= 100 * MOSTLY
        ]
        if sides and count >= FEWEST and of != other and (of, other) not in blended:
            by = "around" if len(sides) == 2 else sides[0]
            says = f"{other} stands {by} {of} in {max(shares_of):.0f} % of {count} (corpus)"
            lead = LEAD if by == "around" else BEFORE
            yield "[company]", {"of": of, "is": other, "by": by, "lead": lead, "says": says}


def _paces(study: Study) -> Rules:
    """Yield what stays apart, the seconds between expressions, and moods."""
    follow = {row[1] for row in neighbours(study).rows if row[-2]}
    often = [name for name, count in study.totals.items() if count >= FEWEST]
    yield "apart", {name: APART for name in often if name not in follow}
    gaps = distances(study).rows[0][1:]
    usual = float(np.mean([gap for gap in gaps if gap is not None and np.isfinite(gap)] or [0.0]))
    percent = emotional(study).column("other percent linked")
    listener = usual * percent["subject"] / percent["other"] if percent["other"] else usual
    yield "pace", {"speaker": round(usual, 2), "listener": round(listener, 2)}
    moods: dict[str, list[tuple[float, float]]] = {}
    for (_, words, _, mean), gap in zip(shares(study).rows, gaps, strict=True):
        if mean is not None and np.isfinite(gap):
            for mood in filter(None, (part.strip().lower() for part in words.split(","))):
                moods.setdefault(mood, []).append((round(gap, 2), round(mean, 2)))
    means = {mood: np.mean(some, axis=0).tolist() for mood, some in moods.items()}
    rows = {mood: {"distance": gap, "frames": mean} for mood, (gap, mean) in means.items()}
    yield "mood", {"mean": round(float(np.mean([len(one) for one in study.every] or [1])), 2)} | rows


def _durations(study: Study) -> Rules:
    """Yield the expressions that are templates or whose faces a corpus has, with its durations."""
    rate, found = study.recordings[0].fps, {one.name: one.aus for one in found_expressions(study)}
    for name, least, most, mean, deviation in lengths(study).rows:
        template, aus = templates().get(name.upper()), found.get(name)
        if template is not None:
            units = template.aus.items()
            aus = {f"{number}{side[0] if side != 'BOTH' else ''}": v for (number, side), v in units}
        if aus is None:
            continue
        features = template.features if template is not None else ""
        row: dict[str, Any] = {"features": features, "aus": aus, "frames": mean / (rate * FRAME)}
        if deviation is not None:
            own = [len(segment) / rate for segment in study.every if segment.text == name]
            row |= {"deviation": deviation / (rate * FRAME), "possible": [least / rate, most / rate]}
            row["probable"] = np.percentile(own, PROBABLE).tolist()
        yield json.dumps(name.upper()), row


def statistics(study: Study) -> Table:
    """Table 4 of Raouzaiou et al. 2002: mean and deviation of each FAP in segments of each expression."""
    rows = [
        (f"{name}, {row.name}", name, row.fap, len(shown), mean, deviation)
        for name, shown in _faces(study).items()
        for row, mean, deviation in zip(
            faps(), shown.mean(axis=0).tolist(), shown.std(axis=0, ddof=1).tolist(), strict=True
        )
        if abs(mean) >= 1
    ]
    columns = "pair", "expression", "fap", "segments", "mean", "deviation"
    return Table(
        "fap-statistics", "FAPs of expressions (Raouzaiou et al. 2002, table 4)", columns, tuple(rows)
    )


def profiles(study: Study) -> list[Profile]:
    """Return a profile of each expression with two segments or more (Raouzaiou et al. 2002, eq. 1 to 3)."""
    found = [from_faces(f"{name} 0", shown) for name, shown in _faces(study).items()]
    return [profile for profile in found if profile.ranges]


def _faces(study: Study) -> dict[str, Any]:
    """Return expression -> (segments, 68), the median FAPs of each of at least two segments."""
    found: dict[str, list[Any]] = {}
    for recording, segments in study.parts:
        for one in segments:
            if recording.faps is not None and one.first < len(recording.faps):
                frames = recording.faps[one.first : one.last + 1]
                found.setdefault(one.text, []).append(np.median(frames, axis=0))
    return {name: np.stack(rows) for name, rows in found.items() if len(rows) > 1}


def _toml(tables: Any) -> str:
    """Return tables of TOML; a name in brackets is one of several tables of that name."""
    return "\n".join(
        f"[{name}]\n" + "".join(f"{_key(key)} = {_value(value)}\n" for key, value in row.items())
        for name, row in tables
    )


def _key(key: str) -> str:
    return key if key.isascii() and key.isalnum() else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(inner)}" for key, inner in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)
