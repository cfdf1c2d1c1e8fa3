"use strict";
// The page of a design: the layout from above, the map or the front, and the numbers. Every number comes from the document.

const design = JSON.parse(document.getElementById("data").textContent);
const { best, compared, front, map } = design;
const axis_of = axis;
const um = (v) => (v === null || v === undefined ? "–" : fixed(v, 1));
const size = (j) => j.size_mm.map((v) => fixed(v, 0)).join(" × ");

// Balls from above: x towards the right, y upwards, the height beside each.
function layout() {
  const sets = [best, ...compared];
  const colours = (theme) => [theme.residual, theme.candidate, theme.quiet];
  const option = (theme) => ({
    grid: { left: 74, right: 26, top: 34, bottom: 52, outerBoundsMode: "none" },
    legend: { top: 0, textStyle: { color: theme.quiet } },
    tooltip: tooltip(theme, ({ seriesName, data }) => `${seriesName}, ball ${data[3]}\nx ${fixed(data[0], 0)}, y ${fixed(data[1], 0)}, z ${fixed(data[2], 0)} mm`),
    xAxis: axis_of(theme, "x, mm", 27, { scale: true }),
    yAxis: axis_of(theme, "y, mm", 52, { scale: true }),
    series: sets.map((j, k) => ({
      name: j.name, type: "scatter", symbol: ["circle", "diamond", "rect"][k % 3], symbolSize: 12,
      itemStyle: { color: colours(theme)[k % 3] }, data: j.balls.map(([id, [x, y, z]]) => [x, y, z, id]),
      label: { show: k === 0, position: "right", color: theme.quiet, formatter: ({ data }) => `z ${fixed(data[2], 0)}` },
    })),
  });
  return element("figure", {}, chart("the balls from above", 380, option));
}

// Worst one-sigma with the ball at each place, the best of its heights.
function where() {
  const distinct = (i) => [...new Set(map.map((m) => m.centre_mm[i]))].toSorted((a, b) => a - b);
  const [xs, ys] = [distinct(0), distinct(1)];
  const least = new Map();
  for (const { centre_mm: [x, y, z], worst_um } of map) {
    const key = `${x} ${y}`;
    if (worst_um !== null && !(least.get(key)?.worst <= worst_um)) least.set(key, { worst: worst_um, x, y, z });
  }
  const cells = [...least.values()];
  const values = cells.map((c) => c.worst).toSorted((a, b) => a - b);
  const option = (theme) => ({
    grid: { left: 74, right: 26, top: 12, bottom: 92, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ data }) => `x ${fixed(xs[data[0]], 0)}, y ${fixed(ys[data[1]], 0)}, z ${fixed(data[3], 0)} mm\nworst ${um(data[2])} µm`),
    xAxis: { ...axis_of(theme, "x, mm", 27), type: "category", data: xs.map((x) => fixed(x, 0)) },
    yAxis: { ...axis_of(theme, "y, mm", 52), type: "category", data: ys.map((y) => fixed(y, 0)) },
    visualMap: { min: values[0], max: values[values.length - 1], dimension: 2, orient: "horizontal", left: "center", bottom: 4, precision: 1, textStyle: { color: theme.quiet }, inRange: { color: [0, 0.25, 0.5, 0.75, 1].map((t) => cividis(t)[0]) } },
    series: [{
      type: "heatmap", data: cells.map((c) => [xs.indexOf(c.x), ys.indexOf(c.y), c.worst, c.z]),
      label: { show: true, fontSize: 10, textBorderColor: "#16191d", textBorderWidth: 2, color: "#ffffff", formatter: ({ data }) => um(data[2]) },
    }],
  });
  return element("figure", {}, element("p", { class: "title" }, "worst one-sigma, µm, with the ball there; the best of the heights"), chart("the ball at every place", 420, option));
}

