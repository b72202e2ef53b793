"""Registries of built-in objects and plug-ins, imported on first use.

A plug-in is an installed package with entry points in the group of a registry
(https://packaging.python.org/specifications/entry-points).
"""

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from realizer.core.errors import PluginError

T = TypeVar("T")

DISTRIBUTION = "bml-realizer"
# Longer values are not written out in warnings.
LONGEST = 60

log = logging.getLogger(__name__)

_installed = cache(entry_points)  # reading those of all packages takes 10 ms


@dataclass(frozen=True, slots=True)
class Plugin:
    """An entry point of another package.

    Attributes:
        group: such as "realizer.voices"; name: in that group.
        package: the distribution that it came with, or "".
        value: "module:attribute".
        fault: why it cannot be used, or "".
    """

    group: str
    name: str
    package: str
    value: str
    fault: str


class Registry(Mapping[str, T], Generic[T]):
    """The objects of one kind by name; a plug-in cannot replace a built-in object.

    `registry[name]` imports the object, and raises PluginError if a plug-in cannot be used.

    Args:
        group: group of entry points for plug-ins, such as "realizer.outputs".
        ours: name -> "module:attribute" of the built-in objects.
        wanted: description of the objects, for messages.
        accepts: returns whether an object of a plug-in is of this kind.
        name_of: returns the name that an object must have in the group; None: any.
    """

    def __init__(
        self,
        group: str,
        ours: Mapping[str, str],
        wanted: str,
        accepts: Callable[[Any], bool],
        name_of: Callable[[T], str] | None = None,
    ) -> None:
        self.group = group
        self._ours = ours
        self._wanted = wanted
        self._accepts = accepts
        self._name_of = name_of
        self._objects: dict[str, T] = {}

    def __getitem__(self, name: str) -> T:
        if name not in self._objects:
            self._objects[name] = self._load(name)
        return self._objects[name]

    def __iter__(self) -> Iterator[str]:
        yield from self._ours
        yield from self._plugins

    def __len__(self) -> int:
        return len(self._ours) + len(self._plugins)

    def __contains__(self, name: object) -> bool:  # without an import
        return name in self._ours or name in self._plugins

    def working(self, names: Iterable[str] | None = None) -> Iterator[tuple[str, T]]:
        """Yield names (by default all) and objects; log a warning for each plug-in that cannot be used."""
        for name in self if names is None else names:
            try:
                yield name, self[name]
            except PluginError as error:
                self._warn(str(error))

    def plugins(self) -> list[Plugin]:
        """Return the plug-ins of other packages in this group, imported to see whether they can be used."""
        found = []
        for point in sorted(_installed().select(group=self.group), key=lambda point: point.name):
            if _is_own(point):
                continue
            fault = "" if self._plugins.get(point.name) is point else "its name is taken"
            try:
                if not fault:
                    self[point.name]
            except PluginError as error:
                fault = str(error)
            package = point.dist.name if point.dist else ""
            found.append(Plugin(self.group, point.name, package, point.value, fault))
        return found

    @cached_property
    def _plugins(self) -> dict[str, EntryPoint]:
        found: dict[str, EntryPoint] = {}
        for point in sorted(_installed().select(group=self.group), key=_is_own, reverse=True):
            if point.name in self._ours or point.name in found:
                self._warn(f"{_described(point)} is not used: its name is taken")
            else:
                found[point.name] = point
        return dict(sorted(found.items()))

    @cached_property
    def _warn(self) -> Callable[[str], None]:
        return cache(log.warning)

    def _load(self, name: str) -> T:
        if name in self._ours:
            module, _, attribute = self._ours[name].partition(":")
            ours: T = getattr(import_module(module), attribute)
            return ours
        point = self._plugins[name]
        package = point.module.partition(".")[0]
        try:
            loaded: T = point.load()
        except Exception as error:
            if isinstance(error, ModuleNotFoundError) and error.name == package:
                again = f": pip install --force-reinstall {point.dist.name}" if point.dist else ""
                what = repr(name) if _is_own(point) else _described(point)
                words = f"{what} needs the package {package}, which is not installed{again}"
                raise PluginError(words) from None
            reason = f"{type(error).__name__}: {error}"
            raise PluginError(f"{_described(point)} cannot be imported: {reason}") from error
        if not self._accepts(loaded):
            got = _shortened(loaded)
            raise PluginError(f"{_described(point)} cannot be used: wanted {self._wanted}, got {got}")
        if self._name_of is not None and (wanted := self._name_of(loaded)) != name:
            raise PluginError(f"{_described(point)} cannot be used: wanted the name {wanted!r}")
        return loaded


def _is_own(point: EntryPoint) -> bool:
    """Return whether an entry point is one of this distribution, which no other package can replace."""
    return point.dist is not None and point.dist.name == DISTRIBUTION


def _shortened(value: object) -> str:
    """Return a value as Python writes it, or only its type if that is long."""
    text = repr(value)
    if len(text) <= LONGEST:
        return text
    if isinstance(value, tuple):
        return f"a tuple of {', '.join(dict.fromkeys(type(item).__name__ for item in value))}"
    return f"an object of the type {type(value).__name__}"


def _described(point: EntryPoint) -> str:
    package = f" of {point.dist.name}" if point.dist else ""
    return f"plug-in {point.name!r}{package} ({point.group}, {point.value})"
