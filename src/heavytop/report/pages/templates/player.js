"use strict";
(() => {
  const byId = (name) => document.getElementById("player-" + name);
  const tops = JSON.parse(byId("data").textContent);
  const [plot, words, slider, choice, play] = ["plot", "words", "frame", "run", "play"].map(byId);
  const SECONDS = 20; // all frames take so long
  const SEEN = 1.3; // rad from picture to picture: a larger turn of the body is not seen as one
  const STILL = 1; // s from picture to picture where less motion is asked for
  const SECTORS = 32;
  const MARKED = SECTORS / 4; // sectors of another colour, so that the spin is seen
  const RADIUS = 0.42, HEIGHT = 0.72;
  const EVENTS = {
    theta_min: ["axis highest", "circle-open", "#009E73"],
    theta_max: ["axis lowest", "square-open", "#D55E00"],
    reversal: ["precession reverses", "diamond-open", "#CC79A7"],
    cusp: ["cusp", "x", "#E69F00"],
  };
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  let top = tops[0], places = [], frame = 0, playing = null, drawing = false;

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
      const marked = tip ? "#F5B335" : "#E69F00";
      faces.facecolor.push(s < MARKED ? marked : tip ? "#C9D3DC" : "#9AA8B5");
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

  const dark = matchMedia("(prefers-color-scheme: dark)");
  const colours = () => (dark.matches
    ? { axis: "#FFFFFF", path: "#56B4E9", rest: "#4F7186", momentum: "#E58BC0", faint: "#5D6771" }
    : { axis: "#111111", path: "#0072B2", rest: "#9CC3DB", momentum: "#A5286F", faint: "#9AA4AE" });
  const lines = ([x, y, z], name, color, width, more = {}) => ({
    type: "scatter3d", mode: "lines", x, y, z, name, hoverinfo: "skip",
    line: { color, width }, ...more,
  });
  const moving = (at) => [
    columns(corners.map((corner) => turned(at, corner))),
    columns([[0, 0, 0], places[at]]),
    columns(places.slice(0, at + 1)),
    columns([[0, 0, 0], momentum(at)]),
    columns(places.slice(at)),
  ];
  const eventTraces = () => Object.entries(EVENTS).flatMap(([kind, [name, symbol, color]]) => {
    const found = top.events.filter((event) => event.kind === kind);
    if (!found.length) return [];
    const [x, y, z] = columns(found.map((event) => event.axis));
    return [{
      type: "scatter3d", mode: "markers", x, y, z, name, marker: { symbol, color, size: 5 },
      text: found.map((event) => "t = " + event.t.toPrecision(6) + " s"), hoverinfo: "text+name",
    }];
  });
  const traces = () => {
    const [body, stick, trail, arrow, rest] = moving(frame), ink = colours();
    return [
      { type: "mesh3d", x: body[0], y: body[1], z: body[2], ...faces, flatshading: true,
        hoverinfo: "skip", lighting: { ambient: 0.85, diffuse: 0.6, specular: 0.05 } },
      lines(stick, "axis", ink.axis, 8),
      lines(trail, "path of the axis so far", ink.path, 6),
      { ...lines(arrow, "angular momentum", ink.momentum, 7), mode: "lines+markers",
        marker: { color: ink.momentum, size: [0, 7], symbol: "diamond" } },
      lines(rest, "path to come", ink.rest, 3),
      lines(sphere(), "sphere", ink.faint, 1, { showlegend: false, opacity: 0.4 }),
      lines([[0, 0], [0, 0], [-1.1, 1.25]], "vertical", ink.faint, 3,
        { line: { color: ink.faint, width: 3, dash: "dash" } }),
      ...eventTraces(),
    ];
  };
  const MOVING = [0, 1, 2, 3, 4];

  // Where the axis first leans to; it is looked at from the side, so that the tilt is seen.
  const lean = () => {
    const level = places.map(([x, y]) => [x, y, Math.hypot(x, y)]);
    const most = level.reduce((one, other) => (other[2] > one[2] ? other : one));
    const [x, y, far] = level.find((each) => each[2] > 0.05) ?? most;
    return far > 1e-3 ? [x / far, y / far] : [0, -1];
  };
  const camera = () => {
    const [x, y] = lean(), turn = 0.35; // a little from before, so that the path is no line
    const mean = places.reduce((sum, place) => sum + place[2], 0) / count();
    const [a, b] = [y * Math.cos(turn) + x * Math.sin(turn), -x * Math.cos(turn) + y * Math.sin(turn)];
    const far = 1.42 - 0.25 * mean * mean; // nearer to what stays near a pole
    return { eye: { x: far * a, y: far * b, z: mean < -0.3 ? 0.15 : 0.55 },
      center: { x: 0, y: 0, z: 0.18 * mean * Math.abs(mean) } };
  };
  const layout = () => {
    const hidden = { visible: false, range: [-1.2, 1.2] };
    const ink = getComputedStyle(document.body).color;
    return {
      uirevision: top.id, margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)",
      font: { color: ink, size: 12 }, legend: { orientation: "h", y: 0, yanchor: "top" },
      modebar: { bgcolor: "rgba(0,0,0,0)", color: ink, activecolor: ink },
      scene: { xaxis: hidden, yaxis: hidden, zaxis: hidden, aspectmode: "cube", camera: camera() },
    };
  };
  const CONFIG = { responsive: true, displaylogo: false, displayModeBar: true, plotlyServerURL: "",
    modeBarButtons: [["toImage", "resetCameraDefault3d"]] };

  const span = () => Math.abs(top.t[count() - 1] - top.t[0]);
  const time = (at) => { // digits enough to tell a frame from the next
    const places = 4 - Math.floor(Math.log10(span() || 1));
    return top.t[at].toFixed(Math.max(0, Math.min(12, places))) + " s";
  };
  const pace = () => { // by how much time is stretched: as asked for, or as this browser manages
    const asked = span() > 0 ? SECONDS / span() : 1;
    if (!playing || !(playing.taken > 1)) return asked;
    const done = Math.abs(top.t[frame] - top.t[playing.first]);
    return done > 0 ? playing.taken / done : asked;
  };
  const paceWords = () => {
    const slow = pace();
    if (slow > 0.95 && slow < 1.05) return "Played as fast as it is.";
    return slow > 1 ? "Time is slowed " + number(slow) + " times."
      : "Time is run " + number(1 / slow) + " times faster.";
  };
  const number = (x) => Number(x.toPrecision(2)).toLocaleString("en", { useGrouping: false });
  const tell = () => {
    const near = top.events.filter((event) => event.frame === frame && EVENTS[event.kind]);
    const tilt = (Math.acos(Math.max(-1, Math.min(1, places[frame][2]))) * 180) / Math.PI;
    const part = span() < 0.999 * Math.abs(top.end)
      ? " Shown are the first " + Number(span().toPrecision(3)) + " s of "
        + Number(Math.abs(top.end).toPrecision(3)) + " s." : "";
    words.textContent = "t = " + time(frame) + ", θ = " + tilt.toFixed(1) + "°, frame "
      + (frame + 1) + " of " + count() + ". " + paceWords() + part
      + " Angle of spin from " + top.spin + "."
      + (top.per_frame > SEEN ? " It turns too far from frame to frame to be seen as it is." : "")
      + (near.length ? " Event: " + near.map((event) => EVENTS[event.kind][0]).join(", ") + "." : "");
  };
  const show = async (at) => {
    frame = Math.max(0, Math.min(count() - 1, Math.round(at)));
    slider.value = String(frame);
    slider.setAttribute("aria-valuetext", "t = " + time(frame));
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
    playing = null;
    play.textContent = "Play";
    play.setAttribute("aria-pressed", "false");
    tell();
  };
  // A slow browser leaves frames out, but never so many that the spin is not seen; then it takes
  // longer, and the pace that is told is what it took.
  const tick = async (now) => {
    const run = playing;
    if (!run) return;
    const gone = run.last === 0 ? 0 : (now - run.last) / 1000;
    if (run.last !== 0 && calm.matches && gone < STILL) { requestAnimationFrame(tick); return; }
    const most = calm.matches ? Infinity : Math.max(1, Math.floor(SEEN / top.per_frame));
    run.last = now;
    run.taken += gone;
    run.at = Math.min(run.at + Math.min(gone * (count() / SECONDS), most), count() - 1);
    if (Math.round(run.at) !== frame) await show(run.at);
    if (playing !== run) return;
    if (frame >= count() - 1) pause();
    else requestAnimationFrame(tick);
  };
  const toggle = () => {
    if (playing) { pause(); return; }
    if (frame >= count() - 1) frame = 0;
    playing = { first: frame, at: frame, last: 0, taken: 0 };
    play.textContent = "Pause";
    play.setAttribute("aria-pressed", "true");
    requestAnimationFrame(tick);
  };
  const zoom = (by) => zoomed(plot, plot.layout.scene.camera.eye, by);
  const to = (at) => { pause(); show(at); };
  const nextEvent = () => {
    const later = top.events.filter((event) => event.frame > frame).map((event) => event.frame);
    to(later.length ? Math.min(...later) : 0);
  };
  const choose = async () => {
    top = tops[choice.selectedIndex];
    places = top.t.map((_, at) => axis(at));
    frame = 0;
    pause();
    slider.max = String(count() - 1);
    slider.value = "0";
    byId("event").disabled = !top.events.length;
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
  slider.addEventListener("input", () => to(Number(slider.value)));
  play.addEventListener("click", toggle);
  byId("back").addEventListener("click", () => to(frame - 1));
  byId("forward").addEventListener("click", () => to(frame + 1));
  byId("event").addEventListener("click", nextEvent);
  plot.addEventListener("keydown", (event) => {
    const act = { ArrowRight: () => to(frame + 1), ArrowLeft: () => to(frame - 1),
      PageDown: () => to(frame + 30), PageUp: () => to(frame - 30), Home: () => to(0),
      End: () => to(count() - 1), e: nextEvent, " ": toggle, "+": () => zoom(0.9),
      "-": () => zoom(1 / 0.9) }[event.key];
    if (!act || event.target !== plot || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    act();
  });
  dark.addEventListener("change", () => Plotly.react(plot, traces(), layout(), CONFIG));
  choose();
})();
