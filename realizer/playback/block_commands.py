"""Commands of behaviours to other blocks: interrupt, activate, change a parameter."""

from collections.abc import Mapping
from typing import Protocol

from bml_schema import Activate, Behaviour, Interrupt, ParameterValueChange
from realizer.animation.channel import Gain
from realizer.behaviours.kind import BehaviourKind, BlockCommand
from realizer.core.similar import did_you_mean, similar
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_timeline import BlockTimeline

# Duration of an instant change of a face and of a sound, which avoids jumps and clicks.
AT_ONCE = {False: 0.1, True: 0.02}  # s


class Blocks(Protocol):
    """The blocks of a session, as far as commands need them."""

    timeline: BlockTimeline

    def activate(self, id: str, now: float) -> bool: ...

    def revoke(self, id: str, now: float) -> bool: ...

    def has_seen(self, id: str) -> bool: ...


class CommandError(Exception):
    """A command that cannot be executed; the message has the expected and the actual value."""


def execute(blocks: Blocks, playing: ActiveBlock, behaviour: str, act: BlockCommand, now: float) -> None:
    """Execute the command of a behaviour of a playing block; raise CommandError if that is impossible."""
    match act:
        case Interrupt():
            _interrupt(blocks, act, now)
        case Activate():
            if not blocks.activate(act.target, now):
                raise CommandError(
                    f"target: wanted a block that was preplanned and waits, got {act.target!r}"
                )
        case ParameterValueChange():
            _change(blocks, act, now, playing.start + float(playing.schedule.times[behaviour][-1]))


def _interrupt(blocks: Blocks, act: Interrupt, now: float) -> None:
    target = blocks.timeline.blocks.find(act.target)
    if target is None:
        if not blocks.revoke(act.target, now) and not blocks.has_seen(act.target):
            raise CommandError(f"target: wanted a block, got {act.target!r}, of which nothing was heard")
        return
    named = set(target.schedule.times)
    if strange := set(act.include) - named:
        raise CommandError(f"include: no behaviour {min(strange)!r} plays in {act.target}")
    chosen = (set(act.include) or named).difference(act.exclude)
    left = target.unfinished(now)
    if not (act.include or act.exclude) or (left and left <= chosen):
        blocks.timeline.stop(target, now)
    elif left & chosen:
        blocks.timeline.cut(target, left & chosen, now)


def initial_value(act: ParameterValueChange, target: Behaviour, kinds: Mapping[str, BehaviourKind]) -> float:
    """Return the value of the parameter that an act changes as its target began with.

    Raises:
        CommandError: the target has no such parameter, or it cannot have the values of the act.
    """
    known, id = kinds[target.tag].parameters, ":".join(act.target)
    if act.param_id not in known:
        names, near = ", ".join(sorted(known)) or "none", did_you_mean(similar(act.param_id, known))
        raise CommandError(f"paramId: {id} has {names}, got {act.param_id!r}{near}")
    usual = known[act.param_id]
    value = float(getattr(target, usual) if isinstance(usual, str) else usual)
    if value <= 0.0:
        raise CommandError(f"{act.param_id}: wanted one that was above 0, got {id} at 0")
    least = min(act.trajectory.target_value, act.trajectory.initial_value or 0)
    if least < 0:
        raise CommandError(f"{act.param_id}: wanted 0 or more, got {least:g}")
    return value


def _change(blocks: Blocks, act: ParameterValueChange, now: float, end: float) -> None:
    """Change a parameter linearly if the document gives an end and wants that, otherwise at once."""
    block, behaviour = act.target
    target = blocks.timeline.blocks.find(block)
    if target is None or behaviour not in target.unfinished(now) or not target.has_begun:
        raise CommandError(f"target: wanted a behaviour that plays, got {block}:{behaviour}")
    unscaled = initial_value(act, target.block[behaviour], target.kinds)
    initial, to = act.trajectory.initial_value, act.trajectory.target_value
    sound = act.param_id == "volume"
    reached = now + AT_ONCE[sound]
    gains = [] if initial is None else [Gain(now, reached, initial / unscaled)]
    if act.trajectory.type != "linear" or "end" not in act.syncs or end <= reached:
        gains = [Gain(now, reached, to / unscaled)]
    else:
        gains.append(Gain(reached if gains else now, end, to / unscaled, "linear"))
    target.scale(behaviour, gains, sound=sound)
    blocks.timeline.mark_changed()
