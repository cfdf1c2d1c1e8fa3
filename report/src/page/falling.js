"use strict";
// The error falling: by model, and pose by pose.

// The models of the page, from the nominal one to the last.
function models(report) {
  const { ladder: it, drawn: as_drawn } = report;
  const first = report.against ? `A: ${report.against.names[0]}` : "calibrated";
  const changed = (r) => (r.removed?.length ? `− ${in_words(report, r.removed)}` : `+ ${in_words(report, r.added)}`);
  const rungs = it.rungs.map((r, k) => ({ ...r, name: k ? changed(r) : first }));
  if (report.against) rungs.push({ ...report.against.rung, name: `B: ${report.against.names[1]}` });
  if (it.other) rungs.push({ ...it.other, name: `+ ${it.recommended.kind.replaceAll("_", " ")} (${it.other.added.length})` });
  const rows = rungs.map((r) => ({
    name: r.name, fit: r.fit_rms_mm, cv: r.cv_rms_mm, expected: r.workspace?.mean_mm, band: r.workspace?.mean_band_mm,
    measured: r.validation?.mean_mm, reach: r.validation && two_errors(r.validation), largest: r.validation?.max_mm, noise: r.noise_mm, chi2: r.chi2_per_dof,
  }));
  if (as_drawn.errors) {
    const measured = as_drawn.on === "validation";
    rows.unshift({ name: as_drawn.name, nominal: true, fit: measured ? null : as_drawn.errors.rms_mm, measured: measured ? as_drawn.errors.mean_mm : null,
      reach: measured ? two_errors(as_drawn.errors) : null, largest: measured ? as_drawn.errors.max_mm : null });
  }
  return rows;
}

// Two standard errors about a mean over poses.
function two_errors(errors) {
  const half = (2 * errors.std_mm) / Math.sqrt(errors.samples);
  return [Math.max(0, errors.mean_mm - half), errors.mean_mm + half];
}

