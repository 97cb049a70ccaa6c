// The lecturer's page: one card at a time, its question first, then its Stage, then what happened; all by key.

import stage from "./stage.js";
import { element, keyOfAddress, Wire } from "./common.js";

const TWO_DIGITS = 700; // ms within which two digits are one number
const SAID_FOR = 7000; // ms that a sentence stays
const NOBODY_FOR = 45; // s without a phone until the wall says what may keep them out
const CUT = "The line to Python is cut: it is tried again until it comes back. If the terminal has ended the demo, start it again.";
const SILENT = "Python does not answer yet. The figure goes on when it does.";
const KEPT_OUT = "No phone has joined yet. The network may keep devices apart (guest networks do), or this machine's firewall does. Open a hotspot with a phone and join it with this machine, start anew, or ask for hands.";
const ALONE = "This machine is in no network that phones could share: they cannot reach it. Join one and start anew, or ask for hands.";
const KEYS = [
  ["Page Down, Page Up", "next card, the one before; with Shift: next chapter, the one before"],
  ["1 ... 9, 10 ...", "card of this number in the chapter; two digits in a row"],
  ["Enter, A", "reveal: the figure, then the answer"],
  ["O", "overview of all cards"],
  ["Tab, arrow keys", "next handle or control; move it (with Shift: ten times as far)"],
  ["P", "play, pause"],
  ["F, R", "Make it fail, Reset"],
  ["Shift+1, Shift+2", "the other buttons of the figure"],
  ["V", "vote: open, close, second round, close"],
  ["J", "how to join, large"],
  ["S", "save the votes as a file"],
  ["N", "notes in a second window, for you alone"],
  ["Q", "question line away, and back"],
  ["D", "dark, light"],
  ["Shift+R", "everything back to the start; votes stay"],
  ["Escape", "close what lies on top"],
  ["?", "these keys"],
];
const SPACE = (globalThis[Symbol.for("labkit.space")] = { load: () => import("./space.js") }); // scenes in space: stage.js
const $ = (selector) => document.querySelector(selector);

/** The drawing in space, a large file: fetched once the first figure is there, unless it is one in space. */
function getSpace() {
  if (!SPACE.module) SPACE.load().then((module) => { SPACE.module = module; }, () => {});
}

/** What is shown, and what the keys do. */
class Wall {
  constructor(program) {
    this.cards = program.cards;
    this.shown = program.now; // where the one left it who opens the page again
    this.titles = program.titles;
    this.pictures = new Set(program.pictures);
    Object.assign(this, { card: null, now: null, takeDown: null, hearers: new Set(), digits: "", begun: performance.now() });
    this.dark = (localStorage.getItem("labkit-demo-dark") ?? String(matchMedia("(prefers-color-scheme: dark)").matches)) === "true";
    this.showTheme();
    this.setLetters();
    addEventListener("resize", () => this.setLetters());
    this.wire = new Wire({
      opened: () => { this.say(""); this.open(this.card?.key ?? this.first()); },
      cut: () => this.say(CUT, true),
      heard: (message) => this.hear(message),
      seen: (message, buffers) => this.hearers.forEach((hearer) => hearer(message, buffers)),
    });
    addEventListener("hashchange", () => { if (this.card?.key !== keyOfAddress()) this.open(keyOfAddress()); });
    addEventListener("keydown", (event) => this.turnPage(event), true); // a slider would take these keys,
    addEventListener("keydown", (event) => this.revealFirst(event), true); // and a figure that can be clicked takes Enter
    addEventListener("keydown", (event) => this.press(event));
    addEventListener("click", (event) => { if (event.detail && event.target.closest("#place button")) this.focus(); }); // not again by Enter
    $("#keys-button").addEventListener("click", () => this.showKeys());
    setInterval(() => this.showJoin(), 5000);
    this.makeKeys();
    this.makeOverview();
  }

  // -- which card

  first() {
    const key = keyOfAddress();
    return key || this.shown;
  }

  byKey(key) {
    return this.cards.find((card) => card.key === key);
  }

  get chapter() {
    return this.cards.filter((card) => card.chapter === this.card?.chapter);
  }

  open(key) {
    const card = this.byKey(key);
    if (!card) {
      this.say(`There is no ${key} here.`);
      return this.card ? undefined : this.open(this.cards[0].key);
    }
    this.card = card;
    if (keyOfAddress() !== key) history.replaceState(null, "", `#${key}`);
    document.title = `${card.chapter} ${card.title}`;
    const title = this.titles[card.chapter];
    $("#where").textContent = `${Number(card.chapter) || ""} ${title}${card.heading === title ? "" : ` · ${card.heading}`}`.trim();
    $("#number").textContent = `${this.chapter.indexOf(card) + 1} of ${this.chapter.length}`;
    this.clear();
    this.show();
    this.wire.ask({ open: key });
  }

