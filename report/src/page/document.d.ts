// The document of a report, as far as the page shows it. `calibench report` writes it, and the workbench sends it part by
// part: `telling` and `residuals` come after all else.

/** The 10 to 90 % band of what is expected, mm. */
type ErrorBand = [low: number, high: number];

/** Effects in words, by their id. */
interface Worded {
  meanings: Record<string, { name: string; what: string; to_do: string[]; physics: string; gallery: string | null }>;
}

interface Report extends Worded {
  title: string;
  robot: string;
  question?: string | null;
  misfit?: string | null;
  masses?: string | null;
  commands_from?: string | null;
  verdict: {
    headline: string;
    means: string;
    effects: string[];
    symptoms: string[];
    warning?: string | null;
    expected?: string | null;
  };
  /** How the figures are called. */
  names: {
    residual: string;
    cross_validated: string;
    workspace: string;
    inside: string;
    over_limits: string;
    not_fitted: string;
    noise_left: string;
    unexplained: string;
  };
  figures: Figures;
  diagnosis: Diagnosis;
  ladder: Ladder;
  against?: Against | null;
  calibration: Calibration;
  comparison: { sentences: string[]; worst: WorstSample[] };
  validation?: JudgedErrors | null;
  workspace?: Workspace | null;
  /** The errors before the calibration and after it, at the same poses. */
  states?: States | null;
  judgement?: Judgement | null;
  /** The robot as drawn, judged on the same rows. */
  drawn: {
    name: string;
    on: "fit" | "validation";
    errors?: JudgedErrors | null;
    by_pose?: { before_mm: number[]; after_mm: number[]; of: number } | null;
  };
  candidates: Candidate[];
  residuals?: Residuals | null;
  telling?: Telling | null;
  run?: Run | null;
  campaign?: Probing[] | null;
  pictures?: { data: string; shows: string }[] | null;
  provenance: { program: string; charts: string; datasets: ReportedDataset[] };
}

/** A report in which the samples have been looked at. */
type WholeReport = Report & { residuals: Residuals };

interface Figures {
  residual_mm: number;
  noise_left_mm: number;
  noise_stated: boolean;
  unexplained_mm?: number | null;
  samples: number;
  expected?: Expected | null;
  validation?: JudgedErrors | null;
  disagreement?: string | null;
}

/** Errors in one state of the robot. */
interface StateErrors {
  mean_mm: number | null;
  p95_mm: number | null;
  max_mm: number | null;
  absent?: string | null;
  /** Poses in equal classes from zero to `classes_to_mm`. */
  counts?: number[];
  /** Poses that meet the tolerance, if one is stated. */
  met?: number | null;
}

interface States {
  held_out: boolean;
  judged: number;
  /** The largest error of all states, up to which the classes of their histograms go. */
  classes_to_mm?: number | null;
  /** The errors of measured orientations in words. */
  orientation?: string | null;
  as_delivered: StateErrors;
  nominal: StateErrors;
  calibrated: StateErrors;
  recommended: StateErrors;
}

/** How the robot was, how it is, and what to do, if the page is that of a calibration. */
interface Judgement {
  expected: { inside?: Expected | null; over_limits?: Expected | null };
  next: string[];
  tolerance_mm?: number | null;
}

interface Expected {
  mean_mm: number;
  mean_band_mm: ErrorBand;
  max_mm: number;
  at_least?: boolean;
  map?: ErrorMap | null;
}

/** Mean errors by distance from axis 1 and height; edges of the cells, and a row of cells for each height. */
interface ErrorMap {
  radius_mm: number[];
  height_mm: number[];
  cells: ({ mean_mm: number; poses: number } | null)[][];
}

interface Workspace {
  radius_mm: number[];
  height_mm: number[];
  measured?: ErrorMap["cells"] | null;
}

/** Position errors over poses. */
interface Errors {
  samples: number;
  mean_mm: number;
  max_mm: number;
  std_mm: number;
  rms_mm: number;
}

interface JudgedErrors extends Errors {
  quantiles_mm: Record<string, number>;
  histogram: { from_mm: number; to_mm: number; count: number }[];
  refitted: string[];
  from_fit_rows: string[];
}

/** What the paper prints of its robot. */
interface PaperErrors {
  mean_mm: number;
  max_mm: number;
  std_mm: number;
}

interface Diagnosis {
  sentences: string[];
  fitted: string[];
  findings: Finding[];
  set95: string[];
  nothing_probability: number;
  contributions: Contribution[];
  not_believable?: { effect: string; size_plausible: number }[];
  heat_map: { cells: HeatCell[]; best?: { joint: number; against: string } | null };
}

interface HeatCell {
  joint: number;
  against: string;
  ln_evidence_against_background: number;
}

/** A parameter as it would be fitted. */
interface Estimate {
  name: string;
  value: number;
  sigma: number;
  unit: string;
}

interface Finding {
  effect: string;
  /** Its id in a model. */
  in_model: string;
  probability: number;
  explains: number;
  visible: number;
  cv_gain: number;
  size_plausible: number;
  rivals: string[];
  parameters: Estimate[];
}

interface Contribution {
  effect: string;
  share: number;
  size_plausible: number;
}

