// A Stage in a page: the picture, the handles over it, the words under it, and the controls it declares.
//
// Whoever shows it (a notebook, a demo page, a reading edition) hands `render` an element and a model of four functions:
//
//   get("declaration")       what does not change: Stage.declaration() of labkit/stage/stage.py, as JSON
//   get("silence")           what to say when Python does not answer, where it is no notebook's
//   get("aside")             an element where the hint on keys stands, in a page that has one; else it is at the buttons
//   on("msg:custom", hear)   from now on hear(message, buffers) is called with what Stage sends; buffers are DataViews;
//                            a model that has pixels, not files, sends message.pixels, [width, height], and RGBA
//   off("msg:custom", hear)  no more
//   send(message)            to Stage.receive(message), as JSON
//   placed                   where it has this, `render` puts a function there: the places of handles as one looks now
//
// Scenes in space are drawn by `space.js`. It comes along with a model as get("drawing"), bytes, which `initialize` takes
// before there is anything to show; else the first Stage of a page that has a scene asks Python for it; a page without
// Python sets globalThis[Symbol.for("labkit.space")] = { load: () => import("./space.js") } before.
//
// A model may also announce "comm_live_update": the line to Python was cut or mended. `render` returns a function that
// takes everything down again. Nothing here knows what a value means: sliders and words speak in positions.

const PATIENCE = 2500; // ms until a message without an answer is given up, and said
const SPEAK_AFTER = 700; // ms of rest until a screen reader hears the new caption,
const SPEAK_EVERY = 2000; // ms between two captions it hears while the picture keeps changing
const PIXELS_A_STEP = 4; // CSS pixels a number of the sentence is dragged by until it goes one step on
const READ = 6000; // ms a hint stays
const REST = 900; // ms without an event until the picture may be stored
const SETTLED = 150; // ms without a change of size or theme until the picture follows
const CLICK_RADIUS = 4; // CSS pixels
const AROUND = "100%"; // of the window on each side: a picture so near has its pixels
const NEAR = 13; // CSS pixels: handles nearer than that are fanned out
const MAX_ARROWS = 10; // presses kept while a message is in flight
const CALM_INTERVAL = 500; // ms from picture to picture where the reader asks for reduced motion
const MOST_LATE = 1500; // ms that a play leaves out to keep up; later, it goes on where it was
const LETTERS = 13; // CSS pixels of the words around, at which the picture's letters have their own size
const LARGEST = 2.4; // times as large letters may become in the whole window
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const NAMES = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down" };
const TURNING = "Arrow keys turn the view; drawn in space, Shift moves it, + and - zoom, x y z and Home look from there.";
const ASK_AGAIN = 10000; // ms until a page that lacks the drawing in space asks for it again
const LOOK_AGAIN = 100; // ms until a Stage looks whether another one has got it
const WORTH_WAITING = 1000; // ms a Stage waits for it with its first picture
const SILENT = "Python does not answer. It is busy with another cell, or it was restarted: then Run All makes the figure live again.";

function render({ model, el }) {
  const figure = new Figure(model, el);
  return () => figure.close();
}

/** The model is there, its view is not: time to get the drawing in space ready. */
function initialize({ model }) {
  hearNevertheless(model);
  const source = model.get("drawing");
  if (source?.byteLength) getReady(source);
}

export default { initialize, render };

/** A model that a busy page did not begin within two seconds is given up by anywidget: it has its view, and no message
 *  reaches it any more. From now on they go straight to what every widget does with them. */
async function hearNevertheless({ get, widget_manager: manager }) {
  const own = manager && get("own");
  if (!own) return;
  const found = await manager.get_model(own);
  let kind = Object.getPrototypeOf(found);
  while (kind && !Object.hasOwn(kind, "_handle_comm_msg")) kind = Object.getPrototypeOf(kind); // anywidget's, which waits
  const plain = kind && Object.getPrototypeOf(kind)._handle_comm_msg;
  if (plain) found.comm?.on_msg((message) => plain.call(found, message));
}

/** What all Stages of the page share of the drawing in space: {module, coming}, and how the page gets it. */
const spaceOfThePage = () => (globalThis[Symbol.for("labkit.space")] ??= {});

/** The drawing from its source, once a page. It makes its context, and its shaders, as soon as the page has nothing else
 *  to do: whatever else begins on the page has two seconds for it, or anywidget gives it up. */
function getReady(source) {
  const page = spaceOfThePage();
  page.coming ??= (async () => {
    const url = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    try {
      page.module ??= await import(url);
      (globalThis.requestIdleCallback ?? setTimeout)(() => page.module.works());
    } catch (error) {
      page.module = { works: () => false }; // it would be refused again
      console.warn("stage: no drawing in space, Python draws it", error);
    }
    URL.revokeObjectURL(url);
  })();
  return page.coming;
}

