"use strict";
// Residuals from every side, with what a candidate would take of them.

function ball_panels(report, candidate, plain_height) {
  const { samples, balls } = report.residuals;
  const several = new Set(balls.map((b) => b.dataset)).size > 1;
  const names = balls.map((b) => (several ? `${b.dataset}/${b.ball}` : b.ball));
  const on_ball = samples.map((s, k) => [s, k]).filter(([s]) => s.ball !== null);
  // Beside each other, not on top of each other.
  const beside = (k) => (((k * 0.618) % 1) - 0.5) * 0.5;
  const limit = round_up(1.05 * largest(on_ball.flatMap(([s]) => s.residual_um)));
  // Names that would not stand side by side stand upright.
  const turned = names.join("  ").length > 24;
  const bottom = turned ? room(names.map((n) => n.slice(0, 14)), 11) + 26 : 44;
  const height = plain_height + bottom - 44;
  const names_axis = { interval: 0, hideOverlap: !turned, rotate: turned ? 90 : 0, width: turned ? bottom - 38 : 90, overflow: "truncate" };
  const panel = (axis_name, a) => element("figure", {}, element("p", { class: "title" }, `${axis_name} of the world`),
    chart(`Residuals in ${axis_name} by ball: ` + balls.map((b, k) => `${names[k]} mean ${digits(b.mean_um[a])} µm`).join(", "), height, (theme) => scatter(theme, {
      x_name: "ball", y_name: `residual in ${axis_name}, µm`, unit: "µm", limit,
      x_axis: { min: -0.5, max: balls.length - 0.5, interval: 1, axisLabel: { ...names_axis, color: theme.quiet, fontSize: 11, customValues: names.map((_, k) => k), formatter: (x) => names[Math.round(x)] ?? "" } }, bottom,
      points: on_ball.map(([s, k]) => [s.ball + beside(k), s.residual_um[a], s.id]),
      candidate: candidate && on_ball.map(([s, k]) => [s.ball + beside(k), candidate.takes_um[k][a], s.id]),
      bins: balls.map((b, k) => ({ x: k - 0.34, mean: b.mean_um[a], sigma: b.sigma_um[a] })),
    })));
  return element("div", { class: "several" }, AXES.map(panel));
}

// Names of axes under a panel that says its joint above.
const short_names = [["qcmd", "commanded minus reported, deg"], ["q", "angle, deg"], ["tau", "gravity torque, N·m"], ["approach", "side from which it came"], ["payload", "payload, kg"], ["time", "time, s"], ["temp", "temperature, °C"]];

function view_panels(report, views, candidate) {
  const { samples, angles_urad } = report.residuals;
  const ids = samples.map((s) => s.id);
  // A joint whose axis goes through the TCP turns nothing that is measured.
  const read_off = ({ joint }) => angles_urad[joint - 1].some((x) => x !== null);
  const panel = (view) => {
    const { joint, against, what, unit, x, bins, test } = view;
    const takes = candidate?.of_views_urad[report.residuals.views.indexOf(view)];
    const limit = round_up(largest([...angles_urad[joint - 1], ...(candidate?.angles_urad[joint - 1] ?? [])]));
    const stands_out = test.p_family < 0.01 ? ` stands out: ${percent(test.explains)} of the squares` : "";
    return element("figure", {}, element("p", { class: "title" }, element("b", {}, `Joint ${joint}`), element("span", { class: "out" }, stands_out)),
      chart(`Apparent error of joint ${joint} against ${what}.${stands_out}`, 215, (theme) => scatter(theme, {
        x_name: short_names.find(([kind]) => against.startsWith(kind))?.[1] ?? `${against}, ${unit}`, y_name: "apparent error, µrad", unit: "µrad", limit, points: pairs(x, angles_urad[joint - 1], ids),
        bins: bins.map((b) => ({ x: b.x, mean: b.mean_urad, sigma: b.sigma_urad })), line: takes && bins.map((b, k) => [b.x, takes[k]]),
        x_axis: against.startsWith("approach") ? { min: -1.5, max: 1.5, interval: 1 } : {},
      })));
  };
  return element("div", { class: "several" }, views.filter(read_off).map(panel));
}

function time_panels(report, candidate) {
  const { samples } = report.residuals;
  const timed = samples.every((s) => s.time_s !== null);
  const x = samples.map((s) => (timed ? s.time_s / 60 : s.number));
  const limit = round_up(1.05 * largest(samples.flatMap((s) => s.residual_um)));
  const panel = (name, a) => element("figure", {}, element("p", { class: "title" }, `${name} of the world`),
    chart(`Residuals in ${name} over time.`, 215, (theme) => scatter(theme, {
      x_name: timed ? "time, min" : "sample, as measured", y_name: `residual in ${name}, µm`, unit: "µm", limit,
      points: samples.map((s, k) => [x[k], s.residual_um[a], s.id]), candidate: candidate && samples.map((s, k) => [x[k], candidate.takes_um[k][a], s.id]),
    })));
  return element("div", { class: "several" }, AXES.map(panel));
}

