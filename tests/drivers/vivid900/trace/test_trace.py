"""From a capture to commands, groups and a draft, on what the real driver said to the simulated scanner."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from itertools import batched

import pytest
import usb.core
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.scanner import CaptureSettings
from drivers.simulated.buses.capture import RECORDS, Urb, write_capture
from drivers.simulated.buses.usb_bridge import SimulatedBridge
from drivers.vivid900.commands import parse_command
from drivers.vivid900.profile import parse_profile
from drivers.vivid900.sense import Key, Sense
from drivers.vivid900.trace import CaptureError
from drivers.vivid900.trace.capture import read_transfers
from drivers.vivid900.trace.draft import draft_profile
from drivers.vivid900.trace.exchanges import read_exchanges
from drivers.vivid900.trace.groups import group
from drivers.vivid900.trace.listing import as_data, list_exchanges
from drivers.vivid900.trace.roles import guess_roles
from drivers.vivid900.transports.bulk_only import CommandWrapper, StatusWrapper, build_command, build_status
