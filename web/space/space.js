// Scenes in space, drawn by the browser. `labkit/stage/stage.js` loads this once a page, opens a `View` for each Stage that
// declares spaces, and hands it what Stage sends. Turning needs no Python; where one looks from is told with the next message.
//
// Whoever shows Stages without Python (a reading edition) sets globalThis[Symbol.for("labkit.space")] to
// () => import("./space.js") before; the declaration and one recorded message with `space` and its numbers are enough.

import { Renderer } from "./renderer.js";
import { dot } from "./solids.js";

const DEGREES_PER_PIXEL = 0.5;
const ZOOM = [0.2, 12];
const MAX_PIXELS = 3e6;
const SLOW = 30; // ms a picture may take until it is drawn coarser while it moves
const CALM = 160; // ms of rest until it is drawn as sharply as it can be
const SCALES = [1, 0.75, 0.5];
const AXIS_VIEWS = { x: [0, 0], y: [90, 0], z: [-90, 90] };
const LETTER = 12; // CSS pixels

let renderer = null;
let refused = false;
const views = new Set();

/** Whether this page can draw; the context is made when it is first asked for. */
export function works() {
  if (renderer) return !renderer.lost;
  if (refused) return false;
  try {
    renderer = new Renderer(() => { for (const view of views) view.onAble(); });
  } catch {
    refused = true;
  }
  return !refused;
}

const radians = (deg) => (deg * Math.PI) / 180;
const clip = (x, low, high) => Math.min(high, Math.max(low, x));
const parsed = new Map();

/** [r, g, b] from a color as Python writes it. */
function rgb(hex) {
  if (!parsed.has(hex)) parsed.set(hex, [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255));
  return parsed.get(hex);
}

/** All scenes of one Stage: they share where one looks from. */
export class View {
  /** place: the element with the picture; target: what has the focus and the pointer; home: where one looks from at
   *  first; onMove(): handles follow; onAble(): whether this page can draw has changed. */
  constructor(place, target, spaces, home, { onMove, onAble }) {
    Object.assign(this, { place, target, onMove, onAble, shown: false, dirty: false, frame: 0, calm: 0, coarse: 0, slow: 0, moving: false, told: true });
    this.scenes = spaces.map((space) => new Scene(space, this));
    Object.assign(this, { home, state: home });
    this.dark = false;
    this.pointers = new Map();
    this.tools = this.makeTools();
    this.target.after(...this.scenes.map((scene) => scene.canvas)); // below the handles
    this.place.append(this.tools);
    this.watch = new IntersectionObserver((entries) => {
      this.seen = entries.some((entry) => entry.isIntersecting);
      if (this.seen && this.dirty) this.request();
    });
    this.watch.observe(place);
    this.seen = true;
    this.listen();
    views.add(this);
  }

  makeTools() {
    const box = document.createElement("div");
    box.className = "looks";
    for (const [text, label, act] of [
      ["x", "look along x", () => this.look(...AXIS_VIEWS.x)], ["y", "look along y", () => this.look(...AXIS_VIEWS.y)],
      ["z", "look down z", () => this.look(...AXIS_VIEWS.z)], ["+", "nearer", () => this.zoom(1.25)],
      ["−", "farther", () => this.zoom(0.8)], ["⌂", "home view", () => this.goHome()],
    ]) {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = text;
      button.title = label;
      button.setAttribute("aria-label", label);
      button.dataset.lmSuppressShortcuts = "true";
      button.addEventListener("click", act);
      box.append(button);
    }
    return box;
  }

  listen() {
    const on = (type, act, options) => this.target.addEventListener(type, act, { signal: this.ended.signal, ...options });
    this.ended = new AbortController();
    on("wheel", (event) => { // a pinch of a touch pad is a wheel with Ctrl; without it the page scrolls
      if (!this.shown || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      this.zoom(Math.exp(-0.004 * clip(event.deltaY, -120, 120)));
    }, { passive: false });
    on("contextmenu", (event) => this.shown && event.preventDefault());
    on("keydown", (event) => this.key(event), { capture: true });
    on("pointerdown", (event) => this.down(event), { capture: true });
    on("pointermove", (event) => this.moved(event), { capture: true });
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) on(type, (event) => this.pointers.delete(event.pointerId), { capture: true });
  }

