"use strict";
// Two models of the same data: the one of the page, A, and another, B.

function against(report) {
  const { against: it, names, figures, ladder: { rungs: [rung] } } = report;
  if (!it) return null;
  const [a, b] = it.names;
  const words = (effects) => effects.map((id) => [it.in_words[id] ?? id, " ", element("code", {}, id)]).flatMap((x, k) => (k ? ["; ", ...x] : x));
  const only = [it.effects[0].filter((id) => !it.effects[1].includes(id)), it.effects[1].filter((id) => !it.effects[0].includes(id))];
  const differs = only[0].length + only[1].length
    ? element("ul", {}, [0, 1].filter((k) => only[k].length).map((k) => element("li", {}, `only ${it.names[k]} holds `, words(only[k]))))
    : element("p", {}, "Both models hold the same effects.");
  const rows = figures_of_two(it, names, [figures, it.figures], [rung, it.rung]);
  const flagged = it.parameters.filter((p) => p.warning);
  return [
    element("p", { class: it.paired?.better ? "means" : "warning" }, sentence(it.sentence)),
    differs,
    table("Every headline figure of both, mm; B minus A", [["figure", (r) => r.name, "words"], [`A: ${a}`, (r) => r.show(r.a, r.band_a)], [`B: ${b}`, (r) => r.show(r.b, r.band_b)],
      ["difference", (r) => signed(r.places(r.b - r.a)) + (r.reach ? ` ± ${r.places(r.reach)}` : "")], ["beyond its error", (r) => r.beyond, "words"]], rows, (r) => r.kind ?? null),
    element("p", { class: "quiet" }, `In brackets the 10 to 90 % band of what is expected, and two standard errors of a measured mean. The ${names.residual} prefers nobody: a model with more parameters always leaves less.`),
    flagged.length ? element("div", { class: "warning" }, element("b", {}, `In ${b}, outside the physical range:`), flagged.map((p) => element("p", {}, worded(report, p.warning)))) : null,
    it.paired ? paired_chart(it) : null,
    both_views(report, it),
    unfold("The parameters of both models", parameters_of_two(report, it), true),
  ].flat();
}

// A row for every figure that both have.
function figures_of_two(it, names, [of_a, of_b], [rung_a, rung_b]) {
  const with_band = (x, band) => `${thousandths(x)}${band ? ` (${thousandths(band[0])} to ${thousandths(band[1])})` : ""}`;
  const plain = (x) => millimetres(x);
  const apart = (p, q) => (p && q ? (p[0] > q[1] || q[0] > p[1] ? "the bands are apart" : "no: the bands overlap") : "–");
  const { paired } = it;
  const about = (mean, k) => paired && [Math.max(0, mean - paired.mean_errors_mm[k]), mean + paired.mean_errors_mm[k]];
  const verdict = paired && (paired.better ? `yes: ${paired.better} is better` : "no: these poses do not tell");
  const row = (name, a, b, more = {}) => ({ name, a, b, show: plain, places: (x) => fixed(x, 4), beyond: "–", ...more });
  const expected = [of_a.expected, of_b.expected];
  const validation = [of_a.validation, of_b.validation];
  return [
    validation[0] && validation[1] && row(`${names.not_fitted}, mean`, validation[0].mean_mm, validation[1].mean_mm, { show: with_band, band_a: about(validation[0].mean_mm, 0), band_b: about(validation[1].mean_mm, 1), reach: paired?.two_errors_mm, beyond: verdict, kind: "emphasis" }),
    validation[0] && validation[1] && row(`${names.not_fitted}, max`, validation[0].max_mm, validation[1].max_mm),
    expected[0] && expected[1] && row(`${names.workspace}, mean`, expected[0].mean_mm, expected[1].mean_mm, { show: with_band, band_a: expected[0].mean_band_mm, band_b: expected[1].mean_band_mm, beyond: apart(expected[0].mean_band_mm, expected[1].mean_band_mm) }),
    row(`${names.cross_validated}, rms`, rung_a.cv_rms_mm, rung_b.cv_rms_mm),
    row(`${names.residual}, rms`, of_a.rms_mm, of_b.rms_mm, { beyond: "prefers nobody" }),
    row(names.noise_left, of_a.noise_mm, of_b.noise_mm, { beyond: "" }),
    row(names.unexplained, of_a.unexplained_mm, of_b.unexplained_mm, { beyond: "" }),
  ].filter((r) => r && Number.isFinite(r.a) && Number.isFinite(r.b));
}

