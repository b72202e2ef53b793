"""Statistics of the expressions of a corpus: tables 6.3 to 6.14 of Wojdel 2005, of any recordings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from realizer.corpus.recording import SUBJECT, Recording, Segment
from realizer.tables.emotional_words import WordList

NEAR = 12  # frames at 25 a second between an expression and a word that it belongs to (eq. 6.13)
FEWEST = 7  # segments that have a standard deviation, and occurrences of a word that has a row
SHORT = 5  # words of a short question
BETWEEN = 1.0  # s between neighbours (6.3.3)
DRAWS = 1000  # of the bootstrap


@dataclass(frozen=True)
class Table:
    """A table: `name` of its file, title, columns and rows; None is an empty cell."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def column(self, name: str) -> dict[str, Any]:
        """Return first cell -> cell of a column."""
        return {str(row[0]): row[self.columns.index(name)] for row in self.rows}


class Sentence(NamedTuple):
    """Words up to the end of a sentence or a turn; `end` is its last sign."""

    words: tuple[Segment, ...]
    end: str


class Overlap(NamedTuple):
    """Two expressions that share frames, by their names in order of the alphabet, and their relation."""

    one: str
    two: str
    relation: str
    frames: int


@dataclass(frozen=True)
class Study:
    """Recordings with one annotator's segments.

    Attributes:
        recordings: at least one.
        annotator: whose labels count; None: the first of each recording.
        words: emotional words; None: there are none.
    """

    recordings: Sequence[Recording]
    annotator: str | None = None
    words: WordList | None = None

    @cached_property
    def segments(self) -> list[list[Segment]]:
        """The segments of each recording."""
        return [recording.segments(self.annotator) for recording in self.recordings]

    @cached_property
    def every(self) -> list[Segment]:
        return [segment for some in self.segments for segment in some]

    @cached_property
    def names(self) -> list[str]:
        """The expressions, most frequent first."""
        return [name for name, _ in Counter(segment.text for segment in self.every).most_common()]

    @cached_property
    def frames(self) -> int:
        return sum(recording.frames for recording in self.recordings)

    @cached_property
    def linked(self) -> list[tuple[str, str, str, frozenset[str]]]:
        """Word, category or "", speaker, and the expressions within half a second (eq. 6.12, 6.13)."""
        found = []
        for recording, segments in zip(self.recordings, self.segments, strict=True):
            near = NEAR * recording.fps / 25.0
            texts = [plain(word.text) for word in recording.spoken]
            kinds = self.words.categories(texts) if self.words is not None else [""] * len(texts)
            for word, text, kind in zip(recording.spoken, texts, kinds, strict=True):
                around = {s.text for s in segments if distance(s, word) <= near}
                found.append((text, kind, word.by, frozenset(around)))
        return found


def plain(word: str) -> str:
    """Return a word in lower case without signs around it."""
    return word.strip(" .,;:!?…\"'“”‘’«»()-–").lower()


def distance(one: Segment, other: Segment) -> int:
    """Return the frames between two segments; 0 if they meet or overlap (eq. 6.12)."""
    return max(one.first - other.last - 1, other.first - one.last - 1, 0)


def counts(study: Study) -> Table:
    """Table 6.3, and rows of all segments and of the frames with one, two or more of them."""
    rows: list[tuple[Any, ...]] = []
    for name in study.names:
        lengths = [len(segment) for segment in study.every if segment.text == name]
        rows.append((name, len(lengths), sum(lengths), _percent(sum(lengths), study.frames)))
    total = sum(len(segment) for segment in study.every)
    rows.append(("all", len(study.every), total, _percent(total, study.frames)))
    shown = np.concatenate([_shown(r, s) for r, s in zip(study.recordings, study.segments, strict=True)])
    for number in (0, 1, 2):
        frames = int((shown == number).sum() if number < 2 else (shown >= 2).sum())
        rows.append((f"frames with {number}", None, frames, _percent(frames, study.frames)))
    return Table("6.3", "Segments and frames", ("expression", "segments", "frames", "percent"), tuple(rows))