  /** Two fingers, the right button or Shift move and zoom; one finger turns, by stage.js. */
  down(event) {
    if (!this.shown) return;
    const pans = event.button === 2 || event.button === 1 || (event.button === 0 && event.shiftKey);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, pans });
    if (!pans && this.pointers.size < 2) return;
    this.target.setPointerCapture?.(event.pointerId);
    this.target.focus({ preventScroll: true });
    event.stopImmediatePropagation();
    event.preventDefault();
  }

  moved(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const [right, down] = [event.clientX - last.x, event.clientY - last.y];
    const others = [...this.pointers.entries()].filter(([id]) => id !== event.pointerId);
    if (others.length) {
      const other = others[0][1];
      const before = Math.hypot(last.x - other.x, last.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 8 && after > 8) this.zoom(after / before);
      this.pan(right / 2, down / 2);
    } else if (last.pans) this.pan(right, down);
    Object.assign(last, { x: event.clientX, y: event.clientY });
    if (others.length || last.pans) event.stopImmediatePropagation();
  }

  key(event) {
    if (!this.shown || event.ctrlKey || event.metaKey || event.altKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (arrow && event.shiftKey) this.pan(20 * arrow[0], -20 * arrow[1]);
    else if (event.key in AXIS_VIEWS) this.look(...AXIS_VIEWS[event.key]);
    else if (event.key === "Home") this.goHome();
    else if (event.key === "+" || event.key === "=") this.zoom(1.25);
    else if (event.key === "-") this.zoom(0.8);
    else return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }

  // -- where one looks from

  turn(right, up) {
    const { azimuth, elevation } = this.state;
    this.go({ azimuth: (azimuth + DEGREES_PER_PIXEL * right + 720) % 360, elevation: clip(elevation + DEGREES_PER_PIXEL * up, -90, 90) });
  }

  pan(right, down) {
    const [x, y] = this.axes();
    const size = this.scenes[0].unitsPerPixel() / this.state.zoom;
    this.go({ center: this.state.center.map((c, k) => c - size * (right * x[k] - down * y[k])) });
  }

  zoom(factor) {
    this.go({ zoom: clip(this.state.zoom * factor, ...ZOOM) });
  }

  look(azimuth, elevation) {
    this.go({ azimuth, elevation });
  }

  goHome() {
    this.go(this.home);
  }

  go(changes) {
    this.state = { ...this.state, ...changes };
    this.told = false;
    this.stir();
    this.onMove();
  }

  /** Something moves: quick pictures now, a sharp one once it has come to rest. */
  stir() {
    this.moving = true;
    this.place.dataset.rest = false;
    clearTimeout(this.calm);
    this.calm = setTimeout(() => { this.moving = false; this.request(); }, CALM);
    this.request();
  }

  /** For Python, once for each change. */
  news() {
    if (this.told) return undefined;
    this.told = true;
    const { azimuth, elevation, zoom, center } = this.state;
    return { angles: [azimuth, elevation], zoom, center };
  }

  axes() {
    const { azimuth, elevation } = this.state;
    const [ca, sa, ce, se] = [Math.cos(radians(azimuth)), Math.sin(radians(azimuth)), Math.cos(radians(elevation)), Math.sin(radians(elevation))];
    return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
  }

  // -- what Python sends

  receive({ places, rows, view }, numbers, dark) {
    this.dark = dark;
    if (view) Object.assign(this, { state: view, told: true });
    let used = 0;
    this.scenes.forEach((scene, k) => {
      scene.place = places[k];
      for (const [number, shown, count, words] of rows[k]) {
        scene.items[number].set(shown, numbers.subarray(used, used + count), words);
        used += count;
      }
    });
    this.show(true);
    this.stir();
  }

  show(on) {
    this.shown = on;
    for (const { canvas } of this.scenes) canvas.hidden = !on;
    this.tools.hidden = !on;
    this.target.dataset.space = on;
  }

  /** Where a point is, in fractions of the picture: right, down. */
  fraction(point, scene = 0) {
    return this.scenes[scene].fraction(point);
  }

  request() {
    this.dirty = true;
    if (!this.frame && this.seen) this.frame = requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.frame = 0;
    if (!this.shown || renderer.lost) return;
    this.dirty = false;
    const start = performance.now();
    const scale = this.moving ? SCALES[this.coarse] : 1;
    for (const scene of this.scenes) scene.draw(scale);
    const took = performance.now() - start;
    if (this.moving) this.adapt(took);
    this.place.dataset.pictures = Number(this.place.dataset.pictures ?? 0) + 1; // for benchmarks and tests
    this.place.dataset.rest = !this.moving;
    this.place.dataset.triangles = this.scenes.reduce((sum, scene) => sum + scene.triangles, 0);
    this.place.dataset.took = took.toFixed(1);
  }

  /** Coarser after several slow pictures, finer after many quick ones. */
  adapt(took) {
    this.slow = took > SLOW ? Math.max(1, this.slow + 1) : took < SLOW / 3 ? Math.min(-1, this.slow - 1) : 0;
    if (this.slow >= 3) [this.coarse, this.slow] = [Math.min(this.coarse + 1, SCALES.length - 1), 0];
    else if (this.slow <= -20) [this.coarse, this.slow] = [Math.max(this.coarse - 1, 0), 0];
  }

  close() {
    this.ended.abort();
    this.watch.disconnect();
    cancelAnimationFrame(this.frame);
    clearTimeout(this.calm);
    for (const scene of this.scenes) scene.close();
    this.tools.remove();
    views.delete(this);
  }
}

