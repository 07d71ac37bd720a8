// Starts the parts of the page that the report has data for.

const element = (id) => document.getElementById(id);

function prepareView(data, surface) {
  const canvas = element("canvas");
  const renderer = Renderer.on(canvas, surface);
  if (!renderer) return null;
  element("viewer").hidden = false;
  element("view-controls").hidden = false;
  element("view-missing").hidden = true;
  const camera = new Camera(surface, data.wound);
  let at = { state: 0, next: 0, part: 0 };
  let waiting = false;

  const color = () => document.querySelector("input[name=color]:checked").value;
  const labels = () => {
    const { right, up } = camera.axes();
    const away = (direction) => direction.map((c) => -c);
    const sides = { right, left: away(right), top: up, bottom: away(up) };
    for (const [side, direction] of Object.entries(sides))
      element(`edge-${side}`).textContent = Camera.letters(direction).slice(0, 2).join("");
    const mmPerPixel = camera.size / Math.min(canvas.clientWidth, canvas.clientHeight);
    const length = roundBelow(mmPerPixel * 140);
    element("scale-text").textContent = `${length} mm`;
    element("scale-bar").style.width = `${length / mmPerPixel}px`;
    element("legend").hidden = color() !== "moved" || surface.about.most_mm === 0;
    const most = surface.most(at.state, at.next, at.part).toFixed(1);
    element("view-text").textContent =
      `The skin seen from ${camera.place()}, ${camera.size.toFixed(0)} mm across. Largest displacement: ${most} mm.`;
  };
  const draw = () => {
    waiting = false;
    renderer.draw(at, camera, color() === "moved");
    labels();
  };
  const redraw = () => {
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  };
  const gradient = SCALE.map((rgb) => `rgb(${rgb.join(" ")})`).join(", ");
  element("legend-bar").style.background = `linear-gradient(to top, ${gradient})`;
  element("legend-most").textContent = surface.about.most_mm.toFixed(1);
  element("legend").setAttribute("aria-label", `Colors of the displacement: light for 0, dark for ${surface.about.most_mm.toFixed(1)} mm`);
  camera.follow(canvas, redraw);
  for (const button of document.querySelectorAll("[data-view]"))
    button.addEventListener("click", () => camera.look(button.dataset.view) || redraw());
  for (const button of document.querySelectorAll("[data-key]"))
    button.addEventListener("click", () => camera.key(button.dataset.key, false) && redraw());
  for (const input of document.querySelectorAll("input[name=color]")) input.addEventListener("change", redraw);
  if (!data.wound) document.querySelector("[data-view=wound]").hidden = true;
  new ResizeObserver(redraw).observe(element("stage"));
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => renderer.prepare() || redraw());
  return (now) => {
    at = now;
    redraw();
  };
}

prepareComparisons();
if (element("data")) {
  const data = JSON.parse(element("data").textContent);
  const surface = new Surface(data.surface, element("surface").textContent);
  let show = null;
  try {
    show = prepareView(data, surface);
  } catch (error) {
    // The pictures stay.
    console.error(error);
  }
  const player = new Player(data, (at) => show && show(at));
  player.followPlots();
  player.show();
}
