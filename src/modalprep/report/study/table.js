// The table of a study: sorting, filters, choice of columns; only the rows in sight are in the page.
"use strict";
const study = (() => {
const place = document.getElementById("study-data");
if (!place) return null;
const data = JSON.parse(place.textContent), { columns, folders, parameters } = data;
const byName = new Map(columns.map(column => [column.name, column])), count = folders.length;
const table = document.getElementById("study-table"), frame = document.getElementById("study-frame");
const form = document.getElementById("study-form"), boxes = document.getElementById("study-columns");
const ROW = 28, MARGIN = 12, PRINTED = 1000, WIDEST = 34; // px, rows, rows, characters
const SUFFIX = { body: ".html", run: "-run.html", log: ".log" };

// ---------- values ----------
const cell = (column, row) => column.values ? column.values[row] : column.texts[column.index[row]];
const POWERS = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
function write(value, digits = 5) {
  if (value === null || value === "") return "";
  if (typeof value === "string") return value;
  const size = Math.abs(value);
  if (size === 0 || (size >= 1e-4 && size < 1e7)) return String(Number(value.toPrecision(size >= 10 ** digits ? 8 : digits)));
  const [base, power] = value.toExponential(digits - 1).split("e").map(Number);
  return `${base === 1 ? "" : `${base} × `}10${[...String(power)].map(sign => POWERS[sign]).join("")}`;
}
const pages = row => cell(data.pages, row).split(" ").filter(Boolean).map(word => {
  return [word, `${folders[row]}/${folders[row].split("/").pop()}${SUFFIX[word]}`];
});

// ---------- what is chosen, also in the address, so that a reload keeps it ----------
const state = { sort: null, up: true, words: "", filters: {}, group: null, shown: data.shown, plot: {} };
let kept = {};
try { kept = JSON.parse(decodeURIComponent(location.hash.slice(1))) ?? {}; } catch { /* an anchor of the page */ }
for (const key of Object.keys(state))
  if (state[key] === null || (typeof kept[key] === typeof state[key] && Array.isArray(kept[key]) === Array.isArray(state[key])))
    state[key] = kept[key] ?? state[key];
state.shown = state.shown.filter(name => byName.has(name));
const keep = () => history.replaceState(null, "", `#${encodeURIComponent(JSON.stringify(state))}`);

// ---------- filters ----------
const NUMBER = String.raw`[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?`;
const TERM = new RegExp(`^(?:(>=|<=|!=|>|<|=)?(${NUMBER})|(${NUMBER})\\.\\.(${NUMBER}))$`);
const COMPARE = { ">": (a, b) => a > b, "<": (a, b) => a < b, ">=": (a, b) => a >= b, "<=": (a, b) => a <= b, "!=": (a, b) => a !== b };
const near = (a, b) => Math.abs(a - b) <= 1e-6 * Math.abs(b);
function numeric(text) { // a test of numbers, or null where the text is none
  const tests = [];
  for (const term of text.replace(/([<>=!])\s+/g, "$1").split(/[\s,;&]+/).filter(Boolean)) {
    const found = TERM.exec(term);
    if (!found) return null;
    const [, sign, value, low, high] = found;
    if (low !== undefined) tests.push(x => x >= Number(low) && x <= Number(high));
    else if (sign && sign !== "=" ) tests.push(x => COMPARE[sign](x, Number(value)));
    else tests.push(x => near(x, Number(value)));
  }
  return x => x !== null && tests.every(test => test(x));
}
function textual(text) {
  const wanted = text.toLowerCase(), rest = wanted.slice(1).trim();
  if (wanted.startsWith("=")) return x => x.toLowerCase() === rest;
  if (wanted.startsWith("!")) return x => !x.toLowerCase().includes(rest);
  return x => x.toLowerCase().includes(wanted);
}
function tests() { // of rows; the tests of texts are done once for each text
  const found = [];
  if (Object.hasOwn(data.groups, state.group ?? "")) {
    const group = new Set(data.groups[state.group]);
    found.push(row => group.has(row));
  }
  for (const [name, text] of Object.entries(state.filters)) {
    const column = byName.get(name), test = column && text.trim() && (column.values ? numeric : textual)(text.trim());
    if (!test) continue;
    if (column.values) found.push(row => test(column.values[row]));
    else { const good = column.texts.map(test); found.push(row => good[column.index[row]]); }
  }
  for (const word of state.words.toLowerCase().split(/\s+/).filter(Boolean)) {
    const texts = columns.filter(column => column.texts)
      .map(column => [column.index, column.texts.map(text => text.toLowerCase().includes(word))]);
    found.push(row => texts.some(([index, good]) => good[index[row]]));
  }
  return found;
}

// ---------- order ----------
const status = byName.get("status"), verdict = byName.get("verdict");
function trouble(row) { // failures first, what is waiting last
  const how = cell(status, row), word = cell(verdict, row);
  if (how !== "done" && how !== "waiting") return 0;
  if (how === "waiting") return 4;
  return word === "FAIL" ? 1 : word === "PASS WITH WARNINGS" ? 2 : 3;
}
const ranks = Array.from({ length: count }, (_, row) => trouble(row));
const collator = new Intl.Collator("en", { numeric: true }), alphabet = new Map();
function places(column) { // of each text in the alphabet, found once
  if (!alphabet.has(column)) {
    const order = column.texts.map((text, k) => k).sort((a, b) => collator.compare(column.texts[a], column.texts[b]));
    alphabet.set(column, order.reduce((at, text, k) => { at[text] = k; return at; }, []));
  }
  return alphabet.get(column);
}
function compare() {
  const column = byName.get(state.sort), sign = state.up ? 1 : -1;
  if (!column) return (a, b) => ranks[a] - ranks[b] || a - b;
  if (column.values) return (a, b) => {
    const x = column.values[a], y = column.values[b];
    return x === null || y === null ? (x === null) - (y === null) || a - b : sign * (x - y) || a - b; // empty ones last
  };
  const at = places(column);
  return (a, b) => !column.index[a] - !column.index[b] || sign * (at[column.index[a]] - at[column.index[b]]) || a - b;
}

// ---------- the table ----------
let order = [], chosen = -1, first = -1, last = -1;
const listeners = [];
const make = (kind, more = {}) => Object.assign(document.createElement(kind), more);
const width = column => {
  const step = Math.max(1, Math.floor(count / 300)), heads = Math.min(column.name.length, 15) + 4;
  let most = column.values ? 6 : Math.max(...column.texts.map(text => text.length));
  for (let row = 0; column.values && row < count; row += step) most = Math.max(most, write(column.values[row]).length);
  return Math.min(Math.max(heads, most + 4), WIDEST);
};
const widths = new Map(columns.map(column => [column.name, width(column)]));
function head() {
  const group = make("colgroup"), names = make("tr"), filters = make("tr", { className: "filters" });
  let total = 0;
  for (const name of state.shown) {
    const column = byName.get(name), th = make("th", { scope: "col" }), box = make("td"), col = make("col");
    const button = make("button", { type: "button", className: "sort", title: `sort by ${name}` });
    const input = make("input", { type: "search", value: state.filters[name] ?? "", placeholder: column.values ? ">0" : "" });
    input.setAttribute("aria-label", `filter ${name}`);
    button.append(...name.split(/(?<=[._])/).flatMap(part => [part, make("wbr")]));
    if (column.values) th.className = "n";
    if (state.sort === name) th.setAttribute("aria-sort", state.up ? "ascending" : "descending");
    button.addEventListener("click", () => {
      [state.sort, state.up] = [name, state.sort === name ? !state.up : true];
      names.querySelectorAll("th").forEach(other => other.removeAttribute("aria-sort"));
      th.setAttribute("aria-sort", state.up ? "ascending" : "descending");
      apply();
    });
    input.addEventListener("input", () => {
      state.filters[name] = input.value;
      if (!input.value) delete state.filters[name];
      input.setAttribute("aria-invalid", Boolean(column.values && input.value.trim() && !numeric(input.value.trim())));
      apply();
    });
    col.style.width = `${widths.get(name)}ch`; total += widths.get(name);
    group.append(col); th.append(button); names.append(th); box.append(input); filters.append(box);
  }
  const pagesHead = make("th", { scope: "col", textContent: "pages" }), col = make("col");
  col.style.width = "16ch";
  group.append(col); names.append(pagesHead); filters.append(make("td"));
  table.style.width = `max(100%, ${total + 16}ch)`;
  table.querySelector("colgroup")?.remove();
  table.prepend(group);
  table.tHead.replaceChildren(names, filters);
}
const STYLES = { failed: "bad", FAIL: "bad", "PASS WITH WARNINGS": "warn", PASS: "good" };
function line(row) {
  const tr = make("tr", { className: row === chosen ? "chosen" : "" });
  for (const name of state.shown) {
    const column = byName.get(name), value = cell(column, row), td = make("td", { title: value ?? "" });
    if (column.values) td.className = "n";
    else if (column === status || column === verdict) td.className = STYLES[value] ?? "";
    const found = name === "job" ? pages(row) : [];
    if (found.length) td.append(make("a", { href: found[0][1], textContent: value }));
    else td.textContent = write(value);
    tr.append(td);
  }
  const links = make("td");
  for (const [word, href] of pages(row)) {
    const link = make("a", { href, className: "page", textContent: word });
    link.setAttribute("aria-label", `${word} of ${cell(byName.get("job"), row)}`);
    links.append(link);
  }
  tr.append(links);
  return tr;
}
const space = rows => { const tr = make("tr", { className: "space" }), td = make("td"); td.colSpan = state.shown.length + 1;
  td.style.height = `${rows * ROW}px`; tr.append(td); tr.setAttribute("aria-hidden", "true"); return tr; };
function fill(from, to, more = true) {
  [first, last] = [from, to];
  const body = order.slice(from, to).map(line);
  body.forEach((tr, k) => tr.setAttribute("aria-rowindex", from + k + 3)); // below the two rows of the head
  const focused = table.tBodies[0].contains(document.activeElement) ? document.activeElement.href : null;
  table.tBodies[0].replaceChildren(...(more && from ? [space(from)] : []), ...body, ...(more && to < order.length ? [space(order.length - to)] : []));
  if (focused) [...table.tBodies[0].querySelectorAll("a")].find(link => link.href === focused)?.focus({ preventScroll: true });
}
function draw(force) {
  const top = Math.floor(frame.scrollTop / ROW), seen = Math.ceil(frame.clientHeight / ROW);
  const from = Math.max(0, top - MARGIN), to = Math.min(order.length, top + seen + MARGIN);
  if (force || from < first - MARGIN + 1 || to > last + MARGIN - 1 || top < first || Math.min(top + seen, order.length) > last) fill(from, to);
}
function apply() {
  const needed = tests();
  order = [];
  for (let row = 0; row < count; row++) if (needed.every(test => test(row))) order.push(row);
  order.sort(compare());
  table.setAttribute("aria-rowcount", order.length + 2);
  document.getElementById("study-shown").textContent = `${order.length} of ${count} jobs${state.group === null ? "" : `, ${state.group}`}`;
  frame.scrollTop = 0;
  draw(true);
  keep();
  listeners.forEach(listener => listener());
}
function choose(row) {
  chosen = row;
  frame.scrollTop = Math.max(0, order.indexOf(row) * ROW - frame.clientHeight / 3);
  draw(true);
}

// ---------- choice of columns ----------
function choices() {
  const labels = columns.map(({ name }) => {
    const label = make("label"), box = make("input", { type: "checkbox", value: name, checked: state.shown.includes(name) });
    label.append(box, ` ${name}`);
    return label;
  });
  boxes.replaceChildren(boxes.querySelector("legend"), ...labels);
  document.querySelector(".choice summary").textContent = `Columns (${state.shown.length} of ${columns.length})`;
}
function show(names) {
  state.shown = names;
  choices(); head(); apply();
}
boxes.addEventListener("change", event => {
  show([...boxes.querySelectorAll("input:checked")].map(box => box.value));
  boxes.querySelector(`input[value="${CSS.escape(event.target.value)}"]`).focus();
});
for (const button of document.querySelectorAll("[data-choice]"))
  button.addEventListener("click", () => show(button.dataset.choice === "all" ? columns.map(({ name }) => name) : [...data.shown]));

form.elements.words.value = state.words;
form.addEventListener("input", () => { state.words = form.elements.words.value; apply(); });
form.addEventListener("submit", event => event.preventDefault());
form.elements.clear.addEventListener("click", () => {
  state.words = form.elements.words.value = ""; state.filters = {}; state.group = null; head(); apply();
});
for (const button of document.querySelectorAll("[data-group]")) button.addEventListener("click", () => {
  state.group = button.dataset.group;
  apply();
  document.getElementById("jobs").scrollIntoView();
});
form.elements.troubles.addEventListener("click", () => { state.sort = null; head(); apply(); });
frame.addEventListener("scroll", () => draw(false), { passive: true });
addEventListener("resize", () => draw(true));
addEventListener("beforeprint", () => {
  fill(0, Math.min(order.length, PRINTED), false);
  document.getElementById("study-printed").textContent = `${last} of ${count} jobs.`;
});
addEventListener("afterprint", () => draw(true));
table.classList.add("live");
choices(); head(); apply();
return { columns, byName, parameters, places, cell, write, pages, state, keep, choose, rows: () => order, listen: listener => listeners.push(listener) };
})();