  go(by) {
    const next = this.cards[this.cards.indexOf(this.card) + by];
    if (next) this.open(next.key);
    else this.say(by > 0 ? "This was the last one." : "This is the first one.");
  }

  goChapter(by) {
    const chapters = [...new Set(this.cards.map((card) => card.chapter))];
    const wanted = chapters[chapters.indexOf(this.card.chapter) + by];
    if (wanted) this.open(this.cards.find((card) => card.chapter === wanted).key);
  }

  /** A digit, or the second of two. */
  digit(digit) {
    clearTimeout(this.typing);
    this.digits += digit;
    const go = () => {
      const card = this.chapter[Number(this.digits) - 1];
      if (card) this.open(card.key);
      else this.say(`This chapter has the numbers 1 to ${this.chapter.length}.`);
      this.digits = "";
    };
    if (this.digits.length === 2 || Number(`${this.digits}0`) > this.chapter.length) go();
    else this.typing = setTimeout(go, TWO_DIGITS);
  }

  // -- what Python says

  hear(message) {
    if (message.kind === "said") this.say(message.text);
    if (message.kind === "now") {
      this.now = message;
      this.show();
    }
    if (message.kind === "card" && message.key === this.card.key) this.mount(message);
    if (message.kind === "ahead") this.measure(message);
  }

  clear() {
    this.takeDown?.();
    this.takeDown = null;
    this.hearers.clear();
    $("#place").replaceChildren();
  }

  mount({ declaration, fault }) {
    this.clear();
    if (fault) $("#place").append(element("p", "fault", fault));
    if (!declaration) return;
    const { hearers, wire } = this;
    const to = this.card.stage;
    const model = {
      get: (name) => ({ declaration, silence: SILENT, aside: $("#aside") })[name],
      on: (event, hear) => { if (event === "msg:custom") hearers.add(hear); },
      off: (event, hear) => hearers.delete(hear),
      send: (message) => wire.send({ to, message }),
    };
    this.takeDown = stage.render({ model, el: $("#place") });
    const first = new MutationObserver(() => { first.disconnect(); this.focus(); getSpace(); }); // handles appear with the picture
    first.observe($("#place .labkit-stage"), { attributeFilter: ["data-picture"] });
  }

  /** The room that a Stage nearby will have here: Python draws it ahead in that size. */
  measure({ stage: key, declaration }) {
    const card = [1, -1].map((by) => this.cards[this.cards.indexOf(this.card) + by]).find((near) => near?.stage === key);
    if (!card) return;
    const asking = $("#bar").cloneNode(true);
    const place = $("#place").cloneNode(false);
    for (const node of [asking, place]) node.removeAttribute("id");
    $("#ahead").replaceChildren(asking, place);
    this.fill(asking, card, null);
    let look = null;
    const model = { get: (name) => (name === "declaration" ? { ...declaration, spaces: [] } : undefined), on: () => {}, off: () => {}, send: (message) => { look ??= message.look; } };
    stage.render({ model, el: place })();
    $("#ahead").replaceChildren();
    if (look) this.wire.ask({ ahead: key, look });
  }

  /** Arrow keys move the first handle at once, or drive, or turn; else the first control has them. */
  focus() {
    if ($("dialog[open]")) return;
    const first = $("#place .handle") ?? $("#place canvas[tabindex]") ?? $("#place :is(input:not([type='radio']:not(:checked)), select)");
    (first ?? document.activeElement).focus?.({ preventScroll: true });
  }

  // -- how far it is revealed

  get step() {
    return this.now?.key === this.card.key ? this.now.step : this.card.votes ? "question" : "figure";
  }

  /** What Enter reveals; nothing after an opinion, which has no answer. */
  get next() {
    const steps = ["question", ...(this.card.stage ? ["figure"] : []), ...(this.card.answer || this.card.happened ? ["answer"] : [])];
    return this.card.votes ? steps[steps.indexOf(this.step) + 1] : undefined;
  }

  reveal() {
    if (this.next) this.wire.ask({ reveal: this.card.key, step: this.next });
  }

