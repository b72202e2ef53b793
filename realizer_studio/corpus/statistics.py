"""Statistics of the expressions of a corpus: tables 6.3 to 6.14 of Wojdel 2005, of any recordings."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from realizer.tables.emotional_words import WordList
from realizer_studio.corpus.recording import SUBJECT, Recording, Segment

NEAR = 12  # frames at 25 a second, the largest gap between an expression and its word (eq. 6.13)
FEWEST = 7  # least number of segments for a standard deviation, and of occurrences of a word for a row
SHORT = 5  # words of a short question
DRAWS = 1000  # of the bootstrap
RELATIONS = ("a then b", "b then a", "b in a", "a in b", "a = b")
SPEAKERS = ("subject", "other", "subject to other", "other to subject", "nobody")
NEIGHBOURS = ("before", "after", "before within 1 s", "after within 1 s")
KINDS: dict[str, Callable[[int, str], bool]] = {  # of sentences, by number of words and final sign
    "single-word question": lambda words, sign: sign == "?" and words == 1,
    "short question": lambda words, sign: sign == "?" and 1 < words <= SHORT,
    "long question": lambda words, sign: sign == "?" and words > SHORT,
    "exclamation": lambda words, sign: sign == "!",
}


@dataclass(frozen=True)
class Table:
    """A table with the `name` of its file, a title, columns and rows; None is an empty cell."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def column(self, name: str) -> dict[str, Any]:
        """Return first cell -> cell of a column."""
        return {str(row[0]): row[self.columns.index(name)] for row in self.rows}


@dataclass(frozen=True)
class Study:
    """Recordings with the segments of one annotator."""

    recordings: Sequence[Recording]  # at least one
    annotator: str | None = None  # None for the first annotator of each recording
    words: WordList | None = None  # emotional words, or None
    watched: frozenset[str] = frozenset()  # words with a row in table 6.11 even if they are rare

    @cached_property
    def parts(self) -> list[tuple[Recording, list[Segment]]]:
        """The recordings with their segments."""
        return [(recording, recording.segments(self.annotator)) for recording in self.recordings]

    @cached_property
    def every(self) -> list[Segment]:
        return [segment for _, segments in self.parts for segment in segments]

    @cached_property
    def totals(self) -> dict[str, int]:
        """Expression -> segments, most frequent first."""
        return dict(Counter(segment.text for segment in self.every).most_common())

    @cached_property
    def frames(self) -> int:
        return sum(recording.frames for recording in self.recordings)

    @cached_property
    def linked(self) -> list[tuple[str, str, str, frozenset[str]]]:
        """Word, category or "", speaker, and expressions within half a second (eq. 6.12, 6.13)."""
        found = []
        for recording, segments in self.parts:
            texts = [plain(word.text) for word in recording.spoken]
            kinds = self.words.categories(texts) if self.words is not None else [""] * len(texts)
            for word, text, kind in zip(recording.spoken, texts, kinds, strict=True):
                near = {one.text for one in segments if one.gap(word) <= NEAR * recording.fps / 25}
                found.append((text, kind, word.by, frozenset(near)))
        return found


def plain(word: str) -> str:
    """Return a word in lower case without punctuation."""
    return word.strip(" .,;:!?…\"'“”‘’«»()-–").lower()


def counts(study: Study) -> Table:
    """Return table 6.3, with rows for all segments, and for frames with none, one, and several of them."""
    lengths = {name: _lengths(study.every, name) for name in (*study.totals, None)}
    rows: list[tuple[Any, ...]] = [
        (name or "all", len(lengths_of), sum(lengths_of)) for name, lengths_of in lengths.items()
    ]
    per_frame = np.concatenate([_expressions_per_frame(*part) for part in study.parts])
    rows += [(f"frames with {k}", None, int((np.minimum(per_frame, 2) == k).sum())) for k in (0, 1, 2)]
    rows = [(*row, _percent(row[2], study.frames)) for row in rows]
    return Table("6.3", "Segments and frames", ("expression", "segments", "frames", "percent"), tuple(rows))


def lengths(study: Study) -> Table:
    """Return table 6.4; the deviation is that of expressions with at least seven segments."""
    rows = []
    for name in study.totals:
        values = _lengths(study.every, name)
        deviation = float(np.std(values, ddof=1)) if len(values) >= FEWEST else None
        rows.append((name, min(values), max(values), float(np.mean(values)), deviation))
    columns = "expression", "shortest", "longest", "mean", "deviation"
    return Table("6.4", "Lengths of segments, frames", columns, tuple(rows))


def distances(study: Study) -> Table:
    """Return table 6.5: D_k(i) and D_k in seconds (eq. 6.2, 6.3) by fragment; "inf" for one segment."""

    def distance(recording: Recording, lengths_of: list[int]) -> float | None:
        mean = (
            (recording.frames - sum(lengths_of)) / (recording.fps * len(lengths_of)) if lengths_of else None
        )
        return float("inf") if len(lengths_of) == 1 else mean

    rows = [
        (
            name or "all",
            *(distance(recording, _lengths(segments, name)) for recording, segments in study.parts),
        )
        for name in (None, *study.totals)
    ]
    return Table("6.5", "Seconds between expressions", ("expression", *_fragments(study)), tuple(rows))


