// The lecturer's second window: it follows the first, and holds what the room does not see.

import { element, Wire } from "./common.js";

const CUT = "The line to Python is cut: it is tried again until it comes back.";
const main = document.querySelector("main");
const begun = Date.now();
let key = "";

async function follow(now) {
  document.querySelector("#votes").textContent = now.voting ? votes(now) : "";
  if (now.key === key) return;
  key = now.key;
  const answer = await fetch(`notes/${key}`);
  if (answer.ok && now.key === key) show(await answer.json());
}

function votes({ voting, ballot }) {
  const joined = `${voting.address}, ${voting.joined} joined`;
  if (!ballot) return joined;
  return `${joined}; round ${ballot.round} ${ballot.open ? "open" : "closed"}, ${ballot.counts.at(-1)} votes`;
}

function show(card) {
  const parts = [element("h1", "", `${card.key} · ${card.heading}`)];
  const part = (title, ...nodes) => parts.push(element("h2", "", title), ...nodes);
  if (card.question) part("Question", element("p", "", card.question), list(card.choices, card.answer));
  if (card.happened) part("What happens", element("p", "", `${card.choices.length ? "" : `${card.answer} ${card.unit}. `}${card.happened}`));
  if (card.shows) part("The figure", element("p", "", card.shows));
  if (card.show) part("To show", element("p", "", card.show));
  if (card.tempts) part("What tempts", element("p", "", card.tempts));
  if (card.mistakes.length) part(card.counted ? "Mistakes your class made near here" : "Mistakes the exercises near here name", mistakes(card));
  if (card.next) part("Next", element("p", "", `${card.next.key} · ${card.next.question || card.next.shows}`));
  main.replaceChildren(...parts);
}

function list(choices, right) {
  const rows = element("ul");
  rows.append(...choices.map((choice) => element("li", choice === right ? "right" : "", choice)));
  return rows;
}

function mistakes({ mistakes, counted }) {
  const rows = element("ul");
  for (const { exercise, text, count } of mistakes) {
    const row = element("li", "", `${counted ? `${count} × ` : ""}${text} `);
    row.append(element("span", "small", exercise));
    rows.append(row);
  }
  return rows;
}

function tick() {
  const minutes = Math.floor((Date.now() - begun) / 60000);
  document.querySelector("#clock").textContent = `${minutes} min`;
}

const head = element("p", "small");
head.append(element("span", "", "Open since "), Object.assign(element("span"), { id: "clock" }), element("span", "", ". "), Object.assign(element("span"), { id: "votes" }));
document.body.prepend(head);
tick();
setInterval(tick, 10000);
const said = document.querySelector("#said");
new Wire({
  opened: () => { said.textContent = ""; key = ""; },
  cut: () => { said.textContent = CUT; },
  heard: (message) => { if (message.kind === "now") follow(message); },
});
