// One WebGL context a page: each scene is drawn into it and copied onto its own 2D canvas, so that a page with twenty
// Stages needs one context, and a picture stays where the context is lost.

import { createProgramInfo, setUniforms } from "twgl.js";
import { DOWN, World } from "./world.js";

const NEAR = 0.05; // of the eye's distance
const LOOK_AGAIN = 10; // ms until one looks whether all is drawn,
const PATIENCE = 3000; // and until that is given up
const SHADOWED = 2.2; // half the width of the floor that can lie in shadow, in the scene's half widths
const SHADOW_PIXELS = [1024, 512]; // of the shadow's own picture; where a processor draws
const LENS = `
uniform mat3 axes; uniform vec3 center; uniform vec4 lens; uniform vec2 range; // lens: scale x, y, eye (0: infinite), pixels a unit
vec4 project(vec3 world) {
  vec3 p = axes * (world - center);
  float w = lens.z > 0.0 ? max(1.0 - p.z / lens.z, 1e-3) : 1.0; // distance over the eye's distance
  float depth = lens.z > 0.0 ? (range.x + range.y / w) : -p.z * range.y;
  return vec4(p.xy * lens.xy, depth * w, w);
}`;
const SOLID_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 position; layout(location = 1) in vec3 normal; layout(location = 2) in vec4 tint; // as \`World\` puts them
${LENS}
out vec3 n; flat out vec4 color;
void main() {
  color = tint;
  n = axes * normal;
  gl_Position = project(position);
}`;
const SOLID_FRAGMENT = `#version 300 es
precision highp float;
in vec3 n; flat in vec4 color; out vec4 shown;
void main() {
  vec3 m = normalize(n); if (!gl_FrontFacing) m = -m;
  float light = 0.56 + 0.44 * max(dot(m, vec3(-0.42, 0.66, 0.62)), 0.0);
  float gleam = 0.16 * pow(max(dot(m, vec3(-0.24, 0.37, 0.90)), 0.0), 18.0);
  float rim = color.a < 1.0 ? 1.0 + 2.2 * pow(1.0 - abs(m.z), 3.0) : 1.0; // a shell is denser where one looks along it
  float a = min(color.a * rim, 1.0);
  shown = vec4((color.rgb * light + gleam) * a, a);
}`;
const CAST_VERTEX = `#version 300 es
precision highp float;
layout(location = 0) in vec3 position;
uniform vec3 fall; // along the light onto the floor's height, and the scale of the shadow's own picture
void main() {
  gl_Position = vec4((position.xy + vec2(${DOWN}) * (position.z - fall.x)) * fall.z, 0.0, 1.0);
}`;
const CAST_FRAGMENT = `#version 300 es
precision highp float;
out vec4 shown;
void main() { shown = vec4(1.0); }`;
const FLOOR_VERTEX = `#version 300 es
precision highp float;
in vec2 corner; uniform vec3 fall; uniform vec4 reach; // of the shadow in its own picture: low x, low y, high x, high y
${LENS}
out vec2 at;
void main() { vec2 p = mix(reach.xy, reach.zw, corner); at = 0.5 + 0.5 * p; gl_Position = project(vec3(p / fall.z, fall.x)); }`;
const FLOOR_FRAGMENT = `#version 300 es
precision highp float; precision highp sampler2D;
in vec2 at; uniform sampler2D fallen; uniform vec4 shade; out vec4 shown;
void main() { shown = shade * texture(fallen, at).r; }`;
const LINE_VERTEX = `#version 300 es
precision highp float;
in vec2 corner; in vec3 a; in vec3 b; in vec2 along; in vec4 look; in vec2 kind; // kind: width, dash (none, dashed, dotted)
uniform vec2 room; uniform float ratio; uniform float share;
${LENS}
out float at; out float side; flat out vec4 color; flat out float width; flat out vec2 dash;
void main() {
  width = kind.x * ratio;
  color = vec4(look.rgb, look.a * share);
  dash = kind.y == 1.0 ? vec2(4.2, 2.7) * max(width, 2.0 * ratio) : kind.y == 2.0 ? vec2(2.6, 1.2) * max(width, 1.5 * ratio) : vec2(0.0);
  vec4 p = project(a); vec4 q = project(b);
  vec2 way = (q.xy / q.w - p.xy / p.w) * room;
  float size = length(way);
  vec2 d = size > 1e-4 ? way / size : vec2(1.0, 0.0);
  vec4 here = mix(p, q, corner.x);
  vec2 off = vec2(-d.y, d.x) * corner.y * (width * 0.5 + 0.5) + d * (corner.x * 2.0 - 1.0) * width * 0.35;
  here.xy += off * 2.0 / room * here.w;
  here.z -= 4e-4 * here.w;
  gl_Position = here;
  at = mix(along.x, along.y, corner.x) * lens.w;
  side = corner.y * (width * 0.5 + 0.5);
}`;
const LINE_FRAGMENT = `#version 300 es
precision highp float;
in float at; in float side; flat in vec4 color; flat in float width; flat in vec2 dash; out vec4 shown;
void main() {
  if (dash.x > 0.0 && mod(at, dash.x) > dash.y) discard;
  float a = color.a * clamp(width * 0.5 + 0.5 - abs(side), 0.0, 1.0);
  shown = vec4(color.rgb * a, a);
}`;
const POINT_VERTEX = `#version 300 es
precision highp float;
in vec3 position; in vec4 look; in vec3 kind; // kind: size, marker, whether it is hollow
uniform float mark; uniform float share;
${LENS}
flat out vec4 color; flat out vec3 drawn;
void main() {
  color = vec4(look.rgb, look.a * share);
  drawn = vec3(kind.x * mark, kind.yz);
  gl_Position = project(position);
  gl_Position.z -= 6e-4 * gl_Position.w;
  gl_PointSize = drawn.x + 2.0;
}`;
const POINT_FRAGMENT = `#version 300 es
precision highp float;
flat in vec4 color; flat in vec3 drawn; out vec4 shown;
void main() {
  float size = drawn.x; int marker = int(drawn.y);
  vec2 p = (gl_PointCoord - 0.5) * (size + 2.0); vec2 q = abs(p);
  float r = 0.5 * size;
  float d = length(p) - r;
  if (marker > 0) { // a processor that draws would work out all of them for every point
    d = marker == 1 ? max(q.x, q.y) - 0.9 * r : marker == 2 ? (q.x + q.y) * 0.72 - 0.85 * r
      : marker == 3 ? abs(q.x - q.y) - 0.3 * r + max(0.0, max(q.x, q.y) - r) * 4.0 // x
      : marker == 4 ? min(q.x, q.y) - 0.16 * r + max(0.0, max(q.x, q.y) - r) * 4.0 // +
      : marker == 5 ? max(q.x * 1.7 + p.y, -p.y - 0.8 * r) * 0.8 - 0.55 * r // triangle up: p.y grows downward
      : max(q.x * 1.7 - p.y, p.y - 0.8 * r) * 0.8 - 0.55 * r;
  }
  if (drawn.z > 0.5) d = abs(d + 1.0) - 1.0;
  float a = color.a * clamp(0.5 - d, 0.0, 1.0);
  if (a < 0.02) discard;
  shown = vec4(color.rgb * a, a);
}`;
export const MARKERS = { o: 0, ".": 0, s: 1, D: 2, d: 2, x: 3, "+": 4, "^": 5, v: 6 };
export const LINE_NUMBERS = 16; // of a corner of a piece of a line: from, to, length until its start and its end, color, width, dash, which corner
export const POINT_NUMBERS = 10; // of a point: where, color, size, marker, hollow

export class Renderer {
  /** Throws where there is no WebGL 2; onChange(): the context is lost, or is back. */
  constructor(onChange) {
    this.canvas = document.createElement("canvas");
    this.canvas.width = this.canvas.height = 1;
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.lost = true;
      onChange();
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.prepare();
      onChange();
    });
    this.gl = this.canvas.getContext("webgl2", { antialias: false, powerPreference: "low-power" });
    if (!this.gl) throw new Error("no WebGL 2");
    const named = this.gl.getExtension("WEBGL_debug_renderer_info");
    this.software = /swiftshader|llvmpipe|software|basic render/i.test(named ? this.gl.getParameter(named.UNMASKED_RENDERER_WEBGL) : "");
    this.prepare();
  }

  prepare() {
    const { gl } = this;
    this.lost = false;
    this.smooth = null;
    this.whole = false; // a processor that draws has its first picture sooner without shadow and what shines through: the first smooth one brings both
    this.age = (this.age ?? 0) + 1; // whoever holds buffers makes them anew when it has changed
    this.solid = createProgramInfo(gl, [SOLID_VERTEX, SOLID_FRAGMENT]);
    this.cast = createProgramInfo(gl, [CAST_VERTEX, CAST_FRAGMENT]);
    this.floor = createProgramInfo(gl, [FLOOR_VERTEX, FLOOR_FRAGMENT]);
    this.line = createProgramInfo(gl, [LINE_VERTEX, LINE_FRAGMENT]);
    this.point = createProgramInfo(gl, [POINT_VERTEX, POINT_FRAGMENT]);
    for (const program of [this.solid, this.cast, this.floor, this.line, this.point]) if (!program) throw new Error("the shaders were refused");
    this.warm();
  }

  /** Draw one of each, for nobody to see: a shader becomes a processor's or a driver's own code when it is first used,
   *  and that goes on beside the page while it waits for Python. */
  warm() {
    const [box, shell] = [{ kind: "raised", outline: [[0, 0], [1, 0], [0, 1]], bottom: 0, top: 1 }, { kind: "turned", profile: [[1, 0], [1, 1]] }];
    const solids = this.solids([box, shell, box], 1, 2);
    const pose = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    this.place(solids, new Float32Array([1, 1, 0.5].flatMap((opacity) => [...pose, 0, 0, 0, opacity])));
    const [lines, points] = [this.lines(null, new Float32Array(4 * LINE_NUMBERS)), this.points(null, new Float32Array(POINT_NUMBERS))];
    const lens = { axes: [1, 0, 0, 0, 1, 0, 0, 0, 1], center: [0, 0, 0], eye: 0, perUnit: 1, scale: [1, 1], reach: 12, ratio: 1, mark: 1 };
    this.draw(8, 8, lens, { solids, lines, points, floor: 0, shadow: [0, 0, 0, 0.5], wide: 1 }, !this.software, false);
    for (const made of [solids, lines, points]) this.free(made);
    this.finish();
  }

  /** All that has been asked for is done beside the page; a flush alone is put off until something is read. */
  finish() {
    const { gl, age } = this;
    const [fence, end] = [gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), performance.now() + PATIENCE];
    const look = () => {
      if (this.lost || this.age !== age) return; // and the fence with the context
      const done = gl.clientWaitSync(fence, gl.SYNC_FLUSH_COMMANDS_BIT, 0) !== gl.TIMEOUT_EXPIRED;
      if (!done && performance.now() < end) return void setTimeout(look, LOOK_AGAIN);
      gl.deleteSync(fence);
    };
    look();
  }

  /** All solids of a scene as one: a processor that draws spends more on being asked than on triangles. Shapes of parts
   *  as `World` wants them; where they are is told by `place`. */
  solids(shapes, closed, full) {
    const { gl } = this;
    const made = { world: new World(shapes, closed, full), vao: gl.createVertexArray(), corners: gl.createBuffer(), colors: gl.createBuffer(), order: gl.createBuffer() };
    made.buffers = [made.corners, made.colors, made.order];
    gl.bindVertexArray(made.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.corners);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0);
    gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 24, 12);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.colors);
    gl.vertexAttribPointer(2, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    for (const place of [0, 1, 2]) gl.enableVertexAttribArray(place);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, made.order);
    gl.bindVertexArray(null);
    return made;
  }

  attribute(program, made, name, size, data) {
    const { gl } = this;
    const buffer = gl.createBuffer();
    made.buffers.push(buffer);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    const place = gl.getAttribLocation(program.program, name);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
  }

  /** Poses and colors of all parts, PART_NUMBERS each; the shadow has to be cast again. */
  place(solids, numbers) {
    const { gl } = this;
    const recolored = solids.world.place(numbers);
    gl.bindBuffer(gl.ARRAY_BUFFER, solids.corners);
    gl.bufferData(gl.ARRAY_BUFFER, solids.world.corners, gl.DYNAMIC_DRAW);
    solids.cast = false;
    if (!recolored && solids.painted) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, solids.colors);
    gl.bufferData(gl.ARRAY_BUFFER, solids.world.colors, gl.DYNAMIC_DRAW);
    solids.painted = true;
  }

  /** Draw the solids' triangles anew from their indices: from here on they are in the buffer. */
  order(solids, indices) {
    const { gl } = this;
    gl.bindVertexArray(solids.vao);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STREAM_DRAW);
  }

  /** All lines, or all points, of a scene: LINE_NUMBERS or POINT_NUMBERS each. A line has four corners a piece, as
   *  triangles: a processor draws instances one by one. */
  lines(old, data) {
    const { gl } = this;
    const layout = [["a", 3], ["b", 3], ["along", 2], ["look", 4], ["kind", 2], ["corner", 2]];
    const made = old ?? this.interleaved(this.line, layout, LINE_NUMBERS);
    if (!old) made.buffers.push((made.indices = gl.createBuffer()));
    this.rows(made, data, 4 * LINE_NUMBERS);
    if (made.count > (made.room ?? 0)) {
      made.room = 2 * made.count;
      const indices = new Uint32Array(6 * made.room);
      for (let k = 0; k < made.room; k++) indices.set([4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 2, 4 * k + 1, 4 * k + 3], 6 * k);
      gl.bindVertexArray(made.vao);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, made.indices);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
      gl.bindVertexArray(null);
    }
    return made;
  }

  points(old, data) {
    return this.rows(old ?? this.interleaved(this.point, [["position", 3], ["look", 4], ["kind", 3]], POINT_NUMBERS), data, POINT_NUMBERS);
  }

  interleaved(program, layout, numbers) {
    const { gl } = this;
    const made = { vao: gl.createVertexArray(), buffers: [] };
    gl.bindVertexArray(made.vao);
    made.rows = gl.createBuffer();
    made.buffers.push(made.rows);
    gl.bindBuffer(gl.ARRAY_BUFFER, made.rows);
    let offset = 0;
    for (const [name, size] of layout) {
      const place = gl.getAttribLocation(program.program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * numbers, 4 * offset);
      offset += size;
    }
    gl.bindVertexArray(null);
    return made;
  }

  rows(made, data, numbers) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, made.rows);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    made.count = data.length / numbers;
    return made;
  }

  free(made) {
    if (!made || this.lost) return;
    this.gl.deleteVertexArray(made.vao);
    for (const buffer of made.buffers) this.gl.deleteBuffer(buffer);
    if (made.shadow) {
      this.gl.deleteTexture(made.shadow.texture);
      this.gl.deleteFramebuffer(made.shadow.frame);
      this.free(made.shadow.quad);
    }
  }

  /** Where edges are smoothed: four samples a pixel, copied onto the canvas in the end. */
  smoothTarget(width, height) {
    const { gl } = this;
    this.smooth ??= { frame: gl.createFramebuffer(), color: gl.createRenderbuffer(), depth: gl.createRenderbuffer(), size: "" };
    const { frame, color, depth } = this.smooth;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    if (this.smooth.size !== `${width}x${height}`) {
      this.smooth.size = `${width}x${height}`;
      for (const [buffer, format, place] of [[color, gl.RGBA8, gl.COLOR_ATTACHMENT0], [depth, gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
        gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
        gl.renderbufferStorageMultisample(gl.RENDERBUFFER, 4, format, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
      }
    }
    return frame;
  }

  /** Draw one scene, width x height device pixels, which the canvas takes on; `smooth` edges cost a processor much, and
   *  `quick` leaves out the points that bodies hide.
   *  lens: {axes (9 numbers, columns), center, scale [x, y], eye, perUnit (device pixels), ratio (device pixels a CSS
   *  pixel), mark (the same for the size of points), reach (how deep the scene is)}. */
  draw(width, height, lens, { solids, lines, points, floor, shadow, wide }, smooth, quick) {
    const { gl, canvas } = this;
    const fall = [floor ?? 0, 0, 1 / (SHADOWED * wide)];
    this.whole ||= smooth;
    const shaded = this.whole && solids && shadow && floor !== null;
    if (shaded && !solids.cast) this.castShadow(solids, fall);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const frame = smooth ? this.smoothTarget(width, height) : null;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, width, height);
    gl.depthMask(true);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const far = lens.eye > 0 ? 1 + lens.reach / lens.eye : 1; // distances over the eye's
    const range = lens.eye > 0 ? [(far + NEAR) / (far - NEAR), (-2 * far * NEAR) / (far - NEAR)] : [0, 1 / lens.reach];
    const common = { axes: lens.axes, center: lens.center, lens: [...lens.scale, lens.eye, lens.perUnit], range, room: [width, height], ratio: lens.ratio, mark: lens.mark };
    const seen = solids && this.drawSolids(solids, common, lens);
    if (shaded) this.drawShadow(solids, common, fall, shadow); // after what hides it
    this.drawPaths(lines, points, common, 1);
    gl.depthMask(false);
    if (solids && seen.indices.length > seen.opaque) {
      gl.useProgram(this.solid.program);
      gl.bindVertexArray(solids.vao);
      this.drawPart(seen.opaque, seen.indices.length);
    }
    gl.depthFunc(gl.GREATER); // what lies behind a body shines through a little
    if (this.whole) this.drawPaths(lines, quick ? null : points, common, 0.22);
    gl.bindVertexArray(null);
    if (!frame) return;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, frame);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** What hides others; returns what one sees of all, whose indices are in the buffer. */
  drawSolids(solids, common, { axes, center, eye }) {
    const toward = [axes[2], axes[5], axes[8]];
    const seen = solids.world.seen(eye > 0 ? [...toward.map((v, k) => center[k] + eye * v), 1] : [...toward, 0]);
    this.gl.useProgram(this.solid.program);
    setUniforms(this.solid, common);
    this.order(solids, seen.indices);
    this.drawPart(0, seen.opaque);
    return seen;
  }

  drawPart(from, to) {
    const { gl } = this;
    if (to > from) gl.drawElements(gl.TRIANGLES, to - from, gl.UNSIGNED_INT, 4 * from);
  }

  /** The shadow of everything one cannot look through, as seen from above in a picture of its own: drawn when something
   *  has moved, not when one looks from elsewhere. */
  castShadow(solids, fall) {
    const { gl } = this;
    const size = SHADOW_PIXELS[Number(this.software)];
    if (!solids.shadow) {
      solids.shadow = { frame: gl.createFramebuffer(), texture: gl.createTexture(), quad: { vao: gl.createVertexArray(), buffers: [] } };
      gl.bindTexture(gl.TEXTURE_2D, solids.shadow.texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R8, size, size);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      gl.bindVertexArray(solids.shadow.quad.vao);
      this.attribute(this.floor, solids.shadow.quad, "corner", 2, new Float32Array([0, 0, 1, 0, 0, 1, 1, 1]));
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, solids.shadow.frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, solids.shadow.texture, 0);
    gl.viewport(0, 0, size, size);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.useProgram(this.cast.program);
    setUniforms(this.cast, { fall });
    const lit = solids.world.lit();
    this.order(solids, lit);
    this.drawPart(0, lit.length);
    solids.cast = true;
    solids.shadow.reach = solids.world.fallen(fall[0]).map((v, k) => Math.min(1, Math.max(-1, v * fall[2] + (k < 2 ? -2 : 2) / size)));
  }

  drawShadow(solids, common, fall, shade) {
    const { gl } = this;
    gl.useProgram(this.floor.program);
    gl.bindVertexArray(solids.shadow.quad.vao);
    setUniforms(this.floor, { ...common, fall, fallen: solids.shadow.texture, shade, reach: solids.shadow.reach });
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.depthMask(true);
  }

  drawPaths(lines, points, common, share) {
    const { gl } = this;
    if (lines?.count) {
      gl.useProgram(this.line.program);
      setUniforms(this.line, { ...common, share });
      gl.bindVertexArray(lines.vao);
      gl.drawElements(gl.TRIANGLES, 6 * lines.count, gl.UNSIGNED_INT, 0);
    }
    if (points?.count) {
      gl.useProgram(this.point.program);
      setUniforms(this.point, { ...common, share });
      gl.bindVertexArray(points.vao);
      gl.drawArrays(gl.POINTS, 0, points.count);
    }
  }
}
