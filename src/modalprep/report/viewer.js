// Bodies in WebGL 2, no library: a mode is rest + swing * shape; the frames of a run are placed here and have no shape.
"use strict";
(() => {
const box = document.getElementById("viewer"), source = document.getElementById("scene");
if (!box || !source) return;
const scene = JSON.parse(source.textContent), part = name => box.querySelector(`[name=${name}]`);
const canvas = box.querySelector("canvas"), status = document.getElementById("viewer-status");
const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
if (!gl) {
  status.textContent = "This browser has no WebGL 2, so that the animated view is not shown.";
  box.dataset.state = "no-webgl";
  return;
}

const decode = (text, Type) => {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Type(bytes.buffer);
};
const run = scene.run, points = run ? new Float32Array(3 * run.nodes) : decode(scene.points, Float32Array);
const index = name => decode(scene[name], Uint32Array);
const edges = index("edges"), outline = index("outline"), lines = index("lines"), triangles = index("triangles");
const nodes = points.length / 3, marks = scene.interfaces.length;

// ---------- programs ----------
const COMMON = `#version 300 es
precision highp float;
uniform mat3 turn; uniform vec4 frame; uniform float swing; uniform bool by_strain; // frame: scale x, y and shift x, y
vec3 seen(vec3 rest, vec3 shape) { return turn * (rest + swing * shape); }
vec4 place(vec3 p, float lift) { return vec4(frame.xy * p.xy + frame.zw, -0.3 * p.z - lift, 1.0); }
`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 where; in float amount; out vec4 colour;
uniform vec4 paint; uniform int kind; // kind 0: lit face, 1: line, 2: disc; paint.a 0: by amount
vec3 viridis(float t) {
  vec3 c = vec3(-5.4355, 4.6459, 26.3124);
  c = c * t + vec3(4.7764, -13.7451, -65.3530); c = c * t + vec3(6.2283, 14.1799, 56.6906);
  c = c * t + vec3(-4.6342, -5.7991, -19.3324); c = c * t + vec3(-0.3309, 0.2148, 0.0951);
  c = c * t + vec3(0.1051, 1.4046, 1.3846); return c * t + vec3(0.2777, 0.0054, 0.3341);
}
void main() {
  vec3 c = paint.a > 0.0 ? paint.rgb : viridis(clamp(amount, 0.0, 1.0));
  if (kind == 0) { vec3 n = normalize(cross(dFdx(where), dFdy(where))); c *= 0.5 + 0.5 * abs(dot(n, normalize(vec3(-0.2, 0.35, 1.0)))); }
  if (kind == 2 && length(gl_PointCoord - 0.5) > 0.5) discard;
  colour = vec4(c, 1.0);
}`;
const NODE = COMMON + `
in vec3 rest, shape; in float strain; uniform float lift, dot_size; out vec3 where; out float amount;
void main() { where = seen(rest, shape); amount = by_strain ? strain : length(shape); gl_Position = place(where, lift); gl_PointSize = dot_size; }`;
const RIBBON = COMMON + `
in vec3 rest, shape, rest2, shape2; in float strain, strain2; uniform vec2 pixel; uniform float lift, thick; out vec3 where; out float amount;
void main() { // four corners of a strip so many pixels thick along the line
  bool end = gl_VertexID > 1; vec3 a = seen(rest, shape), b = seen(rest2, shape2);
  vec2 along = (frame.xy * (b - a).xy) / pixel; along /= max(length(along), 1e-6);
  where = end ? b : a; amount = by_strain ? (end ? strain2 : strain) : length(end ? shape2 : shape);
  gl_Position = place(where, lift);
  gl_Position.xy += vec2(-along.y, along.x) * (gl_VertexID % 2 == 0 ? 0.5 : -0.5) * thick * pixel;
}`;

function program(vertex) {
  const made = gl.createProgram();
  for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  ["rest", "shape", "rest2", "shape2", "strain", "strain2"].forEach((name, k) => gl.bindAttribLocation(made, k, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made) || "shaders do not link");
  const at = {};
  for (const name of ["turn", "frame", "swing", "paint", "kind", "lift", "dot_size", "pixel", "thick", "by_strain"])
    at[name] = gl.getUniformLocation(made, name);
  return { made, at };
}
const ofNodes = program(NODE), ofLines = program(RIBBON);

// ---------- buffers ----------
const buffer = (data, target = gl.ARRAY_BUFFER) => {
  const made = gl.createBuffer();
  gl.bindBuffer(target, made);
  gl.bufferData(target, data, gl.DYNAMIC_DRAW);
  return made;
};
function attribute(k, data, type, stride, offset, each, size = 3) {
  gl.bindBuffer(gl.ARRAY_BUFFER, data);
  gl.enableVertexAttribArray(k);
  gl.vertexAttribPointer(k, size, type, true, stride, offset);
  gl.vertexAttribDivisor(k, each);
}
const picked = (values, pairs, Type, size = 3) => { // the values of both ends of each line
  const out = new Type(pairs.length * size);
  for (let k = 0; k < pairs.length; k++) for (let a = 0; a < size; a++) out[size * k + a] = values[size * pairs[k] + a];
  return out;
};
const restBuffer = buffer(points), shapeBuffer = buffer(new Int16Array(points.length));
const strainBuffer = buffer(new Uint8Array(nodes));
gl.bindVertexArray(null);
const surface = gl.createVertexArray();
gl.bindVertexArray(surface);
attribute(0, restBuffer, gl.FLOAT, 12, 0, 0);
attribute(1, shapeBuffer, gl.SHORT, 6, 0, 0);
attribute(4, strainBuffer, gl.UNSIGNED_BYTE, 1, 0, 0, 1);
buffer(triangles, gl.ELEMENT_ARRAY_BUFFER);
const ribbons = Object.fromEntries(Object.entries({ edges, outline, lines }).map(([name, pairs]) => {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  const rest = buffer(picked(points, pairs, Float32Array)), shape = buffer(new Int16Array(pairs.length * 3));
  const strain = buffer(new Uint8Array(pairs.length));
  attribute(0, rest, gl.FLOAT, 24, 0, 1); attribute(1, shape, gl.SHORT, 12, 0, 1);
  attribute(2, rest, gl.FLOAT, 24, 12, 1); attribute(3, shape, gl.SHORT, 12, 6, 1);
  attribute(4, strain, gl.UNSIGNED_BYTE, 2, 0, 1, 1); attribute(5, strain, gl.UNSIGNED_BYTE, 2, 1, 1, 1);
  return [name, { array, rest, shape, strain, pairs, count: pairs.length / 2 }];
}));
gl.bindVertexArray(null);

// ---------- state ----------
let mode = 0, shape = null, turn = null, zoom = 1, shift = [0, 0], turned = false, time = 0, last = 0, playing = false;
const names = scene.interfaces.map(text => {
  const label = document.createElement("span");
  label.textContent = text;
  box.querySelector(".stage").append(label);
  return label;
});

const fill = (buffer, data) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW); };
function choose(k) {
  mode = k;
  shape = decode(scene.modes[k].shape, Int16Array);
  const strain = decode(scene.modes[k].energy, Uint8Array);
  fill(shapeBuffer, shape);
  if (strain.length) fill(strainBuffer, strain);
  for (const ribbon of Object.values(ribbons)) {
    fill(ribbon.shape, picked(shape, ribbon.pairs, Int16Array));
    if (strain.length) fill(ribbon.strain, picked(strain, ribbon.pairs, Uint8Array, 1));
  }
  if (part("mode")) part("mode").value = k;
  if (!turned) reset(); else draw();
}
function reset() {
  turn = (run ?? scene.modes[mode]).view.map(row => [...row]);
  turned = false;
  const low = [1e9, 1e9], high = [-1e9, -1e9]; // of rest and both extremes, or of the whole run
  const reach = at => { for (const a of [0, 1]) { low[a] = Math.min(low[a], at[a]); high[a] = Math.max(high[a], at[a]); } };
  if (run) for (const corner of corners()) reach(turned_to(corner));
  else for (let k = 0; k < nodes; k++) for (const s of [0, 1, -1]) reach(seen(k, s * scene.share));
  const aspect = canvas.clientWidth / canvas.clientHeight || 1.6;
  zoom = 1.68 / Math.max(high[1] - low[1], (high[0] - low[0]) / aspect, 1e-3);
  shift = [-zoom / aspect * (low[0] + high[0]) / 2, -zoom * (low[1] + high[1]) / 2];
  draw();
}
function seen(k, swing) {
  const at = [0, 1, 2].map(a => points[3 * k + a] + swing * shape[3 * k + a] / 32767);
  return turned_to(at);
}
const turned_to = at => turn.map(row => row[0] * at[0] + row[1] * at[1] + row[2] * at[2]);
const colour = () => part("colour")?.value ?? "displacement";
const amplitude = () => scene.share * Number(part("amplitude")?.value ?? 0) / 100;
const swingNow = () => amplitude() * (time === 0 ? 1 : Math.cos(Math.PI * time)); // one period is two seconds

// ---------- frames of a run ----------
const FAR = 1e6; // where bodies are that are not there
let frame = 0;
const poses = run && decode(run.poses, Float32Array); // of each frame and body: origin, then quaternion w, x, y, z
const strains = run && new Uint8Array(nodes);
const parts = run ? run.parts.map(p => ({ ...p, rest: decode(p.rest, Float32Array), bend: p.bend && decode(p.bend, Int16Array) })) : [];
const factor = () => Number(part("factor")?.value) || 0;
function placed(k, body) { // a function that takes a point in the axes of a body to its place in frame k
  const own = 7 * (k * run.bodies + body), [ox, oy, oz, w, x, y, z] = poses.subarray(own, own + 7);
  if (!Number.isFinite(ox)) return null;
  const rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]];
  const with_it = Number(part("follow")?.value ?? -1), of = 7 * (k * run.bodies + with_it);
  const shift = with_it < 0 || !Number.isFinite(poses[of]) ? [0, 0, 0] : poses.subarray(of, of + 3), at = [ox - shift[0], oy - shift[1], oz - shift[2]];
  return (a, b, c) => rows.map((row, i) => row[0] * a + row[1] * b + row[2] * c + at[i]);
}
function scrub(k) {
  frame = k;
  let node = 0;
  for (const { body, rest, bend, full } of parts) {
    const place = placed(k, body), count = rest.length / 3, more = factor() * full / 32767, first = 3 * count * k;
    for (let i = 0; i < count; i++, node++) {
      const b = bend ? [bend[first + 3 * i], bend[first + 3 * i + 1], bend[first + 3 * i + 2]] : [0, 0, 0];
      const at = place ? place(rest[3 * i] + more * b[0], rest[3 * i + 1] + more * b[1], rest[3 * i + 2] + more * b[2]) : [FAR, FAR, FAR];
      points.set(at, 3 * node);
      strains[node] = Math.min(255, Math.round(255 * Math.hypot(...b) * full / 32767 / (run.range || 1)));
    }
  }
  fill(restBuffer, points);
  fill(strainBuffer, strains);
  for (const name of ["lines", part("edges").checked ? "edges" : "outline"]) {
    const ribbon = ribbons[name];
    fill(ribbon.rest, picked(points, ribbon.pairs, Float32Array));
    fill(ribbon.strain, picked(strains, ribbon.pairs, Uint8Array, 1));
  }
  part("time").value = k;
  part("time").setAttribute("aria-valuetext", `${run.times[k]} s`);
  part("clock").textContent = `t = ${run.times[k]} s`;
  draw();
}
function* corners() { // of the boxes of all bodies in some frames
  const each = Math.ceil(run.frames / 40);
  for (let k = 0; k < run.frames; k += each) for (const { body, box } of parts) {
    const place = placed(k, body);
    if (place) for (const a of [0, 3]) for (const b of [1, 4]) for (const c of [2, 5]) yield place(box[a], box[b], box[c]);
  }
}

// ---------- drawing ----------
function draw() {
  const ratio = window.devicePixelRatio || 1, w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
  if (!w || !h) return;
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  gl.viewport(0, 0, w, h);
  gl.clearColor(1, 1, 1, 1);
  gl.enable(gl.DEPTH_TEST);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  const frame = [zoom * h / w, zoom, shift[0], shift[1]], swing = swingNow();
  const start = ({ made, at }, kind, paint, moving, lift) => {
    gl.useProgram(made);
    gl.uniformMatrix3fv(at.turn, true, turn.flat());
    gl.uniform4fv(at.frame, frame); gl.uniform4fv(at.paint, paint);
    gl.uniform1i(at.kind, kind); gl.uniform1f(at.lift, lift);
    gl.uniform1f(at.swing, moving ? swing : 0); gl.uniform1i(at.by_strain, run || colour() === "energy" ? 1 : 0);
  };
  const ribbon = ({ array, count }, thick, paint, moving, lift) => {
    if (!count) return;
    start(ofLines, 1, paint, moving, lift);
    gl.uniform2f(ofLines.at.pixel, 2 / w, 2 / h); gl.uniform1f(ofLines.at.thick, thick * ratio);
    gl.bindVertexArray(array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
  };
  const BY_SIZE = scene.plain ? [0.56, 0.66, 0.74, 1] : [0, 0, 0, 0], GREY = [0.62, 0.66, 0.7, 1], INK = [0.2, 0.27, 0.33, 1];
  if (part("ghost")?.checked) {
    ribbon(ribbons.outline, 1.2, GREY, false, 0.0005);
    ribbon(ribbons.lines, 1.5, GREY, false, 0.0005);
  }
  if (triangles.length) {
    start(ofNodes, 0, BY_SIZE, true, 0);
    gl.bindVertexArray(surface);
    gl.drawElements(gl.TRIANGLES, triangles.length, gl.UNSIGNED_INT, 0);
    if (part("edges").checked) ribbon(ribbons.edges, 0.8, INK, true, 0.0008);
    else ribbon(ribbons.outline, 0.8, INK, true, 0.0008);
  }
  ribbon(ribbons.lines, triangles.length ? 4 : 7, BY_SIZE, true, 0.001);
  interfaces(start, ratio, swing);
  axes();
}
function interfaces(start, ratio, swing) {
  gl.disable(gl.DEPTH_TEST);
  start(ofNodes, 2, [0.835, 0.369, 0, 1], true, 0);
  gl.uniform1f(ofNodes.at.dot_size, (run && marks > 30 ? 5 : 11) * ratio); // smaller, where many hide the bodies
  gl.bindVertexArray(surface);
  gl.drawArrays(gl.POINTS, nodes - marks, marks);
  names.forEach((label, k) => {
    const [x, y] = seen(nodes - marks + k, swing), w = canvas.clientWidth, h = canvas.clientHeight;
    const left = (zoom * h / w * x + shift[0] + 1) / 2 * w + 9, top = (1 - zoom * y - shift[1]) / 2 * h - 24;
    label.style.transform = `translate(${Math.min(left, w - label.offsetWidth - 4)}px, ${Math.max(2, top)}px)`;
    label.hidden = !(part("names")?.checked ?? true) || left < 0 || left > w + 9 || top < -26 || top > h;
  });
}
function axes() {
  const draws = [0, 1, 2].map(a => {
    const x = 34 * turn[0][a], y = -34 * turn[1][a], far = Math.hypot(x, y) < 6;
    return `<line x1="0" y1="0" x2="${x}" y2="${y}"/>` + (far ? "" : `<text x="${1.3 * x}" y="${1.3 * y + 4}">${"xyz"[a]}</text>`);
  });
  box.querySelector("svg").innerHTML = draws.join("");
}

// ---------- controls ----------
function tick(now) {
  if (!playing) return;
  time += Math.min(0.1, Math.max(0, now - last) / 1000); // a frame may have begun before the click
  last = now;
  if (run) scrub(Math.floor(time / part("speed").value * run.frames) % run.frames); else draw();
  requestAnimationFrame(tick);
}
function play(on) {
  if (!part("play")) return;
  playing = on;
  if (run) time = frame / run.frames * part("speed").value;
  else time = on ? time : 0; // at rest the largest displacement is shown
  part("play").textContent = on ? "Pause" : "Play";
  last = performance.now();
  if (on) requestAnimationFrame(tick); else draw();
}
function spin(right, up) {
  const about = (i, j, angle) => {
    const c = Math.cos(angle), s = Math.sin(angle), a = turn[i], b = turn[j];
    turn[i] = a.map((v, k) => c * v - s * b[k]); turn[j] = a.map((v, k) => s * v + c * b[k]);
  };
  about(2, 0, right); about(1, 2, up);
  turned = true;
  draw();
}
const zoomBy = factor => { zoom = Math.min(60, Math.max(0.15, zoom * factor)); turned = true; draw(); };
canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); canvas.focus({ preventScroll: true }); });
canvas.addEventListener("pointermove", event => {
  if (!event.buttons) return;
  if (event.shiftKey || event.buttons > 1) {
    shift[0] += 2 * event.movementX / canvas.clientWidth; shift[1] -= 2 * event.movementY / canvas.clientHeight;
    turned = true;
    draw();
  } else spin(0.008 * event.movementX, 0.008 * event.movementY);
});
canvas.addEventListener("wheel", event => {
  if (document.activeElement !== canvas) return; // the page still scrolls over a view not in use
  event.preventDefault();
  zoomBy(Math.exp(-0.0015 * event.deltaY));
}, { passive: false });
canvas.addEventListener("contextmenu", event => event.preventDefault());
canvas.addEventListener("dblclick", reset);
canvas.addEventListener("keydown", event => {
  const keys = { ArrowLeft: () => spin(-0.1, 0), ArrowRight: () => spin(0.1, 0), ArrowUp: () => spin(0, -0.1), ArrowDown: () => spin(0, 0.1),
    "+": () => zoomBy(1.15), "-": () => zoomBy(1 / 1.15), " ": () => play(!playing) };
  if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
});
part("mode")?.addEventListener("change", event => choose(Number(event.target.value)));
part("colour")?.addEventListener("change", () => {
  box.querySelector(".bar em").textContent = scene.colours[colour()];
  draw();
});
part("play")?.addEventListener("click", () => play(!playing));
part("reset").addEventListener("click", reset);
for (const name of ["amplitude", "ghost", "names"]) part(name)?.addEventListener("input", draw);
part("edges").addEventListener("input", () => run ? scrub(frame) : draw());
part("time")?.addEventListener("input", event => { play(false); scrub(Number(event.target.value)); });
part("factor")?.addEventListener("input", () => scrub(frame));
part("follow")?.addEventListener("change", () => { scrub(frame); reset(); });
part("speed")?.addEventListener("change", () => { time = frame / run.frames * part("speed").value; });
function show(k) {
  choose(k);
  box.scrollIntoView({ behavior: "smooth", block: "center" });
}
for (const card of document.querySelectorAll("[data-show]")) card.addEventListener("click", () => show(Number(card.dataset.show)));
function follow() { // the address ends in #mode-7
  const number = Number(/^#mode-(\d+)$/.exec(location.hash)?.[1]);
  if (run) return;
  if (number >= 1 && number <= scene.modes.length) show(number - 1);
}
addEventListener("hashchange", follow);
new ResizeObserver(() => {
  const pixels = length => Math.round(length * (window.devicePixelRatio || 1));
  if (canvas.width !== pixels(canvas.clientWidth) || canvas.height !== pixels(canvas.clientHeight)) turned ? draw() : reset();
}).observe(canvas);
if (run) { shape = new Int16Array(points.length); reset(); scrub(0); } else { choose(0); follow(); }
box.dataset.state = "drawn";
})();