// The error at every pose that was not fitted, A against B: a pose under the line is better with B.
function paired_chart(it) {
  const { paired: p, names: [a, b] } = it;
  const [last, apart] = ticks(Math.max(...p.a_mm, ...p.b_mm));
  const label = `Position error at ${p.poses} poses that were not fitted, ${b} against ${a}: at ${p.better_at} of them ${b} is nearer.`;
  const chosen = p.a_mm.length < p.poses ? ` Of ${p.poses} poses ${p.a_mm.length} are drawn, evenly.` : "";
  const sorted = (values) => [...values].sort((x, y) => x - y).map((mm, k) => [(100 * (k + 0.5)) / values.length, mm]);
  const frame = { grid: { left: 62, right: 20, top: 34, bottom: 44, outerBoundsMode: "none" } };
  const scale = { min: 0, max: last, interval: apart, scale: false };
  const pose_by_pose = chart(label, 360, (theme) => ({
    ...frame, tooltip: tooltip(theme, ({ value }) => `${a}: ${thousandths(value[0])} mm\n${b}: ${thousandths(value[1])} mm`),
    xAxis: axis(theme, `error of ${a}, mm`, 27, scale), yAxis: axis(theme, `error of ${b}, mm`, 46, scale),
    series: [
      { type: "line", silent: true, showSymbol: false, data: [[0, 0], [last, last]], lineStyle: { color: theme.noise, width: 1.5 } },
      { ...residual_points(theme, p.a_mm.map((x, k) => [x, p.b_mm[k]])), name: "pose", itemStyle: { color: theme.measured, opacity: 0.6 } },
    ],
  }));
  const shares = chart(`Sorted errors of both models: medians ${thousandths(sorted(p.a_mm)[Math.floor(p.a_mm.length / 2)][1])} and ${thousandths(sorted(p.b_mm)[Math.floor(p.b_mm.length / 2)][1])} mm.`, 360, (theme) => ({
    ...frame, legend: { top: 0, left: 56, itemWidth: 18, itemHeight: 10, textStyle: { color: theme.ink, fontSize: 12 }, selectedMode: false },
    tooltip: tooltip(theme, ({ seriesName, value }) => `${seriesName}: ${thousandths(value[1])} mm`),
    xAxis: axis(theme, "share of the poses, %", 27, { min: 0, max: 100, splitLine: { show: false } }), yAxis: axis(theme, "position error, mm", 46, scale),
    series: [[`A: ${a}`, p.a_mm, "residual", "solid"], [`B: ${b}`, p.b_mm, "candidate", "dashed"]].map(([name, values, colour, type]) => ({
      name, type: "line", showSymbol: false, symbol: "none", itemStyle: { color: theme[colour] }, lineStyle: { color: theme[colour], width: 2.4, type }, data: sorted(values) })),
  }));
  return element("div", { class: "pair" },
    element("figure", {}, pose_by_pose, element("figcaption", {}, `One mark a pose that was not fitted: under the line ${b} is nearer. That is so at ${p.better_at} of ${p.poses} poses.${chosen}`)),
    element("figure", {}, shares, element("figcaption", {}, "Each curve is sorted by itself: the error that so many of the poses do not exceed.")));
}

// What the joints seem to err by under both models, over their own angles.
function both_views(report, it) {
  if (!report.residuals) return null;
  const own = report.residuals.views.filter((v) => /^q\d/.test(v.against)).sort((x, y) => x.joint - y.joint);
  const pairs_of = own.map((v) => [v, it.views.find((w) => w.joint === v.joint && w.against === v.against)]).filter(([v, w]) => w && v.bins.length);
  if (!pairs_of.length) return null;
  const limit = round_up(1.1 * largest(pairs_of.flatMap(([v, w]) => [...v.bins, ...w.bins].map((bin) => bin.mean_urad))));
  const panel = ([v, w]) => element("figure", {}, element("p", { class: "title" }, element("b", {}, `Joint ${v.joint}`)),
    chart(`Mean apparent error of joint ${v.joint} over its angle under both models; largest ${digits(largest(v.bins.map((bin) => bin.mean_urad)))} and ${digits(largest(w.bins.map((bin) => bin.mean_urad)))} µrad.`, 215, (theme) => ({
      ...scatter(theme, { x_name: "angle, deg", y_name: "apparent error, µrad", unit: "µrad", limit, points: [] }),
      series: [[v.bins, "residual", "circle", "solid"], [w.bins, "candidate", "diamond", "dashed"]].map(([bins, colour, symbol, type], k) => ({
        name: it.names[k], type: "line", symbol, symbolSize: 7, itemStyle: { color: theme[colour] }, lineStyle: { color: theme[colour], width: 2, type }, data: bins.map((bin) => [bin.x, bin.mean_urad]), ...(k === 0 && { markLine: zero(theme) }) })),
      tooltip: tooltip(theme, ({ seriesName, value }) => `${seriesName}\n${digits(value[1])} µrad at ${digits(value[0], 4)} deg`),
    })));
  const better = report.residuals.samples.filter((s, k) => it.residual_um[k] < s.length_um).length;
  return [
    element("h3", {}, "Residuals of both, joint by joint"),
    element("p", { class: "quiet" }, element("span", { class: "swatch a" }), ` A: ${it.names[0]}; `, element("span", { class: "swatch b" }), ` B: ${it.names[1]}, dashed. Means of bins of the fitted samples; of ${it.residual_um.length} samples drawn, ${better} have a smaller residual with B. The arrows of both are in the view in space.`),
    element("div", { class: "several" }, pairs_of.map(panel)),
  ];
}

function parameters_of_two(report, it) {
  const [of_a, of_b] = [report.calibration.parameters, it.parameters].map((list) => new Map(list.map((p) => [p.name, p])));
  const rows = [...new Set([...of_a.keys(), ...of_b.keys()])].map((name) => ({ name, a: of_a.get(name), b: of_b.get(name) }));
  const value = (p) => (p ? `${fixed(p.value, 3)} ± ${digits(p.sigma, 2)}` : "–");
  return table("Identified values, one sigma", [["parameter", (r) => r.name, "words"], [`A: ${it.names[0]}`, (r) => value(r.a)], [`B: ${it.names[1]}`, (r) => value(r.b)],
    ["difference", (r) => (r.a && r.b ? signed(fixed(r.b.value - r.a.value, 3)) : "–")], ["unit", (r) => printed((r.a ?? r.b).unit), "words"]], rows);
}
