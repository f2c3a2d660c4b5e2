// Plays `film`, which page.py puts before this; all distances on the screen are in CSS pixels.

const TEAMS = ["blue", "red"], CARRIES = 1, IS_TAGGED = 2, CAN_TAG = 4, SPEEDS = [0.5, 1, 2, 4, 8, 16], WAKE_S = 15;
const byId = id => document.getElementById(id);
const make = (tag, parent, text) => {
  const node = parent.appendChild(document.createElement(tag));
  if (text !== undefined) node.textContent = text;
  return node;
};
const V = film.names.length, last = film.frames - 1;
const total = (steps, width) => {  // each frame holds what it adds to the one before
  for (let i = width; i < steps.length; i++) steps[i] += steps[i - width];
  return steps;
};
const pos = total(film.pos, 2 * V), heading = total(film.heading, V), status = total(film.status, V);
const waited = total(film.waited, V), score = total(film.score, 6);
const numberOf = v => v - film.teams.indexOf(film.teams[v]);
const clock = seconds => {
  const whole = Math.floor(seconds + 1e-6);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
};

// What does not change

document.title = byId("title").textContent = film.title;
const chips = [];
TEAMS.forEach((name, team) => byId(name).classList.add(name === film.right ? "right" : "left"));
film.names.forEach((name, v) => {
  const item = make("li", byId(TEAMS[film.teams[v]]).querySelector("ul"));
  make("b", item, numberOf(v));
  make("span", item, name);
  chips.push(make("i", item, ""));
});
const items = film.events.map(([at, team, kind, words]) => {
  const button = make("button", make("li", byId("events")));
  make("time", button, clock(at * film.step));
  make("span", button, words).style.borderColor = `var(--${TEAMS[team]})`;
  button.dataset.frame = at;
  button.dataset.kind = kind;
  button.addEventListener("click", () => show(at));
  const mark = make("span", byId("marks"));
  mark.style.left = `${100 * at / Math.max(last, 1)}%`;
  mark.style.background = `var(--${TEAMS[team]})`;
  return button;
});
if (!items.length) make("li", byId("events"), "Nothing happened.").className = "hint";
SPEEDS.forEach(speed => make("option", byId("speed"), `${speed}×`).value = speed);

// What is shown: a frame, whole or between two

let at = 0, playing = false, speed = 8, tick = 0, coming = 0, colors = {};

function show(frame) {
  at = Math.min(Math.max(frame, 0), last);
  const now = Math.floor(at + 1e-9);
  byId("clock").textContent = clock(at * film.step);
  byId("scrub").value = at;
  byId("scrub").setAttribute("aria-valuetext", clock(at * film.step));
  TEAMS.forEach((name, team) => {
    const [captures, tags, grabs] = score.slice(6 * now + 3 * team, 6 * now + 3 * team + 3);
    byId(name).querySelector(".captures").textContent = captures;
    byId(name).querySelector("p").textContent = `grabs ${grabs} · tags ${tags}`;
  });
  byId("result").textContent = now === last && film.result ? film.result : `of ${clock(film.limit)}`;
  chips.forEach((chip, v) => {
    const is = status[now * V + v];
    chip.textContent = is & IS_TAGGED ? "✕ tagged" : is & CARRIES ? "⚑ flag" : "";
  });
  const current = items.findLastIndex(item => +item.dataset.frame <= now);
  items.forEach((item, k) => {
    item.classList.toggle("ahead", k > current);
    if (k !== current) return item.removeAttribute("aria-current");
    if (item.hasAttribute("aria-current")) return;
    item.setAttribute("aria-current", "true");
    const list = byId("events"), above = item.offsetTop - list.scrollTop;
    if (above < 0 || above > list.clientHeight - 40) list.scrollTop = item.offsetTop - list.clientHeight / 2;
  });
  document.body.dataset.frame = now;
  draw();
}

function play(on) {
  playing = on;
  if (on && at >= last) show(0);
  byId("play").setAttribute("aria-label", on ? "Pause" : "Play");
  byId("play").querySelector("path").setAttribute("d", on ? "M2 1h4v12H2zM8 1h4v12H8z" : "M2 1l11 6-11 6z");
  document.body.dataset.playing = on;
  tick = performance.now();
  cancelAnimationFrame(coming);
  if (on) coming = requestAnimationFrame(next);
}

function next(now) {
  const passed = Math.min(Math.max(now - tick, 0), 250);  // ms; a page that was hidden does not leap
  show(at + passed / 1000 * speed / film.step);
  tick = now;
  if (at >= last) play(false); else coming = requestAnimationFrame(next);
}

function setSpeed(value) {
  speed = SPEEDS.reduce((best, x) => Math.abs(x - value) < Math.abs(best - value) ? x : best);
  byId("speed").value = speed;
}

// The picture

