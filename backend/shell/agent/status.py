"""What an agent reports of itself."""

from __future__ import annotations

from backend.shell.agent.gate import Gate
from backend.shell.link.messages import AgentStatus


def status_of(gate: Gate, name: str, mode: str, stamp: float, now: float) -> AgentStatus:
    """stamp: on the machine's clock [s]; now: on the clock that the gate is told by [s].

    limit: the least fraction of full speed in any direction, 0 without fresh limits.
    """
    last, held = gate.command, gate.lease.held(now)
    free = gate.fraction is not None and gate.limited(now)
    return AgentStatus(
        machine=name,
        stamp=stamp,
        arrival=stamp,
        mode=mode,
        holder=gate.lease.holder if held else "",
        token=gate.lease.token,
        sequence=last.sequence if last else 0,
        command_age=now - gate.heard_at if last else -1.0,
        limit=float(gate.fraction.min()) if free and gate.fraction is not None else 0.0,
        accepted=gate.accepted,
        refused=gate.refused,
    )
