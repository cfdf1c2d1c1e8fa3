"use strict";
// The sections below the verdict.

function accuracy(report) {
  const { run, validation, drawn: as_drawn } = report;
  const of_run = run?.methods ?? [];
  const titles = { trical: "TriCal", tracker: "laser tracker" };
  const rows = [];
  if (as_drawn.on === "validation" && as_drawn.errors) rows.push({ name: as_drawn.name, ...as_drawn.errors });
  const methods = of_run.length ? of_run.map((m) => ({ name: `calibrated by ${titles[m.name] ?? m.name}`, paper: run.paper?.[m.name], ...m.validation }))
    : validation ? [{ name: "calibrated", ...validation }] : [];
  if (!methods.length) return null;
  for (const method of methods) {
    rows.push({ ...method, kind: "emphasis" });
    if (method.paper) rows.push({ name: "the paper's, on its robot", ...method.paper, kind: "beside" });
  }
  const of_quantile = (q) => (row) => (row.quantiles_mm ? thousandths(row.quantiles_mm[q]) : "–");
  const columns = [
    ["position error, mm", (r) => r.name, "words"], ["mean", (r) => thousandths(r.mean_mm)], ["max", (r) => thousandths(r.max_mm)],
    ["std", (r) => thousandths(r.std_mm)], ["rms", (r) => thousandths(r.rms_mm)], ["median", of_quantile("50")], ["95 %", of_quantile("95")],
  ];
  const most = ticks(Math.max(...methods.flatMap((m) => [m.max_mm, 1.15 * (m.paper?.mean_mm ?? 0)])));
  const highest = ticks(Math.max(...methods.flatMap((m) => m.histogram.map((b) => b.count))));
  const histogram = (m) => element("figure", {}, element("p", { class: "title" }, m.name),
    chart(`Histogram of the position errors, ${m.name}: mean ${millimetres(m.mean_mm)} mm, largest ${millimetres(m.max_mm)} mm.`, 250, (theme) => bars(theme, {
      rows: m.histogram.map((b) => [b.from_mm, b.to_mm, b.count]), x_name: "position error, mm", most, highest, colour: theme.measured,
      marks: [{ at: m.mean_mm, text: `mean ${thousandths(m.mean_mm)}`, type: "solid" }, m.paper && { at: m.paper.mean_mm, text: `the paper's ${thousandths(m.paper.mean_mm)}`, type: "dashed" }]
        .filter(Boolean),
    })));
  const expected = run?.expect?.checks?.length ? unfold(`What the scenario expects: ${run.expect.met ? "met" : "NOT MET"}`,
    table("Expected and found", [["quantity", (c) => c.name, "words"], ["found", (c) => digits(c.value, 4)], ["band", (c) => `${c.band[0]} to ${c.band[1]}`], ["met", (c) => (c.met ? "met" : "not met"), "words"]], run.expect.checks)) : null;
  const paper = methods.some((m) => m.paper);
  return [
    table(`On ${methods[0].samples} poses${paper ? "; beside each method the paper's Table 9 (500 poses of a real KR6)" : ""}`, columns, rows, (r) => r.kind ?? null),
    set_up_anew(methods[methods.length - 1]),
    element("div", { class: "pair" }, methods.map(histogram)),
    element("p", { class: "quiet" }, "Lengths of measured minus predicted positions; they hold the noise of the instrument that measured them."),
    expected,
  ];
}

// What was fitted to the judged poses themselves is not judged by them.
function set_up_anew({ refitted, from_fit_rows }) {
  const named = (list) => list.slice(0, 6).join(", ") + (list.length > 6 ? ` and ${list.length - 6} more` : "");
  return [
    refitted?.length ? element("p", { class: "warning" }, `Not known from the fit, so fitted to these very poses first: ${named(refitted)}. The residual is the spread about that, smaller than the error.`) : null,
    from_fit_rows?.length ? element("p", { class: "quiet" }, `Not in the calibration, so fitted to rows of set ‘fit’ first: ${named(from_fit_rows)}.`) : null,
  ];
}

