"use strict";
const $ = id => document.getElementById(id);
const scene = JSON.parse($("data").textContent);
const n = scene.time.length, view = $("view"), wheelsets = scene.bodies.filter(b => b.kind === "wheelset");
const first = scene.bodies.length - wheelsets.length; // wheelsets stand behind the other bodies
const paint = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
let ink = {};
function inks() { for (const name of ["ink", "soft", "left", "right", "car", "frame", "wheel", "rail", "head", "tie", "now"]) ink[name] = paint(name); }
let chosen = 0; // wheelset
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
      add([toSpace(a, [0, side - .036, 0]), toSpace(a, [0, side + .036, 0]), toSpace(b, [0, side + .036, 0]), toSpace(b, [0, side - .036, 0])], ink.rail, ink.rail);
    }
  }
  const first = Math.ceil((s0 - 45) / 0.6) * 0.6;
  for (let s = first; s < s0 + 45; s += 1.2) {
    const a = trackAt(s);
    const q = [[-.13, -1.3], [.13, -1.3], [.13, 1.3], [-.13, 1.3]].map(([x, y]) => toSpace(a, [x, y, .17]));
    add(q, ink.tie, ink.tie);
    found[found.length - 1].depth += 30;
  }
  scene.bodies.forEach((body, k) => {
    const q = scene.pose[frame][k], at = trackAt(s0 + body.offset + q[0]);
    const wheel = body.kind === "wheelset", angles = [gain * q[3], wheel ? 0 : gain * q[4], gain * q[5]];
    const place = p => { const r = turned(angles, p); return toSpace(at, [gain * q[0] - q[0] + r[0], body.y + gain * q[1] + r[1], body.z + gain * q[2] + r[2]]); };
    const [a, b, c, mx, my, mz] = body.box;
    if (wheel) {
      const spin = (s0 + body.offset) / a;
      for (const y of [-b, b]) {
        const rim = [];
        for (let i = 0; i < 28; i++) { const t = spin + i * Math.PI / 14; rim.push(place([a * Math.cos(t), y, a * Math.sin(t)])); }
        add(rim, ink.wheel, ink.ink);
        for (let i = 0; i < 3; i++) { const t = spin + i * Math.PI / 3; add([place([a * Math.cos(t), y, a * Math.sin(t)]), place([-a * Math.cos(t), y, -a * Math.sin(t)])], null, ink.soft); found[found.length - 1].depth -= .02; }
      }
      add([place([0, -1.05, 0]), place([0, 1.05, 0])], null, ink.ink);
      return;
    }
    const corner = [];
    if (!scene.forces) {
      const still = [];
      for (const x of [-a, a]) for (const y of [-b, b]) for (const z of [-c, c]) still.push(toSpace(trackAt(s0 + body.offset), [x + mx, body.y + y + my, body.z + z + mz]));
      for (const face of FACES) { add(face.map(i => still[i]), null, ink.soft); found[found.length - 1].closed = true; }
    }
    for (const x of [-a, a]) for (const y of [-b, b]) for (const z of [-c, c]) corner.push(place([x + mx, y + my, z + mz]));
    for (const face of FACES) add(face.map(i => corner[i]), ink[body.kind], body.kind === "car" ? ink.left : ink.right);
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
    if (poly.fill || poly.closed) g.closePath();
    if (poly.fill) { g.fillStyle = poly.fill; g.fill(); }
    g.strokeStyle = poly.stroke; g.stroke();
  }
  if (!scene.forces) return;
  wheelsets.forEach((body, wheel) => {
    const q = scene.pose[frame][first + wheel], at = trackAt(scene.distance[frame] + body.offset + q[0]);
    for (const side of [0, 1]) {
      const c = scene.contact[frame][wheel][side], Q = scene.forces.Q[frame][wheel][side], F = scene.forces.Y[frame][wheel][side];
      if (!c[2]) continue; // this wheel does not touch
      const p = [c[0], q[1] + c[1], body.z + q[2] + c[2]], colour = side ? ink.right : ink.left;
      for (const to of [[0, 0, Q / 100], [0, F / 30, 0]]) arrow(g, X, Y, look(toSpace(at, p)), look(toSpace(at, p.map((v, i) => v + to[i]))), colour);
    }
  });
}
function arrow(g, X, Y, from, to, colour) {
  const x = X(to), y = Y(to), a = Math.atan2(y - Y(from), x - X(from));
  g.strokeStyle = g.fillStyle = colour; g.lineWidth = 2; g.setLineDash([]);
  g.beginPath(); g.moveTo(X(from), Y(from)); g.lineTo(x, y); g.stroke();
  if (Math.hypot(x - X(from), y - Y(from)) < 4) return;
  g.beginPath(); g.moveTo(x, y);
  g.lineTo(x - 7 * Math.cos(a - .4), y - 7 * Math.sin(a - .4)); g.lineTo(x - 7 * Math.cos(a + .4), y - 7 * Math.sin(a + .4)); g.fill();
}
/* one wheelset: its two contacts, the whole from behind, its contacts from the right side */
function wheelset() {
  const body = wheelsets[chosen], q = scene.pose[frame][first + chosen], [height, wider] = scene.seats[frame][chosen];
  const wheels = scene.sections[chosen].map((section, side) => {
    const moved = (side - .5) * wider, [cx, cy, cz] = scene.contact[frame][chosen][side];
    let feet = cz ? [[q[1] + cy, height + cz]] : [];
    if (scene.patches) {
      const p = scene.patches, of = name => p[name][frame][chosen][side], N = of("N");
      const loaded = N.map((v, i) => i).filter(i => N[i] > 0).sort((i, j) => N[j] - N[i]);
      if (loaded.length) feet = loaded.map(i => [q[1] + of("y")[i], height + of("z")[i]]);
    }
    return {
      section, side, feet, x: cx + q[5] * cy, z: height + cz, touches: cz !== 0,
      Q: scene.forces.Q[frame][chosen][side], Y: scene.forces.Y[frame][chosen][side],
      rail: section.rail_y.map((y, i) => [y + moved, section.rail_z[i]]),
      wheel: section.wheel_y.map((y, i) => [y, section.wheel_z[i]]), colour: side ? ink.right : ink.left,
    };
  });
  const at = ([y, z]) => [q[1] + y - q[3] * z, height + z + q[3] * y];
  return { body, wheels, at, height };
}
function shape(g, points, fill, stroke) {
  g.beginPath();
  points.forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y));
  g.closePath(); g.fillStyle = fill; g.fill();
  if (stroke) { g.strokeStyle = stroke; g.lineWidth = 1.5; g.stroke(); }
}
function line(g, points, stroke) {
  g.beginPath();
  points.forEach(([x, y], i) => i ? g.lineTo(x, y) : g.moveTo(x, y));
  g.strokeStyle = stroke; g.lineWidth = 1.5; g.stroke();
}
function forces(g, wheel, start, factor) {
  if (!wheel.touches) return;
  const same = v => v[0], down = v => v[1];
  arrow(g, same, down, start, [start[0], start[1] + wheel.Q * factor], wheel.colour);
  arrow(g, same, down, start, [start[0] + 2 * wheel.Y * factor, start[1]], wheel.colour);
}
function write(g, lines, h) {
  g.fillStyle = ink.ink; g.font = "12px system-ui, sans-serif"; g.textAlign = "left";
  lines.forEach((words, i) => g.fillText(words, 6, i ? h - 6 - 14 * (lines.length - 1 - i) : 15));
}
function drawSection(side) {
  const [g, w, h] = fit($(side ? "right" : "left")), { wheels, at } = wheelset(), wheel = wheels[side];
  const middle = side ? 0.745 : -0.745, zoom = Math.min(w / .17, h / .11);
  const P = ([y, z]) => [w / 2 + zoom * (y - middle), h * .52 + zoom * z];
  const rail = wheel.rail.map(P), rim = wheel.wheel.map(p => P(at(p))), ends = points => [points[points.length - 1][0], points[0][0]];
  shape(g, [...rail, ...ends(rail).map(x => [x, h])], ink.head); line(g, rail, ink.rail);
  shape(g, [...rim, ...ends(rim).map(x => [x, 0])], ink.car); line(g, rim, ink.ink);
  for (const foot of wheel.feet.map(P)) { g.beginPath(); g.arc(foot[0], foot[1], 4, 0, 7); g.fillStyle = wheel.colour; g.fill(); }
  if (wheel.feet.length) forces(g, wheel, P(wheel.feet[0]), .4);
  write(g, [(side ? "right" : "left") + " wheel", "Q " + wheel.Q.toFixed(1) + " kN", "Y " + wheel.Y.toFixed(1) + " kN"], h);
}
function drawBehind() {
  const [g, w, h] = fit($("behind")), { wheels, at, body } = wheelset(), r = body.box[0], zoom = Math.min(w / 2.2, h / 1.5, .33 * h / r);
  const P = ([y, z]) => [w / 2 + zoom * y, h * .7 + zoom * z], axle = [[-1.05, -.08], [1.05, -.08], [1.05, .08], [-1.05, .08]];
  for (const wheel of wheels) {
    const rail = wheel.rail.map(P), foot = h * .7 + zoom * .17;
    shape(g, [...rail, [rail[rail.length - 1][0], foot], [rail[0][0], foot]], ink.head, ink.rail);
  }
  shape(g, axle.map(p => P(at(p))), ink.wheel, ink.ink);
  for (const wheel of wheels) shape(g, [...wheel.wheel, ...wheel.wheel.map(([y, z]) => [y, -z]).reverse()].map(p => P(at(p))), ink.wheel, ink.ink);
  for (const wheel of wheels) if (wheel.feet.length) forces(g, wheel, P(wheel.feet[0]), .3);
  write(g, ["from behind"], h);
}
function drawBeside() {
  const [g, w, h] = fit($("beside")), { wheels, height, body } = wheelset(), zoom = Math.min(w / .17, h / .11);
  const P = ([x, z]) => [w / 2 + zoom * x, h * .52 + zoom * z];
  const arc = r => Array.from({ length: 41 }, (_, i) => (i - 20) * .006).map(x => P([x, height + Math.sqrt(r * r - x * x)]));
  const flange = Math.max(...wheels[0].section.wheel_z), rail = [P([-.2, 0]), P([.2, 0])];
  shape(g, [...rail, [rail[1][0], h], [rail[0][0], h]], ink.head); line(g, rail, ink.rail);
  line(g, arc(flange), ink.soft); line(g, arc(body.box[0]), ink.ink);
  for (const wheel of wheels) {
    if (!wheel.touches) continue;
    const foot = P([wheel.x, wheel.z]);
    g.beginPath(); g.arc(foot[0], foot[1], 4, 0, 7); g.fillStyle = wheel.colour; g.fill();
    arrow(g, v => v[0], v => v[1], foot, [foot[0], foot[1] + wheel.Q * .4], wheel.colour);
  }
  const ahead = wheels.map((wheel, side) => (side ? "right " : "left ") + (wheel.touches ? (1e3 * wheel.x + 0).toFixed(1).replace("-0.0", "0.0") : "none"));
  write(g, ["from the right side", "ahead of the axle (mm):", ahead.join(", ")], h);
}
const SERIES = scene.forces ? [
  [scene.words.Q, scene.curves.Q],
  [scene.words.Y, scene.curves.Y],
  [scene.words.wheelset_lateral, scene.curves.lateral],
] : [];
function drawPlots() {
  const [g, w, h] = fit($("plots")), axis = scene.curves.distance;
  const low = axis[0], high = axis[axis.length - 1], left = 44, each = (h - 18) / SERIES.length;
  const X = v => left + (w - left - 8) * (v - low) / (high - low);
  g.font = "11px system-ui, sans-serif"; g.lineWidth = 1.2;
  SERIES.forEach(([name, values], row) => {
    const all = values.map(v => v[chosen]), flat = all.flat();
    let a = Math.min(...flat), b = Math.max(...flat);
    if (b - a < 1e-9) { a -= 1; b += 1; }
    const top = row * each + 16, Y = v => top + (each - 24) * (b - v) / (b - a);
    g.fillStyle = ink.ink; g.textAlign = "left"; g.fillText(name, 4, row * each + 11);
    g.fillStyle = ink.soft; g.textAlign = "right";
    g.fillText(b.toFixed(1), left - 4, Y(b) + 8); g.fillText(a.toFixed(1), left - 4, Y(a));
    [ink.left, ink.right].slice(0, all[0].length).forEach((colour, side) => {
      g.strokeStyle = colour; g.setLineDash(side ? [6, 3] : []); g.beginPath();
      all.forEach((v, i) => i ? g.lineTo(X(axis[i]), Y(v[side])) : g.moveTo(X(axis[i]), Y(v[side])));
      g.stroke();
    });
    g.setLineDash([]);
  });
  g.strokeStyle = ink.now; g.beginPath(); g.moveTo(X(scene.distance[frame]), 16); g.lineTo(X(scene.distance[frame]), h - 16); g.stroke();
  g.fillStyle = ink.soft; g.textAlign = "left"; g.fillText(low.toFixed(0), left, h - 4);
  g.textAlign = "right"; g.fillText(high.toFixed(0), w - 8, h - 4);
  g.textAlign = "center"; g.fillText("distance (m)", (left + w) / 2, h - 4);
}
function speedAt(i) {
  const a = Math.max(0, i - 1), b = Math.min(n - 1, i + 1);
  return (scene.distance[b] - scene.distance[a]) / (scene.time[b] - scene.time[a]);
}
function draw() {
  drawView();
  if (scene.sections.length) { drawSection(0); drawSection(1); drawBehind(); drawBeside(); }
  if (SERIES.length) drawPlots();
  $("scrub").value = frame;
  const s = scene.distance[frame], at = trackAt(s), ahead = trackAt(s + 1);
  const kappa = ahead.heading - at.heading;
  $("state").textContent = "t " + scene.time[frame].toFixed(2) + " s" + (scene.forces ? ", s " + s.toFixed(1) + " m, " + (3.6 * speedAt(frame)).toFixed(1) + " km/h, " +
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
/* playing speed: that of the vehicle on the screen, or a share of the time of a mode */
const speed = (scene.distance[n - 1] - scene.distance[0]) / (scene.time[n - 1] - scene.time[0]);
for (const [share, words] of [[.05, "1/20"], [.1, "1/10"], [.25, "1/4"], [.5, "1/2"], [1, "1"], [2, "2"], [4, "4"]]) {
  const option = document.createElement("option"), kmh = 3.6 * speed * share;
  option.value = share;
  option.textContent = speed > .1 ? (kmh < 10 ? kmh.toFixed(1) : kmh.toFixed(0)) + " km/h" + (share === 1 ? " (as run)" : "") : words + " of real time";
  option.selected = share === 1;
  $("rate").append(option);
}
wheelsets.forEach((body, i) => { const option = document.createElement("option"); option.value = i; option.textContent = i + 1 + " " + body.name; $("wheelset").append(option); });
$("wheelset").onchange = e => { chosen = +e.target.value; draw(); };
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { inks(); draw(); });
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
function show(mode) {
  Object.assign(scene, mode);
  $("title").textContent = document.title = mode.title;
  // a cycle in about two seconds
  const shares = Array.from($("rate").options, o => +o.value), period = scene.time[n - 1] - scene.time[0];
  $("rate").value = shares.reduce((a, b) => Math.abs(Math.log(b * 2 / period)) < Math.abs(Math.log(a * 2 / period)) ? b : a);
  go(0);
}
scene.modes.forEach((mode, i) => { const option = document.createElement("option"); option.value = i; option.textContent = mode.name; option.selected = mode.title === scene.title; $("mode").append(option); });
$("mode").onchange = e => show(scene.modes[+e.target.value]);
if (!scene.modes.length) $("mode").parentNode.hidden = true;
if (!scene.sections.length) $("side").hidden = $("main").classList.add("alone") || true;
if (!scene.sections.length) $("sections").hidden = $("wheelset").parentNode.hidden = $("key").hidden = true;
inks();
if (scene.modes.length) { show(scene.modes[+$("mode").value]); play(true); } else draw();
