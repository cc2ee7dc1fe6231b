"use strict";
(() => {
  const root = document.documentElement;
  const pairs = JSON.parse(document.getElementById("palette").textContent);
  const system = matchMedia("(prefers-color-scheme: dark)");
  const coarse = matchMedia("(pointer: coarse)").matches;
  // Width of the text on an A4 sheet with the margins of the style sheet, in CSS pixels.
  const sheet = 680;
  // Figures are drawn this far ahead of the reader.
  const ahead = "900px 0px";

  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);

  // Figures are stored in light colours; data arrays hold none and are passed through.
  const recolour = (value, table) => {
    if (typeof value === "string") return table[value] ?? value;
    if (value === null || typeof value !== "object" || (Array.isArray(value) && typeof value[0] === "number")) return value;
    if (Array.isArray(value)) return value.map((item) => recolour(item, table));
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, recolour(item, table)]));
  };

  const paper = (printing) => (printing ? "#ffffff" : getComputedStyle(root).getPropertyValue("--paper").trim());

  const legend = (drawing) => [...drawing.parentElement.querySelectorAll(".legend button")];

  const size = (drawing, printing) => {
    if (!printing) return [drawing.clientWidth, drawing.clientHeight];
    switch (drawing.dataset.kind) {
      case "polar": return [560, 590];
      case "dots": return [sheet, drawing.clientHeight];
      default: return [sheet, sheet / 2];
    }
  };

  // An image leaves the page, so it takes along the background and the legend that the page supplies here.
  const save = (drawing) =>
    Plotly.downloadImage(
      { data: drawing.data, layout: { ...drawing.layout, showlegend: true, paper_bgcolor: paper(false), height: 560, width: 900 } },
      { format: "svg", filename: drawing.dataset.figure, height: 560, width: 900 },
    );

  const config = {
    displaylogo: false,
    modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "autoScale2d"],
    modeBarButtonsToAdd: [{ name: "Save as SVG", icon: Plotly.Icons.camera, click: save }],
  };

  const draw = (drawing, printing) => {
    const stored = JSON.parse(drawing.parentElement.querySelector("script").textContent);
    const { data, layout } = recolour(stored, isDark() && !printing ? pairs : {});
    [layout.width, layout.height] = size(drawing, printing);
    // Zoom survives a change of colours or size.
    layout.uirevision = "same";
    // A finger scrolls the page; it zooms a figure by the figure's buttons.
    if (coarse) layout.dragmode = false;
    legend(drawing).forEach((entry, i) => { data[i].visible = entry.getAttribute("aria-pressed") === "true"; });
    const ink = layout.font.color;
    layout.hoverlabel = { bgcolor: paper(printing), bordercolor: ink, font: { size: 12, color: ink }, namelength: -1 };
    layout.modebar = { bgcolor: "rgba(0,0,0,0)", color: layout.xaxis.linecolor, activecolor: ink };
    Plotly.react(drawing, data, layout, config);
  };

  // What a drawing was last drawn for: it is drawn again only when something changed.
  const drawn = new Map();
  // While a sheet is made, nothing is drawn for the screen: its other width would ask for that.
  let onSheet = false;
  const drawFor = (drawing, printing) => {
    const wanted = printing ? "print" : `${isDark()} ${drawing.clientWidth}`;
    if (drawn.get(drawing) === wanted || (onSheet && !printing)) return;
    try {
      draw(drawing, printing);
      drawn.set(drawing, wanted);
      drawing.dataset.drawn = wanted;
    } catch (error) {
      drawing.textContent = `This figure cannot be drawn: ${error.message}`;
      console.error(drawing.dataset.figure, error);
    }
  };

  const drawings = [...document.querySelectorAll(".drawing")];
  const near = new Set();
  const drawNear = () => near.forEach((drawing) => drawFor(drawing, false));
  const watcher = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      if (isIntersecting) {
        near.add(target);
        drawFor(target, false);
      } else {
        near.delete(target);
      }
    }
  }, { rootMargin: ahead });

  for (const drawing of drawings) {
    watcher.observe(drawing);
    for (const entry of legend(drawing)) {
      entry.addEventListener("click", () => {
        entry.setAttribute("aria-pressed", entry.getAttribute("aria-pressed") !== "true");
        drawn.delete(drawing);
        drawFor(drawing, false);
      });
    }
  }

  // A sheet shows everything, in light colours, wherever the reader was.
  addEventListener("beforeprint", () => {
    onSheet = true;
    drawings.forEach((drawing) => drawFor(drawing, true));
  });
  addEventListener("afterprint", () => {
    onSheet = false;
    for (const drawing of drawings) {
      if (near.has(drawing)) continue;
      Plotly.purge(drawing);
      drawing.replaceChildren();
      drawn.delete(drawing);
    }
    drawNear();
  });

  const theme = document.getElementById("theme");
  theme.parentElement.hidden = false;
  theme.value = root.dataset.theme ?? "";
  theme.addEventListener("change", () => {
    if (theme.value) root.dataset.theme = theme.value;
    else delete root.dataset.theme;
    // Storage may be closed to pages from files; the choice then lasts as long as the page.
    try { localStorage.setItem("quadrant-theme", theme.value); } catch { /* see above */ }
    drawNear();
  });
  system.addEventListener("change", drawNear);

  const contents = document.querySelector("#contents > details");
  const narrow = matchMedia("(max-width: 40rem)");
  if (narrow.matches && contents.querySelectorAll("li").length > 20) contents.open = false;
  // Folding the contents gives the figures another width.
  let pending = 0;
  new ResizeObserver(() => {
    clearTimeout(pending);
    pending = setTimeout(drawNear, 120);
  }).observe(document.querySelector("main"));

  // The contents say where the reader is.
  const links = new Map([...contents.querySelectorAll("ol > li")].map((item) => {
    const link = item.querySelector("a");
    return [link.hash.slice(1), link];
  }));
  const place = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      links.get(target.id)?.toggleAttribute("aria-current", isIntersecting);
    }
  }, { rootMargin: "-10% 0px -80% 0px" });
  document.querySelectorAll("main > section").forEach((section) => place.observe(section));
})();
