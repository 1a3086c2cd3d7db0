let story = JSON.parse(document.getElementById("story").textContent);
const live = story === null;
let over = !live;
const $ = id => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const shape = (parent, name, attributes, text) => {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  parent.append(node);
  return node;
};
const latest = (list, at) => list.filter(x => x.at_s <= at + 1e-6).at(-1);
const seconds = s => `${s.toFixed(1)} s`;
// Date and time of the place where the page is read, as ISO 8601 writes them.
const isoDate = unix_s => {
  const date = new Date(unix_s * 1000), two = n => String(n).padStart(2, "0");
  return `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())} ${two(date.getHours())}:${two(date.getMinutes())}`;
};

const verdicts = { achieved: "achieved", not_found: "not found", cannot_tell: "cannot tell", impossible: "cannot be done", failed: "failed" };
const inWords = report => (report.answer ? report.answer + "; " : "") + (verdicts[report.verdict] ?? report.verdict);

// The top: what was asked, how it ended, and the figures.
function head() {
  $("goal").textContent = story.goal;
  const report = story.report;
  const verdict = $("verdict");
  verdict.replaceChildren();
  $("facts").replaceChildren();
  if (report) {
    verdict.classList.toggle("no", report.verdict !== "achieved");
    const bold = document.createElement("b");
    bold.textContent = inWords(report);
    verdict.append(bold, ": " + report.why);
  } else {
    verdict.textContent = over ? "The run has not finished." : "The run is under way.";
  }
  $("lost").hidden = story.lost.length === 0;
  if (story.lost.length) {
    $("lost").textContent = "Lost from the record: " + story.lost.join("; ");
  }
  const facts = [["in PDDL", story.pddl], ["on the body's clock", seconds(story.ends_s)], ["looks", story.looks.length], ["plans", story.plans.length]];
  if (story.wanted) facts.unshift(["wanted", story.wanted]);
  if (report?.position_m) {
    const spread = report.position_sigma_m === null ? "" : ` \u00b1 ${(report.position_sigma_m * 1000).toFixed(0)} mm`;
    facts.push(["position", `(${report.position_m.map(v => v.toFixed(3)).join(", ")}) m${spread}`]);
  }
  if (report) facts.push(["driven", `${report.distance_m.toFixed(1)} m`], ["asked for", report.threshold]);
  if (story.begun_unix_s) facts.push(["begun", isoDate(story.begun_unix_s)]);
  for (const [name, value] of facts) {
    const row = document.createElement("div"), dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name; dd.textContent = value;
    row.append(dt, dd); $("facts").append(row);
  }
}

