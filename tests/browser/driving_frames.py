"""What a made-up server says of driving, and a made-up gamepad."""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Browser, WebSocketRoute
from test_page_exact import ExactFeed
from test_page_offline import frame

ZERO = dict.fromkeys(("left_x", "left_y", "right_x", "right_y", "track_left", "track_right"), 0.0)
JOINTS = ("swing", "boom", "stick", "bucket", "track_left", "track_right")
# Swing to the right is the negative side of this site's swing.
CAUSE = "bucket must stop before boom: 0.42 m left"

GAMEPAD = """
const pad = (index, id, axes, buttons, mapping) => ({
  index, id, mapping, connected: true, timestamp: 0, axes: Array(axes).fill(0),
  buttons: Array.from({length: buttons}, () => ({pressed: false, touched: false, value: 0}))});
window.made = {pads: [], pad, press: (button, value = 1, index = 0) =>
  Object.assign(window.made.pads[index].buttons[button], {pressed: value >= 0.5, value})};
// Frozen: nothing is sent in time, only what an event sends at once.
const every = window.setInterval;
window.setInterval = (act, ms) => every(() => (ms === 25 && window.made.frozen) || act(), ms);
Object.defineProperty(Navigator.prototype, "getGamepads", {value: () => window.made.pads});
"""


def decision(**changes: Any) -> dict[str, Any]:
    free = {joint: [1.0, 1.0] for joint in JOINTS}
    none = {joint: [{"concern": "", "reason": ""}] * 2 for joint in JOINTS}
    return {
        "locked": "",
        "fraction": free,
        "causes": none,
        "cut": {},
        "command": dict.fromkeys(JOINTS, 0.0),
        "method": method(),
        **changes,
    }


def method(name: str = "braking", **changes: Any) -> dict[str, Any]:
    told = {"name": name, "upper": 0.8, "lower": 0.2, "scale": 1.0, "why": [], "warnings": []}
    return {**told, **changes}


def limited(swing_left: float, boom_down: float = 1.0) -> dict[str, Any]:
    made = decision()
    made["fraction"] = {**made["fraction"], "swing": [1.0, swing_left], "boom": [boom_down, 1.0]}
    cause = {"concern": "partner", "reason": CAUSE}
    site = {"concern": "site", "reason": "25 kV line: 0.20 m left"}
    none = {"concern": "", "reason": ""}
    made["causes"] = {**made["causes"], "swing": [none, cause], "boom": [site, none]}
    return made


def remote(holder: str = "", **changes: Any) -> dict[str, Any]:
    return {
        "agent": True,
        "mode": "remote" if holder else "hold",
        "holder": holder,
        "offered_to": "",
        "round_trip": 0.042,
        "level": "ok",
        "locked": "",
        **changes,
    }


def console(state: str = "Idle", **changes: Any) -> dict[str, Any]:
    return {"state": state, "why": "", "since": 100.0, "held": True, "refused": "", **changes}


def seat(consoles: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {
        "who": "anna",
        "role": "operator",
        "driven": "left",
        "pattern": "ISO",
        "fine": False,
        "method": "braking",
        "override": "",
        "source": "",
        "sticks": ZERO,
        "consoles": consoles,
        "decision": {name: decision() for name in consoles},
        **changes,
    }


class DriveFeed(ExactFeed):
    """Anna sits at seat 7; `seat` and `machines` are what the server says of driving."""

    def __init__(
        self, browser: Browser, width: int = 1366, height: int = 768, role: str = "operator"
    ) -> None:
        self.role = role
        self.machines = {"left": remote("anna"), "right": remote()}
        self.seat = seat({"left": console()}, role=role)
        self.more: dict[str, Any] = {}
        super().__init__(browser, width, height)

    def more_routes(self) -> None:
        self.page.add_init_script(GAMEPAD)

    def accept(self, socket: WebSocketRoute) -> None:
        super().accept(socket)
        socket.send(frame({"type": "you", "seat": "7", "who": "anna", "role": self.role}))

    def send(self, until: Any, **changes: Any) -> None:
        driving = {"machines": self.machines, "seats": {"7": self.seat, **self.more}}
        super().send(until, **{"driving": driving, **changes})

    def still(self, console_: str = "Idle", **changes: Any) -> None:
        """The seat has LEFT, in this state."""
        self.seat = {**self.seat, "consoles": {"left": console(console_, **changes)}}

    def driving(self) -> bool:
        return bool(self.shown("limits").get("sticks")) and bool(self.of("sticks"))

    @property
    def last(self) -> dict[str, Any]:
        return self.of("sticks")[-1]

    def until(self, found: Any, **changes: Any) -> None:
        """Some record of the sticks sent from now on is as expected."""
        self.sent.clear()
        self.send(lambda: any(found(m) for m in self.of("sticks")), **changes)

    def connect(self, ident: str = "Pad", axes: int = 4, mapping: str = "standard") -> None:
        self.page.evaluate(
            """([id, axes, mapping]) => { const {pads, pad} = window.made;
              pads.push(pad(pads.length, id, axes, 17, mapping));
              dispatchEvent(new Event("gamepadconnected")); }""",
            [ident, axes, mapping],
        )

    def freeze(self, on: bool = True) -> None:
        self.page.evaluate("on => { window.made.frozen = on; }", on)
        self.page.wait_for_timeout(30)
        self.sent.clear()

    def axes(self, *values: float, index: int = 0) -> None:
        script = "([v, i]) => { Object.assign(window.made.pads[i].axes, v); }"
        self.page.evaluate(script, [list(values), index])

    def press(self, button: int, value: float = 1, index: int = 0) -> None:
        self.page.evaluate("([b, v, i]) => window.made.press(b, v, i)", [button, value, index])
