// @ts-check
// The workbench with a server: the program behind it is the one that sent this page.

import { startBench } from "calibench-workbench/bench.js";

const token = new URLSearchParams(location.search).get("token") ?? "";

// Milliseconds between two looks at what a long action is doing.
const LOOK = 700;

/** @type {AbortController | null} */
let running = null;

/**
 * @param {string | null} what
 * @param {object} [body]
 * @param {AbortSignal} [signal]
 * @returns {Promise<Answer>}
 */
async function ask(what, body, signal) {
  /** @type {Record<string, string>} */
  const headers = { "X-Calibench-Token": token };
  if (body) headers["Content-Type"] = "application/json";
  const method = body ? "POST" : "GET";
  const answer = await fetch(`/api/${what}`, { method, headers, body: body && JSON.stringify(body), signal });
  const told = await answer.json();
  // 422: what was asked for cannot be done, and why.
  if (!answer.ok) throw Object.assign(new Error(told.error), { field: told.field });
  return told;
}

/** @param {(doing: string) => void} tell */
function follow(tell) {
  /** @type {string | null} */
  let last = null;
  const timer = setInterval(async () => {
    const { doing } = await ask("progress").catch(() => ({ doing: last }));
    // What an earlier action did is not told again.
    if (typeof doing === "string" && last !== null && doing !== last) tell(doing);
    last = doing ?? null;
  }, LOOK);
  return () => clearInterval(timer);
}

/**
 * Everything else is done in less time than it takes to think better of it.
 * @param {string | null} what
 */
const canCancel = (what) => what === "recommend";

// The server ends the ladder at its next step, for which nobody waits.
async function cancel() {
  /** @type {unknown} */
  let failed = null;
  await ask("cancel", {}).catch((error) => {
    failed = error;
  });
  running?.abort(failed ?? new Error("Cancelled; the workbench is as it was before."));
}

startBench({
  ask: (what, body) => {
    if (!canCancel(what)) return ask(what, body);
    running = new AbortController();
    return ask(what, body, running.signal);
  },
  follow,
  canCancel,
  cancel,
  saved: () => undefined,
  begin: (open) => open(),
});
