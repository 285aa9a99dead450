"use strict";
// Sorts a table by a column when its heading is pressed; again, the other way round. Numbers are
// sorted by size and stand before words; rows that are equal keep their order. On narrow screens the
// style puts the cells of a row below one another, each after the name of its column.
(() => {
  const value = (row, column) => {
    const text = row.cells[column].textContent.trim();
    const number = parseFloat(text.replace("−", "-"));
    return { number: /^[-−+]?(\d|\.\d|inf)/.test(text) ? (Number.isNaN(number) ? Infinity : number) : null, text };
  };
  const order = (a, b) => {
    if (a.number !== null && b.number !== null) return a.number - b.number;
    if (a.number !== null || b.number !== null) return a.number !== null ? -1 : 1;
    return a.text.localeCompare(b.text, undefined, { numeric: true });
  };

  function sort(table, column, heading) {
    const down = heading.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", down ? "descending" : "ascending");
    const body = table.tBodies[0];
    const rows = [...body.rows].map((row) => ({ row, key: value(row, column) }));
    rows.sort((a, b) => (down ? order(b.key, a.key) : order(a.key, b.key)));
    body.append(...rows.map((each) => each.row));
  }

  for (const table of document.querySelectorAll("table.sorts")) {
    const rows = [...table.tBodies[0].rows], headings = [...table.tHead.rows[0].cells];
    const names = headings.map((heading) => heading.textContent.trim() || "verdict");
    for (const row of rows) [...row.cells].forEach((cell, column) => { cell.dataset.label = names[column]; });
    table.classList.add("stacks");
    if (rows.length < 2) continue;
    headings.forEach((heading, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...(heading.childNodes.length ? heading.childNodes : [names[column]]));
      button.addEventListener("click", () => sort(table, column, heading));
      heading.append(button);
    });
  }
})();
