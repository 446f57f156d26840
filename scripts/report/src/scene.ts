// The 3D view: the cloud in the order of its first sight, both paths, targets, the vehicle.

import {
  BufferAttribute,
  BufferGeometry,
  Color,
  ConeGeometry,
  Group,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Plane,
  Points,
  PointsMaterial,
  Scene,
  SphereGeometry,
  TorusGeometry,
  Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { onThemeChange, themeColour } from './dom';
import { Columns, RunPayload, Track, indexAt } from './payload';

/** Google's turbo colour map (Mikhailov 2019), fitted by polynomials. */
function turbo(u: number): [number, number, number] {
  const poly = (c: number[]) => c.reduceRight((sum, k) => sum * u + k, 0);
  const channel = (c: number[]) => Math.min(1, Math.max(0, poly(c)));
  return [
    channel([0.13572138, 4.6153926, -42.66032258, 132.13108234, -152.94239396, 59.28637943]),
    channel([0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604]),
    channel([0.1066733, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973]),
  ];
}

const LEAST_POINT_PX = 1.8;

function pixelRatio(): number {
  return Math.min(devicePixelRatio, 2);
}

function percentile(values: Float64Array, share: number): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];
}

/** Discs instead of squares, and never so small that a far surface dissolves into dust. */
function makeRound(material: PointsMaterial): void {
  material.onBeforeCompile = (shader) => {
    const round = 'void main() { if (length(gl_PointCoord - 0.5) > 0.5) discard;';
    shader.fragmentShader = shader.fragmentShader.replace('void main() {', round);
    const least = `gl_PointSize = max(gl_PointSize, ${(LEAST_POINT_PX * pixelRatio()).toFixed(2)});\n`;
    const last = '#include <logdepthbuf_vertex>';
    shader.vertexShader = shader.vertexShader.replace(last, least + last);
  };
}

/** What a point must measure so that the points together close the surfaces they lie on, m. */
function closingSize(cloud: Columns, below: number): number {
  const counts = new Map<number, number>(); // of points in columns of 1 m^2
  for (let i = 0; i < cloud.z.length; ++i) {
    if (cloud.z[i] > below) continue;
    const cell = Math.floor(cloud.x[i]) * 0x10000 + Math.floor(cloud.y[i]);
    counts.set(cell, (counts.get(cell) ?? 0) + 1);
  }
  if (counts.size === 0) return 0.1;
  // Discs of 1.5 times their spacing, lying at random, leave a sixth of the ground open.
  const spacing = 1 / Math.sqrt(percentile(Float64Array.from(counts.values()), 0.4));
  return Math.min(0.5, Math.max(0.1, 1.5 * spacing));
}

/** A path that grows: `upTo` shows its beginning. */
class GrowingLine {
  /** The line, and its ghost that shines through what hides it. */
  readonly lines: Line2[];

  constructor(private track: Track, private colour: string, width: number, dashed: boolean) {
    const positions: number[] = [];
    for (let i = 0; i < track.t.length; ++i) positions.push(track.x[i], track.y[i], track.z[i]);
    const geometry = new LineGeometry();
    geometry.setPositions(positions);
    const look = { linewidth: width, dashed, dashSize: 0.5, gapSize: 0.35 };
    const ghost = { ...look, depthTest: false, transparent: true, opacity: 0.35 };
    this.lines = [new LineMaterial(look), new LineMaterial(ghost)].map((material) => {
      const line = new Line2(geometry, material);
      if (dashed) line.computeLineDistances();
      line.frustumCulled = false;
      return line;
    });
    this.paint();
  }

  upTo(time: number, shown: boolean): void {
    const corners = indexAt(this.track.t, time) + 1;
    this.lines[0].geometry.instanceCount = Math.max(0, corners - 1);
    for (const line of this.lines) line.visible = shown && corners > 1;
  }

  paint(): void {
    for (const line of this.lines) line.material.color.set(themeColour(this.colour));
  }
}

function vehicleMesh(): Group {
  const group = new Group();
  const material = new MeshBasicMaterial();
  const nose = new Mesh(new ConeGeometry(0.16, 0.55, 16), material);
  nose.rotation.z = -Math.PI / 2; // along +x
  group.add(nose);
  for (const [x, y] of [[0.3, 0.3], [0.3, -0.3], [-0.3, 0.3], [-0.3, -0.3]]) {
    const ring = new Mesh(new TorusGeometry(0.2, 0.035, 8, 24), material);
    ring.position.set(x, y, 0.05);
    group.add(ring);
  }
  return group;
}