function element(tag, className = "", attributes = {}, children = []) {
  const node = document.createElement(tag);
  if (className) node.className = className;
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

/** The arrow a key event stands for, [right, up]; none with Ctrl, Alt or Meta. */
function arrowOf(event) {
  return event.ctrlKey || event.metaKey || event.altKey ? undefined : ARROWS[event.key];
}

function taken(event) {
  event.preventDefault();
  event.stopPropagation();
}

const limit = (x) => Math.min(1, Math.max(0, x));

/** All parts of one Stage, and what passes between them. */
class Figure {
  constructor(model, el) {
    const declared = model.get("declaration");
    this.name = declared.name;
    this.root = element("div", "labkit-stage", { role: "group", "aria-label": declared.name });
    el.append(this.root);
    this.line = new Line(model, { onSilence: () => this.silent(), onStir: () => this.mark() });
    this.picture = element("div", "picture");
    this.screen = new Screen(this.picture, (message) => this.show(message), () => this.room.look(true));
    this.space = new Space(this.picture, this.screen.canvas, declared, this.line);
    this.handles = new Handles(this.picture, declared.handles, this.line);
    this.scenes = new Scenes(this, declared);
    this.line.where = () => this.scenes.news();
    this.space.scenes = this.scenes;
    if (model.placed) model.placed = (places) => this.scenes.placed(places);
    this.clock = declared.play ? new Clock(declared.play, this.line) : null;
    this.controls = new Controls(declared.controls, this.line);
    this.words = new Words(this.controls.inputs);
    this.buttons = buttonRow(declared.buttons, (key) => { this.clock?.stop(); this.line.press(key); });
    this.room = new Room(this.root, this.picture, declared.size, this.line, this.buttons);
    this.hint = this.space.words && new Hint(this.space, this.buttons, model.get("aside"));
    this.room.canDraw = () => this.scenes.able;
    this.room.waits = () => this.scenes.waits;
    this.root.append(this.picture, ...this.words.nodes, ...(this.clock ? [this.clock.row] : []), this.controls.row, this.buttons);
    // JupyterLab's shortcuts (arrow keys fold headings, letters cut cells) stay away from whatever has the focus here
    for (const node of this.root.querySelectorAll("input, select, button, canvas, .handle")) node.dataset.lmSuppressShortcuts = "true";
    this.hear = (message, buffers) => this.receive(message, buffers);
    this.probe = () => this.room.look(true);
    model.on("msg:custom", this.hear);
    model.on("comm_live_update", this.probe);
    this.model = model;
    this.scenes.ask();
    this.room.begin();
  }

  receive(message, buffers) {
    if (message.module === "space") this.scenes.load(buffers[0]);
    if (message.picture === undefined) return;
    if (message.space) buffers = this.scenes.receive(message.space, buffers, this.room.dark);
    else this.scenes.rest();
    if (this.line.hasAnswer(message)) this.root.dataset.answer = this.line.took.toFixed(1); // ms, for the benchmark
    this.screen.receive(message, buffers);
  }

  /** One picture is on the screen: the words, handles and controls that belong to it. */
  show(message) {
    this.picture.style.width = `${message.width}px`;
    this.picture.style.aspectRatio = `${message.width} / ${message.height}`;
    this.scenes.fit(message);
    this.screen.canvas.setAttribute("aria-label", [this.name, message.caption].filter(Boolean).join(": "));
    this.handles.show((this.places = this.scenes.placed(message.handles)));
    this.controls.show(message.controls);
    this.words.show(message);
    this.clock?.show(message.time);
    this.root.dataset.python = message.milliseconds;
    this.root.dataset.picture = message.picture;
    this.line.seen(message);
  }

  /** For tests: whether nothing is on its way to Python or from there, and nothing waits for the page to be still. */
  mark() {
    this.root.dataset.rest = this.line.still && !this.room.settling;
  }

  /** One looks from elsewhere: the handles go along, and Python hears of it with the next message, or at rest. */
  turned() {
    if (this.places) this.handles.show(this.scenes.placed(this.places));
    this.line.rest();
  }

  /** Python does not answer: that is said, and nothing pretends to move. */
  silent() {
    this.words.notice(this.model.get("silence") ?? SILENT);
    this.clock?.stop();
    this.handles.goBack();
    this.controls.goBack();
  }

  close() {
    this.model.off("msg:custom", this.hear);
    this.model.off("comm_live_update", this.probe);
    for (const part of [this.line, this.screen, this.words, this.clock, this.room, this.hint, this.scenes]) part?.close();
    this.root.remove();
  }
}

/** To Python: all that happened is merged into `pending`; one message is in flight, the next carries what came meanwhile,
 *  so that a drag never queues up. Python answers each with one picture. */
class Line {
  constructor(model, { onSilence, onStir }) {
    Object.assign(this, { model, onSilence, onStir, pending: {}, flight: null, silent: false, timer: 0, resting: 0, count: 0, shown: 0, answer: 0, took: 0 });
    this.view = Math.random().toString(36).slice(2); // two views of one Stage tell their answers apart
  }

  get idle() {
    return this.flight === null && Object.keys(this.pending).length === 0;
  }

  /** The last answer has come, and is on the screen. */
  get still() {
    return this.idle && !this.silent && this.shown > 0 && this.shown >= this.answer;
  }

  add(key, combine) {
    this.pending[key] = combine(this.pending[key]);
    this.flush();
  }

  /** A button undoes what was under way. */
  press(key) {
    const { look } = this.pending;
    this.pending = { ...(look && { look }), button: key };
    this.flush();
  }

  flush() {
    clearTimeout(this.resting);
    if (this.flight === null && Object.keys(this.pending).length > 0) this.pass();
    this.onStir();
  }

  pass() {
    this.flight = `${this.view}:${++this.count}`;
    this.sent = performance.now();
    this.timer = setTimeout(() => { this.flight = null; this.silent = true; this.onSilence(); this.flush(); }, PATIENCE);
    const message = { ...this.pending, ...this.where?.(), shown: this.shown, serial: this.flight };
    this.pending = {};
    this.send(message);
  }

  send(message) {
    try {
      this.model.send(message);
    } catch { /* the line is cut: there will be no answer, and that is said */ }
  }

  /** Whether a message is the answer to the one in flight. */
  hasAnswer(message) {
    if (message.serial === null || message.serial !== this.flight) return false;
    this.flight = null;
    this.answer = message.picture;
    clearTimeout(this.timer);
    this.took = performance.now() - this.sent;
    return true;
  }

  /** A picture is on the screen. Python waits after three: every other one that is no answer is acknowledged. */
  seen(message) {
    this.shown = message.picture;
    this.silent = false; // what comes late has come
    if (message.serial === null && this.idle && this.shown % 2 === 0) this.send({ shown: this.shown });
    this.flush();
    this.rest();
  }

  rest() {
    clearTimeout(this.resting);
    if (this.idle) this.resting = setTimeout(() => this.send({ ...this.where?.(), rest: true }), REST);
  }

  close() {
    clearTimeout(this.timer);
    clearTimeout(this.resting);
  }
}

/** Scenes in space: drawn by the page once it has the module, by Python until then and where the page cannot. */
class Scenes {
  constructor(figure, { spaces = [], home, size }) {
    Object.assign(this, { figure, spaces, home, width: size[0], view: null, timer: 0, closed: spaces.length === 0 });
    Object.assign(this, { page: spaceOfThePage(), patient: true });
    this.patience = setTimeout(() => { this.patient = false; figure.room.begin(); }, WORTH_WAITING);
  }

  get able() {
    return this.view !== null && this.page.module.works();
  }

  get live() {
    return this.view?.shown ?? false;
  }

  /** The drawing may come any moment: a picture that Python would paint now is not worth its while. */
  get waits() {
    return this.patient && !this.closed && !this.page.module;
  }

  /** Ask for the module unless it is on its way, or another Stage of the page has done so; open the view as soon as it
   *  is there. */
  ask() {
    clearTimeout(this.timer);
    if (this.closed || this.view) return;
    const { page } = this;
    if (page.module) return this.open();
    if (performance.now() - (page.asked ?? -Infinity) > ASK_AGAIN && !page.coming) {
      page.asked = performance.now();
      if (page.load) page.coming = page.load().then((module) => { page.module = module; module.works(); }, () => { page.coming = null; });
      else this.figure.line.send({ need: "space" });
    }
    if (page.coming) return void page.coming.then(() => this.ask());
    this.timer = setTimeout(() => this.ask(), LOOK_AGAIN);
  }

  load(source) {
    getReady(source).then(() => this.ask()); // this Stage opens then, the others of the page when they look again
  }

  open() {
    if (!this.page.module.works()) return this.figure.room.begin();
    const { room } = this.figure;
    const hooks = { onMove: () => this.figure.turned(), onAble: () => room.look(true), seat: (tools) => room.end.prepend(tools), width: this.width };
    this.view = new this.page.module.View(this.figure.picture, this.figure.screen.canvas, this.spaces, this.home, hooks);
    this.view.show(false);
    this.figure.room.look(true);
  }

  /** The numbers are the last of the buffers; returns the others. */
  receive(space, buffers, dark) {
    const view = buffers[buffers.length - 1];
    const copy = view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);
    this.view?.receive(space, new Float32Array(copy), dark);
    return buffers.slice(0, -1);
  }

  /** The picture has its size: scenes are drawn for it. */
  fit({ width, height }) {
    if (!this.live || this.size === `${width}x${height}`) return;
    this.size = `${width}x${height}`;
    this.view.stir();
  }

  /** Python draws. */
  rest() {
    if (this.live) this.view.show(false);
  }

  news() {
    const view = this.live ? this.view.news() : undefined;
    return view && { view };
  }

  /** Places of the handles, as one looks now. */
  placed(places) {
    if (!this.live) return places;
    this.view.measure();
    const seen = ([name, place]) => [name, place.point ? { ...place, at: this.view.fraction(place.point, place.scene) } : place];
    return Object.fromEntries(Object.entries(places).map(seen));
  }

  close() {
    this.closed = true;
    clearTimeout(this.timer);
    clearTimeout(this.patience);
    this.view?.close();
  }
}

