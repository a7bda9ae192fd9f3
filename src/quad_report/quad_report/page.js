"use strict";
// Draws every figure of the page with plotly, shows or hides a run in all at once, and moves one time through all.
(function () {
  const report = JSON.parse(document.getElementById("report-data").textContent);
  const config = { responsive: true, displaylogo: false, toImageButtonOptions: { format: "svg" } };
  const phone = window.innerWidth <= 600, plots = [], viewers = [], boxes = new Map();
  if (phone) config.displayModeBar = false;
  let linking = false, cursor = null;

  // Letters take the page's own colour; on a phone axes get the room that titles and margins take on a desk.
  function fitted(layout) {
    layout.font.color = getComputedStyle(document.body).color;
    const sheet = getComputedStyle(document.querySelector("figure")).backgroundColor;
    for (const label of layout.annotations || []) label.bgcolor = sheet;
    if (phone) {
      layout.font.size = 10;
      Object.assign(layout.margin, { l: 52, r: 8, b: 36 });
    }
    return layout;
  }

  const shown = (run) => !boxes.has(run) || boxes.get(run).checked;

  function apply(run) {
    for (const viewer of viewers) viewer.show(run, shown(run));
    for (const { plot, figure } of plots) {
      const traces = figure.data.flatMap((trace, index) => (trace.meta.run === run ? [index] : []));
      if (traces.length) Plotly.restyle(plot, { visible: shown(run) ? true : "legendonly" }, traces);
    }
  }

  // One line per figure at the time of the viewer, moved without a layout; those out of sight wait.
  function moveCursor(t) {
    cursor = t;
    for (const each of plots) if (each.line && each.seen) moveLine(each);
  }

  function moveLine({ plot, line }) {
    const { xaxis } = plot._fullLayout, x = cursor === null ? -1 : xaxis.d2p(cursor);
    line.style.transform = `translateX(${x >= 0 && x <= xaxis._length ? xaxis._offset + x : -9}px)`;
  }

  function sizeLine({ plot, line }) {
    const { height, _size: margin } = plot._fullLayout;
    Object.assign(line.style, { top: `${margin.t}px`, height: `${height - margin.t - margin.b}px` });
  }

  // One time axis: what one figure shows all show, and the viewers play.
  function linkTime(source) {
    if (linking) return;
    linking = true;
    const range = source._fullLayout.xaxis.range.slice();
    for (const viewer of viewers) viewer.range(...range);
    const others = plots.filter(({ plot, line }) => line && plot !== source);
    Promise.all(others.map(({ plot }) => Plotly.relayout(plot, { "xaxis.range": range.slice() })))
      .finally(() => { linking = false; moveCursor(cursor); });
  }

  for (const box of document.querySelectorAll("#bar input[data-run]")) {
    boxes.set(box.dataset.run, box);
    box.addEventListener("change", () => apply(box.dataset.run));
  }

  function view(root) {
    const viewer = window.flightViewer(root, report[root.dataset.figure].scene);
    if (!viewer) return;
    viewers.push(viewer);
    viewer.onTime((t) => {
      moveCursor(t);
      for (const other of viewers) if (other !== viewer && viewer.state.playing && !other.state.playing) other.seek(t);
    });
  }

  async function draw(plot) {
    const figure = report[plot.dataset.figure];
    for (const trace of figure.data) if (!shown(trace.meta.run)) trace.visible = "legendonly";
    await Plotly.newPlot(plot, figure.data, fitted(figure.layout), config);
    const line = figure.time ? plot.appendChild(document.createElement("div")) : null;
    const shownPlot = { plot, figure, line, seen: false };
    plots.push(shownPlot);
    plot.on("plotly_legendclick", (event) => {
      const run = event.data[event.curveNumber].meta.run;
      if (!boxes.has(run)) return true;
      boxes.get(run).checked = !boxes.get(run).checked;
      apply(run);
      return false;
    });
    if (!line) return;
    line.className = "cursor";
    sizeLine(shownPlot);
    plot.on("plotly_afterplot", () => { sizeLine(shownPlot); moveLine(shownPlot); });
    new IntersectionObserver(([entry]) => {
      shownPlot.seen = entry.isIntersecting;
      moveLine(shownPlot);
    }).observe(plot);
    plot.on("plotly_relayout", () => linkTime(plot));
    plot.on("plotly_click", (event) => { for (const viewer of viewers) viewer.seek(event.points[0].x); });
    if (plots.filter((each) => each.line).length === 1) {
      for (const viewer of viewers) viewer.range(...plot._fullLayout.xaxis.range);
    }
  }

  async function drawAll() {
    for (const root of document.querySelectorAll(".viewer")) view(root);
    for (const plot of document.querySelectorAll(".plot")) {
      await draw(plot);
      await new Promise((next) => setTimeout(next, 0));
    }
    for (const viewer of viewers) viewer.ask();
    document.body.dataset.drawn = String(plots.length + viewers.length);
  }

  window.flightViewers = viewers;
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => location.reload());
  drawAll();
})();