/** Whether something hangs over most of the path: then a look from above needs a cut. */
function ceilingOver(cloud: Columns, track: Track, level: number): boolean {
  const covered = new Set<string>();
  const cell = (x: number, y: number) => `${Math.floor(x)},${Math.floor(y)}`;
  for (let i = 0; i < cloud.z.length; ++i) {
    if (cloud.z[i] > level + 0.3 && cloud.z[i] < level + 4) covered.add(cell(cloud.x[i], cloud.y[i]));
  }
  let under = 0;
  for (let i = 0; i < track.t.length; ++i) if (covered.has(cell(track.x[i], track.y[i]))) ++under;
  return under > 0.6 * track.t.length;
}

export interface SceneData {
  run: RunPayload;
  cloud: Columns;
  truth: Track | null;
  estimate: Track | null;
  candidates: { x: Float64Array; y: Float64Array };
}

export type Layer = 'cloud' | 'truth' | 'estimate' | 'targets' | 'candidates';

export class FlightScene {
  readonly canvas: HTMLCanvasElement;
  readonly heights: [number, number];
  /** Where the view cuts at first; nothing if it looks in from above as it is. */
  readonly firstCut: number | null;
  follow = false;

  private renderer: WebGLRenderer;
  private scene = new Scene();
  private camera = new PerspectiveCamera(50, 1, 0.1, 2000);
  private controls: OrbitControls;
  private cut = new Plane(new Vector3(0, 0, -1), 1e6);
  private points: Points | null = null;
  private lines: Partial<Record<'truth' | 'estimate', GrowingLine>> = {};
  private targets: { mesh: Mesh; t: number; reached: boolean }[] = [];
  private candidates: Points | null = null;
  private shown: Record<Layer, boolean> = {
    cloud: true, truth: true, estimate: true, targets: true, candidates: true,
  };
  private vehicle = vehicleMesh();
  private time = 0;
  private asked = false;
  private printed = document.createElement('canvas');

  static possible(): boolean {
    return document.createElement('canvas').getContext('webgl2') !== null;
  }

  /** @pre possible() */
  constructor(box: HTMLElement, private data: SceneData) {
    // Kept so that a picture can be taken at any time.
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.canvas = this.renderer.domElement;
    this.canvas.setAttribute('role', 'img');
    this.canvas.setAttribute('aria-label', 'Three-dimensional view of the map and the flight');
    this.printed.className = 'printed';
    box.append(this.canvas, this.printed);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener('change', () => this.ask());
    // The wheel scrolls the page until the view has been touched.
    this.controls.enableZoom = false;
    this.canvas.addEventListener('pointerdown', () => (this.controls.enableZoom = true));
    this.canvas.addEventListener('pointerleave', (event) => {
      if (event.pointerType === 'mouse') this.controls.enableZoom = false;
    });

    const { cloud } = data;
    this.heights = cloud.z.length ? [percentile(cloud.z, 0.001), percentile(cloud.z, 0.999)] : [0, 1];
    const track = data.truth ?? data.estimate;
    const level = track ? percentile(track.z, 0.5) : 0;
    // Under a ceiling or in a wood, whatever is above the flight hides it.
    const above = cloud.z.reduce((count, z) => count + Number(z > level + 1.5), 0);
    this.firstCut = track && ceilingOver(cloud, track, level) ? level + 0.5
      : track && above > 0.15 * cloud.z.length ? level + 1.5 : null;
    this.addCloud();
    for (const [name, width] of [['truth', 3], ['estimate', 2.5]] as const) {
      const path = data[name];
      if (!path || path.t.length < 2) continue;
      this.lines[name] = new GrowingLine(path, `--${name}`, width, name === 'truth');
      this.scene.add(...this.lines[name].lines);
    }
    this.addTargets();
    this.addCandidates();
    this.scene.add(this.vehicle);
    this.paint();
    new ResizeObserver(() => this.resize(box)).observe(box);
    this.resize(box);
    this.overview();
    onThemeChange(() => {
      this.paint();
      this.draw();
      this.copyForPrint();
    });
  }

  /** Looks at the whole flight and the map around it from a corner above. */
  overview(): void {
    const axes = (['x', 'y', 'z'] as const).map((axis) => {
      const ends = [this.data.truth, this.data.estimate, this.data.cloud]
        .filter((of) => of !== null && of[axis].length > 0)
        .flatMap((of) => [percentile(of![axis], 0.005), percentile(of![axis], 0.995)]);
      return [Math.min(...ends), Math.max(...ends)];
    });
    if (!Number.isFinite(axes[0][0])) return;
    if (this.firstCut !== null) axes[2][1] = Math.max(axes[2][0], Math.min(axes[2][1], this.firstCut));
    this.fit(axes, new Vector3(-0.45, -0.95, 1.0).normalize());
    this.controls.update();
    this.ask();
  }

