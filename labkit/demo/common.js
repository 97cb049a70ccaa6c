// What the lecturer's windows share: the line to Python, and small helpers.

const AGAIN_AFTER = 700; // ms until a line that was cut is tried again
const LONGEST = 5000; // ms between two tries

export function element(tag, className = "", text = "") {
  const node = document.createElement(tag);
  if (className) node.className = className;
  node.textContent = text;
  return node;
}

/** A WebSocket that comes back: after a reload of the server, a sleep of the machine. */
export class Wire {
  constructor({ opened, cut, heard, seen = () => {} }) {
    Object.assign(this, { opened, cut, heard, seen, wait: AGAIN_AFTER });
    this.connect();
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/line`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { this.wait = AGAIN_AFTER; this.opened(); };
    socket.onclose = () => {
      this.cut();
      setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(LONGEST, 1.5 * this.wait);
    };
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.heard(JSON.parse(data)) : this.seen(...unframed(data)));
    this.socket = socket;
  }

  /** Throws where the line is cut. */
  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN) throw new Error("the line is cut");
    this.socket.send(JSON.stringify(message));
  }

  /** For what may get lost while the line is cut. */
  ask(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}

/** [message, its buffers as DataViews] of what labkit/demo/house.py has framed. */
function unframed(data) {
  const count = new DataView(data).getUint32(0, true);
  const lengths = Array.from({ length: count }, (_, k) => new DataView(data).getUint32(4 + 4 * k, true));
  let at = 4 + 4 * count;
  const parts = lengths.map((length) => { at += length; return new DataView(data, at - length, length); });
  return [JSON.parse(new TextDecoder().decode(parts[0])), parts.slice(1)];
}

/** The key of the card that the address names, "05/scan-line"; "" without one. */
export function keyOfAddress() {
  return decodeURIComponent(location.hash.slice(1));
}
