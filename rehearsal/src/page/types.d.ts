// The document of a rehearsal; see page.rs.

interface Gap {
  body: string;
  other: string;
  gap_mm: number;
  /** Index of the motion. */
  motion: number;
}

interface Motion {
  pose: string;
  /** True if it is made only in case. */
  spare: boolean;
  ball: string;
  phase: string;
  joints_deg: number[];
  tcp_mm: number[];
  gap_mm: number | null;
  between: [string, string] | null;
  wrong: string | null;
  /** Index of its last picture. */
  end: number;
}

/** A body of the arm, in the axes of frame `frame`, or of the cell, in the world; mm. */
interface SolidBody {
  name: string;
  frame: number | null;
  capsule?: { ends: [from: number[], to: number[]]; radius: number };
  box?: { centre: number[]; half: number[] };
}

interface Rehearsal {
  cell: string;
  plan: string;
  robot: string;
  is_clear: boolean;
  verdict: string;
  warnings: string[];
  facts: [name: string, value: string][];
  gaps: Gap[];
  motions: Motion[];
  bodies: SolidBody[];
  is_bare: boolean;
  /** Of each frame its origin, mm, and its quaternion (w, x, y, z) in 1e-4. */
  pictures: number[][];
  tcp_mm: [x: number, y: number, z: number][];
  unchecked: string[];
}
