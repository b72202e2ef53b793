"""How sessions share the event loop: when they are woken, when they read documents, how long calls take."""

import asyncio
import math
import time
from collections import deque
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Generic, ParamSpec, TypeVar

from greenlet import getcurrent, greenlet

from bml_schema.steps import on_element
from realizer.core import work

T = TypeVar("T", bound=Hashable)
R = TypeVar("R")
P = ParamSpec("P")

SLICE = 0.004  # s; a call is paused where it counts its work after so long
# Wake-up times are rounded up to whole steps of uvloop's clock, except those so little after a step. A timer
# of uvloop costs more than many frames: the sessions of a step share one.
STEP = 0.001  # s
SLACK = 5e-4  # of a step
TURN = 0.004  # s; so long sessions are woken before the loop looks for messages again
# Of the time since documents were last read, so much goes to documents before frames come again. When more is
# due than can be done, frames are late and documents are still read; an overloaded process reads no more than
# this share of the time.
READING_SHARE = 0.25
LONGEST_READING = 0.02  # s


class WakeUps(Generic[T]):
    """The times at which sessions are woken, each at most once.

    Args:
        wake: called with a session and the time at which it was to be woken.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, wake: Callable[[T, float], None]) -> None:
        self._loop = loop
        self._wake = wake
        self._times: dict[T, tuple[float, int]] = {}  # and the steps they are rounded up to
        self._steps: dict[int, dict[T, None]] = {}  # the sessions of a step, which share a timer
        self._due: deque[tuple[int, T]] = deque()  # those whose step has come, to be woken in turn
        self._closed = False

    def set(self, session: T, when: float) -> None:
        """Wake a session at a time, instead of the one before; infinite: never.

        A session that is already due stays so, or one that gets messages all the time would never be woken.
        """
        now = self._loop.time()
        when = max(when, now)
        if (known := self._times.get(session)) is not None:
            old, step = known
            if when < math.inf and (old == when or old <= now):
                return
            del self._times[session]
            self._steps.get(step, {}).pop(session, None)
        if when < math.inf and not self._closed:
            step = math.ceil(when / STEP - SLACK)
            self._times[session] = when, step
            if step not in self._steps:
                self._steps[step] = {}
                self._loop.call_at(step * STEP, self._wake_step, step)
            self._steps[step][session] = None

    @property
    def is_behind(self) -> bool:
        """Whether sessions are due that have not been woken."""
        return bool(self._due)

    def close(self) -> None:
        """Wake no session any more."""
        self._closed = True
        self._times.clear()

    def _wake_step(self, step: int) -> None:
        is_idle = not self._due
        self._due.extend((step, session) for session in self._steps.pop(step))
        if is_idle:
            self._wake_due()

    def _wake_due(self) -> None:
        """Wake sessions for a while. Then messages and documents come before the others."""
        end = self._loop.time() + TURN
        while self._due and self._loop.time() <= end:
            step, session = self._due.popleft()
            when, own = self._times.get(session, (0.0, None))
            if own == step:
                del self._times[session]
                self._wake(session, when)
        if self._due:
            self._loop.call_soon(self._wake_due)


class ReadingTurns(Generic[T]):
    """The turns of the sessions that have documents to read, or a paused call to continue.

    Args:
        must_wait: returns whether turns wait until it is time for their share.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        read: Callable[[T], None],
        must_wait: Callable[[], bool] = lambda: False,
    ) -> None:
        self._loop = loop
        self._read = read
        self._must_wait = must_wait
        self._waiting: dict[T, None] = {}
        self._next: asyncio.Handle | None = None
        self._until = loop.time()  # when the last turns ended
        self._excess = 0.0  # s that the last turns took beyond their share

    def add(self, session: T) -> None:
        """Give a session one turn."""
        self._waiting.setdefault(session)
        if self._next is None:
            self._next = self._loop.call_soon(self._take_turns)

    def close(self) -> None:
        """Forget the turns."""
        self._waiting.clear()

    def _take_turns(self) -> None:
        """Give sessions their turns for a share of the time. Then frames come again."""
        began = self._loop.time()
        share = min((began - self._until) * READING_SHARE, LONGEST_READING)
        if self._must_wait():
            share -= self._excess
            if share < 0.0:
                self._next = self._loop.call_soon(self._take_turns)
                return
        end = began + share
        while self._waiting:
            session = next(iter(self._waiting))
            del self._waiting[session]
            self._read(session)
            self._until = self._loop.time()
            if self._until >= end:
                break
        self._excess = min(max(0.0, self._until - end), LONGEST_READING)
        self._next = self._loop.call_soon(self._take_turns) if self._waiting else None


