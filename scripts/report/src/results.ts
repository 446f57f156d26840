// The table of runs, as the views of a sweep ask for it.

import { Cell, FigureInfo, SweepPayload } from './payload';
import { Estimate, estimateMean, estimateShare } from './statistics';

/** 1 if the run succeeded, 0 otherwise: the one figure of all runs that were flown. */
export const SUCCESS = 'succeeded';

const SUCCESS_INFO: FigureInfo = { label: 'succeeded', unit: '1', better: 1, main: true };

/** What was not flown to an end of its own is neither a success nor a failure. */
const NOT_FLOWN = ['missing', 'refused', 'unfinished', 'interrupted'];

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
  /** Success, and the columns that hold numbers of runs that succeeded. */
  readonly figures: string[];

  constructor(readonly payload: SweepPayload) {
    for (const key of payload.keys) this.levelOf.set(key, this.groupedValues(key));
    this.factors = payload.keys.filter((key) => this.levels(key).length > 1);
    const others = payload.columns.slice(payload.keys.length);
    const numeric = others.filter((name) => {
      if (name === 'seed' || name === 'repeat') return false;
      const cells = payload.rows.map((_row, i) => this.cell(i, name)).filter((cell) => cell !== null);
      return cells.every((cell) => typeof cell === 'number') && payload.rows.some((_row, i) => this.value(i, name) !== null);
    });
    this.figures = [SUCCESS, ...numeric];
  }

  cell(row: number, column: string): Cell {
    return this.payload.rows[row][this.payload.columns.indexOf(column)] ?? null;
  }

  rows(): number[] {
    return this.payload.rows.map((_row, i) => i);
  }

  succeeded(row: number): boolean {
    return this.cell(row, 'outcome') === 'succeeded' && !this.cell(row, 'failure');
  }

  /** Whether the run says anything about success. */
  private flown(row: number): boolean {
    return ![this.cell(row, 'failure'), this.cell(row, 'outcome')].some((cell) => NOT_FLOWN.includes(String(cell)));
  }

  /** How many of the runs succeeded: those whose figures are compared. */
  successes(rows: number[]): string {
    return `${rows.filter((row) => this.succeeded(row)).length} of ${rows.length}`;
  }

  /** Null where the run has none; of a flight that failed no figure is comparable. */
  value(row: number, figure: string): number | null {
    if (figure === SUCCESS) return this.flown(row) ? Number(this.succeeded(row)) : null;
    const cell = this.cell(row, figure);
    return typeof cell === 'number' && this.succeeded(row) ? cell : null;
  }

  info(figure: string): FigureInfo {
    if (figure === SUCCESS) return SUCCESS_INFO;
    return this.payload.figures[figure] ?? { label: figure, unit: '', better: 0, main: false };
  }

  /** By what a figure is multiplied to be shown in `unit`: shares are shown in percent. */
  display(figure: string): { factor: number; unit: string } {
    const { unit } = this.info(figure);
    return unit === '1' ? { factor: 100, unit: '%' } : { factor: 1, unit };
  }

  /** In words, with its unit. */
  title(figure: string): string {
    const { unit } = this.display(figure);
    return this.info(figure).label + (unit === '' ? '' : `, ${unit}`);
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

  estimate(rows: number[], figure: string, confidence = 0.95): Estimate {
    const { factor } = this.display(figure);
    const values = rows.map((i) => this.value(i, figure)).filter((value) => value !== null);
    return figure === SUCCESS ? scaled(estimateShare(values, confidence), factor)
      : estimateMean(values.map((value) => factor * value), confidence);
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

export function scaled(estimate: Estimate, factor: number): Estimate {
  const { n, values, mean, low, high } = estimate;
  return { n, values: values.map((value) => factor * value), mean: factor * mean, low: factor * low, high: factor * high };
}

/** The last part of a dotted key. */
export function shortKey(key: string): string {
  return key.slice(key.lastIndexOf('.') + 1);
}
