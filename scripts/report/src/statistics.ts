// Means with what is known about them.

/** Two-sided 95 % quantiles of Student's t by degrees of freedom, from 1. */
const T_95 = [
  12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.16, 2.145, 2.131,
  2.12, 2.11, 2.101, 2.093, 2.086, 2.08, 2.074, 2.069, 2.064, 2.06, 2.056, 2.052, 2.048, 2.045, 2.042,
];
const Z_95 = 1.95996;

/** Fewer values than this are shown as they are: an interval from two says next to nothing. */
export const LEAST_FOR_INTERVAL = 3;

export interface Estimate {
  n: number;
  values: number[];
  mean: number;
  /** 95 % confidence interval; NaN where the values are too few to tell. */
  low: number;
  high: number;
}

function quantile(freedom: number): number {
  // Beyond the table, Cornish and Fisher's first term.
  return T_95[freedom - 1] ?? Z_95 * (1 + (Z_95 * Z_95 + 1) / (4 * freedom));
}

/** Mean of independent values and its interval after Student. */
export function estimateMean(values: number[]): Estimate {
  const n = values.length;
  const mean = values.reduce((sum, value) => sum + value, 0) / n;
  if (n < LEAST_FOR_INTERVAL) return { n, values, mean, low: NaN, high: NaN };
  const variance = values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / (n - 1);
  const half = quantile(n - 1) * Math.sqrt(variance / n);
  return { n, values, mean, low: mean - half, high: mean + half };
}

/** A share of yes and no, with Wilson's interval. */
export function estimateShare(values: number[]): Estimate {
  const n = values.length;
  const mean = values.reduce((sum, value) => sum + value, 0) / n;
  if (n < LEAST_FOR_INTERVAL) return { n, values, mean, low: NaN, high: NaN };
  const z2 = Z_95 * Z_95;
  const centre = (mean + z2 / (2 * n)) / (1 + z2 / n);
  const half = (Z_95 / (1 + z2 / n)) * Math.sqrt((mean * (1 - mean)) / n + z2 / (4 * n * n));
  return { n, values, mean, low: centre - half, high: centre + half };
}

/** How much larger share b is than share a, with Newcombe's interval: that of both Wilson's. */
export function shareDifference(a: Estimate, b: Estimate): Estimate {
  const n = Math.min(a.n, b.n);
  const mean = b.mean - a.mean;
  return {
    n, values: [], mean,
    low: mean - Math.hypot(b.mean - b.low, a.high - a.mean),
    high: mean + Math.hypot(b.high - b.mean, a.mean - a.low),
  };
}