/** One scene: its things and its canvas. */
class Scene {
  constructor({ radius, halfWidth, unit, floor, colors, items }, view) {
    Object.assign(this, { radius, halfWidth, unit, floor, colors, view, place: null });
    this.items = items.map((item) => new { path: Path, text: Words, triad: Triad, body: Body }[item.kind](item, this));
    this.canvas = document.createElement("canvas");
    this.canvas.className = "space";
    this.canvas.setAttribute("aria-hidden", "true"); // the picture below bears the name and the words
    this.paper = this.canvas.getContext("2d");
  }

  unitsPerPixel() {
    return this.place[4] / this.view.place.clientWidth;
  }

  fraction(point) {
    const [left, top, width, height, units] = this.place;
    const { center, eye, zoom } = this.view.state;
    const p = this.view.axes().map((axis) => dot(axis, point.map((v, k) => v - center[k])));
    const near = zoom / (eye > 0 ? Math.max(1 - p[2] / eye, 0.05) : 1);
    const aspect = this.view.place.clientWidth / this.view.place.clientHeight;
    return [left + width / 2 + (near * p[0]) / units, top + height / 2 - (near * p[1] * aspect) / units];
  }

  draw(scale) {
    const [left, top, width, height, units] = this.place;
    const room = this.view.place;
    const [cssWidth, cssHeight] = [width * room.clientWidth, height * room.clientHeight];
    if (cssWidth < 2 || cssHeight < 2) return;
    Object.assign(this.canvas.style, { left: `${100 * left}%`, top: `${100 * top}%`, width: `${100 * width}%`, height: `${100 * height}%` });
    Object.assign(this.view.tools.style, { top: `${100 * top}%`, right: `${100 * (1 - left - width)}%` });
    const ratio = Math.min(window.devicePixelRatio || 1, Math.sqrt(MAX_PIXELS / (cssWidth * cssHeight)));
    const [w, h] = [Math.round(cssWidth * ratio), Math.round(cssHeight * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h });
    const [dw, dh] = [Math.round(w * scale), Math.round(h * scale)];
    const { zoom, eye, center } = this.view.state;
    const [x, y, z] = this.view.axes();
    const pixels = (zoom * room.clientWidth) / units; // CSS pixels a unit, at the center
    const drawn = dw / cssWidth; // device pixels a CSS pixel
    const lens = {
      axes: [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]], center, eye, perUnit: pixels * drawn,
      scale: [(2 * pixels) / cssWidth, (2 * pixels) / cssHeight], reach: 12 * Math.max(this.radius, this.halfWidth),
    };
    const solids = [];
    const paths = [];
    for (const item of this.items) if (item.shown) item.give(solids, paths, { dark: this.view.dark, ratio: drawn, turn: [x, y, z] });
    this.triangles = solids.reduce((sum, { mesh }) => sum + mesh.triangles, 0);
    const shadow = z[2] > 0 ? (this.view.dark ? [0, 0, 0, 0.5] : [0, 0, 0, 0.16]) : null;
    renderer.draw(dw, dh, lens, { solids, paths, floor: this.floor, shadow }, !(renderer.software && this.view.moving));
    this.paper.setTransform(1, 0, 0, 1, 0, 0); // `write` leaves CSS pixels behind
    this.paper.clearRect(0, 0, w, h);
    this.paper.imageSmoothingQuality = "high";
    this.paper.drawImage(renderer.canvas, 0, 0, dw, dh, 0, 0, w, h);
    this.write(w / cssWidth, cssWidth, cssHeight, pixels);
  }

  /** Words, the scale and the base frame in the corner, in CSS pixels. */
  write(ratio, width, height, pixels) {
    const { paper } = this;
    const dark = Number(this.view.dark);
    const [left, top, wide, high] = this.place;
    const room = this.view.place;
    const style = getComputedStyle(room);
    const size = (parseFloat(style.fontSize) / 13) * LETTER;
    paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    const at = (point) => {
      const [right, down] = this.fraction(point);
      return [((right - left) / wide) * width, ((down - top) / high) * height];
    };
    const pen = {
      halo: `${this.colors.paper[dark]}c0`, ink: this.colors.muted[dark],
      write: (text, x, y, { color, bold = false, scale = 1, align = "center", baseline = "middle" }) => {
        paper.font = `${bold ? "bold " : ""}${(scale * size).toFixed(1)}px ${style.fontFamily}`;
        Object.assign(paper, { textAlign: align, textBaseline: baseline, lineWidth: 3, strokeStyle: pen.halo, fillStyle: color, lineJoin: "round" });
        for (const [k, row] of text.split("\n").entries()) {
          paper.strokeText(row, x, y + k * 1.25 * scale * size);
          paper.fillText(row, x, y + k * 1.25 * scale * size);
        }
      },
    };
    for (const item of this.items) if (item.shown) item.write?.(pen, at, this.view.dark);
    this.writeScale(pen, width, height, pixels, size);
    this.writeBase(pen, height, size);
  }

  writeScale(pen, width, height, pixels, size) {
    if (!this.unit) return;
    const { paper } = this;
    let length = 10 ** Math.floor(Math.log10(0.25 * width / pixels));
    length *= [5, 2, 1].find((m) => m * length * pixels <= 0.25 * width) ?? 1;
    const [x, y] = [width - 10, height - 8];
    paper.strokeStyle = pen.ink;
    paper.lineWidth = 1.5;
    paper.beginPath();
    paper.moveTo(x - length * pixels, y - 4);
    paper.lineTo(x - length * pixels, y);
    paper.lineTo(x, y);
    paper.lineTo(x, y - 4);
    paper.stroke();
    pen.write(`${Number(length.toPrecision(3))} ${this.unit}`, x - (length * pixels) / 2, y - 0.75 * size, { color: pen.ink, scale: 0.85 });
  }

  writeBase(pen, height, size) {
    const { paper } = this;
    const axes = this.view.axes();
    const [x, y, length] = [1.9 * size, height - 1.9 * size, 1.35 * size];
    const colors = this.colors.axes.map((pair) => pair[Number(this.view.dark)]);
    const order = [0, 1, 2].sort((a, b) => axes[2][a] - axes[2][b]);
    for (const k of order) {
      const [right, up] = [axes[0][k], axes[1][k]];
      paper.globalAlpha = axes[2][k] < -0.1 ? 0.45 : 1;
      paper.strokeStyle = colors[k];
      paper.lineWidth = 2;
      paper.beginPath();
      paper.moveTo(x, y);
      paper.lineTo(x + length * right, y - length * up);
      paper.stroke();
      if (Math.hypot(right, up) > 0.2) pen.write("xyz"[k], x + 1.35 * length * right, y - 1.35 * length * up, { color: colors[k], scale: 0.8 });
    }
    paper.globalAlpha = 1;
  }

  close() {
    for (const item of this.items) item.close?.();
    this.canvas.remove();
  }
}

