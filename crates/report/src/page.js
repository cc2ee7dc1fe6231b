(() => {
  const root = document.documentElement;
  // Width of the text on an A4 sheet with the margins of the style sheet, in CSS pixels.
  const sheet = 680;
  // Figures are drawn this far ahead of the reader.
  const ahead = "900px 0px";

  const legend = (drawing) => [...drawing.parentElement.querySelectorAll(".legend button")];

  const size = (drawing, printing) => {
    if (!printing) return [drawing.clientWidth, drawing.clientHeight];
    return drawing.dataset.kind === "polar" ? [560, 590] : [sheet, sheet / 2];
  };

  // The chart of each drawing that the reader has come near to.
  const charts = new Map();
  const draw = (drawing, printing) => {
    if (!charts.has(drawing)) {
      charts.set(drawing, chart(drawing, JSON.parse(drawing.parentElement.querySelector("script").textContent)));
    }
    charts.get(drawing).draw(...size(drawing, printing));
  };

  // A drawing says what it was last drawn for: it is drawn again only when that changed.
  // While a sheet is made, nothing is drawn for the screen: its other width would ask for that.
  let onSheet = false;
  const drawFor = (drawing, printing) => {
    const wanted = printing ? "print" : String(drawing.clientWidth);
    if (drawing.dataset.drawn === wanted || (onSheet && !printing)) return;
    try {
      draw(drawing, printing);
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
    legend(drawing).forEach((entry, i) => entry.addEventListener("click", () => {
      const shown = entry.getAttribute("aria-pressed") !== "true";
      entry.setAttribute("aria-pressed", shown);
      drawFor(drawing, false);
      charts.get(drawing)?.toggle(i, shown);
    }));
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
      drawing.querySelector("svg.chart")?.remove();
      delete drawing.dataset.drawn;
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
  });
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
