"""Blocks given to a player, and the action units that it shows."""

from __future__ import annotations

import numpy as np

from bml_schema import Block, parse
from realizer.animation.axis import AU_NAMES
from realizer.behaviours.registry import VOCABULARY
from realizer.playback.player import Player
from realizer.speech.silent import SilentVoice

SMILE = '<faceLexeme id="s" lexeme="SMILE" amount="1" start="0" attackPeak="0.4" relax="2" end="2.6"/>'


def block(content: str, id: str = "b", attributes: str = "") -> Block:
    return parse(f'<bml id="{id}" {attributes}>{content}</bml>', VOCABULARY)


def submit(player: Player, *args: str, now: float = 0.0) -> None:
    made = block(*args)
    voice = SilentVoice()
    player.submit(made, now, {b: voice.say(say) for b, say in player.speech_requests(made).items()})


def au(player: Player, name: str, *times: float, character: int = 0) -> list[float]:
    values = player.frames(np.array(times), character).aus[:, AU_NAMES().index(name)]
    return [float(v) for v in values]