function ladder(report) {
  const { ladder: it, names } = report;
  const rows = models(report);
  const kinds = [
    ["fit", `${names.residual}, rms`, "circle", "residual"], ["cv", `${names.cross_validated}, rms`, "triangle", "other"],
    ["expected", `${names.workspace}, mean`, "diamond", "predicted", "band"], ["measured", `${names.not_fitted}, mean`, "rect", "measured", "reach"],
  ].filter(([name]) => rows.some((row) => Number.isFinite(row[name])));
  const label = "Errors by model, mm: " + rows.map((r) => `${r.name}: ${kinds.filter(([n]) => Number.isFinite(r[n])).map(([n, what]) => `${what} ${millimetres(r[n])}`).join(", ")}`).join("; ");
  const of_row = (r) => [r.fit, r.cv, r.expected, r.measured, r.noise, ...(r.band ?? []), ...(r.reach ?? [])].filter(Number.isFinite);
  const fitted = rows.filter((r) => !r.nominal);
  // The nominal robot would leave no room for the rest: what lies beyond the axis is told in figures.
  const most = Math.max(...fitted.flatMap(of_row));
  const all = Math.max(...rows.flatMap(of_row));
  const [last, apart] = ticks(all < 2.5 * most ? all : 1.15 * most);
  // On a phone the name of a model stands over its line, not beside it.
  const is_narrow = (width) => width < 620;
  // Names of figures that would not stand in one line stand under each other.
  const is_stacked = (width) => width < 240 + 190 * kinds.length;
  const above = (width) => (is_stacked(width) ? 20 * kinds.length + 4 : 44);
  const height = (width) => above(width) + 52 + (is_narrow(width) ? 74 : 48) * rows.length;
  const picture = chart(label, height, (theme, width) => {
    const [narrow, stacked] = [is_narrow(width), is_stacked(width)];
    const left = narrow ? 10 : 240;
    const name_of = (row, y, x, w) => (narrow
      ? { text: row.name, x, y: y - 22, align: "left", verticalAlign: "bottom", fill: theme.ink, fontSize: 12, fontWeight: 600, width: w, overflow: "truncate" }
      : { text: row.name, x: left - 12, y, align: "right", verticalAlign: "middle", fill: theme.ink, fontSize: 12, lineHeight: 15, width: left - 14, overflow: "break" });
    const spread = (k) => (k - (kinds.length - 1) / 2) * (narrow ? 0.14 : 0.18) + (narrow ? 0.12 : 0);
    return {
      grid: { left, right: 20, top: above(width), bottom: 44, outerBoundsMode: "none" },
      legend: { top: 0, left: narrow ? 0 : left - 5, orient: stacked ? "vertical" : "horizontal", itemGap: stacked ? 2 : 14, textStyle: { color: theme.ink, fontSize: 12 }, itemWidth: 11, itemHeight: 11, selectedMode: false },
      tooltip: tooltip(theme, ({ value, seriesName }) => {
        const row = rows[Math.round(value[1])];
        const range = row[kinds.find(([, what]) => what === seriesName)?.[4]];
        return `${row.name}\n${seriesName}: ${millimetres(value[0])} mm${range ? `\n${millimetres(range[0])} to ${millimetres(range[1])} mm` : ""}`;
      }),
      xAxis: axis(theme, "error, mm", 27, { min: 0, max: last, interval: apart, splitLine: { show: true, lineStyle: { color: theme.grid } }, axisLabel: { color: theme.quiet, fontSize: 11, formatter: (x) => String(Number(x.toPrecision(3))) } }),
      yAxis: { type: "value", inverse: true, min: -0.5, max: rows.length - 0.5, interval: 1, axisTick: { show: false }, axisLine: { show: false }, axisLabel: { show: false }, splitLine: { show: false } },
      series: [
        { type: "custom", silent: true, data: rows.map((_, k) => [k]), encode: { x: -1, y: 0 },
          renderItem: (parameters, api) => {
            const { x, width: w } = parameters.coordSys;
            const row = rows[parameters.dataIndex];
            const at = (mm, y) => api.coord([Math.min(mm, last), y])[0];
            const [, y] = api.coord([1, parameters.dataIndex]);
            const children = [
              { type: "line", shape: { x1: x, y1: y, x2: x + w, y2: y }, style: { stroke: theme.grid, lineWidth: 1 } },
              { type: "text", style: name_of(row, y, x, w) },
            ];
            for (const [k, [name, , , colour, range]] of kinds.entries()) {
              const [, high] = api.coord([1, parameters.dataIndex + spread(k)]);
              if (row[range]) children.push({ type: "line", shape: { x1: at(row[range][0]), y1: high, x2: at(row[range][1]), y2: high }, style: { stroke: theme[colour], lineWidth: 3, opacity: 0.5 } });
              if (row[name] > last) children.push({ type: "text", style: { text: `${millimetres(row[name])} mm →`, x: x + w - 2, y: high, align: "right", verticalAlign: "middle", fill: theme[colour], fontSize: 12, fontWeight: 600, stroke: theme.paper, lineWidth: 3 } });
            }
            if (row.noise) {
              const n = at(row.noise);
              children.push({ type: "line", shape: { x1: n, y1: y - 13, x2: n, y2: y + 13 }, style: { stroke: theme.noise, lineWidth: 2, lineDash: [3, 3] } });
            }
            return { type: "group", children };
          } },
        ...kinds.map(([name, what, symbol, colour], k) => ({
          name: what, type: "scatter", symbol, symbolSize: 11, itemStyle: { color: theme[colour] }, z: 4,
          data: rows.map((row, r) => [row[name], r + spread(k)]).filter(([x]) => Number.isFinite(x) && x <= last),
        })),
      ],
    };
  });
  const columns = [
    ["model", (r) => r.name, "words"], [`${names.residual}, mm`, (r) => millimetres(r.fit)], [`${names.cross_validated}, mm`, (r) => millimetres(r.cv)],
    [`${names.workspace}, mm`, (r) => (r.band ? `${thousandths(r.expected)} (${thousandths(r.band[0])} to ${thousandths(r.band[1])})` : "–")],
    [`${names.not_fitted}, mean, mm`, (r) => thousandths(r.measured)], [`${names.not_fitted}, max, mm`, (r) => thousandths(r.largest)],
    [`${names.noise_left}, mm`, (r) => millimetres(r.noise)], ["χ²/dof", (r) => digits(r.chi2)],
  ].filter(([heading]) => !heading.startsWith(names.not_fitted) || rows.some((r) => Number.isFinite(r.measured)));
  const step = it.step && (it.step.objections.length
    ? element("p", {}, "Against adding ", with_id(report, it.step.effect), ": ", worded(report, it.step.objections.join("; "), new Set([it.step.effect])), ".")
    : element("p", {}, "Nothing speaks against adding ", with_id(report, it.step.effect), `: blocks that were not fitted are predicted better, and the error ${names.workspace} falls.`));
  return [
    element("figure", {}, picture, element("figcaption", {}, `Each line is a model, with what it leaves; bars are the 10 to 90 % band of what is expected and two standard errors of a measured mean, as of independent poses. Dashes: ${names.noise_left}. The calibrated model holds ${report.diagnosis.fitted.map((id) => in_words(report, [id])).join(" + ")}.`)),
    step,
    it.stopped?.tried?.length ? unfold("Steps that were refused", element("ul", {}, it.stopped.tried.map((t) => element("li", {}, with_id(report, t.effect), ": ", worded(report, t.objections.join("; "), new Set([t.effect])))))) : null,
    !it.complete && it.command && element("p", { class: "quiet" }, "This is the next step alone. ", element("code", {}, it.command), " climbs to the end."),
    unfold("The numbers of the ladder", table("Errors by model", columns, rows)),
  ];
}

