// On a telephone a wide table's rows are cards (cards.css): each cell needs the heading of its column.
for (const table of document.querySelectorAll("table.docutils")) {
  const headings = [...table.querySelectorAll("thead th")].map((heading) => heading.textContent.trim());
  for (const cell of table.querySelectorAll("tbody td")) cell.dataset.heading = headings[cell.cellIndex] ?? "";
}
