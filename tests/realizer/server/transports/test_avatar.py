"""Avatars: which session they show, independence of their programs, and the packets of both protocols."""

from __future__ import annotations

import asyncio
import json
import math
import struct
import urllib.request
import uuid
from collections.abc import Sequence

import pytest

from realizer.animation.arkit import ARKIT_NAMES
from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.realizer.server.transports.udp_receiver import LIMIT, Receiver, answered, opened, sending


def jaw(packet: bytes) -> float:
    """The weight of jawOpen in a packet of Live Link, whose 61 values are at its end."""
    return float(struct.unpack(">61f", packet[-244:])[17])


def set_jaw(value: int) -> str:
    return json.dumps({"type": "set", "faps": {"open_jaw": value}})


async def health(server: Server) -> dict[str, object]:
    def get() -> bytes:
        with urllib.request.urlopen(f"{server.page}healthz") as reply:
            return bytes(reply.read())

    return dict(json.loads(await asyncio.to_thread(get)))


def test_avatar_shows_the_oldest_session_that_has_a_client() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None) as first, opened(server, "second") as second:
            await answered(first, set_jaw(0))
            await answered(second, set_jaw(500))
            await receiver.until(lambda: len(receiver.packets) > 3)
            assert {jaw(packet) for packet in receiver.packets} == {0}
            await first.close()
            await receiver.until(lambda: jaw(receiver.packets[-1]) > 0.1)

    sending("livelink", test)


def test_avatar_does_not_keep_a_session_open() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None):
            await receiver.until(lambda: bool(receiver.packets))
        while (await health(server))["connections"]:
            pass
        assert (await health(server))["sessions"] == 0

    sending("livelink", test, vmc="127.0.0.1:9")


def test_avatar_shows_the_session_that_the_setting_names() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None) as other, opened(server, "stage") as stage:
            await answered(other, set_jaw(0))
            await answered(stage, set_jaw(500))
            await receiver.until(lambda: bool(receiver.packets) and jaw(receiver.packets[-1]) > 0.1)

    sending("livelink", test, avatar_session="stage")


def test_avatar_joins_its_session_again_when_it_was_ended() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        await receiver.until(lambda: bool(receiver.packets))
        assert server._sessions.end("stage")
        receiver.packets.clear()
        await receiver.until(lambda: bool(receiver.packets))

    sending("livelink", test, avatar_session="stage")


def test_avatar_that_nobody_receives_disturbs_no_client() -> None:
    async def run() -> None:
        nowhere = Settings(port=0, vmc="127.0.0.1:9", livelink="nowhere.invalid:11111", voice="silent")
        async with asyncio.timeout(LIMIT), Server(nowhere) as server, opened(server, None) as client:
            await client.send('{"type":"subscribe","stream":"fap","encoding":"json"}')
            frames = 0
            while frames < 20:
                frames += '"fap"' in str(await client.recv())
            await answered(client, set_jaw(10))

    asyncio.run(run())


# Epic's EARFaceBlendShape: the order of the 61 values in a packet.
ORDER = """
eyeBlinkLeft eyeLookDownLeft eyeLookInLeft eyeLookOutLeft eyeLookUpLeft eyeSquintLeft eyeWideLeft
eyeBlinkRight eyeLookDownRight eyeLookInRight eyeLookOutRight eyeLookUpRight eyeSquintRight eyeWideRight
jawForward jawLeft jawRight jawOpen mouthClose mouthFunnel mouthPucker mouthLeft mouthRight
mouthSmileLeft mouthSmileRight mouthFrownLeft mouthFrownRight mouthDimpleLeft mouthDimpleRight
mouthStretchLeft mouthStretchRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper
mouthPressLeft mouthPressRight mouthLowerDownLeft mouthLowerDownRight mouthUpperUpLeft mouthUpperUpRight
browDownLeft browDownRight browInnerUp browOuterUpLeft browOuterUpRight
cheekPuff cheekSquintLeft cheekSquintRight noseSneerLeft noseSneerRight tongueOut
headYaw headPitch headRoll leftEyeYaw leftEyePitch leftEyeRoll rightEyeYaw rightEyePitch rightEyeRoll
"""
NAMES = ORDER.split()


def decoded(packet: bytes) -> dict[str, object]:
    version, length = struct.unpack_from(">Bi", packet)
    device = packet[5 : 5 + length].decode()
    at = 5 + length
    (length,) = struct.unpack_from(">i", packet, at)
    subject = packet[at + 4 : at + 4 + length].decode()
    frame, part, rate, denominator, count = struct.unpack_from(">ifiiB", packet, at + 4 + length)
    values = struct.unpack(f">{count}f", packet[at + 4 + length + 17 :])
    return {
        "version": version, "device": device, "subject": subject, "frame": frame, "part": part,
        "rate": rate / denominator, "values": dict(zip(NAMES, values, strict=True)),
    }  # fmt: skip


def test_livelink_sends_the_packets_of_the_app() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None):
            await receiver.until(lambda: len(receiver.packets) > 3)
        first, second = (decoded(packet) for packet in receiver.packets[:2])
        assert (first["version"], first["subject"], first["part"], first["rate"]) == (
            6,
            "bml-realizer",
            0,
            60,
        )
        assert str(uuid.UUID(str(first["device"]))).upper() == first["device"]
        assert second["device"] == first["device"]
        assert int(str(second["frame"])) > int(str(first["frame"]))

    sending("livelink", test, avatar_fps=60)


@pytest.mark.parametrize(
    ("faps", "name", "value"),
    [
        ("open_jaw", "jawOpen", None),
        ("head_yaw", "headYaw", 0.1),
        ("head_pitch", "headPitch", 0.1),
        ("head_roll", "headRoll", 0.1),
        ("yaw_l_eyeball", "leftEyeYaw", 0.1),
        ("pitch_r_eyeball", "rightEyePitch", 0.1),
        ("shift_jaw", "jawRight", None),
        ("close_t_l_eyelid", "eyeBlinkLeft", None),
    ],
)
def test_livelink_places_each_value_as_the_app_does(faps: str, name: str, value: float | None) -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None) as client:
            amount = 500 if value is None else 10_000  # 1e-5 rad
            await answered(client, f'{{"type":"set","faps":{{"{faps}":{amount}}}}}')

            def shown() -> dict[str, float]:
                return decoded(receiver.packets[-1])["values"] if receiver.packets else {}  # type: ignore[return-value]

            await receiver.until(lambda: shown().get(name, 0) > (0.05 if value is None else value - 1e-4))
            assert value is None or shown()[name] == pytest.approx(value, abs=1e-4)
            group = NAMES[:52] if value is None else NAMES[52:]  # a turned eye also moves its lids
            assert max(group, key=lambda other: abs(shown()[other])) == name

    sending("livelink", test)


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
