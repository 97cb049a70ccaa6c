// The picture of a Stage and the handles over it. Everything that happens is merged into `pending`; one message is in flight,
// the next one carries what came meanwhile, so that a drag never queues up. Python answers with one picture.

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const NAMES = { ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down" };
const PATIENCE = 3000; // ms until a message without an answer (kernel restarted) is given up
const SPEAK_AFTER = 700; // ms of rest until a screen reader hears the new caption
const CLICK_RADIUS = 4; // CSS pixels
const MAX_ARROWS = 10; // presses kept while a message is in flight

function element(tag, className, attributes = {}) {
  const node = document.createElement(tag);
  node.className = className;
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  return node;
}

function isDark() {
  return document.body.dataset.jpThemeLight === "false";
}

function render({ model, el }) {
  const view = Math.random().toString(36).slice(2);
  const root = element("div", "labkit-stage");
  const picture = element("div", "picture");
  const canvas = element("canvas", "", { role: "img" });
  const caption = element("p", "caption", { "aria-hidden": "true" });
  const status = element("p", "status", { role: "status" });
  const spoken = element("div", "spoken", { "aria-live": "polite" });
  picture.append(canvas);
  root.append(picture, status, caption, spoken);
  el.append(root);
  const paper = canvas.getContext("2d", { willReadFrequently: true });
  const handles = new Map();

  // ---- to Python: one message in flight
  let pending = {};
  let flight = null;
  let timer = 0;
  let sent = 0;
  let count = 0;
  let shown = 0;

  function flush() {
    if (flight !== null || Object.keys(pending).length === 0) return;
    flight = `${view}:${++count}`;
    sent = performance.now();
    model.send({ ...pending, shown, serial: flight });
    pending = {};
    timer = setTimeout(() => { flight = null; flush(); }, PATIENCE);
  }

  function add(key, combine) {
    pending[key] = combine(pending[key]);
    flush();
  }

  // ---- from Python: whole pictures, and what changed since the one before
  let queue = [];
  let decoding = false;
  let image = null; // the pixels shown

  function draw() {
    while (queue.length && !decoding) {
      const { message, buffers } = queue.shift();
      if (message.on === null) decode(message, buffers[0]);
      else if (message.on === shown && image) {
        change(...buffers.map(numbers));
        show(message);
      } else {
        last = "";
        look(); // a picture was lost: a whole one is needed
      }
    }
  }

  async function decode(message, png) {
    decoding = true;
    try {
      const bitmap = await createImageBitmap(new Blob([png], { type: "image/png" }));
      canvas.width = bitmap.width;
      canvas.height = bitmap.height;
      paper.drawImage(bitmap, 0, 0);
      image = paper.getImageData(0, 0, bitmap.width, bitmap.height);
      show(message);
    } catch (error) {
      console.error("stage: the picture could not be decoded", error);
      flush(); // what happened meanwhile need not wait for the next event
    }
    decoding = false;
    draw();
  }

  function numbers(view) {
    return new Uint32Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
  }

  function change(runs, colors) { // runs of changed pixels: first place, length
    if (!colors.length) return;
    const pixels = new Uint32Array(image.data.buffer);
    for (let k = 0, used = 0; k < runs.length; used += runs[k + 1], k += 2) {
      pixels.set(colors.subarray(used, used + runs[k + 1]), runs[k]);
    }
    const top = Math.floor(runs[0] / image.width);
    const bottom = Math.floor((runs[runs.length - 2] + runs[runs.length - 1] - 1) / image.width);
    paper.putImageData(image, 0, 0, 0, top, image.width, bottom - top + 1);
  }

  function onMessage(message, buffers) {
    if (message.picture === undefined) return;
    if (message.serial !== null && message.serial === flight) {
      flight = null;
      clearTimeout(timer);
      root.dataset.answer = (performance.now() - sent).toFixed(1); // ms, for the benchmark
    }
    if (message.on === null) queue = []; // the newest wins
    queue.push({ message, buffers });
    draw();
  }

  function show(message) {
    words(message);
    shown = message.picture;
    root.dataset.python = message.milliseconds;
    root.dataset.picture = message.picture;
    // every other picture is acknowledged: Python waits after three
    const quiet = flight === null && Object.keys(pending).length === 0;
    if (message.serial === null && quiet && shown % 2 === 0) model.send({ shown });
    flush();
  }

  // what is said of the picture, and the handles over it
  function words(message) {
    picture.style.width = `${message.width}px`;
    canvas.dataset.empty = message.empty;
    canvas.dataset.click = message.click;
    canvas.dataset.keys = message.keys;
    if (message.keys || message.empty === "turn") {
      canvas.tabIndex = 0;
      canvas.setAttribute("role", "application"); // a screen reader passes arrow keys on to it
    }
    canvas.setAttribute("aria-label", [message.name, message.caption].filter(Boolean).join(": "));
    if (caption.textContent !== message.caption) {
      caption.textContent = message.caption;
      speak(message.caption);
    }
    if (status.textContent !== message.status) status.textContent = message.status;
    for (const [name, place] of Object.entries(message.handles)) {
      if (!handles.has(name)) handles.set(name, makeHandle(name));
      handles.get(name).put(place);
    }
  }

  let speaking = 0;
  function speak(text) {
    clearTimeout(speaking);
    speaking = setTimeout(() => { spoken.textContent = text; }, SPEAK_AFTER);
  }

  // ---- places: fractions of the picture, right and down
  function fraction(event) {
    const box = canvas.getBoundingClientRect();
    const limit = (x) => Math.min(1, Math.max(0, x));
    return [limit((event.clientX - box.left) / box.width), limit((event.clientY - box.top) / box.height)];
  }

  function makeHandle(name) {
    const node = element("div", "handle", {
      role: "slider", tabindex: "0", "aria-roledescription": "point to drag", "data-handle": name, "data-lm-suppress-shortcuts": "true",
    });
    picture.append(node);
    let held = null; // [pointer's offset right, down] while dragging
    let corrected = false; // Python keeps it elsewhere than the pointer: then only Python moves it
    let at = [0, 0];

    const move = ([right, down]) => {
      at = [right, down];
      node.style.left = `${100 * right}%`;
      node.style.top = `${100 * down}%`;
    };
    node.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      event.stopPropagation();
      node.focus({ preventScroll: true });
      node.setPointerCapture(event.pointerId);
      node.classList.add("held");
      const [right, down] = fraction(event);
      held = [at[0] - right, at[1] - down];
      corrected = false;
    });
    node.addEventListener("pointermove", (event) => {
      if (!held) return;
      const [right, down] = fraction(event);
      const target = [right + held[0], down + held[1]];
      if (!corrected) move(target);
      add("drag", (drag) => ({ ...drag, [name]: target }));
    });
    const release = () => { held = null; node.classList.remove("held"); };
    node.addEventListener("pointerup", release);
    node.addEventListener("pointercancel", release);
    node.addEventListener("lostpointercapture", release);
    node.addEventListener("keydown", (event) => {
      const arrow = ARROWS[event.key];
      if (!arrow || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      event.stopPropagation();
      const size = event.shiftKey ? 10 : 1;
      add("step", (step = {}) => {
        const [right, up] = step[name] ?? [0, 0];
        return { ...step, [name]: [right + size * arrow[0], up + size * arrow[1]] };
      });
    });
    return {
      put(place) {
        node.style.setProperty("--ring", place.color);
        node.setAttribute("aria-label", place.label);
        node.setAttribute("aria-valuetext", place.value);
        node.setAttribute("aria-valuenow", place.now);
        node.title = place.label;
        if (held && !corrected) {
          if (pending.drag?.[name] !== undefined || flight !== null) return; // the pointer is further already
          const box = canvas.getBoundingClientRect();
          corrected = Math.hypot((place.at[0] - at[0]) * box.width, (place.at[1] - at[1]) * box.height) > 2;
        }
        move(place.at);
      },
    };
  }

  // ---- empty space: click, draw, turn, drive
  let press = null;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    press = { x: event.clientX, y: event.clientY, start: fraction(event), moved: false };
    if (canvas.dataset.empty === "draw" || canvas.dataset.empty === "turn") {
      canvas.setPointerCapture(event.pointerId);
      event.preventDefault();
    }
    if (canvas.tabIndex === 0) canvas.focus({ preventScroll: true });
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!press) return;
    const right = event.clientX - press.x;
    const down = event.clientY - press.y;
    if (!press.moved && Math.hypot(right, down) < CLICK_RADIUS) return;
    if (canvas.dataset.empty === "turn") {
      add("orbit", ([a, b] = [0, 0]) => [a - right, b + down]);
      press.x = event.clientX;
      press.y = event.clientY;
    } else if (canvas.dataset.empty === "draw") {
      if (!press.moved) {
        pending.fresh = true;
        pending.brush = [press.start];
      }
      const points = (event.getCoalescedEvents?.() ?? []).map(fraction);
      add("brush", (path = []) => [...path, ...(points.length ? points : [fraction(event)])]);
    }
    press.moved = true;
  });
  const release = (event) => {
    if (press && !press.moved && event.type === "pointerup") {
      if (canvas.dataset.click === "true") add("click", () => fraction(event));
      else if (canvas.dataset.empty === "draw") {
        pending.fresh = true;
        add("brush", () => [fraction(event)]);
      }
    }
    press = null;
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.setAttribute("data-lm-suppress-shortcuts", "true");
  canvas.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (!arrow || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    if (canvas.dataset.keys === "true") {
      add("arrows", (names = []) => [...names, NAMES[event.key]].slice(-MAX_ARROWS));
    } else if (canvas.dataset.empty === "turn") {
      const size = event.shiftKey ? 60 : 10;
      add("orbit", ([a, b] = [0, 0]) => [a + size * arrow[0], b - size * arrow[1]]);
    }
  });

  // ---- what Python must know of the screen
  let last = "";
  let width = 0;
  function look() {
    width = Math.floor(root.getBoundingClientRect().width) || width; // 0 while hidden, and while a theme is exchanged
    if (!width) return;
    const now = { width, ratio: window.devicePixelRatio || 1, dark: isDark() };
    if (JSON.stringify(now) === last) return;
    last = JSON.stringify(now);
    add("look", () => now);
  }
  const resizing = new ResizeObserver(look);
  resizing.observe(root);
  const theming = new MutationObserver(look);
  theming.observe(document.body, { attributes: true, attributeFilter: ["data-jp-theme-light", "data-jp-theme-name"] });
  window.addEventListener("resize", look); // also fired when the zoom, and with it the pixel ratio, changes
  model.on("msg:custom", onMessage);
  look();

  return () => {
    resizing.disconnect();
    theming.disconnect();
    window.removeEventListener("resize", look);
    clearTimeout(timer);
    clearTimeout(speaking);
    model.off("msg:custom", onMessage);
  };
}

export default { render };