class _Stack(greenlet):
    """A stack on which calls of an owner run."""

    owner: Any = None
    waits_for: Future[Any] | None = None  # the function that it called in another thread


class SlicedCalls(Generic[T]):
    """Calls on behalf of owners: those of one owner in order, those of different owners in slices.

    A call runs on a stack of its own (a greenlet), and is paused where it counts its work
    (`realizer.core.work`). So functions need not know that they may be paused. Only the calls of their owner
    wait for them. All methods are called in one thread.

    Args:
        on_pause: called with the owner of a call that was paused; the caller passes it to `resume` later.
        call_soon: calls a function in the thread of the other methods; called in any thread.
    """

    def __init__(
        self,
        on_pause: Callable[[T], None],
        call_soon: Callable[[Callable[[T], None], T], object],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._on_pause = on_pause
        self._call_soon = call_soon
        self._clock = clock
        self._end = 0.0  # of the present slice
        self._stacks: dict[T, _Stack] = {}
        self._waiting: dict[T, deque[Callable[[], None]]] = {}
        self._free: list[_Stack] = []
        self._threads = ThreadPoolExecutor(1, "solver")

    def is_busy(self, owner: T) -> bool:
        """Return whether a call of the owner has not ended."""
        return owner in self._stacks

    def count_waiting(self, owner: T) -> int:
        """Return how many calls of the owner have not begun."""
        return len(self._waiting.get(owner, ()))

    def call(self, owner: T, function: Callable[[], None], slices: int = 1) -> None:
        """Call a function for at most some slices of time, or after the earlier calls of its owner.

        Within a call of the same owner it is called at once. Exceptions are raised here until the first
        pause, and by `resume` after it.
        """
        stack = self._stacks.get(owner)
        if stack is None:
            self._stacks[owner] = stack = self._free.pop() if self._free else _Stack(self._run)
            self._waiting[owner] = deque([function])
            stack.owner = owner
            self._switch(stack, slices)
        elif stack is getcurrent():
            function()
        else:
            self._waiting[owner].append(function)

    def resume(self, owner: T) -> None:
        """Continue the calls of an owner for at most a slice of time, unless they wait for a thread."""
        stack = self._stacks.get(owner)
        if stack is not None and (stack.waits_for is None or stack.waits_for.done()):
            self._switch(stack)

    def cancel(self, owner: T) -> None:
        """End the calls of an owner where they are, if this is not one of them."""
        if (stack := self._stacks.get(owner)) is not None and stack is not getcurrent():
            del self._stacks[owner], self._waiting[owner]
            if stack.waits_for is not None:
                stack.waits_for.cancel()
            stack.parent = getcurrent()
            stack.throw()

    def close(self) -> None:
        """End the calls of all owners."""
        for owner in list(self._stacks):
            self.cancel(owner)
        self._threads.shutdown(wait=False, cancel_futures=True)

    # work.Pauser, for the calls themselves --------------------------------------------------------

    def pause(self) -> None:
        """Pause the present call if its slice of time is over."""
        # Callbacks that a call has scheduled have its context, but not its stack.
        if self._clock() >= self._end and isinstance(getcurrent(), _Stack):
            self._parent().switch()

    def wait_for(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Pause the present call until a function has returned in another thread."""
        stack = getcurrent()
        if not isinstance(stack, _Stack):
            return function(*args, **kwargs)
        stack.waits_for = future = self._threads.submit(function, *args, **kwargs)
        future.add_done_callback(lambda _: self._call_soon(self._on_pause, stack.owner))
        self._parent().switch()
        stack.waits_for = None
        return future.result()

    def _switch(self, stack: _Stack, slices: int = 1) -> None:
        outer, self._end = self._end, self._clock() + slices * SLICE
        stack.parent, owner = getcurrent(), stack.owner
        try:
            stack.switch()
        except BaseException:
            self._stacks.pop(owner, None)
            self._waiting.pop(owner, None)
            raise
        finally:
            self._end = outer
        if owner in self._stacks and stack.waits_for is None:
            self._on_pause(owner)

    def _run(self) -> None:
        """Make the calls of an owner, then those of the next owner that this stack is used for."""
        work.pause_with(self)
        on_element.set(self.pause)
        stack = getcurrent()
        assert isinstance(stack, _Stack)
        while True:
            waiting = self._waiting[stack.owner]
            while waiting:
                waiting.popleft()()
            del self._waiting[stack.owner], self._stacks[stack.owner]
            self._free.append(stack)
            stack.owner = None
            self._parent().switch()

    @staticmethod
    def _parent() -> greenlet:
        parent = getcurrent().parent
        assert parent is not None
        return parent
