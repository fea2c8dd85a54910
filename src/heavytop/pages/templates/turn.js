"use strict";
// The critical set as surfaces and lines that can be turned, drawn when it is asked for.
for (const button of document.querySelectorAll("button.turn")) {
  button.addEventListener("click", () => {
    const found = JSON.parse(document.getElementById(button.dataset.of).textContent);
    const place = document.createElement("div");
    place.className = "plot";
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
