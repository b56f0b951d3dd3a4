"""`planish serve --host` over a real socket: TLS by a certificate that the browser knows, and nothing without it."""

from __future__ import annotations

import ipaddress
import signal
import socket
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from station.console.http.protocol import ConsoleProtocol
from station.console.serving import Address
from tests.station.conftest import curl_scan
from tests.station.console.conftest import WAIT_S, GatedScanner, StandInRestorer, serving

MOST = 20  # connections
ADDRESS = "127.0.0.2"  # of this computer, and not the one that needs no TLS
CODE = set("█▀▄")


@dataclass(frozen=True)
class Files:
    """A certificate for ADDRESS and its key, in files."""

    cert: Path
    key: Path

    @property
    def pinned(self) -> ssl.SSLContext:
        """What a browser uses that trusts this certificate, and no authority."""
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.load_verify_locations(self.cert)
        return context


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    folder = tmp_path_factory.mktemp("tls")
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "station")])
    now = datetime.now(UTC)
    cert = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=1))
        .add_extension(x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address(ADDRESS))]), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    (folder / "cert.pem").write_bytes(cert.public_bytes(serialization.Encoding.PEM))
    (folder / "key.pem").write_bytes(
        key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    )
    return Files(folder / "cert.pem", folder / "key.pem")


@contextmanager
def served(root: Path, files: Files, *options: str) -> Iterator[tuple[str, list[str]]]:
    """A server at ADDRESS: its link, and the lines that it printed before it."""
    command = [sys.executable, "-m", "station", "serve", str(root), "--host", ADDRESS, "--port", "0", *options]
    command += ["--cert", str(files.cert), "--key", str(files.key), "--index", str(root / "index")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        assert process.stdout is not None
        try:
            before: list[str] = []
            while not (line := process.stdout.readline()).startswith("https://"):
                assert line, before
                before.append(line)
            yield line.strip(), before
        finally:
            process.send_signal(signal.SIGTERM)
            process.wait(WAIT_S)


def test_a_tablet_comes_in_by_the_pinned_certificate(root: Path, files: Files) -> None:
    with served(root, files, "--qr") as (link, code):
        assert len(code) > 15
        assert set("".join(code)) & CODE
        base = link.partition("/enter")[0]
        with httpx.Client(base_url=base, verify=files.pinned, trust_env=False, timeout=WAIT_S) as tablet:
            tablet.headers["Authorization"] = "Bearer " + link.partition("token=")[2]
            assert tablet.get(link).status_code == 303
            assert tablet.get("/api/state").status_code == 200
            assert tablet.get("/api/state", headers={"Host": "evil.example"}).status_code == 421
            plain = base.replace("https", "http")
            for origin, status in ((plain, 403), ("https://evil.example", 403), (base, 409)):
                answer = tablet.post("/api/press", json={"action": "mark"}, headers={"Origin": origin})
                assert answer.status_code == status


@pytest.mark.slow
def test_nothing_is_said_without_tls_or_elsewhere(root: Path, files: Files) -> None:
    with served(root, files) as (link, before):
        assert before == []  # no code without --qr
        base = link.partition("/enter")[0]
        port = int(base.rpartition(":")[2])
        with socket.create_connection((ADDRESS, port), WAIT_S) as line:
            line.sendall(f"GET /api/state HTTP/1.1\r\nHost: {ADDRESS}:{port}\r\n\r\n".encode())
            line.shutdown(socket.SHUT_WR)
            assert b"HTTP" not in b"".join(iter(lambda: line.recv(4096), b""))
        with pytest.raises(httpx.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
            httpx.get(link, trust_env=False, timeout=WAIT_S)
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port), WAIT_S)
        with httpx.Client(verify=files.pinned, trust_env=False, timeout=WAIT_S) as tablet:
            assert tablet.get(f"{base}/api/state").status_code == 401


def test_silent_connections_count_before_their_handshake(root: Path, files: Files, monkeypatch) -> None:
    """They end after the time for a head, and sooner when their places are needed."""
    monkeypatch.setattr("station.console.serving.max_connections", lambda: MOST)
    address = Address(ADDRESS, 0, files.cert, files.key)
    with serving(root, GatedScanner(curl_scan()), StandInRestorer(), address=address) as station, ExitStack() as lines:
        browser = lines.enter_context(httpx.Client(verify=files.pinned, trust_env=False, timeout=WAIT_S))
        browser.headers["Authorization"] = f"Bearer {station.token}"
        assert browser.get(f"{station.origin}/api/state").status_code == 200
        monkeypatch.setattr(ConsoleProtocol, "head_s", WAIT_S)
        silent = [
            lines.enter_context(socket.create_connection((ADDRESS, station.port), WAIT_S)) for _ in range(3 * MOST)
        ]
        assert [line.recv(1) for line in silent[:MOST]] == [b""] * MOST
        assert browser.get(f"{station.origin}/api/state").status_code == 200  # over the connection that it has
        with httpx.Client(verify=files.pinned, trust_env=False, timeout=WAIT_S) as newcomer:
            assert newcomer.get(f"{station.origin}/api/state").status_code == 401
        monkeypatch.setattr(ConsoleProtocol, "head_s", 0.2)
        late = lines.enter_context(socket.create_connection((ADDRESS, station.port), WAIT_S))
        assert late.recv(1) == b""
