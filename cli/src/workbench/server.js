"use strict";
// The program behind the workbench: the server that sent this page.

const backend = (() => {
  const token = new URLSearchParams(location.search).get("token") ?? "";
  // Milliseconds between two looks at what a long action is doing.
  const LOOK = 700;

  async function ask(what, body) {
    const headers = { "X-Calibench-Token": token };
    if (body) headers["Content-Type"] = "application/json";
    const answer = await fetch(`/api/${what}`, { method: body ? "POST" : "GET", headers, body: body && JSON.stringify(body) });
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

  return { ask, follow, cancel: null, saved: () => undefined, begin: (open) => open() };
})();
