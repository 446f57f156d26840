// The table of runs, as the views of a sweep ask for it.

import { Cell, SweepPayload } from './payload';
import { Estimate, estimateMean, estimateShare } from './statistics';

/** 1 if the run succeeded, 0 otherwise: the one figure that every run has. */
export const SUCCESS = 'succeeded';

/** Figures of which more is better; of the others that are named, less. */
const MORE_IS_BETTER = [
  SUCCESS, 'coverage.area_fraction', 'coverage.surface_fraction', 'clearance.min_m', 'clearance.p05_m',
  'battery.remaining_fraction', 'real_time_factor',
];
const LESS_IS_BETTER = [
  'sim_time_s', 'distance_m', 'collisions', 'coverage.t50_s', 'coverage.t90_s', 'coverage.t95_s',
  'coverage.revisit_ratio', 'map.median_m', 'map.p95_m', 'map.outlier_fraction', 'odometry.ate_rmse_m',
  'odometry.ate_max_m', 'odometry.ate_se3_rmse_m', 'odometry.yaw_error_max_deg', 'odometry.rpe_1m_m',
  'odometry.lost_s', 'planner.failures', 'planner.median_ms', 'planner.p99_ms', 'tracking.rmse_m',
  'battery.used_wh',
];

export function betterSign(figure: string): number {
  return MORE_IS_BETTER.includes(figure) ? 1 : LESS_IS_BETTER.includes(figure) ? -1 : 0;
}

/** Numbers by value, and so what is text but all digits, as seeds are. */
export function compare(a: Cell, b: Cell): number {
  if (typeof a === 'number' && typeof b === 'number') return a - b;
  return String(a).localeCompare(String(b), 'en', { numeric: true });
}

/** A key with more values than this is drawn in ranges: a sample, not a grid. */
const MAX_LEVELS = 12;
const RANGES = 8;

export class Results {
  /** Keys whose values stand for ranges, by the ranges' middles. */
  readonly ranged: string[] = [];
  private levelOf = new Map<string, Cell[]>();
  /** Keys with more than one value. */
  readonly factors: string[];
  /** Columns that hold numbers which are not all the same, and success. */
  readonly figures: string[];

  constructor(readonly payload: SweepPayload) {
    for (const key of payload.keys) this.levelOf.set(key, this.groupedValues(key));
    this.factors = payload.keys.filter((key) => this.levels(key).length > 1);
    const others = payload.columns.slice(payload.keys.length);
    const numeric = others.filter((name) => {
      if (name === 'seed' || name === 'repeat') return false;
      const values = payload.rows.map((_row, i) => this.cell(i, name)).filter((cell) => cell !== null);
      return values.length > 0 && values.every((cell) => typeof cell === 'number');
    });
    this.figures = [SUCCESS, ...numeric];
  }

  cell(row: number, column: string): Cell {
    return this.payload.rows[row][this.payload.columns.indexOf(column)] ?? null;
  }

  value(row: number, figure: string): number | null {
    if (figure === SUCCESS) return this.cell(row, 'outcome') === 'succeeded' ? 1 : 0;
    const cell = this.cell(row, figure);
    return typeof cell === 'number' ? cell : null;
  }

  /** Each row's value of a key, or the middle of its range. */
  private groupedValues(key: string): Cell[] {
    const cells = this.payload.rows.map((_row, i) => this.cell(i, key));
    const numbers = cells.filter((cell) => typeof cell === 'number');
    if (numbers.length < cells.length || new Set(numbers).size <= MAX_LEVELS) return cells;
    this.ranged.push(key);
    const low = numbers.reduce((a, b) => Math.min(a, b));
    const width = (numbers.reduce((a, b) => Math.max(a, b)) - low) / RANGES;
    return numbers.map((value) => {
      const range = Math.min(RANGES - 1, Math.floor((value - low) / width));
      return Number((low + (range + 0.5) * width).toPrecision(4));
    });
  }

  /** The values of a key, in order. */
  levels(key: string): Cell[] {
    const seen = new Map((this.levelOf.get(key) ?? []).map((cell) => [String(cell), cell]));
    return [...seen.values()].sort(compare);
  }

  /** Rows that hold these values. */
  where(values: Record<string, Cell>): number[] {
    return this.payload.rows
      .map((_row, i) => i)
      .filter((i) => Object.entries(values).every(([key, value]) => this.levelOf.get(key)?.[i] === value));
  }

  estimate(rows: number[], figure: string): Estimate {
    const values = rows.map((i) => this.value(i, figure)).filter((value) => value !== null);
    return figure === SUCCESS ? estimateShare(values) : estimateMean(values);
  }

  /** Every combination of the factors' values that was flown. */
  configurations(): { name: string; values: Record<string, Cell> }[] {
    const found = new Map<string, Record<string, Cell>>();
    this.payload.rows.forEach((_row, i) => {
      const values = Object.fromEntries(this.factors.map((key) => [key, this.levelOf.get(key)![i]]));
      const name = this.factors.map((key) => `${shortKey(key)} ${values[key] ?? '–'}`).join(', ');
      if (!found.has(name)) found.set(name, values);
    });
    return [...found].map(([name, values]) => ({ name, values }));
  }
}

/** The last part of a dotted key. */
export function shortKey(key: string): string {
  return key.slice(key.lastIndexOf('.') + 1);
}