  /** Places the camera in a direction so that a box just fills the view. */
  private fit(axes: number[][], towardsCamera: Vector3): void {
    const centre = new Vector3(...axes.map(([low, high]) => (low + high) / 2));
    const forward = towardsCamera.clone().negate();
    const right = forward.clone().cross(this.camera.up).normalize();
    const up = right.clone().cross(forward);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((i) =>
      new Vector3(axes[0][i & 1], axes[1][(i >> 1) & 1], axes[2][(i >> 2) & 1]).sub(centre));
    // A corner at depth z in front of the centre is inside while |offset| <= (distance + z) slope.
    const tangent = Math.tan((this.camera.fov * Math.PI) / 360);
    const along = (axis: Vector3, slope: number) => {
      const ends = corners.map((c) => [c.dot(axis), slope * c.dot(forward)]);
      const high = Math.max(...ends.map(([offset, depth]) => offset - depth));
      const low = Math.min(...ends.map(([offset, depth]) => offset + depth));
      return { shift: (high + low) / 2, distance: (high - low) / (2 * slope) };
    };
    const across = along(right, tangent * this.camera.aspect);
    const upwards = along(up, tangent);
    const distance = 1.05 * Math.max(5, across.distance, upwards.distance);
    const target = centre.addScaledVector(right, across.shift).addScaledVector(up, upwards.shift);
    this.controls.target.copy(target);
    this.camera.position.copy(target).addScaledVector(towardsCamera, distance);
  }

  show(layer: Layer, visible: boolean): void {
    this.shown[layer] = visible;
    this.setTime(this.time);
  }

  /** Leaves out what is above `height` in O. */
  setCut(height: number): void {
    this.cut.constant = height;
    this.ask();
  }

  /** The world as it was known at `time`. */
  setTime(time: number): void {
    this.time = time;
    const { run, truth, estimate } = this.data;
    if (this.points) {
      const { t, count } = run.cloud.growth;
      const seen = t.length === 0 ? Infinity : (count[indexAt(t, time)] ?? 0);
      this.points.geometry.setDrawRange(0, Math.min(seen, this.data.cloud.x.length));
      this.points.visible = this.shown.cloud;
    }
    for (const name of ['truth', 'estimate'] as const) {
      this.lines[name]?.upTo(time, this.shown[name]);
    }
    this.showTargets(time);
    this.showCandidates(time);
    const track = truth ?? estimate;
    if (track && track.t.length > 0) this.moveVehicle(track, Math.max(0, indexAt(track.t, time)));
    this.ask();
  }

  private moveVehicle(track: Track, i: number): void {
    const before = this.vehicle.position.clone();
    this.vehicle.position.set(track.x[i], track.y[i], track.z[i]);
    this.vehicle.rotation.z = track.yaw[i];
    if (!this.follow) return;
    this.camera.position.add(this.vehicle.position).sub(before);
    this.controls.target.copy(this.vehicle.position);
    this.controls.update();
  }

  /** Goes behind the vehicle and stays with it. */
  startFollowing(): void {
    this.follow = true;
    const yaw = this.vehicle.rotation.z;
    this.controls.target.copy(this.vehicle.position);
    this.camera.position
      .copy(this.vehicle.position)
      .add(new Vector3(-7 * Math.cos(yaw), -7 * Math.sin(yaw), 4));
    this.controls.update();
    this.ask();
  }