/** A model of the ladder. */
interface Rung {
  added?: string[];
  removed?: string[];
  residual_mm: number;
  cross_validated_mm?: number | null;
  noise_left_mm?: number | null;
  chi2_per_dof?: number | null;
  workspace?: { mean_mm: number; mean_band_mm: ErrorBand } | null;
  validation?: Errors | null;
}

interface Objections {
  effect: string;
  objections: string[];
}

interface Ladder {
  rungs: Rung[];
  other?: Rung | null;
  recommended?: { kind: string } | null;
  step?: Objections | null;
  stopped?: { tried?: Objections[] | null } | null;
  advice?: string | null;
  complete: boolean;
  command?: string | null;
}

interface Parameter extends Estimate {
  nominal: number;
  warning?: string | null;
}

interface StatedParameter extends Parameter {
  stated_sigma: number;
}

interface JointRange {
  joint: number;
  identified_deg: [low: number, high: number];
  limits_deg: [low: number, high: number];
}

interface Calibration {
  robot: string;
  samples: number;
  rank: number;
  dof: number;
  residual_mm: number;
  chi2_per_dof: number | null;
  noise_stated: boolean;
  condition: number;
  effects: string[];
  parameters: Parameter[];
  stated_parameters: StatedParameter[];
  /** A row for each parameter. */
  correlation: number[][];
  observability: { O1: number; O2: number; O3: number; O4: number; O5: number };
  unresolved_sentences: string[];
  joint_ranges: JointRange[];
}

/** What an effect that is not in the model would take of the residuals. */
interface Candidate {
  effect: string;
  rms_after_mm: number;
  /** By joint and sample; null where the joint turns nothing that is measured. */
  angles_urad: (number | null)[][];
  /** By view and bin. */
  of_views_urad: number[][];
  /** By sample. */
  takes_um: number[][];
  phase?: { joint: number; order: number; x_deg: number[] } | null;
  symptoms: { parameter: string; words: string }[];
  /** The picture of it, in the workbench. */
  telling?: Telling;
}

interface Curve {
  joint: number;
  against: string;
  unit: string;
  at: number[];
  mean_urad: number[];
  sigma_urad: number[];
  x?: (number | null)[] | null;
}

/** The key residual plot; `candidate` is a place in the list of them. */
type Telling = { candidate: number | null; sample?: string } & (
  | { kind: "phase" | "agreement" | "balls" | "contributions" | "samples" }
  | { kind: "view"; view: number }
  | ({ kind: "curve" } & Curve)
);

interface Sample {
  id: string;
  number: number;
  /** A place in the list of balls. */
  ball: number | null;
  time_s: number | null;
  residual_um: number[];
  length_um: number;
}

interface Ball {
  dataset: string;
  ball: string;
  mean_um: number[];
  sigma_um: number[];
}

/** Apparent errors of a joint over a variable. */
interface View {
  joint: number;
  against: string;
  what: string;
  unit: string;
  x: (number | null)[];
  bins: { x: number; mean_urad: number; sigma_urad: number }[];
  test: { p_family: number; explains: number };
}

/** A region of a map: from and to along both axes, mm; the mean, mm; how many. */
type Cell = [x0: number, x1: number, y0: number, y1: number, mean_mm: number, count: number];

interface Maps {
  side: Cell[];
  top: Cell[];
}

/** The arm at each sample, as a flat list of points, and the residual there. */
interface Space {
  arms_mm: number[][];
  arrows_um: number[][];
  balls_mm: (number[] | null)[];
  maps: Maps;
}

interface Residuals {
  samples: Sample[];
  /** Of which these are drawn. */
  of: number;
  balls: Ball[];
  views: View[];
  /** By joint and sample. */
  angles_urad: (number | null)[][];
  space?: Space | null;
}

interface WorstSample {
  id: string;
  residual_um: number[];
  norm_um: number;
  normalised: number;
  special: string[];
}

/** The errors of two models on the same poses. */
interface Paired {
  poses: number;
  a_mm: number[];
  b_mm: number[];
  better?: string | null;
  better_at: number;
  mean_errors_mm: number[];
  two_errors_mm: number;
}

/** Another model of the same data. */
interface Against {
  names: [a: string, b: string];
  effects: [a: string[], b: string[]];
  in_words: Record<string, string>;
  sentence: string;
  figures: Figures;
  rung: Rung;
  parameters: Parameter[];
  paired?: Paired | null;
  views: View[];
  /** The length by sample. */
  residual_um: number[];
  arrows_um?: number[][] | null;
  maps?: Maps | null;
}

interface Run {
  scenario?: string | null;
  seed?: number | null;
  plant?: string | null;
  paper?: Record<string, PaperErrors> | null;
  methods?: { name: string; validation: JudgedErrors; score?: { name: string; truth: number }[] | null }[] | null;
  expect?: {
    met: boolean;
    checks: { name: string; value: number; band: [low: number, high: number]; met: boolean }[];
  } | null;
}

interface Probing {
  id: string;
  ball: string;
  outcome: string;
  readings_um: number[];
  clearance_mm?: number | null;
  duration_s: number;
}

interface ReportedDataset {
  name: string;
  fit_rows: number;
  validation_rows: number;
  sha256: string;
  stated: Record<string, string | number>;
}
