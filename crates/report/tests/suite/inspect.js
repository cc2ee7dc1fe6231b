// What a page is like, as data. Every figure is brought into view first, as a reader would.
(async () => {
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const before = document.documentElement.scrollHeight;
  const figures = [];
  for (const drawing of document.querySelectorAll(".drawing")) {
    drawing.scrollIntoView({ behavior: "instant", block: "center" });
    for (let waited = 0; !drawing.dataset.drawn && waited < 5000; waited += 20) await wait(20);
    const traces = [...drawing.querySelectorAll("svg.chart .curve")];
    figures.push({
      id: drawing.dataset.figure,
      curves: drawing.parentElement.querySelectorAll(".legend button").length,
      traces: traces.filter((trace) => [...trace.querySelectorAll("path")].some((path) => path.getAttribute("d")?.length > 8)).length,
      labels: [...drawing.querySelectorAll(".x-label, .y-label")].map((label) => label.textContent),
      cut: [...drawing.querySelectorAll("svg.chart text")].filter((text) => {
        const [own, whole] = [text, text.closest("svg")].map((element) => element.getBoundingClientRect());
        return own.left < whole.left - 1 || own.right > whole.right + 1;
      }).map((text) => text.textContent),
      ink: getComputedStyle(drawing.querySelector(".x-label") ?? drawing).fill,
    });
  }
  const links = [...document.querySelectorAll('a[href^="#"]')];
  return {
    figures,
    growth: document.documentElement.scrollHeight - before,
    dangling: links.map((link) => link.hash).filter((hash) => !document.getElementById(hash.slice(1))),
    links: links.length,
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    paper: getComputedStyle(document.body).backgroundColor,
    ink: getComputedStyle(document.body).color,
  };
})()
