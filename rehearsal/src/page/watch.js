// @ts-check
// The watch page: it asks what the measurement does, twice a second, and draws it. Every number comes from the program.

/**
 * @typedef {{ pose: string, ball: string | null, attempt: number }} Now
 * @typedef {{ pose: string, ball: string | null, failure: string | null, off_mm: number | null }} Outcome
 * @typedef {{
 *   what: string, wanted: number, now: Now | null, next: string | null, remaining_s: number | null,
 *   centring_mm: number[], tolerance_mm: number | null, results: Outcome[], is_stopping: boolean
 * }} State
 */

const LOOK = 500;
const token = new URLSearchParams(location.search).get("token") ?? "";

/** @param {string} id */
const byId = (id) => {
  const found = document.getElementById(id);
  if (!found) throw new Error(`no ${id}`);
  return found;
};

/**
 * @param {string} what
 * @param {object} [body]
 * @returns {Promise<State>}
 */
async function ask(what, body) {
  /** @type {Record<string, string>} */
  const headers = { "X-Calibench-Token": token };
  if (body) headers["Content-Type"] = "application/json";
  const answer = await fetch(`/api/${what}`, {
    method: body ? "POST" : "GET",
    headers,
    body: body && JSON.stringify(body),
  });
  if (!answer.ok) throw new Error((await answer.json()).error);
  return answer.json();
}

/**
 * @param {string} name
 * @param {Record<string, string | number>} attributes
 * @param {string} [text]
 */
function shape(name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value));
  if (text) made.textContent = text;
  return made;
}

const LEFT = 56;
const RIGHT = 630;
const TOP = 12;
const BOTTOM = 190;

/** @param {number} mm */
const words = (mm) => (mm < 0.1 ? `${(1000 * mm).toPrecision(2)} µm` : `${mm.toPrecision(3)} mm`);

/**
 * The largest reading of each stop, on a logarithmic axis.
 * @param {State} state
 */
function drawCentring(state) {
  const { centring_mm: readings, tolerance_mm: tolerance } = state;
  byId("centring").hidden = tolerance === null;
  if (tolerance === null) return;
  const last = readings.at(-1);
  byId("centred").textContent =
    last === undefined
      ? "The arm is on its way to the ball."
      : `Stop ${readings.length}: the largest reading is ${words(last)}; a ball is centred below ${words(tolerance)}.`;
  const low = Math.log10(Math.min(tolerance, ...readings.map((r) => Math.max(r, 1e-5)))) - 0.2;
  const high = Math.log10(Math.max(10 * tolerance, ...readings)) + 0.2;
  /** @param {number} mm */
  const y = (mm) => BOTTOM - ((Math.log10(Math.max(mm, 1e-5)) - low) / (high - low)) * (BOTTOM - TOP);
  const step = (RIGHT - LEFT) / Math.max(8, readings.length);
  const points = readings.map((r, k) => [LEFT + (k + 0.5) * step, y(r)]);
  const chart = byId("centring-chart");
  chart.replaceChildren(
    shape("line", { class: "line", x1: LEFT, x2: RIGHT, y1: BOTTOM, y2: BOTTOM }),
    shape("line", { class: "limit", x1: LEFT, x2: RIGHT, y1: y(tolerance), y2: y(tolerance) }),
    shape("text", { x: 2, y: y(tolerance) + 4 }, words(tolerance)),
    shape("text", { x: LEFT, y: 212 }, "stops of this centring; largest of the three readings, logarithmic"),
    ...points.slice(0, 1).map(([x, at]) => shape("text", { x: x + 9, y: at + 5 }, words(readings[0]))),
    shape("polyline", { class: "path", points: points.map((p) => p.join(",")).join(" ") }),
    ...points.map(([x, at]) => shape("circle", { class: "mark", cx: x, cy: at, r: 4 })),
  );
}

/** @param {Outcome[]} results */
function drawErrors(results) {
  const known = results.filter(({ off_mm: off }) => off !== null);
  const off = known.map(({ off_mm: mm }) => mm ?? 0);
  if (!off.length) return;
  const mean = off.reduce((sum, mm) => sum + mm, 0) / off.length;
  const most = Math.max(...off);
  byId("off").textContent =
    `With its base fitted to ${off.length} measurements the nominal arm is off by ${words(mean)} on average, ` +
    `at most ${words(most)}. One bar far above the others is a measurement to look at.`;
  const width = (RIGHT - LEFT) / off.length;
  /** @param {number} mm */
  const y = (mm) => BOTTOM - (mm / most) * (BOTTOM - TOP);
  byId("off-chart").replaceChildren(
    shape("line", { class: "line", x1: LEFT, x2: RIGHT, y1: BOTTOM, y2: BOTTOM }),
    shape("text", { x: 2, y: TOP + 8 }, words(most)),
    shape("text", { x: 2, y: BOTTOM }, "0"),
    shape("text", { x: LEFT, y: 212 }, "in the order of measurement"),
    ...off.map((mm, k) =>
      shape("rect", { class: "mark", x: LEFT + k * width, y: y(mm), width: 0.8 * width, height: BOTTOM - y(mm) }),
    ),
  );
}

/** @param {Outcome[]} results */
function listRows(results) {
  const cell = (/** @type {string} */ text) => {
    const made = document.createElement("td");
    made.textContent = text;
    return made;
  };
  const rows = results.toReversed().map(({ pose, ball, failure, off_mm: off }) => {
    const row = document.createElement("tr");
    row.append(cell(pose), cell(ball ?? ""), cell(off === null ? "" : off.toFixed(3)), cell(failure ?? ""));
    return row;
  });
  byId("rows").replaceChildren(...rows);
}

/** @param {State} state */
function tell(state) {
  const done = state.results.filter(({ failure }) => failure === null).length;
  const counted = `${done} of ${state.wanted} ${state.what}`;
  const minutes = state.remaining_s === null ? "" : ` About ${Math.ceil(state.remaining_s / 60)} min to go.`;
  const { now } = state;
  const place = now ? `${now.pose}${now.ball ? `, ball ${now.ball}` : ""}` : "";
  const then = state.next ? ` Next: ${state.next}.` : "";
  const again = now && now.attempt > 1 ? `, attempt ${now.attempt}` : "";
  return state.is_stopping
    ? `${counted}. A stop was requested.`
    : now
      ? `${counted}. Now: ${place}${again}.${then}${minutes}`
      : `${counted}. Not begun yet: the terminal asks.`;
}

const button = /** @type {HTMLButtonElement} */ (byId("stop"));
const bar = /** @type {HTMLProgressElement} */ (byId("done"));
let shown = "";

/** @param {State} state */
function show(state) {
  const sentence = tell(state);
  // A status that is said again is read aloud again.
  if (sentence !== byId("state").textContent) byId("state").textContent = sentence;
  bar.max = state.wanted;
  bar.value = state.results.filter(({ failure }) => failure === null).length;
  button.disabled = state.is_stopping;
  if (state.is_stopping) button.textContent = "Stop requested";
  drawCentring(state);
  const results = JSON.stringify(state.results);
  if (results !== shown) {
    shown = results;
    drawErrors(state.results);
    listRows(state.results);
  }
}

const lost = "The program does not answer: it has ended, or this page is of an earlier one. The robot may still move.";

button.addEventListener("click", () => {
  button.disabled = true;
  ask("stop", {}).then(show, () => {
    byId("stopped").textContent = `The stop did not reach the program. Use the emergency stop. ${lost}`;
  });
});

async function look() {
  try {
    show(await ask("state"));
  } catch {
    byId("state").textContent = lost;
  }
  setTimeout(look, LOOK);
}

look();