  private addCloud(): void {
    const { x, y, z } = this.data.cloud;
    if (x.length === 0) return;
    const positions = new Float32Array(3 * x.length);
    const colours = new Uint8Array(3 * x.length);
    const below = this.firstCut === null ? z : z.filter((height) => height < this.firstCut!);
    const low = percentile(below, 0.02);
    const high = percentile(below, 0.98);
    const colour = new Color();
    for (let i = 0; i < x.length; ++i) {
      positions.set([x[i], y[i], z[i]], 3 * i);
      const u = Math.min(1, Math.max(0, (z[i] - low) / (high - low || 1)));
      colour.setRGB(...turbo(0.06 + 0.86 * u), 'srgb');
      colours.set([255 * colour.r, 255 * colour.g, 255 * colour.b], 3 * i);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setAttribute('color', new BufferAttribute(colours, 3, true));
    const size = closingSize(this.data.cloud, this.firstCut ?? Infinity);
    const material = new PointsMaterial({ size, vertexColors: true, clippingPlanes: [this.cut] });
    makeRound(material);
    this.points = new Points(geometry, material);
    this.points.frustumCulled = false;
    this.scene.add(this.points);
  }

  private addTargets(): void {
    for (const target of this.data.run.targets) {
      const mesh = new Mesh(new SphereGeometry(0.35, 16, 12), new MeshBasicMaterial());
      mesh.position.set(target.x, target.y, target.z);
      this.targets.push({ mesh, t: target.t, reached: target.reached });
      this.scene.add(mesh);
    }
  }

  private showTargets(time: number): void {
    const current = this.targets.reduce((last, { t }, i) => (t <= time ? i : last), -1);
    this.targets.forEach(({ mesh, t }, i) => {
      mesh.visible = this.shown.targets && t <= time;
      mesh.scale.setScalar(i === current ? 1.5 : 0.7);
    });
  }

  private addCandidates(): void {
    const { x, y } = this.data.candidates;
    if (x.length === 0) return;
    const geometry = new BufferGeometry();
    const positions = new Float32Array(3 * x.length);
    const { t, first } = this.data.run.decisions;
    for (let d = 0; d < t.length; ++d) {
      const height = this.targetHeight(t[d]);
      for (let i = first[d]; i < first[d + 1]; ++i) positions.set([x[i], y[i], height], 3 * i);
    }
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    const colours = new Uint8Array(3 * x.length);
    geometry.setAttribute('color', new BufferAttribute(colours, 3, true));
    const material = new PointsMaterial({ size: 6, sizeAttenuation: false, vertexColors: true });
    makeRound(material);
    this.candidates = new Points(geometry, material);
    this.candidates.frustumCulled = false;
    this.scene.add(this.candidates);
  }

  /** The height that the mission flies at: that of its newest target. */
  private targetHeight(time: number): number {
    const { targets } = this.data.run;
    const newest = indexAt(targets.map((target) => target.t), time + 1);
    return targets[Math.max(0, newest)]?.z ?? 1.5;
  }

  private showCandidates(time: number): void {
    if (!this.candidates) return;
    const { t, first } = this.data.run.decisions;
    const decision = indexAt(t, time);
    this.candidates.visible = this.shown.candidates && decision >= 0 && time - t[decision] < 15;
    if (decision < 0) return;
    this.candidates.geometry.setDrawRange(first[decision], first[decision + 1] - first[decision]);
  }

  private paint(): void {
    this.scene.background = new Color(themeColour('--scene'));
    this.lines.truth?.paint();
    this.lines.estimate?.paint();
    // Full turbo is pale on a light page.
    (this.points?.material as PointsMaterial | undefined)?.color.set(themeColour('--cloud-tint'));
    const vehicle = (this.vehicle.children[0] as Mesh).material as MeshBasicMaterial;
    vehicle.color.set(themeColour('--vehicle'));
    for (const { mesh, reached } of this.targets) {
      (mesh.material as MeshBasicMaterial).color.set(themeColour(reached ? '--good' : '--target'));
    }
    if (!this.candidates) return;
    const colours = this.candidates.geometry.getAttribute('color');
    const kept = new Color(themeColour('--candidate'));
    const dropped = new Color(themeColour('--muted'));
    const winner = new Color(themeColour('--target'));
    const { verdict } = this.data.run.decisions;
    for (let i = 0; i < verdict.length; ++i) {
      const colour = verdict[i] === 'w' ? winner : verdict[i] === 'k' ? kept : dropped;
      colours.setXYZ(i, colour.r, colour.g, colour.b);
    }
    colours.needsUpdate = true;
  }

  private resize(box: HTMLElement): void {
    const width = Math.max(1, box.clientWidth);
    const height = Math.max(1, box.clientHeight);
    this.renderer.setPixelRatio(pixelRatio());
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Browsers print the frame that was last on the screen, in its colours: paper gets a copy. */
  private copyForPrint(): void {
    if (!matchMedia('print').matches) return;
    this.printed.width = this.canvas.width;
    this.printed.height = this.canvas.height;

    this.printed.getContext('2d')?.drawImage(this.canvas, 0, 0);
  }

  private ask(): void {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => this.draw());
  }

  private draw(): void {
    this.asked = false;
    this.renderer.render(this.scene, this.camera);
  }
}
