// Puts a widget into every place of the page that bears its number, now and later: notebooks render outputs again when
// they are scrolled to, shown in a second view, or loaded with a kernel that still runs.

const ANSWERING = 3000; // ms after a click within which what it has brought comes into sight
const KEY = Symbol.for("labkit.live"); // each widget may come with a copy of this module; there is one watch a page

function watchOfThePage() {
  const watch = { tenants: new Map() }; // number -> { views: Map of place -> promise of its view, make }
  watch.look = () => {
    for (const tenant of watch.tenants.values()) {
      for (const [place, view] of tenant.views) {
        if (place.isConnected) continue;
        tenant.views.delete(place);
        view.then(dispose);
      }
    }
    keepFocus(watch);
    for (const place of document.querySelectorAll("[data-labkit-live]")) {
      const tenant = watch.tenants.get(place.dataset.labkitLive);
      if (tenant && !tenant.views.has(place)) tenant.views.set(place, tenant.make(place));
    }
  };
  const isNode = (node) => node.nodeType === Node.ELEMENT_NODE;
  new MutationObserver((records) => {
    if (records.some((r) => [...r.addedNodes].some(isNode) || [...r.removedNodes].some(isNode))) watch.look();
  }).observe(document.body, { childList: true, subtree: true });
  return watch;
}

/** What had the focus is gone, such as the button of an answer: its place has it now, and Tab goes on from there. */
function keepFocus(watch) {
  const { node, place } = watch.focused ?? {};
  if (!node || node.isConnected || !place.isConnected || document.activeElement !== document.body) return;
  place.tabIndex = -1;
  place.style.outline = "none";
  place.focus({ preventScroll: true });
}

/** From now on the focus in a place is remembered, and what a click in it brings comes into sight as it grows. */
function attend(place, watch) {
  let clicked = -Infinity;
  place.addEventListener("focusin", (event) => { watch.focused = { node: event.target, place }; });
  place.addEventListener("focusout", (event) => { if (event.relatedTarget) watch.focused = null; });
  place.addEventListener("click", (event) => { if (!event.target.closest(".labkit-stage")) clicked = performance.now(); });
  new ResizeObserver(() => {
    if (performance.now() - clicked < ANSWERING) place.querySelector(".labkit-stage")?.scrollIntoView({ block: "nearest" });
  }).observe(place);
}

function dispose(view) {
  const widget = view?.luminoWidget;
  if (!widget) return view?.remove();
  document.body.append(widget.node); // Lumino takes down only what stands in the page
  widget.dispose();
}

/** A view of the child in a place; what was stored of it disappears meanwhile. */
async function makeView(model, place) {
  const manager = model.widget_manager;
  const child = await manager.get_model(model.get("child"));
  const view = await manager.create_view(child);
  if (!place.isConnected) return view;
  const still = `[data-labkit-still="${model.get("place")}"]`;
  const rule = document.createElement("style");
  rule.textContent = `${still}, .jp-OutputArea-child:has(${still}) { display: none; }`;
  place.replaceChildren(rule);
  attend(place, window[KEY]);
  if (view.luminoWidget) view.luminoWidget.constructor.attach(view.luminoWidget, place);
  else place.append(view.el);
  return view;
}

function initialize({ model }) {
  window[KEY] ??= watchOfThePage();
  const watch = window[KEY];
  const number = model.get("place");
  watch.tenants.set(number, { views: new Map(), make: (place) => makeView(model, place) });
  watch.look();
  return () => {
    for (const view of watch.tenants.get(number).views.values()) view.then(dispose);
    watch.tenants.delete(number);
  };
}

export default { initialize };
