"use strict";
// The report of calibench: one document, laid out. Called again with another document, it lays out that.

const AXES = ["x", "y", "z"];

const sections = () => ({ told, telling, ladder, against, by_pose, accuracy, workspace, space, ranking, residuals, parameters, cell, centring, provenance });

// The samples in space that are drawn: what does not change keeps its view.
let drawn_in_space = null;

// `ids` names the sections that have changed.
function render(report, ids = Object.keys(sections())) {
  const in_space = report.residuals?.space ?? null;
  if (ids.includes("residuals") && !ids.includes("space") && in_space !== drawn_in_space) ids = [...ids, "space"];
  if (ids.includes("space")) drawn_in_space = in_space;
  delete document.body.dataset.ready;
  const parts = ids.map((id) => document.getElementById(id));
  // Their charts are gone with their hosts.
  for (let i = drawn.length - 1; i >= 0; i -= 1) if (parts.some((part) => part.contains(drawn[i].host))) drawn.splice(i, 1)[0].chart?.dispose();
  document.title = `${report.title}: ${report.verdict.headline}`;
  document.getElementById("verdict").replaceChildren(...verdict(report).flat().filter(Boolean));
  for (const [k, id] of ids.entries()) {
    const [section, fill] = [parts[k], sections()[id]];
    section.replaceChildren(section.querySelector("h2"));
    const filled = fill(report);
    section.hidden = filled === null;
    if (filled) section.append(...filled.flat().filter(Boolean));
  }
  contents();
  for (const part of parts) {
    for (const unfolded of part.querySelectorAll("details")) unfolded.addEventListener("toggle", () => unfolded.open && draw(unfolded));
  }
  draw_soon(parts, () => { document.body.dataset.ready = "1"; });
}

function verdict(report) {
  const { verdict: said, figures, title, robot, question } = report;
  const band = (x) => `${thousandths(x[0])} to ${thousandths(x[1])} mm`;
  const { expected, validation } = figures;
  const { names } = report;
  const tiles = [
    [`${capital(names.residual)}, rms`, `${millimetres(figures.rms_mm)} mm`,
      `${figures.samples} samples; ${figures.noise_stated ? names.noise_left : "the best explanation would leave"} ${millimetres(figures.noise_mm)} mm`],
    expected && [`${capital(names.workspace)}, mean`, `${thousandths(expected.mean_mm)} mm`,
      `${band(expected.mean_band_mm)}; largest ${thousandths(expected.max_mm)} mm`],
    validation && [`${capital(names.not_fitted)}, mean`, `${thousandths(validation.mean_mm)} mm`,
      `${validation.samples} poses; largest ${thousandths(validation.max_mm)} mm${validation.refitted.length ? `; ${validation.refitted.length} numbers of the set-up were fitted to them first` : ""}`],
  ].filter(Boolean);
  return [
    element("p", { class: "eyebrow" }, `calibench report · ${title} · ${robot}`),
    element("h1", {}, said.headline),
    said.effects.length ? element("p", { class: "ids" }, said.effects.map((id) => element("code", {}, id))) : null,
    element("p", { class: "means" }, said.means),
    report.misfit && element("p", { class: "warning" }, report.misfit),
    question && element("p", { class: "quiet" }, `Asked: ${question}`),
    element("dl", { class: "figures" }, tiles.map(([name, value, beside]) => element("div", {}, element("dt", {}, name),
      element("dd", {}, element("div", { class: "value" }, value), element("div", { class: "beside" }, beside))))),
    said.symptoms.length ? flags(report, said.symptoms) : null,
    figures.disagreement && element("p", { class: "warning" }, sentence(figures.disagreement)),
  ];
}

// Parameters outside the range that physics leaves them: nothing that follows is to be read without that.
function flags(report, symptoms) {
  return element("div", { class: "warning", role: "note" }, element("b", {}, symptoms.length === 1 ? "A parameter is outside its physical range" : `${symptoms.length} parameters are outside their physical range`),
    symptoms.map((text) => element("p", {}, worded(report, text))));
}

