// A phone in the room: the question that is open, its choices or a number, and nothing else.

"use strict";
const AGAIN_AFTER = 3000; // ms after a request that failed
const CODE = location.pathname.replace(/\//g, "");
const $ = (selector) => document.querySelector(selector);
let now = { version: -1 };

function say(text) {
  $("#said").textContent = text;
}

async function follow() {
  for (let cut = true; ;) { // the first answer after a fault comes at once, and takes its sentence away
    try {
      const answer = await fetch(`/${CODE}/now?seen=${cut ? "" : now.version}`);
      if (answer.ok) {
        const next = await answer.json();
        if (cut || next.version !== now.version) show(next);
        cut = false;
        continue;
      }
      say(await answer.text());
      if (answer.status === 404) return; // the code of another day
    } catch {
      say("The connection is gone; it is tried again.");
    }
    cut = true;
    await new Promise((go) => setTimeout(go, AGAIN_AFTER));
  }
}

function show(next) {
  now = next;
  $("#question").textContent = next.question || "Waiting for the first question.";
  $("#answers").replaceChildren(...(next.question ? (next.choices.length ? buttons() : [number()]) : []));
  say(!next.question ? "" : next.open ? hint() : "The vote is closed: look at the wall.");
}

function hint() {
  const round = now.round === 2 ? "Second round. " : "";
  return now.mine === null ? `${round}${now.choices.length ? "Choose." : "Type a number."}` : `${round}Counted; you can change it until the vote is closed.`;
}

function buttons() {
  return now.choices.map((choice, k) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = choice;
    button.disabled = !now.open;
    button.setAttribute("aria-pressed", now.mine === k);
    button.addEventListener("click", () => vote(k));
    return button;
  });
}

function number() {
  const place = document.createElement("div");
  const input = document.createElement("input");
  input.inputMode = "decimal";
  input.setAttribute("aria-label", now.unit || "number");
  input.placeholder = now.unit || "number";
  input.value = now.mine ?? "";
  const button = document.createElement("button");
  button.textContent = "Vote";
  for (const node of [input, button]) node.disabled = !now.open;
  place.append(input, button);
  return place;
}

async function vote(answer) {
  const { key, round } = now;
  try {
    const reply = await fetch(`/${CODE}/vote`, { method: "POST", body: JSON.stringify({ key, round, answer }) });
    if (!reply.ok) return say(await reply.text());
    now.mine = answer;
    document.querySelectorAll("#answers button[aria-pressed]").forEach((node, k) => node.setAttribute("aria-pressed", k === answer));
    say(hint());
  } catch {
    say("That did not arrive; try it again.");
  }
}

if ($("#join")) {
  $("#join").addEventListener("submit", (event) => {
    event.preventDefault();
    location.assign(`/${encodeURIComponent($("#join input").value.trim().toLowerCase())}`);
  });
} else {
  $("#answers").addEventListener("submit", (event) => {
    event.preventDefault();
    vote($("#answers input").value);
  });
  follow();
}