/** From Python: whole pictures (PNG), and runs of pixels that changed since the one before. Far from the window the
 *  canvas gives its pixels back, and the browser its copies of them: `image` keeps them.
 */
class Screen {
  constructor(place, show, lost) {
    this.canvas = element("canvas", "", { role: "img" });
    place.append(this.canvas);
    this.paper = this.canvas.getContext("2d", { willReadFrequently: true });
    Object.assign(this, { show, lost, queue: [], decoding: false, image: null, number: 0, near: true });
    this.watch = new IntersectionObserver((entries) => {
      const { isIntersecting, boundingClientRect: { width } } = entries[entries.length - 1];
      if (width || isIntersecting) this.come(isIntersecting); // without a width it is hidden, and may be shown at any moment
    }, { rootMargin: AROUND, scrollMargin: AROUND });
    this.watch.observe(place);
    this.print = () => this.come(true);
    this.printed = () => { this.watch.unobserve(place); this.watch.observe(place); }; // it says anew where the picture is
    window.addEventListener("beforeprint", this.print);
    window.addEventListener("afterprint", this.printed);
    this.jump = () => { // into sight at once, a frame before the observer says so
      const { width, top, bottom } = place.getBoundingClientRect();
      if (!this.near && width && bottom > 0 && top < window.innerHeight) this.come(true);
    };
    this.sizing = new ResizeObserver(this.jump); // a notebook that takes cells out of the page puts this one back
    this.sizing.observe(place);
  }

  come(near) {
    this.near = near;
    if (near) document.removeEventListener("scroll", this.jump, true);
    else document.addEventListener("scroll", this.jump, { capture: true, passive: true }); // of whatever scrolls
    if (near) this.put();
    else if (this.image) Object.assign(this.canvas, { width: 1, height: 1 });
  }

  /** Rows of the picture onto the canvas. */
  put(top = 0, rows = this.image?.height) {
    if (!this.near || !this.image) return;
    const { width, height } = this.image;
    if (this.canvas.width !== width || this.canvas.height !== height) {
      Object.assign(this.canvas, { width, height }); // and it is empty
      [top, rows] = [0, height];
    }
    this.paper.putImageData(this.image, 0, 0, 0, top, width, rows);
  }

