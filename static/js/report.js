// Making a report, or exporting data: what goes on, and what went wrong, in words.

import { number } from "./axis.js";
import { download } from "./api.js";
import { title } from "./session.js";

const SHOWN = 12000; // ms that an error, or a success, stays
const FORMATS = { csv: [".zip", "CSV"], parquet: [".zip", "Parquet"], ros2: [".mcap", "ROS 2 MCAP"] };

const job = { what: "", since: 0, bytes: 0, error: "", done: "", ended: -Infinity };

const recent = () => performance.now() - job.ended < SHOWN;
export const busy = () => job.what !== "";

/** "report: 12 s", or what was saved just now; empty when nothing goes on. */
export function busyText() {
  if (job.what) {
    const grown = job.bytes ? `${number(job.bytes / 1e6, 1)} MB` : `${number((performance.now() - job.since) / 1000, 0)} s`;
    return `${job.what}: ${job.bytes ? "receiving" : "working"}, ${grown}`;
  }
  return recent() && job.done ? `saved ${job.done}` : "";
}

export const failure = () => (!job.what && recent() ? job.error : "");

async function run(what, path, fallback) {
  if (job.what) return;
  Object.assign(job, { what, since: performance.now(), bytes: 0, error: "", done: "" });
  try {
    job.done = await download(path, fallback, (bytes) => {
      job.bytes = bytes;
    });
  } catch (error) {
    job.error = `${what} failed: ${error.message}`;
  }
  job.what = "";
  job.ended = performance.now();
}

const fileName = () => title().trim().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-+|-+$/g, "") || "session";

export const startReport = () => run("report", "/api/session/report", `${fileName()}.html`);

export function startExport(format) {
  const [ending, word] = FORMATS[format];
  return run(`export ${word}`, `/api/session/export?format=${format}`, fileName() + ending);
}
export const formats = Object.entries(FORMATS).map(([name, [, word]]) => [name, word]);
