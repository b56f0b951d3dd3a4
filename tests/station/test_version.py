"""The version as records and the command tell it."""

from __future__ import annotations

from importlib import metadata

import pytest

from station.version import software_version


@pytest.fixture(autouse=True)
def _nothing_remembered():
    software_version.cache_clear()
    yield
    software_version.cache_clear()


def test_the_version_is_that_of_the_installed_package(monkeypatch):
    monkeypatch.setattr("station.version.installed_version", lambda name: f"1.2 of {name}")
    assert software_version() == "planish 1.2 of planish"


def test_sources_that_are_not_installed_have_no_number(monkeypatch):
    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr("station.version.installed_version", missing)
    assert "not installed" in software_version()
