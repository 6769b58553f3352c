"use strict";
const $ = id => document.getElementById(id);
const scene = JSON.parse($("data").textContent);
const n = scene.time.length, view = $("view"), DARK = "#004a80", WARM = "#b8450a";
let frame = 0, playing = false, gain = 1, azimuth = -0.75, elevation = 0.3, scale = 1, last = 0, clock = 0;
const PRESETS = [[-0.75, 0.3], [-Math.PI / 2, 0.05], [Math.PI, 0.05], [-Math.PI / 2, 1.5]];

function fit(canvas) {
  const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
  const w = Math.max(1, Math.round(box.width * ratio)), h = Math.max(1, Math.round(box.height * ratio));
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const g = canvas.getContext("2d");
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, box.width, box.height);
  return [g, box.width, box.height];
}
// position and direction of the track at arc length s
function trackAt(s) {
  const t = scene.track, step = t.s[1] - t.s[0];
  const u = Math.min(Math.max((s - t.s[0]) / step, 0), t.s.length - 1.001), i = Math.floor(u), f = u - i;
  const mix = a => a[i] * (1 - f) + a[i + 1] * f;
  return { x: mix(t.x), y: mix(t.y), heading: mix(t.heading), cant: mix(t.cant) };
}
// a point of the track frame at s to space; x forward, y right, z down
function toSpace(at, p) {
  const cc = Math.cos(at.cant), sc = Math.sin(at.cant), ch = Math.cos(at.heading), sh = Math.sin(at.heading);
  const y = cc * p[1] - sc * p[2], z = sc * p[1] + cc * p[2];
  return [at.x + ch * p[0] - sh * y, at.y + sh * p[0] + ch * y, z];
}
function turned(a, p) {  // Rz(yaw) Rx(roll) Ry(pitch)
  const [roll, pitch, yaw] = a;
  let [x, y, z] = p;
  [x, z] = [Math.cos(pitch) * x + Math.sin(pitch) * z, Math.cos(pitch) * z - Math.sin(pitch) * x];
  [y, z] = [Math.cos(roll) * y - Math.sin(roll) * z, Math.sin(roll) * y + Math.cos(roll) * z];
  return [Math.cos(yaw) * x - Math.sin(yaw) * y, Math.sin(yaw) * x + Math.cos(yaw) * y, z];
}
function camera() {
  const at = trackAt(scene.distance[frame]), turn = at.heading + azimuth;
  const ca = Math.cos(turn), sa = Math.sin(turn), ce = Math.cos(elevation), se = Math.sin(elevation);
  const middle = [at.x, at.y, -1.4];
  // looking along (ca, sa) and down by the elevation
  return p => {
    const x = p[0] - middle[0], y = p[1] - middle[1], z = p[2] - middle[2];
    const forward = ca * x + sa * y, right = -sa * x + ca * y;
    return [right, ce * z + se * -forward, ce * forward + se * z];
  };
}
const FACES = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
function polygons() {
  const found = [], look = camera();
  const add = (points, fill, stroke) => {
    const p = points.map(look);
    found.push({ p, fill, stroke, depth: p.reduce((a, q) => a + q[2], 0) / p.length });
  };
  const s0 = scene.distance[frame];
  for (const side of [-0.75, 0.75]) {
    for (let s = s0 - 45; s < s0 + 45; s += 1.5) {
      const a = trackAt(s), b = trackAt(s + 1.5);
      add([toSpace(a, [0, side - .036, 0]), toSpace(a, [0, side + .036, 0]), toSpace(b, [0, side + .036, 0]), toSpace(b, [0, side - .036, 0])], "#8a8a8a", "#6b6b6b");
    }
  }
  const first = Math.ceil((s0 - 45) / 0.6) * 0.6;
  for (let s = first; s < s0 + 45; s += 1.2) {
    const a = trackAt(s);
    const q = [[-.13, -1.3], [.13, -1.3], [.13, 1.3], [-.13, 1.3]].map(([x, y]) => toSpace(a, [x, y, .17]));
    add(q, "#e2ddd4", "#cfc8bc");
    found[found.length - 1].depth += 30;
  }
  scene.bodies.forEach((body, k) => {
    const q = scene.pose[frame][k], at = trackAt(s0 + body.offset + q[0]);
    const wheel = body.kind === "wheelset", angles = [gain * q[3], wheel ? 0 : gain * q[4], gain * q[5]];
    const place = p => { const r = turned(angles, p); return toSpace(at, [gain * q[0] - q[0] + r[0], body.y + gain * q[1] + r[1], body.z + gain * q[2] + r[2]]); };
    const [a, b, c, down] = body.box;
    if (wheel) {
      const spin = (s0 + body.offset) / a;
      for (const y of [-b, b]) {
        const rim = [];
        for (let i = 0; i < 28; i++) { const t = spin + i * Math.PI / 14; rim.push(place([a * Math.cos(t), y, a * Math.sin(t)])); }
        add(rim, "rgba(70,75,80,.85)", "#222");
        for (let i = 0; i < 3; i++) { const t = spin + i * Math.PI / 3; add([place([a * Math.cos(t), y, a * Math.sin(t)]), place([-a * Math.cos(t), y, -a * Math.sin(t)])], null, "#d8d8d8"); found[found.length - 1].depth -= .02; }
      }
      add([place([0, -1.05, 0]), place([0, 1.05, 0])], null, "#222");
      return;
    }
    const corner = [];
    for (const x of [-a, a]) for (const y of [-b, b]) for (const z of [-c, c]) corner.push(place([x, y, z + down]));
    const fill = body.kind === "car" ? "rgba(86,168,224,.22)" : "rgba(240,161,60,.75)";
    for (const face of FACES) add(face.map(i => corner[i]), fill, body.kind === "car" ? DARK : WARM);
  });
  return [found.sort((u, v) => v.depth - u.depth), look];
}
function drawView() {
  const [g, w, h] = fit(view), [list, look] = polygons();
  const zoom = scale * Math.min(w / 30, h / 9), X = p => w / 2 + zoom * p[0], Y = p => h / 2 + zoom * p[1];
  g.lineWidth = 1;
  for (const poly of list) {
    g.beginPath();
    poly.p.forEach((p, i) => i ? g.lineTo(X(p), Y(p)) : g.moveTo(X(p), Y(p)));
    if (poly.fill) { g.closePath(); g.fillStyle = poly.fill; g.fill(); }
    g.strokeStyle = poly.stroke; g.stroke();
  }
  if (!scene.forces) return;
  let wheel = -1;
  scene.bodies.forEach((body, k) => {
    if (body.kind !== "wheelset") return;
    wheel += 1;
    const q = scene.pose[frame][k], at = trackAt(scene.distance[frame] + body.offset + q[0]);
    for (const side of [0, 1]) {
      const y = side ? body.box[1] : -body.box[1], Q = scene.forces.Q[frame][wheel][side], F = scene.forces.Y[frame][wheel][side];
      arrow(g, X, Y, look(toSpace(at, [0, y, 0])), look(toSpace(at, [0, y, Q / 100])), DARK);
      arrow(g, X, Y, look(toSpace(at, [0, y, 0])), look(toSpace(at, [0, y + F / 30, 0])), WARM);
    }
  });
}
function arrow(g, X, Y, from, to, colour) {
  const x = X(to), y = Y(to), a = Math.atan2(y - Y(from), x - X(from));
  g.strokeStyle = g.fillStyle = colour; g.lineWidth = 2;
  g.beginPath(); g.moveTo(X(from), Y(from)); g.lineTo(x, y); g.stroke();
  if (Math.hypot(x - X(from), y - Y(from)) < 4) return;
  g.beginPath(); g.moveTo(x, y);
  g.lineTo(x - 7 * Math.cos(a - .4), y - 7 * Math.sin(a - .4)); g.lineTo(x - 7 * Math.cos(a + .4), y - 7 * Math.sin(a + .4)); g.fill();
}
function drawSection(side) {
  const [g, w, h] = fit($(side ? "right" : "left")), section = scene.sections[side];
  if (!section) return;
  const k = scene.bodies.findIndex(b => b.kind === "wheelset"), body = scene.bodies[k], q = scene.pose[frame][k];
  const middle = side ? 0.745 : -0.745, zoom = Math.min(w / .17, h / .11);
  const X = p => w / 2 + zoom * (p[0] - middle), Y = p => h * .52 + zoom * p[1];
  const line = (ys, zs, place, fill, stroke, down) => {
    g.beginPath();
    ys.forEach((y, i) => { const p = place(y, zs[i]); i ? g.lineTo(X(p), Y(p)) : g.moveTo(X(p), Y(p)); });
    g.strokeStyle = stroke; g.lineWidth = 1.5; g.stroke();
    const a = place(ys[ys.length - 1], zs[zs.length - 1]), b = place(ys[0], zs[0]);
    g.lineTo(X(a), down ? h : 0); g.lineTo(X(b), down ? h : 0); g.closePath(); g.fillStyle = fill; g.fill();
  };
  line(section.rail_y, section.rail_z, (y, z) => [y, z], "#eee7da", "#8a7a5c", true);
  const at = (y, z) => [q[1] + body.y + y - q[3] * z, body.z + q[2] + z + q[3] * y];
  line(section.wheel_y, section.wheel_z, at, "rgba(86,168,224,.25)", DARK, false);
  g.fillStyle = "#333"; g.font = "12px system-ui, sans-serif";
  const Q = scene.forces.Q[frame][0][side], F = scene.forces.Y[frame][0][side];
  g.fillText((side ? "right" : "left") + " wheel 1", 6, 15);
  g.fillText("Q " + Q.toFixed(1) + " kN", 6, h - 20); g.fillText("Y " + F.toFixed(1) + " kN", 6, h - 6);
  let foot = [at(side ? body.box[1] : -body.box[1], body.box[0])];
  if (scene.patches) {
    const N = scene.patches.N[frame][side], y = scene.patches.y[frame][side], z = scene.patches.z[frame][side];
    const loaded = N.map((v, i) => [v, i]).filter(v => v[0] > 0);
    if (loaded.length) foot = loaded.sort((a, b) => b[0] - a[0]).map(v => [q[1] + body.y + y[v[1]], body.z + q[2] + z[v[1]]]);
    for (const p of foot) { g.beginPath(); g.arc(X(p), Y(p), 4, 0, 7); g.fillStyle = WARM; g.fill(); }
  }
  const p = foot[0];
  const start = [X(p), Y(p)], ends = [[[start[0], start[1] + Q * .4], DARK], [[start[0] + F * .8, start[1]], WARM]];
  for (const [end, colour] of ends) arrow(g, v => v[0], v => v[1], start, end, colour);
}
const SERIES = scene.forces ? [
  ["Q wheelset 1 (kN)", i => scene.forces.Q[i][0]],
  ["Y wheelset 1 (kN)", i => scene.forces.Y[i][0]],
  ["lateral displacement of wheelset 1 (mm)", i => { const k = scene.bodies.findIndex(b => b.kind === "wheelset"); return [scene.pose[i][k][1] * 1e3]; }],
] : [["lateral displacement of the first body (relative)", i => [scene.pose[i][0][1]]]];
function drawPlots() {
  const [g, w, h] = fit($("plots")), axis = scene.forces ? scene.distance : scene.time;
  const low = axis[0], high = axis[n - 1], left = 44, each = (h - 16) / SERIES.length;
  const X = v => left + (w - left - 8) * (v - low) / (high - low);
  g.font = "11px system-ui, sans-serif"; g.lineWidth = 1.2;
  SERIES.forEach(([name, values], row) => {
    const all = Array.from({ length: n }, (_, i) => values(i)), flat = all.flat();
    let a = Math.min(...flat), b = Math.max(...flat);
    if (b - a < 1e-9) { a -= 1; b += 1; }
    const top = row * each + 16, Y = v => top + (each - 24) * (b - v) / (b - a);
    g.fillStyle = "#333"; g.fillText(name, left, row * each + 12);
    g.fillStyle = "#777"; g.fillText(b.toFixed(1), 4, Y(b) + 8); g.fillText(a.toFixed(1), 4, Y(a));
    [DARK, WARM].slice(0, all[0].length).forEach((colour, side) => {
      g.strokeStyle = colour; g.beginPath();
      all.forEach((v, i) => i ? g.lineTo(X(axis[i]), Y(v[side])) : g.moveTo(X(axis[i]), Y(v[side])));
      g.stroke();
    });
  });
  g.strokeStyle = "#b3122b"; g.beginPath(); g.moveTo(X(axis[frame]), 0); g.lineTo(X(axis[frame]), h); g.stroke();
  g.fillStyle = "#777"; g.fillText(scene.forces ? "left blue, right orange; distance " + low.toFixed(0) + " to " + high.toFixed(0) + " m" : "time", left, h - 4);
}
function draw() {
  drawView();
  if (scene.sections.length) { drawSection(0); drawSection(1); }
  drawPlots();
  $("scrub").value = frame;
  const s = scene.distance[frame], at = trackAt(s), ahead = trackAt(s + 1);
  const kappa = ahead.heading - at.heading;
  $("state").textContent = "t " + scene.time[frame].toFixed(2) + " s" + (scene.forces ? ", s " + s.toFixed(1) + " m, " +
    (Math.abs(kappa) < 1e-6 ? "straight" : "R " + (1 / kappa).toFixed(0) + " m") + ", cant " + (1500 * Math.sin(at.cant)).toFixed(0) + " mm" : "");
}
function tick(now) {
  if (playing) {
    clock += (now - last) / 1000 * parseFloat($("rate").value);
    const end = scene.time[n - 1];
    if (clock > end) clock = scene.time[0];
    let i = frame;
    if (scene.time[i] > clock) i = 0;
    while (i < n - 1 && scene.time[i + 1] <= clock) i++;
    if (i !== frame) { frame = i; draw(); }
    requestAnimationFrame(tick);
  }
  last = now;
}
function play(on) {
  playing = on; $("play").textContent = on ? "Pause" : "Play";
  if (on) { clock = scene.time[frame]; requestAnimationFrame(t => { last = t; tick(t); }); }
}
function go(i) { frame = Math.min(Math.max(i, 0), n - 1); clock = scene.time[frame]; draw(); }
$("play").onclick = () => play(!playing);
$("scrub").max = n - 1;
$("scrub").oninput = e => go(+e.target.value);
$("gain").onchange = e => { gain = +e.target.value; draw(); };
$("preset").onchange = e => { [azimuth, elevation] = PRESETS[+e.target.value]; draw(); };
if (!scene.forces) $("rate").value = ".1";
document.addEventListener("keydown", e => {
  if (/SELECT|INPUT/.test(e.target.tagName) && e.key !== " ") return;
  if (e.key === " ") { play(!playing); e.preventDefault(); }
  if (e.key === "ArrowRight") go(frame + 1);
  if (e.key === "ArrowLeft") go(frame - 1);
});
const fingers = new Map();
let apart = 0;
view.addEventListener("pointerdown", e => { fingers.set(e.pointerId, [e.clientX, e.clientY]); apart = 0; try { view.setPointerCapture(e.pointerId); } catch (_) { /* no such pointer */ } });
view.addEventListener("pointermove", e => {
  const old = fingers.get(e.pointerId);
  if (!old) return;
  if (fingers.size === 1) {
    azimuth -= (e.clientX - old[0]) * .008;
    elevation = Math.min(Math.max(elevation + (e.clientY - old[1]) * .006, -.1), 1.5);
  }
  fingers.set(e.pointerId, [e.clientX, e.clientY]);
  if (fingers.size === 2) {
    const [a, b] = [...fingers.values()], d = Math.hypot(a[0] - b[0], a[1] - b[1]);
    if (apart) scale = Math.min(Math.max(scale * d / apart, .3), 30);
    apart = d;
  }
  draw();
});
for (const name of ["pointerup", "pointercancel"]) view.addEventListener(name, e => { fingers.delete(e.pointerId); apart = 0; });
view.addEventListener("wheel", e => { scale = Math.min(Math.max(scale * Math.exp(-e.deltaY * .001), .3), 30); draw(); e.preventDefault(); }, { passive: false });
window.addEventListener("resize", draw);
if (!scene.sections.length) $("sections").style.display = "none";
draw();
