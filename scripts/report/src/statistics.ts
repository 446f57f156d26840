// Means with what is known about them.

/** Fewer values than this are shown as they are: an interval from two says next to nothing. */
export const LEAST_FOR_INTERVAL = 3;

export interface Estimate {
  n: number;
  values: number[];
  mean: number;
  /** Confidence interval, of 95 % unless told otherwise; NaN where the values are too few to tell. */
  low: number;
  high: number;
}

/** Probability that Student's t lies within -x..x, by its finite series (Abramowitz and Stegun 26.7.3, 26.7.4). */
function studentWithin(x: number, freedom: number): number {
  const angle = Math.atan2(x, Math.sqrt(freedom));
  const cos2 = Math.cos(angle) ** 2;
  const odd = freedom % 2 === 1;
  let term = odd ? Math.cos(angle) : 1;
  let sum = freedom === 1 ? 0 : term;
  for (let k = odd ? 3 : 2; k <= freedom - 2; k += 2) {
    term *= ((k - 1) / k) * cos2;
    sum += term;
  }
  return odd ? (2 / Math.PI) * (angle + Math.sin(angle) * sum) : Math.sin(angle) * sum;
}

/** What Student's t of so many degrees of freedom, 1 or more, lies within with this probability. */
export function studentQuantile(confidence: number, freedom: number): number {
  let [low, high] = [0, 1];
  while (studentWithin(high, freedom) < confidence) high *= 2;
  for (let k = 0; k < 60; ++k) {
    const middle = (low + high) / 2;
    [low, high] = studentWithin(middle, freedom) < confidence ? [middle, high] : [low, middle];
  }
  return (low + high) / 2;
}

/** The same of the normal distribution, which Student's is to 1e-4 with so much freedom. */
function normalQuantile(confidence: number): number {
  return studentQuantile(confidence, 10000);
}

/** Mean of independent values and its interval after Student. */
export function estimateMean(values: number[], confidence = 0.95): Estimate {
  const n = values.length;
  const mean = values.reduce((sum, value) => sum + value, 0) / n;
  if (n < LEAST_FOR_INTERVAL) return { n, values, mean, low: NaN, high: NaN };
  const variance = values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / (n - 1);
  const half = studentQuantile(confidence, n - 1) * Math.sqrt(variance / n);
  return { n, values, mean, low: mean - half, high: mean + half };
}

/** A share of yes and no, with Wilson's interval. */
export function estimateShare(values: number[], confidence = 0.95): Estimate {
  const n = values.length;
  const mean = values.reduce((sum, value) => sum + value, 0) / n;
  if (n < LEAST_FOR_INTERVAL) return { n, values, mean, low: NaN, high: NaN };
  const z = normalQuantile(confidence);
  const centre = (mean + (z * z) / (2 * n)) / (1 + (z * z) / n);
  const half = (z / (1 + (z * z) / n)) * Math.sqrt((mean * (1 - mean)) / n + (z * z) / (4 * n * n));
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