def shares(study: Study) -> Table:
    """Return table 6.6, with the mood of each fragment."""
    rows = []
    for name, (recording, segments) in zip(_fragments(study), study.parts, strict=True):
        expressive = int((_expressions_per_frame(recording, segments) > 0).sum())
        mean = float(np.mean(_lengths(segments, None))) if segments else None
        rows.append((name, recording.meta.get("mood", ""), _percent(expressive, recording.frames), mean))
    columns = "fragment", "mood", "expressive percent", "mean length"
    return Table("6.6", "Expressive frames and lengths by fragment", columns, tuple(rows))


def relation(a: Segment, b: Segment) -> str:
    """Return the relation of two overlapping segments (table 6.8)."""
    if (a.first, a.last) == (b.first, b.last):
        return "a = b"
    if a.first <= b.first and b.last <= a.last:
        return "b in a"
    if b.first <= a.first and a.last <= b.last:
        return "a in b"
    return "a then b" if a.first < b.first else "b then a"


def blends(study: Study) -> Table:
    """Return tables 6.7 and 6.8: pairs of overlapping expressions a and b, in alphabetical order."""
    found: dict[tuple[str, str], list[tuple[int, str]]] = {}
    for _, segments in study.parts:
        for pair in combinations(segments, 2):
            a, b = sorted(pair, key=lambda segment: segment.text)
            shared = min(a.last, b.last) - max(a.first, b.first) + 1
            if shared > 0 and a.text != b.text:
                found.setdefault((a.text, b.text), []).append((shared, relation(a, b)))
    rows = []
    for (one, two), some in sorted(found.items(), key=lambda item: -len(item[1])):
        frames, relations = [shared for shared, _ in some], Counter(kind for _, kind in some)
        figures = len(some), sum(frames), min(frames), max(frames)
        rows.append((f"{one} & {two}", one, two, *figures, *(relations[kind] for kind in RELATIONS)))
    columns = "blend", "a", "b", "count", "frames", "shortest", "longest", *RELATIONS
    return Table("6.7-6.8", "Expressions that share frames", columns, tuple(rows))


def neighbours(study: Study) -> Table:
    """Return the shares of segments with a neighbour directly before or after, or within 1 s (6.3.3)."""
    found: Counter[tuple[str, str, str]] = Counter()
    for recording, segments in study.parts:
        for a in segments:
            near = [(b, "before" if b.first < a.first else "after") for b in segments if b is not a]
            relations = {(b.text, f"{side} within 1 s") for b, side in near if a.gap(b) <= recording.fps}
            relations |= {(b.text, side) for b, side in near if a.gap(b) <= 0}
            found.update((a.text, other, side) for other, side in relations)
    pairs = sorted({(a, b) for a, b, _ in found}, key=lambda pair: (-study.totals[pair[0]], pair))
    rows = tuple(
        (f"{a}, {b}", a, b, total, *(_percent(found[a, b, side], total) for side in NEIGHBOURS))
        for a, b in pairs
        for total in [study.totals[a]]
    )
    columns = "pair", "expression", "neighbour", "count", *(f"percent {side}" for side in NEIGHBOURS)
    return Table("neighbours", "Neighbours of expressions", columns, rows)


def speakers(study: Study) -> Table:
    """Return table 6.9: the speakers of the words that expressions accompany (eq. 6.11)."""
    found: Counter[tuple[str, str]] = Counter()
    for recording, segments in study.parts:
        for one in segments:
            voices = [word.by for word in recording.spoken if word.gap(one) < 0] or ["nobody"]
            changes = (
                voices[0]
                if len({*voices}) == 1
                else f"{voices[0]} to {'other' if voices[0] == SUBJECT else SUBJECT}"
            )
            found[one.text, changes] += 1
    rows = tuple(
        (name, *(_percent(found[name, who], total) for who in SPEAKERS))
        for name, total in study.totals.items()
    )
    return Table("6.9", "Percent of expressions by speaker", ("expression", *SPEAKERS), rows)


def sentences(recording: Recording) -> Iterator[tuple[list[Segment], str]]:
    """Yield the words of the subject's sentences, and their final signs."""
    words: list[Segment] = []
    for word, following in zip(recording.spoken, [*recording.spoken[1:], None], strict=False):
        if plain(word.text):
            words.append(word)
        elif words:  # a separate punctuation mark
            words[-1] = Segment(words[-1].first, word.last, words[-1].text + word.text, words[-1].by)
        sign = word.text.rstrip("\"'”’»)")[-1:]
        ends = sign in ".?!…" and not (following is not None and not plain(following.text))
        if words and (ends or following is None or following.by != word.by):
            if word.by == SUBJECT:
                yield words, sign if sign in "?!" else "."
            words = []


