// A page whose session is over leads to the login page instead of waiting for a server that refuses it.

const AGAIN = 3000; // at most so often, in milliseconds
let asked = -AGAIN;

/** To be called when the websocket was closed or refused. */
export async function leaveIfSignedOut() {
  if (performance.now() - asked < AGAIN) return;
  asked = performance.now();
  try {
    const reply = await fetch("/api/login");
    // Only a clear answer counts: a server that is away or starts anew is waited for.
    if (reply.ok && (await reply.json()).who === null) location.assign("/login");
  } catch {
    // no server, no answer
  }
}
