// @ts-check
// The program behind the workbench: WebAssembly in a worker of this page, and in a second one that helps it. Nothing is
// sent anywhere.

import { byId } from "calibench-report/elements.js";

// What leads to another state of the workbench, to be done again by a worker that takes the place of one that was
// ended.
const ACTS = ["open", "play", "switch", "own", "choose", "undo", "redo", "recommend", "adopt"];

/**
 * What is asked for next is asked first: actions, the judgement, the samples, then one candidate after the other.
 * The choices are what the page begins with, and cannot be cancelled.
 * @type {Record<string, number>}
 */
const ORDER = { choices: -1, document: 1, views: 2, candidate: 3 };

/**
 * @type {{
 *   module: Promise<WebAssembly.Module> | null,
 *   worker: Worker | null,
 *   helper: Worker | null,
 *   warmed: boolean,
 *   files: ProgramFile[],
 *   log: { what: string, body: object }[],
 *   queue: Job[],
 *   job: Job | null,
 *   serving: boolean,
 *   running: { id: number, resolve: (told: Reply) => void, reject: (error: unknown) => void } | null,
 *   count: number,
 *   number: number,
 *   told: (doing: string) => void,
 *   open: () => Promise<void>,
 * }}
 */
const state = {
  module: null,
  worker: null,
  helper: null,
  warmed: false,
  files: [],
  log: [],
  queue: [],
  job: null,
  serving: false,
  running: null,
  count: 0,
  number: 0,
  told: () => undefined,
  open: () => Promise.resolve(),
};

async function compiled() {
  const text = atob(byId("module").textContent.trim());
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i += 1) packed[i] = text.charCodeAt(i);
  const whole = new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip")));
  return WebAssembly.compile(await whole.arrayBuffer());
}

function started() {
  const address = URL.createObjectURL(new Blob([byId("worker").textContent], { type: "text/javascript" }));
  const worker = new Worker(address);
  URL.revokeObjectURL(address);
  return worker;
}

function hire() {
  const worker = started();
  worker.onmessage = ({ data }) => heard(worker, data);
  worker.onerror = (event) => heard(worker, { id: state.running?.id, stopped: event.message });
  state.worker = worker;
}

/**
 * A worker that helps, where a program can wait for it and there is a processor for it; the way to it.
 * @param {WebAssembly.Module} module
 */
function hireHelper(module) {
  if (!WebAssembly.Suspending || navigator.hardwareConcurrency < 2) return null;
  state.helper = started();
  const { port1, port2 } = new MessageChannel();
  /** @type {Question} */
  const question = { module, helps: port1, isFirst: !state.warmed };
  state.helper.postMessage(question, [port1]);
  state.warmed = true;
  return port2;
}

function dismiss() {
  state.worker?.terminate();
  state.helper?.terminate();
  state.worker = null;
  state.helper = null;
  state.running = null;
}

/**
 * Sends to the worker; answers come one after the other.
 * @param {Question} question
 * @param {Transferable[]} transferred
 * @returns {Promise<Reply>}
 */
function send(question, transferred = []) {
  state.count += 1;
  const { count: id } = state;
  return new Promise((resolve, reject) => {
    state.running = { id, resolve, reject };
    state.worker?.postMessage({ id, ...question }, transferred);
  });
}

/**
 * @param {Worker} worker
 * @param {Said} said
 */
function heard(worker, { id, doing, stopped, ...told }) {
  if (worker !== state.worker) return;
  if (doing !== undefined) {
    state.told(doing);
    return;
  }
  if (!state.running || state.running.id !== id) return;
  const { resolve, reject } = state.running;
  state.running = null;
  if (stopped) {
    reject(Object.assign(new Error("this cannot be computed; the workbench is as it was before"), { stopped }));
  } else {
    resolve(/** @type {Reply} */ (told));
  }
}

// A new worker in the state of the last one. Nobody is told what it does.
async function again() {
  dismiss();
  const { told } = state;
  state.told = () => undefined;
  hire();
  state.module ??= compiled();
  const module = await state.module;
  const helpedBy = hireHelper(module);
  await send({ module, helpedBy, files: state.files }, helpedBy ? [helpedBy] : []);
  // What was accepted once is not asked about again.
  /** @type {(what: string, body: object) => object} */
  const forced = (what, body) => (["switch", "own"].includes(what) ? { ...body, force: true } : body);
  for (const { what, body } of state.log) await send({ what, body: forced(what, body) });
  state.told = told;
}