def lengths(study: Study) -> Table:
    """Table 6.4; the deviation of expressions with at least seven segments."""
    rows: list[tuple[Any, ...]] = []
    for name in study.names:
        own = [len(segment) for segment in study.every if segment.text == name]
        deviation = float(np.std(own, ddof=1)) if len(own) >= FEWEST else None
        rows.append((name, min(own), max(own), float(np.mean(own)), deviation))
    columns = "expression", "shortest", "longest", "mean", "deviation"
    return Table("6.4", "Lengths of segments, frames", columns, tuple(rows))


def distances(study: Study) -> Table:
    """Table 6.5: D_k(i) and D_k in seconds (eq. 6.2, 6.3) of each fragment; "inf" of a single appearance."""
    rows: list[tuple[Any, ...]] = []
    for name in [None, *study.names]:
        row: list[Any] = [name or "all"]
        for recording, segments in zip(study.recordings, study.segments, strict=True):
            own = [len(one) for one in segments if name in (None, one.text)]
            mean = (recording.frames - sum(own)) / (recording.fps * len(own)) if own else None
            row.append(float("inf") if len(own) == 1 else mean)
        rows.append(tuple(row))
    return Table("6.5", "Seconds between expressions", ("expression", *_fragments(study)), tuple(rows))


def shares(study: Study) -> Table:
    """Table 6.6, with the mood of each fragment."""
    rows = []
    for name, recording, segments in zip(_fragments(study), study.recordings, study.segments, strict=True):
        expressive = int((_shown(recording, segments) > 0).sum())
        mean = float(np.mean([len(one) for one in segments])) if segments else None
        rows.append((name, recording.meta.get("mood", ""), _percent(expressive, recording.frames), mean))
    columns = "fragment", "mood", "expressive percent", "mean length"
    return Table("6.6", "Expressive frames and lengths by fragment", columns, tuple(rows))


def overlaps(study: Study) -> list[Overlap]:
    """Return all pairs of different expressions that share frames."""
    found = []
    for segments in study.segments:
        for a, b in combinations(segments, 2):
            frames = min(a.last, b.last) - max(a.first, b.first) + 1
            if frames > 0 and a.text != b.text:
                one, two = sorted((a, b), key=lambda segment: segment.text)
                found.append(Overlap(one.text, two.text, relation(one, two), frames))
    return found


def relation(a: Segment, b: Segment) -> str:
    """Return how two segments that share frames lie (table 6.8)."""
    if (a.first, a.last) == (b.first, b.last):
        return "a = b"
    if a.first <= b.first and b.last <= a.last:
        return "b in a"
    if b.first <= a.first and a.last <= b.last:
        return "a in b"
    return "a then b" if a.first < b.first else "b then a"


RELATIONS = ("a then b", "b then a", "b in a", "a in b", "a = b")


def blends(study: Study) -> Table:
    """Tables 6.7 and 6.8."""
    pairs: dict[tuple[str, str], list[Overlap]] = {}
    for overlap in overlaps(study):
        pairs.setdefault((overlap.one, overlap.two), []).append(overlap)
    rows: list[tuple[Any, ...]] = []
    for (one, two), some in sorted(pairs.items(), key=lambda item: -len(item[1])):
        frames, ways = [o.frames for o in some], Counter(o.relation for o in some)
        head = f"{one} & {two}", one, two, len(some), sum(frames), min(frames), max(frames)
        rows.append((*head, *(ways[way] for way in RELATIONS)))
    columns = "blend", "a", "b", "count", "frames", "shortest", "longest", *RELATIONS
    return Table("6.7-6.8", "Expressions that share frames", columns, tuple(rows))


