// Slices before and after in one place, with a slider between them.

function prepareComparisons() {
  for (const figure of document.querySelectorAll(".compare")) {
    const [label, slider] = [figure.querySelector("label"), figure.querySelector("input")];
    const two = figure.querySelector(".two");
    const after = two.querySelectorAll("img")[1];
    const edge = two.appendChild(document.createElement("span"));
    edge.className = "edge";
    const show = () => {
      // The state after is on the right of the edge.
      const left = 100 - Number(slider.value);
      after.style.clipPath = `inset(0 0 0 ${left}%)`;
      edge.style.left = `${left}%`;
    };
    const follow = (event) => {
      if (!(event.buttons & 1)) return;
      const box = two.getBoundingClientRect();
      slider.value = 100 - (100 * (event.clientX - box.left)) / box.width;
      show();
    };
    two.addEventListener("pointerdown", follow);
    two.addEventListener("pointermove", follow);
    two.addEventListener("dragstart", (event) => event.preventDefault());
    slider.addEventListener("input", show);
    label.hidden = false;
    figure.classList.add("ready");
    show();
  }
}