// One question at a time, the most urgent first.
async function serve() {
  if (state.serving) return;
  state.serving = true;
  state.queue.sort((a, b) => a.order - b.order || a.number - b.number);
  for (let job = state.queue.shift(); job; job = state.queue.shift()) {
    state.job = job;
    try {
      if (!state.worker) await again();
      job.resolve(await answered(job));
    } catch (error) {
      const { stopped } = /** @type {Mistake} */ (error);
      if (stopped) console.error(stopped);
      if (stopped) await again().catch(dismiss);
      job.reject(error);
    }
    state.job = null;
    state.queue.sort((a, b) => a.order - b.order || a.number - b.number);
  }
  state.serving = false;
}

/**
 * @param {Job} job
 * @returns {Promise<Answer>}
 */
async function answered({ what, body, files, names }) {
  const { answer, taken, tookMs } = await send({ what, body, files, names });
  if (answer.error && !answer.changed) {
    throw Object.assign(new Error(answer.error), { field: answer.field, told: answer.told });
  }
  if (what && ACTS.includes(what)) await remember(what, body, files, answer);
  return { ...answer, taken, tookMs: Math.round(tookMs) };
}

/**
 * @param {string} what
 * @param {object} body
 * @param {ProgramFile[] | undefined} files
 * @param {Answer} answer
 */
async function remember(what, body, files, answer) {
  if (what === "open" || what === "play") {
    state.files = files ?? [];
    state.log = [{ what, body }];
  } else if (what === "recommend" && answer.moved) {
    // The ladder is not run again: the model that it led to is taken.
    const { taken } = await send({ what: "save-model", names: ["model.toml"] });
    const model = new TextDecoder().decode(taken[0] ?? undefined);
    state.log.push({ what: "adopt", body: { model } });
  } else if (answer.moved) {
    state.log.push({ what, body });
  }
}

/**
 * @param {string | null} what
 * @param {object} [body]
 * @param {{ files?: ProgramFile[], names?: string[] }} more
 * @returns {Promise<Answer>}
 */
function ask(what, body = {}, more = {}) {
  return new Promise((resolve, reject) => {
    state.number += 1;
    const order = ORDER[what ?? ""] ?? 0;
    state.queue.push({ what, body, resolve, reject, order, number: state.number, ...more });
    serve();
  });
}

// Ends the action that is waited for; what the page asked beside it is asked again.
function cancel() {
  const cancelled = Object.assign(new Error("Cancelled; the workbench is as it was before."), { cancelled: true });
  const waiting = state.queue.filter((job) => job.order === 0);
  state.queue = state.queue.filter((job) => job.order !== 0);
  for (const job of waiting) job.reject(cancelled);
  const { job, running } = state;
  if (!job || job.order !== 0) return;
  // The next thing that is done is to bring another worker to where this one was.
  dismiss();
  running?.reject(cancelled);
  // What becomes of it shows with the next question.
  ask(null).catch(() => undefined);
}

/** @param {(doing: string) => void} tell */
function follow(tell) {
  state.told = tell;
  return () => {
    state.told = () => undefined;
  };
}

/**
 * Hands a file that was written to the browser, which keeps it where it keeps downloads.
 * @param {Answer} answer
 */
async function saved({ files }) {
  const { taken } = await ask(null, {}, { names: files });
  for (const [k, bytes] of taken.entries()) {
    if (!bytes) continue;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([bytes]));
    link.download = files[k].split("/").pop() ?? "";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  }
}

/**
 * Opens files, or measures a simulated robot, and lays it out.
 * @param {string} what
 * @param {object} body
 * @param {NamedFile[]} files
 */
export async function open(what, body, files) {
  const { opened } = await ask(what, body, { files: files.map(({ path, file }) => ({ name: path, file })) });
  return { opened, shown: state.open() };
}

/** @type {Backend} */
export const backend = {
  ask,
  follow,
  canCancel: () => true,
  cancel,
  saved,
  begin: (show) => {
    state.open = show;
  },
};
