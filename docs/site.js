// A table that is too wide for a wide screen is set closer. Where that does not help, and on a phone,
// it shows its rows one below the other, each cell with its head.
const stack = () => {
  const closer = window.matchMedia("(min-width: 60em)").matches;
  for (const table of document.querySelectorAll(".md-typeset table:not([class])")) {
    const room = table.closest(".md-content__inner");
    const wide = () => table.getBoundingClientRect().right > room.getBoundingClientRect().right;
    delete table.dataset.stacked;
    delete table.dataset.close;
    if (!room || !wide()) continue;
    if (closer) table.dataset.close = "";
    if (!wide()) continue;
    delete table.dataset.close;
    table.dataset.stacked = "";
  }
};
window.addEventListener("load", stack);
window.addEventListener("resize", stack);

document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll(".md-typeset table:not([class])")) {
    const heads = [...table.querySelectorAll("thead th")].map((head) => head.textContent);
    for (const line of table.querySelectorAll("tbody tr")) {
      [...line.cells].forEach((cell, i) => (cell.dataset.head = heads[i] ?? ""));
    }
  }

  // Each figure links to its full picture.
  for (const figure of document.querySelectorAll(".md-typeset p > img")) {
    const link = document.createElement("a");
    link.href = figure.src;
    link.title = "Full picture";
    figure.replaceWith(link);
    link.append(figure);
  }

  // Inline code breaks at spaces, not after the hyphens of a flag.
  for (const code of document.querySelectorAll(".md-typeset :not(pre) > code, .md-nav code")) {
    if (code.childElementCount || !code.textContent.includes("-")) continue;
    const words = code.textContent.split(/( )/).map((text) => {
      if (!text.includes("-") || text.length > 36) return text;
      const word = document.createElement("span");
      word.className = "word";
      word.append(text);
      return word;
    });
    code.replaceChildren(...words);
  }
});