// Few enough poses are drawn one by one.
const MOST_POSES = 120;

function by_pose(report) {
  const { by_pose: it, on, name } = report.drawn;
  if (!it?.before_mm?.length) return null;
  const poses = it.before_mm.map((before, k) => ({ before, after: it.after_mm[k] })).sort((a, b) => a.before - b.before);
  const better = poses.filter((p) => p.after < p.before).length;
  const whose = on === "validation" ? `poses that were not fitted` : "fitted poses";
  const share = (k) => (100 * (k + 0.5)) / poses.length;
  const few = poses.length <= MOST_POSES;
  const highest = ticks(Math.max(...poses.flatMap((p) => [p.before, p.after])));
  const label = `Position error of ${poses.length} ${whose}, before and after: ${better} of them are better after the calibration.`;
  const after = few ? poses.map((p) => p.after) : poses.map((p) => p.after).sort((a, b) => a - b);
  const picture = chart(label, 300, (theme) => ({
    grid: { left: 62, right: 20, top: 34, bottom: 44, outerBoundsMode: "none" },
    legend: { top: 0, left: 56, itemWidth: 11, itemHeight: 11, textStyle: { color: theme.ink, fontSize: 12 }, selectedMode: false },
    tooltip: tooltip(theme, ({ seriesName, value }) => `${seriesName}: ${thousandths(value[1])} mm${few ? "" : `\nat most, in ${fixed(value[0], 0)} % of the poses`}`),
    xAxis: axis(theme, few ? "poses, by their error before" : "share of the poses, %", 27, { min: 0, max: few ? poses.length + 1 : 100, splitLine: { show: false }, ...(few && { axisLabel: { show: false } }) }),
    yAxis: axis(theme, "position error, mm", 46, { min: 0, max: highest[0], interval: highest[1], scale: false }),
    series: [
      few && { type: "custom", silent: true, data: poses.map((p, k) => [k + 1, p.before, p.after]), encode: { x: 0, y: [1, 2] },
        renderItem: (_, api) => {
          const [x, y1] = api.coord([api.value(0), api.value(1)]);
          const [, y2] = api.coord([api.value(0), api.value(2)]);
          return { type: "line", shape: { x1: x, y1, x2: x, y2 }, style: { stroke: api.value(2) > api.value(1) ? theme.candidate : theme.rule, lineWidth: 2 } };
        } },
      ...[[`before (${name})`, poses.map((p) => p.before), "circle", "other"], ["after (calibrated)", after, "rect", "measured"]].map(([series, values, symbol, colour]) => ({
        name: series, type: few ? "scatter" : "line", symbol, symbolSize: 6, showSymbol: few, itemStyle: { color: theme[colour] }, lineStyle: { color: theme[colour], width: 2.4 },
        data: values.map((mm, k) => [few ? k + 1 : share(k), mm]),
      })),
    ].filter(Boolean),
  }));
  const chosen = poses.length < it.of ? ` Of ${it.of} poses ${poses.length} are drawn, evenly.` : "";
  const worse = poses.length - better;
  return [element("figure", {}, picture, element("figcaption", {},
    `${better} of ${poses.length} ${whose} are nearer to where they should be after the calibration${worse ? `, ${worse} are farther` : ""}.${few ? "" : " Each curve is sorted by itself: the error that so many of the poses do not exceed."}${chosen}`))];
}
