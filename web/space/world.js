// All solids of a scene where they stand in the world, as one: their corners, and of their triangles those one sees.
// A processor that draws spends its time on triangles; half of a closed body's look away, and are not even asked for.

import { triangles } from "./solids.js";

export const PART_NUMBERS = 20; // of a part of a body: its pose in columns, its color; opacity 0 hides it
export const DOWN = [0.28, -0.2]; // how far a shadow goes aside for each unit it falls: x, y
const LIGHT = [-DOWN[0], -DOWN[1], 1, 0]; // from where it falls: a direction
const meshes = new Map();

/** Triangles of a solid, made once for all that are alike. */
function meshOf(shape) {
  const key = JSON.stringify(shape);
  if (!meshes.has(key)) {
    const { position, normal, indices } = triangles(shape);
    meshes.set(key, { position: new Float32Array(position), normal: new Float32Array(normal), indices });
  }
  return meshes.get(key);
}

/** Where each of several begins, and in the end the sum. */
function starts(counts) {
  const all = [0];
  for (const count of counts) all.push(all[all.length - 1] + count);
  return all;
}

/** A color as four bytes in the order of memory; 0 is out of sight. */
function packed(red, green, blue, opacity) {
  if (opacity === 0) return 0;
  const byte = (share) => Math.round(255 * share);
  return (byte(red) | (byte(green) << 8) | (byte(blue) << 16) | (Math.max(1, byte(opacity)) << 24)) >>> 0;
}

export class World {
  /** Shapes of parts, the `closed` ones first, then up to number `full` the others one cannot look through, then those
   *  one can. */
  constructor(shapes, closed, full) {
    Object.assign(this, { closed, full, meshes: shapes.map(meshOf) });
    this.first = starts(this.meshes.map(({ position }) => position.length / 3));
    this.start = starts(this.meshes.map(({ indices }) => indices.length));
    const [corners, all] = [this.first, this.start].map((ends) => ends[shapes.length]);
    this.corners = new Float32Array(6 * corners); // where each is, and what stands upright on its triangle there
    this.colors = new Uint32Array(corners);
    this.mirrored = new Uint8Array(shapes.length);
    this.indices = new Uint32Array(all);
    this.meshes.forEach((mesh, part) => mesh.indices.forEach((index, k) => { this.indices[this.start[part] + k] = this.first[part] + index; }));
    this.chosen = new Uint32Array(all);
  }

  get triangles() {
    return this.indices.length / 3;
  }

  /** Put all parts where they are, PART_NUMBERS each; whether one has another color now. */
  place(numbers) {
    const { first, colors } = this;
    let recolored = false;
    this.meshes.forEach((mesh, part) => {
      const m = numbers.subarray(PART_NUMBERS * part, PART_NUMBERS * (part + 1));
      const color = packed(m[16], m[17], m[18], m[19]);
      if (colors[first[part]] !== color) {
        colors.fill(color, first[part], first[part + 1]);
        recolored = true;
      }
      if (color) this.mirrored[part] = Number(lead(mesh, m, this.corners, 6 * first[part]) < 0);
    });
    return recolored;
  }

  /** Triangles as seen from an eye (x, y, z, 1), or from afar (a direction, 0): of closed bodies the outside alone, of
   *  those one can look through first what is farther. Indices, and how many of them are of what hides others. */
  seen(eye) {
    const opaque = this.hiding(eye);
    let used = this.choose(this.full, this.meshes.length, eye, -1, opaque);
    used = this.choose(this.full, this.meshes.length, eye, 1, used);
    return { indices: this.chosen.subarray(0, used), opaque };
  }

  /** Indices of the triangles that throw a shadow. */
  lit() {
    return this.chosen.subarray(0, this.hiding(LIGHT));
  }

  hiding(eye) {
    return this.choose(this.closed, this.full, eye, 0, this.choose(0, this.closed, eye, 1, 0));
  }

  /** To `chosen`, from place `used` on, triangles of parts that look toward (side 1) or away from an eye (-1), or all
   *  (0); returns the place after them. */
  choose(from, to, eye, side, used) {
    for (let part = from; part < to; part++) {
      if (this.colors[this.first[part]] === 0) continue;
      const [start, end] = [this.start[part], this.start[part + 1]];
      if (side === 0) {
        this.chosen.set(this.indices.subarray(start, end), used);
        used += end - start;
      } else used = facing(this, start, end, eye, this.mirrored[part] ? -side : side, used);
    }
    return used;
  }

  /** How far the shadow reaches, [low x, low y, high x, high y] on a floor at a height. */
  fallen(height) {
    const { corners, colors } = this;
    const reach = [Infinity, Infinity, -Infinity, -Infinity];
    for (let corner = 0; corner < this.first[this.full]; corner++) {
      if (colors[corner] === 0) continue;
      const lift = corners[6 * corner + 2] - height;
      const x = corners[6 * corner] + DOWN[0] * lift;
      const y = corners[6 * corner + 1] + DOWN[1] * lift;
      if (x < reach[0]) reach[0] = x;
      if (y < reach[1]) reach[1] = y;
      if (x > reach[2]) reach[2] = x;
      if (y > reach[3]) reach[3] = y;
    }
    return reach;
  }
}

/** The corners of a mesh by a pose in columns, which may stretch it; the determinant. */
function lead({ position, normal }, m, corners, used) {
  const [ax, ay, az, bx, by, bz, cx, cy, cz] = [m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]];
  const [ux, uy, uz] = [by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx]; // what is upright goes by cross products
  const [vx, vy, vz] = [cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax];
  const [wx, wy, wz] = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
  for (let k = 0; k < position.length; k += 3, used += 6) {
    const x = position[k], y = position[k + 1], z = position[k + 2];
    const p = normal[k], q = normal[k + 1], r = normal[k + 2];
    corners[used] = ax * x + bx * y + cx * z + m[12];
    corners[used + 1] = ay * x + by * y + cy * z + m[13];
    corners[used + 2] = az * x + bz * y + cz * z + m[14];
    corners[used + 3] = ux * p + vx * q + wx * r;
    corners[used + 4] = uy * p + vy * q + wy * r;
    corners[used + 5] = uz * p + vz * q + wz * r;
  }
  return ax * ux + ay * uy + az * uz;
}

/** Triangles of the indices from `start` to `end` that turn their side (1 or -1) to an eye. */
function facing({ corners, indices, chosen }, start, end, [ex, ey, ez, near], side, used) {
  for (let k = start; k < end; k += 3) {
    const a = 6 * indices[k], b = 6 * indices[k + 1], c = 6 * indices[k + 2];
    const x = corners[a], y = corners[a + 1], z = corners[a + 2];
    const px = corners[b] - x, py = corners[b + 1] - y, pz = corners[b + 2] - z;
    const qx = corners[c] - x, qy = corners[c + 1] - y, qz = corners[c + 2] - z;
    const toward = (py * qz - pz * qy) * (ex - near * x) + (pz * qx - px * qz) * (ey - near * y) + (px * qy - py * qx) * (ez - near * z);
    if (side * toward > 0) {
      chosen[used++] = indices[k];
      chosen[used++] = indices[k + 1];
      chosen[used++] = indices[k + 2];
    }
  }
  return used;
}
