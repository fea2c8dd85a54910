"use strict";
// The numbers behind a figure, as a file: JSON as they are, or CSV of their list or columns.
(() => {
  const quoted = (value) => {
    if (value === null || value === undefined) return "";
    if (typeof value !== "string") return String(value);
    const text = /^[=+\-@\t]/.test(value) ? "'" + value : value; // no program takes it for a formula
    return /[",\n\r]/.test(text) || text !== value ? '"' + text.replaceAll('"', '""') + '"' : text;
  };
  // What has lists is as many rows as the longest has values; what has none is one row.
  const rows = (one) => {
    const entries = Object.entries(one).filter(([, x]) => x === null || typeof x !== "object" ||
      Array.isArray(x));
    const lists = entries.filter(([, x]) => Array.isArray(x)).map(([, x]) => x.length);
    return Array.from({ length: lists.length ? Math.max(...lists) : 1 }, (_, k) =>
      Object.fromEntries(entries.flatMap(([name, x]) => {
        const value = Array.isArray(x) ? x[k] : x;
        return Array.isArray(value) ? value.map((y, j) => [name + "_" + (j + 1), y])
          : [[name, value]];
      })));
  };
  const csv = (found) => {
    const all = (Array.isArray(found) ? found : [found]).flatMap(rows);
    const heads = [...new Set(all.flatMap((row) => Object.keys(row)))];
    const lines = all.map((row) => heads.map((head) => quoted(row[head])).join(","));
    return [heads.map(quoted).join(","), ...lines, ""].join("\r\n");
  };
  const save = (name, text, type) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  for (const button of document.querySelectorAll("button.save")) {
    const { of, as, list } = button.dataset;
    button.addEventListener("click", () => {
      const text = document.getElementById(of).textContent;
      if (as === "json") { save(of + ".json", text, "application/json"); return; }
      const found = JSON.parse(text);
      save(of + ".csv", csv(list ? found[list] : found), "text/csv");
    });
  }
})();
