"use strict";
(() => {
  const root = document.documentElement;
  const narrow = () => window.innerWidth < 640;
  const colour = (name) => getComputedStyle(root).getPropertyValue("--" + name).trim();
  // Plotly reads a little HTML and %{...} in its texts: names are shown as they are.
  const literal = (text) =>
    String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;").replace(/%\{/g, "%\u200b{");
  const within = (unit) => (unit ? " in " + literal(unit) : "");
  const embedded = (selector) => JSON.parse(document.querySelector(selector).textContent);
  const config = {
    responsive: true,
    displaylogo: false,
    showSendToCloud: false,
    plotlyServerURL: "",
    // Named one by one: plotly's own set has a button that sends the data to its makers.
    modeBarButtons: [["toImage"], ["zoom2d", "pan2d"], ["zoomIn2d", "zoomOut2d", "resetScale2d"]],
  };

  const axis = (title, more) => ({
    title: { text: title, standoff: 8, font: { size: 12 } },
    gridcolor: colour("grid"),
    linecolor: colour("line"),
    zerolinecolor: colour("line"),
    zeroline: true,
    automargin: true,
    exponentformat: "power",
    ...more,
  });
  // On a phone the legend has its own row below the buttons.
  const underButtons = () => ({ l: 56, r: 8, t: narrow() ? 60 : 34, b: 42 });
  const layout = (more) => ({
    font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: colour("ink") },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    hoverlabel: { bgcolor: colour("raised"), bordercolor: colour("line"), font: { color: colour("ink") } },
    margin: { l: 56, r: 8, t: 34, b: 42 },
    legend: { orientation: "h", x: 0, y: 1.0, yanchor: "bottom", bgcolor: "rgba(0,0,0,0)" },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("muted"), activecolor: colour("accent") },
    // A finger on a plot scrolls the page; the buttons above it turn zooming on.
    dragmode: window.matchMedia("(pointer: coarse)").matches ? false : "zoom",
    hovermode: "x unified",
    ...more,
  });

  // Gives a plot the colours of the page as they are now, and keeps its zoom; `meta` names a curve's colour.
  function repaint(plot, size) {
    const strokes = plot.data.map((trace) => colour(trace.meta));
    const look = { "font.color": colour("ink"), "hoverlabel.bgcolor": colour("raised"),
      "hoverlabel.bordercolor": colour("line"), "hoverlabel.font.color": colour("ink"), ...size };
    Object.keys(plot.layout).filter((key) => /^[xy]axis/.test(key)).forEach((key) => {
      look[key + ".gridcolor"] = colour("grid");
      look[key + ".linecolor"] = look[key + ".zerolinecolor"] = colour("line");
    });
    return Plotly.update(plot, { "line.color": strokes, fillcolor: strokes }, look);
  }

  function tracesFigure(channel) {
    const line = (name, y, stroke, width, more) => ({
      type: "scatter", mode: "lines", name, x: channel.time, y, meta: stroke, line: { color: colour(stroke), width },
      hovertemplate: "%{y:.6~g}" + (channel.unit ? " " + literal(channel.unit) : ""), ...more,
    });
    const thinned = channel.shown < channel.samples;
    return {
      title: channel.name,
      label: "Measured and simulated " + channel.name + ", and the residual, over time",
      note: thinned
        ? `${channel.shown} of ${channel.samples} samples, every peak among them. Drag to zoom, double click to reset.`
        : "Drag to zoom, double click to reset.",
      height: narrow() ? 380 : 440,
      data: [
        line("measured", channel.measured, "measured", 2),
        line("simulated", channel.simulated, "simulated", 1.3),
        line("residual", channel.residual, "residual", 1, { yaxis: "y2", showlegend: false }),
      ],
      layout: {
        hoversubplots: "axis",
        margin: underButtons(),
        xaxis: axis("time in s", { anchor: "y2", zeroline: false }),
        yaxis: axis((channel.name.length > 20 ? "value" : literal(channel.name)) + within(channel.unit), { domain: [0.37, 1] }),
        yaxis2: axis("residual" + within(channel.unit), { domain: [0, 0.29] }),
      },
    };
  }

  function frictionFigure(plot) {
    const data = plot.curves.flatMap((curve, index) => {
      const meta = "curve-" + (index % 7);
      const stroke = colour(meta);
      const shared = { type: "scatter", mode: "lines", legendgroup: String(index), meta };
      const band = {
        ...shared, x: curve.speed.concat(curve.speed.slice().reverse()),
        y: curve.upper.concat(curve.lower.slice().reverse()), fill: "toself", fillcolor: stroke, opacity: 0.2,
        line: { width: 0 }, hoverinfo: "skip", showlegend: false,
      };
      const line = {
        ...shared, x: curve.speed, y: curve.torque, name: literal(curve.label), line: { color: stroke, width: 2 },
        hovertemplate: "%{y:.4~g} " + literal(plot.torque_unit),
      };
      return curve.upper.length === curve.speed.length && curve.lower.length ? [band, line] : [line];
    });
    return {
      title: plot.shaft + " (" + plot.laws + ")",
      label: "Friction torque of " + plot.shaft + " over speed, with its 95 % band",
      height: narrow() ? 320 : 380,
      data,
      layout: {
        showlegend: plot.curves.length > 1,
        ...(plot.curves.length > 1 ? { margin: underButtons() } : {}),
        xaxis: axis("speed" + within(plot.speed_unit)),
        yaxis: axis("friction torque" + within(plot.torque_unit)),
      },
    };
  }

  function curveFigure(title, label, curve, layout) {
    return {
      title, label, height: 290, layout,
      data: [{
        type: "scatter", mode: "lines", name: curve.name, x: curve.x, y: curve.y, meta: curve.colour,
        line: { color: colour(curve.colour), width: 1.6 }, hovertemplate: "%{y:.3f}",
      }],
    };
  }

  function residualFigure(residual) {
    const band = residual.band === null ? [] : [{
      type: "rect", xref: "paper", x0: 0, x1: 1, y0: -residual.band, y1: residual.band, layer: "below",
      line: { width: 0 }, fillcolor: colour("muted"), opacity: 0.25,
    }];
    const curve = { name: "autocorrelation", x: residual.lag, y: residual.autocorrelation, colour: "residual" };
    return curveFigure(
      residual.name + ": " + (residual.white ? "white" : "not white"),
      "Autocorrelation of the residual of " + residual.name + " over the lag", curve, {
        shapes: band,
        xaxis: axis("lag in s", { zeroline: false }),
        yaxis: axis("autocorrelation", { range: [-1.05, 1.05] }),
      },
    );
  }

  function coherenceFigure(found) {
    const curve = { name: "coherence", x: found.frequency, y: found.share, colour: "simulated" };
    return curveFigure(
      found.name + ": " + found.explained,
      "Coherence of measured and simulated " + found.name + " over the frequency", curve, {
        xaxis: axis("frequency in Hz", { type: "log", zeroline: false, dtick: 1, tickformat: "~g" }),
        yaxis: axis("coherence", { range: [-0.02, 1.05] }),
      },
    );
  }

  function frame(holder, figure) {
    const element = document.createElement("figure");
    const heading = document.createElement("h3");
    const plot = document.createElement("div");
    heading.textContent = figure.title;
    plot.className = "plot";
    plot.dataset.height = figure.height;
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", figure.label);
    element.append(heading, plot);
    if (figure.note) {
      const note = document.createElement("figcaption");
      note.textContent = figure.note;
      note.className = "screen";
      element.append(note);
    }
    holder.append(element);
    return plot;
  }

  // All frames stand before the first plot measures the room it has.
  function drawAll(holder, figures) {
    const plots = figures.map((figure) => frame(holder, figure));
    figures.forEach((figure, index) =>
      Plotly.newPlot(plots[index], figure.data, layout({ height: figure.height, ...figure.layout }), config));
    return plots;
  }

  // Zooming the time of one channel zooms it in all channels of the recording.
  function linkTime(plots) {
    let busy = false;
    plots.forEach((plot) => plot.on("plotly_relayout", (change) => {
      const time = Object.fromEntries(Object.entries(change).filter(([key]) => key.startsWith("xaxis.")));
      if (busy || !Object.keys(time).length) return;
      busy = true;
      Promise.all(plots.filter((other) => other !== plot).map((other) => Plotly.relayout(other, time)))
        .finally(() => { busy = false; });
    }));
  }

  const figures = { traces: tracesFigure, residuals: residualFigure, coherence: coherenceFigure };
  const holder = (kind) => document.querySelector(`[data-plots="${kind}"]`);
  const clear = (element) => {
    element.querySelectorAll(".plot").forEach((plot) => Plotly.purge(plot));
    element.replaceChildren();
  };

  function show(kind) {
    const select = document.querySelector(`[data-choose="${kind}"]`);
    const element = holder(kind);
    if (!select || !element) return;
    clear(element);
    const content = embedded(`script[data-${kind}="${select.value}"]`);
    const plots = drawAll(element, content.map(figures[kind]));
    if (!plots.length) element.textContent = "Nothing was recorded here that can be drawn.";
    if (kind === "traces") linkTime(plots);
    const name = select.selectedOptions[0].textContent;
    document.querySelectorAll(`[data-shown="${kind}"]`).forEach((shown) => { shown.textContent = name; });
    select.parentElement.querySelectorAll("[data-step]").forEach((button) => {
      const next = select.selectedIndex + Number(button.dataset.step);
      button.disabled = next < 0 || next >= select.options.length;
    });
  }

  function showAll() {
    Object.keys(figures).forEach(show);
    const friction = holder("friction");
    if (!friction) return;
    clear(friction);
    drawAll(friction, embedded("script[data-friction]").map(frictionFigure));
  }

  document.querySelectorAll("[data-choose]").forEach((select) => {
    select.addEventListener("change", () => show(select.dataset.choose));
    select.parentElement.querySelectorAll("[data-step]").forEach((button) => button.addEventListener("click", () => {
      select.selectedIndex += Number(button.dataset.step);
      show(select.dataset.choose);
    }));
  });

  function sortBy(header) {
    const table = header.closest("table");
    const column = header.cellIndex;
    const sign = header.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    const numeric = header.classList.contains("number") || /^Verdict/.test(header.textContent);
    const key = (row) => row.cells[column].dataset.key || "";
    const compare = (a, b) => {
      const [left, right] = [key(a), key(b)];
      if (left === "" || right === "") return (left === "") - (right === "");
      return sign * (numeric ? Number(left) - Number(right) : left.localeCompare(right, "en", { numeric: true }));
    };
    const body = table.tBodies[0];
    body.append(...Array.from(body.rows).sort(compare));
    table.querySelectorAll("th[aria-sort]").forEach((other) => other.setAttribute("aria-sort", "none"));
    header.setAttribute("aria-sort", sign === 1 ? "ascending" : "descending");
  }
  document.querySelectorAll("table.sortable th[aria-sort]").forEach((header) =>
    header.querySelector("button").addEventListener("click", () => sortBy(header)));

  // A table that is wider than a phone becomes a card a row: every cell beside the header of its column.
  function label(table) {
    const heads = Array.from(table.tHead.rows[0].cells, (cell) => cell.textContent.trim());
    Array.from(table.tBodies).forEach((body) => {
      const spans = [];
      Array.from(body.rows).forEach((row) => {
        let column = 0;
        Array.from(row.cells).forEach((cell) => {
          while (spans[column] > 0) spans[column++] -= 1;
          cell.dataset.label = heads[column] || "";
          spans[column++] = cell.rowSpan - 1;
        });
      });
    });
    // What is no table for the eye remains one for a screen reader.
    const roles = { table: "table", thead: "rowgroup", tbody: "rowgroup", tr: "row", td: "cell" };
    [table, ...table.querySelectorAll("thead, tbody, tr, td")].forEach((element) =>
      element.setAttribute("role", roles[element.localName]));
    table.querySelectorAll("th").forEach((head) =>
      head.setAttribute("role", head.scope.startsWith("row") ? "rowheader" : "columnheader"));
  }
  const tables = Array.from(document.querySelectorAll(".scroll > table")).filter((table) =>
    table.tHead && !table.classList.contains("correlation"));
  tables.forEach(label);
  const fold = () => tables.forEach((table) => {
    table.classList.remove("cards");
    table.classList.toggle("cards", narrow() && table.scrollWidth > table.parentElement.clientWidth + 1);
  });
  window.addEventListener("resize", fold);
  document.querySelectorAll("details").forEach((details) => details.addEventListener("toggle", fold));
  fold();

  // Paper is white and narrower than most windows.
  const onPaper = (printing) => {
    root.classList.toggle("printing", printing);
    if (printing) tables.forEach((table) => table.classList.remove("cards"));
    else fold();
    document.querySelectorAll("details").forEach((details) => { details.open = printing; });
    document.querySelectorAll(".plot").forEach((plot) => repaint(plot, printing
      ? { width: plot.closest(".pairs") ? 325 : 680, height: 0.86 * plot.dataset.height }
      : { width: null, height: Number(plot.dataset.height), autosize: true }));
  };
  window.addEventListener("beforeprint", () => onPaper(true));
  window.addEventListener("afterprint", () => onPaper(false));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    document.querySelectorAll(".plot").forEach((plot) => repaint(plot, {})));
  showAll();
})();
