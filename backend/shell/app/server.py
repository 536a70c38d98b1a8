"""The web server in a thread of its own, on a port that is known to be free."""

from __future__ import annotations

import socket
import threading
import time

import uvicorn
from fastapi import FastAPI

from backend.errors import InputError
from backend.shell.access.tls import Tls


def bind(host: str, port: int) -> socket.socket:
    """A listening-to-be socket; raises InputError when the address is taken or impossible."""
    if not 0 <= port <= 65535:
        raise InputError(f"--port: {port} is not a port; allowed is 0 (any free one) to 65535.")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
    except OSError as error:
        listener.close()
        if error.errno in (98, 48):  # EADDRINUSE on Linux and macOS
            raise InputError(
                f"--port: {port} is taken by another program; allowed is any free port, "
                "or 0 to have one chosen."
            ) from None
        raise InputError(f"--host: {host}:{port} cannot be used: {error.strerror}.") from None
    except OverflowError:
        listener.close()
        raise InputError(f"--port: {port} is not a port; allowed is 0 to 65535.") from None
    return listener


class WebServer:
    """Serves an app until stopped. tls: over HTTPS with this certificate; None: plain HTTP."""

    def __init__(self, app: FastAPI, listener: socket.socket, tls: Tls | None = None) -> None:
        self._listener = listener
        config = uvicorn.Config(
            app,
            log_level="warning",
            log_config=None,  # as the whole program logs
            ws="websockets-sansio",
            ws_max_size=65536,
            ws_ping_interval=5.0,
            ws_ping_timeout=10.0,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=1,
            server_header=False,
            # Limits on logins count by address: what a header says of it is not believed.
            proxy_headers=False,
            ssl_certfile=None if tls is None else tls.cert,
            ssl_keyfile=None if tls is None else str(tls.key),
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._run, name="web", daemon=True)

    @property
    def port(self) -> int:
        return int(self._listener.getsockname()[1])

    def start(self, timeout: float = 15.0) -> None:
        self._thread.start()
        deadline = time.monotonic() + timeout
        while not self._server.started:
            if not self._thread.is_alive() or time.monotonic() > deadline:
                raise InputError(f"the web server on port {self.port} did not start.")
            time.sleep(0.01)

    def stop(self) -> None:
        self._server.should_exit = True
        self._thread.join(timeout=3.0)
        self._listener.close()

    def _run(self) -> None:
        self._server.run(sockets=[self._listener])
