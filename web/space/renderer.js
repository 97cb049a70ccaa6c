// One WebGL context a page: each scene is drawn into it and copied onto its own 2D canvas, so that a page with twenty
// Stages needs one context, and a picture stays where the context is lost.

import { createBufferInfoFromArrays, createProgramInfo, createVertexArrayInfo, setUniforms } from "twgl.js";
import { triangles } from "./solids.js";

const NEAR = 0.05; // of the eye's distance
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
in vec3 position; in vec3 normal;
uniform mat4 pose; uniform mat3 turn;
${LENS}
out vec3 n;
void main() { n = turn * normal; gl_Position = project((pose * vec4(position, 1.0)).xyz); }`;
const SOLID_FRAGMENT = `#version 300 es
precision highp float;
in vec3 n; uniform vec4 color; out vec4 shown;
void main() {
  vec3 m = normalize(n); if (!gl_FrontFacing) m = -m;
  float light = 0.56 + 0.44 * max(dot(m, vec3(-0.42, 0.66, 0.62)), 0.0);
  float gleam = 0.16 * pow(max(dot(m, vec3(-0.24, 0.37, 0.90)), 0.0), 18.0);
  float rim = color.a < 1.0 ? 1.0 + 2.2 * pow(1.0 - abs(m.z), 3.0) : 1.0; // a shell is denser where one looks along it
  float a = min(color.a * rim, 1.0);
  shown = vec4((color.rgb * light + gleam) * a, a);
}`;
const SHADOW_FRAGMENT = `#version 300 es
precision highp float;
in vec3 n; uniform vec4 color; out vec4 shown;
void main() { shown = color; }`;
const LINE_VERTEX = `#version 300 es
precision highp float;
in vec2 corner; in vec3 a; in vec3 b; in vec2 along;
uniform vec2 room; uniform float width;
${LENS}
out float at; out float side;
void main() {
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
in float at; in float side; uniform vec4 color; uniform float width; uniform vec2 dash; out vec4 shown;
void main() {
  if (dash.x > 0.0 && mod(at, dash.x) > dash.y) discard;
  float a = color.a * clamp(width * 0.5 + 0.5 - abs(side), 0.0, 1.0);
  shown = vec4(color.rgb * a, a);
}`;
const POINT_VERTEX = `#version 300 es
precision highp float;
in vec3 position; uniform float size;
${LENS}
void main() { gl_Position = project(position); gl_Position.z -= 6e-4 * gl_Position.w; gl_PointSize = size + 2.0; }`;
const POINT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 color; uniform float size; uniform int marker; uniform bool hollow; out vec4 shown;
void main() {
  vec2 p = (gl_PointCoord - 0.5) * (size + 2.0); vec2 q = abs(p);
  float r = 0.5 * size;
  float d = marker == 1 ? max(q.x, q.y) - 0.9 * r : marker == 2 ? (q.x + q.y) * 0.72 - 0.85 * r
    : marker == 3 ? abs(q.x - q.y) - 0.3 * r + max(0.0, max(q.x, q.y) - r) * 4.0 // x
    : marker == 4 ? min(q.x, q.y) - 0.16 * r + max(0.0, max(q.x, q.y) - r) * 4.0 // +
    : marker == 5 ? max(q.x * 1.7 + p.y, -p.y - 0.8 * r) * 0.8 - 0.55 * r // triangle up: p.y grows downward
    : marker == 6 ? max(q.x * 1.7 - p.y, p.y - 0.8 * r) * 0.8 - 0.55 * r : length(p) - r;
  if (hollow) d = abs(d + 1.0) - 1.0;
  float a = color.a * clamp(0.5 - d, 0.0, 1.0);
  if (a < 0.02) discard;
  shown = vec4(color.rgb * a, a);
}`;
const MARKERS = { o: 0, ".": 0, s: 1, D: 2, d: 2, x: 3, "+": 4, "^": 5, v: 6 };

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
    this.gl = this.canvas.getContext("webgl2", { stencil: true, antialias: false, powerPreference: "low-power" });
    if (!this.gl) throw new Error("no WebGL 2");
    const named = this.gl.getExtension("WEBGL_debug_renderer_info");
    this.software = /swiftshader|llvmpipe|software|basic render/i.test(named ? this.gl.getParameter(named.UNMASKED_RENDERER_WEBGL) : "");
    this.prepare();
  }

  prepare() {
    const { gl } = this;
    this.lost = false;
    this.meshes = new Map();
    this.smooth = null;
    this.age = (this.age ?? 0) + 1; // whoever holds buffers makes them anew when it has changed
    const places = ["position", "normal"]; // the same in both: a mesh is bound once for its picture and its shadow
    this.solid = createProgramInfo(gl, [SOLID_VERTEX, SOLID_FRAGMENT], places);
    this.shade = createProgramInfo(gl, [SOLID_VERTEX, SHADOW_FRAGMENT], places);
    this.line = createProgramInfo(gl, [LINE_VERTEX, LINE_FRAGMENT]);
    this.point = createProgramInfo(gl, [POINT_VERTEX, POINT_FRAGMENT]);
    for (const program of [this.solid, this.shade, this.line, this.point]) if (!program) throw new Error("the shaders were refused");
  }

  /** Buffers of a solid, one for all bodies of the page that are alike. */
  mesh(shape) {
    const key = JSON.stringify(shape);
    if (!this.meshes.has(key)) {
      const { position, normal, indices } = triangles(shape);
      const info = createBufferInfoFromArrays(this.gl, {
        position: new Float32Array(position), normal: new Float32Array(normal),
        indices: position.length / 3 > 65535 ? new Uint32Array(indices) : new Uint16Array(indices),
      });
      this.meshes.set(key, { info, arrays: createVertexArrayInfo(this.gl, [this.solid, this.shade], info), triangles: indices.length / 3 });
    }
    return this.meshes.get(key);
  }

  /** Segments of a path (float32, 8 a segment: from, to, length until its start and its end). */
  segments(old, data) {
    const { gl } = this;
    const info = old ?? this.segmentArrays();
    gl.bindBuffer(gl.ARRAY_BUFFER, info.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    info.count = data.length / 8;
    return info;
  }

  segmentArrays() {
    const { gl } = this;
    const info = { vao: gl.createVertexArray(), buffer: gl.createBuffer(), corners: gl.createBuffer() };
    gl.bindVertexArray(info.vao);
    const place = (name) => gl.getAttribLocation(this.line.program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, info.corners);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place("corner"));
    gl.vertexAttribPointer(place("corner"), 2, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, info.buffer);
    for (const [name, size, offset] of [["a", 3, 0], ["b", 3, 12], ["along", 2, 24]]) {
      gl.enableVertexAttribArray(place(name));
      gl.vertexAttribPointer(place(name), size, gl.FLOAT, false, 32, offset);
      gl.vertexAttribDivisor(place(name), 1);
    }
    gl.bindVertexArray(null);
    return info;
  }

  points(old, data) {
    const { gl } = this;
    const info = old ?? { vao: gl.createVertexArray(), buffer: gl.createBuffer() };
    gl.bindVertexArray(info.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, info.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    const place = gl.getAttribLocation(this.point.program, "position");
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    gl.bindVertexArray(null);
    info.count = data.length / 3;
    return info;
  }

  free(info) {
    if (!info || this.lost) return;
    this.gl.deleteVertexArray(info.vao);
    this.gl.deleteBuffer(info.buffer);
    if (info.corners) this.gl.deleteBuffer(info.corners);
  }

  /** Where edges are smoothed: four samples a pixel, copied onto the canvas in the end. */
  smoothTarget(width, height) {
    const { gl } = this;
    this.smooth ??= { frame: gl.createFramebuffer(), color: gl.createRenderbuffer(), depth: gl.createRenderbuffer(), size: "" };
    const { frame, color, depth } = this.smooth;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    if (this.smooth.size !== `${width}x${height}`) {
      this.smooth.size = `${width}x${height}`;
      for (const [buffer, format, place] of [[color, gl.RGBA8, gl.COLOR_ATTACHMENT0], [depth, gl.DEPTH24_STENCIL8, gl.DEPTH_STENCIL_ATTACHMENT]]) {
        gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
        gl.renderbufferStorageMultisample(gl.RENDERBUFFER, 4, format, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
      }
    }
    return frame;
  }

  /** Draw one scene, width x height device pixels, which the canvas takes on; `smooth` edges cost a processor much.
   *  lens: {axes (9 numbers, columns), center, scale [x, y], eye, perUnit (device pixels), reach (how deep the scene is)}.
   *  solids: [{mesh, pose, turn, color}], paths: [{line, points, color, width, dash, size, marker, hollow}] */
  draw(width, height, lens, { solids, paths, floor, shadow }, smooth) {
    const { gl, canvas } = this;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const frame = smooth ? this.smoothTarget(width, height) : null;
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.viewport(0, 0, width, height);
    gl.depthMask(true);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const far = lens.eye > 0 ? 1 + lens.reach / lens.eye : 1; // distances over the eye's
    const range = lens.eye > 0 ? [(far + NEAR) / (far - NEAR), (-2 * far * NEAR) / (far - NEAR)] : [0, 1 / lens.reach];
    const common = { axes: lens.axes, center: lens.center, lens: [...lens.scale, lens.eye, lens.perUnit], range, room: [width, height] };
    const full = solids.filter((s) => s.color[3] >= 1);
    const thin = solids.filter((s) => s.color[3] < 1);
    if (shadow && floor !== null) this.drawShadows(full, common, floor, shadow);
    this.drawSolids(full, common);
    this.drawPaths(paths, common, 1);
    gl.depthMask(false);
    gl.enable(gl.CULL_FACE);
    for (const side of [gl.FRONT, gl.BACK]) {
      gl.cullFace(side);
      this.drawSolids(thin, common);
    }
    gl.disable(gl.CULL_FACE);
    gl.depthFunc(gl.GREATER); // what lies behind a body shines through a little
    this.drawPaths(paths, common, 0.22);
    gl.bindVertexArray(null);
    if (!frame) return;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, frame);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  drawSolids(solids, common) {
    const { gl } = this;
    gl.useProgram(this.solid.program);
    setUniforms(this.solid, common);
    for (const { mesh, pose, turn, color } of solids) {
      gl.bindVertexArray(mesh.arrays.vertexArrayObject);
      setUniforms(this.solid, { pose, turn, color });
      gl.drawElements(gl.TRIANGLES, mesh.info.numElements, mesh.info.elementType, 0);
    }
  }

  /** Everything flattened onto the floor along the light; each pixel is darkened once. */
  drawShadows(solids, common, floor, color) {
    const { gl } = this;
    gl.useProgram(this.shade.program);
    setUniforms(this.shade, { ...common, color, turn: [1, 0, 0, 0, 1, 0, 0, 0, 1] });
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    gl.disable(gl.DEPTH_TEST);
    for (const { mesh, pose } of solids) {
      gl.bindVertexArray(mesh.arrays.vertexArrayObject);
      setUniforms(this.shade, { pose: flattened(pose, floor) });
      gl.drawElements(gl.TRIANGLES, mesh.info.numElements, mesh.info.elementType, 0);
    }
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  drawPaths(paths, common, share) {
    const { gl } = this;
    for (const path of paths) {
      const color = [...path.color.slice(0, 3), path.color[3] * share];
      if (path.line?.count) {
        gl.useProgram(this.line.program);
        setUniforms(this.line, { ...common, color, width: path.width, dash: path.dash });
        gl.bindVertexArray(path.line.vao);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, path.line.count);
      }
      if (path.points?.count) {
        gl.useProgram(this.point.program);
        setUniforms(this.point, { ...common, color, size: path.size, marker: MARKERS[path.marker] ?? 0, hollow: path.hollow });
        gl.bindVertexArray(path.points.vao);
        gl.drawArrays(gl.POINTS, 0, path.points.count);
      }
    }
  }
}

/** A pose (columns) followed by the fall along the light onto z = floor. */
function flattened(m, floor) {
  const [lx, ly] = [0.28, -0.2]; // sideways for each unit of height
  const out = new Float32Array(16);
  for (let column = 0; column < 4; column++) {
    const [x, y, z, w] = m.slice(4 * column, 4 * column + 4);
    const height = z - floor * w;
    out.set([x + lx * height, y + ly * height, floor * w, w], 4 * column);
  }
  return out;
}
