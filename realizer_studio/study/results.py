"""Tables of a study's results: Wojdel 2005, 5.1; Paul 2010, 4.4 and 4.5; and others; and a report."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.atomic_files import write_text
from realizer_studio.corpus.agreement import alpha
from realizer_studio.corpus.report import html, write_tables
from realizer_studio.corpus.statistics import Table
from realizer_studio.study.answers import Answer, attention, inattentive
from realizer_studio.study.items import EMOTIONS, NAMES, SCORES
from realizer_studio.study.measures import (
    against_chance,
    angle_difference,
    circular_mean,
    hit_rates,
    interval,
    ratio,
)

MATCHED = ("right", "removed", "added", "none")
BEST = 3.0  # score
FEWEST = 5  # least number of judges for intervals over judges; otherwise intervals are over items
# Numbers of the publications, for comparison.
WOJDEL = {"visual": (0.698, 0.140, 0.159, 0.003), "emotional": (0.640, 0.140, 0.207, 0.013)}
PAUL = {  # implemented, scored 3, 2, 1, 0; weighted means without and with unimplemented ones
    "FaceEditor": (104, 91, 13, 0, 0, 2.88, 2.60),
    "Xface": (70, 19, 30, 21, 0, 1.97, 1.32),
    "Greta": (110, 71, 25, 14, 0, 2.55, 2.32),
    "Miraface": (115, 62, 24, 21, 8, 2.17, 1.96),
}
ENDS = ("from", "to")
Value = Callable[[Answer], Any]


def groups(answers: Sequence[Answer], *kinds: str) -> Iterator[tuple[tuple[str, str, str], list[Answer]]]:
    """Yield (group, variant, kind) with the answers, in order, without attention items."""
    found: dict[tuple[str, str, str], list[Answer]] = {}
    for one in answers:
        if one.kind in kinds and "check" not in one.truth:
            found.setdefault((one.group, one.truth["variant"], one.kind), []).append(one)
    yield from sorted(found.items())


def units(answers: Sequence[Answer], value: Value) -> Float64:
    """Return the sums (n, ...) of values over the answers of each judge, or of each item for few judges."""
    pick = "judge" if len({one.judge for one in answers}) >= FEWEST else "item"
    sums: dict[str, Any] = {}
    for one in answers:
        name = getattr(one, pick)
        sums[name] = sums.get(name, 0) + np.asarray(value(one), np.float64)
    return np.stack(list(sums.values()))


def mean(
    answers: Sequence[Answer], value: Value, weight: Value = lambda one: 1.0, most: float = 1.0
) -> tuple[float, ...]:
    """Return the weighted mean of a value from 0 to `most`, and its interval."""
    parts = units(answers, lambda one: (weight(one) * value(one), weight(one)))
    return float(ratio(parts.sum(axis=0))), *interval(parts, ratio, (0.0, most))


def matching(answers: Sequence[Answer]) -> Table:
    """Return table 5.1 of Wojdel 2005, with chi-square of the three faces against equal shares."""
    rows: list[tuple[Any, ...]] = []
    for group, some in groups(answers, "visual", "emotional"):
        counts = np.array([sum(one.role == role for one in some) for role in MATCHED], np.float64)
        shares = counts / counts.sum()
        right = mean(some, lambda one: one.right)
        rows.append((*group, len(some), *shares, *right[1:], *against_chance(counts[:3])))
    rows += [("Wojdel 2005", "", kind, 900, *figures, *[None] * 4) for kind, figures in WOJDEL.items()]
    columns = "who", "variant", "question", "answers", *MATCHED, *ENDS, "chi-square", "p"
    return Table("5.1", "Visual and emotional matching, shares; interval of right", columns, tuple(rows))


def _scores(some: Sequence[Answer]) -> dict[str, list[Answer]]:
    found: dict[str, list[Answer]] = {}
    for one in some:
        found.setdefault(one.item, []).append(one)
    return found


def implemented(answers: Sequence[Answer]) -> Table:
    """Return table 4.4 of Paul 2010: displacements by score, which is the lower median over judges."""
    rows: list[tuple[Any, ...]] = []
    for (group_name, variant, _), some in groups(answers, "displacements"):
        medians = [
            sorted(one.role for one in every)[(len(every) - 1) // 2]
            for every in _scores(some).values()
            if every[0].truth["moves"]
        ]
        rows.append((group_name, variant, len(_scores(some)), len(medians), *map(medians.count, SCORES)))
    rows += [("Paul 2010", name, 127, *figures[:5]) for name, figures in PAUL.items()]
    columns = "who", "variant", "displacements", "implemented", *(f"score {score}" for score in SCORES)
    return Table("4.4", "Displacements of single FAPs by score", columns, tuple(rows))


def scores(answers: Sequence[Answer]) -> Table:
    """Return table 4.5 of Paul 2010: weighted means without and with unimplemented displacements (0)."""
    rows: list[tuple[Any, ...]] = []
    for (group_name, variant, _), some in groups(answers, "displacements"):
        cells: tuple[Any, ...] = ()
        for chosen in ([one for one in some if one.truth["moves"]], some):
            cells += mean(chosen, _score, _weight, BEST) if chosen else (None,) * 3
        rows.append((group_name, variant, *cells))
    rows += [("Paul 2010", name, f[5], None, None, f[6], None, None) for name, f in PAUL.items()]
    columns = "who", "variant", "without unimplemented", *ENDS, "with unimplemented", "with from", "with to"
    return Table("4.5", "Weighted mean score of displacements", columns, tuple(rows))


def _score(one: Answer) -> float:
    return float(one.role) if one.truth["moves"] else 0.0


def _weight(one: Answer) -> float:
    return float(one.truth["weight"])


def displacements(answers: Sequence[Answer]) -> Table:
    """Return the mean score of each displacement, the worst first."""
    rows = []
    for (group_name, variant, _), some in groups(answers, "displacements"):
        for every in _scores(some).values():
            truth = every[0].truth
            found = truth["fap"], truth["name"], truth["sign"], truth["weight"], truth["moves"]
            rows.append(
                (group_name, variant, *found, len(every), float(np.mean([float(one.role) for one in every])))
            )
    columns = "who", "variant", "fap", "name", "sign", "weight", "moves", "answers", "score"
    return Table("displacements", "Scores by FAP", columns, tuple(sorted(rows, key=lambda row: row[-1])))


def _naming(answers: Sequence[Answer]) -> Iterator[tuple[tuple[str, str, str], list[Answer]]]:
    """Yield (group, variant, profiles) with the answers."""
    for (group_name, variant, _), some in groups(answers, "naming"):
        for profiles in sorted({one.truth["profiles"] for one in some}):
            yield (group_name, variant, profiles), [one for one in some if one.truth["profiles"] == profiles]


def _cell(one: Answer) -> Float64:
    matrix = np.zeros((len(EMOTIONS), len(NAMES)))
    matrix[EMOTIONS.index(one.truth["emotion"]), NAMES.index(one.role)] = 1
    return matrix


def confusion(answers: Sequence[Answer]) -> Table:
    """Return the counts of names for each emotion, with hit rates and unbiased hit rates (Wagner 1993)."""
    rows: list[tuple[Any, ...]] = []
    for group, some in _naming(answers):
        parts = units(some, _cell)
        total = parts.sum(axis=0)
        rates = hit_rates(total)
        for k, name in enumerate(EMOTIONS):
            if count := total[k].sum():
                ends = interval(parts, lambda sums, k=k: hit_rates(sums)[:, k])  # type: ignore[misc]
                rows.append((*group, name, *total[k].astype(int), total[k, k] / count, rates[k], *ends))
        ends = interval(parts, lambda sums: np.nanmean(hit_rates(sums), axis=1))
        share = np.trace(total[:, : len(EMOTIONS)]) / total.sum()
        given = total.sum(axis=0).astype(int)
        rows.append((*group, "all", *given, share, float(np.nanmean(rates)), *ends))
    columns = "who", "variant", "profiles", "emotion", *NAMES, "hit rate", "unbiased", *ENDS
    return Table(
        "confusion", "Names given to emotions; interval of the unbiased hit rate", columns, tuple(rows)
    )


def wheel(answers: Sequence[Answer]) -> Table:
    """Return the errors on the wheel of emotions: mean error with its direction, and mean absolute error."""
    rows = []
    for group, every in _naming(answers):
        for name in (*EMOTIONS, None):
            some = [a for a in every if a.angle is not None and name in (a.truth["emotion"], None)]
            if some:
                sizes = mean(some, lambda one: abs(_angle_error(one)), most=180.0)
                rows.append(
                    (
                        *group,
                        name or "all",
                        len(some),
                        *circular_mean(np.array([*map(_angle_error, some)])),
                        *sizes,
                    )
                )
    columns = "who", "variant", "profiles", "emotion", "answers", "error", "agreement", "size of error", *ENDS
    return Table("wheel", "Errors on the wheel in degrees", columns, tuple(rows))


def _angle_error(one: Answer) -> float:
    return angle_difference(one.angle or 0.0, one.truth["angle"])


def films(answers: Sequence[Answer]) -> Table:
    """Return preferences between pairs of films; an answer without preference counts half for each."""
    rows = []
    for group, every in groups(answers, "films"):
        for pair in sorted({tuple(one.truth["pair"]) for one in every}):
            some = [one for one in every if tuple(one.truth["pair"]) == pair]
            value = {pair[0]: 1.0, "same": 0.5}
            found = mean(some, lambda one, value=value: value.get(one.role, 0.0))  # type: ignore[misc]
            counts = [sum(one.role == role for one in some) for role in (*pair, "same")]
            p = against_chance(np.array(counts[:2], np.float64))[1]
            rows.append((*group[:2], *pair, *counts, *found, p))
    sides = "one", "other", "one preferred", "other preferred", "same"
    columns = "who", "variant", *sides, "share", *ENDS, "p"
    return Table("films", "Pairs of films, and the share that prefers the first", columns, tuple(rows))


def comparisons(answers: Sequence[Answer]) -> Table:
    """Return the differences between variants in the share of right answers, or in the mean score."""
    rows = []
    every = list(groups(answers, "visual", "emotional", "naming", "displacements"))
    for ((group_name, a, kind), one), ((other, b, same), two) in combinations(every, 2):
        if (group_name, kind) != (other, same):
            continue
        scored = kind == "displacements"

        def part(answer: Answer, first: str = a, scored: bool = scored) -> Float64:
            weight = _weight(answer) if scored else 1.0
            cells = np.zeros((2, 2))
            value = _score(answer) if scored else answer.right
            cells[int(answer.truth["variant"] != first)] = weight * value, weight
            return cells

        parts = units([*one, *two], part)
        most = BEST if scored else 1.0
        ends = interval(parts, lambda sums: ratio(sums) @ (1.0, -1.0), (-most, most))
        rows.append((group_name, kind, a, b, float(ratio(parts.sum(axis=0)) @ (1.0, -1.0)), *ends))
    columns = "who", "question", "one", "other", "difference", *ENDS
    return Table("comparisons", "Differences between variants", columns, tuple(rows))


def agreement(answers: Sequence[Answer]) -> Table:
    """Return Krippendorff's alpha of judges for each kind of question."""
    rows = []
    for (group_name, variant, kind), some in groups(
        answers, "visual", "emotional", "naming", "displacements", "films"
    ):
        judges, items, roles = (sorted({pick(one) for one in some}) for pick in PICKS)
        codes = np.full((len(judges), len(items)), np.nan)
        for one in some:
            code = float(one.role) if kind == "displacements" else roles.index(one.role)
            codes[judges.index(one.judge), items.index(one.item)] = code
        rows.append((group_name, variant, kind, len(judges), alpha(codes, numbers=kind == "displacements")))
    columns = "who", "variant", "question", "judges", "alpha"
    return Table("agreement", "Krippendorff's alpha", columns, tuple(rows))


