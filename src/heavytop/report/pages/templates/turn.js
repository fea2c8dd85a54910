"use strict";
// Rolling zooms a picture that was clicked on; over any other the page is rolled on.
document.addEventListener("wheel", (event) => {
  const plot = event.target.closest?.(".plot");
  if (plot && !plot.contains(document.activeElement)) event.stopPropagation();
}, { capture: true, passive: true });
document.addEventListener("pointerdown", (event) => {
  event.target.closest?.(".plot")?.focus({ preventScroll: true });
}, { capture: true });
// Two fingers zoom: the library that draws gives them no meaning.
const apart = ([one, two]) => Math.hypot(one.clientX - two.clientX, one.clientY - two.clientY);
const zoomed = (plot, from, by) => {
  const eye = Object.fromEntries(Object.entries(from).map(([name, x]) => [name, x * by]));
  return Plotly.relayout(plot, { "scene.camera.eye": eye });
};
let pinch = null;
document.addEventListener("touchstart", (event) => {
  const plot = event.target.closest?.(".plot");
  if (!plot || event.touches.length !== 2) return;
  event.stopPropagation();
  pinch = { plot, apart: apart(event.touches), eye: plot.layout.scene.camera.eye, busy: false };
}, { capture: true, passive: true });
document.addEventListener("touchmove", async (event) => {
  if (!pinch || event.touches.length !== 2) return;
  event.preventDefault();
  event.stopPropagation();
  if (pinch.busy) return;
  pinch.busy = true;
  const by = pinch.apart / Math.max(1, apart(event.touches));
  await zoomed(pinch.plot, pinch.eye, Math.min(4, Math.max(0.25, by)));
  if (pinch) pinch.busy = false;
}, { capture: true, passive: false });
document.addEventListener("touchend", (event) => {
  if (event.touches.length < 2) pinch = null;
}, { capture: true, passive: true });
// The critical set as surfaces and lines that can be turned, drawn when it is asked for.
for (const button of document.querySelectorAll("button.turn")) {
  button.addEventListener("click", () => {
    const found = JSON.parse(document.getElementById(button.dataset.of).textContent);
    const place = document.createElement("div");
    place.className = "plot";
    place.tabIndex = 0;
    place.setAttribute("role", "group");
    place.setAttribute("aria-label", "The critical set in three dimensions, to be turned");
    button.parentElement.replaceWith(place);
    const ink = getComputedStyle(document.body).color;
    const colours = { sleeping: "#000000", thread: "#D55E00", hanging: "#009E73" };
    const sheets = found.sheets.map((sheet, k) => ({
      type: "surface", x: sheet.p_psi, y: sheet.p_phi, z: sheet.E_prime, showscale: false,
      opacity: 0.75, name: "steady precession", hoverinfo: "x+y+z",
      colorscale: [[0, k ? "#56B4E9" : "#0072B2"], [1, k ? "#B8E0F5" : "#8AB6D6"]],
    }));
    // Sleeping tops lie on both sides of the thread: no line across it.
    const apart = (values) => values.flatMap((value, k) =>
      k && found.sleeping.p_psi[k - 1] < 0 && found.sleeping.p_psi[k] > 0 ? [null, value] : [value]);
    for (const name of ["p_phi", "E_prime"]) found.sleeping[name] = apart(found.sleeping[name]);
    found.sleeping.p_psi = apart(found.sleeping.p_psi);
    const lines = Object.entries(colours).map(([name, color]) => ({
      type: "scatter3d", mode: "lines", x: found[name].p_psi, y: found[name].p_phi,
      z: found[name].E_prime, name, line: { color, width: 7 }, hoverinfo: "name+x+y+z",
    }));
    const axis = (text) => ({ title: { text }, color: ink });
    Plotly.newPlot(place, [...sheets, ...lines], {
      margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", font: { color: ink },
      legend: { orientation: "h", y: 0, yanchor: "top" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: ink, activecolor: ink },
      scene: { xaxis: axis("p_ψ [kg m²/s]"), yaxis: axis("p_φ [kg m²/s]"), zaxis: axis("E′ [J]"),
        aspectmode: "cube", camera: { eye: { x: 0.6, y: -2.0, z: 0.8 } } },
    }, { responsive: true, displaylogo: false, plotlyServerURL: "",
      modeBarButtons: [["toImage", "resetCameraDefault3d"]] });
  });
}
