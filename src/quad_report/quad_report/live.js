"use strict";
// Shows a flight whose samples come one by one; the browser connects again by itself and asks for what it missed.
(function () {
  const report = JSON.parse(document.getElementById("report-data").textContent);
  const note = document.querySelector("p.note"), root = document.querySelector(".viewer");
  document.querySelector("h1").textContent = report.name;
  const viewer = window.flightViewer(root, report);
  if (!viewer) return;
  window.flightViewers = [viewer];
  root.focus();
  const source = new EventSource("events");
  source.onopen = () => { note.textContent = "live: scrub to look back, End to come back"; };
  source.onerror = () => { note.textContent = "no connection, trying again"; };
  source.onmessage = (event) => viewer.add(JSON.parse(event.data));
  source.addEventListener("end", (event) => {
    source.close();
    note.textContent = JSON.parse(event.data);
    viewer.end(note.textContent);
  });
})();
