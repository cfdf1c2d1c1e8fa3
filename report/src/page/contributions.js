// @ts-check
// To what the residual goes when everything is fitted at once.

import { chart } from "./drawing.js";
import { named } from "./elements.js";
import { axis, categories, grid, tooltip } from "./options.js";
import { digits, percent } from "./text.js";

/**
 * @param {Report} report
 * @param {Contribution[]} most
 */
export function contributionChart(report, most) {
  const names = most.map((c) => named(report, c.effect));
  const first = most.slice(0, 5).map((c, k) => `${names[k]} ${percent(c.share)}`);
  /** @param {Item} item */
  const say = ({ dataIndex }) => {
    const { effect, share, size_plausible: size } = most[dataIndex];
    return `${names[dataIndex]} (${effect})\n${digits(100 * share)} % of the residual\n${digits(size)} plausible sizes`;
  };
  return chart(`Contributions, largest first: ${first.join(", ")}`, 60 + 22 * most.length, (theme, width) => {
    const room = Math.min(330, 0.42 * width);
    const label = { color: theme.ink, fontSize: 12, width: room, overflow: "truncate", interval: 0 };
    return {
      grid: grid(room + 13, 46, 6, 44),
      tooltip: tooltip(theme, say),
      xAxis: axis(theme, "share of what all explain, %", 27, { min: 0 }),
      yAxis: categories(names, label, { inverse: true, axisLine: { lineStyle: { color: theme.noise } } }),
      series: [
        {
          type: "bar",
          data: most.map((c) => 100 * c.share),
          barWidth: "62%",
          itemStyle: { color: theme.residual },
          label: {
            show: true,
            position: "right",
            color: theme.ink,
            fontSize: 11,
            formatter: (/** @type {{ value: number }} */ { value }) => digits(value, 2),
          },
        },
      ],
    };
  });
}
