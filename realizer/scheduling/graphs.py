"""Graph algorithms: longest paths, the cycles that prevent them, strong components, and tied points."""

from collections.abc import Sequence

from realizer.core import work


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
        """Tie points: time[u] = time[v] + seconds; return the misfit if they were tied already, else 0."""
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


Edge = tuple[int, int, float]


def longest_path_levels(level: list[float], edges: Sequence[Edge], slack: float) -> list[int] | None:
    """Raise levels in place, as little as possible, until all edges have level[v] + slack >= level[u] + w.

    This is Bellman-Ford's longest path from the given levels. It takes one sweep if the edges (u, v, w) come
    in the order of the paths, so pass them sorted by the approximate final level of their tails. Return None;
    or, if there is no end, the numbers of edges that form a cycle of positive length, in order.
    """
    cause: dict[int, int] = {}
    sweep = 0
    while True:
        sweep += 1
        work.count(1 + len(edges) // 8)
        moved = False
        for k, (u, v, w) in enumerate(edges):
            need = level[u] + w
            if level[v] < need - slack:
                level[v] = need
                cause[v] = k
                moved = True
        if not moved:
            return None
        # The search for a cycle costs as much as a sweep, so it is done after some sweeps only.
        looks = sweep & (sweep - 1) == 0 or sweep % 8 == 0
        if looks and (cycle := _cycle(cause, edges)):
            return cycle


def _cycle(cause: dict[int, int], edges: Sequence[Edge]) -> list[int]:
    """Return a cycle among the edges that raised their heads last, or []."""
    seen: dict[int, int] = {}
    for start in work.counted(cause):
        at = start
        while at in cause and at not in seen:
            seen[at] = start
            at = edges[cause[at]][0]
        if at in cause and seen[at] == start:
            found = []
            end = at
            while True:
                found.append(cause[at])
                at = edges[cause[at]][0]
                if at == end:
                    return found[::-1]
    return []


def components(n: int, edges: Sequence[Edge]) -> list[int]:
    """Return the strong component of each of n nodes, numbered so that no edge leads to a lower number.

    Source: Tarjan (1972), without recursion.
    """
    work.count(n + len(edges))
    after: list[list[int]] = [[] for _ in range(n)]
    for u, v, _ in edges:
        after[u].append(v)
    index, low, component = [-1] * n, [0] * n, [-1] * n
    stack: list[int] = []
    counter = found = 0
    for root in range(n):
        if index[root] >= 0:
            continue
        todo = [(root, 0)]
        while todo:
            at, k = todo.pop()
            if index[at] < 0:
                index[at] = low[at] = counter
                counter += 1
                stack.append(at)
            for step in range(k, len(after[at])):
                to = after[at][step]
                if index[to] < 0:
                    todo += [(at, step), (to, 0)]
                    break
                if component[to] < 0:
                    low[at] = min(low[at], low[to])
            else:
                if low[at] == index[at]:
                    while True:
                        node = stack.pop()
                        component[node] = found
                        if node == at:
                            break
                    found += 1
    # Tarjan closes the last components first.
    return [found - 1 - c for c in component]
