// What sim/report/payload.cpp writes, read back.

/** value = lo + level / 65534 * (hi - lo); level 65535 is a missing value. */
export interface Quantised {
  n: number;
  lo: number;
  hi: number;
  data: string;
}

const MISSING = 65535;

async function inflate(base64: string): Promise<Uint8Array> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The numbers; NaN where one is missing. */
export async function decode(q: Quantised): Promise<Float64Array> {
  const values = new Float64Array(q.n);
  if (q.n === 0) return values;
  const bytes = await inflate(q.data);
  const scale = (q.hi - q.lo) / (MISSING - 1);
  let level = 0;
  for (let i = 0; i < q.n; ++i) {
    level = (level + bytes[i] + 256 * bytes[q.n + i]) & 0xffff;
    values[i] = level === MISSING ? NaN : q.lo + level * scale;
  }
  return values;
}

export type Columns = Record<string, Float64Array>;

/** Every column of a record of columns. */
export async function decodeAll(columns: Record<string, Quantised>): Promise<Columns> {
  const decoded: Columns = {};
  for (const [name, column] of Object.entries(columns)) decoded[name] = await decode(column);
  return decoded;
}

export interface Track {
  t: Float64Array;
  x: Float64Array;
  y: Float64Array;
  z: Float64Array;
  yaw: Float64Array;
}

export interface RunPayload {
  kind: 'run';
  duration_s: number;
  flight: Record<string, Quantised>;
  coverage: Record<string, Quantised>;
  tracks: Record<'truth' | 'estimate', Record<string, Quantised> | null>;
  cloud: {
    total: number;
    points: Record<'x' | 'y' | 'z', Quantised>;
    /** The first `count[i]` points were there at `t[i]`; empty: not recorded. */
    growth: { t: number[]; count: number[] };
  };
  targets: { t: number; x: number; y: number; z: number; reached: boolean }[];
  /** Candidates [first[i], first[i + 1]) belong to the decision at t[i]. */
  decisions: { t: number[]; first: number[]; x: Quantised; y: Quantised; verdict: string };
}

export type Cell = string | number | null;

/** One of figure_list() in sim/scoring. */
export interface FigureInfo {
  label: string;
  unit: string;
  /** 1: more is better; -1: less is; 0: neither. */
  better: number;
  main: boolean;
}

/** Runs laid over each other, on axes that they share. */
export interface OverlayPayload {
  /** The colours' names: of runs, or of configurations with several runs each. */
  groups: string[];
  /** Those without a colour as well. */
  all_groups: number;
  axes: Record<'time_s' | 'distance_m', { end: number; steps: number }>;
  runs: ({ title: string; group: number } & Record<'time_s' | 'distance_m', Record<string, Quantised>>)[];
}

export interface SweepPayload {
  kind: 'sweep';
  /** What is known of the columns that are figures. */
  figures: Record<string, FigureInfo>;
  /** What varies beside the seed, first in the columns. */
  keys: string[];
  columns: string[];
  /** Seeds and hashes are texts, whatever their digits. */
  rows: Cell[][];
  /** What tells each run from the others. */
  titles: string[];
  /** Their folders' names. */
  runs: string[];
  /** Of each run's report or folder; empty if it is gone. */
  links: string[];
  overlay: OverlayPayload;
}

/** The last index whose t is not after `time`; -1 if there is none. */
export function indexAt(t: ArrayLike<number>, time: number): number {
  let lo = 0;
  let hi = t.length;
  while (lo < hi) {
    const middle = (lo + hi) >> 1;
    if (t[middle] <= time) lo = middle + 1;
    else hi = middle;
  }
  return lo - 1;
}
