"""The pipeline: eight steps from BML to pixels.

    1 parse     text -> blocks of behaviours                                      `bml_schema`
    2 time      behaviour -> its sync points and preferred gaps between them      `realizer.behaviours`
    3 schedule  block -> a time for every sync point, by least squares            `realizer.scheduling`
    4 expand    behaviour and times -> curves of action units (AUs) and FAPs      `realizer.behaviours`
    5 blend     curves of all behaviours -> AUs, a row a frame                    `realizer.animation.blend`
    6 map       AUs -> MPEG-4's 68 facial animation parameters (FAPs)             `realizer.animation.fap`
    7 deform    FAPs or AUs -> the vertices of a face                             `realizer.face.deform`
    8 draw      vertices -> pixels                                                `realizer.render`

Blocks wait for, replace and refer to each other, so a `Player` plans each together with the earlier ones.
Steps 2 to 4 are in `realizer.playback.block_planner`. The service does the same, with a clock."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import inf
from typing import TYPE_CHECKING

from bml_schema import Block, made_ids, read
from realizer.animation.blend import blend
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.behaviours.registry import VOCABULARY
from realizer.core.array_types import UInt8
from realizer.core.options import PlayOptions
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import input_names
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.playback.speaking import open_voice, submit_with_speech
from realizer.realization import Performance, Realization, frame_times, realization_of
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.utterance import Voice

if TYPE_CHECKING:
    from realizer.render.renderer import Renderer

Documents = Iterable[str | bytes]
Planned = tuple[list[Schedule], list[Warning]]


def plan(documents: Documents, player: Player, voice: Voice | str | None = None) -> Planned:
    """Submit documents at 0 s; return the schedules of their blocks, and a warning for each refused part."""
    schedules, refused = list[Schedule](), list[Warning]()
    block_ids, strict = made_ids(), player.strict_bml
    texts = (read(text, VOCABULARY, strict_bml=strict, block_ids=block_ids) for text in documents)
    with open_voice(voice) as speaker:
        for item in (item for blocks in texts for item in blocks):  # 1 parse
            if isinstance(item, Block):
                schedules.append(submit_with_speech(player, item, speaker))  # 2 time, 3 schedule, 4 expand
                refused += schedules[-1].warnings if schedules[-1].failed else ()
            else:
                refused.append(parse_warning(item))
                player.refuse(refused[-1])
    return schedules, refused


def play(
    documents: Documents, options: PlayOptions, voice: Voice | str | None = None, longest: float = inf
) -> Realization:
    """Play documents from 0 s to the end of the last block, without a clock.

    Raises:
        ValueError: that takes more than `longest` seconds.
    """
    mapping = mapping_of(options.face, options.mapping)
    player = Player(
        options, history=inf, face_inputs=lambda _: input_names(options.face, deformer=options.deformer)
    )
    schedules, refused = plan(documents, player, voice)
    if player.end > longest:
        raise ValueError(f"wanted at most {longest:g} s, got {player.end:g} s")
    feedback = player.due(inf)
    characters = {}
    for index, name in enumerate(player.characters):
        windows = []
        for times in frame_times(player.end, options.fps):
            channels, idle = player.motion(times, index)
            windows.append(blend(channels, times, player.rules, idle))  # 5 blend
        aus = AUFrames.concatenate(windows)
        characters[name] = Performance(aus, to_fap(aus, mapping))  # 6 map
    return realization_of(player, options, mapping, characters, feedback, schedules, refused)


def pictures(realization: Realization, renderer: Renderer, frames: Sequence[int]) -> Iterator[UInt8]:
    """Draw frames of the first character, in the renderer's own process."""
    return renderer.frames(realization.poses[frames])  # 7 deform, 8 draw
