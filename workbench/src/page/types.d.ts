// What the workbench gets from the program, and how it reaches it.

/** The program behind the workbench: a server, or a worker of the page. */
interface Backend {
  /** Answers, or throws an error with the field of the page in error. */
  ask(what: string | null, body?: object): Promise<Answer>;
  /** Tells what is being done until the function that it returns is called. */
  follow(tell: (doing: string) => void): () => void;
  /** True if a question can be cancelled. */
  canCancel(what: string): boolean;
  /** Ends the action that is waited for, whose question then throws. */
  cancel(): void;
  /** Does what remains to be done with files that were written. */
  saved(answer: Answer): void;
  /** Calls `open` whenever other data are open. */
  begin(open: () => Promise<void>): void;
}

/** What went wrong, and where on the page. */
interface Mistake extends Error {
  field?: string;
  /** By the user. */
  cancelled?: boolean;
  /** Why the program ended for good. */
  stopped?: string;
  told?: { guess?: Guess };
}

/** How a table was understood. */
interface Guess {
  reasons: string[];
  rows: string[];
  map: string;
}

/** What was opened, or measured. */
interface Opened {
  guess?: Guess | null;
  scenario?: string | null;
  effect?: string | null;
  times?: number | null;
  hidden?: string | null;
  import?: string | null;
  samples: number;
  validation: number;
  robot: string;
  nominal: string[];
  misfit?: string | null;
  warnings: string[];
}

/** An effect that can be switched on and off. */
interface Switch {
  asked: string;
  words: string;
  on: boolean;
  initial?: boolean;
  flags: string[];
}

/** A switch as it is listed. */
interface Listed {
  effect: string;
  words: string;
  on: boolean;
  initial?: boolean;
  offered?: boolean;
  flags: string[];
}

/** What is on the workbench. */
interface Live {
  datasets: { name: string; samples: number; chosen: boolean }[];
  switches: Switch[];
  candidates?: string[] | null;
  sites: string[];
  can_undo: boolean;
  can_redo: boolean;
}

/** A proposal of measurements. */
interface Step {
  measurements: number;
  minutes: number;
  probability_of_truth: number | null;
  workspace_error_mm: number | null;
}

interface Proposal {
  best?: { measurements: number; action: string } | null;
  sentences: string[];
  actions: { action: string; steps: Step[] }[];
  not_offered: { action: string; because: string }[];
  cell_known: boolean;
}

/** What the program answers: every question has its own part of it. */
interface Answer {
  changed?: boolean;
  moved?: boolean;
  live: Live;
  document: Report;
  views: object;
  candidate: Candidate;
  telling: Telling;
  accepted?: boolean;
  added: string[];
  removed: string[];
  objections: string[];
  before: Rung;
  after: Rung;
  advice?: string;
  saved?: string;
  files: string[];
  next: Proposal;
  doing?: string;
  opened: Opened;
  robots: { name: string; joints: number }[];
  hidden: { effect: string; words: string }[];
  sizes: number[];
  /** As long as the page waited, ms. */
  tookMs: number;
  taken: (Uint8Array<ArrayBuffer> | null)[];
}

interface Ids {
  undo: HTMLButtonElement;
  redo: HTMLButtonElement;
  recommend: HTMLButtonElement;
  next: HTMLButtonElement;
  cancel: HTMLButtonElement;
  "save-model": HTMLButtonElement;
  "save-calibration": HTMLButtonElement;
  "save-urdf": HTMLButtonElement;
  "save-report": HTMLButtonElement;
  other: HTMLFormElement;
  own: HTMLFormElement;
  choice: HTMLFormElement;
  effect: HTMLInputElement;
  ways: HTMLDetailsElement;
  drop: HTMLFormElement;
  play: HTMLFormElement;
  files: HTMLInputElement;
  robot: HTMLSelectElement;
  hidden: HTMLSelectElement;
  times: HTMLSelectElement;
}
