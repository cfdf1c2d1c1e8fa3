"use strict";
// The worker: runs the program, one question after the other. It gets the module, then files and questions.

let program = null;
let stopped = null;

const told = (at, length) => new TextDecoder().decode(new Uint8Array(program.memory.buffer, at, length).slice());

// What a dependency would import beside this, nobody calls.
function imports(module) {
  const page = { told: (at, length) => postMessage({ doing: told(at, length) }), stopped: (at, length) => { stopped = told(at, length); } };
  const all = { page };
  for (const { module: from, name, kind } of WebAssembly.Module.imports(module)) {
    all[from] ??= {};
    if (kind === "function") all[from][name] ??= () => { throw new Error(`${from}.${name} is not there`); };
  }
  return all;
}

function fill(...parts) {
  const length = parts.reduce((sum, part) => sum + part.length, 0);
  let at = program.room(length) >>> 0;
  for (const part of parts) {
    new Uint8Array(program.memory.buffer, at, part.length).set(part);
    at += part.length;
  }
}

const answered = (length) => new Uint8Array(program.memory.buffer, program.answer() >>> 0, length).slice();

function ask(what, body) {
  const bytes = (text) => new TextEncoder().encode(text);
  const name = bytes(what);
  fill(name, bytes(JSON.stringify(body ?? {})));
  return JSON.parse(new TextDecoder().decode(answered(program.ask(name.length))));
}

function take(name) {
  fill(new TextEncoder().encode(name));
  const length = program.take();
  return length < 0 ? null : answered(length);
}

onmessage = async ({ data: { id, module, files, what, body, names } }) => {
  try {
    if (module) program = (await WebAssembly.instantiate(module, imports(module))).exports;
    if (files) program.forget();
    for (const { name, file } of files ?? []) {
      const encoded = new TextEncoder().encode(name);
      fill(encoded, new Uint8Array(await file.arrayBuffer()));
      program.put(encoded.length);
    }
    const began = performance.now();
    const answer = what ? ask(what, body) : {};
    postMessage({ id, answer, took_ms: performance.now() - began, taken: (names ?? []).map(take) });
  } catch (error) {
    // The module stops for good when it meets something that must not be.
    postMessage({ id, stopped: stopped ?? String(error) });
  }
};
