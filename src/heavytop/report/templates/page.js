"use strict";
// Charts that zoom: the wheel once one was clicked on, plus and minus; dragging moves what is
// zoomed, a double click or 0 puts it back.
for (const box of document.querySelectorAll(".chart")) {
  const picture = box.firstElementChild;
  let scale = 1, x = 0, y = 0, held = null;
  const show = () => {
    x = Math.min(0, Math.max(x, picture.offsetWidth * (1 - scale)));
    y = Math.min(0, Math.max(y, picture.offsetHeight * (1 - scale)));
    picture.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
    box.classList.toggle("zoomed", scale > 1);
  };
  const zoom = (by, a = picture.offsetWidth / 2, b = picture.offsetHeight / 2) => {
    const next = Math.min(20, Math.max(1, scale * by));
    [x, y, scale] = [a - ((a - x) * next) / scale, b - ((b - y) * next) / scale, next];
    show();
  };
  const KEYS = { "+": () => zoom(1.25), "=": () => zoom(1.25), "-": () => zoom(0.8),
    0: () => zoom(0) };
  box.addEventListener("wheel", (event) => {
    if (document.activeElement !== box) return;
    event.preventDefault();
    const place = box.getBoundingClientRect();
    zoom(Math.exp(-event.deltaY / 400), event.clientX - place.left + box.scrollLeft,
      event.clientY - place.top);
  }, { passive: false });
  box.addEventListener("keydown", (event) => {
    if (!KEYS[event.key] || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  box.addEventListener("dblclick", () => zoom(0));
  box.addEventListener("pointerdown", (event) => {
    if (scale === 1 || event.pointerType === "touch") return;
    held = [event.clientX - x, event.clientY - y];
    box.setPointerCapture(event.pointerId);
  });
  box.addEventListener("pointermove", (event) => {
    if (!held) return;
    [x, y] = [event.clientX - held[0], event.clientY - held[1]];
    show();
  });
  box.addEventListener("pointerup", () => { held = null; });
}
// The numbers behind a figure stand in the page once, as JSON: as a table when it is opened, and
// as a file, JSON as they are, or CSV of the first of them, which is a list or columns.
{
  const MOST = 60; // rows of a table, evenly spaced; a file has all
  const heads = JSON.parse(document.getElementById("headings").textContent);
  const rows = (one) => { // as many as the longest list has values; what has none is one row
    const entries = Object.entries(one).filter(([, x]) => x === null || typeof x !== "object" ||
      Array.isArray(x));
    const lists = entries.filter(([, x]) => Array.isArray(x)).map(([, x]) => x.length);
    return Array.from({ length: lists.length ? Math.max(...lists) : 1 }, (_, k) =>
      Object.fromEntries(entries.flatMap(([name, x]) => {
        const value = Array.isArray(x) ? x[k] : x;
        if (Array.isArray(value)) return value.map((y, j) => [`${name}_${j + 1}`, y]);
        return value !== null && typeof value === "object" ? [] : [[name, value]];
      })));
  };
  const table = (found) => {
    const all = (Array.isArray(found) ? found : [found]).flatMap(rows);
    return [[...new Set(all.flatMap((row) => Object.keys(row)))], all];
  };
  const quoted = (value) => {
    if (value === null || value === undefined) return "";
    if (typeof value !== "string") return String(value);
    const text = /^[=+\-@\t]/.test(value) ? `'${value}` : value; // no program takes it for a formula
    return /[",\n\r]/.test(text) || text !== value ? `"${text.replaceAll('"', '""')}"` : text;
  };
  const csv = ([names, all]) => [names.map(quoted).join(","),
    ...all.map((row) => names.map((name) => quoted(row[name])).join(",")), ""].join("\r\n");
  const cell = (value) => {
    if (value === null || value === undefined || value === "") return "–";
    return typeof value === "number" ? String(Number(value.toPrecision(6))) : String(value);
  };
  const save = (name, text, type) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  for (const part of document.querySelectorAll("details.numbers")) {
    const [place, keys] = [part.querySelector("table"), part.dataset.keys.split(" ")];
    const read = () => JSON.parse(document.getElementById(part.dataset.of).textContent);
    part.addEventListener("toggle", () => {
      if (place.rows.length) return;
      const [names, all] = table(read()[keys[0]]);
      const some = all.filter((_, k) => k % Math.ceil(all.length / MOST) === 0);
      const put = (row, kind, text) => {
        row.append(Object.assign(document.createElement(kind), { textContent: text }));
      };
      const head = place.createTHead().insertRow(), body = place.createTBody();
      for (const name of names) put(head, "th", heads[name] ?? name.replaceAll("_", " "));
      for (const each of some) {
        const row = body.insertRow();
        for (const name of names) put(row, "td", cell(each[name]));
      }
      const left = all.length - some.length;
      if (left) place.createCaption().textContent = `${left} more rows are in the files.`;
    });
    for (const button of part.querySelectorAll("button")) {
      button.addEventListener("click", () => {
        const all = read(), name = `${part.closest("figure").id}-data`;
        const chosen = Object.fromEntries(keys.map((key) => [key, all[key]]));
        if (button.dataset.as === "csv") save(`${name}.csv`, csv(table(all[keys[0]])), "text/csv");
        else save(`${name}.json`, JSON.stringify(chosen), "application/json");
      });
    }
  }
}