// What a sentence is about, before it: a word of its own, or one by what it says.
function labelled(text) {
  const [, word, rest] = text.match(/^(Saw|Means|Do|Not tested|Order|Repeats|WARNING|Not believable at this size): (.*)$/s) ?? [null, null, text];
  if (word === "Not believable at this size") return ["Beware", `Not believable at this size: ${rest}`];
  if (word) return [word === "WARNING" ? "Warning" : word, /^[a-z]+[ ,]/.test(rest) ? capital(rest) : rest];
  const by_what = [["Explained", /explains \d+ % of the squares/], ["Residual", /samples? leaves? /], ["Look at", /^Look at /]].find(([, of]) => of.test(text));
  return [by_what?.[0] ?? "Noted", text];
}

// What was seen, what it means, what to do; and what these data cannot tell.
function told(report) {
  const { verdict: said, diagnosis, commands_from } = report;
  const seen = new Set();
  // A curve drawn in letters stands beside the picture of it; the verdict is the heading of the page.
  const lines = diagnosis.sentences.filter((text) => !text.startsWith("Verdict:")).map((text) => labelled(text.replace(/[▁-█]{5,} */, "")));
  const line = ([word, rest]) => element("li", {}, element("b", {}, word), element("span", {}, worded(report, rest, seen)));
  const said_lines = lines.filter(([word]) => word !== "Not tested").map(line);
  const untested = lines.filter(([word]) => word === "Not tested").map(([, rest]) => element("li", {}, worded(report, rest, seen)));
  return [
    element("ul", { class: "told" }, said_lines),
    report.ladder?.advice && element("p", { class: "advice" }, worded(report, report.ladder.advice, seen)),
    commands_from && element("p", { class: "quiet" }, `Commands are to be given in ${commands_from}.`),
    untested.length ? unfold("What these data cannot test", element("ul", {}, untested)) : null,
    said.warning ? unfold("Poses outside the range that was seen", element("p", {}, capital(said.warning.replace(/^warning: /, "")))) : null,
  ];
}

// What marks mean: drawn as they are in the charts.
function key(...kinds) {
  const mark = (kind) => {
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    svg.setAttribute("viewBox", "0 0 24 14");
    svg.setAttribute("aria-hidden", "true");
    const add = (tag, attributes) => {
      const shape = document.createElementNS("http://www.w3.org/2000/svg", tag);
      for (const [name, value] of Object.entries(attributes)) shape.setAttribute(name, value);
      svg.append(shape);
    };
    if (kind === "residual") add("circle", { cx: 12, cy: 7, r: 4, style: "fill: var(--residual)" });
    if (kind === "diamond") add("path", { d: "M12 1 18 7 12 13 6 7Z", style: "fill: none; stroke: var(--candidate); stroke-width: 2" });
    if (kind === "line") add("path", { d: "M1 9 C8 1 14 14 23 5", style: "fill: none; stroke: var(--candidate); stroke-width: 2.5" });
    if (kind === "mean") {
      add("path", { d: "M12 0V14", style: "stroke: var(--mean); stroke-width: 1.5" });
      add("rect", { x: 9, y: 4, width: 6, height: 6, style: "fill: var(--mean)" });
    }
    return svg;
  };
  return element("ul", { class: "key" }, kinds.filter(Boolean).map(([kind, text]) => element("li", {}, mark(kind), text)));
}

// Where samples are looked at only after all else has been said.
const awaited = () => [element("p", { class: "quiet" }, "Looking at every sample …")];