  show() {
    const { card } = this;
    const ballot = this.now?.key === card.key ? this.now.ballot : null;
    const covered = card.votes && (this.step === "question" || !card.stage);
    $("#cover").hidden = !covered;
    if ($("#place").inert !== covered) {
      $("#place").inert = covered; // no key moves what is not seen
      this.focus();
    }
    for (const place of [$("#bar"), $("#cover")]) {
      this.fill(place, card, ballot);
      place.classList.toggle("answered", this.step === "answer");
    }
    $("#cover .next").textContent = this.next ? `Enter shows the ${this.next}.` : "";
    $("#voting").textContent = this.now?.voting && ballot ? voted(ballot) : "";
    if (ballot) $("#voting").dataset.round = ballot.round;
    this.showJoin();
  }

  /** The words of a card; hidden ones take their room from the beginning. */
  fill(place, card, ballot) {
    const large = place.id === "cover";
    if (!large) {
      place.hidden = Boolean(this.bare) || !card.stage || !(card.question || card.shows);
      place.classList.toggle("asked", card.votes);
    }
    place.querySelector(".question").textContent = card.question || card.shows;
    place.querySelector(".happened").textContent = happened(card);
    place.querySelector(".choices").replaceChildren(...choices(card, ballot, large));
  }

  showJoin() {
    const voting = this.now?.voting;
    for (const place of document.querySelectorAll(".join")) {
      const visible = Boolean(voting) && (place.parentElement.id === "join" || !this.now.ballot || this.now.ballot.open);
      place.hidden = !visible;
      if (!visible) continue;
      if (!place.firstChild) {
        const code = element("img");
        code.src = "code.svg";
        code.alt = "QR code of the address";
        place.append(code, element("p", "address"), element("p", "count"), element("p", "warning"));
      }
      place.querySelector(".address").textContent = voting.address;
      const here = `${voting.joined} ${voting.joined === 1 ? "phone" : "phones"} here`;
      place.querySelector(".count").textContent = this.now.ballot?.open ? `${this.now.ballot.counts.at(-1)} voted, ${here}` : here;
      const late = performance.now() - this.begun > 1000 * NOBODY_FOR && voting.joined === 0;
      place.querySelector(".warning").textContent = !voting.reachable ? ALONE : late ? KEPT_OUT : "";
    }
  }

  say(text, stays = false) {
    clearTimeout(this.saying);
    $("#said").textContent = text;
    if (text && !stays) this.saying = setTimeout(() => { $("#said").textContent = ""; }, SAID_FOR);
  }

  // -- keys

  turnPage(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || $("dialog[open]")) return;
    const by = { PageDown: 1, PageUp: -1 }[event.key];
    if (!by) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.shiftKey) this.goChapter(by);
    else this.go(by);
  }

  /** Enter reveals as long as there is something to reveal; then it is the figure's. */
  revealFirst(event) {
    const isFigure = event.target.matches?.("#place canvas");
    if (event.key !== "Enter" || !isFigure || !this.next || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) this.reveal();
  }

  press(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    const dialog = $("dialog[open]");
    if (dialog) return this.pressIn(dialog, event);
    const at = event.target;
    if (event.key === "Enter" && at.matches?.("button, a")) return; // it is pressed itself
    const preset = event.shiftKey && /^Digit[1-9]$/.test(event.code) ? Number(event.code.slice(5)) : 0;
    const action = preset ? () => this.button(preset + 1) : this.actions[event.shiftKey && event.key === "R" ? "R" : event.key.toLowerCase()];
    if (action) {
      event.preventDefault();
      if (!event.repeat) action();
    } else if (/^\d$/.test(event.key) && !event.repeat) this.digit(event.key);
  }

  get actions() {
    return {
      enter: () => this.reveal(),
      a: () => this.reveal(),
      o: () => this.showOverview(),
      p: () => $("#place .play")?.click(),
      r: () => this.button(0),
      f: () => this.button(1),
      R: () => { this.wire.ask({ again: true }); this.say("Everything is back at the start."); },
      v: () => this.wire.ask({ vote: true }),
      j: () => (this.now?.voting ? $("#join").showModal() : this.say("Nobody can vote: the demo was started without --vote.")),
      s: () => location.assign("votes.csv"),
      n: () => window.open("notes", "labkit-notes", "popup,width=760,height=900"),
      q: () => { this.bare = !this.bare; this.show(); },
      d: () => this.turnDark(),
      "?": () => this.showKeys(),
      h: () => this.showKeys(),
    };
  }

  button(number) {
    if (this.step === "question") return; // nothing is shown yet
    document.querySelectorAll("#place .buttons > button:not(.enlarge)")[number]?.click();
  }

  pressIn(dialog, event) {
    if ({ o: "overview", j: "join", "?": "keys", h: "keys" }[event.key.toLowerCase()] === dialog.id) dialog.close();
    else if (dialog.id === "overview") moveInGrid(event);
  }

  // -- theme, letters, overview

  turnDark() {
    this.dark = !this.dark;
    localStorage.setItem("labkit-demo-dark", this.dark);
    this.showTheme();
  }

  showTheme() {
    document.documentElement.toggleAttribute("data-dark", this.dark);
  }

  /** Letters that the last row reads. */
  setLetters() {
    const letters = Math.min(innerWidth / 68, innerHeight / 40);
    document.documentElement.style.fontSize = `${Math.min(40, Math.max(13, letters)).toFixed(1)}px`;
  }

  makeKeys() {
    const table = element("table");
    for (const [key, what] of KEYS) {
      const row = table.insertRow();
      row.append(element("td", "", key), element("td", "", what));
    }
    $("#keys").append(table);
  }

  showKeys() {
    $("#keys").showModal();
  }

  makeOverview() {
    for (const [chapter, title] of Object.entries(this.titles).sort()) {
      const cards = this.cards.filter((card) => card.chapter === chapter);
      const grid = element("div", "cards");
      cards.forEach((card, k) => grid.append(this.thumbnail(card, k + 1)));
      $("#overview").append(element("h2", "", `${Number(chapter) || ""} ${title}`.trim()), grid);
    }
  }

  thumbnail(card, number) {
    const button = element("button");
    button.type = "button";
    button.dataset.key = card.key;
    const picture = element("span", "picture", this.pictures.has(card.key) ? "" : "?");
    if (this.pictures.has(card.key)) {
      const image = element("img");
      image.loading = "lazy";
      image.alt = "";
      image.src = `picture/${card.key}`;
      picture.append(image);
    }
    button.append(picture, element("span", "", `${number}  ${card.title}`));
    button.addEventListener("click", () => { $("#overview").close(); this.open(card.key); });
    return button;
  }

  showOverview() {
    for (const button of document.querySelectorAll("#overview button")) button.toggleAttribute("aria-current", button.dataset.key === this.card.key);
    $("#overview").showModal();
    $("#overview [aria-current]")?.focus();
  }
}

