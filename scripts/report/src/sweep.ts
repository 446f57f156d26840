// A sweep, or runs side by side: curves, heat map, two configurations, the table.

import { Dot, addChart, clearCharts } from './charts';
import { byId, choice, element, onThemeChange, shown, themeColour } from './dom';
import { showOverlay } from './overlay';
import { Cell, SweepPayload } from './payload';
import { Results, SUCCESS, compare, scaled, shortKey } from './results';
import { Estimate, LEAST_FOR_INTERVAL, estimateMean, shareDifference } from './statistics';

const LINE_COLOURS = 6; // --line-1 ... of the style sheet

/** The mean; of a few values, the values themselves. */
function middle(estimate: Estimate): string {
  if (estimate.n === 0) return '–';
  return estimate.n < LEAST_FOR_INTERVAL && estimate.values.length > 0
    ? estimate.values.map((value) => shown(value, 3)).join(', ')
    : shown(estimate.mean, 3);
}

function interval(estimate: Estimate): string {
  if (!Number.isFinite(estimate.low)) return middle(estimate);
  return `${middle(estimate)} (${shown(estimate.low, 3)} … ${shown(estimate.high, 3)})`;
}

/** Blends two colours of the style sheet. */
function blend(from: string, to: string, share: number): string {
  return `color-mix(in oklab, ${themeColour(to)} ${(100 * share).toFixed(1)}%, ${themeColour(from)})`;
}

/** What the page's address asks for, #figure=...&across=...&by=..., so that a view can be linked. */
function fromAddress(name: string, options: string[]): string | undefined {
  const asked = new URLSearchParams(location.hash.slice(1)).get(name);
  return asked !== null && options.includes(asked) ? asked : undefined;
}

/** What is drawn: a figure over one key, and over a second one. */
class FigureView {
  private figure: string;
  private across: string;
  private by: string;
  private charts = element('div');
  private heat = element('div', { class: 'heat-box' });

  constructor(private results: Results, section: HTMLElement) {
    const usual = ['coverage.t95_s', 'coverage.area_fraction', 'sim_time_s', SUCCESS];
    const varying = usual.find((name) => results.figures.includes(name) && this.varies(name));
    const { factors, figures } = results;
    this.figure = fromAddress('figure', figures) ?? varying ?? figures[0];
    this.across = fromAddress('across', factors) ?? factors[0];
    this.by = fromAddress('by', ['', ...factors]) ?? factors[1] ?? '';
    const set = (apply: (value: string) => void) => (value: string) => {
      apply(value);
      const { figure, across, by } = this;
      history.replaceState(null, '', `#${new URLSearchParams({ figure, across, by })}`);
      this.draw();
    };
    const controls = element('div', { class: 'controls' });
    const title = (figure: string) => results.title(figure);
    controls.append(choice('figure', 'figure', figures, this.figure, set((v) => (this.figure = v)), title));
    if (factors.length > 1) {
      controls.append(choice('across', 'across', factors, this.across, set((v) => (this.across = v))));
      controls.append(choice('by', 'by', ['', ...factors], this.by, set((v) => (this.by = v))));
    }
    section.append(element('h2', {}, 'Effect of what was varied'), controls,
      element('div', { class: 'columns' }, this.charts, this.heat));
    section.append(element('p', { class: 'note' },
      `Means over seeds and over every key not chosen, of the runs that succeeded (${results.successes(results.rows())}): ` +
      'of a flight that failed no other figure is comparable. With 95 % confidence intervals (Student; Wilson for the ' +
      `share that succeeded) from n = ${LEAST_FOR_INTERVAL} on; fewer values are shown as they are. n says how many runs had the figure.`));
    if (results.ranged.length > 0) {
      const text = `Of ${results.ranged.join(', ')} each value stands for the range around it.`;
      section.append(element('p', { class: 'note' }, text));
    }
    onThemeChange(() => this.drawHeat());
    this.draw();
  }

  private varies(figure: string): boolean {
    const values = this.results.payload.rows.map((_row, i) => this.results.value(i, figure)).filter((v) => v !== null);
    return values.length > 1 && new Set(values).size > 1;
  }

  private draw(): void {
    this.drawCurves();
    this.drawHeat();
  }

