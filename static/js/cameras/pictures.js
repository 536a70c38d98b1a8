// Pictures that the cockpit passes on: a websocket for each camera, open only while its picture is on the page.

import { decode } from "../socket.js";
import { leaveIfSignedOut } from "../signed_out.js";
import { transit } from "../state.js";

const FIRST_WAIT = 500, LONGEST_WAIT = 4000; // ms between two attempts

/** A JPEG (Uint8Array) to be drawn and closed. A blob would go by another process, which can take seconds on a busy computer. */
async function decoded(jpeg) {
  if (typeof ImageDecoder === "undefined") return createImageBitmap(new Blob([jpeg], { type: "image/jpeg" })); // not over plain HTTP
  const decoder = new ImageDecoder({ type: "image/jpeg", data: jpeg });
  try {
    return (await decoder.decode()).image;
  } finally {
    decoder.close();
  }
}

/** Draws on `canvas` until `close` is called. `taken` and `by` say how old the newest picture is. */
export function openPictures(machine, index, canvas) {
  const feed = { taken: null, by: "", trouble: "", count: 0, close };
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  const url = `${scheme}//${location.host}/api/camera/${encodeURIComponent(machine)}/${index}`;
  let socket = null, timer = 0, wait = FIRST_WAIT, closed = false;

  async function draw(header, jpeg, arrival) {
    try {
      const picture = await decoded(jpeg);
      if (closed) return picture.close();
      const [width, height] = [picture.displayWidth ?? picture.width, picture.displayHeight ?? picture.height];
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      canvas.getContext("2d").drawImage(picture, 0, 0);
      picture.close();
      feed.count += 1;
      feed.taken = arrival - 1000 * (header.age + transit(header.wall));
      feed.by = header.by;
    } catch {
      feed.trouble = "the picture cannot be decoded";
    }
    // The next one is sent when this one is done with: a busy page gets fewer pictures, never late ones.
    if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ drawn: header.serial }));
  }

  function open() {
    socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { wait = FIRST_WAIT; };
    socket.onmessage = (event) => {
      if (typeof event.data === "string") return;
      try {
        const { header, arrays } = decode(event.data);
        if (header.type === "trouble") feed.trouble = header.text;
        else if (header.type === "picture") {
          feed.trouble = "";
          draw(header, arrays.jpeg.data, performance.now());
        }
      } catch {
        feed.trouble = "the picture cannot be read";
      }
    };
    socket.onclose = () => {
      if (closed) return;
      feed.trouble = "no connection to the cockpit";
      leaveIfSignedOut();
      timer = setTimeout(open, wait);
      wait = Math.min(2 * wait, LONGEST_WAIT);
    };
  }

  function close() {
    closed = true;
    clearTimeout(timer);
    socket?.close();
  }

  open();
  return feed;
}