const canvas = byId("field"), pen = canvas.getContext("2d");
let scale = 1, hull = 10, wide = 0, high = 0;

function lay() {
  const margin = 10, ratio = window.devicePixelRatio || 1;
  wide = canvas.parentElement.clientWidth;
  scale = Math.min((wide - 2 * margin) / film.field[0], Math.max(200, 0.74 * innerHeight) / film.field[1]);
  high = scale * film.field[1] + 2 * margin;
  hull = Math.max(0.019 * scale * film.field[0], 10);
  canvas.width = Math.round(wide * ratio);
  canvas.height = Math.round(high * ratio);
  canvas.style.height = `${high}px`;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  const style = getComputedStyle(document.documentElement);
  for (const name of ["blue", "red", "blue-water", "red-water", "grid", "shore", "keepout", "tagged", "rim", "pole"])
    colors[name] = style.getPropertyValue(`--${name}`).trim();
  show(at);
}

const point = (x, y) => [wide / 2 + scale * (x - film.field[0] / 2), high / 2 - scale * (y - film.field[1] / 2)];

function line(points, color, width, alpha = 1) {
  pen.globalAlpha = alpha;
  pen.strokeStyle = color;
  pen.lineWidth = width;
  pen.beginPath();
  points.forEach(([x, y], k) => k ? pen.lineTo(x, y) : pen.moveTo(x, y));
  pen.stroke();
  pen.globalAlpha = 1;
}

function disc([x, y], radius, fill, alpha, edge, edgeAlpha, width) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) { pen.globalAlpha = alpha; pen.fillStyle = fill; pen.fill(); }
  if (edge) { pen.globalAlpha = edgeAlpha; pen.strokeStyle = edge; pen.lineWidth = width; pen.stroke(); }
  pen.globalAlpha = 1;
}

function flag([x, y], team, tall) {
  pen.beginPath();
  pen.moveTo(x, y - tall);
  pen.lineTo(x + 0.75 * tall, y - 0.72 * tall);
  pen.lineTo(x, y - 0.44 * tall);
  pen.closePath();
  pen.fillStyle = colors[TEAMS[team]];
  pen.fill();
  line([[x, y], [x, y - tall]], colors.pole, 0.09 * tall);
}

function water() {
  const [w, h] = film.field;
  TEAMS.forEach(name => {
    const [x, y] = point(name === film.right ? w / 2 : 0, h);
    pen.fillStyle = colors[`${name}-water`];
    pen.fillRect(x, y, scale * w / 2, scale * h);
  });
  for (let x = w / 10; x < 0.99 * w; x += w / 10) line([point(x, 0), point(x, h)], colors.grid, 1);
  for (let y = w / 10; y < 0.99 * h; y += w / 10) line([point(0, y), point(w, y)], colors.grid, 1);
  line([point(w / 2, 0), point(w / 2, h)], colors.shore, 1.5, 0.7);
  film.homes.forEach(([x, y], team) => {
    disc(point(x, y), scale * film.keepout, colors.keepout, 1, colors[TEAMS[team]], 0.6, 1);
    disc(point(x, y), 2.5, colors[TEAMS[team]], 1);
  });
  line([point(0, 0), point(w, 0), point(w, h), point(0, h), point(0, 0), point(w, 0)], colors.shore, 2.5);
}

function placed(v, t) {
  const now = Math.min(Math.floor(t + 1e-9), last), then = Math.min(now + 1, last), share = t - now;
  const mix = (values, i, j) => values[i] + share * (values[j] - values[i]);
  const i = now * V + v, j = then * V + v;
  const turn = ((heading[j] - heading[i]) % 360 + 540) % 360 - 180;
  return {
    place: point(mix(pos, 2 * i, 2 * j) / 100, mix(pos, 2 * i + 1, 2 * j + 1) / 100),
    course: (heading[i] + share * turn) * Math.PI / 180,
    is: status[i],
    waited: waited[i] / 100,
  };
}

