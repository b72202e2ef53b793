"""Times of words and IPA phonemes from hibari's readings and durations."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from realizer import tables
from realizer.core.array_types import Int16
from realizer.speech.word_boundaries import boundaries, is_vowel, strip_marks
from realizer.speech.words import words_in

Role = Literal["sound", "primary", "secondary", "long", "pause", "joint"]
# What a reader makes of a text: written word, phonemes in hibari's signs, whether a blank follows.
Token = tuple[str, str, bool]
WINDOW = 12  # words that a number or an abbreviation is read as, at most
QUIET = 0.02  # of the loudest sample: where a sentence without known lengths is taken to begin and end
SILENCE = 40  # of 32768; its pauses are nearly zeros, its faintest fricatives above 100
KEPT_OF_LAST = 0.4  # of a sound whose end is silent
SHARES = {"pause": 1.5, "vowel": 1.0, "consonant": 0.6}  # of a sentence without known lengths; ours


@dataclass(frozen=True, slots=True)
class SignRow:
    """A row of the table of hibari's signs."""

    sign: str
    ipa: str
    role: Role


@dataclass(frozen=True, slots=True)
class Lengths:
    """How long each sign of a sentence is, in samples; they add up to its sound."""

    lead: int
    signs: tuple[int, ...]
    tail: int


@dataclass(frozen=True, slots=True)
class Sound:
    """One phoneme or pause (ipa ""): samples from the start of its sentence; `token` is its word's index."""

    ipa: str
    stress: int
    start: int
    end: int
    token: int


@cache
def _signs() -> Mapping[str, SignRow]:
    name = "phonemes_hibari.csv"
    rows = tables.read_csv(tables.text_of(name), SignRow, name)
    return {row.sign or " ": row for row in rows}


def _role(sign: str) -> tuple[str, Role]:
    row = _signs().get(sign)
    return (row.ipa, row.role) if row else (sign, "sound")


def signs_of(sentence: Sequence[Token]) -> tuple[str, tuple[int, ...]]:
    """The signs that hibari is given, and for each the index of its token."""
    signs, owners = "", []
    for k, (_, phonemes, blank) in enumerate(sentence):
        said = phonemes + (" " if blank and k + 1 < len(sentence) else "")
        signs += said
        owners += [k] * len(said)
    return signs, tuple(owners)


def sounds(sentence: Sequence[Token], lengths: Lengths) -> list[Sound]:
    """Phonemes and pauses in order; they tile the sentence from 0.

    A stress counts to its vowel, and what hibari gives to a blank to the phoneme before.
    """
    signs, owners = signs_of(sentence)
    found = [Sound("", 0, 0, lengths.lead, 0)]
    at = lengths.lead
    opened: tuple[int, int] | None = None  # stress, and where it began
    for sign, owner, length in zip(signs, owners, lengths.signs, strict=True):
        ipa, role = _role(sign)
        end = at + length
        last = found[-1]
        if role in ("primary", "secondary"):
            opened = (1 if role == "primary" else 2, at if opened is None else opened[1])
        elif role == "sound":
            stress, start = opened or (0, at)
            found.append(Sound(ipa, stress, start, end, owner))
            opened = None
        elif role == "pause" and last.ipa:
            found.append(Sound("", 0, last.end, end, owner))
        else:
            mark = "ː" if sign == "ː" and last.ipa else ""
            found[-1] = Sound(last.ipa + mark, last.stress, last.start, end, last.token)
        at = end
    last = found[-1]
    end = at + lengths.tail
    if last.ipa and end > last.end:
        found.append(Sound("", 0, last.end, end, last.token))
    else:
        found[-1] = Sound(last.ipa, last.stress, last.start, end, last.token)
    return [sound for sound in found if sound.end > sound.start]