/** A line, single points, or both. */
class Path {
  constructor(declared) {
    Object.assign(this, declared, { shown: false, changed: false, age: -1, lineInfo: null, pointInfo: null });
    this.numbers = new Float32Array();
  }

  set(shown, numbers) {
    Object.assign(this, { shown: Boolean(shown), numbers: numbers.slice(), changed: true });
  }

  give(solids, paths, { dark, ratio }) {
    if (this.age !== renderer.age) Object.assign(this, { age: renderer.age, changed: true, lineInfo: null, pointInfo: null });
    if (this.changed) {
      if (this.width > 0) this.lineInfo = renderer.segments(this.lineInfo, segmentsOf(this.numbers));
      if (this.marker) this.pointInfo = renderer.points(this.pointInfo, finite(this.numbers));
      this.changed = false;
    }
    const thick = this.width * ratio;
    paths.push({
      line: this.lineInfo, points: this.pointInfo, color: [...rgb(this.color[Number(dark)]), this.opacity], width: thick,
      dash: [[0, 0], [4.2 * Math.max(thick, 2 * ratio), 2.7 * Math.max(thick, 2 * ratio)], [2.6 * Math.max(thick, 1.5 * ratio), 1.2 * Math.max(thick, 1.5 * ratio)]][this.dash],
      size: this.size * (this.marker === "." ? 0.6 : 1) * ratio, marker: this.marker, hollow: this.hollow,
    });
  }