// Accuracy against the length of the artifact.
function curve() {
  const points = front.filter((f) => f.judged).map(({ scale, judged }) => ({ scale, judged, length: Math.hypot(...judged.size_mm) }));
  const rows = (of) => points.toSorted((a, b) => a.length - b.length).map((p) => [p.length, of(p.judged), p]);
  const line = (name, colour, symbol, of) => ({ name, type: "line", symbol, symbolSize: 8, data: rows(of), itemStyle: { color: colour }, lineStyle: { color: colour, width: 1.6 } });
  const option = (theme) => ({
    grid: { left: 74, right: 26, top: 34, bottom: 52, outerBoundsMode: "none" },
    legend: { top: 0, textStyle: { color: theme.quiet } },
    tooltip: tooltip(theme, ({ value }) => `box ${percent(value[2].scale)}: ${size(value[2].judged)} mm, ${fixed(value[2].judged.mass_kg, 1)} kg\nworst ${um(value[2].judged.worst_um)}, mean ${um(value[2].judged.mean_um)} µm`),
    xAxis: axis_of(theme, "diagonal of the artifact, mm", 27, { scale: true }),
    yAxis: axis_of(theme, "one-sigma, µm", 52, { scale: false, min: 0 }),
    series: [line("worst pose", theme.residual, "circle", (j) => j.worst_um), line("mean", theme.candidate, "diamond", (j) => j.mean_um)],
  });
  return element("figure", {}, chart("accuracy against size", 340, option));
}

const numbers = (title, rows, name) => table(title, [
  [name, (r) => r.called, "words"],
  ["balls", (r) => String(r.judged.balls.length)],
  ["probings", (r) => String(r.judged.probings)],
  ["worst, µm", (r) => um(r.judged.worst_um)],
  ["mean, µm", (r) => um(r.judged.mean_um)],
  ["mass, kg", (r) => fixed(r.judged.mass_kg, 1)],
  ["size, mm", (r) => size(r.judged)],
], rows);

const all = [best, ...compared].map((judged) => ({ called: judged.name, judged }));
const tried = all.filter((r) => r.judged.verified);
const held = ({ measured_um, band_um: [low, high] }) => `${um(measured_um)} (${um(low)} to ${um(high)})`;

document.getElementById("head").append(
  element("p", { class: "eyebrow" }, `design ${design.name}`),
  element("h1", {}, design.question),
  element("p", { class: "means" }, `${um(best.worst_um)} µm at the worst of ${design.workspace_poses} poses of the workspace, ${um(best.mean_um)} µm on average (one-sigma of the calibrated TCP, from noise alone); ${fixed(best.mass_kg, 1)} kg, ${size(best)} mm. ${design.places[1]} places tried, seed ${design.seed}.`),
);
const section = (title, ...content) => element("section", {}, element("h2", {}, title), ...content);
document.getElementById("main").append(
  section("Where the balls stand", layout(), numbers("Against others", all, "artifact")),
  ...(map ? [section("The ball at every place", where())] : []),
  ...(front.length ? [section("Accuracy against size", curve(), numbers("The best of each size", front.filter((f) => f.judged).map((f) => ({ called: percent(f.scale), judged: f.judged })), "box"))] : []),
  ...(tried.length ? [section("Tried on the simulated cell", element("p", { class: "quiet" }, "Distance of the calibrated TCP from the true one, rms, µm, with 95 % bands. What the encoders do not see at that moment is in both."), table("Predicted and measured", [
    ["artifact", (r) => r.called, "words"],
    ["trials", (r) => String(r.judged.verified.trials)],
    ["all poses, predicted", (r) => um(r.judged.verified.rms.predicted_um)],
    ["measured", (r) => held(r.judged.verified.rms)],
    ["worst pose, predicted", (r) => um(r.judged.verified.worst.predicted_um)],
    ["measured", (r) => held(r.judged.verified.worst)],
  ], tried))] : []),
);
draw();
document.body.dataset.ready = "1";
