// Several runs laid over each other: their coverage on common axes.

import { Line, addChart, clearCharts } from './charts';
import { choice, element } from './dom';
import { OverlayPayload, decode } from './payload';

const QUANTITIES: Record<string, string> = { area_fraction: 'area', surface_fraction: 'surface' };

/** A line a run, in its group's colour; in the legend a group stands once. */
async function linesOver(overlay: OverlayPayload, axis: 'time_s' | 'distance_m', quantity: string): Promise<Line[]> {
  const named = new Set<number>();
  const lines: Line[] = [];
  for (const run of overlay.runs) {
    const values = (await decode(run[axis][quantity])).map((share) => 100 * share);
    if (!values.some(Number.isFinite)) continue;
    const unnamed = named.has(run.group);
    named.add(run.group);
    const label = overlay.groups[run.group];
    lines.push({ label, values, colour: `--line-${run.group + 1}`, unit: '%', unnamed });
  }
  return lines;
}

export async function showOverlay(overlay: OverlayPayload, section: HTMLElement): Promise<void> {
  const charts = element('div', { class: 'charts' });
  const draw = async (quantity: string) => {
    const [overTime, overDistance] = [
      await linesOver(overlay, 'time_s', quantity), await linesOver(overlay, 'distance_m', quantity),
    ];
    clearCharts(charts);
    for (const [axis, xLabel, lines] of [
      ['time_s', 'time, s', overTime], ['distance_m', 'distance, m', overDistance],
    ] as const) {
      const { end, steps } = overlay.axes[axis];
      const x = Float64Array.from({ length: steps }, (_, i) => (end * i) / (steps - 1));
      const title = `Coverage of the ${QUANTITIES[quantity]} over ${axis === 'time_s' ? 'time' : 'distance'}`;
      addChart(charts, { title, xLabel, x, lines, height: 260 });
    }
  };
  // Before any chart: missions without an exploration have no coverage.
  const first = await linesOver(overlay, 'time_s', 'area_fraction');
  const quantity = first.length > 0 ? 'area_fraction' : 'surface_fraction';
  if (first.length === 0 && (await linesOver(overlay, 'time_s', quantity)).length === 0) return;
  section.append(
    element('h2', {}, 'Coverage'),
    element('div', { class: 'controls' },
      choice('of the', 'quantity', Object.keys(QUANTITIES), quantity, (chosen) => void draw(chosen), (name) => QUANTITIES[name])),
    charts,
  );
  if (overlay.all_groups > overlay.groups.length) {
    const text = `The first ${overlay.groups.length} of ${overlay.all_groups} configurations.`;
    section.append(element('p', { class: 'note' }, text));
  }
  await draw(quantity);
}
