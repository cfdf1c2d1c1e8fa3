// @ts-check
// How the balls were centred.

import { chart } from "./drawing.js";
import { element, figure, table, unfold } from "./elements.js";
import { axis, grid, plain, shortNumber, tooltip } from "./options.js";
import { digits, fixed } from "./text.js";

// The indicators resolve a tenth of a micrometre, and a reading of zero has no logarithm.
const LEAST_READING_UM = 0.1;

/**
 * @param {Report} report
 * @returns {Child[] | null}
 */
export function centring({ campaign }) {
  if (!campaign?.length) return null;
  const centred = campaign.filter((c) => c.outcome === "centred");
  const failed = campaign.filter((c) => c.outcome !== "centred");
  const readings = Math.max(...campaign.map((c) => c.readings_um.length));
  const counts = Array.from({ length: readings }, (_, k) => k + 1).flatMap((n) => {
    const times = centred.filter((c) => c.readings_um.length === n).length;
    return times ? [`${times} in ${n} readings`] : [];
  });
  const ways = campaign.flatMap((c) => (typeof c.clearance_mm === "number" ? [{ ...c, mm: c.clearance_mm }] : []));
  ways.sort((a, b) => a.mm - b.mm);
  return [
    element("p", {}, `${centred.length} of ${campaign.length} probings centred; ${counts.join(", ")}.`),
    figure(
      picture([...centred, ...failed], readings),
      "Length of the three indicators’ reading at every stop on the ball: one line a probing. Each step takes away " +
        "what the reading says.",
    ),
    ways.length > 0 && clearances(ways),
    failed.length > 0 &&
      table(
        "Not centred",
        [
          ["probing", (c) => c.id, "words"],
          ["ball", (c) => c.ball, "words"],
          ["why", (c) => c.outcome, "words"],
          ["time, s", (c) => fixed(c.duration_s, 1)],
        ],
        failed,
      ),
  ];
}

/**
 * @param {Probing[]} probings
 * @param {number} readings the most of a probing
 */
function picture(probings, readings) {
  const most = `${probings.length} probings, at most ${readings} readings`;
  /** @type {(theme: Theme, c: Probing) => Option} */
  const line = (theme, c) => {
    const good = c.outcome === "centred";
    const color = good ? theme.residual : theme.candidate;
    return {
      type: "line",
      data: c.readings_um.map((r, k) => [k + 1, Math.max(r, LEAST_READING_UM), c.id]),
      symbol: good ? "circle" : "triangle",
      symbolSize: good ? 4 : 8,
      lineStyle: { color, width: good ? 1 : 2, opacity: good ? 0.35 : 1 },
      itemStyle: { color, opacity: good ? 0.5 : 1 },
    };
  };
  return chart(`Length of the reading at every stop on the ball, ${most}.`, 300, (theme) => ({
    grid: grid(66, 16, 12, 44),
    tooltip: tooltip(theme, ({ value }) => `${value[2]}\nreading ${value[0]}: ${digits(value[1])} µm`),
    xAxis: axis(theme, "reading on the ball", 27, { min: 1, max: Math.max(2, readings), interval: 1, ...plain }),
    yAxis: axis(theme, "off the centre, µm (logarithmic)", 48, {
      type: "log",
      axisLabel: { color: theme.quiet, fontSize: 11, formatter: shortNumber },
    }),
    series: probings.map((c) => line(theme, c)),
  }));
}

/** @param {(Probing & { mm: number })[]} ways the narrowest first */
function clearances(ways) {
  const [narrowest, median] = [ways[0], ways[Math.floor(ways.length / 2)]];
  const told =
    `Least clearance of the nominal arm on its planned ways: ${fixed(narrowest.mm, 1)} mm, on the way to ` +
    `${narrowest.id}; ${fixed(median.mm, 1)} mm in the median of ${ways.length} ways.`;
  const rows = table(
    "Ways, the narrowest first",
    [
      ["to probing", (c) => c.id, "words"],
      ["ball", (c) => c.ball, "words"],
      ["least clearance, mm", (c) => fixed(c.mm, 1)],
    ],
    ways,
  );
  return [element("p", {}, told), unfold("Least clearance of every way", rows)];
}
