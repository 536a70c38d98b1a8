"""Every rule of driving taken out of a copy of the program, one by one: some test must fail.

Prints which test notices each. The copy is made anew; nothing here is changed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
JUDGES = (
    "tests/control",
    "tests/driving",
    "tests/agent/test_gate.py",
    "tests/sim/test_sim_agent.py",
)


class Rule(NamedTuple):
    """says: the rule; file; line: what upholds it; without: the same with the rule gone."""

    says: str
    file: str
    line: str
    without: str


CONSOLE, DESK, SEAT = (f"backend/control/{name}.py" for name in ("console", "desk", "seat"))
PATTERNS, LEASE = "backend/control/patterns.py", "backend/control/lease.py"
GATE, DRIVING = "backend/shell/agent/gate.py", "backend/shell/driving/driving.py"
LIMITER, LEASES = "backend/safety/limiter.py", "backend/shell/driving/leases.py"

RULES = (
    Rule(
        "the dead-man is held",
        CONSOLE,
        "if not event.enable:\n            return State.PAUSE",
        "if False:\n            return State.PAUSE",
    ),
    Rule(
        "input that ceases is let go", CONSOLE, 'return "no input from the operator"', 'return ""'
    ),
    Rule("a lost gamepad disables", CONSOLE, "if not event.gamepad:", "if False:"),
    Rule("a lost focus disables", CONSOLE, "if not event.focus:", "if False:"),
    Rule(
        "a lost network disables",
        CONSOLE,
        'return "" if event.network else "connection is lost"',
        'return ""',
    ),
    Rule(
        "neutral to begin",
        CONSOLE,
        "if event.enable and event.neutral and console.armed:",
        "if event.enable and console.armed:",
    ),
    Rule(
        "a new press to begin",
        CONSOLE,
        "if event.enable and event.neutral and console.armed:",
        "if event.enable and event.neutral:",
    ),
    Rule(
        "a dead-man held all along is no new press",
        CONSOLE,
        "armed = released or (",
        "armed = True or (",
    ),
    Rule("pause interrupts", CONSOLE, "if event.pause:", "if False:"),
    Rule("stop latches", CONSOLE, "return State.STOP, console.why", "return State.IDLE, ''"),
    Rule("stop is obeyed", CONSOLE, "if event.stop:", "if False:"),
    Rule(
        "no reset while enabled or off neutral",
        CONSOLE,
        "if event.reset and event.neutral and not event.enable:",
        "if event.reset:",
    ),
    Rule(
        "a reset is no restart",
        CONSOLE,
        'return (State.IDLE if event.lease else State.RESERVED), ""',
        'return (State.ENABLED if event.lease else State.RESERVED), ""',
    ),
    Rule("nothing without a lease", CONSOLE, "if not event.lease:", "if False:"),
    Rule(
        "an override that ends pauses", CONSOLE, "if console.state is State.OVERRIDE:", "if False:"
    ),
    Rule(
        "an override is a supervisor's, with a reason",
        SEAT,
        "override=given.override and seat.person.may_override and bool(seat.reason.strip()),",
        "override=given.override,",
    ),
    Rule(
        "no switch of machines while enabled or off neutral",
        DESK,
        "if not event.neutral or event.enable or desk.driven == machine:",
        "if desk.driven == machine:",
    ),
    Rule(
        "the sticks reach one machine",
        DESK,
        "if name != desk.driven:",
        "if False:",
    ),
    Rule(
        "only an enabled console moves",
        SEAT,
        "if console is None or name != seat.desk.driven or not console.may_move:",
        "if console is None or name != seat.desk.driven:",
    ),
    Rule(
        "an older input counts for nothing",
        SEAT,
        "if new.sequence > seat.input.sequence else seat",
        "if True else seat",
    ),
    Rule(
        "patterns change in neutral only",
        PATTERNS,
        "return replace(setting, pattern=pattern) if neutral(sticks) else setting",
        "return replace(setting, pattern=pattern)",
    ),
    Rule(
        "methods change in neutral only",
        PATTERNS,
        "return replace(setting, method=method) if neutral(sticks) else setting",
        "return replace(setting, method=method)",
    ),
    Rule("fine is slower", PATTERNS, "share = FINE if setting.fine else 1.0", "share = 1.0"),
    Rule("dead zones", PATTERNS, "if not abs(value) > DEAD_ZONE:", "if not abs(value) > 0.0:"),
    Rule(
        "what is not a number is not neutral",
        PATTERNS,
        "return all(abs(value) <= DEAD_ZONE for value",
        "return not any(abs(value) > DEAD_ZONE for value",
    ),
    Rule(
        "SAE swaps boom and stick",
        PATTERNS,
        "if setting.pattern is Pattern.ISO else (right_y, left_y)",
        "if True else (right_y, left_y)",
    ),
    Rule(
        "one controller",
        LEASE,
        'return f"{lease.holder} is in control"\n\n\ndef _not_own',
        'return ""\n\n\ndef _not_own',
    ),
    Rule(
        "every grant raises the token",
        LEASE,
        "return Lease(lease.token + 1, request.who",
        "return Lease(lease.token, request.who",
    ),
    Rule(
        "a refresh needs the own token",
        LEASE,
        "if request.token != lease.token or request.who != lease.holder:",
        "if False:",
    ),
    Rule(
        "a lease ends",
        LEASE,
        "return bool(self.holder) and now < self.expires",
        "return bool(self.holder)",
    ),
    Rule("a take-over is a supervisor's", LEASE, "if request.role != SUPERVISOR:", "if False:"),
    Rule(
        "a take-over has a reason",
        LEASE,
        'return "" if request.reason.strip() else "a take-over needs a reason"',
        'return ""',
    ),
    Rule(
        "handed over to the one named only",
        LEASE,
        "request.who in (lease.holder, lease.offered_to)",
        "lease.offered_to or request.who == lease.holder",
    ),
    Rule(
        "a stop ends anybody's lease",
        LEASE,
        "return Lease(lease.token, stopped_by=request.who)",
        "return lease",
    ),
    Rule(
        "a lost lease is not asked for anew",
        LEASES,
        "elif answer is not None:\n                    del self._held[machine]",
        "elif answer is not None:\n                    pass",
    ),
    Rule(
        "leases end when driving has failed",
        DRIVING,
        "if self._clock() - self._cycled <= FAILED:",
        "if True:",
    ),
    Rule("a viewer drives nothing", DRIVING, "elif not seat.person.may_drive:", "elif False:"),
    Rule("a late cycle pauses", DRIVING, "on_time = now - self._cycled <= LATE", "on_time = True"),
    Rule(
        "the machine counts the time-to-live",
        GATE,
        "and now - self.heard_at < min(said.time_to_live, TIME_TO_LIVE)",
        "",
    ),
    Rule(
        "the machine cuts a long time-to-live",
        GATE,
        "now - self.heard_at < min(said.time_to_live, TIME_TO_LIVE)",
        "now - self.heard_at < said.time_to_live",
    ),
    Rule(
        "no sequence twice",
        GATE,
        'command.sequence <= last.sequence:\n        return _refuse(gate, "replayed")',
        'False:\n        return _refuse(gate, "replayed")',
    ),
    Rule(
        "only the lease's token", GATE, "if not gate.lease.admits(command.token, now):", "if False:"
    ),
    Rule("only in the holder's name", GATE, "if command.holder != gate.lease.holder:", "if False:"),
    Rule(
        "nothing without fresh limits",
        GATE,
        "if not (gate.obeys(now) and gate.limited(now)):",
        "if not gate.obeys(now):",
    ),
    Rule(
        "the machine limits accelerations",
        GATE,
        "asked = np.sign(asked) * np.minimum(np.abs(asked), ahead)",
        "",
    ),
    Rule("nonsense is refused", GATE, "if not _sound(command, machine):", "if False:"),
    Rule(
        "after a limit the stick goes to neutral first",
        LIMITER,
        "fraction[k, side] = 0.0\n            if causes",
        "pass\n            if causes",
    ),
)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    there = tmp_path_factory.mktemp("copy")
    for folder in ("backend", "cockpit", "tests"):
        shutil.copytree(ROOT / folder, there / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for other in ("scenes", "static", "pyproject.toml"):
        (there / other).symlink_to(ROOT / other)
    return there


def failed(copy: Path) -> str:
    """The first test that fails; empty when none does."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *JUDGES],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    found = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    if done.returncode and not found:
        return done.stdout[-500:] + done.stderr[-500:]
    return found[0].split("::", 1)[-1].split(" - ")[0] if found else ""


@pytest.mark.timeout(7_200)
def test_no_rule_goes_unnoticed(copy: Path) -> None:
    assert failed(copy) == ""
    unnoticed = []
    for rule in RULES:
        path = copy / rule.file
        sound = path.read_text()
        assert sound.count(rule.line) == 1, f"{rule.says}: not once in {rule.file}"
        path.write_text(sound.replace(rule.line, rule.without))
        noticed = failed(copy)
        path.write_text(sound)
        print(f"  {rule.says:52} {noticed or 'NOT NOTICED'}", flush=True)
        if not noticed:
            unnoticed.append(rule.says)
    print(f"  {len(RULES)} rules taken out: unnoticed expected 0, measured {len(unnoticed)}")
    assert unnoticed == []
