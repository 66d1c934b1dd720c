// Keeps a page up to date: polls the JSON API, and fetches the page again when shards changed.
import { watchSkeletons } from "./skeleton.js";

const POLL_MS = 2000;
const main = document.getElementById("main");
const shown = new Map(liveParts(document).map((part) => [part.id, part.outerHTML]));
let state = null;

function liveParts(page) {
  return [...page.querySelectorAll("[data-live]")];
}

function tell(text) {
  document.getElementById("notice").textContent = text;
}

async function refreshPage() {
  const response = await fetch(location.href, { headers: { Accept: "text/html" } });
  if (response.redirected) return location.reload(); // the session has ended
  if (!response.ok) return;
  const fresh = new DOMParser().parseFromString(await response.text(), "text/html");
  for (const part of liveParts(fresh)) {
    if (shown.get(part.id) === part.outerHTML) continue;
    shown.set(part.id, part.outerHTML);
    document.getElementById(part.id)?.replaceWith(document.adoptNode(part));
  }
  watchSkeletons();
}

function showProgress({ count, done, in_progress: working }) {
  const bar = document.querySelector("#summary svg.progress");
  const share = (100 * done) / count;
  bar.querySelector(".done").setAttribute("width", `${share}%`);
  bar.querySelector(".working").setAttribute("x", `${share}%`);
  bar.querySelector(".working").setAttribute("width", `${(100 * working) / count}%`);
  document.getElementById("working").textContent = working.toLocaleString("en");
}

async function pollDataset() {
  const response = await fetch(main.dataset.address);
  if (response.status === 401) return location.reload(); // the session has ended
  if (!response.ok) throw new Error(`the API answered ${response.status}`);
  const dataset = await response.json();
  showProgress(dataset.progress);
  const next = JSON.stringify([dataset.status, dataset.progress.shards]);
  if (state !== null && state !== next) await refreshPage();
  state = next;
}

async function poll() {
  try {
    if (!document.hidden && document.querySelector("[data-active]")) {
      await (main.dataset.refresh === "dataset" ? pollDataset() : refreshPage());
      tell("");
    }
  } catch (error) {
    tell(`Not up to date: ${error.message}. Trying again.`);
  }
  setTimeout(poll, POLL_MS);
}

async function post(button) {
  if (button.dataset.ask && !confirm(button.dataset.ask)) return;
  button.disabled = true;
  const response = await fetch(button.dataset.post, { method: "POST" });
  if (response.ok && button.dataset.then) return location.assign(button.dataset.then);
  const answer = await response.json();
  tell(response.ok ? "" : answer.detail);
  await refreshPage();
  button.disabled = false;
}

document.addEventListener("click", (event) => {
  const button = event.target.closest("button[data-post]");
  if (button) post(button).catch((error) => tell(`Not done: ${error.message}`));
});
document.addEventListener("change", (event) => {
  event.target.closest("form[data-submit-on-change]")?.requestSubmit();
});

watchSkeletons();
setTimeout(poll, POLL_MS);
