// Line charts on uPlot: one look, one replay line, colours of the page's theme.

import uPlot from 'uplot';
import { element, onThemeChange, shown, themeColour } from './dom';

export interface Line {
  label: string;
  values: ArrayLike<number>;
  colour: string; // a variable of the style sheet
  unit: string;
  /** Second scale, on the right. */
  right?: boolean;
  /** An edge of a band: not drawn itself, not in the legend. */
  edge?: boolean;
  /** Drawn, but not in the legend: one of several lines of one name. */
  unnamed?: boolean;
}

export interface Band {
  low: number; // indices into the lines
  high: number;
  colour: string;
}

/** One value of its own. */
export interface Dot {
  x: number;
  y: number;
  colour: string;
}

export interface ChartSpec {
  title: string;
  xLabel: string;
  x: ArrayLike<number>;
  lines: Line[];
  bands?: Band[];
  dots?: Dot[];
  /** Charts over the same axis share their cursor. */
  sync?: string;
  zero?: boolean;
  height?: number;
  points?: boolean;
  /** Names of x = 0, 1, ... instead of numbers. */
  names?: string[];
  onPick?: (x: number) => void;
}

const HEIGHT = 200;
const charts: { plot: uPlot; box: HTMLElement }[] = [];
let mark: number | null = null;

/** Draws the replay's moment into every chart over time. */
export function setMark(time: number): void {
  mark = time;
  for (const { plot } of charts) plot.redraw(false, false);
}

/** Takes every chart and whatever else is there out of `parent`. */
export function clearCharts(parent: HTMLElement): void {
  for (let i = charts.length - 1; i >= 0; --i) {
    const { plot, box } = charts[i];
    if (!parent.contains(box)) continue;
    charts.splice(i, 1);
    resized.unobserve(box);
    plot.destroy();
  }
  parent.replaceChildren();
}

function fit({ plot, box }: { plot: uPlot; box: HTMLElement }): void {
  const width = Math.floor(box.clientWidth);
  if (width > 0 && width !== plot.width) plot.setSize({ width, height: plot.height });
}

const resized = new ResizeObserver((entries) => {
  for (const chart of charts) {
    if (entries.some((entry) => entry.target === chart.box)) fit(chart);
  }
});

onThemeChange(() => {
  for (const chart of charts) {
    fit(chart);
    chart.plot.redraw(false, true);
  }
});

/** Room for the labels, measured rather than guessed. */
function axisWidth(plot: uPlot, labels: string[] | null, index: number, cycle: number): number {
  const axis = plot.axes[index] as uPlot.Axis & { _size: number };
  if (cycle > 1) return axis._size;
  let width = 18;
  const longest = (labels ?? []).reduce((a, b) => (b.length > a.length ? b : a), '');
  if (longest !== '') {
    plot.ctx.font = (axis.font as unknown as string[])[0];
    width += plot.ctx.measureText(longest).width / devicePixelRatio;
  }
  return Math.ceil(width);
}

function axis(unit: string, options: Partial<uPlot.Axis>): uPlot.Axis {
  return {
    stroke: () => themeColour('--muted'),
    grid: { stroke: () => themeColour('--grid'), width: 1 },
    ticks: { stroke: () => themeColour('--grid'), width: 1, size: 4 },
    font: '11px system-ui, sans-serif',
    labelFont: '11px system-ui, sans-serif',
    labelSize: 16,
    labelGap: 0,
    label: unit,
    ...options,
  };
}

function markPlugin(): uPlot.Plugin {
  return {
    hooks: {
      draw: (plot) => {
        if (mark === null || mark < plot.scales.x.min! || mark > plot.scales.x.max!) return;
        const x = Math.round(plot.valToPos(mark, 'x', true));
        plot.ctx.save();
        plot.ctx.strokeStyle = themeColour('--mark');
        plot.ctx.lineWidth = devicePixelRatio;
        plot.ctx.beginPath();
        plot.ctx.moveTo(x, plot.bbox.top);
        plot.ctx.lineTo(x, plot.bbox.top + plot.bbox.height);
        plot.ctx.stroke();
        plot.ctx.restore();
      },
    },
  };
}

/** The interval at each point, which a band shows only between them. */
function whiskerPlugin(bands: Band[]): uPlot.Plugin {
  return {
    hooks: {
      draw: (plot) => {
        plot.ctx.save();
        plot.ctx.lineWidth = 1.5 * devicePixelRatio;
        for (const band of bands) {
          plot.ctx.strokeStyle = themeColour(band.colour);
          plot.data[0].forEach((at, i) => {
            const ends = [plot.data[band.low + 1][i], plot.data[band.high + 1][i]];
            if (ends[0] === null || ends[1] === null || ends[0] === undefined || ends[1] === undefined) return;
            const x = plot.valToPos(at, 'x', true);
            plot.ctx.beginPath();
            plot.ctx.moveTo(x, plot.valToPos(ends[0], 'y', true));
            plot.ctx.lineTo(x, plot.valToPos(ends[1], 'y', true));
            plot.ctx.stroke();
          });
        }
        plot.ctx.restore();
      },
    },
  };
}

