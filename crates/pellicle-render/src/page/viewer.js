const VERTEX_SHADER = `#version 300 es
layout(location = 0) in vec3 place;   // 16 bits within the box
layout(location = 1) in vec2 octahedral;
uniform vec3 low, size;
uniform mat4 clip;
uniform mat3 turn;                    // to the viewer's axes
uniform vec3 eye;
uniform float lift;                   // lines lie a hair before their triangles
out vec3 normal, viewer;
void main() {
  vec3 p = low + place * size;
  vec2 e = octahedral * 2.0 - 1.0;
  vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  normal = turn * n;
  viewer = turn * (eye - p);
  gl_Position = clip * vec4(p, 1.0);
  gl_Position.z -= lift * gl_Position.w;
}`;

const FRAGMENT_SHADER = `#version 300 es
precision highp float;
${LIGHT}
in vec3 normal, viewer;
uniform vec3 sky;
uniform int look;                     // 0 water, 1 both sides, 2 wires
uniform float strength;               // of wires
out vec4 color;
vec3 encode(vec3 x) {
  return mix(12.92 * x, 1.055 * pow(max(x, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}
void main() {
  vec3 v = normalize(viewer);
  vec3 n = normalize(normal) * (gl_FrontFacing ? 1.0 : -1.0);
  bool wet = look == 0;
  vec3 albedo = look == 2 ? WIRE : wet ? WATER : gl_FrontFacing ? OUTSIDE : INSIDE;
  float key = max((dot(n, KEY_DIRECTION) + 0.15) / 1.15, 0.0);
  float fill = max((dot(n, FILL_DIRECTION) + 0.3) / 1.3, 0.0);
  float above = 0.5 + 0.5 * dot(n, sky);
  float shine = pow(max(dot(n, normalize(KEY_DIRECTION + v)), 0.0), 48.0) * (wet ? WET.x : DULL.x);
  float grazing = 1.0 - clamp(dot(n, v), 0.0, 1.0);
  float rim = grazing * grazing * grazing * (wet ? WET.y : DULL.y) * (0.35 + 0.65 * above);
  vec3 light = albedo * (KEY_LIGHT * key + FILL_LIGHT * fill + mix(GROUND_LIGHT, SKY_LIGHT, above));
  if (look != 2) light += KEY_LIGHT * shine + SKY_LIGHT * 2.0 * rim;
  float cover = look == 2 ? strength : 1.0;
  color = vec4(encode(clamp(light, 0.0, 1.0)) * cover, cover);
}`;

const body = document.body, message = document.getElementById("message"), canvas = document.getElementById("view");
const facts = JSON.parse(document.getElementById("facts").textContent);

function say(text, state) {
  message.textContent = text;
  body.dataset.state = state;
}

function bytesOf(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// Differences to the index before, zigzag, seven bits a byte, lowest first.
function indicesOf(bytes, count) {
  const indices = new Uint32Array(count);
  let at = 0, last = 0;
  for (let i = 0; i < count; i++) {
    let value = 0, unit = 1, byte;
    do {
      byte = bytes[at++];
      value += (byte & 127) * unit;
      unit *= 128;
    } while (byte > 127);
    last += value % 2 ? -(value + 1) / 2 : value / 2;
    indices[i] = last;
  }
  return indices;
}

// Column-major matrices; vectors as arrays.
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];

const home = { azimuth: 30, elevation: 22, zoom: 1, aside: [0, 0] };
let camera = structuredClone(home);
let wires = false, inside = false, gl = null, scene = null, due = false;

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  return made;
}

function start() {
  gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!gl) {
    say("This browser does not offer WebGL 2, which this page needs to show the mesh. A current version of Firefox, Chrome, Edge or Safari does, unless hardware acceleration is turned off.", "unsupported");
    return;
  }
  const vertices = bytesOf("vertices"), indices = indicesOf(bytesOf("indices"), facts.triangles * 3);
  const used = program(gl), uniforms = {};
  for (const name of ["low", "size", "clip", "turn", "eye", "sky", "look", "strength", "lift"]) uniforms[name] = gl.getUniformLocation(used, name);
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.UNSIGNED_SHORT, true, 12, 0);
  gl.enableVertexAttribArray(1);
  gl.vertexAttribPointer(1, 2, gl.UNSIGNED_SHORT, true, 12, 8);
  const triangles = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, triangles);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  scene = { used, uniforms, indices, triangles, lines: null };
  draw();
  const problem = gl.getError();
  if (problem) throw new Error("WebGL error " + problem);
  say(facts.triangles ? "" : "This mesh has no triangles.", "ready");
}

// Made when first wanted: three lines a triangle.
function linesOf(indices) {
  const lines = new Uint32Array(indices.length * 2);
  for (let i = 0; i < indices.length; i += 3) {
    const a = indices[i], b = indices[i + 1], c = indices[i + 2];
    lines.set([a, b, b, c, c, a], 2 * i);
  }
  return lines;
}

function axes() {
  const [side, up, front] = facts.axes, radians = Math.PI / 180;
  const a = camera.azimuth * radians, e = camera.elevation * radians;
  const level = plus(front.map(x => x * Math.cos(a)), Math.sin(a), side);
  const back = plus(level.map(x => x * Math.cos(e)), Math.sin(e), up);
  const right = plus(side.map(x => x * Math.cos(a)), -Math.sin(a), front);
  const above = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
  return { right, above, back, up };
}