  receive(message, buffers) {
    if (message.on === null) this.queue = []; // the newest wins
    this.queue.push({ message, buffers });
    this.draw();
  }

  draw() {
    while (this.queue.length && !this.decoding) {
      const { message, buffers } = this.queue.shift();
      if (message.pixels) this.paint(message, buffers[0]);
      else if (message.on === null) this.decode(message, buffers[0]);
      else if (message.on === this.number && this.image) this.change(message, ...buffers.map(numbers));
      else this.lost(); // a picture is missing: a whole one is needed
    }
  }

  async decode(message, png) {
    this.decoding = true;
    try {
      const bitmap = await createImageBitmap(new Blob([png], { type: "image/png" }));
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
      this.paper.drawImage(bitmap, 0, 0);
      this.image = this.paper.getImageData(0, 0, bitmap.width, bitmap.height);
      bitmap.close();
      this.come(this.near);
      this.number = message.picture;
      this.show(message);
    } catch (error) {
      console.error("stage: the picture could not be decoded", error);
    }
    this.decoding = false;
    this.draw();
  }

  /** A whole picture that needs no decoding. */
  paint(message, rgba) {
    const [width, height] = message.pixels;
    this.image = new ImageData(new Uint8ClampedArray(rgba.buffer, rgba.byteOffset, 4 * width * height), width, height);
    this.put();
    this.show(message);
  }

  /** runs: first place and length of each run of changed pixels; colors: theirs, one after the other. */
  change(message, runs, colors) {
    if (colors.length) {
      const pixels = new Uint32Array(this.image.data.buffer);
      for (let k = 0, used = 0; k < runs.length; used += runs[k + 1], k += 2) {
        pixels.set(colors.subarray(used, used + runs[k + 1]), runs[k]);
      }
      const top = Math.floor(runs[0] / this.image.width);
      const bottom = Math.floor((runs[runs.length - 2] + runs[runs.length - 1] - 1) / this.image.width);
      this.put(top, bottom - top + 1);
    }
    this.number = message.picture;
    this.show(message);
  }

  close() {
    this.watch.disconnect();
    this.sizing.disconnect();
    window.removeEventListener("beforeprint", this.print);
    window.removeEventListener("afterprint", this.printed);
    document.removeEventListener("scroll", this.jump, true);
  }
}

function numbers(view) {
  return new Uint32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
}

/** Where an event is: fractions of a picture, right and down. */
function fraction(node, event) {
  const box = node.getBoundingClientRect();
  return [limit((event.clientX - box.left) / box.width), limit((event.clientY - box.top) / box.height)];
}

/** Caption, status, and what a screen reader hears. Numbers of the caption that are a slider's can be dragged. */
class Words {
  constructor(inputs) {
    this.caption = element("p", "caption");
    this.status = element("p", "status", { role: "status" });
    this.gone = element("p", "gone", { role: "status" });
    this.spoken = element("div", "spoken", { "aria-live": "polite" });
    this.nodes = [this.status, this.gone, this.caption, this.spoken];
    Object.assign(this, { inputs, told: "", parts: [], order: "", timer: 0, since: 0, cursor: "" });
  }

  show({ caption, status, cursor, numbers }) {
    if (this.told !== caption) {
      this.told = caption;
      this.write(caption, numbers.filter(([, , name]) => this.inputs.has(name))); // a film has some of the sliders
      this.speak(caption);
    }
    for (const part of this.parts) part.show?.();
    if (cursor && cursor !== this.cursor) this.speak(cursor);
    this.cursor = cursor;
    if (this.status.textContent !== status) this.status.textContent = status;
    this.notice("");
  }

  /** The caption; a number keeps its node, and with it focus and pointer, as long as the order of the numbers stays. */
  write(caption, numbers) {
    const order = JSON.stringify(numbers.map(([, , name]) => name));
    if (this.order !== order || !this.parts.length) {
      const focused = this.parts.find((part) => part.node === document.activeElement)?.name;
      const text = () => ({ node: element("span", "", { "aria-hidden": "true" }) }); // heard from `spoken`
      this.parts = [text(), ...numbers.flatMap(([, , name]) => [new CaptionNumber(name, this.inputs.get(name)), text()])];
      this.caption.replaceChildren(...this.parts.map(({ node }) => node));
      this.parts.find(({ name }) => name && name === focused)?.node.focus({ preventScroll: true });
      this.order = order;
    }
    const cuts = [0, ...numbers.flatMap(([start, end]) => [start, end]), caption.length];
    this.parts.forEach(({ node }, k) => {
      const words = caption.slice(cuts[k], cuts[k + 1]);
      if (node.textContent !== words) node.textContent = words;
    });
  }

  notice(text) {
    if (this.gone.textContent !== text) this.gone.textContent = text;
  }

  speak(text) {
    const now = performance.now();
    this.since ||= now; // of the first change not yet heard
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.spoken.textContent = text;
      this.since = 0;
    }, Math.min(SPEAK_AFTER, Math.max(0, this.since + SPEAK_EVERY - now)));
  }

  close() {
    clearTimeout(this.timer);
  }
}

