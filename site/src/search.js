// Finds the words that are typed in the headings and texts of all pages: sections that hold all of them, headings first.
(() => {
  const root = document.currentScript.dataset.root;
  const times = (text, word) => text.split(word).length - 1;
  const weight = ([, page, heading, text], words) => {
    const [head, body] = [`${page} ${heading}`.toLowerCase(), text.toLowerCase()];
    const each = words.map((word) => 20 * times(head, word) + Math.min(times(body, word), 10));
    return each.every((w) => w > 0) ? each.reduce((a, b) => a + b) : 0;
  };
  for (const box of document.querySelectorAll("input[type=search]")) {
    box.hidden = false;
    box.addEventListener("input", () => {
      const words = box.value.toLowerCase().split(/\s+/).filter((word) => word.length > 1);
      const found = words.length ? SECTIONS.map((s) => [weight(s, words), s]).filter(([w]) => w > 0) : [];
      found.sort((a, b) => b[0] - a[0]);
      box.nextElementSibling.replaceChildren(...found.slice(0, 12).map(([, [at, page, heading]]) => {
        const [item, link] = [document.createElement("li"), document.createElement("a")];
        link.href = root + at;
        link.textContent = page === heading ? page : `${page}: ${heading}`;
        item.append(link);
        return item;
      }));
    });
  }
})();