def questions(study: Study) -> Table:
    """Return table 6.10: expressions in the subject's questions, by number of words, and exclamations."""
    found: Counter[tuple[str, str]] = Counter()
    for recording, segments in study.parts:
        for words, sign in sentences(recording):
            span = Segment(words[0].first, words[-1].last, "")
            expressions = {"all", *(one.text for one in segments if one.gap(span) < 0)}
            kinds = [kind for kind, fits in KINDS.items() if fits(len(words), sign)]
            found.update((name, kind) for name in expressions for kind in kinds)
    rows = tuple((name, *(found[name, kind] for kind in KINDS)) for name in [*study.totals, "all"])
    return Table("6.10", "Expressions of questions and exclamations", ("expression", *KINDS), rows)


def words(study: Study) -> Table:
    """Return table 6.11: expressions at the subject's frequent words, and at watched ones."""
    occurrences = [(text, expressions) for text, _, by, expressions in study.linked if by == SUBJECT and text]
    found = Counter((text, name) for text, expressions in occurrences for name in expressions)
    usual = [
        (text, count)
        for text, count in Counter(text for text, _ in occurrences).most_common()
        if count >= FEWEST or text in study.watched
    ]
    rows = tuple((text, count, *(found[text, name] for name in study.totals)) for text, count in usual)
    return Table("6.11", "Expressions at words", ("word", "count", *study.totals), rows)


def emotional(study: Study) -> Table:
    """Return table 6.12: words with an expression within half a second."""
    rows = []
    for speaker, speakers_of in (("all", (SUBJECT, "other")), (SUBJECT, (SUBJECT,)), ("other", ("other",))):
        row: list[Any] = [speaker]
        for is_emotional in (False, True):
            some = [
                expressions
                for _, kind, by, expressions in study.linked
                if by in speakers_of and bool(kind) == is_emotional
            ]
            row += [len(some), sum(map(bool, some)), _percent(sum(map(bool, some)), len(some))]
        rows.append(tuple(row))
    kinds = ("words", "linked", "percent linked")
    columns = ("speaker", *(f"{which} {kind}" for which in ("other", "emotional") for kind in kinds))
    return Table("6.12", "Words with expressions", columns, tuple(rows))


def categories(study: Study, seed: int = 0) -> Table:
    """Return figure 6.11: expressions at words of each category, with odds ratios and 95 % intervals.

    The odds ratio compares the subject's words of the category with the subject's other words; half an
    occurrence is added to each cell (Haldane). The interval is computed by a bootstrap of words.
    """
    chance = np.random.default_rng(seed)
    occurrences = [(kind, expressions) for _, kind, by, expressions in study.linked if by == SUBJECT]
    rows = []
    for kind in sorted({kind for kind, _ in occurrences if kind}):
        for name in study.totals:
            cells = Counter((one == kind, name in expressions) for one, expressions in occurrences)
            table = np.array(
                [cells[in_category, met] for in_category in (True, False) for met in (True, False)]
            )
            if table[0]:
                tables = (
                    np.vstack([table, chance.multinomial(len(occurrences), table / len(occurrences), DRAWS)])
                    + 0.5
                )
                odds = tables[:, 0] * tables[:, 3] / (tables[:, 1] * tables[:, 2])
                figures = float(odds[0]), *np.percentile(odds[1:], [2.5, 97.5]).tolist()
                rows.append((f"{kind}, {name}", kind, name, int(table[:2].sum()), int(table[0]), *figures))
    columns = "pair", "category", "expression", "words", "linked", "odds ratio", "low", "high"
    return Table("6.13", "Expressions at emotional words", columns, tuple(rows))


def occurrences(study: Study) -> Table:
    """Return table 6.14: the shares of expressions among all, and among those at emotional words."""
    met = Counter(name for _, kind, _, expressions in study.linked if kind for name in expressions)
    rows = tuple(
        (name, _percent(total, len(study.every)), _percent(met[name], sum(met.values())))
        for name, total in study.totals.items()
    )
    columns = "expression", "percent of all", "percent at emotional words"
    return Table("6.14", "Shares of expressions", columns, rows)


TABLES: tuple[Callable[[Study], Table], ...] = (
    counts, lengths, distances, shares, blends, neighbours, speakers, questions, words, emotional, categories,
    occurrences,
)  # fmt: skip


def _lengths(segments: Sequence[Segment], name: str | None) -> list[int]:
    return [len(segment) for segment in segments if name in (None, segment.text)]


def _percent(part: int, total: int) -> float:
    return 100.0 * part / total if total else 0.0


def _fragments(study: Study) -> list[str]:
    return [str(recording.meta.get("fragment") or recording.name) for recording in study.recordings]


def _expressions_per_frame(recording: Recording, segments: Sequence[Segment]) -> Any:
    """Return the number of expressions in each frame."""
    count = np.zeros(recording.frames, np.int64)
    for one in segments:
        count[one.first : one.last + 1] += 1
    return count