  close() {
    if (this.age !== renderer?.age) return;
    renderer.free(this.lineInfo);
    renderer.free(this.pointInfo);
  }
}

/** From, to, and the length until there, for each piece between two finite points. */
function segmentsOf(points) {
  const count = Math.max(0, points.length / 3 - 1);
  const out = new Float32Array(8 * count);
  let [used, length] = [0, 0];
  for (let k = 0; k < count; k++) {
    const [a, b, c, d, e, f] = points.subarray(3 * k, 3 * k + 6);
    const piece = Math.hypot(d - a, e - b, f - c);
    if (!Number.isFinite(piece)) {
      length = 0;
      continue;
    }
    out.set([a, b, c, d, e, f, length, length + piece], used);
    used += 8;
    length += piece;
  }
  return out.subarray(0, used);
}

function finite(points) {
  const out = [];
  for (let k = 0; k + 2 < points.length; k += 3) if (Number.isFinite(points[k] + points[k + 1] + points[k + 2])) out.push(points[k], points[k + 1], points[k + 2]);
  return new Float32Array(out);
}

/** matplotlib's vertical alignment as a canvas names it. */
const BASELINES = { center: "middle", top: "top", bottom: "bottom", baseline: "alphabetic" };

class Words {
  constructor({ offset, align, baseline, bold, size, color }) {
    Object.assign(this, { offset, align, baseline: BASELINES[baseline], bold, size, color, shown: false });
  }

  set(shown, numbers, words) {
    Object.assign(this, { shown: Boolean(shown), point: [...numbers], words: words ?? "" });
  }

  give() {}