  private drawCurves(): void {
    clearCharts(this.charts);
    const { results, across, by, figure } = this;
    const levels = results.levels(across);
    const numeric = levels.every((level) => typeof level === 'number');
    const x = numeric ? (levels as number[]) : levels.map((_level, i) => i);
    const groups: (Cell | undefined)[] = by && by !== across ? results.levels(by) : [undefined];
    const { unit } = results.display(figure);
    const lines = [];
    const bands = [];
    const dots: Dot[] = [];
    for (const [g, group] of groups.slice(0, LINE_COLOURS).entries()) {
      const estimates = levels.map((level) => {
        const values: Record<string, Cell> = { [across]: level };
        if (group !== undefined) values[by] = group;
        return results.estimate(results.where(values), figure);
      });
      const colour = `--line-${g + 1}`;
      const name = group === undefined ? 'mean' : `${shortKey(by)} ${group ?? '–'}`;
      const first = lines.length;
      lines.push({ label: name, values: estimates.map((e) => e.mean), colour, unit });
      lines.push({ label: 'low', values: estimates.map((e) => e.low), colour, unit, edge: true });
      lines.push({ label: 'high', values: estimates.map((e) => e.high), colour, unit, edge: true });
      bands.push({ low: first + 1, high: first + 2, colour });
      estimates.forEach((e, i) => {
        if (e.n < LEAST_FOR_INTERVAL) dots.push(...e.values.map((y) => ({ x: x[i], y, colour })));
      });
    }
    if (groups.length > LINE_COLOURS) {
      const text = `The first ${LINE_COLOURS} of ${groups.length} values of ${by} are drawn; the heat map has all.`;
      this.charts.append(element('p', { class: 'note' }, text));
    }
    addChart(this.charts, {
      title: `${results.title(figure)} over ${across}`,
      xLabel: across,
      x,
      lines,
      bands,
      dots,
      points: true,
      zero: false,
      height: 300,
      names: numeric ? undefined : levels.map(String),
    });
  }

  private drawHeat(): void {
    this.heat.replaceChildren();
    const { results, across, by, figure } = this;
    this.heat.hidden = !by || by === across;
    if (this.heat.hidden) return;
    const columns = results.levels(across);
    const rows = results.levels(by);
    const cells = rows.map((row) =>
      columns.map((column) => results.estimate(results.where({ [across]: column, [by]: row }), figure)),
    );
    const means = cells.flat().filter((e) => e.n > 0).map((e) => e.mean);
    const scale = { low: Math.min(...means), high: Math.max(...means) };
    const table = element('table', { class: 'heat' });
    const head = element('tr', {}, element('th', {}, `${shortKey(by)} \\ ${shortKey(across)}`));
    for (const column of columns) head.append(element('th', {}, String(column ?? '–')));
    table.append(element('thead', {}, head));
    const body = element('tbody');
    rows.forEach((row, r) => {
      const line = element('tr', {}, element('th', {}, String(row ?? '–')));
      for (const estimate of cells[r]) line.append(heatCell(estimate, scale));
      body.append(line);
    });
    table.append(body);
    this.heat.append(element('h3', {}, `${results.title(figure)}: mean`), table);
  }
}

/** Coloured between the lowest and the highest mean, where there are two to be compared. */
function heatCell(estimate: Estimate, { low, high }: { low: number; high: number }): HTMLElement {
  if (estimate.n === 0) return element('td', {}, '–');
  const known = Number.isFinite(estimate.low) ? `${shown(estimate.low, 3)} … ${shown(estimate.high, 3)}, ` : '';
  const small = `${known}n ${estimate.n}`;
  const cell = element('td', {}, middle(estimate), element('small', {}, small));
  if (!(high > low)) return cell;
  const share = (estimate.mean - low) / (high - low);
  cell.style.background = blend('--heat-low', '--heat-high', share);
  cell.style.color = themeColour(share > 0.55 ? '--heat-text-high' : '--heat-text-low');
  return cell;
}

