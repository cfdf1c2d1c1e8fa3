// @ts-check
// The page of a rehearsal: the verdict, the film, the gaps, what is set, and what was not checked. Every number comes
// from the document.

import { draw } from "calibench-report/drawing.js";
import { drawn } from "calibench-report/drawn.js";
import { button, byId, element, list, present, quiet, sentence, table, unfold } from "calibench-report/elements.js";
import { VIEWS } from "calibench-report/eye.js";
import { goTo, handle, moved, spaceHost } from "calibench-report/handling.js";
import { redrawOnChange } from "calibench-report/redraw.js";
import { fixed } from "calibench-report/text.js";
import { paintStage } from "calibench-rehearsal/stage.js";

/** @type {Rehearsal} */
const rehearsal = JSON.parse(byId("data").textContent);
const { motions, pictures, gaps } = rehearsal;

// Pictures a second: with four degrees from one to the next, the joint that turns most turns at 100 deg/s.
const PACE = 25;

/** @param {number} mm */
const gap = (mm) => (mm > 0 ? `${fixed(mm, 1)} mm` : "none");

/** @param {Motion} motion */
const called = ({ pose, ball, phase, spare }) =>
  (pose ? `${pose}${ball ? `, ball ${ball}` : ""}: ${phase}` : phase) + (spare ? " (if needed)" : "");

// The last picture of what will be done; after it comes what may be needed.
const done = Math.max(0, ...motions.filter(({ spare }) => !spare).map(({ end }) => end));

const film = { picture: 0, plays: false };

/** @param {number} picture */
const motionAt = (picture) => {
  const k = motions.findIndex(({ end }) => picture <= end);
  return k < 0 ? motions.length - 1 : k;
};

