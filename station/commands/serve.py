"""The command `planish serve`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from station.commands.options import Debug
from station.commands.sessions import Index, enter
from station.commands.terminal import print_note, print_result, report_faults

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder with the sessions.", show_default=False)]
Station = Annotated[
    Path | None,
    typer.Option(
        "--config",
        help="Configuration of the station: a TOML file, or `simulated`; without it nothing is captured.",
        show_default=False,
    ),
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any free one.")]
HostAddress = Annotated[str, typer.Option(metavar="ADDRESS", help="Address to listen on; other computers need --cert.")]
Cert = Annotated[Path | None, typer.Option(help="TLS certificate (PEM) for --host.", show_default=False)]
Key = Annotated[Path | None, typer.Option(help="Private key of the certificate (PEM).", show_default=False)]
Qr = Annotated[bool, typer.Option("--qr", help="Print the link as a QR code; needs --host.")]


def serve(
    folder: Folder = Path(),
    config: Station = None,
    port: Port = 8765,
    host: HostAddress = "127.0.0.1",
    cert: Cert = None,
    key: Key = None,
    qr: Qr = False,
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Serve the web interface: capture, review, export.

    Open the printed link in the browser of this computer. Ctrl-C ends.
    """
    with report_faults(debug=debug):
        from station.errors import UsageError

        try:
            from station.console.serving import LOCALHOST, Address, serve
            from station.console.state.app_state import AppState
            from station.console.vendored import complete
        except ImportError as error:
            raise UsageError(
                f"the console needs {error.name}, which is not installed",
                "pip install 'planish[console]'; in a checkout: make serve",
            ) from error
        from station.config import load_config

        if qr and host == LOCALHOST:
            raise UsageError("--qr shows the link to other devices", "name this computer's address with --host")
        if not folder.is_dir():
            raise UsageError(f"{folder} is not a folder", "create it, or name the folder with the sessions")
        configuration = None if config is None else load_config(config)
        named = "" if config is None else str(config.resolve() if config.suffix == ".toml" else config)
        app_state = AppState(
            folder.resolve(), configuration, station=named, enter=lambda session: enter(index, session)
        )

        complete(print_note)

        def show(link: str) -> None:
            if qr:
                print_code(link)
            print_result(link)
            print_note("open this link in the browser; Ctrl-C ends")

        serve(app_state, Address(host, port, cert, key), show=show)


def print_code(link: str) -> None:
    """Print a link as a QR code, in half blocks."""
    import segno

    segno.make(link, error="m").terminal(out=sys.stdout, compact=True)