/** Two configurations, figure by figure, paired by what they share. */
function sideBySide(results: Results, section: HTMLElement): void {
  const configurations = results.configurations();
  if (configurations.length < 2) return overall(results, section);
  const names = configurations.map((c) => c.name);
  const chosen = [names[0], names[names.length - 1]];
  const box = element('div', { class: 'scroll' });
  // Whoever looks at each pair judges so often: Bonferroni's share of the 5 % for each.
  const pairs = (names.length * (names.length - 1)) / 2;
  const confidence = 1 - 0.05 / pairs;
  const draw = () => {
    const [a, b] = chosen.map((name) => results.where(configurations[names.indexOf(name)].values));
    const body = element('tbody');
    for (const figure of results.figures) {
      const row = comparisonRow(results, figure, a, b, confidence);
      if (row) body.append(row);
    }
    const successes = (rows: number[]) => element('small', {}, ` ${results.successes(rows)} succeeded`);
    const head = element('tr', {}, element('th', { class: 'word' }, 'figure'), element('th', {}, 'A', successes(a)),
      element('th', {}, 'B', successes(b)), element('th', {}, 'B − A, paired'));
    box.replaceChildren(element('table', { class: 'data' }, element('thead', {}, head), body));
  };
  section.append(
    element('h2', {}, 'Side by side'),
    element('div', { class: 'controls' },
      choice('A', 'side-a', names, chosen[0], (name) => ((chosen[0] = name), draw())),
      choice('B', 'side-b', names, chosen[1], (name) => ((chosen[1] = name), draw()))),
    box,
    element('p', { class: 'note' },
      `Mean (95 % confidence interval) of the runs that succeeded; fewer than ${LEAST_FOR_INTERVAL} values are shown as they ` +
      'are and not judged. Differences are taken seed by seed where both succeeded' +
      (pairs > 1 ? `, and their intervals hold for all ${pairs} pairs of configurations together (Bonferroni)` : '') +
      '; one whose interval leaves zero out is marked. Among many figures, one in twenty does so by chance.'),
  );
  draw();
}

/** Of a single configuration: each figure over its runs. */
function overall(results: Results, section: HTMLElement): void {
  const rows = results.rows();
  if (rows.length < 2) return;
  const body = element('tbody');
  for (const figure of results.figures) {
    const estimate = results.estimate(rows, figure);
    if (estimate.n === 0) continue;
    const ends = figure === SUCCESS ? [NaN, NaN] : [Math.min(...estimate.values), Math.max(...estimate.values)];
    body.append(element('tr', { 'data-figure': figure }, element('td', { class: 'word', title: figure }, results.title(figure)),
      element('td', {}, interval(estimate)), ...ends.map((end) => element('td', {}, shown(end))), element('td', {}, String(estimate.n))));
  }
  const head = element('tr', {}, element('th', { class: 'word' }, 'figure'), element('th', {}, 'mean (95 % interval)'),
    element('th', {}, 'least'), element('th', {}, 'greatest'), element('th', {}, 'runs'));
  section.append(
    element('h2', {}, 'Over all runs'),
    element('div', { class: 'scroll' }, element('table', { class: 'data' }, element('thead', {}, head), body)),
    element('p', { class: 'note' }, `Of the runs that succeeded (${results.successes(rows)}); of a flight that failed no figure is comparable.`),
  );
}

/** A row's seed and repetition where no other row of its side has them: what can be paired. */
function partners(results: Results, figure: string, rows: number[]): Map<string, number> {
  const identity = (row: number) => `${results.cell(row, 'seed')} ${results.cell(row, 'repeat')}`;
  const count = new Map<string, number>();
  for (const row of rows) count.set(identity(row), (count.get(identity(row)) ?? 0) + 1);
  const found = new Map<string, number>();
  for (const row of rows) {
    const value = results.value(row, figure);
    if (value !== null && count.get(identity(row)) === 1) found.set(identity(row), value);
  }
  return found;
}

function difference(results: Results, figure: string, a: number[], b: number[], confidence: number): Estimate {
  if (figure === SUCCESS) {
    const [share_a, share_b] = [a, b].map((rows) => scaled(results.estimate(rows, figure, confidence), 1 / 100));
    return scaled(shareDifference(share_a, share_b), 100);
  }
  const { factor } = results.display(figure);
  const before = partners(results, figure, a);
  const after = partners(results, figure, b);
  return estimateMean([...after].flatMap(([id, value]) => (before.has(id) ? [factor * (value - before.get(id)!)] : [])), confidence);
}

