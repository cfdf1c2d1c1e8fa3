// The libraries of the page, and how it is made. What the report holds is in document.d.ts.

/** The colours of the page; see page.css. */
type Theme = Record<
  | "ink"
  | "quiet"
  | "paper"
  | "panel"
  | "rule"
  | "grid"
  | "residual"
  | "candidate"
  | "predicted"
  | "measured"
  | "other"
  | "noise"
  | "mean",
  string
>;

/** A part of an option object of ECharts, whose own types would be four times as long as these scripts. */
type Option = Record<string, any>;

/** A graphic element that a custom series draws. */
type Shape = Option;

/** What ECharts passes to the functions that write tooltips and labels. */
interface Item {
  seriesName: string;
  dataIndex: number;
  value: any[];
  data: any[];
}

/** What ECharts passes to a custom series: places of values, px, and values of the row that is drawn. */
interface Api {
  coord(values: number[]): [x: number, y: number];
  value(dimension: number): number;
}

/** The row that a custom series draws, and where the chart lies, px. */
interface RowAt {
  coordSys: { x: number; width: number };
  dataIndex: number;
}

interface Chart {
  setOption(option: Option): void;
  on(event: "mouseover", heard: (item: { value?: unknown[] }) => void): void;
  convertToPixel(finder: object, value: number[]): [x: number, y: number];
  dispose(): void;
}

declare const echarts: {
  init(host: HTMLElement, theme: null, options: object): Chart;
  graphic: Record<
    "Group" | "Line" | "Text" | "Circle" | "Polygon" | "Polyline",
    new (options?: Option) => GraphicElement
  > & {
    extendShape(shape: object): new (options: Option) => GraphicElement;
  };
  zrender: { init(host: HTMLElement, options: object): { add(element: GraphicElement): void; dispose(): void } };
};

interface GraphicElement {
  add(element: GraphicElement): void;
  removeAll(): void;
}

/** Where a sample stands in a chart, and in which series. */
interface Point {
  x: number;
  y: number;
  name: string;
}

/** A chart of the page. */
interface Drawn {
  host: HTMLElement;
  height: number | ((width: number) => number);
  option?: (theme: Theme, width: number) => Option;
  /** Draws instead of ECharts. */
  paint?: (theme: Theme, width: number, height: number) => { dispose(): void };
  /** As it is drawn now. */
  chart: { dispose(): void; convertToPixel?: Chart["convertToPixel"] } | null;
  points?: Map<string, Point[]>;
  rings?: HTMLElement[];
}

/** Means of a bin, with one sigma. */
interface Bin {
  x: number;
  mean: number;
  sigma: number;
}

/** What can stand in an element; what is not there is left out. */
type Child = Node | string | false | null | undefined | readonly Child[];

/** A column of a table: its heading, the cell of a row, a class. */
type Column<R> = [heading: string, cell: (row: R) => Child, kind?: string];

/** Elements of the page that are more than an HTMLElement, by their id. */
interface Ids {
  theme: HTMLButtonElement;
}

type Named<K extends string> = K extends keyof Ids ? Ids[K] : HTMLElement;

/** A place of the eye in the view in space, angles in rad; the model whose arrows are drawn. */
interface ViewInSpace {
  azimuth: number;
  elevation: number;
  zoom: number;
  enlarged: number;
  model: number;
}

/** What the view in space shows, mm; arrows in µm. */
interface Scene {
  arms: number[][][];
  arrows: number[][][];
  longest: number;
  centre: number[];
  radius: number;
  floor: number;
  low: number[];
  high: number[];
  ids: string[];
  balls: (number[] | null)[];
}

/** A line of the picture of models, mm. */
interface ModelRow {
  name: string;
  nominal?: boolean;
  fit?: number | null;
  cv?: number | null;
  expected?: number | null;
  band?: [low: number, high: number] | null;
  measured?: number | null;
  reach?: [low: number, high: number] | null;
  largest?: number | null;
  noise?: number | null;
  chi2?: number | null;
}
