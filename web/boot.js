// Brings the viewer up: says what is being loaded, and says in a sentence why it cannot be.

const CANVAS = "sightline";
const BINDINGS = "./sightline_viewer.js";
const MODULE = "./sightline_viewer_bg.wasm";
const SERVER_GONE =
  "The Sightline server does not answer. Start it with `cargo xtask serve` and load this page again.";

const message = document.getElementById("message");
const text = document.getElementById("message-text");
const progress = document.getElementById("message-progress");
const detail = document.getElementById("message-detail");
const plain = document.getElementById("message-plain");

/** A failure with a sentence for the person before the screen; `cause` is shown small below it. */
class Failure extends Error {}

/** Exchanges an access token for a cookie; says whether the server took it. */
async function logIn(token) {
  const headers = { "Content-Type": "application/json" };
  const response = await ask("api/v1/login", { method: "POST", headers, body: JSON.stringify({ token }) });
  return response.ok;
}

/** Asks the server; a server that does not answer is a failure with a sentence. */
async function ask(path, request) {
  try {
    return await fetch(path, request);
  } catch (cause) {
    throw new Failure(SERVER_GONE, { cause });
  }
}

/** Takes the access token out of the address, where it must not stay: addresses are copied, sent and kept. */
function tokenOfAddress() {
  const parts = location.hash.replace(/^#/, "").split("&");
  const mine = parts.find((part) => part.startsWith("token="));
  if (mine === undefined) {
    return undefined;
  }
  const others = parts.filter((part) => part !== mine && part !== "").join("&");
  history.replaceState(history.state, "", location.pathname + location.search + (others ? `#${others}` : ""));
  return mine.slice("token=".length);
}

/** Asks the person for the access token until the server takes it. */
function askForToken() {
  const form = document.getElementById("login");
  const field = document.getElementById("login-token");
  tell("This server asks for its access token. Open the address that it printed when it was started, or enter the token.");
  form.hidden = false;
  field.focus();
  return new Promise((resolve, reject) => {
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      // A whole address is taken as well.
      const token = field.value.trim().replace(/^.*[#&]token=/, "");
      logIn(token).then((taken) => {
        if (taken) {
          form.hidden = true;
          resolve();
        } else {
          tell("That is not the access token of this server. It is the part after `#token=` of the address that the server printed.");
          field.select();
        }
      }, reject);
    });
  });
}

/** Makes sure that the server lets this page in. */
async function enter() {
  const token = tokenOfAddress();
  if (token !== undefined && (await logIn(token))) {
    return;
  }
  const response = await ask("api/v1/version");
  if (response.status === 401) {
    await askForToken();
  }
}

/** Shows what is being done, and how much of it is. */
function tell(sentence, fraction) {
  text.textContent = sentence;
  progress.hidden = fraction === undefined;
  if (fraction !== undefined) {
    progress.value = fraction;
  }
}

/** Replaces the page by a sentence; the first one stays, because what follows a failure only repeats it. */
function fail(sentence, cause) {
  if (message.classList.contains("failed")) {
    return;
  }
  message.classList.add("failed");
  message.hidden = false;
  tell(sentence);
  detail.hidden = !cause;
  detail.textContent = cause ? String(cause) : "";
  offerPlainPages();
}

/** Offers the pages that the server makes of every step, which need neither WebGL nor WebAssembly. */
function offerPlainPages() {
  const session = /(?:^#|&)session=(s[0-9]+)(?:&|$)/.exec(location.hash);
  plain.querySelector("a").href = session ? `api/v1/sessions/${session[1]}/page` : "api/v1/page";
  plain.hidden = false;
}

/** Refuses a browser in which the viewer cannot run, before anything large is loaded. */
function requireBrowser() {
  if (typeof WebAssembly !== "object" || typeof WebAssembly.instantiateStreaming !== "function") {
    throw new Failure("This browser cannot run WebAssembly, or it is switched off. Use a current Firefox, Chrome, Edge or Safari.");
  }
  // A canvas of its own: the viewer's canvas can be given one context only.
  const probe = document.createElement("canvas");
  const context = probe.getContext("webgl2") ?? probe.getContext("webgl");
  if (!context) {
    throw new Failure("This browser offers no WebGL, with which the viewer paints. Switch on hardware acceleration in its settings, or use another browser.");
  }
  context.getExtension("WEBGL_lose_context")?.loseContext();
}

function megabytes(bytes) {
  return (bytes / 1e6).toFixed(1);
}

/** Fetches the WASM, telling how much has come. */
async function fetchModule() {
  let response;
  try {
    response = await fetch(MODULE);
  } catch (cause) {
    throw new Failure(SERVER_GONE, { cause });
  }
  if (!response.ok) {
    throw new Failure("The server has no viewer to send. Build it with `cargo xtask web` and load this page again.", {
      cause: `${response.status} ${response.statusText} for ${response.url}`,
    });
  }
  // The length of a compressed response is not that of what is read from it, which has a header of its own.
  const packed = response.headers.get("Content-Encoding");
  const total = Number(response.headers.get(packed ? "Sightline-Unpacked-Length" : "Content-Length") ?? NaN);
  let received = 0;
  const count = new TransformStream({
    transform(chunk, controller) {
      received += chunk.byteLength;
      if (total > 0) {
        tell(`Loading the viewer: ${megabytes(received)} of ${megabytes(total)} MB`, received / total);
      } else {
        tell(`Loading the viewer: ${megabytes(received)} MB`);
      }
      controller.enqueue(chunk);
    },
    flush() {
      tell("Starting the viewer");
    },
  });
  const headers = { "Content-Type": "application/wasm" };
  return new Response(response.body.pipeThrough(count), { headers });
}

/** Loads the JavaScript side of the viewer. */
async function importBindings() {
  try {
    return await import(BINDINGS);
  } catch (cause) {
    throw new Failure(SERVER_GONE, { cause });
  }
}

async function boot() {
  requireBrowser();
  await enter();
  tell("Loading the viewer");
  const [bindings, module] = await Promise.all([importBindings(), fetchModule()]);
  try {
    await bindings.default({ module_or_path: module });
  } catch (cause) {
    throw new Failure("The viewer did not arrive whole. Load this page again; if that does not help, restart the server.", { cause });
  }
  await bindings.start(CANVAS);
  if (!message.classList.contains("failed")) {
    message.hidden = true;
    // When the viewer has painted for the first time, for whoever measures.
    performance.mark("sightline-painted");
    document.getElementById(CANVAS).focus();
  }
}

// The printed address may be opened in a tab that shows this page already, perhaps of an earlier start of the server.
window.addEventListener("hashchange", () => {
  const token = tokenOfAddress();
  if (token !== undefined) {
    logIn(token).finally(() => location.reload());
  }
});

/** The most files that are read from a dropped folder. */
const FOLDER_FILES_MAX = 100_000;

/** Lists the files below a dropped folder as pairs of path and file; the path begins with the folder's name. */
async function filesBelow(folder) {
  const files = [];
  const waiting = [folder];
  while (waiting.length > 0) {
    const reader = waiting.pop().createReader();
    // A reader returns its entries in parts; an empty part is the last one.
    for (;;) {
      const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (entries.length === 0) {
        break;
      }
      waiting.push(...entries.filter((entry) => entry.isDirectory));
      for (const entry of entries.filter((entry) => entry.isFile)) {
        const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
        files.push([entry.fullPath.replace(/^\//, ""), file]);
      }
      if (files.length > FOLDER_FILES_MAX) {
        throw new Error(`“${folder.name}” has more than ${FOLDER_FILES_MAX} files: drop the folder of one recording.`);
      }
    }
  }
  if (files.length === 0) {
    throw new Error(`“${folder.name}” has no files: drop the folder of a recording.`);
  }
  return files;
}

// A browser shows a folder only to the handler of its drop. The viewer gets the list of files; what else is dropped it
// handles itself.
document.addEventListener("drop", (event) => {
  const entries = Array.from(event.dataTransfer?.items ?? [], (item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length !== 1 || !entries[0].isDirectory) {
    return;
  }
  event.preventDefault();
  event.stopPropagation();
  // The viewer takes down its sign that something is being dragged.
  document.getElementById(CANVAS).dispatchEvent(new DragEvent("dragleave", { bubbles: true }));
  const send = (detail) => document.dispatchEvent(new CustomEvent("sightline-folder", { detail }));
  filesBelow(entries[0]).then(send, (error) =>
    send(error instanceof DOMException ? `“${entries[0].name}” cannot be read: ${error.message}` : error.message));
}, true);

// A panic inside the viewer calls this with its message; afterwards nothing on the canvas answers any more.
window.addEventListener("sightline-panic", (event) => {
  fail("The viewer stopped because of a fault in it. Load this page again to go on.", event.detail);
});

boot().catch((error) => {
  if (error instanceof Failure) {
    fail(error.message, error.cause);
  } else {
    fail("The viewer could not start. Load this page again; if that does not help, use another browser.", error);
  }
});