function stage() {
  const [azimuth, elevation] = VIEWS.Oblique;
  const view = { azimuth, elevation, zoom: 1 };
  const host = spaceHost(
    `The arm along ${motions.length} motions. Arrow keys turn the view, plus and minus zoom, brackets go from ` +
      "motion to motion; all motions are in a table below.",
  );
  const told = element("p", { class: "quiet told-sample", role: "status" });
  const along = element("input", {
    type: "range",
    min: "0",
    max: pictures.length - 1,
    value: "0",
    "aria-label": "Position in the film",
  });
  /** @type {ReturnType<typeof paintStage> | null} */
  let painter = null;
  const paint = () => painter?.paint();
  const tell = () => {
    const k = motionAt(film.picture);
    const motion = motions[k];
    const clear =
      motion.gap_mm === null
        ? ""
        : `; clearance ${gap(motion.gap_mm)}${motion.between ? `: ${motion.between.join(" and ")}` : ""}`;
    const joints = motion.joints_deg.map((q) => fixed(q, 1)).join(", ");
    told.replaceChildren(
      element("b", {}, `${k + 1} of ${motions.length}, ${called(motion)}`),
      `${clear}. To ${joints} deg`,
      motion.wrong ? element("b", {}, `. ${motion.wrong}`) : "",
    );
    along.value = String(film.picture);
    along.setAttribute("aria-valuetext", `motion ${k + 1} of ${motions.length}, ${called(motion)}`);
  };
  /** @param {number} picture */
  const show = (picture) => {
    film.picture = Math.max(0, Math.min(pictures.length - 1, picture));
    tell();
    paint();
  };
  const play = button("Play", () => (film.plays ? stop() : start()));
  const stop = () => {
    film.plays = false;
    play.textContent = "Play";
  };
  const start = () => {
    film.plays = true;
    play.textContent = "Pause";
    if (film.picture === pictures.length - 1 || film.picture === done) film.picture = 0;
    const until = film.picture < done ? done : pictures.length - 1;
    const [from, began] = [film.picture, performance.now()];
    /** @param {number} now */
    const next = (now) => {
      if (!film.plays) return;
      const picture = Math.min(until, from + Math.floor((Math.max(0, now - began) / 1000) * PACE));
      if (picture !== film.picture) show(picture);
      if (film.picture === until) stop();
      else requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
  };
  /** @param {number} k */
  const goToMotion = (k) => {
    stop();
    show(motions[Math.max(0, Math.min(motions.length - 1, k))].end);
  };
  /** @param {number} by */
  const step = (by) => goToMotion(motionAt(film.picture) + by);
  along.addEventListener("input", () => {
    stop();
    show(Number(along.value));
  });
  const { turn, zoom } = moved(view, paint);
  handle(host, { turn, zoom, step, nearest: () => null, mark: () => undefined });
  drawn.push({
    host,
    height: (width) => (width < 620 ? 360 : 560),
    chart: null,
    paint: (theme, width, height) => {
      const now = () => ({ picture: film.picture, motion: motions[motionAt(film.picture)] });
      painter = paintStage(host, theme, { width, height, view, rehearsal, now });
      painter.paint();
      return painter;
    },
  });
  const narrowest = gaps[0];
  const tools = [
    play,
    button("‹", () => step(-1), "Previous motion"),
    button("›", () => step(1), "Next motion"),
    narrowest && button("Least clearance", () => goToMotion(narrowest.motion)),
    Object.keys(VIEWS).map((name) => button(name, () => goTo(view, VIEWS[name], paint))),
    button("+", () => zoom(1.25), "Zoom in"),
    button("−", () => zoom(0.8), "Zoom out"),
  ];
  // The picture of the narrowest place says most to those who do not play the film.
  if (narrowest) film.picture = motions[narrowest.motion].end;
  tell();
  const caption = element(
    "figcaption",
    {},
    "The nominal arm, grey, among the bodies of the scene, pale; in colour the two that are nearest to each other, " +
      "if they come within 8 mm. The line is the path of the TCP.",
  );
  return {
    goToMotion,
    content: [element("div", { class: "tools" }, tools, along), element("figure", {}, host, told, caption)],
  };
}

/** @type {(heading: string, ...content: Child[]) => HTMLElement} */
const section = (heading, ...content) => element("section", {}, element("h2", {}, heading), content);

const { goToMotion, content } = stage();

/** @param {number} k */
const link = (k) => button(`${k + 1}`, () => goToMotion(k), `Show motion ${k + 1}`);

/** @type {Column<Gap>[]} */
const gapColumns = [
  ["body of the arm", (row) => row.body],
  ["clearance", (row) => gap(row.gap_mm)],
  ["from", (row) => row.other, "words"],
  ["motion", (row) => [link(row.motion), ` ${called(motions[row.motion])}`], "words"],
];

/** @typedef {{ motion: Motion, k: number }} Numbered */
/** @type {Column<Numbered>[]} */
const motionColumns = [
  ["motion", ({ k }) => link(k)],
  ["pose", ({ motion }) => motion.pose, "words"],
  ["ball", ({ motion }) => motion.ball, "words"],
  ["for", ({ motion }) => motion.phase + (motion.spare ? ", if needed" : ""), "words"],
  ["joints, deg", ({ motion }) => motion.joints_deg.map((q) => fixed(q, 2)).join(", ")],
  ["TCP, mm", ({ motion }) => motion.tcp_mm.map((v) => fixed(v, 1)).join(", ")],
  ["clearance", ({ motion }) => (motion.gap_mm === null ? "" : gap(motion.gap_mm))],
  ["verdict", ({ motion }) => motion.wrong ?? "", "words"],
];

redrawOnChange();
byId("head").append(
  element("p", { class: "eyebrow" }, `plan ${rehearsal.plan} in ${rehearsal.cell}`),
  element("h1", {}, rehearsal.is_clear ? `What ${rehearsal.robot} is going to do` : "Do not measure by this plan"),
  element("p", { class: "means" }, rehearsal.verdict),
);
byId("head").append(...rehearsal.warnings.map((text) => element("p", { class: "warning" }, sentence(text))));
byId("main").append(
  ...present([
    section("Its motions", content),
    gaps.length > 0 &&
      section(
        "Least clearance of each body",
        quiet("The narrowest place of whole motions, not of samples of them, to half a millimetre."),
        table("Least clearance of each body of the arm", gapColumns, gaps),
      ),
    section(
      "What is set on the controller, and how long it takes",
      table(
        "Settings and time",
        [
          ["setting", ([name]) => name],
          ["value", ([, value]) => value, "words"],
        ],
        rehearsal.facts,
      ),
      quiet(
        sentence(
          "`calibench cell check` compares them with what the controller has now; " +
            "nothing moves before you have agreed.",
        ),
      ),
    ),
    section("What was not checked", list(rehearsal.unchecked.map((text) => sentence(text)))),
    section(
      "All motions",
      unfold(
        `${motions.length} motions`,
        table(
          "All motions in their order",
          motionColumns,
          motions.map((motion, k) => ({ motion, k })),
          ({ motion }) => (motion.wrong ? "emphasis" : null),
        ),
        true,
      ),
    ),
  ]),
);
draw();
document.body.dataset.ready = "1";