def neighbours(study: Study) -> Table:
    """Neighbours (6.3.3): shares of segments of a that b precedes or follows directly, or within a second."""
    found: Counter[tuple[str, str, str]] = Counter()
    for recording, segments in zip(study.recordings, study.segments, strict=True):
        for k, a in enumerate(segments):
            seen = set()
            for n, b in enumerate(segments):
                if n != k and (gap := distance(a, b)) <= BETWEEN * recording.fps:
                    side = "before" if b.first < a.first else "after"
                    seen |= {(b.text, f"{side} within 1 s")} | ({(b.text, side)} if not gap else set())
            found.update((a.text, other, side) for other, side in seen)
    totals = Counter(segment.text for segment in study.every)
    sides = "before", "after", "before within 1 s", "after within 1 s"
    pairs = sorted({(a, b) for a, b, _ in found}, key=lambda pair: (-totals[pair[0]], pair))
    rows = tuple(
        (f"{a}, {b}", a, b, totals[a], *(_percent(found[a, b, side], totals[a]) for side in sides))
        for a, b in pairs
    )
    columns = "pair", "expression", "neighbour", "count", *(f"percent {side}" for side in sides)
    return Table("neighbours", "Neighbours of expressions", columns, rows)


SPEAKERS = ("subject", "other", "subject to other", "other to subject", "nobody")


def speakers(study: Study) -> Table:
    """Table 6.9: whose text expressions accompany (eq. 6.11)."""
    found: Counter[tuple[str, str]] = Counter()
    for recording, segments in zip(study.recordings, study.segments, strict=True):
        for one in segments:
            said = [word.by for word in recording.spoken if word.last >= one.first and word.first <= one.last]
            turn = said[0] if len(set(said)) < 2 and said else "nobody"
            if len(set(said)) == 2:
                turn = SPEAKERS[2] if said[0] == SUBJECT else SPEAKERS[3]
            found[one.text, turn] += 1
    totals = Counter(segment.text for segment in study.every)
    rows = tuple(
        (name, *(_percent(found[name, who], totals[name]) for who in SPEAKERS)) for name in study.names
    )
    return Table("6.9", "Percent of expressions by speaker", ("expression", *SPEAKERS), rows)


def sentences(recording: Recording) -> Iterator[Sentence]:
    """Yield the sentences of the subject."""
    words: list[Segment] = []
    for word, following in zip(recording.spoken, [*recording.spoken[1:], None], strict=False):
        if plain(word.text):
            words.append(word)
        elif words:  # a sign by itself
            words[-1] = Segment(words[-1].first, word.last, words[-1].text + word.text, words[-1].by)
        signs = word.text.rstrip("\"'”’»)")[-1:]
        ends = signs in ".?!…" and not (following is not None and not plain(following.text))
        if words and (ends or following is None or following.by != word.by):
            if word.by == SUBJECT:
                yield Sentence(tuple(words), signs if signs in "?!" else ".")
            words = []


KINDS: dict[str, Callable[[Sentence], bool]] = {
    "single-word question": lambda s: s.end == "?" and len(s.words) == 1,
    "short question": lambda s: s.end == "?" and 1 < len(s.words) <= SHORT,
    "long question": lambda s: s.end == "?" and len(s.words) > SHORT,
    "exclamation": lambda s: s.end == "!",
}


def questions(study: Study) -> Table:
    """Table 6.10: expressions of the subject's questions, by their number of words, and exclamations."""
    found: Counter[tuple[str, str]] = Counter()
    for recording, segments in zip(study.recordings, study.segments, strict=True):
        for sentence in sentences(recording):
            for kind in (kind for kind, fits in KINDS.items() if fits(sentence)):
                found["all", kind] += 1
                span = Segment(sentence.words[0].first, sentence.words[-1].last, "")
                shown = {one.text for one in segments if one.first <= span.last and span.first <= one.last}
                found.update((name, kind) for name in shown)
    rows = tuple((name, *(found[name, kind] for kind in KINDS)) for name in [*study.names, "all"])
    return Table("6.10", "Expressions of questions and exclamations", ("expression", *KINDS), rows)


