// A recorded Stage: answers `stage.js` from a film, as Python answers from a living Stage. What a film holds is said in
// film.py. A handle goes to the recorded place nearest to the pointer, a slider to the recorded positions.

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

async function unpacked(base64, area) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const pictures = new Uint8Array(await new Response(stream).arrayBuffer());
  for (let k = area; k < pictures.length; k++) pictures[k] ^= pictures[k - area]; // each was stored as what differs
  return pictures;
}

function opaque(palette) {
  return Uint32Array.from({ length: palette.length / 3 }, (_, k) => (0xff << 24 | palette[3 * k + 2] << 16 | palette[3 * k + 1] << 8 | palette[3 * k]) >>> 0);
}

export class Projector {
  constructor(film) {
    this.film = film;
    this.palettes = film.palettes.map(opaque);
    this.hears = new Set();
    Object.assign(this, { look: null, shown: 0, epoch: 0, turned: 0, asked: 0 });
    this.enter("start");
  }

  get() { return this.film.declaration; }
  on(kind, hear) { if (kind === "msg:custom") this.hears.add(hear); }
  off(kind, hear) { this.hears.delete(hear); }

  send(message) {
    if (message.look) this.look = message.look;
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
    this.enter(button === "Reset" ? (this.film.tracks.play ? "play" : "start") : button);
  }

  /** Time runs on in what goes wrong, once it does. */
  seek({ at, epoch }) {
    if (epoch === this.epoch) this.move(this.name === "Make it fail" ? this.name : "play", at);
  }

  nearest(name, [right, down]) {
    const away = this.film.tracks.handle.notes.map(({ handles }) => Math.hypot(handles[name].at[0] - right, handles[name].at[1] - down));
    return away.indexOf(Math.min(...away));
  }

  /** One picture on or back, whichever lies in the direction of the arrow key. */
  neighbor(name, [right, up]) {
    const { notes } = this.film.tracks.handle;
    const here = this.name === "handle" ? this.at : this.nearest(name, this.track.notes[this.at].handles[name].at);
    const from = notes[here].handles[name].at;
    const along = (k) => {
      const to = notes[k].handles[name].at;
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
    const pictures = await develop(track, width * height);
    if (asked !== this.asked || !this.look) return; // a newer question has been put
    const dark = Number(this.look.dark);
    const colors = this.palettes[dark];
    const pixels = new Uint32Array(width * height);
    for (let k = 0, from = at * pixels.length; k < pixels.length; k++) pixels[k] = colors[pictures[from + k]];
    const scale = Math.min(this.look.width / width, this.look.height / height);
    const note = track.notes[at];
    const handles = Object.entries(note.handles).map(([name, place]) => [name, { ...place, color: place.color[dark] }]);
    const message = {
      ...note, handles: Object.fromEntries(handles), time: note.time && { ...note.time, ...this.clock(note), epoch: this.epoch },
      picture: ++this.shown, on: null, pixels: this.film.size, serial, cursor: "", milliseconds: 0,
      width: Math.round(scale * width), height: Math.round(scale * height),
    };
    for (const hear of this.hears) hear(message, [new DataView(pixels.buffer)]);
  }

  clock(note) {
    const { play } = this.film.tracks;
    return ["play", "Make it fail"].includes(this.name) ? {} : { at: play.entry };
  }
}
