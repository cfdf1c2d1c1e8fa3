"use strict";
// The program behind the workbench: the server that sent this page.

const backend = (() => {
  const token = new URLSearchParams(location.search).get("token") ?? "";
  // Milliseconds between two looks at what a long action is doing.
  const LOOK = 700;

  let climbing = null;

  async function ask(what, body, signal) {
    const headers = { "X-Calibench-Token": token };
    if (body) headers["Content-Type"] = "application/json";
    const answer = await fetch(`/api/${what}`, { method: body ? "POST" : "GET", headers, body: body && JSON.stringify(body), signal });
    const told = await answer.json();
    // 422: what was asked for cannot be done, and why.
    if (!answer.ok) throw Object.assign(new Error(told.error), { field: told.field });
    return told;
  }

  function follow(tell) {
    let last = null;
    const timer = setInterval(async () => {
      const { doing } = await ask("progress").catch(() => ({ doing: last }));
      // What an earlier action did is not told again.
      if (last !== null && doing !== last) tell(doing);
      last = doing;
    }, LOOK);
    return () => clearInterval(timer);
  }

  // Everything else is done in less time than it takes to think better of it.
  const can_cancel = (what) => what === "recommend";

  async function cancellable(what, body) {
    if (!can_cancel(what)) return ask(what, body);
    climbing = new AbortController();
    return ask(what, body, climbing.signal);
  }

  // The server ends the ladder at its next step, for which nobody waits.
  async function cancel() {
    const { error } = await ask("cancel", {}).then(() => ({}), (error) => ({ error }));
    climbing?.abort(error ?? new Error("Cancelled; the workbench is as it was before."));
  }

  return { ask: cancellable, follow, can_cancel, cancel, saved: () => undefined, begin: (open) => open() };
})();
