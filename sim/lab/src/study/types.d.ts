// The document of `calibench sim study`, as far as its page shows it.

/** A quantile with the band in which it is known. */
interface Quantile {
  percent: number;
  value: number;
  low: number | null;
  high: number | null;
}

/** The name of a quantity of which a study keeps quantiles. */
type Quantity = "mean_mm" | "rms_mm" | "p95_mm" | "max_mm" | "std_mm" | "before_mean_mm" | "cell_s";

type StudyMethod = { [Q in Quantity]?: { quantiles: Quantile[] } | null } & {
  name: "trical" | "tracker";
  done: number;
  failed: Record<string, number>;
  coverage: { name: string; share: number; low: number; high: number; inside: number; of: number }[];
};

interface StudyPoint {
  at: Record<string, number | string>;
  methods: StudyMethod[];
}

interface Study {
  study: string;
  question?: string;
  seed: number;
  trials: number;
  axes?: string[];
  points?: StudyPoint[];
  methods: StudyMethod[];
}
