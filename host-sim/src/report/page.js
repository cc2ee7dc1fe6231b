"use strict";
(() => {
  const pairs = JSON.parse(document.getElementById("palette").textContent);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const coarse = matchMedia("(pointer: coarse)").matches;
  // Width of the text on an A4 sheet with the margins of the style sheet, in CSS pixels.
  const sheet = 680;

  // Figures are stored in light colours; data arrays hold none and are passed through.
  const recolour = (value, table) => {
    if (typeof value === "string") return table[value] ?? value;
    if (value === null || typeof value !== "object" || (Array.isArray(value) && typeof value[0] === "number")) return value;
    if (Array.isArray(value)) return value.map((item) => recolour(item, table));
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, recolour(item, table)]));
  };

  const paper = () => getComputedStyle(document.documentElement).getPropertyValue("--paper").trim();

  const legend = (drawing) => [...drawing.parentElement.querySelectorAll(".legend button")];

  const height = (drawing, width) =>
    drawing.dataset.kind === "polar" ? Math.min(width, 608) + 30 : Math.max(290, Math.min(0.5 * width, 400));

  // An image leaves the page, so it takes along the background and the legend that the page supplies here.
  const save = (drawing) =>
    Plotly.downloadImage(
      { data: drawing.data, layout: { ...drawing.layout, showlegend: true, paper_bgcolor: paper(), height: 560, width: 900 } },
      { format: "svg", filename: drawing.dataset.figure, height: 560, width: 900 },
    );

  const config = {
    displaylogo: false,
    modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "autoScale2d"],
    modeBarButtonsToAdd: [{ name: "Save as SVG", icon: Plotly.Icons.camera, click: save }],
  };

  const draw = (drawing, printing) => {
    const stored = JSON.parse(document.getElementById(`${drawing.dataset.figure}-data`).textContent);
    const table = dark.matches && !printing ? pairs : {};
    const { data, layout } = recolour(stored, table);
    const limit = drawing.dataset.kind === "polar" ? 608 : sheet;
    layout.width = printing ? limit : drawing.clientWidth;
    layout.height = height(drawing, layout.width);
    // Zoom survives a change of colours or size.
    layout.uirevision = "same";
    // A finger scrolls the page; it zooms a figure by the figure's buttons.
    if (coarse) layout.dragmode = false;
    legend(drawing).forEach((entry, i) => { data[i].visible = entry.getAttribute("aria-pressed") === "true"; });
    const ink = layout.font.color;
    layout.hoverlabel = { bgcolor: paper(), bordercolor: ink, font: { size: 12, color: ink }, namelength: -1 };
    layout.modebar = { bgcolor: "rgba(0,0,0,0)", color: layout.xaxis.linecolor, activecolor: ink };
    Plotly.react(drawing, data, layout, config);
  };

  const drawings = [...document.querySelectorAll(".drawing")];
  const drawAll = (printing) => drawings.forEach((drawing) => draw(drawing, printing));

  for (const drawing of drawings) {
    for (const entry of legend(drawing)) {
      entry.addEventListener("click", () => {
        entry.setAttribute("aria-pressed", entry.getAttribute("aria-pressed") !== "true");
        draw(drawing, false);
      });
    }
  }

  drawAll(false);
  dark.addEventListener("change", () => drawAll(false));
  addEventListener("beforeprint", () => drawAll(true));
  addEventListener("afterprint", () => drawAll(false));

  let width = innerWidth;
  let pending = 0;
  addEventListener("resize", () => {
    // Phones report a resize whenever their address bar folds; only the width matters here.
    if (innerWidth === width) return;
    width = innerWidth;
    clearTimeout(pending);
    pending = setTimeout(() => drawAll(false), 120);
  });
})();
