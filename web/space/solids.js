// Triangles of the solids that labkit/stage/scene3d_solids.py describes: {position, normal, indices}.

const SHARP = Math.cos((32 * Math.PI) / 180); // edges sharper than that stay edges

export function triangles(shape) {
  return { turned, raised, tube }[shape.kind](shape);
}

/** Whether one can never see its inside. */
export function isClosed({ kind, profile }) {
  return kind === "raised" || (kind === "turned" && profile[0][0] === 0 && profile[profile.length - 1][0] === 0);
}

/** A profile of (radius, height), turned about z in so many pieces; round where its pieces meet at a small angle. */
function turned({ profile, pieces: given }) {
  const largest = Math.max(...profile.map(([r]) => r));
  const pieces = given ?? (profile.length > 16 ? 36 : profile.length > 8 ? 24 : largest > 0 ? 28 : 3); // finely described, finely drawn
  const mesh = { position: [], normal: [], indices: [] };
  const parts = [];
  for (let k = 0; k + 1 < profile.length; k++) {
    const [r0, z0] = profile[k];
    const [r1, z1] = profile[k + 1];
    const length = Math.hypot(r1 - r0, z1 - z0);
    if (length > 1e-9) parts.push({ from: profile[k], to: profile[k + 1], normal: [(z1 - z0) / length, (r0 - r1) / length] });
  }
  const smooth = (a, b) => a && b && a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] > SHARP;
  const middle = (a, b) => {
    const sum = [a.normal[0] + b.normal[0], a.normal[1] + b.normal[1]];
    const size = Math.hypot(...sum);
    return [sum[0] / size, sum[1] / size];
  };
  parts.forEach((part, k) => {
    const start = smooth(parts[k - 1], part) ? middle(parts[k - 1], part) : part.normal;
    const end = smooth(part, parts[k + 1]) ? middle(part, parts[k + 1]) : part.normal;
    const first = mesh.position.length / 3;
    for (const [[r, z], n] of [[part.from, start], [part.to, end]]) {
      for (let j = 0; j <= pieces; j++) {
        const angle = (2 * Math.PI * j) / pieces;
        const [c, s] = [Math.cos(angle), Math.sin(angle)];
        mesh.position.push(r * c, r * s, z);
        mesh.normal.push(n[0] * c, n[0] * s, n[1]);
      }
    }
    for (let j = 0; j < pieces; j++) {
      const [a, b, c, d] = [first + j, first + j + 1, first + pieces + 1 + j, first + pieces + 2 + j];
      if (part.from[0] > 0) mesh.indices.push(a, b, d);
      if (part.to[0] > 0) mesh.indices.push(a, d, c);
    }
  });
  return mesh;
}

/** A convex outline, raised. */
function raised({ outline, bottom, top }) {
  const mesh = { position: [], normal: [], indices: [] };
  const face = (corners, normal) => {
    const first = mesh.position.length / 3;
    for (const corner of corners) {
      mesh.position.push(...corner);
      mesh.normal.push(...normal);
    }
    for (let k = 1; k + 1 < corners.length; k++) mesh.indices.push(first, first + k, first + k + 1);
  };
  outline.forEach(([x0, y0], k) => {
    const [x1, y1] = outline[(k + 1) % outline.length];
    const length = Math.hypot(x1 - x0, y1 - y0) || 1;
    if (top > bottom) face([[x0, y0, bottom], [x1, y1, bottom], [x1, y1, top], [x0, y0, top]], [(y1 - y0) / length, (x0 - x1) / length, 0]);
  });
  face(outline.map(([x, y]) => [x, y, top]), [0, 0, 1]);
  face([...outline].reverse().map(([x, y]) => [x, y, bottom]), [0, 0, -1]);
  return mesh;
}

/** A path with a thickness. */
function tube({ path, radius }) {
  const pieces = 10;
  const mesh = { position: [], normal: [], indices: [] };
  const way = (k) => unit(minus(path[Math.min(k + 1, path.length - 1)], path[Math.max(k - 1, 0)]));
  const first = way(0).map(Math.abs);
  let side = [0, 0, 0];
  side[first.indexOf(Math.min(...first))] = 1;
  path.forEach((point, k) => {
    const z = way(k);
    const along = dot(side, z);
    side = unit(side.map((v, i) => v - along * z[i]));
    const other = [z[1] * side[2] - z[2] * side[1], z[2] * side[0] - z[0] * side[2], z[0] * side[1] - z[1] * side[0]];
    for (let j = 0; j <= pieces; j++) {
      const [c, s] = [Math.cos((2 * Math.PI * j) / pieces), Math.sin((2 * Math.PI * j) / pieces)];
      const n = side.map((v, i) => c * v + s * other[i]);
      mesh.position.push(...point.map((v, i) => v + radius * n[i]));
      mesh.normal.push(...n);
    }
    if (k === 0) return;
    for (let j = 0; j < pieces; j++) {
      const a = (k - 1) * (pieces + 1) + j;
      const c = a + pieces + 1;
      mesh.indices.push(a, a + 1, c + 1, a, c + 1, c);
    }
  });
  return mesh;
}

export const minus = (a, b) => a.map((v, k) => v - b[k]);
export const dot = (a, b) => a.reduce((sum, v, k) => sum + v * b[k], 0);
export const unit = (a) => {
  const size = Math.hypot(...a) || 1;
  return a.map((v) => v / size);
};
