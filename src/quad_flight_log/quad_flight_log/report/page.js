"use strict";
// Draws every figure of the page, and shows or hides a run in all of them at once.
(function () {
  const report = JSON.parse(document.getElementById("report-data").textContent);
  const config = { responsive: true, displaylogo: false, toImageButtonOptions: { format: "svg" } };
  if (window.innerWidth <= 600) config.displayModeBar = false;
  const drawn = new Map();
  const boxes = new Map();
  let linking = false;

  // Letters take the page's own colour; on a phone axes get the room that titles and margins take on a desk.
  function fitted(layout) {
    layout.font.color = getComputedStyle(document.body).color;
    const sheet = getComputedStyle(document.querySelector("figure")).backgroundColor;
    for (const label of layout.annotations || []) label.bgcolor = sheet;
    if (window.innerWidth > 600) return layout;
    layout.font.size = 10;
    Object.assign(layout.margin, { l: 52, r: 8, b: 36 });
    if (layout.scene) {
      layout.height = Math.round(0.9 * window.innerWidth);
      Object.assign(layout.margin, { l: 0, r: 0, t: 28, b: 0 });
    }
    return layout;
  }

  function shown(run) {
    return !boxes.has(run) || boxes.get(run).checked;
  }

  function apply(run) {
    const changes = [];
    for (const [plot, figure] of drawn) {
      const traces = figure.data.flatMap((trace, index) => (trace.meta && trace.meta.run === run ? [index] : []));
      if (traces.length) changes.push(Plotly.restyle(plot, { visible: shown(run) ? true : "legendonly" }, traces));
    }
    return Promise.all(changes);
  }

  function linkTime(source, event) {
    if (linking) return;
    const range = event["xaxis.range"] || [event["xaxis.range[0]"], event["xaxis.range[1]"]];
    const change = event["xaxis.autorange"] ? { "xaxis.autorange": true } : { "xaxis.range": range };
    if (!event["xaxis.autorange"] && !range.every(Number.isFinite)) return;
    linking = true;
    const others = [...drawn.keys()].filter((plot) => plot !== source && drawn.get(plot).time);
    Promise.all(others.map((plot) => Plotly.relayout(plot, change))).finally(() => { linking = false; });
  }

  for (const box of document.querySelectorAll("#bar input[data-run]")) {
    boxes.set(box.dataset.run, box);
    box.addEventListener("change", () => apply(box.dataset.run));
  }

  async function draw(plot) {
    const figure = report[plot.dataset.figure];
    drawn.set(plot, figure);
    for (const trace of figure.data) if (trace.meta && !shown(trace.meta.run)) trace.visible = "legendonly";
    await Plotly.newPlot(plot, figure.data, fitted(figure.layout), config);
    plot.on("plotly_legendclick", (event) => {
      const run = event.data[event.curveNumber].meta.run;
      if (!boxes.has(run)) return true;
      boxes.get(run).checked = !boxes.get(run).checked;
      apply(run);
      return false;
    });
    if (figure.time) plot.on("plotly_relayout", (event) => linkTime(plot, event));
  }

  async function drawAll() {
    for (const plot of document.querySelectorAll(".plot")) {
      await draw(plot);
      await new Promise((next) => setTimeout(next, 0));
    }
    document.body.dataset.drawn = String(drawn.size);
  }

  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => location.reload());
  drawAll();
})();