function residuals(report) {
  if (!report.residuals) return awaited();
  const { residuals: { views, balls, samples, of }, candidates, comparison, telling: first } = report;
  const panels = element("div");
  const of_kind = (kind) => views.filter((v) => v.against.startsWith(kind)).sort((a, b) => a.joint - b.joint);
  const kinds = [["q", "Joints, against their own angle"], ["tau", "Joints, against the torque of gravity on them"]];
  const further = [["approach", "Joints, against the side from which they came"], ["payload", "Joints, against the payload"], ["time", "Joints, over time"], ["temp", "Joints, against the temperature"]];
  const shown = ([kind, heading], candidate) => {
    const own = of_kind(kind).filter((v) => !v.against.startsWith("qcmd") || kind === "qcmd");
    return own.length ? [element("h3", {}, heading), view_panels(report, own, candidate)] : [];
  };
  const fill = (k) => {
    const candidate = candidates[k];
    // Charts of the last choice are gone with their hosts.
    for (let i = drawn.length - 1; i >= 0; i -= 1) if (panels.contains(drawn[i].host)) drawn.splice(i, 1)[0].chart?.dispose();
    const more = [["qcmd", "Joints, against commanded minus reported angle"], ...further].flatMap((kind) => shown(kind, candidate));
    const folded = more.length ? unfold("Further views: side of approach, payload, time, temperature", more, true) : null;
    folded?.addEventListener("toggle", () => folded.open && draw(folded));
    panels.replaceChildren(
      ...[key(["residual", "a sample"], ["mean", "mean of a bin or ball, one sigma"], candidate && ["line", `what ${named(report, candidate.effect)} would take, mean of a bin`], candidate && ["diamond", "the same of a sample"]),
        balls.length ? [element("h3", {}, "By ball"), ball_panels(report, candidate, 215)] : null,
        kinds.flatMap((kind) => shown(kind, candidate)), element("h3", {}, "Over time"), time_panels(report, candidate), folded].flat().filter(Boolean));
  };
  const option = (c, k) => {
    const input = element("input", { type: "radio", name: "candidate", value: k });
    input.checked = k === (first.candidate ?? 0);
    input.addEventListener("change", () => { fill(k); draw(panels); });
    return element("label", {}, input, named(report, c.effect), " ", element("code", {}, c.effect));
  };
  fill(first.candidate ?? (candidates.length ? 0 : -1));
  const told_ids = new Set();
  const worst = comparison.worst.slice(0, 10);
  return [
    element("p", {}, "A residual is measured minus predicted. What a joint seems to err by is the turn of it, actual minus reported, that would take up the most of a residual; samples in which it has less than a fifth of its longest lever are not drawn. A residual after a fit is not the error: the fit has bent the model to the data.",
      samples.length < of ? ` Of ${of} samples ${samples.length} are drawn, evenly; means are of all.` : ""),
    candidates.length > 1 ? element("fieldset", {}, element("legend", {}, "Candidate drawn over the residuals"), candidates.map(option)) : null,
    panels,
    element("h3", {}, "What stands out, in words"),
    element("ul", {}, comparison.sentences.map((text) => element("li", {}, worded(report, text, told_ids)))),
    unfold("The samples that fit worst", table("Worst first", [["sample", (w) => w.id, "words"], ["x, µm", (w) => digits(w.residual_um[0])], ["y, µm", (w) => digits(w.residual_um[1])],
      ["z, µm", (w) => digits(w.residual_um[2])], ["length, µm", (w) => digits(w.norm_um)], ["in units of noise", (w) => digits(w.normalised)], ["special", (w) => w.special.join("; "), "words"]], worst)),
    unfold(samples.length < of ? `${samples.length} of the ${of} samples as a table` : `All ${of} samples as a table`, table("Residuals", [["sample", (s) => s.id, "words"], ["ball", (s) => (s.ball === null ? "–" : balls[s.ball].ball), "words"],
      ["time, s", (s) => (s.time_s === null ? "–" : fixed(s.time_s, 0))], ["x, µm", (s) => digits(s.residual_um[0])], ["y, µm", (s) => digits(s.residual_um[1])], ["z, µm", (s) => digits(s.residual_um[2])]], samples), true),
  ];
}
