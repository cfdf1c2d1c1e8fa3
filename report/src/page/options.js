// @ts-check
// Charts: the parts of which every chart of every page is made, as option objects of ECharts. What is drawn has been
// computed before.

/**
 * The frame of a chart, with this room about it, px.
 * @param {number} left
 * @param {number} right
 * @param {number} top
 * @param {number} bottom
 */
export const grid = (left, right, top, bottom) => ({ left, right, top, bottom, outerBoundsMode: "none" });

/**
 * @param {Theme} theme
 * @param {string} name
 * @param {number} gap between the axis and its name, px
 * @param {Option} more
 * @returns {Option}
 */
export const axis = (theme, name, gap, more = {}) => ({
  type: "value",
  name,
  nameLocation: "middle",
  nameGap: gap,
  scale: true,
  nameTextStyle: { color: theme.quiet, fontSize: 12 },
  axisLine: { show: true, lineStyle: { color: theme.noise } },
  axisTick: { show: false },
  axisLabel: { color: theme.quiet, fontSize: 11, hideOverlap: true },
  splitLine: { lineStyle: { color: theme.grid } },
  splitNumber: 4,
  ...more,
});

/**
 * The line of an axis that stays at the edge of the chart.
 * @param {Theme} theme
 */
export const edge = (theme) => ({ axisLine: { show: true, onZero: false, lineStyle: { color: theme.noise } } });

// An axis without lines across the chart.
export const plain = { splitLine: { show: false } };

/**
 * An axis of names, without a line.
 * @param {string[]} data
 * @param {Option} axisLabel
 * @param {Option} more
 * @returns {Option}
 */
export const categories = (data, axisLabel, more = {}) => ({
  type: "category",
  data,
  axisLabel,
  axisTick: { show: false },
  axisLine: { show: false },
  ...more,
});

/**
 * @param {Theme} theme
 * @param {(item: Item) => string} formatter
 */
export const tooltip = (theme, formatter) => ({
  trigger: "item",
  renderMode: "richText",
  confine: true,
  backgroundColor: theme.panel,
  borderColor: theme.rule,
  textStyle: { color: theme.ink, fontSize: 12 },
  formatter,
});

/**
 * @param {Theme} theme
 * @param {Option} more
 * @returns {Option}
 */
export const legend = (theme, more) => ({
  top: 0,
  itemWidth: 11,
  itemHeight: 11,
  textStyle: { color: theme.ink, fontSize: 12 },
  selectedMode: false,
  ...more,
});

/**
 * Points of the residual.
 * @param {Theme} theme
 * @param {unknown[]} data
 * @returns {Option}
 */
export const residualPoints = (theme, data, size = 5) => ({
  name: "residual",
  type: "scatter",
  symbol: "circle",
  symbolSize: size,
  data,
  itemStyle: { color: theme.residual, opacity: 0.65 },
});

/**
 * Points of what a candidate would take of the residual.
 * @param {Theme} theme
 * @param {unknown[]} data
 * @returns {Option}
 */
export const candidatePoints = (theme, data, size = 8) => ({
  name: "candidate",
  type: "scatter",
  symbol: "diamond",
  symbolSize: size,
  data,
  z: 4,
  itemStyle: { color: "transparent", borderColor: theme.candidate, borderWidth: 1.6 },
});

/**
 * A line at zero, as `markLine` of a series.
 * @param {Theme} theme
 */
export const zero = (theme) => ({
  silent: true,
  symbol: "none",
  label: { show: false },
  lineStyle: { color: theme.noise, type: "solid", width: 1 },
  data: [{ yAxis: 0 }],
});

/**
 * A straight line of what a series draws itself.
 * @param {[number, number]} from px
 * @param {[number, number]} to px
 * @param {Option} style
 * @returns {Shape}
 */
export const stroke = ([x1, y1], [x2, y2], style) => ({ type: "line", shape: { x1, y1, x2, y2 }, style });

/**
 * A rectangle of what a series draws itself.
 * @param {number} x px
 * @param {number} y px
 * @param {number} width px
 * @param {number} height px
 * @param {Option} style
 * @returns {Shape}
 */
export const rectangle = (x, y, width, height, style) => ({ type: "rect", shape: { x, y, width, height }, style });

// The number of a logarithmic or fine axis, without the digits that rounding leaves.
export const shortNumber = (/** @type {number} */ x) => String(Number(x.toPrecision(3)));