  write(pen, at, dark) {
    const [x, y] = at(this.point);
    if (!Number.isFinite(x)) return;
    pen.write(this.words, x + this.offset[0], y - this.offset[1], { color: this.color[Number(dark)], bold: this.bold, scale: this.size, align: this.align, baseline: this.baseline });
  }
}

/** Rows of a pose to the columns WebGL wants. */
function columns(m) {
  return [m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14], m[3], m[7], m[11], m[15]];
}

/** Product of two matrices in columns. */
function times(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) for (let k = 0; k < 4; k++) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}

/** What turns the normals of a body that may be stretched: its cofactors, in columns. */
function cofactors(m) {
  const [a, b, c] = [m.slice(0, 3), m.slice(4, 7), m.slice(8, 11)];
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  return [cross(b, c), cross(c, a), cross(a, b)];
}

/** Solids as they are drawn: the mesh, where it is, how its normals turn. */
function placed(shape, pose, color, turn) {
  const normals = cofactors(pose);
  const turned = [];
  for (const column of normals) for (const axis of turn) turned.push(dot(axis, column));
  return { mesh: renderer.mesh(shape), pose, color, turn: turned };
}

class Body {
  constructor({ parts }) {
    this.parts = parts.map((part) => ({ ...part, at: columns(part.at) }));
    this.shown = false;
  }

  set(shown, numbers) {
    this.shown = Boolean(shown);
    if (numbers.length !== 16) return;
    const pose = columns(numbers);
    for (const part of this.parts) part.pose = times(pose, part.at);
  }

  give(solids, paths, { dark, turn }) {
    for (const { shape, pose, color, opacity } of this.parts) solids.push(placed(shape, pose, [...rgb(color[Number(dark)]), opacity], turn));
  }
}

const SHAFT = { kind: "turned", profile: [[0, 0], [1, 0], [1, 1], [0, 1]] };
const TIP = { kind: "turned", profile: [[0, 0], [1, 0], [0, 1]] };

class Triad {
  constructor({ length, name, label, broken, width, axes }) {
    Object.assign(this, { length, name, label, broken, axes, radius: Math.max(0.012, 0.006 * width) * length, shown: false });
  }

  set(shown, numbers) {
    this.shown = Boolean(shown);
    if (numbers.length === 16) this.pose = columns(numbers);
  }

  /** A piece of an axis: number, from, to (shares of the length), radius. */
  piece(k, from, to, radius) {
    const L = this.length;
    const local = new Float32Array(16);
    const [u, v] = [(k + 1) % 3, (k + 2) % 3];
    local[u] = radius;
    local[4 + v] = radius;
    local[8 + k] = (to - from) * L;
    local[12 + k] = from * L;
    local[15] = 1;
    return times(this.pose, local);
  }

  give(solids, paths, { dark, turn }) {
    for (let k = 0; k < 3; k++) {
      const color = [...rgb(this.axes[k][Number(dark)]), 1];
      const pieces = this.broken ? [[0, 0.17], [0.26, 0.43], [0.52, 0.69]] : [[0, 0.86]];
      for (const [from, to] of pieces) solids.push(placed(SHAFT, this.piece(k, from, to, this.radius), color, turn));
      solids.push(placed(TIP, this.piece(k, this.broken ? 0.76 : 0.82, 1, 2.6 * this.radius), color, turn));
    }
  }

  write(pen, at, dark) {
    const { pose, length } = this;
    const origin = [pose[12], pose[13], pose[14]];
    const [x, y] = at(origin);
    for (let k = 0; k < 3; k++) {
      const tip = at(origin.map((v, r) => v + 1.13 * length * pose[4 * k + r]));
      if (Math.hypot(tip[0] - x, tip[1] - y) > 6) pen.write("xyz"[k], ...tip, { color: this.axes[k][Number(dark)], scale: 0.9 });
    }
    if (!this.name) return;
    const { offset, align, baseline, color } = this.label;
    pen.write(this.name, x + offset[0], y - offset[1], { color: color[Number(dark)], bold: true, align, baseline: BASELINES[baseline] });
  }
}
