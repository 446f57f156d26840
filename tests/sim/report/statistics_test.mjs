// The intervals of a sweep's report against printed tables and against frequencies.
//
//   node statistics_test.mjs VIEWER_DIR
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';

const viewer = process.argv[2];
const { transformSync } = createRequire(`${viewer}/`)('esbuild');
const { code } = transformSync(readFileSync(`${viewer}/src/statistics.ts`, 'utf8'), { loader: 'ts' });
const { estimateMean, estimateShare, studentQuantile } = await import(`data:text/javascript,${encodeURIComponent(code)}`);

/** Normal values of a fixed sequence (Park and Miller's generator, Box and Muller's pairs). */
function normals(seed) {
  let state = seed;
  const uniform = () => (state = (state * 48271) % 2147483647) / 2147483647;
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
}

// Two-sided quantiles as Fisher and Yates print them.
for (const [confidence, freedom, printed] of [
  [0.95, 1, 12.706], [0.95, 2, 4.303], [0.95, 7, 2.365], [0.95, 30, 2.042], [0.95, 120, 1.98],
  [0.99, 1, 63.657], [0.99, 4, 4.604], [0.99, 19, 2.861], [0.999, 3, 12.924], [0.999, 40, 3.551],
]) {
  assert.ok(Math.abs(studentQuantile(confidence, freedom) - printed) < 6e-4, `t of ${freedom} at ${confidence}`);
}

// An interval holds the truth as often as it says: 4000 samples of eight, at 95 % and for ten pairs together.
for (const pairs of [1, 10]) {
  const confidence = 1 - 0.05 / pairs;
  const next = normals(7 + pairs);
  let missed = 0;
  for (let k = 0; k < 4000; ++k) {
    const { low, high } = estimateMean(Array.from({ length: 8 }, () => 3 + 2 * next()), confidence);
    missed += low > 3 || high < 3;
  }
  const expected = 4000 * (1 - confidence);
  assert.ok(Math.abs(missed - expected) < 4 * Math.sqrt(expected), `${missed} of 4000 missed, ${expected} expected`);
}

// Wilson's own bounds: the score test at either end is just not rejected.
for (const [yes, n, confidence] of [[3, 20, 0.95], [20, 20, 0.95], [11, 20, 0.995]]) {
  const values = Array.from({ length: n }, (_, i) => (i < yes ? 1 : 0));
  const z = studentQuantile(confidence, 100000);
  const { low, high, mean } = estimateShare(values, confidence);
  for (const end of [low, high].filter((share) => share > 1e-9 && share < 1 - 1e-9)) {
    assert.ok(Math.abs(Math.abs(mean - end) / Math.sqrt((end * (1 - end)) / n) - z) < 1e-3, `${yes} of ${n}`);
  }
}