function dotPlugin(dots: Dot[]): uPlot.Plugin {
  return {
    hooks: {
      draw: (plot) => {
        plot.ctx.save();
        plot.ctx.lineWidth = 1.5 * devicePixelRatio;
        for (const dot of dots) {
          plot.ctx.strokeStyle = themeColour(dot.colour);
          plot.ctx.beginPath();
          plot.ctx.arc(plot.valToPos(dot.x, 'x', true), plot.valToPos(dot.y, 'y', true), 4 * devicePixelRatio, 0, 2 * Math.PI);
          plot.ctx.stroke();
        }
        plot.ctx.restore();
      },
    },
  };
}

/** @param dots values that are no series' and must be seen as well */
function scaleRange(zero: boolean, dots: Dot[] = []): uPlot.Range.Function {
  return (_plot, from, to) => {
    if (from === null || to === null) return [0, 1];
    const min = dots.reduce((least, dot) => Math.min(least, dot.y), from);
    const max = dots.reduce((most, dot) => Math.max(most, dot.y), to);
    const room = 0.06 * (max - min || Math.abs(max) || 1);
    const low = zero && min >= 0 ? 0 : min - room;
    return [low, max + room];
  };
}

/** Room beside the outermost points. */
function pointRange(_plot: uPlot, min: number, max: number): uPlot.Range.MinMax {
  const room = 0.04 * (max - min || Math.abs(max) || 1);
  return [min - room, max + room];
}

/** Nothing while no moment is pointed at. */
function legendValue(value: number | null, index: number | null, unit = ''): string {
  if (index === null) return '';
  return value === null ? '–' : `${shown(value)} ${unit}`.trim();
}

function series(line: Line, spec: ChartSpec): uPlot.Series {
  return {
    label: line.label,
    scale: line.right ? 'right' : 'y',
    class: line.edge || line.unnamed ? 'edge' : undefined,
    stroke: () => (line.edge ? 'transparent' : themeColour(line.colour)),
    width: 1.5,
    paths: spec.names ? () => null : undefined, // nothing lies between two names
    spanGaps: false,
    points: { show: (spec.points ?? false) && !line.edge, size: 6, fill: () => themeColour(line.colour) },
    value: (_plot, value, _series, index) => legendValue(value, index, line.unit),
  };
}

function gaps(values: ArrayLike<number>): (number | null)[] {
  return Array.from(values, (value) => (Number.isFinite(value) ? value : null));
}

function nameAxis(names: string[]): Partial<uPlot.Axis> {
  return {
    splits: () => names.map((_name, i) => i),
    values: (_plot, splits) => splits.map((split) => names[split] ?? ''),
  };
}

/** Adds a chart to `parent`; nothing if no line has a value. */
export function addChart(parent: HTMLElement, spec: ChartSpec): void {
  const lines = spec.lines.filter((line) => line.edge || Array.from(line.values).some(Number.isFinite));
  if (!lines.some((line) => !line.edge)) return;
  const box = element('div', { class: 'plot' });
  const heading = element('h3', {}, spec.title);
  parent.append(element('figure', { class: 'chart' }, heading, box));

  const left = lines.filter((line) => !line.right);
  const right = lines.filter((line) => line.right);
  const axes = [
    axis(spec.xLabel, { size: 36, ...(spec.names ? nameAxis(spec.names) : {}) }),
    axis(left[0]?.unit ?? '', { scale: 'y', size: axisWidth }),
  ];
  if (right.length > 0) {
    axes.push(axis(right[0].unit, { scale: 'right', side: 1, size: axisWidth, grid: { show: false } }));
  }
  const x: uPlot.Scale = { time: false };
  if (spec.points) x.range = pointRange;
  const scales: uPlot.Scales = { x, y: { range: scaleRange(spec.zero ?? true, spec.dots) } };
  if (right.length > 0) scales.right = { range: scaleRange(spec.zero ?? true) };

  const plot = new uPlot(
    {
      width: Math.max(200, Math.floor(box.clientWidth)),
      height: spec.height ?? HEIGHT,
      scales,
      axes,
      series: [
        { label: spec.xLabel, value: (_plot, value, _series, index) => legendValue(value, index) },
        ...lines.map((line) => series(line, spec)),
      ],
      bands: (spec.names ? [] : spec.bands)?.map((band) => ({
        series: [band.high + 1, band.low + 1] as [number, number],
        fill: () => themeColour(band.colour) + '2e',
      })),
      cursor: {
        sync: spec.sync ? { key: spec.sync, setSeries: false } : undefined,
        drag: { x: true, y: false },
        points: { size: 6 },
      },
      // By the variable's name, so that it follows the theme and goes to paper.
      legend: { markers: { stroke: (_plot, i) => `var(${lines[i - 1]?.colour})` } },
      plugins: spec.bands ? [whiskerPlugin(spec.bands), dotPlugin(spec.dots ?? [])] : spec.sync === 'time' ? [markPlugin()] : [],
    },
    [gaps(spec.x), ...lines.map((line) => gaps(line.values))] as uPlot.AlignedData,
    box,
  );
  if (spec.onPick) {
    const pick = spec.onPick;
    plot.over.addEventListener('click', (event) => {
      pick(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, 'x'));
    });
  }
  charts.push({ plot, box });
  resized.observe(box);
}
