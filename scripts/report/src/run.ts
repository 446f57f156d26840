// One run: the 3D replay and the charts.

import { addChart, setMark } from './charts';
import { byId, element } from './dom';
import { Columns, RunPayload, Track, decode, decodeAll, indexAt } from './payload';
import { FlightScene, Layer, SceneData } from './scene';

const DEGREES = 180 / Math.PI;

/** The moment that everything on the page shows. */
class Replay {
  private listeners: ((time: number) => void)[] = [];
  private playing = false;
  private speed = 10;
  private last = 0;
  readonly slider: HTMLInputElement;
  readonly play: HTMLButtonElement;
  time: number;

  constructor(readonly duration: number) {
    this.time = duration;
    this.slider = element('input', {
      type: 'range', id: 'time', min: 0, max: duration, step: 'any', value: duration,
      'aria-label': 'Time of the flight',
      input: () => this.set(Number(this.slider.value)),
    });
    this.play = element('button', { id: 'play', type: 'button', click: () => this.toggle() }, 'Play');
  }

  onChange(listener: (time: number) => void): void {
    this.listeners.push(listener);
  }

  set(time: number): void {
    this.time = Math.min(this.duration, Math.max(0, time));
    this.slider.value = String(this.time);
    for (const listener of this.listeners) listener(this.time);
  }

  setSpeed(speed: number): void {
    this.speed = speed;
  }

  private toggle(): void {
    this.playing = !this.playing;
    this.play.textContent = this.playing ? 'Pause' : 'Play';
    if (!this.playing) return;
    if (this.time >= this.duration) this.set(0);
    this.last = performance.now();
    requestAnimationFrame((now) => this.advance(now));
  }

  private advance(now: number): void {
    if (!this.playing) return;
    this.set(this.time + (this.speed * Math.max(0, now - this.last)) / 1000);
    this.last = now;
    if (this.time >= this.duration) this.toggle();
    else requestAnimationFrame((next) => this.advance(next));
  }
}

async function decodeTrack(columns: RunPayload['tracks']['truth']): Promise<Track | null> {
  return columns ? ((await decodeAll(columns)) as unknown as Track) : null;
}

/** The vehicle on the path's picture. */
function followOnMap(replay: Replay, track: Track | null): void {
  const map = document.getElementById('path-map');
  if (!map || !track || track.t.length === 0) return;
  const here = document.createElementNS('http://www.w3.org/2000/svg', 'circle');
  here.setAttribute('class', 'here');
  here.setAttribute('r', String(0.6 * Number(map.dataset.unit ?? 1))); // the start's ring stays to be seen
  map.append(here);
  replay.onChange((time) => {
    const i = Math.max(0, indexAt(track.t, time));
    here.setAttribute('cx', track.x[i].toFixed(2));
    here.setAttribute('cy', (-track.y[i]).toFixed(2));
  });
}

function readout(replay: Replay, flight: Columns): HTMLOutputElement {
  const output = element('output', { id: 'now' });
  const at = (name: string, i: number) => flight[name]?.[i] ?? NaN;
  replay.onChange((time) => {
    const i = indexAt(flight.time_s ?? [], time);
    const parts = [`${time.toFixed(1)} s`];
    if (i >= 0) {
      parts.push(`${at('speed_mps', i).toFixed(2)} m/s`, `${at('height_m', i).toFixed(1).replace('-0.0', '0.0')} m high`);
      if (Number.isFinite(at('clearance_m', i))) parts.push(`${at('clearance_m', i).toFixed(2)} m clear`);
    }
    output.textContent = parts.join(' · ');
  });
  return output;
}

const LAYERS: [Layer, string][] = [
  ['cloud', 'map'],
  ['estimate', 'estimated path'],
  ['truth', 'true path'],
  ['targets', 'targets'],
  ['candidates', 'candidates'],
];

function layerBoxes(scene: FlightScene): HTMLElement {
  const boxes = LAYERS.map(([layer, name]) => {
    const box = element('input', { type: 'checkbox', checked: true, change: () => scene.show(layer, box.checked) });
    return element('label', { class: `layer ${layer}` }, box, element('span', { class: 'key' }), name);
  });
  const follow = element('input', {
    type: 'checkbox',
    id: 'follow',
    change: () => {
      if (follow.checked) scene.startFollowing();
      else {
        scene.follow = false;
        scene.overview();
      }
    },
  });
  return element('div', { class: 'layers' }, ...boxes, element('label', { class: 'layer' }, follow, 'follow'));
}

function cutSlider(scene: FlightScene): HTMLElement {
  const [low, high] = scene.heights;
  const output = element('output');
  const slider = element('input', {
    type: 'range', id: 'cut', min: low, max: high, step: 0.1, value: scene.firstCut ?? high,
    input: () => apply(),
  });
  const apply = () => {
    const whole = Number(slider.value) >= high - 0.1;
    scene.setCut(whole ? 1e6 : Number(slider.value));
    output.textContent = whole ? 'off' : `${Number(slider.value).toFixed(1)} m`;
  };
  apply();
  return element('label', { class: 'cut' }, 'cut above', slider, output);
}

