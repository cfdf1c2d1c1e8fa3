// The program as WebAssembly, and what is said between the page and its workers.

/** The functions of the module; see `web/src`. Places and lengths are of its memory, bytes. */
interface Program {
  memory: WebAssembly.Memory;
  begin(): void;
  room(length: number): number;
  answer(): number;
  ask(length: number): number;
  take(): number;
  put(length: number): void;
  forget(): void;
  warm(): void;
  work(): number;
}

/** Functions that a program may wait for (JavaScript Promise Integration). */
declare namespace WebAssembly {
  const Suspending: (new (call: () => Promise<number>) => ImportValue) | undefined;
  function promising(call: (length: number) => number): (length: number) => Promise<number>;
}

/** A file that a visitor chose, with its path. */
interface NamedFile {
  path: string;
  file: File;
}

/** A file for the program. */
interface ProgramFile {
  name: string;
  file: File;
}

/** What a worker is asked. */
interface Question {
  id?: number;
  module?: WebAssembly.Module;
  /** The port to whom it helps. */
  helps?: MessagePort;
  isFirst?: boolean;
  /** The port to its helper. */
  helpedBy?: MessagePort | null;
  files?: ProgramFile[];
  what?: string | null;
  body?: object;
  /** Files that are to be handed out. */
  names?: string[];
}

/** What a worker answers. */
interface Reply {
  answer: Answer & { error?: string; field?: string; told?: object };
  taken: (Uint8Array<ArrayBuffer> | null)[];
  tookMs: number;
}

/** What it says. */
interface Said extends Partial<Reply> {
  id?: number;
  doing?: string;
  stopped?: string;
}

/** A question that waits for its turn. */
interface Job {
  what: string | null;
  body: object;
  files?: ProgramFile[];
  names?: string[];
  order: number;
  number: number;
  resolve(answer: Answer): void;
  reject(error: unknown): void;
}
