"""The Live Link transport, whose packets are read as PyLiveLinkFace reads them."""

from __future__ import annotations

import struct
import uuid

import pytest

from realizer.server.serve import Server
from tests.realizer.server.transports.udp_receiver import Receiver, answered, opened, sending

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
