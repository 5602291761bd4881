document.addEventListener("DOMContentLoaded", () => {
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