function telling(report) {
  if (!report.telling) return awaited();
  const { telling: it, residuals: { samples, angles_urad, views }, candidates, figures, diagnosis } = report;
  const ids = samples.map((s) => s.id);
  const candidate = it.candidate === null ? null : candidates[it.candidate];
  const name = candidate && named(report, candidate.effect);
  const keys = (more = []) => key(["residual", "what the fit leaves"], candidate && ["diamond", `what ${name} would take of it`], ...more);
  const leaves = candidate && `With ${name} in the model and all else fitted anew, ${millimetres(candidate.rms_after_mm)} of ${millimetres(figures.rms_mm)} mm would be left.`;
  const of_joint = (joint, x, x_name, x_axis, bins) => {
    const [left, takes] = [angles_urad[joint - 1], candidate.angles_urad[joint - 1]];
    const limit = round_up(1.05 * Math.max(largest(left), largest(takes)));
    const label = `Apparent error of joint ${joint} against ${x_name}: points of the residual and of what ${name} would take of it.`;
    return chart(label, 380, (theme) => scatter(theme, {
      x_name, y_name: `apparent error of joint ${joint}, µrad`, unit: "µrad", limit, x_axis, bins, spacious: true,
      points: pairs(x, left, ids), candidate: pairs(x, takes, ids),
    }));
  };
  const apparent = "The apparent error is the turn of the joint, actual minus reported, that would take up the most of a sample's residual.";
  switch (it.kind) {
    case "phase": {
      const { joint, order, x_deg } = candidate.phase;
      const turn = order === 1 ? `angle of joint ${joint} within a turn, deg` : `${order} × angle of joint ${joint}, folded to a period, deg`;
      return [keys(), element("figure", {}, of_joint(joint, x_deg, turn, { min: 0, max: 360, interval: 45 }),
        element("figcaption", {}, `${leaves} ${apparent}`))];
    }
    case "view": {
      const { joint, against, what, unit, x, bins } = views[it.view];
      const shown = bins.map((b) => ({ x: b.x, mean: b.mean_urad, sigma: b.sigma_urad }));
      return [keys([["mean", "mean of a bin, one sigma"]]), element("figure", {}, of_joint(joint, x, `${what}, ${unit}`, {}, shown),
        element("figcaption", {}, `Of all views the one in which most of ${name} is seen (joint ${joint} against ${against}). ${leaves} ${apparent}`))];
    }
    case "curve": {
      const { joint, against, unit, at, mean_urad, sigma_urad } = it;
      const limit = round_up(1.05 * Math.max(...mean_urad.map((m, k) => Math.abs(m) + sigma_urad[k])));
      const curve = chart(`The curve that the error of joint ${joint} follows over ${against}, with its band of one sigma.`, 260, (theme) => ({
        ...scatter(theme, { x_name: `${against}, ${unit}`, y_name: "error about its mean, µrad", unit: "µrad", limit, points: [], line: at.map((x, k) => [x, mean_urad[k]]) }),
      }));
      add_band(curve, at, mean_urad, sigma_urad);
      return [keys(), element("div", {},
        element("figure", {}, it.x ? of_joint(joint, it.x, `${against}, ${unit}`, {}) : null,
          element("figcaption", {}, `${leaves} ${apparent}`)),
        element("figure", {}, curve, element("figcaption", {},
          "The curve itself, with its band of one sigma: no shape was prescribed. What the fitted model has absorbed of it is not in the points above.")))];
    }
    case "agreement": {
      const of_axis = (a) => samples.map((s, k) => [candidate.takes_um[k][a], s.residual_um[a], ids[k]]);
      const all = AXES.flatMap((_, a) => of_axis(a));
      const limit = round_up(1.05 * largest(all.flatMap(([x, y]) => [x, y])));
      return [element("figure", {}, chart(`What the fit leaves against what ${name} would take of it.`, 400, (theme) => scatter(theme, {
        x_name: `what ${name} would take, µm`, y_name: "what the fit leaves, µm", unit: "µm", limit, spacious: true,
        points: all, line: [[-limit, -limit], [limit, limit]], x_axis: { min: -limit, max: limit, interval: limit / 2 },
      })), element("figcaption", {}, `Every sample three times: x, y and z of the world. What ${name} explains wholly lies on the line; what it does not explain lies on the vertical through zero. ${leaves}`))];
    }
    case "balls":
      return [keys([["mean", "mean of a ball, one sigma"]]), ball_panels(report, candidate, 320), element("p", { class: "quiet" }, leaves)];
    case "contributions": {
      const most = diagnosis.contributions.slice(0, 12);
      return [element("figure", {}, contribution_chart(report, most), element("figcaption", {},
        "No single effect sticks out. This is to what the residual goes when the whole catalogue is fitted at once, each effect held to its plausible size."))];
    }
    default: {
      const [at, y] = [samples.map((s) => s.number), samples.map((s) => s.length_um)];
      const marked = ids.indexOf(it.sample);
      const noise = 1000 * figures.noise_mm;
      const host = chart("Length of the residual of every sample, in the order of measurement.", 340, (theme) => ({
        grid: { left: 62, right: 14, top: 16, bottom: 44, outerBoundsMode: "none" },
        tooltip: tooltip(theme, ({ value }) => `${value[2]}\n${digits(value[1])} µm`),
        xAxis: axis(theme, "sample, in the order of measurement", 27, { splitLine: { show: false }, min: 0, max: figures.samples + 1 }),
        yAxis: axis(theme, "length of the residual, µm", 46, { min: 0 }),
        series: [{
          ...residual_points(theme, at.map((x, k) => ({ value: [x, y[k], ids[k]], ...(k === marked && {
            symbol: "diamond", symbolSize: 14, itemStyle: { color: theme.candidate, opacity: 1 },
            label: { show: true, formatter: () => ids[k], position: x > figures.samples / 2 ? "left" : "right", color: theme.ink },
          }) })), 7),
          markLine: { silent: true, symbol: "none", lineStyle: { color: theme.noise, type: "dashed" }, data: [{ yAxis: noise,
            label: { formatter: () => `noise alone, rms: ${digits(noise)} µm`, position: "insideEndTop", color: theme.ink, fontSize: 11, backgroundColor: theme.paper, padding: 2 } }] },
        }],
      }));
      return [element("figure", {}, host, element("figcaption", {}, marked < 0
        ? "Every sample against what noise alone would leave. A residual as small as its noise is no proof of accuracy where nothing was measured."
        : `${ids[marked]} disagrees with all others. ${leaves}`))];
    }
  }
}