def trim_to_sound(told: Sequence[Sound], pcm: Int16) -> list[Sound]:
    """The same with pauses that begin where it falls silent: the last sound of a phrase is told too long."""
    found = list(told)
    for k in range(1, len(found)):
        last, pause = found[k - 1], found[k]
        if pause.ipa or not last.ipa:
            continue
        least = last.start + round(KEPT_OF_LAST * (last.end - last.start))
        part = pcm[least : (pause.start + pause.end) // 2]
        loud = np.flatnonzero(np.abs(part.astype(np.int32)) > SILENCE)
        begin = least + (int(loud[-1]) + 1 if len(loud) else 0)
        found[k - 1] = replace(last, end=begin)
        found[k] = replace(pause, start=begin)
    return found


def guess_lengths(sentence: Sequence[Token], pcm: Int16) -> Lengths:
    """Lengths by rule, where the model does not tell them: shares of the part of the sound that is heard."""
    loud = np.flatnonzero(
        np.abs(pcm.astype(np.int32)) > QUIET * max(1, int(np.abs(pcm.astype(np.int32)).max()))
    )
    first, last = (int(loud[0]), int(loud[-1]) + 1) if len(loud) else (0, len(pcm))
    shares = []
    for sign in signs_of(sentence)[0]:
        ipa, role = _role(sign)
        kind = role if role != "sound" else "vowel" if is_vowel(ipa) else "consonant"
        shares.append(SHARES.get(kind, 0.0))
    total = sum(shares)
    if not total:
        return Lengths(0, (0,) * len(shares), len(pcm))
    borders = first + np.rint(np.cumsum([0.0, *shares]) / total * (last - first)).astype(int)
    return Lengths(first, tuple(np.diff(borders).tolist()), len(pcm) - int(borders[-1]))


def word_spans(
    words: Sequence[str],
    tokens: Sequence[Token],
    heard: Sequence[Sound],
    alone: Callable[[Sequence[str]], Sequence[Sequence[str]]],
) -> list[tuple[int, int]]:
    """For each of our words the indices of its first sound and of the one after its last; equal for none.

    hibari writes numbers, dates and abbreviations out before it reads them: words that stand in its own text
    too are found there, what lies between is shared out by how each word sounds alone.

    Args:
        words: ours, as they are written.
        tokens: hibari's, of all sentences.
        heard: of all sentences; `token` counts through.
        alone: words -> phonemes of each by itself.
    """
    firsts: dict[int, int] = {}
    for k, sound in enumerate(heard):
        if sound.ipa:
            firsts.setdefault(sound.token, k)
    if not words or not firsts:
        return [(0, 0)] * len(words)
    text, starts = "", {}
    for k, (word, _, blank) in enumerate(tokens):
        starts[len(text)] = k
        text += word + (" " if blank else "")
    theirs = list(words_in(text))
    begins: dict[int, int] = {}
    latest = -1
    for mine, other in _matched([w.lower() for w in words], [w.lower() for w, _ in theirs]):
        first = firsts.get(starts.get(theirs[other][1], -1), -1)
        if first > latest:
            begins[mine] = latest = first
    begins[0] = next(iter(firsts.values()))

    order = sorted(begins)
    found: list[tuple[int, int]] = []
    for k, opens in enumerate(order):
        inside = range(opens, order[k + 1] if k + 1 < len(order) else len(words))
        until = begins[order[k + 1]] if k + 1 < len(order) else len(heard)
        own = [i for i in range(begins[opens], until) if heard[i].ipa]
        at = [0]
        if len(inside) > 1:
            at = boundaries(alone([words[i] for i in inside]), [strip_marks(heard[i].ipa) for i in own])
        at.append(len(own))
        for n in range(len(inside)):
            part = own[at[n] : at[n + 1]]
            last = found[-1][1] if found else begins[opens]
            found.append((part[0], part[-1] + 1) if part else (last, last))
    return found


def _matched(ours: Sequence[str], theirs: Sequence[str]) -> list[tuple[int, int]]:
    """Pairs of equal words in order: on from the nearest pair after each that differ."""
    pairs = []
    i = j = 0
    while i < len(ours) and j < len(theirs):
        if ours[i] == theirs[j]:
            pairs.append((i, j))
            i, j = i + 1, j + 1
            continue
        steps = ((a, n - a) for n in range(1, 2 * WINDOW) for a in range(n + 1))
        near = (
            (i + a, j + b)
            for a, b in steps
            if i + a < len(ours) and j + b < len(theirs) and ours[i + a] == theirs[j + b]
        )
        i, j = next(near, (i + 1, j + 1))
    return pairs