/** A slider's number in the caption: dragged sideways, or moved by arrow keys, it moves the slider. */
class CaptionNumber {
  constructor(name, { input, label }) {
    Object.assign(this, { name, input, held: null });
    this.node = element("span", "number", {
      role: "slider", tabindex: "0", "aria-label": label, title: `${label}: drag sideways`, "aria-valuemin": 0, "aria-valuemax": input.max,
      "data-number": name, "data-lm-suppress-shortcuts": "true",
    });
    this.node.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      taken(event);
      this.node.focus({ preventScroll: true });
      this.node.setPointerCapture(event.pointerId);
      this.held = { x: event.clientX, at: Number(input.value) };
    });
    this.node.addEventListener("pointermove", (event) => {
      if (this.held) this.ask(this.held.at + Math.round((event.clientX - this.held.x) / PIXELS_A_STEP));
    });
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) this.node.addEventListener(type, () => { this.held = null; });
    this.node.addEventListener("keydown", (event) => {
      const arrow = arrowOf(event);
      if (!arrow) return;
      taken(event);
      this.ask(Number(input.value) + (event.shiftKey ? 10 : 1) * (arrow[0] + arrow[1]));
    });
  }

  ask(position) {
    const before = this.input.value;
    this.input.value = position; // it keeps to its ends
    if (this.input.value !== before) this.input.dispatchEvent(new Event("input"));
  }

  show() {
    this.node.setAttribute("aria-valuenow", this.input.value);
    this.node.setAttribute("aria-valuetext", this.input.getAttribute("aria-valuetext"));
  }
}

/** Points to drag, by mouse, touch and arrow keys. */
class Handles {
  constructor(place, declared, line) {
    this.place = place;
    this.all = Object.entries(declared).map(([name, label]) => new Handle(place, name, label, line));
  }

  show(places) {
    const box = this.place.getBoundingClientRect(); // before anything moves: the page need not be laid out for it
    for (const handle of this.all) handle.put(places[handle.name], box);
    this.fan(box);
  }

  goBack() {
    for (const handle of this.all) handle.goBack();
  }

  /** Handles that lie on each other are drawn around their spot, each with its name, and can be pulled one by one. */
  fan(box) {
    const spots = this.all.map((h) => [h.at[0] * box.width, h.at[1] * box.height]);
    this.all.forEach((handle, k) => {
      const group = this.all.map((_, j) => j).filter((j) => Math.hypot(spots[j][0] - spots[k][0], spots[j][1] - spots[k][1]) < NEAR);
      handle.aside(group.indexOf(k), group.length);
    });
  }
}

class Handle {
  constructor(place, name, label, line) {
    Object.assign(this, { place, name, line, at: [0, 0], last: null, held: null, corrected: false });
    this.node = element("div", "handle", {
      role: "slider", tabindex: "0", "aria-roledescription": "point to drag", "aria-label": label, title: label,
      "data-handle": name, "data-name": name,
    });
    this.node.hidden = true; // until a picture says where it is
    place.append(this.node);
    this.node.addEventListener("pointerdown", (event) => this.grab(event));
    this.node.addEventListener("pointermove", (event) => this.pull(event));
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) this.node.addEventListener(type, () => this.drop());
    this.node.addEventListener("keydown", (event) => this.step(event));
  }

  grab(event) {
    if (event.button !== 0) return;
    taken(event);
    this.node.focus({ preventScroll: true });
    this.node.setPointerCapture(event.pointerId);
    this.node.classList.add("held");
    const [right, down] = fraction(this.place, event);
    this.held = [this.at[0] - right, this.at[1] - down];
    this.corrected = false; // Python keeps it elsewhere than the pointer: then only Python moves it
  }

  pull(event) {
    if (!this.held) return;
    const [right, down] = fraction(this.place, event);
    const target = [right + this.held[0], down + this.held[1]];
    if (!this.corrected && !this.line.silent) this.move(target);
    this.line.add("drag", (drag) => ({ ...drag, [this.name]: target }));
  }

  drop() {
    this.held = null;
    this.node.classList.remove("held");
  }

  step(event) {
    const arrow = arrowOf(event);
    if (!arrow) return;
    taken(event);
    const size = event.shiftKey ? 10 : 1;
    this.line.add("step", (steps = {}) => {
      const [right, up] = steps[this.name] ?? [0, 0];
      return { ...steps, [this.name]: [right + size * arrow[0], up + size * arrow[1]] };
    });
  }

  move([right, down]) {
    this.at = [right, down];
    this.node.style.left = `${100 * right}%`;
    this.node.style.top = `${100 * down}%`;
  }

  put(place, box) {
    this.last = place.at;
    this.node.hidden = false;
    this.node.style.setProperty("--ring", place.color);
    this.node.setAttribute("aria-valuetext", place.value);
    this.node.setAttribute("aria-valuenow", place.now);
    if (this.held && !this.corrected) {
      if (this.line.pending.drag?.[this.name] !== undefined || this.line.flight !== null) return; // the pointer is further already
      this.corrected = Math.hypot((place.at[0] - this.at[0]) * box.width, (place.at[1] - this.at[1]) * box.height) > 2;
    }
    this.move(place.at);
  }

  goBack() {
    this.drop();
    if (this.last) this.move(this.last);
  }

  /** Beside its spot when it is number k of several there. */
  aside(k, count) {
    this.node.classList.toggle("fanned", count > 1);
    const angle = (2 * Math.PI * k) / count - Math.PI / 2;
    const reach = count > 1 ? 10 + 4 * count : 0;
    this.node.style.translate = count > 1 ? `${(reach * Math.sin(angle)).toFixed(1)}px ${(reach * Math.cos(angle)).toFixed(1)}px` : "";
  }
}

