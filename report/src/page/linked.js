"use strict";
// A sample that is looked at in one picture is marked in all of them: with a ring in the charts, as an arrow with the arm in space.

const looked_at = { id: null, watchers: new Set(), frame: null };

// `said` is read out to those who do not see the rings.
function look_at(id, said = null) {
  const spoken = document.getElementById("spoken");
  if (said && spoken) spoken.textContent = said;
  if (looked_at.id === id) return;
  looked_at.id = id;
  // Once a frame, however fast the pointer runs over the points.
  looked_at.frame ??= requestAnimationFrame(() => {
    looked_at.frame = null;
    for (const one of drawn) ring(one);
    for (const watcher of looked_at.watchers) watcher(looked_at.id);
  });
}

// The samples of a chart, by their id: where they stand.
function points_of(option) {
  const points = new Map();
  for (const { type, data, name } of [option.series ?? []].flat()) {
    if (type !== "scatter") continue;
    for (const item of data ?? []) {
      const value = item?.value ?? item;
      if (typeof value?.[2] === "string") points.set(value[2], [...(points.get(value[2]) ?? []), { x: value[0], y: value[1], name }]);
    }
  }
  return points;
}

// Rings around the sample that is looked at.
function ring(one) {
  for (const old of one.rings ?? []) old.remove();
  one.rings = [];
  const points = one.points?.get(looked_at.id);
  if (!points || !one.chart) return;
  for (const { x, y } of points) {
    const [left, top] = one.chart.convertToPixel({ xAxisIndex: 0, yAxisIndex: 0 }, [x, y]);
    const mark = element("span", { class: "ring" });
    mark.style.left = `${left}px`;
    mark.style.top = `${top}px`;
    one.host.append(mark);
    one.rings.push(mark);
  }
}

// Links a drawn chart with the other pictures, if it shows samples.
function link(one, option) {
  one.points = points_of(option);
  if (!one.points.size) return;
  const { host, points, chart: drawing } = one;
  drawing.on("mouseover", ({ value }) => typeof value?.[2] === "string" && look_at(value[2]));
  ring(one);
  if (host.tabIndex === 0) return;
  host.tabIndex = 0;
  host.setAttribute("role", "application");
  host.setAttribute("aria-roledescription", "chart: arrow keys go from sample to sample");
  host.addEventListener("keydown", (event) => {
    const order = [...one.points].filter(([, of]) => of[0].x !== null).sort(([, a], [, b]) => a[0].x - b[0].x).map(([id]) => id);
    const at = order.indexOf(looked_at.id);
    const next = { ArrowRight: at + 1, ArrowLeft: at < 0 ? 0 : at - 1, Home: 0, End: order.length - 1 }[event.key];
    if (event.key === "Escape") look_at(null, "no sample marked");
    else if (next === undefined) return;
    else {
      const id = order[Math.min(order.length - 1, Math.max(0, next))];
      look_at(id, one.points.get(id).map(({ x, y, name }) => `${id}: ${name === "candidate" ? "the candidate takes " : ""}${digits(y)} at ${digits(x, 4)}`).join("; "));
    }
    event.preventDefault();
  });
}
