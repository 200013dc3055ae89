// The plot of a study: a point for each job that the table shows, by any two columns, coloured by a third.
"use strict";
(() => {
if (!study || !document.getElementById("plot-form")) return;
const { columns, byName, parameters, places, cell, write, pages, state, keep, choose, rows, listen } = study;
const form = document.getElementById("plot-form"), canvas = document.getElementById("plot-canvas"), pen = canvas.getContext("2d");
const readout = document.getElementById("plot-readout"), legend = document.getElementById("plot-legend");
const drawable = columns.filter(column => column.values || column.texts.length <= 200);
const numbers = columns.filter(column => column.values && !parameters.includes(column.name) && column.name !== "seconds");
if (!pen) return;
for (const part of [form, canvas.parentElement, readout]) part.hidden = false;
const RAMP = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b"];
const RAMP_DARK = [...RAMP.slice(3), "#fde725"];
const HUES = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f", "#a6761d"];
const dark = matchMedia("(prefers-color-scheme: dark)"), REACH = 14; // px
const empty = readout.textContent;
let points = [], under = -1;

// ---------- choices ----------
const varies = column => column.values ? new Set(column.values.filter(x => x !== null)).size > 1 : column.texts.length > 2;
const start = { x: drawable.find(c => parameters.includes(c.name) && varies(c)) ?? numbers.find(varies) ?? drawable.find(c => c.values),
  y: numbers.find(c => varies(c)) ?? drawable.find(c => c.values) };
start.colour = drawable.find(c => parameters.includes(c.name) && varies(c) && c !== start.x);
if (start.y === start.x) start.y = numbers.filter(varies)[1] ?? start.y;
for (const name of ["x", "y", "colour"]) {
  const select = form.elements[name];
  if (name === "colour") select.append(new Option("none", ""));
  for (const column of drawable) select.append(new Option(column.name, column.name));
  const wanted = state.plot[name] ?? start[name]?.name ?? "";
  select.value = byName.has(wanted) ? wanted : "";
  if (!select.value && name !== "colour") select.selectedIndex = 0;
}
for (const name of ["logx", "logy"]) form.elements[name].checked = Boolean(state.plot[name]);
form.addEventListener("submit", event => event.preventDefault());
form.addEventListener("change", () => {
  for (const name of ["x", "y", "colour"]) state.plot[name] = form.elements[name].value;
  for (const name of ["logx", "logy"]) state.plot[name] = form.elements[name].checked;
  keep(); draw();
});

// ---------- axes ----------
function axis(column, log, some) {
  if (!column.values) {
    const order = places(column), used = [...new Set(some.map(row => column.index[row]))].filter(Boolean).sort((a, b) => order[a] - order[b]);
    const at = new Map(used.map((index, k) => [index, k]));
    const each = Math.max(1, Math.ceil(used.length / 12));
    return { of: row => at.has(column.index[row]) ? (at.get(column.index[row]) + 0.5) / used.length : NaN,
      ticks: used.map((index, k) => [(k + 0.5) / used.length, column.texts[index]]).filter((tick, k) => k % each === 0) };
  }
  const fine = x => x !== null && (!log || x > 0), map = x => log ? Math.log10(x) : x;
  let low = Infinity, high = -Infinity;
  for (const row of some) { const x = column.values[row]; if (fine(x)) { low = Math.min(low, map(x)); high = Math.max(high, map(x)); } }
  if (!(high >= low)) return { of: () => NaN, ticks: [] };
  const room = 0.04 * (high - low) || 0.05 * Math.abs(high) || 1;
  low -= room; high += room;
  return { of: row => fine(column.values[row]) ? (map(column.values[row]) - low) / (high - low) : NaN,
    ticks: (levels(column, some) ?? (log ? powers(low, high) : steps(low, high))).map(x => [(map(x) - low) / (high - low), write(x, 4)]) };
}
function levels(column, some) { // of a parameter with few values
  const found = parameters.includes(column.name) ? new Set(some.map(row => column.values[row])) : [];
  return found.size > 1 && found.size <= 8 ? [...found].filter(x => x !== null).sort((a, b) => a - b) : null;
}
function steps(low, high, most = 8) {
  const rough = (high - low) / most, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map(k => k * power).find(size => size >= rough), found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(Number((k * step).toPrecision(12)));
  return found;
}
function powers(low, high) {
  const found = [], each = high - low > 3 ? [1] : high - low > 1 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9];
  for (let k = Math.floor(low); k <= high; k++) for (const head of each) {
    const x = Math.log10(head) + k;
    if (x >= low && x <= high) found.push(head * 10 ** k);
  }
  const skip = Math.ceil(found.length / 8);
  return found.length > 1 ? found.filter((x, k) => k % skip === 0) : steps(10 ** low, 10 ** high);
}

// ---------- colours ----------
const mixed = (ramp, share) => {
  const at = Math.min(Math.max(share, 0), 1) * (ramp.length - 1), k = Math.min(Math.floor(at), ramp.length - 2), part = at - k;
  const [a, b] = [ramp[k], ramp[k + 1]].map(hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16)));
  return `rgb(${a.map((x, i) => Math.round(x + part * (b[i] - x))).join(" ")})`;
};
function colours(column, some) {
  const plain = getComputedStyle(document.documentElement).getPropertyValue("--accent").trim();
  legend.replaceChildren();
  if (!column) return () => plain;
  const say = (...parts) => { const span = document.createElement("span"); span.append(...parts); legend.append(span); };
  const swatch = background => { const i = document.createElement("i"); i.style.background = background; return i; };
  if (column.values) {
    const known = some.map(row => column.values[row]).filter(x => x !== null), ramp = dark.matches ? RAMP_DARK : RAMP;
    const low = known.reduce((a, b) => Math.min(a, b), Infinity), high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    if (!known.length) return () => plain;
    const band = swatch(`linear-gradient(90deg, ${ramp.join(", ")})`); band.className = "ramp";
    say(`${column.name}: ${write(low)}`, band, write(high));
    const shades = Array.from({ length: 65 }, (_, k) => mixed(ramp, k / 64));
    return row => column.values[row] === null ? "#7f7f7f" : shades[Math.round(64 * (high > low ? (column.values[row] - low) / (high - low) : 0.5))];
  }
  const many = new Map();
  for (const row of some) many.set(column.index[row], (many.get(column.index[row]) ?? 0) + 1);
  const used = [...many.keys()].sort((a, b) => many.get(b) - many.get(a)), hue = new Map(used.map((index, k) => [index, HUES[Math.min(k, 6)]]));
  const label = document.createElement("b"); label.textContent = `${column.name}:`; legend.append(label);
  used.slice(0, 6).forEach(index => say(swatch(hue.get(index)), column.texts[index] || "empty"));
  if (used.length > 6) say(swatch(HUES[6]), used.length === 7 ? column.texts[used[6]] || "empty" : `${used.length - 6} others`);
  return row => hue.get(column.index[row]);
}