function speedChoice(replay: Replay): HTMLElement {
  const choice = element('select', {
    'aria-label': 'Speed of the replay',
    change: () => replay.setSpeed(Number(choice.value)),
  });
  for (const speed of [1, 5, 10, 30]) {
    choice.append(element('option', { value: speed, selected: speed === 10 }, `${speed}×`));
  }
  return choice;
}

function addScene(box: HTMLElement, transport: HTMLElement, replay: Replay, data: SceneData): void {
  if (!FlightScene.possible()) {
    const text = 'No WebGL here, so no 3D view; the path over the map below follows the slider.';
    box.append(element('p', { class: 'notice', id: 'no-webgl' }, text), transport);
    return;
  }
  const view = element('div', { id: 'view' });
  box.append(view);
  const scene = new FlightScene(view, data);
  replay.onChange((time) => scene.setTime(time));
  box.append(transport, layerBoxes(scene), cutSlider(scene));
  const { growth, total } = data.run.cloud;
  if (total === 0) return;
  const count = `${data.cloud.x.length.toLocaleString('en')} of the map's ${total.toLocaleString('en')} points.`;
  const when = growth.t.length > 0 ? '' : ' This run did not record when its map grew: it is shown whole at any time.';
  box.append(element('p', { class: 'note' }, `Coloured by height; ${count} Drag to orbit, right drag to move.${when}`));
}

function coverageCharts(box: HTMLElement, coverage: Columns, pick: (t: number) => void): void {
  if (!coverage.time_s) return;
  const percent = (values: Float64Array) => values.map((value) => 100 * value);
  const lines = [
    { label: 'area', values: percent(coverage.area_fraction), colour: '--line-1', unit: '%' },
    { label: 'surface', values: percent(coverage.surface_fraction), colour: '--line-2', unit: '%' },
  ];
  addChart(box, { title: 'Coverage against time', xLabel: 'time, s', x: coverage.time_s, lines, sync: 'time', onPick: pick });
  addChart(box, { title: 'Coverage against distance', xLabel: 'distance, m', x: coverage.distance_m, lines });
}

function flightCharts(box: HTMLElement, flight: Columns, pick: (t: number) => void): void {
  if (!flight.time_s) return;
  const base = { xLabel: 'time, s', x: flight.time_s, sync: 'time', onPick: pick };
  const line = (name: string, label: string, unit: string, colour: string, factor = 1) => ({
    label, unit, colour, values: (flight[name] ?? new Float64Array()).map((value) => factor * value),
  });
  addChart(box, { ...base, title: 'Speed', lines: [line('speed_mps', 'speed', 'm/s', '--line-1')] });
  addChart(box, { ...base, title: 'Clearance', lines: [line('clearance_m', 'to the nearest surface', 'm', '--line-1')] });
  addChart(box, {
    ...base,
    title: 'Odometry error',
    lines: [
      line('odometry_error_m', 'position', 'mm', '--line-1', 1000),
      { ...line('odometry_yaw_error_rad', 'yaw', 'deg', '--line-2', DEGREES), right: true },
    ],
  });
  addChart(box, { ...base, title: 'Tracking error', lines: [line('tracking_error_m', 'from the setpoint', 'm', '--line-1')] });
  addChart(box, { ...base, title: 'Height', zero: false, lines: [line('height_m', 'above the start', 'm', '--line-1')] });
  addChart(box, {
    ...base,
    title: 'Battery',
    lines: [
      line('battery_fraction', 'charge', '%', '--line-1', 100),
      { ...line('battery_power_w', 'power', 'W', '--line-2'), right: true },
    ],
  });
}

/** A click on an event or a decision goes to its moment. */
function linkMoments(replay: Replay): void {
  for (const row of document.querySelectorAll<HTMLElement>('tr[data-t]')) {
    row.addEventListener('click', () => replay.set(Number(row.dataset.t)));
  }
}

export async function showRun(run: RunPayload): Promise<void> {
  const [cloud, truth, estimate, x, y, flight, coverage] = await Promise.all([
    decodeAll(run.cloud.points),
    decodeTrack(run.tracks.truth),
    decodeTrack(run.tracks.estimate),
    decode(run.decisions.x),
    decode(run.decisions.y),
    decodeAll(run.flight),
    decodeAll(run.coverage),
  ]);
  const replay = new Replay(run.duration_s);
  const section = byId('replay');
  section.replaceChildren(element('h2', {}, 'Replay'));
  const transport = element('div', { class: 'transport' }, replay.play, replay.slider, speedChoice(replay));
  transport.append(readout(replay, flight));
  addScene(section, transport, replay, { run, cloud, truth, estimate, candidates: { x, y } });
  followOnMap(replay, truth ?? estimate);

  const charts = element('div', { id: 'charts' });
  const againstTime = byId('against-time');
  againstTime.replaceChildren(element('h2', {}, 'Against time'), charts);
  const pick = (time: number) => replay.set(time);
  coverageCharts(charts, coverage, pick);
  flightCharts(charts, flight, pick);
  againstTime.hidden = charts.childElementCount === 0;
  replay.onChange(setMark);
  linkMoments(replay);
  // report.html#t=70 opens at that moment.
  const asked = Number(new URLSearchParams(location.hash.slice(1)).get('t') ?? NaN);
  replay.set(Number.isFinite(asked) ? asked : run.duration_s);
}