function workspace(report) {
  const { workspace: it, names, figures: { expected, validation } } = report;
  if (!it || !expected?.map) return null;
  const { radius_mm: r, height_mm: h, cells: grid } = expected.map;
  const flat = (map) => map.flatMap((row, k) => row.map((cell, c) => cell && [r[c], r[c + 1], h[k], h[k + 1], cell.mean_mm, cell.poses])).filter(Boolean);
  const all = [["predicted", flat(grid)], ...(it.measured ? [["measured", flat(it.measured)]] : [])];
  const values = all.flatMap(([, rows]) => rows.map((row) => row[4]));
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const range = (rows) => `${millimetres(Math.min(...rows.map((c) => c[4])))} to ${millimetres(Math.max(...rows.map((c) => c[4])))} mm`;
  const picture = ([name, rows]) => element("figure", {}, it.measured ? element("p", { class: "title" }, name === "predicted" ? `${names.workspace}, from the fitted rows alone` : `${names.not_fitted}, ${validation?.samples ?? ""} poses`) : null,
    chart(`Position error ${name} by distance from axis 1 and height over the base: ${range(rows)}.`, 400, (theme) => cells(theme, {
      x_name: "distance of the TCP from axis 1, mm", y_name: "height of the TCP over the base, mm", rows, name, low, high, points: it.radius_mm.map((x, k) => [x, it.height_mm[k]]),
    })));
  const heights = grid.map((row, k) => ({ name: `${h[k].toFixed(0)} to ${h[k + 1].toFixed(0)}`, row })).reverse();
  return [
    element("p", {}, report.verdict.expected),
    element("div", { class: "pair" }, all.map(picture)),
    element("p", { class: "quiet" }, "Numbers are millimetres: the mean over the poses (dots) of a cell. Yellow is worse. The prediction carries every effect of the catalogue, at every size that these data allow, to these poses.", it.measured ? " What was measured holds the noise of the instrument too." : ""),
    unfold("The map as a table", table("Expected error, mm; columns are distances from axis 1, mm",
      [["height, mm", (x) => x.name], ...r.slice(0, -1).map((from, c) => [`${from.toFixed(0)} to ${r[c + 1].toFixed(0)}`, (x) => (x.row[c] ? thousandths(x.row[c].mean_mm) : "")])], heights)),
  ];
}

function ranking(report) {
  const { diagnosis: d, meanings } = report;
  const size = (f) => f.parameters.slice(0, 3).map((p) => `${p.name} ${digits(p.value)} ± ${digits(p.sigma, 2)} ${printed(p.unit)}`).join(", ") + (f.parameters.length > 3 ? ", …" : "");
  const columns = [
    ["effect", (f) => [capital(named(report, f.in_model)), " ", element("code", {}, f.in_model), element("div", { class: "quiet" }, [meanings[f.in_model]?.what, meanings[f.in_model]?.gallery].filter(Boolean).join("; picture in "))], "words"],
    ["probability", (f) => share(f.probability)], ["explains", (f) => share(f.explains)], ["visible", (f) => share(f.visible)],
    ["gain", (f) => percent(f.cv_gain)], ["as it would be fitted", size, "words"],
    ["aliased with", (f) => f.rivals.join(", "), "words"],
  ];
  const map = d.heat_map.cells;
  const plain = (variable) => variable.replace(/[() ]/g, "");
  const variables = [...new Set(map.map((c) => plain(c.against)))];
  const joints = [...new Set(map.map((c) => c.joint))];
  const most = Math.max(3, ...map.map((c) => c.ln_evidence_against_background));
  const heat = map.length ? [
    element("h3", {}, "Which joint’s error follows what, whatever its shape"),
    element("figure", {}, element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Map of joints and variables" },
      wide(chart(`Evidence that the error of a joint follows a variable; best: ${d.heat_map.best ? `joint ${d.heat_map.best.joint} follows ${d.heat_map.best.against}` : "none"}.`, 40 + 30 * joints.length, (theme, width) => matrix(theme, {
        columns: variables, rows: joints.map((j) => `joint ${j}`), low: 0, high: most, colours: [theme.panel, theme.residual],
        data: map.map((c) => ({ value: [variables.indexOf(plain(c.against)), joints.indexOf(c.joint), c.ln_evidence_against_background],
          label: { color: c.ln_evidence_against_background > 0.6 * most ? theme.paper : theme.ink } })),
        text: ({ value }) => fixed(value[2], 1), say: ({ value }) => `joint ${joints[value[1]]} follows ${variables[value[0]]}\nln evidence ${fixed(value[2], 1)}`,
      }, width)), 560)),
      element("figcaption", {}, "Log evidence vs. the usual model discrepancy of a robot: above 3 is worth a look, far below 0 is nothing.")),
  ] : [];
  const contributions = d.contributions.slice(0, 10);
  return [
    element("p", {}, `Probability that nothing is missing beyond the usual model discrepancy: ${percent(d.nothing_probability)}.`,
      d.set95.length ? ` In the 95 % credible set: ${d.set95.map((id) => named(report, id)).join("; ")}.` : ""),
    d.findings.length ? table("Effects of the catalogue, most credible first", columns, d.findings, (f) => (d.set95.includes(f.effect) ? "emphasis" : null)) : null,
    element("p", { class: "quiet" }, "Explains: share of the squares left that it takes. Visible: share of the effect that shows in these residuals at all; the rest hides in wrong parameters and comes out elsewhere. Gain: how much the residual of blocks that were not fitted falls (cross-validation)."),
    contributions.length ? [element("h3", {}, "What contributes most when everything is fitted at once"), element("figure", {}, contribution_chart(report, contributions))] : null,
    heat,
  ].flat(2);
}

