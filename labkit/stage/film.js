// A recorded Stage: answers `stage.js` from a film, as Python answers from a living Stage. What a film holds is said in
// film.py. A handle goes to the recorded place nearest to the pointer, a slider to the recorded positions.
// Scenes in space are drawn by `space.js` as with a living Stage, and turn freely: a note says which numbers each thing
// has. No picture holds them, so the numbers are sent even while the page has lost its means to draw.

const KEPT = 4; // developed tracks kept at once, some 16 MB each

const developed = new Map(); // track -> promise of its pictures, the newest last

/** The pictures of a track, one byte a pixel, one after the other. */
function develop(track, area) {
  const known = developed.get(track);
  developed.delete(track);
  developed.set(track, known ?? unpacked(track.pictures, area));
  if (developed.size > KEPT) developed.delete(developed.keys().next().value);
  return developed.get(track);
}

async function inflated(base64) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function unpacked(base64, area) {
  const pictures = await inflated(base64);
  for (let k = area; k < pictures.length; k++) pictures[k] ^= pictures[k - area]; // each was stored as what differs
  return pictures;
}

/** All that things in space were given: [[words, numbers (float32)], ...]; the bytes were stored first bytes first. */
async function things({ counts, words, numbers }) {
  const sorted = await inflated(numbers);
  const count = sorted.length / 4;
  const bytes = new Uint8Array(sorted.length);
  for (let k = 0; k < sorted.length; k++) bytes[4 * (k % count) + Math.floor(k / count)] = sorted[k];
  const all = new Float32Array(bytes.buffer);
  let used = 0;
  return counts.map((many, k) => [words[k], all.subarray(used, (used += many))]);
}

function opaque(palette) {
  return Uint32Array.from({ length: palette.length / 3 }, (_, k) => (0xff << 24 | palette[3 * k + 2] << 16 | palette[3 * k + 1] << 8 | palette[3 * k]) >>> 0);
}

export class Projector {
  constructor(film) {
    this.film = film;
    this.palettes = film.palettes.map(opaque);
    this.hears = new Set();
    Object.assign(this, { look: null, shown: 0, epoch: 0, turned: 0, asked: 0, drawn: null, home: null });
    this.placed = (places) => places; // `stage.js` puts in its own: where handles are as one looks now
    this.things = film.space ? things(film.space) : Promise.resolve([]);
    this.enter("start");
  }

  get(name) { return name === "declaration" ? this.film.declaration : undefined; }
  on(kind, hear) { if (kind === "msg:custom") this.hears.add(hear); }
  off(kind, hear) { this.hears.delete(hear); }

  send(message) {
    if (message.look) Object.assign(this, { look: message.look, drawn: null });
    if (message.button) this.press(message.button);
    else if (message.time) this.seek(message.time);
    for (const [name, position] of Object.entries(message.control ?? {})) if (name) this.move("control", position);
    for (const [name, at] of Object.entries(message.drag ?? {})) this.move("handle", this.nearest(name, at));
    for (const [name, steps] of Object.entries(message.step ?? {})) this.move("handle", this.neighbor(name, steps));
    if (message.orbit) this.turn(message.orbit);
    if ("serial" in message) this.answer(message.serial);
  }

  enter(name) {
    this.name = name;
    this.track = this.film.tracks[name];
    this.at = this.track.entry;
  }

  move(name, at) {
    if (!this.film.tracks[name]) return;
    this.enter(name);
    this.at = Math.max(0, Math.min(at, this.track.notes.length - 1));
  }

  press(button) {
    this.epoch += 1;
    this.turned = 0;
    if (button === "Reset") this.home = this.film.declaration.home;
    this.enter(button === "Reset" ? (this.film.tracks.play ? "play" : "start") : button);
  }

  /** Time runs on in what goes wrong, once it does. */
  seek({ at, epoch }) {
    if (epoch === this.epoch) this.move(this.name === "Make it fail" ? this.name : "play", at);
  }

  nearest(name, [right, down]) {
    const away = this.film.tracks.handle.notes.map((note) => {
      const [x, y] = this.placeOf(name, note);
      return Math.hypot(x - right, y - down);
    });
    return away.indexOf(Math.min(...away));
  }

  placeOf(name, { handles }) {
    return this.placed(handles)[name].at;
  }

  /** One picture on or back, whichever lies in the direction of the arrow key. */
  neighbor(name, [right, up]) {
    const { notes } = this.film.tracks.handle;
    const here = this.name === "handle" ? this.at : this.nearest(name, this.placeOf(name, this.track.notes[this.at]));
    const from = this.placeOf(name, notes[here]);
    const along = (k) => {
      const to = this.placeOf(name, notes[k]);
      return (to[0] - from[0]) * right - (to[1] - from[1]) * up;
    };
    const beside = [(here + 1) % notes.length, (here + notes.length - 1) % notes.length];
    const best = along(beside[0]) >= along(beside[1]) ? beside[0] : beside[1];
    return along(best) > 0 ? best : here;
  }

  turn([right]) {
    const { view } = this.film.tracks;
    if (!view) return;
    this.turned += right / 20; // film.py turns by so many CSS pixels from picture to picture
    const count = view.notes.length;
    this.move("view", ((Math.round(this.turned) % count) + count) % count);
  }

  async answer(serial) {
    const asked = ++this.asked;
    const { track, at } = this;
    const [width, height] = this.film.size;
    const [pictures, things] = await Promise.all([develop(track, width * height), this.things]);
    if (asked !== this.asked || !this.look) return; // a newer question has been put
    const dark = Number(this.look.dark);
    const colors = this.palettes[dark];
    const pixels = new Uint32Array(width * height);
    for (let k = 0, from = at * pixels.length; k < pixels.length; k++) pixels[k] = colors[pictures[from + k]];
    const high = this.film.narrow ? Infinity : this.look.height; // a phone scrolls: smaller, its letters are not read
    const scale = Math.min(this.look.width / width, high / height);
    const note = track.notes[at];
    const handles = Object.entries(note.handles).map(([name, place]) => [name, { ...place, color: place.color[dark] }]);
    const [space, numbers] = note.things ? this.spaceOf(note.things, things) : [null, []];
    const message = {
      ...note, space, handles: Object.fromEntries(handles), time: note.time && { ...note.time, ...this.clock(), epoch: this.epoch },
      picture: ++this.shown, on: null, pixels: this.film.size, serial, cursor: "", milliseconds: 0,
      width: Math.round(scale * width), height: Math.round(scale * height),
    };
    for (const hear of this.hears) hear(message, [new DataView(pixels.buffer), ...numbers]);
  }

  /** What the scenes lack since the picture before: as Stage tells it, and the numbers. */
  spaceOf(now, things) {
    const chosen = [];
    const rows = now.map((numbers, scene) => numbers.flatMap((number, k) => {
      if (this.drawn?.[scene][k] === number) return [];
      if (number < 0) return [[k, 0, 0, null]];
      const [words, values] = things[number];
      chosen.push(values);
      return [[k, 1, values.length, words]];
    }));
    const all = new Float32Array(chosen.reduce((sum, values) => sum + values.length, 0));
    chosen.reduce((used, values) => (all.set(values, used), used + values.length), 0);
    const view = this.home;
    Object.assign(this, { drawn: now, home: null });
    return [{ places: this.film.places, rows, view }, [new DataView(all.buffer)]];
  }

  clock() {
    const { play } = this.film.tracks;
    return ["play", "Make it fail"].includes(this.name) ? {} : { at: play.entry };
  }
}
