// Scenes in space, drawn by the browser. `labkit/stage/stage.js` loads this once a page, opens a `View` for each Stage that
// declares spaces, and hands it what Stage sends. Turning needs no Python; where one looks from is told with the next message.
//
// The first lines of `stage.js` say how a page without Python gets it; the declaration and one recorded message with
// `space` and its numbers are enough.

import { LINE_NUMBERS, MARKERS, POINT_NUMBERS, Renderer } from "./renderer.js";
import { dot, isClosed } from "./solids.js";
import { PART_NUMBERS } from "./world.js";

const DEGREES_PER_PIXEL = 0.5;
const ZOOM = [0.2, 12];
const MAX_PIXELS = 3e6;
const SLOW = 6; // ms a picture may take until it is drawn coarser while it moves
const CALM = 160; // ms of rest until it is drawn as sharply as it can be,
const HELD = 500; // while a finger or a button is down, which may go on at any moment
const SCALES = [1, 0.75, 0.5];
const AXIS_VIEWS = { x: [0, 0], y: [90, 0], z: [-90, 90] };
const LETTER = 12; // CSS pixels
const CROWDED = 0.85; // a picture narrower than so much of its designed width shrinks, letters too,
const SMALLEST = 0.85; // here down to so much of their size, which a phone still shows: panels there stand under each other
const MARKED = 300; // CSS pixels: a scene less high has smaller points, for they are not read,
const LEAST_MARK = 0.6; // down to so much of their size
const EARLY = "200px"; // so near to the window a scene is drawn

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
   *  first; onMove(): handles follow; onAble(): whether this page can draw has changed; seat(tools): where the
   *  buttons of the view go, beside the picture, not on it; width: the picture's as designed, CSS pixels. */
  constructor(place, target, spaces, home, { onMove, onAble, seat, width }) {
    Object.assign(this, { width, place, target, onMove, onAble, shown: false, dirty: false, frame: 0, calm: 0, coarse: 0, slow: 0, moving: false, told: true, turned: false, held: false });
    this.scenes = spaces.map((space) => new Scene(space, this));
    Object.assign(this, { home, state: home });
    this.dark = false;
    this.pointers = new Map();
    this.tools = this.makeTools();
    this.target.after(...this.scenes.map((scene) => scene.canvas)); // below the handles
    seat(this.tools);
    this.watch = new IntersectionObserver((entries) => {
      this.seen = entries[entries.length - 1].isIntersecting;
      if (this.seen && this.dirty) this.request();
      else if (!this.seen) this.rest();
    }, { rootMargin: EARLY, scrollMargin: EARLY });
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
    window.addEventListener("beforeprint", () => this.draw(), { signal: this.ended.signal });
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
    this.place.addEventListener("pointerdown", () => { this.held = true; }, { signal: this.ended.signal, capture: true });
    for (const type of ["pointerup", "pointercancel"]) window.addEventListener(type, () => this.letGo(), { signal: this.ended.signal, capture: true });
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
    Object.assign(this, { told: false, turned: true });
    this.stir();
  }

  /** Something moves: quick pictures now, a sharp one once it has come to rest. */
  stir() {
    this.moving = true;
    this.place.dataset.rest = false;
    this.settle();
    this.request();
  }

  settle() {
    clearTimeout(this.calm);
    this.calm = setTimeout(() => { this.moving = false; this.request(); }, this.held ? HELD : CALM);
  }

  letGo() {
    if (!this.held) return;
    this.held = false;
    if (this.moving) this.settle();
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
        scene.set(number, shown, numbers.subarray(used, used + count), words);
        used += count;
      }
    });
    this.show(true);
    this.stir();
    if (!this.seen) return;
    cancelAnimationFrame(this.frame);
    this.draw(); // at once: the next frame shows it, whoever waits for it would paint it one later
  }

  show(on) {
    this.shown = on;
    for (const { canvas } of this.scenes) canvas.hidden = !on;
    this.tools.hidden = !on;
    this.target.dataset.space = on;
  }

  /** The picture's size now, CSS pixels: asked for once a picture, as the page may have to be laid out for it. */
  measure() {
    this.room = [this.place.clientWidth, this.place.clientHeight];
  }

  /** Where a point is, in fractions of the picture as it was measured: right, down. */
  fraction(point, scene = 0) {
    return this.scenes[scene].fraction(point);
  }

  /** Out of sight: pixels are given back until it is seen, or printed. */
  rest() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    for (const { canvas } of this.scenes) Object.assign(canvas, { width: 1, height: 1 });
    this.dirty = true;
  }

  request() {
    this.dirty = true;
    if (!this.frame && this.seen) this.frame = requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.frame = 0;
    this.measure();
    if (this.turned) this.onMove();
    this.turned = false;
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
    if (this.slow >= 2) [this.coarse, this.slow] = [Math.min(this.coarse + 1, SCALES.length - 1), 0];
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
    this.items = items.map((item) => new { path: Path, text: Words, triad: Triad, body: Body }[item.kind](item));
    const owned = this.items.flatMap((item) => (item.parts ?? []).map((part) => ({ item, part })));
    const kinds = [0, 1, 2].map((kind) => owned.filter(({ part }) => (part.opacity < 1 ? 2 : isClosed(part.shape) ? 0 : 1) === kind));
    this.parts = kinds.flat();
    this.closed = kinds[0].length;
    this.full = this.closed + kinds[1].length;
    this.paths = this.items.filter((item) => item instanceof Path);
    this.given = {};
    this.canvas = document.createElement("canvas");
    this.canvas.className = "space";
    this.canvas.setAttribute("aria-hidden", "true"); // the picture below bears the name and the words
    this.paper = this.canvas.getContext("2d");
  }

  unitsPerPixel() {
    return this.place[4] / this.view.room[0];
  }

  fraction(point) {
    const [left, top, width, height, units] = this.place;
    const { center, eye, zoom } = this.view.state;
    const p = this.view.axes().map((axis) => dot(axis, point.map((v, k) => v - center[k])));
    const near = zoom / (eye > 0 ? Math.max(1 - p[2] / eye, 0.05) : 1);
    const aspect = this.view.room[0] / this.view.room[1];
    return [left + width / 2 + (near * p[0]) / units, top + height / 2 - (near * p[1] * aspect) / units];
  }

  draw(scale) {
    const [left, top, width, height, units] = this.place;
    const { room } = this.view;
    const [cssWidth, cssHeight] = [width * room[0], height * room[1]];
    if (cssWidth < 2 || cssHeight < 2) return;
    Object.assign(this.canvas.style, { left: `${100 * left}%`, top: `${100 * top}%`, width: `${100 * width}%`, height: `${100 * height}%` });
    const ratio = Math.min(window.devicePixelRatio || 1, Math.sqrt(MAX_PIXELS / (cssWidth * cssHeight)));
    const [w, h] = [Math.round(cssWidth * ratio), Math.round(cssHeight * ratio)];
    if (this.canvas.width !== w || this.canvas.height !== h) Object.assign(this.canvas, { width: w, height: h });
    const [dw, dh] = [Math.round(w * scale), Math.round(h * scale)];
    const { zoom, eye, center } = this.view.state;
    const [x, y, z] = this.view.axes();
    const pixels = (zoom * room[0]) / units; // CSS pixels a unit, at the center
    const drawn = dw / cssWidth; // device pixels a CSS pixel
    const lens = {
      axes: [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]], center, eye, perUnit: pixels * drawn,
      scale: [(2 * pixels) / cssWidth, (2 * pixels) / cssHeight], reach: 12 * Math.max(this.radius, this.halfWidth), ratio: drawn,
      mark: drawn * clip((2 * this.radius * room[0]) / (units * MARKED), LEAST_MARK, 1),
    };
    this.give();
    this.triangles = this.given.solids?.world.triangles ?? 0;
    const shadow = z[2] > 0 ? (this.view.dark ? [0, 0, 0, 0.5] : [0, 0, 0, 0.16]) : null;
    renderer.draw(dw, dh, lens, { ...this.given, floor: this.floor, shadow, wide: Math.max(this.radius, this.halfWidth) }, !(renderer.software && this.view.moving), scale < 1);
    this.paper.setTransform(1, 0, 0, 1, 0, 0); // `write` leaves CSS pixels behind
    this.paper.clearRect(0, 0, w, h);
    this.paper.imageSmoothingQuality = this.view.moving ? "low" : "high"; // cubic costs a processor as much as the solids
    this.paper.drawImage(renderer.canvas, 0, 0, dw, dh, 0, 0, w, h);
    this.write(w / cssWidth, cssWidth, cssHeight, pixels);
  }

  /** To the buffers what has changed since the last picture: a turn of the view changes nothing. */
  give() {
    const { dark } = this.view;
    if (this.age !== renderer.age) Object.assign(this, { age: renderer.age, given: {}, moved: true, redrawn: true });
    if (this.dark !== dark) Object.assign(this, { dark, moved: true, redrawn: true });
    if (this.moved && this.parts.length) {
      this.given.solids ??= renderer.solids(this.parts.map(({ part }) => part.shape), this.closed, this.full);
      this.table ??= new Float32Array(PART_NUMBERS * this.parts.length);
      this.parts.forEach(({ item, part }, k) => {
        const color = item.shown ? [...rgb(part.color[Number(dark)]), part.opacity] : [0, 0, 0, 0];
        if (part.pose) this.table.set(part.pose, PART_NUMBERS * k);
        this.table.set(color, PART_NUMBERS * k + 16);
      });
      renderer.place(this.given.solids, this.table);
    }
    if (this.redrawn) {
      const shown = this.paths.filter((path) => path.shown);
      this.given.lines = renderer.lines(this.given.lines, joined(shown.map((path) => path.lines(dark))));
      this.given.points = renderer.points(this.given.points, joined(shown.map((path) => path.points(dark))));
    }
    Object.assign(this, { moved: false, redrawn: false });
  }

  /** One thing's numbers from Python. */
  set(number, shown, numbers, words) {
    const item = this.items[number];
    item.set(shown, numbers, words);
    if (item.parts) this.moved = true;
    else if (item instanceof Path) this.redrawn = true;
  }

  /** Words, the scale and the base frame in the corner, in CSS pixels. */
  write(ratio, width, height, pixels) {
    const { paper } = this;
    const dark = Number(this.view.dark);
    const [left, top, wide, high] = this.place;
    const style = getComputedStyle(this.view.place);
    const shrunk = clip(this.view.room[0] / (CROWDED * this.view.width), SMALLEST, 1); // as the picture around shrinks
    const size = shrunk * (parseFloat(style.fontSize) / 13) * LETTER;
    paper.setTransform(ratio, 0, 0, ratio, 0, 0);
    const at = (point) => {
      const [right, down] = this.fraction(point);
      return [((right - left) / wide) * width, ((down - top) / high) * height];
    };
    const pen = {
      shrunk, halo: `${this.colors.paper[dark]}c0`, ink: this.colors.muted[dark],
      taken: [], // boxes of words: left, top, right, bottom
      write: (text, x, y, { color, bold = false, scale = 1, align = "center", baseline = "middle", whole = false }) => {
        paper.font = `${bold ? "bold " : ""}${(scale * size).toFixed(1)}px ${style.fontFamily}`;
        Object.assign(paper, { textAlign: align, textBaseline: baseline, lineWidth: 3, strokeStyle: pen.halo, fillStyle: color, lineJoin: "round" });
        const rows = text.split("\n");
        const line = 1.25 * scale * size;
        if (whole && x > -size && x < width + size) { // what they name is in sight: no letter leaves the picture
          const wide = Math.max(...rows.map((row) => paper.measureText(row).width));
          const left = x - SHARES[align] * wide;
          const top = y - SHARES[baseline] * line;
          x += clip(left, 2, Math.max(2, width - 2 - wide)) - left;
          pen.taken.push([x - SHARES[align] * wide, top, x + (1 - SHARES[align]) * wide, top + rows.length * line]);
        }
        for (const [k, row] of rows.entries()) {
          paper.strokeText(row, x, y + k * line);
          paper.fillText(row, x, y + k * line);
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
    const x = width - 10;
    const y = lowest(pen.taken, x - length * pixels, x, height - 8, 1.4 * size);
    paper.strokeStyle = pen.ink;
    paper.lineWidth = 1.5;
    paper.beginPath();
    paper.moveTo(x - length * pixels, y - 4);
    paper.lineTo(x - length * pixels, y);
    paper.lineTo(x, y);
    paper.lineTo(x, y - 4);
    paper.stroke();
    pen.write(`${Number(length.toPrecision(3))} ${this.unit}`, x - (length * pixels) / 2, y - 0.75 * size, { color: pen.ink, scale: 0.9 });
  }

  writeBase(pen, height, size) {
    const { paper } = this;
    const axes = this.view.axes();
    const [x, y, length] = [1.9 * size, lowest(pen.taken, 0, 3.8 * size, height, 3.8 * size) - 1.9 * size, 1.35 * size];
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
    if (this.age === renderer?.age) for (const made of Object.values(this.given)) renderer.free(made);
    this.canvas.remove();
  }
}

/** How low, from `bottom` up, something so high can stand between left and right without lying on words. */
function lowest(taken, left, right, bottom, high) {
  const isFree = (y) => taken.every((box) => box[2] < left || box[0] > right || box[3] < y - high || box[1] > y);
  return [0, 1, 2, 3, 4].map((k) => bottom - 0.6 * k * high).find(isFree) ?? bottom;
}

const CORNERS = [[0, -1], [1, -1], [0, 1], [1, 1]]; // of a piece of a line: along it, and to its side

function joined(arrays) {
  const all = new Float32Array(arrays.reduce((sum, array) => sum + array.length, 0));
  arrays.reduce((used, array) => (all.set(array, used), used + array.length), 0);
  return all;
}

/** A line, single points, or both. */
class Path {
  constructor(declared) {
    Object.assign(this, declared, { shown: false, numbers: new Float32Array() });
  }

  set(shown, numbers) {
    Object.assign(this, { shown: Boolean(shown), numbers: numbers.slice() });
  }

  look(dark) {
    return [...rgb(this.color[Number(dark)]), this.opacity];
  }

  /** For each piece between two finite points its four corners: from, to, the length until there, how it looks. */
  lines(dark) {
    const { numbers } = this;
    const count = this.width > 0 ? Math.max(0, numbers.length / 3 - 1) : 0;
    const out = new Float32Array(4 * LINE_NUMBERS * count);
    const look = [...this.look(dark), this.width, Math.min(this.dash, 2)];
    let [used, length] = [0, 0];
    for (let k = 0; k < count; k++) {
      const ends = numbers.subarray(3 * k, 3 * k + 6);
      const piece = Math.hypot(ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]);
      if (!Number.isFinite(piece)) {
        length = 0;
        continue;
      }
      for (const corner of CORNERS) {
        out.set(ends, used);
        out[used + 6] = length;
        out[used + 7] = length + piece;
        out.set(look, used + 8);
        out.set(corner, used + 14);
        used += LINE_NUMBERS;
      }
      length += piece;
    }
    return out.subarray(0, used);
  }

  points(dark) {
    const { numbers } = this;
    const count = this.marker ? Math.floor(numbers.length / 3) : 0;
    const out = new Float32Array(POINT_NUMBERS * count);
    const look = [...this.look(dark), this.size * (this.marker === "." ? 0.6 : 1), MARKERS[this.marker] ?? 0, Number(this.hollow)];
    let used = 0;
    for (let k = 0; k < 3 * count; k += 3) {
      if (!Number.isFinite(numbers[k] + numbers[k + 1] + numbers[k + 2])) continue;
      out.set(numbers.subarray(k, k + 3), used);
      out.set(look, used + 3);
      used += POINT_NUMBERS;
    }
    return out.subarray(0, used);
  }
}

/** matplotlib's vertical alignment as a canvas names it. */
const BASELINES = { center: "middle", top: "top", bottom: "bottom", baseline: "alphabetic" };

/** How much of a line lies left of where it is set, and above. */
const SHARES = { left: 0, center: 0.5, right: 1, top: 0, middle: 0.5, alphabetic: 0.8, bottom: 1 };

class Words {
  constructor({ offset, align, baseline, bold, size, color }) {
    Object.assign(this, { offset, align, baseline: BASELINES[baseline], bold, size, color, shown: false });
  }

  set(shown, numbers, words) {
    Object.assign(this, { shown: Boolean(shown), point: [...numbers], words: words ?? "" });
  }

  write(pen, at, dark) {
    const [x, y] = at(this.point);
    if (!Number.isFinite(x)) return;
    pen.write(this.words, x + pen.shrunk * this.offset[0], y - pen.shrunk * this.offset[1], { color: this.color[Number(dark)], bold: this.bold, scale: this.size, align: this.align, baseline: this.baseline, whole: true });
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
}

const SHAFT = { kind: "turned", pieces: 12, profile: [[0, 0], [1, 0], [1, 1], [0, 1]] };
const TIP = { kind: "turned", pieces: 16, profile: [[0, 0], [1, 0], [0, 1]] };

class Triad {
  constructor({ length, name, label, broken, width, axes }) {
    Object.assign(this, { length, name, label, broken, axes, radius: Math.max(0.012, 0.006 * width) * length, shown: false });
    const pieces = broken ? [[0, 0.17], [0.26, 0.43], [0.52, 0.69]] : [[0, 0.86]];
    this.parts = axes.flatMap((color, axis) => [
      ...pieces.map(([from, to]) => ({ shape: SHAFT, axis, from, to, radius: this.radius, color, opacity: 1 })),
      { shape: TIP, axis, from: broken ? 0.76 : 0.82, to: 1, radius: 2.6 * this.radius, color, opacity: 1 },
    ]);
  }

  set(shown, numbers) {
    this.shown = Boolean(shown);
    if (numbers.length !== 16) return;
    this.pose = columns(numbers);
    for (const part of this.parts) part.pose = this.piece(part);
  }

  /** A piece of an axis: its number, from, to (shares of the length), radius. */
  piece({ axis: k, from, to, radius }) {
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
    pen.write(this.name, x + pen.shrunk * offset[0], y - pen.shrunk * offset[1], { color: color[Number(dark)], bold: true, align, baseline: BASELINES[baseline] });
  }
}
