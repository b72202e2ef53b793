"""Tests of `realizer.core.setting_types`, with the settings that have these types."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from realizer.core.setting_types import background, switch_or_file
from realizer.core.settings import Settings, SettingsError
from tests.rows import each_row


def test_whole_does_not_truncate_numbers(tmp_path: Path) -> None:
    file = tmp_path / "realizer.toml"
    for value in ("1.5", "inf", "true"):
        file.write_text(f"max_blocks = {value}\n")
        with pytest.raises(SettingsError, match=r"max_blocks: wanted a whole number 1\.\.1e\+06"):
            Settings.read(file=file, environment={})
    file.write_text("max_blocks = 7.0\n")
    assert Settings.read(file=file, environment={}).max_blocks == 7


@each_row(
    "name, value",
    [
        ("asap_ports", "7500"),
        ("asap_ports", "7500 0"),
        ("xface_port", "65536"),
        ("xface_player", "here"),
        ("xface_player_session", "a b"),
        ("xface_player_interval", "-1"),
        ("stomp", "here"),
        ("stomp", "here:0"),
        ("fps", "nan"),
        ("fps", "0"),
        ("fps", "fast"),
        ("idle", "maybe"),
        ("prosody", "loud"),
        ("face", ""),
        ("media", "no/such/folder"),
        ("origins", "example.org"),
        ("origins", "https://example.org/page"),
        ("log", "xml"),
        ("tls_cert", "no/such/file.pem"),
        ("max_memory", "1"),
        ("max_rate", "0"),
        ("max_blocks", "-1"),
        ("max_blocks", "1.5"),
        ("max_elements", "many"),
        ("max_duration", "inf"),
        ("max_address_sessions", "0"),
    ],
)
def test_types_refuse_invalid_values(name: str, value: str) -> None:
    with pytest.raises(SettingsError, match=rf"setting {name}: wanted .*, got '{value}'"):
        Settings.read(environment={f"REALIZER_{name.upper()}": value})


def test_key_is_a_text_or_its_file(tmp_path: Path) -> None:
    pem = "-----BEGIN PUBLIC KEY-----\nMCow\n-----END PUBLIC KEY-----"
    secret = "x" * 32
    for text in (pem, secret):
        file = tmp_path / "key"
        file.write_text(text + "\n")
        assert Settings.read(environment={"REALIZER_JWT_KEY": str(file)}).jwt_key == text
        assert replace(Settings(jwt_key=text)).jwt_key == text  # as a worker reads it again
    assert Settings(jwt_key="y" * 5000).jwt_key == "y" * 5000  # longer than any name
    assert Settings().jwt_key is None


@pytest.mark.parametrize(
    "key", ["", " ", "opensesame", "x" * 31, f"/run/secrets/{'x' * 40}.pem", f"{'x' * 40}.key"]
)
def test_key_that_is_short_or_missing_is_refused_and_not_shown(key: str, tmp_path: Path) -> None:
    short = tmp_path / "short"
    short.write_text(key)
    for value in (key, str(short)):
        with pytest.raises(SettingsError, match=r"jwt_key: wanted an existing PEM file, or") as refused:
            Settings.read(environment={"REALIZER_JWT_KEY": value})
        assert "got something else" in str(refused.value)


def test_hosts_and_networks_are_read_from_a_text() -> None:
    read = Settings.read(
        environment={"REALIZER_HOSTS": "Face.example,[::1]", "REALIZER_ALLOW": "192.0.2.9/24"}
    )
    assert (read.hosts, read.allow) == (("face.example", "::1"), ("192.0.2.0/24",))
    for wrong in ({"hosts": "face.example:80"}, {"hosts": "http://face"}, {"allow": "face"}, {"allow": 7}):
        with pytest.raises(SettingsError, match=r"wanted (names or )?addresses"):
            Settings(**wrong)


def test_origins_are_one_or_several() -> None:
    settings = Settings.read(environment={"REALIZER_ORIGINS": "https://a.example, http://b.example:8000"})
    assert settings.origins == ("https://a.example", "http://b.example:8000")
    assert Settings(origins=["*"]).origins == ("*",)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "least"), [("max_memory", 64), ("max_size", 16), ("max_pixels", 256)])
def test_numbers_accept_the_least_value_and_no_lower_one(name: str, least: int) -> None:
    variable = f"REALIZER_{name.upper()}"
    assert getattr(Settings.read(environment={variable: str(least)}), name) == least
    with pytest.raises(SettingsError, match=f"{name}: wanted"):
        Settings.read(environment={variable: str(least - 1)})


def test_switch_or_file_is_on_off_or_an_existing_file(tmp_path: Path) -> None:
    (tmp_path / "rules.toml").write_text("")
    for value, wanted in (
        ("yes", "on"),
        (False, "off"),
        (tmp_path / "rules.toml", str(tmp_path / "rules.toml")),
    ):
        assert switch_or_file(value) == wanted
    for value in ("maybe", str(tmp_path / "none.toml"), str(tmp_path), "x" * 5000, 3):
        with pytest.raises(ValueError, match="on, off, or an existing file"):
            switch_or_file(value)


def test_background_is_a_colour_transparent_or_a_file(tmp_path: Path) -> None:
    (tmp_path / "beach.jpg").write_bytes(b"")
    for value in ("#d8dde2", "transparent", str(tmp_path / "beach.jpg")):
        assert background(value) == value
    for value in ("blue", "#12", str(tmp_path), "x" * 5000, 3):
        with pytest.raises(ValueError, match="transparent, a colour such as #d8dde2, or an existing file"):
            background(value)
