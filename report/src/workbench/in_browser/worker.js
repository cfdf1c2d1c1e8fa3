"use strict";
// The worker: runs the program, one question after the other. It gets the module, then files and questions; or the module and a port, from which it
// takes what another worker hands over.

let program = null;
let stopped = null;
// The way to the worker that helps, what was handed to it last, and the promise of the result.
let helper = null;
let handed_over = null;

const at_place = (at, length) => new Uint8Array(program.memory.buffer, at >>> 0, length).slice();
const told = (at, length) => new TextDecoder().decode(at_place(at, length));

function hand_over(at, length) {
  const job = at_place(at, length);
  handed_over = new Promise((resolve) => { helper.onmessage = ({ data }) => resolve(data.result); });
  helper.postMessage(job, [job.buffer]);
}

async function wait_for_helper() {
  const result = await handed_over;
  if (!result) return -1;
  fill(result);
  return result.length;
}

// What a dependency would import beside this, nobody calls.
function imports(module) {
  const page = {
    told: (at, length) => postMessage({ doing: told(at, length) }),
    stopped: (at, length) => { stopped = told(at, length); },
    has_helper: () => (helper ? 1 : 0),
    hand_over,
    wait_for_helper: WebAssembly.Suspending ? new WebAssembly.Suspending(wait_for_helper) : () => -1,
  };
  const all = { page };
  for (const { module: from, name, kind } of WebAssembly.Module.imports(module)) {
    all[from] ??= {};
    if (kind === "function") all[from][name] ??= () => { throw new Error(`${from}.${name} is not there`); };
  }
  return all;
}

async function begin(module) {
  program = (await WebAssembly.instantiate(module, imports(module))).exports;
  program.begin();
}

function fill(...parts) {
  const length = parts.reduce((sum, part) => sum + part.length, 0);
  let at = program.room(length) >>> 0;
  for (const part of parts) {
    new Uint8Array(program.memory.buffer, at, part.length).set(part);
    at += part.length;
  }
}

const answered = (length) => at_place(program.answer(), length);

async function ask(what, body) {
  const bytes = (text) => new TextEncoder().encode(text);
  const name = bytes(what);
  fill(name, bytes(JSON.stringify(body ?? {})));
  // A program that may have to wait for another worker is suspended meanwhile.
  const length = await (helper ? WebAssembly.promising(program.ask)(name.length) : program.ask(name.length));
  return JSON.parse(new TextDecoder().decode(answered(length)));
}

function take(name) {
  fill(new TextEncoder().encode(name));
  const length = program.take();
  return length < 0 ? null : answered(length);
}

// Helps another worker: what cannot be computed here, it computes itself.
async function help(module, port, is_first) {
  await begin(module);
  if (is_first) program.warm();
  port.onmessage = ({ data: job }) => {
    let result = null;
    try {
      fill(job);
      const length = program.work();
      if (length >= 0) result = answered(length);
    } catch (error) {
      console.error(stopped ?? error);
    }
    port.postMessage({ result }, result ? [result.buffer] : []);
  };
  port.postMessage({ ready: true });
}

onmessage = async ({ data: { id, module, helps, is_first, helped_by, files, what, body, names } }) => {
  if (helps) { await help(module, helps, is_first); return; }
  // Whoever helps says so first.
  if (helped_by) helped_by.onmessage = () => { helper = helped_by; };
  try {
    if (module) await begin(module);
    if (files) program.forget();
    for (const { name, file } of files ?? []) {
      const encoded = new TextEncoder().encode(name);
      fill(encoded, new Uint8Array(await file.arrayBuffer()));
      program.put(encoded.length);
    }
    const began = performance.now();
    const answer = what ? await ask(what, body) : {};
    postMessage({ id, answer, took_ms: performance.now() - began, taken: (names ?? []).map(take) });
  } catch (error) {
    // The module stops for good when it meets something that must not be.
    postMessage({ id, stopped: stopped ?? String(error) });
  }
};