/** Empty space of the picture: click, draw, turn, drive; by pointer, and by keys with a cursor of its own. */
class Space {
  constructor(place, canvas, { empty, click, keys }, line) {
    Object.assign(this, { place, canvas, empty, click, keys, line, press: null, cursor: null, pen: false });
    canvas.dataset.empty = empty;
    canvas.dataset.click = click;
    if (!(keys || click || empty)) return;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application"); // a screen reader passes arrow keys on to it
    this.words = this.keysInWords();
    canvas.setAttribute("aria-description", this.words);
    this.mark = element("div", "cursor", { "aria-hidden": "true" });
    this.mark.hidden = true;
    place.append(this.mark);
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", () => { this.press = null; });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("keydown", (event) => { // before a scene in space, whose view moves by Shift
      if (!this.cursor || !arrowOf(event)) return;
      this.key(event);
      event.stopImmediatePropagation();
    }, { capture: true });
    canvas.addEventListener("blur", () => this.leave());
  }

  get points() {
    return this.click || this.empty === "draw";
  }

  keysInWords() {
    const arrows = this.keys ? "Arrow keys drive." : this.empty === "turn" ? TURNING : "";
    if (!this.points) return arrows;
    const mode = arrows ? "Enter: a cursor for the arrow keys; " : "Arrow keys move a cursor; ";
    return `${arrows} ${mode}${this.empty === "draw" ? "Space puts the pen down and lifts it" : "Space clicks"}.`.trim();
  }

  down(event) {
    if (event.button !== 0) return;
    this.press = { x: event.clientX, y: event.clientY, start: fraction(this.canvas, event), moved: false };
    if (this.empty) {
      this.canvas.setPointerCapture(event.pointerId);
      event.preventDefault();
    }
    this.canvas.focus({ preventScroll: true });
  }

  moved(event) {
    if (!this.press) return;
    const right = event.clientX - this.press.x;
    const down = event.clientY - this.press.y;
    if (!this.press.moved && Math.hypot(right, down) < CLICK_RADIUS) return;
    if (this.empty === "turn") {
      this.turn(-right, down);
      this.press.x = event.clientX;
      this.press.y = event.clientY;
    } else if (this.empty === "draw") {
      if (!this.press.moved) this.begin(this.press.start);
      const points = (event.getCoalescedEvents?.() ?? []).map((e) => fraction(this.canvas, e));
      this.draw(points.length ? points : [fraction(this.canvas, event)]);
    }
    this.press.moved = true;
  }

  up(event) {
    if (this.press && !this.press.moved) this.touch(fraction(this.canvas, event));
    this.press = null;
  }

  /** A click, or a stroke of one point. */
  touch(at) {
    if (this.click) this.line.add("click", () => at);
    else if (this.empty === "draw") {
      this.begin(at);
      this.draw([]);
    }
  }

  turn(right, down) {
    if (this.scenes?.live) this.scenes.view.turn(right, down);
    else this.line.add("orbit", ([a, b] = [0, 0]) => [a + right, b + down]);
  }

  begin(at) {
    this.line.pending.fresh = true;
    this.line.pending.brush = [at];
  }

  draw(points) {
    this.line.add("brush", (path = []) => [...path, ...points]);
  }

  key(event) {
    const arrow = arrowOf(event);
    if (arrow) {
      taken(event);
      if (this.cursor || (this.points && !this.keys && this.empty !== "turn")) this.shift(arrow, event.shiftKey ? 0.05 : 0.01);
      else if (this.keys) this.line.add("arrows", (names = []) => [...names, NAMES[event.key]].slice(-MAX_ARROWS));
      else if (this.empty === "turn") this.turn(...arrow.map((a, k) => (event.shiftKey ? 60 : 10) * (k ? -a : a)));
    } else if (this.points && (event.key === "Enter" || event.key === " ")) {
      taken(event);
      if (!this.cursor) this.shift([0, 0], 0);
      else this.strike();
    } else if (event.key === "Escape" && this.cursor) {
      taken(event);
      this.leave();
    }
  }

  /** Move the keyboard's cursor; with the pen down it draws. */
  shift([right, up], size) {
    const [x, y] = this.cursor ?? [0.5, 0.5];
    this.cursor = [limit(x + size * right), limit(y - size * up)];
    this.mark.hidden = false;
    this.mark.style.left = `${100 * this.cursor[0]}%`;
    this.mark.style.top = `${100 * this.cursor[1]}%`;
    if (this.pen) this.draw([this.cursor]);
    this.line.add("cursor", () => this.cursor);
  }

  strike() {
    if (this.empty !== "draw") return this.touch(this.cursor);
    this.pen = !this.pen;
    this.mark.classList.toggle("down", this.pen);
    if (this.pen) this.touch(this.cursor);
    else if (this.click) this.touch(this.cursor);
  }

  leave() {
    this.cursor = null;
    this.pen = false;
    this.mark.hidden = true;
    this.mark.classList.remove("down");
  }
}

/** What keys do in empty space, until it has been read: where the page has a place for it, in the gap of the row of
 *  buttons where it fits there, else in a line of its own below. It covers nothing. No animation, which keeps a page busy.
 */
class Hint {
  constructor({ canvas, words }, row, aside) {
    Object.assign(this, { row, aside, timer: 0 });
    this.node = element("div", "hint", { "aria-hidden": "true" }, [words]); // heard from the canvas
    this.node.hidden = true;
    if (aside) aside.append(this.node);
    else row.insertBefore(this.node, row.querySelector(".end"));
    canvas.addEventListener("focus", () => { if (canvas.matches(":focus-visible")) this.show(); });
    canvas.addEventListener("blur", () => this.hide());
  }

  show() {
    const { node, row } = this;
    node.hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.hide(), READ);
    if (this.aside) return;
    const fits = node.scrollHeight <= node.clientHeight + 1 && node.scrollWidth <= node.clientWidth;
    if (fits) return;
    node.classList.add("under");
    row.after(node);
  }

  hide() {
    const { node, row } = this;
    node.hidden = true;
    if (!node.classList.contains("under")) return;
    node.classList.remove("under");
    row.insertBefore(node, row.querySelector(".end"));
  }

  close() {
    clearTimeout(this.timer);
    this.node.remove();
  }
}

