// The binary websocket: frames in, small JSON messages out, reconnecting by itself.

const TYPES = { f4: Float32Array, f8: Float64Array, u1: Uint8Array, i4: Int32Array };

/** header length (uint32 LE) | header (JSON) | zeros up to a multiple of 8 | arrays */
export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const start = Math.ceil((4 + length) / 8) * 8;
  const arrays = {};
  for (const [name, { dtype, shape, offset }] of Object.entries(header.arrays ?? {})) {
    const Type = TYPES[dtype];
    if (!Type) continue;
    const count = shape.reduce((a, b) => a * b, 1);
    const at = start + offset;
    const aligned = at % Type.BYTES_PER_ELEMENT === 0;
    const data = aligned ? new Type(buffer, at, count) : new Type(buffer.slice(at, at + count * Type.BYTES_PER_ELEMENT));
    arrays[name] = { data, shape };
  }
  return { header, arrays };
}

/** Keeps one connection to `url`; waits 0.25 s, doubling up to 2 s, between attempts. */
export function connect(url, onFrame, onState) {
  let socket = null;
  let wait = 250;
  let rejected = 0;

  function open() {
    onState("connecting");
    socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      wait = 250;
      onState("open");
      send({ type: "hello" });
    };
    socket.onmessage = (event) => {
      if (typeof event.data === "string") return;
      let frame;
      try {
        frame = decode(event.data);
      } catch {
        rejected += 1; // a damaged frame must not take the page down; the age shows if all are
        return;
      }
      onFrame(frame.header, frame.arrays);
      // The server sends no more snapshots than are acknowledged: a busy page gets fewer, never late ones.
      if (frame.header.type === "snapshot") send({ type: "ack", cycle: frame.header.cycle });
    };
    socket.onclose = () => {
      onState("closed");
      setTimeout(open, wait);
      wait = Math.min(2 * wait, 2000);
    };
  }

  function send(message) {
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  }

  open();
  return { send, rejected: () => rejected };
}