PICKS: tuple[Callable[[Answer], str], ...] = (lambda a: a.judge, lambda a: a.item, lambda a: a.role)


def judges(answers: Sequence[Answer]) -> Table:
    """Return the number, speed and attention of the answers of each judge."""
    rows = []
    failed = inattentive(answers)
    for (group_name, judge), (right, every) in attention(answers).items():
        own_answers = [one for one in answers if (one.group, one.judge) == (group_name, judge)]
        seconds = float(np.median([one.seconds for one in own_answers]))
        rows.append(
            (
                group_name,
                judge,
                len(own_answers),
                seconds,
                right,
                every,
                "failed" if (group_name, judge) in failed else "",
            )
        )
    columns = "who", "judge", "answers", "median seconds", "attention right", "of", "attention"
    return Table("judges", "Judges", columns, tuple(sorted(rows)))


TABLES = (matching, implemented, scores, confusion, wheel, films, comparisons, agreement, displacements)


def tables(answers: Sequence[Answer], keep: bool = False) -> list[Table]:
    """Return all tables that have answers; `keep` includes judges who failed attention items."""
    failed = () if keep else inattentive(answers)
    counted = [one for one in answers if (one.group, one.judge) not in failed]
    kinds = {one.kind for one in counted}
    found = [make(counted) for make in TABLES]
    published = {"5.1": {"visual", "emotional"}, "4.4": {"displacements"}, "4.5": {"displacements"}}
    relevant = [one for one in found if one.rows and published.get(one.name, kinds) & kinds]
    return [*relevant, judges(answers)]


