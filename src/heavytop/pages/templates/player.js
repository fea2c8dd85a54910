"use strict";
(() => {
  const byId = (name) => document.getElementById("player-" + name);
  const tops = JSON.parse(byId("data").textContent);
  const [plot, words, slider, choice, play] = ["plot", "words", "frame", "run", "play"].map(byId);
  const SECONDS = 20; // all frames take so long
  const SECTORS = 32;
  const MARKED = SECTORS / 4; // sectors of another colour, so that the spin is seen
  const RADIUS = 0.42, HEIGHT = 0.72;
  const EVENTS = {
    theta_min: ["axis highest", "circle-open", "#009E73"],
    theta_max: ["axis lowest", "square-open", "#D55E00"],
    reversal: ["precession reverses", "diamond-open", "#CC79A7"],
    cusp: ["cusp", "x", "#E69F00"],
  };
  let top = tops[0], frame = 0, playing = false, begun = 0, drawing = false;

  const hasWebGL = () => {
    const canvas = document.createElement("canvas");
    return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
  };

  // The body in its own frame: a cone on its tip, closed by a disc; the tip is the pivot.
  const corners = [[0, 0, 0], [0, 0, HEIGHT]];
  const faces = { i: [], j: [], k: [], facecolor: [] };
  for (let s = 0; s < SECTORS; s += 1) {
    const angle = (2 * Math.PI * s) / SECTORS;
    corners.push([RADIUS * Math.cos(angle), RADIUS * Math.sin(angle), HEIGHT]);
    const here = 2 + s, next = 2 + ((s + 1) % SECTORS);
    for (const tip of [0, 1]) {
      faces.i.push(tip);
      faces.j.push(tip ? here : next);
      faces.k.push(tip ? next : here);
      faces.facecolor.push(s < MARKED ? "#D55E00" : tip ? "#9CC9E8" : "#5AA9D6");
    }
  }

  const count = () => top.t.length;
  const turned = (at, [x, y, z]) => {
    const [w, a, b, c] = top.quaternion.slice(4 * at, 4 * at + 4);
    const u = 2 * (b * z - c * y), v = 2 * (c * x - a * z), r = 2 * (a * y - b * x);
    return [x + w * u + b * r - c * v, y + w * v + c * u - a * r, z + w * r + a * v - b * u];
  };
  const axis = (at) => turned(at, [0, 0, 1]);
  const columns = (rows) => [0, 1, 2].map((k) => rows.map((row) => row[k]));
  const path = (last) => columns(Array.from({ length: last + 1 }, (_, at) => axis(at)));
  const momentum = (at) => top.momentum.slice(3 * at, 3 * at + 3).map((x) => 1.15 * x);

  const sphere = () => {
    const rows = [];
    const ring = (place) => {
      for (let k = 0; k <= 72; k += 1) rows.push(place((2 * Math.PI * k) / 72));
      rows.push([null, null, null]);
    };
    for (const tilt of [30, 60, 90, 120, 150].map((d) => (d * Math.PI) / 180)) {
      ring((a) => [Math.sin(tilt) * Math.cos(a), Math.sin(tilt) * Math.sin(a), Math.cos(tilt)]);
    }
    for (const turn of [0, 60, 120].map((d) => (d * Math.PI) / 180)) {
      ring((a) => [Math.sin(a) * Math.cos(turn), Math.sin(a) * Math.sin(turn), Math.cos(a)]);
    }
    return columns(rows);
  };

  const lines = ([x, y, z], name, colour, width, more = {}) => ({
    type: "scatter3d", mode: "lines", x, y, z, name, hoverinfo: "skip",
    line: { color: colour, width }, ...more,
  });
  const moving = (at) => [
    columns(corners.map((corner) => turned(at, corner))),
    columns([[0, 0, 0], axis(at)]),
    path(at),
    columns([[0, 0, 0], momentum(at)]),
  ];
  const eventTraces = () => Object.entries(EVENTS).flatMap(([kind, [name, symbol, color]]) => {
    const found = top.events.filter((event) => event.kind === kind);
    if (!found.length) return [];
    const [x, y, z] = columns(found.map((event) => event.axis));
    return [{
      type: "scatter3d", mode: "markers", x, y, z, name, marker: { symbol, color, size: 4 },
      text: found.map((event) => "t = " + event.t.toPrecision(6) + " s"), hoverinfo: "text+name",
    }];
  });
  const traces = () => {
    const [body, stick, trail, arrow] = moving(frame);
    return [
      { type: "mesh3d", x: body[0], y: body[1], z: body[2], ...faces, flatshading: true,
        hoverinfo: "skip", lighting: { ambient: 0.9, diffuse: 0.5, specular: 0.05 } },
      lines(stick, "axis", "#0072B2", 6),
      lines(trail, "path of the axis so far", "#0072B2", 5),
      { ...lines(arrow, "angular momentum", "#882255", 6), mode: "lines+markers",
        marker: { color: "#882255", size: [0, 6], symbol: "diamond" } },
      lines(path(count() - 1), "whole path", "#8AB6D6", 2),
      lines(sphere(), "sphere", "#9AA4AE", 1, { showlegend: false, opacity: 0.35 }),
      lines([[0, 0], [0, 0], [-1.1, 1.25]], "vertical", "#6B7280", 2,
        { showlegend: false, line: { color: "#6B7280", width: 2, dash: "dash" } }),
      ...eventTraces(),
    ];
  };
  const MOVING = [0, 1, 2, 3];

  const layout = () => {
    const hidden = { visible: false, range: [-1.2, 1.2] };
    const ink = getComputedStyle(document.body).color;
    let mean = 0; // of the height of the axis: what moves is in the middle of the picture
    for (let at = 0; at < count(); at += 1) mean += axis(at)[2] / count();
    return {
      uirevision: "kept", margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, size: 12 }, legend: { orientation: "h", y: 0, yanchor: "top" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: ink, activecolor: ink },
      scene: { xaxis: hidden, yaxis: hidden, zaxis: hidden, aspectmode: "cube",
        camera: { eye: { x: 0.2, y: -1.3, z: 0.5 + 0.2 * mean },
          center: { x: 0, y: 0, z: 0.12 * mean } } },
    };
  };
  const CONFIG = { responsive: true, displaylogo: false, plotlyServerURL: "",
    modeBarButtons: [["toImage", "resetCameraDefault3d"]] };

  const tell = () => {
    const span = Math.abs(top.t[count() - 1] - top.t[0]);
    const slow = span > 0 ? SECONDS / span : 1;
    const near = top.events.filter((event) => event.frame === frame && EVENTS[event.kind]);
    const pace = slow >= 1 ? slow.toPrecision(2) + " times slower" : (1 / slow).toPrecision(2) +
      " times faster";
    words.textContent = "t = " + top.t[frame].toFixed(4) + " s, frame " + (frame + 1) + " of " +
      count() + "; played " + pace + " than it is. Angle of spin from " + top.spin + "." +
      (top.per_frame > 1.5 ? " It turns too far from frame to frame to be seen as it is." : "") +
      (near.length ? " Event: " + near.map((event) => EVENTS[event.kind][0]).join(", ") + "." : "");
  };
  const show = async (at) => {
    frame = Math.max(0, Math.min(count() - 1, Math.round(at)));
    slider.value = String(frame);
    slider.setAttribute("aria-valuetext", "t = " + top.t[frame].toPrecision(5) + " s");
    tell();
    if (drawing) return;
    drawing = true;
    let drawn = -1;
    while (drawn !== frame) { // the last one asked for is drawn, whatever came between
      drawn = frame;
      const parts = moving(drawn);
      await Plotly.restyle(plot, { x: parts.map((p) => p[0]), y: parts.map((p) => p[1]),
        z: parts.map((p) => p[2]) }, MOVING);
    }
    drawing = false;
  };
  const pause = () => {
    playing = false;
    play.textContent = "Play";
    play.setAttribute("aria-pressed", "false");
  };
  const tick = async (now) => {
    if (!playing) return;
    const at = begun === 0 ? frame : ((now - begun) / 1000) * (count() / SECONDS);
    if (begun === 0) begun = now - (frame * SECONDS * 1000) / count();
    await show(at);
    if (frame >= count() - 1) pause();
    else requestAnimationFrame(tick);
  };
  const toggle = () => {
    if (playing) { pause(); return; }
    if (frame >= count() - 1) frame = 0;
    playing = true;
    begun = 0;
    play.textContent = "Pause";
    play.setAttribute("aria-pressed", "true");
    requestAnimationFrame(tick);
  };
  const step = (by) => { pause(); show(frame + by); };
  const nextEvent = () => {
    pause();
    const later = top.events.filter((event) => event.frame > frame).map((event) => event.frame);
    show(later.length ? Math.min(...later) : 0);
  };
  const choose = async () => {
    pause();
    top = tops[choice.selectedIndex];
    frame = 0;
    slider.max = String(count() - 1);
    slider.value = "0";
    await Plotly.react(plot, traces(), layout(), CONFIG);
    tell();
  };

  for (const each of tops) choice.add(new Option(each.title, each.id));
  if (!hasWebGL()) {
    words.textContent = "This browser has no WebGL, which the player needs.";
    plot.style.display = "none";
    return;
  }
  choice.addEventListener("change", choose);
  slider.addEventListener("input", () => { pause(); show(Number(slider.value)); });
  play.addEventListener("click", toggle);
  byId("back").addEventListener("click", () => step(-1));
  byId("forward").addEventListener("click", () => step(1));
  byId("event").addEventListener("click", nextEvent);
  plot.addEventListener("keydown", (event) => {
    const act = { ArrowRight: () => step(1), ArrowLeft: () => step(-1), " ": toggle }[event.key];
    if (!act || event.target !== plot) return;
    event.preventDefault();
    act();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    Plotly.relayout(plot, { "font.color": getComputedStyle(document.body).color });
  });
  choose();
})();