/** Sliders, words and toggles, as native inputs. */
class Controls {
  constructor(declared, line) {
    this.line = line;
    this.row = element("div", "row controls");
    this.inputs = new Map();
    for (const [name, control] of Object.entries(declared)) {
      const make = { slider: sliderInput, list: listInput, words: wordsInput, toggle: toggleInput }[control.kind];
      const input = make(control, (position) => line.add("control", (all) => ({ ...all, [name]: position })));
      input.node.dataset.control = name;
      this.inputs.set(name, input);
      this.row.append(input.node);
    }
  }

  show(values) {
    this.last = values;
    for (const [name, input] of this.inputs) {
      if (this.line.pending.control?.[name] === undefined) input.show(values[name].at, values[name].text); // else it is further already
    }
  }

  goBack() {
    for (const [name, input] of this.last ? this.inputs : []) input.show(this.last[name].at, this.last[name].text);
  }
}

function sliderInput({ label, positions, unit }, send) {
  const input = element("input", "", { type: "range", min: 0, max: positions, step: 1 });
  const number = element("output", "", { "aria-hidden": "true" });
  input.addEventListener("input", () => send(Number(input.value)));
  return {
    input, label,
    node: element("div", "control", {}, [element("label", "", {}, [label, input]), number]),
    show(at, text) {
      if (Number(input.value) !== at) input.value = at;
      number.textContent = text;
      input.setAttribute("aria-valuetext", unit ? `${text} ${unit}` : text);
    },
  };
}

function listInput({ label, words }, send) {
  const input = element("select", "", {}, words.map((word) => element("option", "", {}, [word])));
  input.addEventListener("change", () => send(input.selectedIndex));
  return {
    node: element("div", "control", {}, [element("label", "", {}, [label, input])]),
    show(at) { input.selectedIndex = at; },
  };
}

function wordsInput({ label, words }, send) {
  const group = Math.random().toString(36).slice(2);
  const inputs = words.map((_, k) => {
    const input = element("input", "", { type: "radio", name: group });
    input.addEventListener("change", () => send(k));
    return input;
  });
  const labels = words.map((word, k) => element("label", "word", {}, [inputs[k], word]));
  const head = element("span", "head", { "aria-hidden": "true" }, [label]);
  return {
    node: element("div", "control", { role: "radiogroup", "aria-label": label }, [head, ...labels]),
    show(at) {
      inputs[at].checked = true;
      if (inputs.includes(document.activeElement)) inputs[at].focus({ preventScroll: true }); // arrow keys go on from there
    },
  };
}

function toggleInput({ label }, send) {
  const input = element("input", "", { type: "checkbox" });
  input.addEventListener("change", () => send(Number(input.checked)));
  return {
    node: element("div", "control", {}, [element("label", "word", {}, [input, label])]),
    show(at) { input.checked = at === 1; },
  };
}

function buttonRow(keys, press) {
  const row = element("div", "row buttons");
  for (const key of keys) {
    const button = element("button", "", { type: "button" }, [key]);
    button.addEventListener("click", () => press(key));
    row.append(button);
  }
  return row;
}

/** Play, pause, and a slider of time; any moment can be asked for. The page beats the time; Python says what it is. */
class Clock {
  constructor({ steps, interval, stride, patient }, line) {
    const calm = window.matchMedia?.("(prefers-reduced-motion: reduce)").matches;
    const slower = calm ? Math.max(1, Math.round(CALM_INTERVAL / interval)) : 1;
    Object.assign(this, { steps, line, interval: interval * slower, stride: stride * slower, patient });
    Object.assign(this, { at: 0, epoch: 0, timer: 0, playing: false });
    this.button = element("button", "play", { type: "button" });
    this.button.addEventListener("click", () => (this.playing ? this.stop() : this.start()));
    this.number = element("output", "", { "aria-hidden": "true" });
    this.row = element("div", "row time", {}, [this.button]);
    this.slider = element("input", "", { type: "range", min: 0, max: steps, step: 1, "aria-label": "time" });
    this.slider.addEventListener("input", () => { this.stop(); this.ask(Number(this.slider.value)); });
    this.row.append(this.slider, this.number);
    this.stop();
  }

  start() {
    this.playing = true;
    this.button.textContent = "Pause";
    if (this.at >= this.steps) this.ask(0);
    this.due = performance.now() + this.interval;
    this.timer = setTimeout(() => this.beat(), this.interval);
  }

  stop() {
    this.playing = false;
    this.button.textContent = "Play";
    clearTimeout(this.timer);
  }

  /** One step of time; a simulation waits for its answer, anything else leaves out what it was too late for. */
  beat() {
    const now = performance.now();
    if (this.line.flight === null && this.line.pending.time === undefined) {
      const slept = now - this.due > MOST_LATE; // the machine, or the page behind another
      const late = this.patient || slept ? 0 : Math.floor((now - this.due) / this.interval);
      const next = Math.min(this.steps, this.at + this.stride * (1 + late));
      this.due = Math.max(this.due + this.interval * (1 + late), now);
      this.ask(next);
      if (next >= this.steps) return this.stop();
    }
    this.timer = setTimeout(() => this.beat(), Math.max(4, this.due - performance.now()));
  }

  ask(step) {
    this.at = step;
    this.line.add("time", () => ({ at: step, epoch: this.epoch }));
  }

  show({ at, text, epoch }) {
    if (epoch !== this.epoch) this.stop(); // Python went back to the start
    this.epoch = epoch;
    this.number.textContent = text;
    if (this.line.pending.time !== undefined) return;
    this.at = at;
    this.slider.value = at;
    this.slider.setAttribute("aria-valuetext", text);
  }

  close() {
    clearTimeout(this.timer);
  }
}