// A chart that needs so many pixels, and scrolls where there are fewer.
function wide(host, pixels) {
  host.style.minWidth = `${pixels}px`;
  return host;
}

function parameters(report) {
  const { calibration: c, run } = report;
  const truths = new Map((run?.methods?.find((m) => m.name === "trical")?.score ?? []).map((p) => [p.name, p.truth]));
  const places = (p) => Math.min(6, Math.max(3, 1 - Math.floor(Math.log10(p.sigma || 1))));
  const columns = [
    ["parameter", (p) => (p.warning ? [p.name, element("div", { class: "warning flag" }, p.warning)] : p.name), "words"], ["nominal", (p) => fixed(p.nominal, 3)], ["identified", (p) => fixed(p.value, places(p))], ["one sigma", (p) => fixed(p.sigma, places(p))],
    ["correction", (p) => signed(fixed(p.value - p.nominal, places(p)))], ["unit", (p) => printed(p.unit), "words"],
    ...(truths.size ? [["truth", (p) => fixed(truths.get(p.name), places(p))], ["off, in sigmas", (p) => (truths.has(p.name) ? signed(fixed((p.value - truths.get(p.name)) / p.sigma, 1)) : "–")]] : []),
  ];
  const names = c.parameters.map((p) => p.name);
  const strongest = names.flatMap((a, i) => names.slice(0, i).map((b, k) => ({ a, b, r: c.correlation[i][k] }))).sort((x, y) => Math.abs(y.r) - Math.abs(x.r)).slice(0, 12);
  const side = Math.max(420, 30 + room(names, 9) + 15 * names.length);
  const correlations = names.length && names.length <= 60 ? element("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Correlations", style: `max-width: ${side + 140}px` }, wide(chart(
    `Correlations of ${names.length} parameters; strongest ${strongest[0] ? `${strongest[0].a} with ${strongest[0].b}, ${fixed(strongest[0].r, 2)}` : "none"}.`, side, (theme, width) => matrix(theme, {
      columns: names, rows: names, label_size: 9, columns_turned: 90, low: -1, high: 1, colours: ["#0072b2", theme.paper, "#d55e00"],
      data: c.correlation.flatMap((row, i) => row.map((r, k) => [k, i, r])), say: ({ value }) => `${names[value[1]]} with ${names[value[0]]}\n${fixed(value[2], 3)}`,
    }, width)), side)) : null;
  const o = c.observability;
  const seen = [
    { name: "O1", what: "geometric mean of the singular values over the root of the number of poses", value: o.O1 }, { name: "O2", what: "least over largest singular value", value: o.O2 },
    { name: "O3", what: "least singular value", value: o.O3 }, { name: "O4", what: "least singular value squared over the largest", value: o.O4 },
    { name: "O5", what: "harmonic: one over the sum of the reciprocal singular values", value: o.O5 },
  ];
  const ranges = c.joint_ranges;
  return [
    element("p", {}, `${c.samples} samples, ${c.rank} independent parameters, ${c.dof} degrees of freedom; residual ${millimetres(c.rms_mm)} mm rms (3-D), χ²/dof ${digits(c.chi2_per_dof)}. One sigma is of the noise ${c.noise_stated ? "as stated" : "as the residuals show it"}; it knows nothing of effects that are not in the model.`),
    table(`Parameters of ${c.effects.join(" + ")}`, columns, c.parameters),
    c.stated_parameters.length ? unfold("Certified values, carried along with their uncertainty", table("Certified values", [["parameter", (p) => p.name, "words"], ["stated", (p) => fixed(p.nominal, 4)], ["one sigma", (p) => fixed(p.stated_sigma, 4)],
      ["found", (p) => fixed(p.value, 4)], ["one sigma after", (p) => fixed(p.sigma, 4)], ["unit", (p) => printed(p.unit), "words"]], c.stated_parameters)) : null,
    element("h3", {}, "How well the poses show them"),
    element("div", { class: "pair" },
      element("div", {}, table(`Observability (SI units); condition of the scaled Jacobian ${digits(c.condition)}`, [["index", (x) => x.name], ["value", (x) => digits(x.value)], ["what it is", (x) => x.what, "words"]], seen),
        c.unresolved_sentences.length ? [element("p", {}, "Kept at their nominal values, because these data cannot distinguish them:"), element("ul", {}, c.unresolved_sentences.map((text) => element("li", {}, text)))] : null),
      element("figure", {}, range_chart(ranges), element("figcaption", {}, "Joint angles in the data (bars) within the limits of the robot (outlines). Outside the bars the calibration is an extrapolation."))),
    element("h3", {}, "Correlations"),
    correlations && element("figure", {}, correlations, element("figcaption", {}, "Blue: −1, no colour: 0, orange: +1. Parameters that are strongly correlated are known in their combination better than each alone.")),
    unfold("The strongest correlations as a table", table("Strongest first", [["parameter", (x) => x.a, "words"], ["with", (x) => x.b, "words"], ["correlation", (x) => fixed(x.r, 3)]], strongest)),
  ].flat();
}

