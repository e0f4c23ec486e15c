"use strict";
// Replaces the parts of the page by those of the stream, and says when the stream is silent.

// The server sends at least a beat each second.
const SILENCE_MS = 4000;
const RETRY_MS = 5000;

const silent = document.getElementById("silent");
const parts = document.querySelectorAll("[data-part]");
let stream = null;
let opened = 0;
let heard = Date.now();

// hh:mm:ss in the time zone of the browser.
const clock = (ms) => new Date(ms).toLocaleTimeString("en-GB");

function showTimes(part) {
  for (const time of part.querySelectorAll("time")) time.textContent = clock(Number(time.dataset.ms));
}

function alive() {
  heard = Date.now();
  silent.hidden = true;
  document.body.classList.remove("stale");
}

function open() {
  if (stream) stream.close();
  opened = Date.now();
  stream = new EventSource("events");
  stream.addEventListener("beat", alive);
  stream.addEventListener("version", (event) => {
    // Another program serves the page now.
    if (event.data !== document.body.dataset.version) location.reload();
  });
  for (const part of parts) {
    stream.addEventListener(part.id, (event) => {
      // A space stands for an empty part.
      part.innerHTML = event.data.trim();
      showTimes(part);
      alive();
      const verdict = document.querySelector("h1");
      if (part.id === "verdict" && verdict) document.title = verdict.textContent + " - flexid";
    });
  }
}

function check() {
  if (document.hidden || Date.now() - heard < SILENCE_MS) return;
  silent.textContent = "connection lost, last data from " + clock(heard) + ": flexid web does not answer";
  silent.hidden = false;
  document.body.classList.add("stale");
  if (Date.now() - opened > RETRY_MS) open();
}

function theme(name) {
  if (name) document.documentElement.dataset.theme = name;
}

document.getElementById("theme").addEventListener("click", () => {
  const now = document.documentElement.dataset.theme;
  const dark = now ? now === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  theme(dark ? "light" : "dark");
  try { localStorage.setItem("theme", document.documentElement.dataset.theme); } catch { /* not kept */ }
});
try { theme(localStorage.getItem("theme")); } catch { /* the browser's own */ }

// A page that nobody sees needs no stream.
document.addEventListener("visibilitychange", () => {
  if (document.hidden) { stream.close(); } else { open(); }
});
document.querySelectorAll("[data-part]").forEach(showTimes);
open();
setInterval(check, 500);