/** The place the picture may fill, the device's pixels and the theme; and the button that gives it the whole window. */
class Room {
  constructor(root, picture, size, line, buttons) {
    Object.assign(this, { root, picture, size, line, last: "", enlarged: false });
    this.button = element("button", "enlarge", { type: "button", "aria-pressed": "false" }, ["Enlarge"]);
    this.button.addEventListener("click", () => this.enlarge(!this.enlarged));
    this.end = element("div", "end", {}, [this.button]); // one line's end, also where it takes a line of its own
    buttons.append(this.end);
    root.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !this.enlarged) return;
      taken(event);
      this.enlarge(false);
    });
    this.watch = () => { // once it has come to rest: while a theme is exchanged, nothing has its size or color
      clearTimeout(this.settling);
      this.settling = setTimeout(() => { this.settling = 0; if (this.last) this.look(); line.onStir(); }, SETTLED);
      this.begin();
      line.onStir();
    };
    this.resizing = new ResizeObserver(this.watch);
    this.resizing.observe(root);
    this.resizing.observe(root.parentElement); // less room around it does not change its own size
    this.theming = new MutationObserver(this.watch);
    for (const node of [document.documentElement, document.body]) this.theming.observe(node, { attributes: true });
    window.addEventListener("resize", this.watch); // also fired when the zoom, and with it the pixel ratio, changes
    this.scheme = window.matchMedia("(prefers-color-scheme: dark)");
    this.scheme.addEventListener("change", this.watch);
  }

  /** The first picture is asked for as soon as there is room for it: there is none yet that could jump. */
  begin() {
    if (!this.last && !this.waits?.()) this.look();
  }

  /** Tell Python of the room when it has changed; `again` asks for a whole picture in any case. */
  look(again = false) {
    const width = Math.floor(this.root.clientWidth);
    if (!width) return; // hidden, or a theme is being exchanged
    if (this.enlarged) this.root.style.fontSize = `${this.lettersOfTheWindow()}px`;
    const style = getComputedStyle(this.root);
    this.keepLines(`${width} ${style.fontSize}`);
    const height = Math.floor(this.visibleHeight() / 8) * 8;
    const look = {
      width: Math.floor(width - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight)), height,
      ratio: window.devicePixelRatio || 1, dark: isLight(style.color), letters: parseFloat(style.fontSize) / LETTERS,
      space: this.canDraw?.() ?? false,
    };
    this.dark = look.dark;
    const words = JSON.stringify(look);
    if (words === this.last && !again) return;
    this.last = words;
    this.line.add("look", () => look);
  }

  /** Lines that the caption has once taken stay its own at this width: the picture changes its size once, not to and fro. */
  keepLines(place) {
    const caption = this.root.querySelector(".caption");
    if (this.place !== place) caption.style.minHeight = "";
    this.place = place;
    caption.style.minHeight = `${caption.offsetHeight}px`;
  }

  /** What the picture may have of the height one sees at once, beside caption and controls. */
  visibleHeight() {
    if (this.enlarged) return window.innerHeight - this.rows() - 12;
    let seen = window.innerHeight;
    for (let node = this.root.parentElement; node; node = node.parentElement) { // the outermost that scrolls is the notebook
      if (/auto|scroll/.test(getComputedStyle(node).overflowY) && node.clientHeight > 100) seen = Math.min(window.innerHeight, node.clientHeight);
    }
    return seen - (this.root.offsetHeight - this.picture.offsetHeight - this.passing()) - 12;
  }

  /** Height of the lines that come and go: for them the picture does not change its size, or a kernel that is late with
   *  its answers would be asked for one more picture each time that this is said.
   */
  passing() {
    let sum = 0;
    for (const node of this.root.querySelectorAll(".status, .gone, .hint.under")) if (node.offsetHeight) sum += node.offsetHeight + parseFloat(getComputedStyle(node).marginTop);
    return sum;
  }

  rows() {
    const style = getComputedStyle(this.root);
    let sum = parseFloat(style.paddingTop) + parseFloat(style.paddingBottom);
    for (const node of this.root.children) if (node !== this.picture) sum += node.offsetHeight;
    return sum - this.passing() + 24;
  }

  /** Letters as large as the whole figure grows: a lecture hall reads them. */
  lettersOfTheWindow() {
    const [width, height] = this.size;
    const growth = Math.min(window.innerWidth / (width + 40), window.innerHeight / (height + 190));
    return Math.round(LETTERS * Math.min(LARGEST, Math.max(1, growth)));
  }

  enlarge(on) {
    this.enlarged = on;
    const top = typeof this.root.showPopover === "function"; // the top layer: no ancestor can clip it
    const focused = document.activeElement;
    if (on) {
      if (top) {
        this.root.popover = "manual";
        this.root.showPopover();
      }
    } else {
      if (top) {
        this.root.hidePopover();
        this.root.popover = null;
      }
      this.root.style.fontSize = "";
    }
    this.root.classList.toggle("enlarged", on);
    this.button.textContent = on ? "Back" : "Enlarge";
    this.button.setAttribute("aria-pressed", on);
    (this.root.contains(focused) ? focused : this.button).focus({ preventScroll: true });
    this.look();
  }

  close() {
    clearTimeout(this.settling);
    this.resizing.disconnect();
    this.theming.disconnect();
    window.removeEventListener("resize", this.watch);
    this.scheme.removeEventListener("change", this.watch);
  }
}

/** Whether a computed color, such as that of the words, is a light one: then the paper is dark. */
function isLight(color) {
  const [red, green, blue] = (color.match(/[\d.]+/g) ?? [0, 0, 0]).map(Number);
  return 0.299 * red + 0.587 * green + 0.114 * blue > 128;
}