// ---------- drawing ----------
function draw() {
  const [xName, yName] = [form.elements.x.value, form.elements.y.value], [X, Y] = [byName.get(xName), byName.get(yName)];
  const some = rows(), colour = colours(byName.get(form.elements.colour.value), some), style = getComputedStyle(document.documentElement);
  const [ink, line] = ["--ink", "--line"].map(name => style.getPropertyValue(name).trim());
  form.elements.logx.disabled = !X.values; form.elements.logy.disabled = !Y.values;
  const across = axis(X, form.elements.logx.checked && X.values, some), up = axis(Y, form.elements.logy.checked && Y.values, some);
  const ratio = devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  canvas.width = wide * ratio; canvas.height = high * ratio;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, wide, high);
  pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
  const short = text => text.length > 18 ? `${text.slice(0, 17)}…` : text;
  const left = 30 + Math.max(20, ...up.ticks.map(tick => pen.measureText(short(tick[1])).width)), box = { left, right: wide - 16, top: 14, bottom: high - 46 };
  const px = share => box.left + share * (box.right - box.left), py = share => box.bottom - share * (box.bottom - box.top);
  pen.strokeStyle = line; pen.fillStyle = ink; pen.lineWidth = 1;
  pen.textAlign = "center";
  let free = -Infinity;
  for (const [share, text] of across.ticks) {
    const x = Math.round(px(share)) + 0.5, half = pen.measureText(short(text)).width / 2;
    pen.beginPath(); pen.moveTo(x, box.top); pen.lineTo(x, box.bottom); pen.stroke();
    if (x - half > free) { pen.fillText(short(text), Math.min(x, wide - half - 2), box.bottom + 17); free = x + half + 6; }
  }
  pen.fillText(xName, (box.left + box.right) / 2, high - 9);
  pen.textAlign = "right";
  for (const [share, text] of up.ticks) {
    const y = Math.round(py(share)) + 0.5;
    pen.beginPath(); pen.moveTo(box.left, y); pen.lineTo(box.right, y); pen.stroke();
    pen.fillText(short(text), box.left - 6, y + 4);
  }
  pen.save(); pen.translate(13, (box.top + box.bottom) / 2); pen.rotate(-Math.PI / 2); pen.textAlign = "center"; pen.fillText(yName, 0, 0); pen.restore();
  points = some.map(row => ({ row, x: px(across.of(row)), y: py(up.of(row)) })).filter(point => point.x === point.x && point.y === point.y);
  const size = points.length > 2000 ? 2.5 : points.length > 300 ? 3 : 4.5;
  pen.globalAlpha = points.length > 2000 ? 0.6 : 0.85;
  for (const point of points) { pen.fillStyle = colour(point.row); pen.beginPath(); pen.arc(point.x, point.y, size, 0, 7); pen.fill(); }
  pen.globalAlpha = 1;
  points.sort((a, b) => a.x - b.x || a.y - b.y);
  if (under >= 0) ring(points.find(point => point.row === under), ink);
  document.getElementById("plot-count").textContent = `${points.length} of ${some.length} jobs drawn`;
  canvas.setAttribute("aria-label", `Plot of ${yName} against ${xName} for ${points.length} jobs`);
}
function ring(point, ink) {
  if (!point) return;
  pen.strokeStyle = ink; pen.lineWidth = 2; pen.beginPath(); pen.arc(point.x, point.y, 7, 0, 7); pen.stroke();
}
function tell(point) {
  if ((point?.row ?? -1) === under) return;
  under = point?.row ?? -1;
  draw();
  if (!point) { readout.textContent = empty; return; }
  const names = ["x", "y", "colour"].map(name => form.elements[name].value).filter(Boolean);
  const said = [...new Set([...parameters, ...names])].map(name => `${name} = ${write(cell(byName.get(name), under)) || "none"}`);
  const job = document.createElement("b"); job.textContent = cell(byName.get("job"), under);
  const links = pages(under).flatMap(([word, href]) => [" ", Object.assign(document.createElement("a"), { href, textContent: word })]);
  readout.replaceChildren(job, `: ${said.join(", ")}`, ...links);
}
function nearest(event) {
  const box = canvas.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top;
  let best = null, least = REACH ** 2;
  for (const point of points) { const d = (point.x - x) ** 2 + (point.y - y) ** 2; if (d < least) [best, least] = [point, d]; }
  return best;
}
let waiting = false;
canvas.addEventListener("pointermove", event => {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => { waiting = false; const point = nearest(event); if (point) tell(point); });
});
canvas.addEventListener("click", event => { const point = nearest(event); tell(point); if (point) choose(point.row); });
canvas.addEventListener("keydown", event => {
  const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key], at = points.findIndex(point => point.row === under);
  if (step && points.length) { event.preventDefault(); tell(points[(at + step + points.length) % points.length]); }
  if (event.key === "Enter" && under >= 0) choose(under);
});
draw();
new ResizeObserver(() => { if (canvas.width !== Math.floor(canvas.clientWidth * (devicePixelRatio || 1))) draw(); }).observe(canvas.parentElement);
dark.addEventListener("change", draw);
listen(() => { under = -1; readout.textContent = empty; draw(); });
})();
