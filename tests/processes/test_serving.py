"""`cockpit serve` as it is operated: its metrics and its log lines."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from live import ENVIRONMENT
from program import cockpit

pytestmark = pytest.mark.processes


def test_metrics_by_token_and_json_lines_on_stderr(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("0123456789abcdef\n")
    token.chmod(0o600)
    log = tmp_path / "log"
    arguments = [
        *("serve", "--site", "demo", "--no-browser", "--port", "0", "--no-record"),
        *("--listen", "tcp/127.0.0.1:0", "--metrics-token-file", str(token)),
        *("--log-json", "--log-level", "info", "--one-time-link"),
    ]
    with log.open("w") as stderr:
        process = subprocess.Popen(
            [sys.executable, "-m", "cockpit.cli", *arguments],
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            env=ENVIRONMENT,
        )
    try:
        assert process.stdout is not None
        found = None
        for line in process.stdout:
            found = found or re.search(r"http://[\d.]+:\d+", line)
            if line.startswith("Machines:"):
                break
        assert found is not None
        with pytest.raises(urllib.error.HTTPError, match="401"):
            urllib.request.urlopen(found[0] + "/metrics", timeout=10)
        request = urllib.request.Request(
            found[0] + "/metrics", headers={"Authorization": "Bearer 0123456789abcdef"}
        )
        with urllib.request.urlopen(request, timeout=10) as answer:
            text = answer.read().decode()
        assert 'cockpit_loop_rate_hertz{loop="step"}' in text
        assert 'cockpit_recorder{state="off"} 1.0' in text
    finally:
        process.terminate()
        process.wait(30)
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    serving = next(line for line in lines if line["message"] == "serving")
    assert serving["site"] == "demo"
    assert serving["level"] == "info"
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", serving["time"])


def test_mistakes_are_one_sentence(tmp_path: Path) -> None:
    for arguments, words in (
        (("--log-level", "loud"), "allowed are debug, info, warning, error"),
        (("--metrics-token-file", str(tmp_path / "none")), "cannot be read"),
        (("--link-config", str(tmp_path / "none.json5")), "cannot be read"),
    ):
        start = "serve", "--site", "demo", "--no-browser", "--port", "0", "--one-time-link"
        done = cockpit(*start, *arguments)
        assert done.returncode == 2
        assert words in done.stderr
        assert done.stderr.count("\n") == 1
