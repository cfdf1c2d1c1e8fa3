// @ts-check
// The worker: runs the program, one question after the other. It gets the module, then files and questions; or the
// module and a port, from which it takes what another worker hands over.

/** @type {Program} */
let program;

/** @type {string | null} */
let stopped = null;

/**
 * The way to the worker that helps.
 * @type {MessagePort | null}
 */
let helper = null;

/**
 * The result of what was handed to it last.
 * @type {Promise<Uint8Array | null>}
 */
let handedOver = Promise.resolve(null);

/** @type {(at: number, length: number) => Uint8Array<ArrayBuffer>} */
const atPlace = (at, length) => new Uint8Array(program.memory.buffer, at >>> 0, length).slice();

/** @type {(at: number, length: number) => string} */
const told = (at, length) => new TextDecoder().decode(atPlace(at, length));

/**
 * @param {number} at
 * @param {number} length
 */
function handOver(at, length) {
  const job = atPlace(at, length);
  handedOver = new Promise((resolve) => {
    if (helper) helper.onmessage = ({ data }) => resolve(data.result);
  });
  helper?.postMessage(job, [job.buffer]);
}

async function waitForHelper() {
  const result = await handedOver;
  if (!result) return -1;
  fill(result);
  return result.length;
}

/**
 * What a dependency would import beside this, nobody calls.
 * @param {WebAssembly.Module} module
 * @returns {WebAssembly.Imports}
 */
function imports(module) {
  const page = {
    told: (/** @type {number} */ at, /** @type {number} */ length) => postMessage({ doing: told(at, length) }),
    stopped: (/** @type {number} */ at, /** @type {number} */ length) => {
      stopped = told(at, length);
    },
    has_helper: () => (helper ? 1 : 0),
    hand_over: handOver,
    wait_for_helper: WebAssembly.Suspending ? new WebAssembly.Suspending(waitForHelper) : () => -1,
  };
  /** @type {WebAssembly.Imports} */
  const all = { page };
  for (const { module: from, name, kind } of WebAssembly.Module.imports(module)) {
    all[from] ??= {};
    if (kind !== "function") continue;
    all[from][name] ??= () => {
      throw new Error(`${from}.${name} is not there`);
    };
  }
  return all;
}

/** @param {WebAssembly.Module} module */
async function begin(module) {
  const { exports } = await WebAssembly.instantiate(module, imports(module));
  program = /** @type {Program} */ (/** @type {unknown} */ (exports));
  program.begin();
}

/** @param {Uint8Array[]} parts */
function fill(...parts) {
  const length = parts.reduce((sum, part) => sum + part.length, 0);
  let at = program.room(length) >>> 0;
  for (const part of parts) {
    new Uint8Array(program.memory.buffer, at, part.length).set(part);
    at += part.length;
  }
}

/** @param {number} length */
const answered = (length) => atPlace(program.answer(), length);

/** @param {string} text */
const bytes = (text) => new TextEncoder().encode(text);

/**
 * @param {string} what
 * @param {object} body
 */
async function ask(what, body) {
  const name = bytes(what);
  fill(name, bytes(JSON.stringify(body)));
  // A program that may have to wait for another worker is suspended meanwhile.
  const length = await (helper ? WebAssembly.promising(program.ask)(name.length) : program.ask(name.length));
  return JSON.parse(new TextDecoder().decode(answered(length)));
}

/** @param {string} name */
function take(name) {
  fill(bytes(name));
  const length = program.take();
  return length < 0 ? null : answered(length);
}

/**
 * Helps another worker: what cannot be computed here, it computes itself.
 * @param {MessagePort} port
 */
function help(port) {
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

/** @param {MessageEvent<Question>} message */
onmessage = async ({ data: { id, module, helps, isFirst, helpedBy, files, what, body = {}, names = [] } }) => {
  // Whoever helps says so first.
  if (helpedBy) {
    helpedBy.onmessage = () => {
      helper = helpedBy;
    };
  }
  try {
    if (module) await begin(module);
    if (helps) {
      if (isFirst) program.warm();
      help(helps);
      return;
    }
    if (files) program.forget();
    for (const { name, file } of files ?? []) {
      const encoded = bytes(name);
      fill(encoded, new Uint8Array(await file.arrayBuffer()));
      program.put(encoded.length);
    }
    const began = performance.now();
    const answer = what ? await ask(what, body) : {};
    postMessage({ id, answer, tookMs: performance.now() - began, taken: names.map(take) });
  } catch (error) {
    // The module stops for good when it meets something that must not be.
    postMessage({ id, stopped: stopped ?? String(error) });
  }
};
