"""Rules and durations for `enrich`, and profiles of emotions, derived from the statistics of a corpus."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realizer import tables
from realizer.core.atomic_files import write_text
from realizer.emotions.profile import Profile, write_profiles
from realizer.tables import faps
from realizer.tables.templates import FRAME, templates
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

OFTEN = 1 / 3  # least share of occurrences that makes an expression a rule
MOSTLY = 1 / 2  # least share of segments that makes a neighbour or blend a companion
APART = 1.0  # s; expressions that never follow another one within this time are kept apart
PROBABLE = 25, 75  # percentiles of the lengths of segments, the ends of the probable range
LEAD, BEFORE = 0.12, 0.6  # s by which a companion is longer at either end, or begins before; assumed
HEAD = """\
# source: {} recordings, by `realizer corpus describe`
# units: seconds; frames at 25 fps
# licence: that of the recordings
"""
Rules = Iterator[tuple[str, dict[str, Any]]]


def write_rules(folder: Path, study: Study) -> list[str]:
    """Write the rules, durations, profiles and expressions that the data allow; return the files' names."""
    tables = [*_placements(study), *_companions(study), *_paces(study)]
    texts = {"knowledge.toml": _toml(tables), "templates.toml": _toml(_durations(study))}
    found = {name: HEAD.format(len(study.recordings)) + text for name, text in texts.items() if text}
    if emotions := profiles(study):
        found["profiles.txt"] = write_profiles(emotions)
    for name, text in found.items():
        write_text(folder / name, text)
    return [*found, *write_expressions(folder, study)]


def _placements(study: Study) -> Rules:
    """Yield rules for categories of words, and for questions and exclamations, with frequent expressions."""
    for _, kind, name, count, linked, _, low, _ in categories(study).rows:
        if count >= FEWEST and linked >= OFTEN * count and low > 1:
            note = f"{name} at {linked} of {count} words of {kind} (corpus)"
            yield "[speaker]", {"when": kind, "show": [name], "says": note}
    *rows, (_, *totals) = questions(study).rows
    for name, *counts in rows:
        often = [met >= OFTEN * max(count, 1) for met, count in zip(counts, totals, strict=True)]
        # Long questions have the rule too if they show the expression as often.
        most = 3 if often[2] else 2
        for when, part, more in (
            ("question", slice(most), {} if often[2] else {"most_words": SHORT}),
            ("exclamation", slice(len(KINDS) - 1, None), {}),
        ):
            met, count = sum(counts[part]), sum(totals[part])
            if count >= FEWEST and met >= OFTEN * count:
                note = f"{name} at {met} of {count} {'short ' * bool(more)}{when}s (corpus)"
                yield "[speaker]", {"when": when, "show": [name], "says": note} | more


def _companions(study: Study) -> Rules:
    """Yield rules for expressions that overlap or adjoin most segments of another one."""
    blended = set()
    for _, a, b, count, *_, a_then_b, b_then_a, b_in_a, a_in_b, same in blends(study).rows:
        for of, other, around in ((a, b, a_in_b), (b, a, b_in_a)):
            if study.totals[of] >= FEWEST and count >= MOSTLY * study.totals[of]:
                blended |= {(of, other), (other, of)}
                by = "around" if around > (a_then_b + b_then_a + same) / 2 else "with"
                note = f"{count} of {study.totals[of]} of {of} share frames with {other} (corpus)"
                yield "[company]", {"of": of, "is": other, "by": by, "lead": LEAD, "says": note}
    for _, of, other, count, *shares_of, _, _ in neighbours(study).rows:
        sides = [
            side for side, share in zip(("before", "after"), shares_of, strict=True) if share >= 100 * MOSTLY
        ]
        if sides and count >= FEWEST and of != other and (of, other) not in blended:
            by = "around" if len(sides) == 2 else sides[0]
            note = f"{other} stands {by} {of} in {max(shares_of):.0f} % of {count} (corpus)"
            lead = LEAD if by == "around" else BEFORE
            yield "[company]", {"of": of, "is": other, "by": by, "lead": lead, "says": note}


def _paces(study: Study) -> Rules:
    """Yield rules for expressions that are kept apart, for times between expressions, and for moods."""
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
    """Yield the durations of expressions that are templates or have faces in the corpus."""
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
            durations = [len(segment) / rate for segment in study.every if segment.text == name]
            row |= {"deviation": deviation / (rate * FRAME), "possible": [least / rate, most / rate]}
            row["probable"] = np.percentile(durations, PROBABLE).tolist()
        yield json.dumps(name.upper()), row


def statistics(study: Study) -> Table:
    """Table 4 of Raouzaiou et al. 2002: mean and deviation of each FAP in segments of each expression."""
    rows = [
        (f"{name}, {row.name}", name, row.fap, len(faces), mean, deviation)
        for name, faces in _faces(study).items()
        for row, mean, deviation in zip(
            faps(), faces.mean(axis=0).tolist(), faces.std(axis=0, ddof=1).tolist(), strict=True
        )
        if abs(mean) >= 1
    ]
    columns = "pair", "expression", "fap", "segments", "mean", "deviation"
    return Table(
        "fap-statistics", "FAPs of expressions (Raouzaiou et al. 2002, table 4)", columns, tuple(rows)
    )


def profiles(study: Study) -> list[Profile]:
    """Return a profile of each expression with two segments or more (Raouzaiou et al. 2002, eq. 1 to 3)."""
    found = [from_faces(f"{name} 0", faces) for name, faces in _faces(study).items()]
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
    """Return tables as TOML; a name in brackets makes an array of tables."""
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


MIN_MEAN = 1.0  # FAPU; FAPs with a smaller mean are not part of an expression


def from_statistics(
    name: str, measured: Mapping[int, tuple[float, float]], source: str = "statistics"
) -> Profile:
    """Return the profile with ranges of one standard deviation around the means (eq. 1).

    Ranges of FAPs that move in one direction only are limited to it (eq. 2 and 3).

    Args:
        measured: FAP -> (mean, standard deviation) in FAPU.

    Raises:
        ValueError: a deviation below 0, or not a number.
    """
    ranges = {}
    for fap, (mean, deviation) in measured.items():
        if not deviation >= 0:
            raise ValueError(f"{name}, FAP {fap}: wanted a deviation of 0 or more, got {deviation}")
        row = tables.faps()[fap - 1]
        low, high = mean - deviation, mean + deviation
        if row.least == 0:
            low, high = max(0.0, low), max(0.0, high)
        if row.most == 0:
            low, high = min(0.0, low), min(0.0, high)
        ranges[fap] = low, high
    return Profile(name, source, ranges)


def from_faces(name: str, frames: Any) -> Profile:
    """Return the profile of observed faces that show the same expression.

    Args:
        frames: (n, 68) FAP values of at least 2 faces; column = FAP - 1.

    Raises:
        ValueError: frames of another shape, or values that are not finite.
    """
    values = np.asarray(frames, np.float64)
    if values.ndim != 2 or values.shape[1] != 68 or len(values) < 2:
        raise ValueError(f"{name}: wanted at least two faces (n, 68), got {values.shape}")
    if not np.isfinite(values).all():
        raise ValueError(f"{name}: wanted finite values, got NaN or infinity")
    means, deviations = values.mean(axis=0), values.std(axis=0, ddof=1)
    chosen = (int(k) + 1 for k in np.flatnonzero(np.abs(means) >= MIN_MEAN))
    measured = {fap: (float(means[fap - 1]), float(deviations[fap - 1])) for fap in chosen if fap >= 3}
    return from_statistics(name, measured, "faces")
