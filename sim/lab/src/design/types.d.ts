// The document of `calibench sim design`, as far as its page shows it.

interface Verified {
  trials: number;
  rms: Predicted;
  worst: Predicted;
}

interface Predicted {
  predicted_um: number;
  measured_um: number;
  band_um: [low: number, high: number];
}

interface Judged {
  name: string;
  balls: [id: string, centre_mm: [x: number, y: number, z: number]][];
  probings: number;
  worst_um: number;
  mean_um: number;
  mass_kg: number;
  size_mm: number[];
  verified?: Verified | null;
}

interface Design {
  name: string;
  question: string;
  seed: number;
  workspace_poses: number;
  places: [known: number, tried: number];
  best: Judged;
  compared: Judged[];
  front: { scale: number; judged?: Judged | null }[];
  map?: { centre_mm: [x: number, y: number, z: number]; worst_um: number | null }[] | null;
}
