"""Fresh clones that install through a slow link on a busy machine.

    python -m benchmarks.ui.slow_install [--runs 3] [--delay 2] [--stress 4] [-o RESULT.json]

A proxy on loopback delays each request by `--delay` seconds, TLS handshakes included, while
`stress-ng --cpu` keeps the processors busy. Each run clones this repository into a new folder and
starts `run.py --version` there, without pip's cache. It passes if it prints the version.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import socket
import socketserver
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CHUNK = 65_536


@dataclass
class Turns:
    """The speaker on one connection: a client that follows the server waits."""

    delay_s: float
    requests: int = 0
    server_spoke: bool = True
    lock: threading.Lock = field(default_factory=threading.Lock)

    def wait_before_request(self) -> None:
        with self.lock:
            is_new, self.server_spoke = self.server_spoke, False
            self.requests += is_new
        if is_new:
            time.sleep(self.delay_s)


class Tunnel(socketserver.BaseRequestHandler):
    """One CONNECT of a client through the proxy."""

    server: Proxy

    def handle(self) -> None:
        head = b""
        while b"\r\n\r\n" not in head:
            part = self.request.recv(CHUNK)
            if not part:
                return
            head += part
        method, target, _ = head.split(b" ", 2)
        if method != b"CONNECT":
            self.request.sendall(b"HTTP/1.1 501 Not Implemented\r\nContent-Length: 0\r\n\r\n")
            return
        host, _, port = target.decode().rpartition(":")
        with contextlib.suppress(OSError), socket.create_connection((host, int(port)), 60) as far:
            far.settimeout(None)
            self.request.sendall(b"HTTP/1.1 200 Connection established\r\n\r\n")
            self.relay(far)

    def relay(self, far: socket.socket) -> None:
        turns = Turns(self.server.delay_s)

        def answer() -> None:
            with contextlib.suppress(OSError):
                while part := far.recv(CHUNK):
                    turns.server_spoke = True
                    self.request.sendall(part)
                self.request.shutdown(socket.SHUT_WR)

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        with contextlib.suppress(OSError):
            while part := self.request.recv(CHUNK):
                turns.wait_before_request()
                far.sendall(part)
            far.shutdown(socket.SHUT_WR)
        thread.join()
        self.server.requests += turns.requests


class Proxy(socketserver.ThreadingTCPServer):
    """A loopback proxy that delays each request."""

    daemon_threads = True

    def __init__(self, delay_s: float) -> None:
        super().__init__(("127.0.0.1", 0), Tunnel)
        self.delay_s = delay_s
        self.requests = 0


@contextlib.contextmanager
def proxy_running(delay_s: float) -> Iterator[Proxy]:
    with Proxy(delay_s) as proxy:
        threading.Thread(target=proxy.serve_forever, daemon=True).start()
        yield proxy
        proxy.shutdown()


@contextlib.contextmanager
def busy_processors(count: int) -> Iterator[None]:
    stress = shutil.which("stress-ng")
    if not count:
        yield
        return
    if stress is None:
        raise SystemExit("stress-ng is not installed. Install it, or run with --stress 0.")
    with subprocess.Popen([stress, "--cpu", str(count), "--quiet"]) as process:
        try:
            yield
        finally:
            process.terminate()


def install(delay_s: float) -> dict[str, object]:
    """Clone, install and start once."""
    with tempfile.TemporaryDirectory() as folder, proxy_running(delay_s) as proxy:
        clone = Path(folder) / "turnlight"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(clone)], check=True)
        address = f"http://127.0.0.1:{proxy.server_address[1]}"
        begun = time.monotonic()
        done = subprocess.run(
            [sys.executable, "run.py", "--version"],
            cwd=clone,
            env={
                **os.environ,
                "https_proxy": address,
                "http_proxy": address,
                "PIP_NO_CACHE_DIR": "1",
            },
            capture_output=True,
            text=True,
            check=False,
        )
        return {
            "passed": done.returncode == 0 and done.stdout.startswith("turnlight "),
            "seconds": round(time.monotonic() - begun),
            "requests": proxy.requests,
            "last_line": "" if done.returncode == 0 else done.stderr.strip().splitlines()[-1],
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--delay", type=float, default=2.0, help="seconds before each request")
    parser.add_argument("--stress", type=int, default=4, help="busy processes of stress-ng")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    runs = []
    with busy_processors(args.stress):
        for _ in range(args.runs):
            runs.append(install(args.delay))
            print(json.dumps(runs[-1]), flush=True)
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    result = {
        "commit": commit.stdout.strip(),
        "delay_s": args.delay,
        "stress": args.stress,
        "runs": runs,
        "passed": sum(bool(run["passed"]) for run in runs),
    }
    if args.output:
        args.output.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