FACTS = "variant", "reference", "triple", "emotion", "profiles", "strength", "fap", "name", "sign"
WORST = 12  # items of each kind that are shown with pictures


def write_report(
    folder: Path, key: Mapping[str, Any], answers: Sequence[Answer], pictures: Path, keep: bool
) -> list[str]:
    """Write all tables and report.html into a folder, and return the names of the files.

    Args:
        pictures: folder of the study; without it, the report has no pictures.
        keep: whether to include judges who failed attention items.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = tables(answers, keep)
    write_tables(folder, found)
    failed = set() if keep else set(inattentive(answers))
    counted = [one for one in answers if (one.group, one.judge) not in failed]
    pictures_of_worst = _worst(counted, pictures) if pictures.is_dir() else {}
    write_text(folder / "report.html", html(f"Study {key['study']}", found, pictures_of_worst))
    return [*(f"{table.name}.csv" for table in found), "report.html"]


def _worst(answers: Sequence[Answer], folder: Path) -> dict[str, list[bytes]]:
    """Return caption -> pictures of the items of each kind with the worst answers."""
    by_item: dict[tuple[str, str], list[Answer]] = {}
    for one in answers:
        if "check" not in one.truth and one.kind != "films":
            by_item.setdefault((one.kind, one.item), []).append(one)
    ranked = sorted(by_item.items(), key=lambda found: sum(map(_worth, found[1])) / len(found[1]))
    count: Counter[str] = Counter()
    pictures = {}
    for (kind, _), every in ranked:
        count[kind] += 1
        if count[kind] <= WORST:
            names = [*every[0].truth["shown"].values(), *every[0].truth["options"]]
            files = [folder / name for name in names]
            pictures[_caption(every)] = [file.read_bytes() for file in files if file.is_file()]
    return pictures


def _worth(one: Answer) -> float:
    return float(one.role) if one.kind == "displacements" else float(one.right)


def _caption(every: Sequence[Answer]) -> str:
    """Return a caption with the facts of an item, the order of its options, and the answers."""
    truth, given = every[0].truth, Counter(one.role for one in every)
    facts = [str(truth[name]) for name in FACTS if name in truth]
    order = [f"faces: {', '.join(truth['options'].values())}"] if truth["options"] else []
    replies = ", ".join(f"{role} {number}" for role, number in given.most_common())
    return "; ".join([f"{every[0].kind}: {' '.join(facts)}", *order, f"answers: {replies}"])
