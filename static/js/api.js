// The few requests the page makes besides its websocket. What goes wrong is an Error in words.

async function failed(reply) {
  let detail = "";
  try {
    const said = (await reply.json()).detail;
    detail = typeof said === "string" ? said : "";
  } catch {
    // not JSON: the status has to do
  }
  if (reply.status === 404 && (!detail || detail === "Not Found")) return new Error("this server cannot do that");
  return new Error(detail || `the server answered ${reply.status}`);
}

async function request(path, options) {
  let reply;
  try {
    reply = await fetch(path, options);
  } catch {
    throw new Error("no answer from the server");
  }
  if (!reply.ok) throw await failed(reply);
  return reply;
}

const posting = (body, method = "POST") => ({ method, ...(body === undefined ? {} : { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }) });

async function json(reply) {
  try {
    return await reply.json();
  } catch {
    throw new Error("the server's answer cannot be read");
  }
}

export const get = async (path) => json(await request(path, {}));
/** The answer, or null when there is nothing to say. */
export async function post(path, body) {
  const reply = await request(path, posting(body));
  return reply.status === 204 ? null : json(reply);
}

/** Any other method than POST: "PUT", "DELETE". */
export const send = async (method, path, body) => json(await request(path, posting(body, method)));

/** Posts, and saves the answer as a file; `progress(bytes)` meanwhile. Returns the file's name. */
export async function download(path, fallback, progress) {
  const reply = await request(path, posting());
  const name = /filename="?([^";]+)"?/.exec(reply.headers.get("Content-Disposition") ?? "")?.[1] ?? fallback;
  const chunks = [];
  let bytes = 0;
  const reader = reply.body.getReader();
  try {
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      chunks.push(part.value);
      bytes += part.value.length;
      progress(bytes);
    }
  } catch {
    throw new Error("the server broke off");
  }
  const url = URL.createObjectURL(new Blob(chunks, { type: reply.headers.get("Content-Type") ?? "application/octet-stream" }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
  return name;
}