// From where the body stood to where it stood next: straight, and through the middles of the doors between two rooms.
function way(from, to) {
  const inside = (room, [x, y]) => room.outline_m.reduce((is, [ax, ay], n) => {
    const [bx, by] = room.outline_m[(n + 1) % room.outline_m.length];
    return (ay > y) !== (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax ? !is : is;
  }, false);
  const room = p => story.map.rooms.find(r => inside(r, p))?.name;
  const [start, goal] = [room(from), room(to)];
  const ways = [{ at: start, through: [] }], known = new Set([start]);
  while (start && goal && ways.length) {
    const { at, through } = ways.shift();
    if (at === goal) return [from, ...through, to];
    for (const door of story.map.doors.filter(d => d.between.includes(at))) {
      const beyond = door.between.find(name => name !== at);
      if (known.has(beyond)) continue;
      known.add(beyond);
      ways.push({ at: beyond, through: [...through, door.centre_m] });
    }
  }
  return [from, to];
}

// Name of the viewpoint of the look at this time: the place in the step under way that is no surface and no room.
function viewpoint(at_s) {
  const places = story.deeds.findLast(d => d.from_s <= at_s + 1e-6)?.arguments ?? [];
  const areas = new Set([...story.map.surfaces, ...story.map.rooms].map(a => a.name.toLowerCase().replaceAll(" ", "-")));
  return places.find(place => !areas.has(place));
}

// The map, seen from above: rooms, surfaces, where the body stood, what each look took in, what is believed.
function mapOf(at) {
  const svg = $("map");
  svg.replaceChildren();
  const path = points => points.map(([x, y]) => `${x},${-y}`).join(" ");
  const all = [...story.map.rooms, ...story.map.surfaces].flatMap(a => a.outline_m)
    .concat(story.looks.flatMap(l => l.corners_m.slice(2)), story.stands.map(s => [s.x_m, s.y_m]), story.beliefs.flatMap(b => b.objects.map(o => o.position_m)));
  const [xs, ys] = [0, 1].map(k => all.map(p => p[k]));
  const least = list => list.length ? Math.min(...list) : -1, most = list => list.length ? Math.max(...list) : 1;
  const box = [least(xs) - .4, -most(ys) - .4, most(xs) - least(xs) + .8, most(ys) - least(ys) + .8];
  svg.setAttribute("viewBox", box.join(" "));
  svg.style.aspectRatio = `${box[2]} / ${box[3]}`;
  // Letters are 11 px high at least, however narrow the screen.
  const scale = Math.min(svg.clientWidth / box[2], (svg.clientHeight || Infinity) / box[3]);
  const em = Math.max(Math.max(box[2], box[3]) / 42, scale > 0 ? 11 / scale : 0);
  const words = (x, y, text, more) => shape(svg, "text", { x, y: -y, "text-anchor": "middle", style: `font-size:${em}px;fill:${more.fill}` }, text);
  const middle = points => [0, 1].map(k => points.reduce((sum, p) => sum + p[k], 0) / points.length);
  for (const room of story.map.rooms) {
    shape(svg, "polygon", { points: path(room.outline_m), fill: "none", stroke: "var(--wall)", "stroke-width": .22 * em });
    const [x] = middle(room.outline_m);
    words(x, most(room.outline_m.map(p => p[1])) - 1.2 * em, room.name, { fill: "var(--faint)" });
  }
  for (const door of story.map.doors) {
    const [x, y] = door.centre_m, dx = Math.cos(door.along_rad) * door.width_m / 2, dy = Math.sin(door.along_rad) * door.width_m / 2;
    shape(svg, "line", { x1: x - dx, y1: -y + dy, x2: x + dx, y2: -y - dy, stroke: "var(--room)", "stroke-width": .3 });
    shape(svg, "line", { x1: x - dx, y1: -y + dy, x2: x + dx, y2: -y - dy, stroke: "var(--planned)", "stroke-width": .04 }).append(titled(door.name));
  }
  const named = [];
  for (const surface of story.map.surfaces) {
    shape(svg, "polygon", { points: path(surface.outline_m), fill: "var(--field)", stroke: "var(--line)", "stroke-width": .12 * em });
    const [x] = middle(surface.outline_m);
    named.push({ x, y: least(surface.outline_m.map(p => p[1])) - em, name: surface.name, step: -1, more: { fill: "var(--faint)" } });
  }
  const looked = story.looks.filter(l => l.at_s <= at + 1e-6);
  looked.forEach((look, n) => {
    const low = look.corners_m.slice(2);
    const now = n === looked.length - 1;
    shape(svg, "polygon", { points: path([look.eye_m, ...low]), fill: now ? "var(--now)" : "var(--done)", "fill-opacity": now ? .28 : .07 });
  });
  const stood = story.stands.filter(s => s.at_s <= at + 1e-6);
  shape(svg, "polyline", { points: path(stood.flatMap((s, n) => n ? way([stood[n - 1].x_m, stood[n - 1].y_m], [s.x_m, s.y_m]).slice(1) : [[s.x_m, s.y_m]])), fill: "none", stroke: "var(--done)", "stroke-width": .13 * em, "stroke-dasharray": `${.45 * em} ${.35 * em}` });
  stood.forEach((s, n) => shape(svg, "circle", { cx: s.x_m, cy: -s.y_m, r: .22 * em, fill: n === stood.length - 1 ? "var(--now)" : "var(--done)" }));
  const seen = new Set();
  for (const s of stood) {
    const name = viewpoint(s.at_s);
    if (!name || seen.has(name)) continue;
    seen.add(name);
    named.push({ x: s.x_m, y: s.y_m - 1.1 * em, name, step: -1, more: { fill: "var(--done)" } });
  }
  const body = stood.at(-1);
  if (body) {
    const r = story.body_radius_m;
    shape(svg, "circle", { cx: body.x_m, cy: -body.y_m, r, fill: "none", stroke: "var(--now)", "stroke-width": .14 * em });
    shape(svg, "line", { x1: body.x_m, y1: -body.y_m, x2: body.x_m + r * Math.cos(body.yaw_rad), y2: -body.y_m - r * Math.sin(body.yaw_rad), stroke: "var(--now)", "stroke-width": .18 * em });
  }
  for (const o of latest(story.beliefs, at)?.objects ?? []) {
    const colour = o.name ? "var(--known)" : "var(--unknown)";
    const outline = o.footprint_m.length > 2 ? o.footprint_m : null;
    const drawn = outline ? shape(svg, "polygon", { points: path(outline), fill: colour, "fill-opacity": .55, stroke: colour, "stroke-width": .07 * em })
      : shape(svg, "circle", { cx: o.position_m[0], cy: -o.position_m[1], r: Math.max(o.size_m[0], .04) / 2, fill: colour });
    drawn.append(titled(`${o.name ?? "unknown"} ${o.probability.toFixed(2)}`));
    if (o.name) named.push({ x: o.position_m[0], y: o.position_m[1] + .6 * em, name: o.name, step: 1, more: { fill: colour } });
  }
  const [x, y] = [box[0] + .8 * em, box[1] + box[3] - .7 * em], length_m = box[2] > 2.5 ? 1 : .2;
  shape(svg, "path", { d: `M${x},${y - .3 * em} v${.3 * em} h${length_m} v${-.3 * em}`, fill: "none", stroke: "var(--faint)", "stroke-width": .12 * em });
  words(x + length_m / 2, -y + .5 * em, `${length_m} m`, { fill: "var(--faint)" });
  // Names of neighbours make room for each other: those of objects upwards, those of surfaces downwards.
  const set = [];
  for (const { x, y: from, name, step, more } of named.sort((a, b) => a.step - b.step || a.step * (a.y - b.y))) {
    const drawn = words(x, from, name, more), half = Math.max(drawn.getComputedTextLength?.() ?? 0, name.length * .5 * em) / 2;
    const within = Math.max(box[0] + half, Math.min(x, box[0] + box[2] - half));
    let y = from;
    while (set.some(o => Math.abs(o.x - within) < o.half + half && Math.abs(o.y - y) < 1.1 * em)) y += step * .2 * em;
    set.push({ x: within, y, half });
    drawn.setAttribute("x", within); drawn.setAttribute("y", -y);
    // A name that had to go elsewhere is tied to its object.
    if (step > 0 && y - from > .5 * em) shape(svg, "line", { x1: x, y1: -from + .5 * em, x2: within, y2: -y + .2 * em, stroke: more.fill, "stroke-width": .05 * em });
  }
}
const titled = text => { const title = document.createElementNS(SVG, "title"); title.textContent = text; return title; };

// Plans: a line a step, as planned (pale) from the moment it was made, and as it happened (strong) below.
const shortened = (text, most) => text.length > most ? text.slice(0, most - 1) + "\u2026" : text;
function planOf(at) {
  const svg = $("plan"), plan = latest(story.plans, at);
  svg.replaceChildren();
  $("because").textContent = plan ? `plan ${plan.round}: ${plan.because}` : "There is no plan yet.";
  if (!plan) return;
  const next = story.plans.find(p => p.at_s > plan.at_s + 1e-9 || p.round > plan.round);
  const until = next?.at_s ?? Infinity;
  const steps = plan.steps, done = story.deeds.filter(d => d.from_s >= plan.at_s - 1e-6 && d.from_s < until - 1e-6);
  const ends = Math.max(plan.at_s + 1, ...steps.map(s => s.from_s + s.lasts_s), ...done.map(d => d.to_s));
  const wide = Math.max(300, svg.clientWidth), row = 44, x = s => (s - plan.at_s) / (ends - plan.at_s) * (wide - 2);
  const height = row * steps.length + 26;
  svg.setAttribute("viewBox", `0 0 ${wide} ${height}`);
  svg.style.height = `${height}px`;
  const used = new Set();
  steps.forEach((step, n) => {
    const y = n * row;
    shape(svg, "text", { x: 0, y: y + 12 }, shortened(step.said, wide / 6.5)).append(titled(step.call));
    shape(svg, "rect", { x: x(step.from_s), y: y + 17, width: Math.max(2, x(step.from_s + step.lasts_s) - x(step.from_s)), height: 9, rx: 2, fill: "var(--planned)" });
    const deed = done.find(d => d.call === step.call && !used.has(d));
    if (!deed) return;
    used.add(deed);
    const bar = shape(svg, "rect", { x: x(deed.from_s), y: y + 28, width: Math.max(2, x(Math.max(deed.to_s, deed.from_s)) - x(deed.from_s)), height: 9, rx: 2, fill: deed.failed ? "var(--failed)" : "var(--done)" });
    bar.append(titled(`${seconds(deed.from_s)} to ${seconds(deed.to_s)}${deed.failed ? ": " + deed.failed : ""}`));
  });
  const line = x(Math.min(Math.max(at, plan.at_s), ends));
  shape(svg, "line", { x1: line, x2: line, y1: 0, y2: height - 22, stroke: "var(--now)", "stroke-width": 1.5 });
  for (const s of [plan.at_s, (plan.at_s + ends) / 2, ends]) shape(svg, "text", { x: x(s), y: height - 6, "text-anchor": s === ends ? "end" : s === plan.at_s ? "start" : "middle", fill: "var(--faint)" }, seconds(s));
}

// How sure: the numbers that the goal asks for, and the best probability of each known object, after each look.
function sureOf(at) {
  // Several things may be asked for: of each, how it stands by now.
  const by = latest(story.known, at)?.at_s;
  const looked = story.looks.some(l => l.at_s <= at + 1e-6);
  $("known").textContent = story.known.filter(k => k.at_s === by).map(k => k.text).join(" ") || (looked ? "Nothing was judged yet." : "Nothing was looked at yet.");
  $("known").hidden = story.report !== null && !story.known.length;
  $("sought").textContent = story.sought.map((s, n) => `sought${story.sought.length > 1 ? ` ${n + 1}` : ""}: ${s.name}, ${s.wanted} is wanted`).join("; ");
  const svg = $("sure"), lines = curves();
  svg.replaceChildren();
  // What is hidden has no width: this comes first.
  svg.parentElement.hidden = story.looks.length > 0 && !lines.length;
  const wide = Math.max(320, svg.clientWidth), longest = Math.max(0, ...lines.map(l => l.name.length));
  const high = Math.max(300, 40 + 14 * lines.length), left = 34, right = Math.min(wide * .45, 26 + 6.6 * longest), low = high - 26;
  svg.setAttribute("viewBox", `0 0 ${wide} ${high}`);
  svg.style.height = `${high}px`;
  // What the last look changed has a line of its own behind it.
  const until_s = 1.06 * Math.max(story.ends_s, 1e-9);
  const x = s => left + s / until_s * (wide - left - right), y = p => low - p * (low - 12);
  const wanted = [...new Set([...story.sought.map(s => s.wanted), ...(story.report ? [story.report.threshold] : [])])].filter(p => p <= 1);
  for (const p of [0, .25, .5, .75, 1]) {
    shape(svg, "line", { x1: left, x2: wide - right, y1: y(p), y2: y(p), stroke: "var(--line)" });
    if (!wanted.some(w => Math.abs(w - p) < .06)) shape(svg, "text", { x: left - 6, y: y(p) + 4, "text-anchor": "end" }, p);
  }
  for (const p of wanted) {
    shape(svg, "line", { x1: left - 4, x2: wide - right, y1: y(p), y2: y(p), stroke: "var(--known)", "stroke-dasharray": "5 4" });
    shape(svg, "text", { x: left - 6, y: y(p) + 4, "text-anchor": "end", style: "fill:var(--known);font-weight:600" }, p).append(titled(`wanted: ${p}`));
  }
  const ends = [];
  lines.forEach(({ name, values, is_sought }, n) => {
    // The greens belong to what is sought.
    const hue = 170 + 270 * n / lines.length;
    const colour = is_sought ? "var(--known)" : `light-dark(hsl(${hue} 60% 30%), hsl(${hue} 60% 70%))`;
    let points = `${x(0)},${y(0)}`, last = 0;
    for (const [at_s, value] of values) { points += ` ${x(at_s)},${y(last)}`; last = Math.min(1, Math.max(0, value)); points += ` ${x(at_s)},${y(last)}`; }
    shape(svg, "polyline", { points: points + ` ${x(until_s)},${y(last)}`, fill: "none", style: `stroke:${colour}`, "stroke-width": is_sought ? 3 : 1.5 });
    ends.push({ name, colour, from: y(last), y: y(last) + 4 });
  });
  // Names stand at the ends of their lines; where they would cover each other they make room, and a thread leads back.
  ends.sort((a, b) => a.y - b.y);
  ends.forEach((e, n) => { if (n && e.y - ends[n - 1].y < 14) e.y = ends[n - 1].y + 14; });
  ends.forEach((e, n) => { e.y = Math.min(e.y, low + 4 - 14 * (ends.length - 1 - n)); });
  for (const e of ends) {
    shape(svg, "line", { x1: wide - right, x2: wide - right + 12, y1: e.from, y2: e.y - 4, style: `stroke:${e.colour}` });
    shape(svg, "text", { x: wide - right + 15, y: e.y, style: `fill:${e.colour}` }, shortened(e.name, (right - 15) / 6.2)).append(titled(e.name));
  }
  shape(svg, "line", { x1: x(at), x2: x(at), y1: 12, y2: low, stroke: "var(--now)", "stroke-width": 1.5 });
  for (const s of [0, story.ends_s]) shape(svg, "text", { x: x(s), y: high - 6, "text-anchor": "middle" }, seconds(s));
}

// The lines of the curve, each with its values in time: what the goal asks for first.
function curves() {
  const many = story.sought.length > 1;
  const sought = story.sought.map((s, n) => ({ name: many ? `sought ${n + 1}` : "sought", is_sought: true, values: s.values }));
  const names = [...new Set(story.beliefs.flatMap(b => Object.keys(b.best)))];
  return sought.concat(names.map(name => ({ name, is_sought: false, values: story.beliefs.map(b => [b.at_s, b.best[name] ?? 0]) })));
}

// What was seen, in three dimensions.
const view = { yaw: -.8, pitch: .6, far: 4, centre: [0, 0, .8] };
let gl = null, program = null, inputs = {}, clouds = new Map(), turning = false, turned = false;
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
function beginSpace() {
  const canvas = $("cloud");
  gl = canvas.getContext("webgl", { antialias: false, preserveDrawingBuffer: true });
  if (!gl) return;
  const part = (kind, text) => { const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); return s; };
  program = gl.createProgram();
  gl.attachShader(program, part(gl.VERTEX_SHADER, `attribute vec3 place; attribute vec3 colour; uniform vec3 least, size; uniform mat4 seen; uniform float dot; varying vec3 shade;
    void main() { gl_Position = seen * vec4(least + place * size, 1.0); gl_PointSize = clamp(dot / gl_Position.w, 1.0, 9.0); shade = colour; }`));
  gl.attachShader(program, part(gl.FRAGMENT_SHADER, "precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }"));
  gl.linkProgram(program);
  gl.useProgram(program);
  // Asked once: each answer is waited for.
  for (const name of ["least", "size", "seen", "dot"]) inputs[name] = gl.getUniformLocation(program, name);
  for (const name of ["place", "colour"]) { inputs[name] = gl.getAttribLocation(program, name); gl.enableVertexAttribArray(inputs[name]); }
  gl.enable(gl.DEPTH_TEST);
}
// The points of each look, those that stand elsewhere now in the place of those that were there. What is told anew meanwhile goes first.
async function fillSpace() {
  if (!gl) return;
  const told = story;
  const buffer = data => { const b = gl.createBuffer(); gl.bindBuffer(gl.ARRAY_BUFFER, b); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW); return b; };
  for (const { key, at_s, points } of story.looks) {
    if (clouds.has(key)) continue;
    const had = points ?? await fetched(`points/${key}`);
    if (story !== told) return;
    if (!had) continue;
    const places = bytes(had.places), colours = bytes(had.colours);
    clouds.set(key, { at_s, count: colours.length / 3, least: had.min_m, size: had.size_m, places: buffer(places), colours: buffer(colours) });
  }
  const keys = new Set(story.looks.map(l => l.key));
  for (const [key, cloud] of clouds) {
    if (keys.has(key)) continue;
    gl.deleteBuffer(cloud.places); gl.deleteBuffer(cloud.colours); clouds.delete(key);
  }
  redraw();
}
function lookAt(at) {
  const shown = latest(story.beliefs, at)?.objects ?? [];
  const asked = shown.filter(o => o.name);
  const focus = asked.length ? asked : shown;
  const areas = story.map.surfaces.map(s => [...[0, 1].map(k => s.outline_m.reduce((sum, p) => sum + p[k], 0) / s.outline_m.length), s.height_m]);
  const spots = focus.length ? focus.map(o => o.position_m) : areas;
  if (!spots.length) return;
  view.centre = [0, 1, 2].map(k => spots.reduce((sum, p) => sum + p[k], 0) / spots.length);
  const reach = Math.max(...spots.map(p => Math.hypot(...p.map((v, k) => v - view.centre[k]))));
  view.far = Math.max(1.3, 2.2 * reach);
}
function matrix(wide, high) {
  const [sy, cy, sp, cp] = [Math.sin(view.yaw), Math.cos(view.yaw), Math.sin(view.pitch), Math.cos(view.pitch)];
  const right = [-sy, cy, 0], up = [-cy * sp, -sy * sp, cp], back = [cy * cp, sy * cp, sp];
  const eye = view.centre.map((v, k) => v + back[k] * view.far);
  const along = axis => -(axis[0] * eye[0] + axis[1] * eye[1] + axis[2] * eye[2]);
  const near = .05, end = 40, f = 1.6, a = f * high / wide, z = (end + near) / (near - end), w = 2 * end * near / (near - end);
  const rows = [[...right, along(right)].map(v => v * a), [...up, along(up)].map(v => v * f), [...back, along(back)].map((v, k) => v * z + (k === 3 ? w : 0)), [...back, along(back)].map(v => -v)];
  return Float32Array.from([0, 1, 2, 3].flatMap(c => rows.map(r => r[c])));
}
// How many points are drawn while the picture turns: as many as come 30 times a second here, by how long the picture before took.
let most = 60000, before_ms = 0;
function affordable() {
  const now_ms = performance.now(), took_ms = now_ms - before_ms;
  before_ms = now_ms;
  // A hand that rests is no slow picture.
  if (took_ms < 250) most = took_ms > 36 ? Math.max(6000, most * .8) : took_ms < 24 ? Math.min(400000, most * 1.1) : most;
  return most;
}
function spaceOf(at) {
  const canvas = $("cloud"), labels = $("labels"), scale = window.devicePixelRatio || 1;
  const wide = Math.round(canvas.clientWidth * scale), high = Math.round(canvas.clientHeight * scale);
  for (const c of [canvas, labels]) if (c.width !== wide || c.height !== high) { c.width = wide; c.height = high; }
  const seen = matrix(wide, high);
  if (gl) {
    gl.viewport(0, 0, wide, high);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(inputs.seen, false, seen);
    gl.uniform1f(inputs.dot, .009 * high * 1.6 / 2 * 1.3);
    const shown = [...clouds.values()].filter(c => c.at_s <= at + 1e-6);
    const share = turning ? Math.min(1, affordable() / shown.reduce((sum, c) => sum + c.count, 1)) : 1;
    for (const cloud of shown) {
      gl.uniform3fv(inputs.least, cloud.least);
      gl.uniform3fv(inputs.size, cloud.size);
      for (const [name, data, kind] of [["place", cloud.places, gl.UNSIGNED_SHORT], ["colour", cloud.colours, gl.UNSIGNED_BYTE]]) {
        gl.bindBuffer(gl.ARRAY_BUFFER, data);
        gl.vertexAttribPointer(inputs[name], 3, kind, true, 0, 0);
      }
      gl.drawArrays(gl.POINTS, 0, Math.ceil(cloud.count * share));
    }
  }
  drawLabels(labels.getContext("2d"), seen, wide, high, scale, at);
}
function drawLabels(paper, seen, wide, high, scale, at) {
  paper.clearRect(0, 0, wide, high);
  const style = getComputedStyle(document.documentElement), colour = name => style.getPropertyValue(name);
  const onto = p => {
    const [x, y, , w] = [0, 1, 2, 3].map(r => [...p, 1].reduce((sum, v, c) => sum + seen[c * 4 + r] * v, 0));
    return w > .05 ? [(x / w + 1) / 2 * wide, (1 - y / w) / 2 * high] : null;
  };
  paper.font = `${12 * scale}px system-ui, sans-serif`;
  paper.textAlign = "center";
  if (!gl) { paper.fillStyle = colour("--faint"); paper.fillText("this browser draws no WebGL: the boxes alone are shown", wide / 2, 20 * scale); }
  const named = [];
  for (const o of latest(story.beliefs, at)?.objects ?? []) {
    const tint = colour(o.name ? "--known" : "--unknown"), h = o.size_m[2];
    const foot = o.footprint_m.length > 2 ? o.footprint_m : [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => [o.position_m[0] + a * o.size_m[0] / 2, o.position_m[1] + b * o.size_m[1] / 2, o.position_m[2]]);
    const rings = [0, h].map(up => foot.map(p => onto([p[0], p[1], p[2] + up])));
    if (rings.flat().some(p => !p)) continue;
    paper.strokeStyle = tint; paper.lineWidth = 1.2 * scale;
    for (const ring of rings) { paper.beginPath(); ring.forEach((p, n) => n ? paper.lineTo(...p) : paper.moveTo(...p)); paper.closePath(); paper.stroke(); }
    const top = onto([o.position_m[0], o.position_m[1], o.position_m[2] + h + .03]);
    if (!top || !o.name) continue;
    const text = `${o.name} ${o.probability.toFixed(2)}`, half = paper.measureText(text).width / 2 + 4 * scale;
    named.push({ x: top[0], y: top[1], half, text, tint });
  }
  // Names that would cover each other make room upwards, the lowest stays.
  const set = [], high_px = 17 * scale;
  for (const n of named.sort((a, b) => b.y - a.y)) {
    for (let other; (other = set.find(o => Math.abs(o.x - n.x) < o.half + n.half && Math.abs(o.y - n.y) < high_px)); ) n.y = other.y - high_px;
    set.push(n);
    paper.fillStyle = colour("--ground"); paper.globalAlpha = .8; paper.fillRect(n.x - n.half, n.y - 13 * scale, 2 * n.half, high_px); paper.globalAlpha = 1;
    paper.fillStyle = n.tint; paper.fillText(n.text, n.x, n.y);
  }
}