/** Arrow keys in the overview: the nearest card that way. */
function moveInGrid(event) {
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  if (!way) return;
  event.preventDefault();
  const all = [...document.querySelectorAll("#overview .cards button")];
  const here = center(document.activeElement);
  const ahead = all.map((node) => [node, center(node)]).map(([node, [x, y]]) => [node, x - here[0], y - here[1]])
    .filter(([, x, y]) => (way[0] ? way[0] * x > 5 && Math.abs(y) < 5 : way[1] * y > 5));
  ahead.sort((a, b) => Math.hypot(a[1], 3 * a[2]) - Math.hypot(b[1], 3 * b[2]));
  ahead[0]?.[0].focus();
}

function center(node) {
  const box = node.getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}

/** What the figure has shown: the number where one was asked for, and one sentence. */
function happened(card) {
  const number = card.choices.length || !card.answer ? "" : `${card.answer} ${card.unit}. `;
  return `${number}${card.happened}`;
}

/** The choices with their letters, and what the room has voted in the rounds that are closed. */
function choices(card, ballot, large) {
  const labels = card.choices.length ? card.choices : ballot?.labels ?? [];
  return labels.map((label, k) => {
    const item = element("li", card.answer && label === card.answer ? "right" : "");
    item.append(element("span", "sign", "✓"));
    if (card.choices.length) item.append(element("span", "letter", String.fromCharCode(65 + k)));
    item.append(element("span", "", label));
    const shares = (ballot?.shares ?? []).map((votes) => share(votes, k));
    if (large) shares.forEach((part, round) => item.append(bar(part, round, ballot.shares[round][k])));
    else if (shares.length) item.append(element("span", "shares", shares.map((part) => `${Math.round(100 * part)} %`).join(" → ")));
    return item;
  });
}

function share(votes, k) {
  const sum = votes.reduce((a, b) => a + b, 0);
  return sum ? votes[k] / sum : 0;
}

function bar(part, round, votes) {
  const row = element("div", round ? "bar second" : "bar first");
  const filled = element("i");
  filled.style.width = `${70 * part}%`;
  row.append(filled, element("span", "", `${Math.round(100 * part)} % (${votes})${round ? " second round" : ""}`));
  return row;
}

function voted(ballot) {
  const count = ballot.counts.at(-1);
  return `round ${ballot.round} ${ballot.open ? "is open" : "is closed"}: ${count} ${count === 1 ? "vote" : "votes"}`;
}

const answer = await fetch("program.json");
if (answer.ok) window.wall = new Wall(await answer.json());
else $("#said").textContent = await answer.text();
