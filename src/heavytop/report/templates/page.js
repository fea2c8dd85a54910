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
// The numbers of a result stand in the page as JSON; a button saves them.
for (const button of document.querySelectorAll("button[data-of]")) {
  button.addEventListener("click", () => {
    const text = document.getElementById(button.dataset.of).textContent;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
    link.download = `${button.dataset.of}.json`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}