// What was said, the verdict last, and the moment that all parts show.
const moments = () => story.report ? [...story.moments, { at_s: story.ends_s, what: "verdict", head: "verdict", text: `${inWords(story.report)}: ${story.report.why}` }] : story.moments;
function said() {
  $("said").replaceChildren(...moments().map(moment => {
    const item = document.createElement("li"), time = document.createElement("time"), text = document.createElement("pre");
    item.className = moment.what;
    time.textContent = seconds(moment.at_s);
    const what = document.createElement("b");
    what.textContent = moment.head;
    text.textContent = moment.text;
    item.append(time, what, text);
    item.addEventListener("click", () => go(moment.at_s));
    return item;
  }));
}
let at = Infinity, drawn = false;
function go(s) {
  if (!story) return;
  at = Math.min(Math.max(s, 0), story.ends_s);
  $("time").value = at;
  $("now").textContent = seconds(at);
  const items = [...$("said").children];
  const current = moments().findLastIndex(m => m.at_s <= at + 1e-6);
  items.forEach((item, n) => item.classList.toggle("now", n === current));
  if (current >= 0) $("said").scrollTop = items[current].offsetTop - $("said").offsetTop - 60;
  mapOf(at); planOf(at); sureOf(at); redraw();
}
function redraw() {
  if (drawn) return;
  drawn = true;
  requestAnimationFrame(() => { drawn = false; spaceOf(at); });
}
const times = () => [...new Set([0, ...story.moments.map(m => m.at_s), ...story.looks.map(l => l.at_s), story.ends_s])].sort((a, b) => a - b);
let playing = null;
function play() {
  if (playing) { clearInterval(playing); playing = null; return; }
  if (at >= story.ends_s) go(0);
  playing = setInterval(() => { go(at + story.ends_s / 200); if (at >= story.ends_s) { clearInterval(playing); playing = null; } }, 50);
}
function hands() {
  $("time").addEventListener("input", e => go(+e.target.value));
  $("back").addEventListener("click", () => go(times().findLast(t => t < at - 1e-6) ?? 0));
  $("on").addEventListener("click", () => go(times().find(t => t > at + 1e-6) ?? story.ends_s));
  $("play").addEventListener("click", play);
  const canvas = $("cloud"), fingers = new Map();
  canvas.addEventListener("pointerdown", e => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); });
  for (const gone of ["pointerup", "pointercancel"]) canvas.addEventListener(gone, e => { fingers.delete(e.pointerId); turning = fingers.size > 0; redraw(); });
  canvas.addEventListener("pointermove", e => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    turning = turned = true;
    const was = fingers.size === 2 ? apart() : 0;
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    if (fingers.size === 2) view.far *= was / Math.max(apart(), 1);
    else { view.yaw -= (e.clientX - before[0]) * .008; view.pitch = Math.min(1.55, Math.max(-.3, view.pitch + (e.clientY - before[1]) * .008)); }
    redraw();
  });
  canvas.addEventListener("wheel", e => { e.preventDefault(); turned = true; view.far = Math.min(20, Math.max(.3, view.far * Math.exp(e.deltaY * .001))); redraw(); }, { passive: false });
  addEventListener("resize", () => go(at));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => go(at));
}

// All of it, told anew: who looked at the end looks at the new end.
function tell(next) {
  const follows = !story || (at >= story.ends_s - 1e-6 && !playing);
  story = next;
  document.title = `descry: ${story.goal}`;
  head(); said();
  $("time").max = story.ends_s;
  if (follows && !turned) lookAt(story.ends_s);
  go(follows ? story.ends_s : at);
  return fillSpace();
}

// While the run goes on: told anew whenever there are news.
async function fetched(path) {
  try { const answer = await fetch(path); return answer.ok ? await answer.json() : null; } catch { return null; }
}
let filled = null;
async function tellNews(ended) {
  over = ended;
  const next = await fetched("story");
  if (next) filled = tell(next);
  return next !== null;
}
beginSpace(); hands();
// The page has loaded before it waits for news.
if (live) addEventListener("load", () => follow(tellNews, () => filled)); else tell(story);