// A band around a curve, drawn under it.
function add_band(host, at, mean, sigma) {
  const one = drawn.find((d) => d.host === host);
  const plain = one.option;
  one.option = (theme, width) => {
    const option = plain(theme, width);
    const edge = [...at.map((x, k) => [x, mean[k] + sigma[k]]), ...at.map((x, k) => [x, mean[k] - sigma[k]]).reverse()];
    option.series.unshift({ type: "custom", silent: true, data: [0], encode: { x: -1, y: -1 },
      renderItem: (_, api) => ({ type: "polygon", shape: { points: edge.map((p) => api.coord(p)) }, style: { fill: theme.candidate, opacity: 0.22 } }) });
    return option;
  };
}

function contribution_chart(report, most) {
  const names = most.map((c) => named(report, c.effect));
  return chart("Contributions, largest first: " + most.slice(0, 5).map((c, k) => `${names[k]} ${percent(c.share)}`).join(", "), 60 + 22 * most.length, (theme, width) => ({
    grid: { left: Math.min(330, 0.42 * width) + 13, right: 46, top: 6, bottom: 44, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ dataIndex }) => `${names[dataIndex]} (${most[dataIndex].effect})\n${digits(100 * most[dataIndex].share)} % of what is left\n${digits(most[dataIndex].size_plausible)} plausible sizes`),
    xAxis: axis(theme, "share of the residual, %", 27, { min: 0 }),
    yAxis: { type: "category", inverse: true, data: names, axisTick: { show: false }, axisLine: { lineStyle: { color: theme.noise } },
      axisLabel: { color: theme.ink, fontSize: 12, width: Math.min(330, 0.42 * width), overflow: "truncate", interval: 0 } },
    series: [{ type: "bar", data: most.map((c) => 100 * c.share), barWidth: "62%", itemStyle: { color: theme.residual },
      label: { show: true, position: "right", color: theme.ink, fontSize: 11, formatter: ({ value }) => digits(value, 2) } }],
  }));
}