function range_chart(ranges) {
  const label = "Joint angles covered: " + ranges.map((r) => `joint ${r.joint} ${fixed(r.identified_deg[0], 0)} to ${fixed(r.identified_deg[1], 0)} deg of ${fixed(r.limits_deg[0], 0)} to ${fixed(r.limits_deg[1], 0)}`).join("; ");
  return chart(label, 60 + 28 * ranges.length, (theme) => ({
    grid: { left: 56, right: 16, top: 6, bottom: 44, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ dataIndex: k }) => `joint ${ranges[k].joint}\nseen ${fixed(ranges[k].identified_deg[0], 1)} to ${fixed(ranges[k].identified_deg[1], 1)} deg\nlimits ${fixed(ranges[k].limits_deg[0], 1)} to ${fixed(ranges[k].limits_deg[1], 1)} deg`),
    xAxis: axis(theme, "joint angle, deg", 27),
    yAxis: { type: "category", inverse: true, data: ranges.map((r) => `joint ${r.joint}`), axisTick: { show: false }, axisLine: { show: false }, axisLabel: { color: theme.quiet, fontSize: 11 } },
    series: [{ type: "custom", data: ranges.map((r, k) => [k, ...r.identified_deg, ...r.limits_deg]), encode: { y: 0, x: [1, 2, 3, 4] },
      renderItem: (_, api) => {
        const box = (from, to, height, style) => {
          const [left, y] = api.coord([from, api.value(0)]);
          const [right] = api.coord([to, api.value(0)]);
          return { type: "rect", shape: { x: left, y: y - height / 2, width: right - left, height }, style };
        };
        return { type: "group", children: [
          box(api.value(3), api.value(4), 16, { fill: "transparent", stroke: theme.noise, lineWidth: 1 }),
          box(api.value(1), api.value(2), 10, { fill: theme.residual, opacity: 0.8 }),
        ] };
      } }],
  }));
}

function cell(report) {
  if (!report.pictures?.length) return null;
  const picture = ({ data, shows }) => element("figure", {}, element("img", { src: data, alt: shows }), element("figcaption", {}, shows));
  return [element("div", { class: "pair" }, report.pictures.map(picture))];
}

