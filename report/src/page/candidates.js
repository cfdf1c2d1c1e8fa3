"use strict";
// What may be missing: the candidates of the diagnosis.

// Rows that are read at once; the rest is folded away.
const FIRST_CANDIDATES = 6;

function ranking(report) {
  const { diagnosis: d } = report;
  const implausible = new Map((d.not_believable ?? []).map((u) => [u.effect, u.size_plausible]));
  const impossible = new Set(report.calibration.parameters.filter((p) => p.warning).map((p) => p.name));
  const looked_at = new Map((report.candidates ?? []).map((c) => [c.effect, c]));
  const size = (f, most) => {
    const shown = f.parameters.slice(0, most);
    const alike = shown.every((p) => p.unit === shown[0].unit);
    const one = (p) => `${p.name} ${digits(p.value)} ± ${digits(p.sigma, 2)}${alike ? "" : ` ${printed(p.unit)}`}`;
    const more = f.parameters.length > most ? `, and ${f.parameters.length - most} more` : "";
    return shown.map(one).join(", ") + (alike && shown.length ? ` ${printed(shown[0].unit)}` : "") + more;
  };
  const doubts = (f) => [
    implausible.has(f.effect) ? `${digits(f.size_plausible, 2)} times its plausible size: not believable` : null,
    ...(looked_at.get(f.in_model)?.symptoms ?? []).filter((s) => !impossible.has(s.parameter)).map((s) => `In the model with it, ${s.words}`),
  ].filter(Boolean);
  const name = (f) => [capital(named(report, f.in_model)), " ", element("code", {}, f.in_model), doubts(f).map((text) => element("div", { class: "warning flag" }, worded(report, capital(text))))];
  const columns = [
    ["effect", name, "words wide"], ["probability", (f) => share(f.probability)], ["explains", (f) => share(f.explains)], ["visible", (f) => share(f.visible)],
    ["gain", (f) => percent(f.cv_gain)], ["as it would be fitted", (f) => size(f, 2), "words"],
  ];
  const credible = (f) => (d.set95.includes(f.effect) ? "emphasis" : null);
  const [first, rest] = [d.findings.slice(0, FIRST_CANDIDATES), d.findings.slice(FIRST_CANDIDATES)];
  const more = [
    ["effect", (f) => [capital(named(report, f.in_model)), " ", element("code", {}, f.in_model)], "words"], ["what it is", (f) => report.meanings[f.in_model]?.what ?? "", "words"],
    ["where to look", (f) => [report.meanings[f.in_model]?.look, report.meanings[f.in_model]?.gallery && element("div", { class: "quiet" }, `picture in ${report.meanings[f.in_model].gallery}`)].filter(Boolean), "words"], ["in these data the same as", (f) => f.rivals.map((id) => named(report, id)).join("; ") || "–", "words"],
    ["as it would be fitted", (f) => size(f, 3), "words"],
  ];
  const contributions = d.contributions.slice(0, 10);
  return [
    element("p", {}, `Probability that nothing is missing beyond the usual model discrepancy: ${percent(d.nothing_probability)}.`,
      d.set95.length ? [" In the 95 % credible set: ", d.set95.flatMap((id, k) => [k ? "; " : "", ...with_id(report, id)]), "."] : ""),
    first.length ? table("Effects of the catalogue, most credible first", columns, first, credible) : null,
    element("p", { class: "quiet" }, "Explains: share of the squares left that it takes. Visible: share of the effect that shows in these residuals at all; the rest hides in wrong parameters and comes out elsewhere. Gain: how much the residual of blocks that were not fitted falls (cross-validation)."),
    rest.length ? unfold(`${rest.length} less credible candidates`, table("Less credible candidates", columns, rest, credible)) : null,
    d.findings.length ? unfold("What each of them is, where to look, and what imitates it", table("The candidates", more, d.findings, credible), true) : null,
    contributions.length ? [element("h3", {}, "What contributes most when everything is fitted at once"), element("figure", {}, contribution_chart(report, contributions))] : null,
    heat_map(report),
  ].flat(2);
}

// Which joint's error follows which variable.
function heat_map({ diagnosis: d }) {
  const map = d.heat_map.cells;
  const plain = (variable) => variable.replace(/[() ]/g, "");
  const variables = [...new Set(map.map((c) => plain(c.against)))];
  const joints = [...new Set(map.map((c) => c.joint))];
  const most = Math.max(3, ...map.map((c) => c.ln_evidence_against_background));
  return map.length ? [
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
}
