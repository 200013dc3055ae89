// Sorting and filtering of the selection table, values of the MAC matrix under the pointer.
"use strict";
(() => {
const table = document.getElementById("selection");
if (!table) return;
const rows = [...table.tBodies[0].rows], heads = [...table.tHead.rows[0].cells];
const keyOf = (row, column) => row.cells[column].dataset.sort ?? row.cells[column].textContent.trim();
function sort(head, column) {
  const up = head.getAttribute("aria-sort") !== "ascending", numeric = head.classList.contains("n");
  const order = numeric ? (a, b) => Number(keyOf(a, column)) - Number(keyOf(b, column))
    : (a, b) => keyOf(a, column).localeCompare(keyOf(b, column), "en", { numeric: true });
  rows.sort(order);
  if (!up) rows.reverse();
  heads.forEach(other => other.removeAttribute("aria-sort"));
  head.setAttribute("aria-sort", up ? "ascending" : "descending");
  table.tBodies[0].append(...rows);
}
heads.forEach((head, column) => {
  head.tabIndex = 0;
  head.addEventListener("click", () => sort(head, column));
  head.addEventListener("keydown", event => { if (event.key === "Enter") sort(head, column); });
});

const filter = document.getElementById("filter"), shown = document.getElementById("shown");
function apply() {
  const words = filter.words.value.toLowerCase().split(/\s+/).filter(Boolean);
  for (const row of rows) {
    const text = row.textContent.toLowerCase(), wanted = filter.show.value, kind = filter.kind.value;
    row.hidden = (wanted !== "all" && !row.classList.contains(wanted)) || (kind !== "all" && row.dataset.kind !== kind)
      || !words.every(word => text.includes(word));
  }
  shown.textContent = `${rows.filter(row => !row.hidden).length} of ${rows.length} rows`;
}
filter.addEventListener("input", apply);
filter.addEventListener("submit", event => event.preventDefault());
apply();
})();

// ---------- contents and paper ----------
(() => {
const contents = document.querySelector("#contents details"), narrow = matchMedia("(max-width: 600px)");
const fold = () => { contents.open = !narrow.matches; };
narrow.addEventListener("change", fold);
fold();
contents.addEventListener("click", event => { if (narrow.matches && event.target.closest("a")) contents.open = false; });
addEventListener("beforeprint", () => { for (const part of document.querySelectorAll("details")) part.open = true; });
addEventListener("afterprint", fold);

const mac = document.getElementById("mac"), data = document.getElementById("mac-values");
if (mac && data) {
  const { values, frequencies } = JSON.parse(data.textContent), readout = document.getElementById("mac-readout");
  const empty = readout.textContent;
  mac.addEventListener("pointermove", event => {
    const box = mac.querySelector(".area").getBoundingClientRect(), n = values.length;
    const j = Math.floor((event.clientX - box.left) / box.width * n), i = Math.floor((event.clientY - box.top) / box.height * n);
    readout.textContent = values[i]?.[j] === undefined ? empty
      : `mode ${i + 1} (${frequencies[i]} Hz) and mode ${j + 1} (${frequencies[j]} Hz): ${values[i][j].toFixed(3)}`;
  });
  mac.addEventListener("pointerleave", () => { readout.textContent = empty; });
}
})();