function centring(report) {
  const { campaign } = report;
  if (!campaign?.length) return null;
  const centred = campaign.filter((c) => c.outcome === "centred");
  const failed = campaign.filter((c) => c.outcome !== "centred");
  // A reading of zero has no logarithm: the indicators resolve a tenth of a micrometre.
  const line = (c) => c.readings_um.map((r, k) => [k + 1, Math.max(r, 0.1), c.id]);
  const readings = Math.max(...campaign.map((c) => c.readings_um.length));
  const count = (of) => campaign.filter(of).length;
  const picture = chart(`Length of the reading at every stop on the ball, ${campaign.length} probings, at most ${readings} readings.`, 300, (theme) => ({
    grid: { left: 66, right: 16, top: 12, bottom: 44, outerBoundsMode: "none" },
    tooltip: tooltip(theme, ({ value }) => `${value[2]}\nreading ${value[0]}: ${digits(value[1])} µm`),
    xAxis: axis(theme, "reading on the ball", 27, { min: 1, max: Math.max(2, readings), interval: 1, splitLine: { show: false } }),
    yAxis: axis(theme, "off the centre, µm (logarithmic)", 48, { type: "log", axisLabel: { color: theme.quiet, fontSize: 11, formatter: (x) => String(Number(x.toPrecision(3))) } }),
    series: [...centred, ...failed].map((c) => ({
      type: "line", data: line(c), symbol: c.outcome === "centred" ? "circle" : "triangle", symbolSize: c.outcome === "centred" ? 4 : 8,
      lineStyle: { color: c.outcome === "centred" ? theme.residual : theme.candidate, width: c.outcome === "centred" ? 1 : 2, opacity: c.outcome === "centred" ? 0.35 : 1 },
      itemStyle: { color: c.outcome === "centred" ? theme.residual : theme.candidate, opacity: c.outcome === "centred" ? 0.5 : 1 },
    })),
  }));
  const ways = campaign.filter((c) => Number.isFinite(c.clearance_mm)).sort((a, b) => a.clearance_mm - b.clearance_mm);
  return [
    element("p", {}, `${centred.length} of ${campaign.length} probings centred; ${[...Array(readings).keys()].map((k) => k + 1).map((n) => [n, count((c) => c.outcome === "centred" && c.readings_um.length === n)]).filter(([, n]) => n).map(([n, times]) => `${times} in ${n} readings`).join(", ")}.`),
    element("figure", {}, picture, element("figcaption", {}, "Length of the three indicators’ reading at every stop on the ball: one line a probing. Each step takes away what the reading says.")),
    ways.length ? element("p", {}, `Least clearance of the nominal arm on its planned ways: ${fixed(ways[0].clearance_mm, 1)} mm, on the way to ${ways[0].id}; ${fixed(ways[Math.floor(ways.length / 2)].clearance_mm, 1)} mm in the median of ${ways.length} ways.`) : null,
    ways.length ? unfold("Least clearance of every way", table("Ways, the narrowest first", [["to probing", (c) => c.id, "words"], ["ball", (c) => c.ball, "words"], ["least clearance, mm", (c) => fixed(c.clearance_mm, 1)]], ways)) : null,
    failed.length ? table("Not centred", [["probing", (c) => c.id, "words"], ["ball", (c) => c.ball, "words"], ["why", (c) => c.outcome, "words"], ["time, s", (c) => fixed(c.duration_s, 1)]], failed) : null,
  ];
}

function provenance(report) {
  const { provenance: p, run, calibration } = report;
  const facts = [
    ["program", p.program], ["charts", p.charts], ["robot", calibration.robot],
    run?.scenario && ["scenario", run.scenario], run?.seed !== undefined && run?.seed !== null && ["seed", String(run.seed)], run?.plant && ["plant", run.plant],
  ].filter(Boolean).map(([name, value]) => ({ name, value }));
  return [
    table("What made this report", [["what", (f) => f.name, "words"], ["which", (f) => f.value, "words"]], facts),
    table("Data", [["dataset", (d) => d.name, "words"], ["rows fitted", (d) => String(d.fit_rows)], ["rows judged on", (d) => String(d.validation_rows)],
      ["SHA-256 of its files", (d) => element("code", {}, d.sha256), "words"],
      ...(p.datasets.some((d) => Object.keys(d.stated).length) ? [["as stated", (d) => Object.entries(d.stated).map(([k, v]) => `${k} = ${v}`).join(", "), "words"]] : [])], p.datasets),
    element("p", { class: "quiet" }, "The same run gives the same page, byte for byte."),
  ];
}

// A page that a program keeps begins without one.
const given = JSON.parse(document.getElementById("data").textContent);
if (given) render(given);
