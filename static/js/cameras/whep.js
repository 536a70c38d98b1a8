// A camera's own WebRTC stream, opened by the page itself: WHEP, one offer for one answer.

const GATHER = 1500; // ms that the own addresses are waited for
const FIRST_WAIT = 1000, LONGEST_WAIT = 8000; // ms between two attempts

const gathered = (peer) => new Promise((done) => {
  if (peer.iceGatheringState === "complete") done();
  setTimeout(done, GATHER);
  peer.addEventListener("icegatheringstatechange", () => peer.iceGatheringState === "complete" && done());
});

/** Shows `url` in `video` until `close` is called; as openPictures. */
export function openWhep(url, video) {
  const feed = { taken: null, by: "", trouble: "", count: 0, close };
  let peer = null, session = null, timer = 0, watch = 0, wait = FIRST_WAIT, closed = false;

  function seen(now, frame) {
    feed.count += 1;
    feed.trouble = "";
    // Only some senders say when a frame was taken; else it counts from when it could be shown.
    feed.by = Number.isFinite(frame.captureTime) ? "capture" : "arrival";
    feed.taken = frame.captureTime ?? frame.receiveTime ?? now;
    wait = FIRST_WAIT;
    watch = video.requestVideoFrameCallback(seen);
  }

  async function open() {
    const mine = (peer = new RTCPeerConnection());
    try {
      mine.addTransceiver("video", { direction: "recvonly" });
      mine.addEventListener("track", ({ track }) => { video.srcObject = new MediaStream([track]); });
      mine.addEventListener("connectionstatechange", () => /failed|disconnected/.test(mine.connectionState) && again(mine, "the stream broke off"));
      await mine.setLocalDescription(await mine.createOffer());
      await gathered(mine);
      const reply = await fetch(url, { method: "POST", headers: { "Content-Type": "application/sdp" }, body: mine.localDescription.sdp, credentials: "omit", referrerPolicy: "no-referrer" });
      if (!reply.ok) throw new Error(`the camera answers ${reply.status}`);
      const place = reply.headers.get("Location");
      session = place && new URL(place, url).href;
      await mine.setRemoteDescription({ type: "answer", sdp: await reply.text() });
    } catch (error) {
      again(mine, error instanceof TypeError ? "the camera does not answer" : error.message);
    }
  }

  function end(one) {
    one?.close();
    if (session && new URL(session).origin === new URL(url).origin) fetch(session, { method: "DELETE", credentials: "omit", keepalive: true }).catch(() => {});
    session = null;
  }

  function again(one, why) {
    if (closed || one !== peer) return;
    peer = null;
    feed.trouble = why;
    end(one);
    timer = setTimeout(open, wait);
    wait = Math.min(2 * wait, LONGEST_WAIT);
  }

  function close() {
    closed = true;
    clearTimeout(timer);
    video.cancelVideoFrameCallback(watch);
    end(peer);
    video.srcObject = null;
  }

  watch = video.requestVideoFrameCallback(seen);
  open();
  return feed;
}
