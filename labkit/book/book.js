// What the pages of the book do beyond being read: films, predictions, the ledger's search, light and dark, print.

const EARLY = "600px"; // films this far below the window are loaded
const PHONE = window.matchMedia("(max-width: 30rem)"); // it has films of its own, with letters that it shows large enough
const UNABLE = "This browser has no WebGL 2, which would draw and turn the figure.";

/** The drawing in space, loaded by the first figure that needs it: pages opened from a folder may load no modules. */
const space = (globalThis[Symbol.for("labkit.space")] = {
  load: () => (space.loading ??= new Promise((arrive, fail) => {
    window.labkitSpace = arrive;
    const script = element("script", "", { src: "space.js" });
    script.addEventListener("error", fail);
    document.head.append(script);
  })),
});

async function drawsSpace() {
  try {
    space.module = await space.load();
    return space.module.works();
  } catch {
    return false;
  }
}

for (const figure of document.querySelectorAll("figure[data-film]")) watch(figure);

function watch(figure) {
  const watcher = new IntersectionObserver((entries) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    watcher.disconnect();
    load(figure);
    PHONE.addEventListener("change", () => load(figure));
  }, { rootMargin: EARLY });
  watcher.observe(figure);
}

/** A film is a script that calls `labkitFilm`: pages opened from a folder may fetch nothing. */
const arrived = new Map();
window.labkitFilm = (key, film) => { arrived.set(key, film); };

const filmOf = (figure) => figure.dataset.film + (PHONE.matches ? "-narrow" : "");

function load(figure) {
  const key = filmOf(figure);
  if (arrived.has(key)) return void project(figure, key);
  const script = element("script", "", { src: `films/${key}.js` });
  script.addEventListener("load", () => project(figure, key));
  document.head.append(script);
}

const takeDown = new WeakMap(); // figure -> takes away what it shows

async function project(figure, key) {
  const film = arrived.get(key);
  const inSpace = film.declaration.spaces.length > 0;
  if (inSpace && !(await drawsSpace())) {
    figure.querySelector("figcaption small").textContent = UNABLE;
    return;
  }
  if (key !== filmOf(figure)) return; // the phone was turned meanwhile
  takeDown.get(figure)?.();
  const place = element("div");
  figure.prepend(place);
  const close = render({ model: new Projector(film), el: place });
  takeDown.set(figure, () => { close(); place.remove(); });
  const shown = new MutationObserver(() => { // the first picture is on the screen
    if (!place.querySelector(inSpace ? ".labkit-stage[data-picture] canvas[data-space=true]" : ".labkit-stage[data-picture]")) return;
    shown.disconnect();
    figure.classList.add("live");
    if (film.tracks.handle && !isInSpace(film)) place.querySelector(".picture").append(pathOf(film));
  });
  shown.observe(place, { subtree: true, attributes: true, attributeFilter: ["data-picture", "data-space"] });
}

/** Whether the ring moves in space: then the scene itself shows where it was recorded. */
function isInSpace(film) {
  const [name] = Object.keys(film.declaration.handles);
  return film.tracks.handle.notes[0].handles[name].point !== undefined;
}

/** Where the ring was recorded, as a dotted line. */
function pathOf(film) {
  const [name] = Object.keys(film.declaration.handles);
  const points = film.tracks.handle.notes.map(({ handles }) => handles[name].at.join(" "));
  const space = "http://www.w3.org/2000/svg";
  const drawing = document.createElementNS(space, "svg");
  const line = document.createElementNS(space, "polyline");
  for (const [key, value] of Object.entries({ class: "path", viewBox: "0 0 1 1", preserveAspectRatio: "none", "aria-hidden": "true" })) drawing.setAttribute(key, value);
  line.setAttribute("points", points.join(", "));
  line.setAttribute("vector-effect", "non-scaling-stroke");
  drawing.append(line);
  return drawing;
}

for (const question of document.querySelectorAll(".prediction")) {
  const answer = question.querySelector("details");
  for (const button of question.querySelectorAll(".choices button")) {
    button.addEventListener("click", () => {
      for (const other of question.querySelectorAll(".choices button")) other.removeAttribute("aria-pressed");
      button.setAttribute("aria-pressed", "true");
      answer.open = true;
      const right = button.dataset.right === "true";
      answer.querySelector("summary").textContent = right ? "That is what happens" : "Something else happens";
    });
  }
}

const search = document.querySelector("form.search");
if (search) {
  const rows = [...document.querySelectorAll(".ledger tbody tr")].map((row) => ({ row, told: row.textContent.toLowerCase() }));
  const field = (row, name) => row.querySelector(`[data-name="${name}"]`).textContent;
  const look = () => {
    const words = search.querySelector("input").value.toLowerCase().split(/\s+/).filter(Boolean);
    const chosen = [...search.querySelectorAll("select")].filter((select) => select.value !== "all");
    let count = 0;
    for (const { row, told } of rows) {
      row.hidden = !words.every((word) => told.includes(word)) || chosen.some((select) => field(row, select.name) !== select.value);
      count += !row.hidden;
    }
    search.querySelector("output").textContent = `${count} of ${rows.length} rows`;
  };
  search.hidden = false;
  search.addEventListener("input", look);
  search.addEventListener("submit", (event) => event.preventDefault());
  look();
}

const theme = document.querySelector("button.theme");
const remembered = (() => { try { return localStorage.getItem("labkit-theme"); } catch { return null; } })();
const isDark = () => isLight(getComputedStyle(document.body).color);
const choose = (name) => {
  document.documentElement.dataset.theme = name;
  theme.textContent = isDark() ? "Light" : "Dark";
};
choose(remembered ?? (window.matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
theme.hidden = false;
theme.addEventListener("click", () => {
  const name = isDark() ? "light" : "dark";
  choose(name);
  try { localStorage.setItem("labkit-theme", name); } catch { /* opened from a folder, some browsers remember nothing */ }
});

window.addEventListener("beforeprint", () => {
  for (const picture of document.querySelectorAll("img[loading=lazy]")) picture.loading = "eager";
  for (const closed of document.querySelectorAll(".prediction details:not([open])")) {
    closed.open = true;
    window.addEventListener("afterprint", () => { closed.open = false; }, { once: true });
  }
});