// What half of the picture's height shows at the middle of the mesh.
function span() {
  const narrow = Math.min(1, canvas.clientWidth / Math.max(canvas.clientHeight, 1));
  return facts.radius * 1.06 / narrow / camera.zoom;
}

function draw() {
  due = false;
  if (!scene) return;
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const { used, uniforms } = scene, { right, above, back, up } = axes();
  const tangent = Math.tan(15 * Math.PI / 180), distance = span() / tangent;
  const target = plus(plus([0, 0, 0], camera.aside[0] * facts.radius, right), camera.aside[1] * facts.radius, above);
  const eye = plus(target, distance, back);
  // The whole ball lies between the planes, or all that is before the eye.
  const reach = Math.hypot(...eye), far = reach + facts.radius * 1.01, near = Math.max(reach - facts.radius * 1.01, far * 1e-3);
  const fy = 1 / tangent, fx = fy * height / width, p = (far + near) / (near - far), q = 2 * far * near / (near - far);
  const ex = -dot(right, eye), ey = -dot(above, eye), ez = -dot(back, eye), clip = [];
  for (let c = 0; c < 3; c++) clip.push(fx * right[c], fy * above[c], p * back[c], -back[c]);
  clip.push(fx * ex, fy * ey, p * ez + q, -ez);

  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  gl.useProgram(used);
  gl.uniform3fv(uniforms.low, facts.low);
  gl.uniform3fv(uniforms.size, facts.size);
  gl.uniform3fv(uniforms.eye, eye);
  gl.uniform3fv(uniforms.sky, [dot(right, up), dot(above, up), dot(back, up)]);
  gl.uniformMatrix4fv(uniforms.clip, false, clip);
  gl.uniformMatrix3fv(uniforms.turn, false, [0, 1, 2].flatMap(c => [right[c], above[c], back[c]]));
  gl.uniform1i(uniforms.look, inside ? 1 : 0);
  gl.uniform1f(uniforms.lift, 0);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, scene.triangles);
  gl.drawElements(gl.TRIANGLES, facts.triangles * 3, gl.UNSIGNED_INT, 0);
  if (!wires) return;
  if (!scene.lines) {
    scene.lines = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, scene.lines);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, linesOf(scene.indices), gl.STATIC_DRAW);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, scene.lines);
  gl.uniform1i(uniforms.look, 2);
  gl.uniform1f(uniforms.lift, 4e-4);
  // Where edges are a few pixels long their lines would run together.
  const pixels = facts.edge / (2 * span()) * height;
  gl.uniform1f(uniforms.strength, Math.min(Math.max((pixels - 1) / 8, 0.12), 0.6));
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.drawElements(gl.LINES, facts.triangles * 6, gl.UNSIGNED_INT, 0);
  gl.disable(gl.BLEND);
}

function change() {
  if (!due) requestAnimationFrame(draw);
  due = true;
}

const pointers = new Map();
const zoomBy = factor => { camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.1), 200); };
const moveBy = (dx, dy) => {
  const unit = 2 * span() / facts.radius / canvas.clientHeight;
  camera.aside = [camera.aside[0] - dx * unit, camera.aside[1] + dy * unit];
};

canvas.addEventListener("pointerdown", event => {
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, [event.clientX, event.clientY]);
});
canvas.addEventListener("pointermove", event => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const now = [event.clientX, event.clientY], dx = now[0] - before[0], dy = now[1] - before[1];
  if (pointers.size === 2) {
    const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
    const length = p => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
    zoomBy(length(now) / length(before));
    moveBy(dx / 2, dy / 2);
  } else if (event.buttons & 6 || event.shiftKey) {
    moveBy(dx, dy);
  } else {
    camera.azimuth -= dx * 0.4;
    camera.elevation = Math.min(Math.max(camera.elevation + dy * 0.4, -90), 90);
  }
  pointers.set(event.pointerId, now);
  change();
});
for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, event => pointers.delete(event.pointerId));
canvas.addEventListener("contextmenu", event => event.preventDefault());
canvas.addEventListener("wheel", event => {
  event.preventDefault();
  zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)));
  change();
}, { passive: false });

function toggle(id) {
  if (id === "wire") wires = !wires;
  if (id === "inside") inside = !inside;
  if (id === "reset") camera = structuredClone(home);
  document.getElementById("wire").setAttribute("aria-pressed", wires);
  document.getElementById("inside").setAttribute("aria-pressed", inside);
  change();
}
for (const id of ["wire", "inside", "reset"]) document.getElementById(id).addEventListener("click", () => toggle(id));
canvas.addEventListener("dblclick", () => toggle("reset"));
window.addEventListener("keydown", event => {
  const id = { w: "wire", i: "inside", r: "reset" }[event.key.toLowerCase()];
  if (id && !event.ctrlKey && !event.metaKey && !event.altKey) toggle(id);
});
window.addEventListener("resize", change);
canvas.addEventListener("webglcontextlost", event => { event.preventDefault(); scene = null; });
canvas.addEventListener("webglcontextrestored", run);

function run() {
  try {
    start();
  } catch (error) {
    say("The mesh cannot be shown: " + error.message, "failed");
  }
}
run();
if (location.hash === "#wire" || location.hash === "#inside") toggle(location.hash.slice(1));