function vehicle(v, { place: [x, y], course, is }) {
  const team = film.teams[v], color = colors[TEAMS[team]], tagged = is & IS_TAGGED;
  pen.save();
  pen.translate(x, y);
  pen.rotate(course);
  pen.beginPath();
  pen.moveTo(0, -hull);
  pen.bezierCurveTo(0.36 * hull, -0.6 * hull, 0.46 * hull, -0.2 * hull, 0.46 * hull, 0.05 * hull);
  pen.lineTo(0.42 * hull, 0.72 * hull);
  pen.quadraticCurveTo(0.38 * hull, 0.9 * hull, 0.16 * hull, 0.9 * hull);
  pen.lineTo(-0.16 * hull, 0.9 * hull);
  pen.quadraticCurveTo(-0.38 * hull, 0.9 * hull, -0.42 * hull, 0.72 * hull);
  pen.lineTo(-0.46 * hull, 0.05 * hull);
  pen.bezierCurveTo(-0.46 * hull, -0.2 * hull, -0.36 * hull, -0.6 * hull, 0, -hull);
  pen.fillStyle = tagged ? colors.tagged : color;
  pen.fill();
  pen.strokeStyle = tagged ? color : colors.rim;
  pen.lineWidth = 0.12 * hull;
  pen.stroke();
  pen.restore();
  const middle = [x - 0.12 * hull * Math.sin(course), y + 0.12 * hull * Math.cos(course)], number = String(numberOf(v));
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  if (tagged) {
    for (const slope of [-1, 1])
      line([-1, 1].map(way => [middle[0] + way * 0.33 * hull, middle[1] + way * slope * 0.33 * hull]), colors.rim, 0.19 * hull);
    pen.fillStyle = color;
    pen.font = `600 ${0.75 * hull}px system-ui, sans-serif`;
    pen.fillText(number, x + 0.85 * hull, y - 0.85 * hull);
  } else {
    pen.fillStyle = colors.rim;
    pen.font = `600 ${(number.length > 1 ? 0.68 : 0.85) * hull}px system-ui, sans-serif`;
    pen.fillText(number, middle[0], middle[1] + 0.05 * hull);
  }
  if (is & CARRIES) {
    disc([x, y], 1.25 * hull, null, 0, colors[TEAMS[1 - team]], 1, 0.16 * hull);
    flag([x + 0.8 * hull, y - 0.8 * hull], 1 - team, 1.2 * hull);
  }
}

function draw() {
  pen.clearRect(0, 0, wide, high);
  pen.lineJoin = "round";
  water();
  const everyone = film.names.map((_, v) => placed(v, at));
  everyone.forEach(({ place, is, waited }, v) => {
    const color = colors[TEAMS[film.teams[v]]];
    if (is & CAN_TAG) disc(place, scale * film.reach, color, 0.1, color, 0.4, 1);
    if (waited < 1) {
      pen.globalAlpha = 0.6;
      pen.strokeStyle = color;
      pen.lineWidth = 0.12 * hull;
      pen.beginPath();
      pen.arc(place[0], place[1], 1.35 * hull, -Math.PI / 2, (2 * waited - 0.5) * Math.PI);
      pen.stroke();
      pen.globalAlpha = 1;
    }
  });
  const wake = Math.min(WAKE_S / film.step, at), pieces = 15;
  for (let v = 0; v < V && wake > 0; v++)
    for (let k = 0; k < pieces; k++)
      line([k, k + 1].map(n => placed(v, at - wake * (1 - n / pieces)).place), colors[TEAMS[film.teams[v]]], 0.15 * hull, 0.6 * k / pieces);
  film.homes.forEach(([x, y], team) => {
    if (!everyone.some(({ is }, v) => is & CARRIES && film.teams[v] !== team)) flag(point(x, y), team, 1.3 * hull);
  });
  everyone.forEach((state, v) => vehicle(v, state));
}

// What the user does

const steps = seconds => Math.max(1, Math.round(seconds / film.step));
const KEYS = {
  " ": () => play(!playing),
  ArrowLeft: event => show(Math.ceil(at - 1e-9) - (event.shiftKey ? steps(10) : 1)),
  ArrowRight: event => show(Math.floor(at + 1e-9) + (event.shiftKey ? steps(10) : 1)),
  ArrowUp: () => setSpeed(speed * 2),
  ArrowDown: () => setSpeed(speed / 2),
  Home: () => show(0),
  End: () => show(last),
};
addEventListener("keydown", event => {
  const own = event.target.tagName === "SELECT" || (event.target.tagName === "BUTTON" && event.key === " ");
  if (own || event.ctrlKey || event.metaKey || event.altKey || !(event.key in KEYS)) return;
  event.preventDefault();
  KEYS[event.key](event);
});
byId("play").addEventListener("click", () => play(!playing));
byId("back").addEventListener("click", () => KEYS.ArrowLeft({}));
byId("on").addEventListener("click", () => KEYS.ArrowRight({}));
byId("scrub").addEventListener("input", event => show(+event.target.value));
byId("speed").addEventListener("change", event => setSpeed(+event.target.value));
addEventListener("click", event => event.detail && document.activeElement.blur());  // so that Space plays after a click
addEventListener("resize", lay);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", lay);

function follow() {
  const asked = new URLSearchParams(location.hash.slice(1));
  if (Number.isFinite(parseFloat(asked.get("speed")))) setSpeed(parseFloat(asked.get("speed")));
  if (Number.isFinite(parseFloat(asked.get("t")))) show(Math.round(parseFloat(asked.get("t")) / film.step));
  if (asked.has("play")) play(true);
}
addEventListener("hashchange", follow);

byId("scrub").max = last;
setSpeed(speed);
play(false);
lay();
follow();
