"""A union-find structure with offsets in seconds, for points at fixed distances."""

from __future__ import annotations


class UnionFind:
    """n points; tied points move together. The smallest number of a class is its root.

    Attributes:
        parent, shift: time[i] = time[parent[i]] + shift[i]; after `find(i)` the parent is the root.
    """

    __slots__ = ("parent", "shift")

    def __init__(self, n: int) -> None:
        self.parent = list(range(n))
        self.shift = [0.0] * n

    def find(self, i: int) -> int:
        """Return the root of i's class."""
        parent = self.parent
        root = parent[i]
        if parent[root] == root:
            return root
        trail = []
        while parent[i] != i:
            trail.append(i)
            i = parent[i]
        shift, total = self.shift, 0.0
        for k in reversed(trail):
            total += shift[k]
            shift[k] = total
            parent[k] = i
        return i

    def tie(self, u: int, v: int, seconds: float) -> float:
        """Tie two points: time[u] = time[v] + seconds.

        Returns:
            0.0; or, if u and v were tied already, the difference to their present distance.
        """
        parent = self.parent
        a, b = parent[u], parent[v]
        if parent[a] != a:
            a = self.find(u)
        if parent[b] != b:
            b = self.find(v)
        # time[a] + shift[u] = time[b] + shift[v] + seconds
        apart = self.shift[v] + seconds - self.shift[u]
        if a == b:
            return apart
        if a > b:
            parent[a], self.shift[a] = b, apart
        else:
            parent[b], self.shift[b] = a, -apart
        return 0.0