function comparisonRow(
  results: Results, figure: string, a: number[], b: number[], confidence: number,
): HTMLElement | null {
  const [of_a, of_b] = [results.estimate(a, figure), results.estimate(b, figure)];
  if (of_a.n === 0 && of_b.n === 0) return null;
  const change = difference(results, figure, a, b, confidence);
  const significant = change.low > 0 || change.high < 0;
  const better = Math.sign(change.mean) * results.info(figure).better;
  const mark = !significant ? '' : better > 0 ? 'better' : better < 0 ? 'worse' : 'differs';
  const text = change.n === 0 ? '–' : `${interval(change)}, n ${change.n}${mark ? ', ' + mark : ''}`;
  return element('tr', { 'data-figure': figure }, element('td', { class: 'word', title: figure }, results.title(figure)),
    element('td', {}, interval(of_a)), element('td', {}, interval(of_b)), element('td', { class: mark }, text));
}

class RunTable {
  private all = false;
  private sortedBy = '';
  private direction = 1;
  private box = element('div', { class: 'scroll' });

  constructor(private results: Results, section: HTMLElement) {
    const whole = element('input', {
      type: 'checkbox', id: 'all-columns',
      change: () => {
        this.all = whole.checked;
        this.draw();
      },
    });
    section.append(element('h2', {}, 'Runs'), element('div', { class: 'controls' }, element('label', {}, whole, 'every column')), this.box);
    this.draw();
  }

  private columns(): string[] {
    const { columns } = this.results.payload;
    if (this.all) return columns;
    const { figures, rows } = this.results.payload;
    const measured = (name: string) => rows.some((_row, i) => this.results.cell(i, name) !== null);
    const main = Object.keys(figures).filter((name) => figures[name].main && measured(name));
    return [...new Set([...this.results.factors, 'seed', 'failure', ...main])]
      .filter((name) => columns.includes(name) && (name === 'seed' || measured(name)));
  }

  private order(): number[] {
    const rows = this.results.payload.rows.map((_row, i) => i);
    if (!this.sortedBy) return rows;
    const value = (row: number) => this.results.cell(row, this.sortedBy);
    return rows.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === null || y === null) return Number(x === null) - Number(y === null); // the empty ones last
      return this.direction * compare(x, y);
    });
  }

  private header(name: string): HTMLElement {
    const button = element('button', {
      type: 'button',
      click: () => {
        this.direction = this.sortedBy === name ? -this.direction : 1;
        this.sortedBy = name;
        this.draw();
      },
    }, name in this.results.payload.figures ? this.results.title(name) : shortKey(name));
    const words = this.results.payload.rows.some((_row, i) => typeof this.results.cell(i, name) === 'string');
    const cell = element('th', { title: name, class: words ? 'word' : '' }, button);
    if (this.sortedBy === name) cell.setAttribute('aria-sort', this.direction > 0 ? 'ascending' : 'descending');
    return cell;
  }

  private draw(): void {
    const columns = this.columns();
    const { runs, titles, links } = this.results.payload;
    const body = element('tbody');
    for (const row of this.order()) {
      const link = links[row] ? element('a', { href: links[row] }, titles[row]) : titles[row];
      const line = element('tr', {}, element('td', { class: 'word', title: runs[row] }, link));
      for (const name of columns) {
        const cell = this.results.cell(row, name);
        const { factor } = this.results.display(name);
        line.append(typeof cell === 'number' ? element('td', {}, shown(factor * cell)) : element('td', { class: 'word' }, cell ?? ''));
      }
      body.append(line);
    }
    const head = element('tr', {}, element('th', { class: 'word' }, 'run'), ...columns.map((name) => this.header(name)));
    this.box.replaceChildren(element('table', { class: 'data', id: 'run-table' }, element('thead', {}, head), body));
  }
}

export async function showSweep(payload: SweepPayload): Promise<void> {
  const results = new Results(payload);
  if (payload.rows.length === 0) return;
  byId('runs').replaceChildren();
  if (results.factors.length > 0) new FigureView(results, byId('figures'));
  await showOverlay(payload.overlay, byId('coverage'));
  sideBySide(results, byId('side'));
  new RunTable(results, byId('runs'));
}