def words(study: Study) -> Table:
    """Table 6.11: expressions at frequent words of the subject."""
    said = [(text, shown) for text, _, by, shown in study.linked if by == SUBJECT and text]
    usual = [text for text, count in Counter(text for text, _ in said).most_common() if count >= FEWEST]
    found = Counter((text, name) for text, shown in said for name in shown)
    totals = Counter(text for text, _ in said)
    rows = tuple((text, totals[text], *(found[text, name] for name in study.names)) for text in usual)
    return Table("6.11", "Expressions at frequent words", ("word", "count", *study.names), rows)


def emotional(study: Study) -> Table:
    """Table 6.12: words with an expression within half a second."""
    rows = []
    for who, by in (("all", ("subject", "other")), ("subject", ("subject",)), ("other", ("other",))):
        row: list[Any] = [who]
        for emotional_ones in (False, True):
            some = [
                shown
                for _, kind, speaker, shown in study.linked
                if speaker in by and bool(kind) == emotional_ones
            ]
            met = sum(bool(shown) for shown in some)
            row += [len(some), met, _percent(met, len(some))]
        rows.append(tuple(row))
    columns = (
        "speaker", "other words", "linked", "percent linked",
        "emotional words", "emotional linked", "emotional percent linked",
    )  # fmt: skip
    return Table("6.12", "Words with expressions", columns, tuple(rows))


def categories(study: Study, seed: int = 0) -> Table:
    """Figure 6.11: expressions at words of each category, with odds ratios and their 95 % intervals.

    The odds ratio compares the subject's words of the category with all others of theirs, half an occurrence
    added to each cell (Haldane); the interval is a bootstrap of words.
    """
    chance = np.random.default_rng(seed)
    said = [(kind, shown) for _, kind, by, shown in study.linked if by == SUBJECT]
    rows: list[tuple[Any, ...]] = []
    for kind in sorted({kind for kind, _ in said if kind}):
        for name in study.names:
            cells = Counter((one == kind, name in shown) for one, shown in said)
            table = [cells[key] for key in ((True, True), (True, False), (False, True), (False, False))]
            if not table[0]:
                continue
            draws = chance.multinomial(len(said), np.array(table) / len(said), DRAWS)
            low, high = np.percentile(_odds(draws), [2.5, 97.5]).tolist()
            ratio = float(_odds(np.array([table]))[0])
            rows.append((f"{kind}, {name}", kind, name, table[0] + table[1], table[0], ratio, low, high))
    columns = "pair", "category", "expression", "words", "linked", "odds ratio", "low", "high"
    return Table("6.13", "Expressions at emotional words", columns, tuple(rows))


def occurrences(study: Study) -> Table:
    """Table 6.14: shares of all expressions, and of those at emotional words."""
    met = Counter(name for _, kind, _, shown in study.linked if kind for name in shown)
    totals = Counter(segment.text for segment in study.every)
    rows = tuple(
        (name, _percent(totals[name], len(study.every)), _percent(met[name], sum(met.values())))
        for name in study.names
    )
    columns = "expression", "percent of all", "percent at emotional words"
    return Table("6.14", "Shares of expressions", columns, rows)


TABLES: tuple[Callable[[Study], Table], ...] = (
    counts, lengths, distances, shares, blends, neighbours, speakers, questions, words, emotional, categories,
    occurrences,
)  # fmt: skip


def _odds(tables: Any) -> Any:
    a, b, c, d = (np.asarray(tables, np.float64) + 0.5).T
    return a * d / (b * c)


def _percent(part: int, whole: int) -> float:
    return 100.0 * part / whole if whole else 0.0


def _fragments(study: Study) -> list[str]:
    return [str(recording.meta.get("fragment") or recording.name) for recording in study.recordings]


def _shown(recording: Recording, segments: Sequence[Segment]) -> Any:
    """Return how many expressions each frame shows."""
    shown = np.zeros(recording.frames, np.int64)
    for one in segments:
        shown[one.first : one.last + 1] += 1
    return shown
