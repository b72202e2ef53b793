"""The VMC transport, whose packets are read by python-osc."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from realizer.animation.arkit import ARKIT_NAMES
from realizer.server.serve import Server
from tests.realizer.server.transports.udp_receiver import Receiver, answered, opened, sending

osc_bundle = pytest.importorskip("pythonosc.osc_bundle", reason="pip install python-osc")

APPLY = "/VMC/Ext/Blend/Apply"
Message = tuple[str, list[object]]


def frames(packets: Sequence[bytes]) -> list[list[Message]]:
    """The messages of each complete frame: (address, arguments)."""
    found: list[list[Message]] = [[]]
    for packet in packets:
        for message in osc_bundle.OscBundle(packet):
            found[-1].append((message.address, list(message.params)))
            if message.address == APPLY:
                found.append([])
    return found[:-1]


def bones(frame: list[Message]) -> dict[object, list[float]]:
    return {values[0]: values[1:] for address, values in frame if address == "/VMC/Ext/Bone/Pos"}  # type: ignore[misc]


def blends(frame: list[Message]) -> dict[object, object]:
    return {values[0]: values[1] for address, values in frame if address == "/VMC/Ext/Blend/Val"}


def after(document: str, there: object = None) -> list[list[Message]]:
    """The frames until one satisfies `there`, or three of them, after a message of a client."""
    received: list[list[Message]] = []

    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None) as client:
            await answered(client, document)

            def is_there() -> bool:
                shown = frames(receiver.packets)
                return there(shown[-1]) if there and shown else len(shown) >= 3  # type: ignore[operator]

            await receiver.until(is_there)
        received.extend(frames(receiver.packets))
        assert max(map(len, receiver.packets)) <= 1472, "what fits into an Ethernet frame"

    sending("vmc", test)
    return received


def test_vmc_sends_all_shapes_and_bones_of_a_frame() -> None:
    first, second, *_ = after('{"type":"ping"}')
    assert first[0] == ("/VMC/Ext/OK", [1])
    assert first[-1] == (APPLY, [])
    assert list(blends(first)) == [name[0].upper() + name[1:] for name in ARKIT_NAMES()]
    assert "BrowDownLeft" in blends(first)
    assert bones(first) == {bone: [0, 0, 0, 0, 0, 0, 1] for bone in ("Neck", "Head", "LeftEye", "RightEye")}
    assert dict(second)["/VMC/Ext/T"] > dict(first)["/VMC/Ext/T"]  # type: ignore[operator]


def test_vmc_sends_the_weights_of_shapes() -> None:
    shown = after('{"type":"set","faps":{"open_jaw":500}}', lambda frame: blends(frame)["JawOpen"] > 0.1)
    assert max(blends(shown[-1]), key=lambda name: blends(shown[-1])[name]) == "JawOpen"


@pytest.mark.parametrize(
    ("fap", "axis", "sign"), [("head_pitch", 0, 1), ("head_yaw", 1, -1), ("head_roll", 2, -1)]
)
def test_vmc_shares_the_turn_of_the_head_with_the_neck(fap: str, axis: int, sign: int) -> None:
    half = sign * math.sin(0.4 / 4)

    def there(frame: list[Message]) -> bool:
        return bones(frame)["Head"][3 + axis] == pytest.approx(half, abs=1e-4)

    turned = bones(after(f'{{"type":"set","faps":{{"{fap}":40000}}}}', there)[-1])
    assert turned["Neck"] == turned["Head"]
    assert turned["Head"][6] == pytest.approx(math.cos(0.4 / 4), abs=1e-4)
    assert turned["LeftEye"][6] == 1


def test_vmc_turns_each_eye() -> None:
    turned = bones(
        after(
            '{"type":"set","faps":{"yaw_l_eyeball":20000,"pitch_r_eyeball":-20000}}',
            lambda frame: bones(frame)["LeftEye"][4] < -0.099,
        )[-1]
    )
    assert turned["LeftEye"][3:] == pytest.approx([0, -math.sin(0.1), 0, math.cos(0.1)], abs=1e-4)
    assert turned["RightEye"][3:] == pytest.approx([-math.sin(0.1), 0, 0, math.cos(0.1)], abs=1e-4)
