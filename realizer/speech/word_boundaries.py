"""Detection of boundaries between words that an engine reports as one."""

from collections.abc import Collection, Sequence
from itertools import pairwise

import numpy as np

from realizer.tables.phonemes import vowels

MAX_CELLS = 60_000  # of an alignment; longer texts are divided by numbers of phonemes
SKIP, UNLIKE, ALIKE, HINT = 0.7, 1.2, 0.4, -0.5  # costs of the alignment; our choice


def boundaries(
    expected: Sequence[Sequence[str]], heard: Sequence[str], hints: Collection[int] = ()
) -> list[int]:
    """Return the index of each word's first phoneme, by aligning the phonemes of words spoken separately.

    Args:
        expected: phonemes of each word spoken separately.
        heard: phonemes of all words spoken together.
        hints: indices at which the engine reports a word.
    """
    flat = [(strip_marks(sound), n == 0) for word in expected for n, sound in enumerate(word)]
    if not flat or len(flat) * len(heard) > MAX_CELLS:
        counts = np.array([max(len(word), 1) for word in expected], float)
        shares = np.concatenate(([0.0], np.cumsum(counts)[:-1])) / counts.sum()
        return [round(share * len(heard)) for share in shares]
    plain = [strip_marks(sound) for sound in heard]
    # Lists are faster than arrays, because the groups are small and indexed one number at a time.
    cost = [SKIP * j for j in range(len(plain) + 1)]
    steps = [[2] * (len(plain) + 1)]  # 0 both, 1 expected alone, 2 heard alone
    for sound, opens in flat:
        above, cost, step = cost, [cost[0] + SKIP], [1]
        for j, other in enumerate(plain):
            hint = HINT if opens and j in hints else 0.0
            ways = (above[j] + _difference(sound, other) + hint, above[j + 1] + SKIP, cost[j] + SKIP)
            cost.append(min(ways))
            step.append(ways.index(cost[-1]))
        steps.append(step)
    at = [0] * len(flat)  # for each expected phoneme, the index of the first heard one from there on
    i, j = len(flat), len(plain)
    while i:
        if steps[i][j] == 2:
            j -= 1
            continue
        j -= steps[i][j] == 0
        i -= 1
        at[i] = j
    found, passed = [], 0
    for word in expected:
        found.append(at[passed] if passed < len(at) else len(plain))
        passed += len(word)
    found[0] = 0
    return found


def divided(
    own: Sequence[int], expected: Sequence[Sequence[str]], heard: Sequence[str], hints: Collection[int] = ()
) -> list[Sequence[int]]:
    """Return the part of each word of `own`, items of the heard phonemes; the rest is as for `boundaries`."""
    return [own[first:last] for first, last in pairwise([*boundaries(expected, heard, hints), len(own)])]


def strip_marks(ipa: str) -> str:
    """Return a phoneme without stress and length marks."""
    return ipa.strip("ˈˌː_").replace("ː", "")


def is_vowel(ipa: str) -> bool:
    """Return whether a phoneme without marks begins with a vowel."""
    return ipa[:1] in vowels()


def _difference(a: str, b: str) -> float:
    if a == b:
        return 0.0
    if not a or not b:
        return UNLIKE
    return ALIKE if is_vowel(a) == is_vowel(b) else UNLIKE
