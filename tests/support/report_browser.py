"""Opens a page in headless Chromium, asks it a question, and takes its picture, for the tests."""

import gc
import json
import os
import shutil
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
PATIENCE = 30.0  # [s] for the page to answer
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    # Whatever is not on this machine cannot be reached: a page that needs it is seen to fail.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)


def find_browser() -> str:
    """The browser's path; without one the test is skipped, but under CI it fails."""
    for name in BROWSERS:
        path = shutil.which(name)
        if path:
            return path
    reason = f"no Chromium on this machine (looked for {', '.join(BROWSERS)})"
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def ask_page(
    html: str,
    question: str,
    *,
    work: Path,
    picture: Path | None = None,
    size: tuple[int, int] = (1000, 640),
) -> Any:
    """Opens a page, waits for its answer, and returns that.

    The browser takes its picture when the page has loaded, so the page is given an image that
    comes only once the question is answered.

    Args:
        html: The page.
        question: JavaScript, the body of an async function in the page; what it returns is
            the answer. It may wait for things.
        work: A directory for the browser's own files.
        picture: Where to put a picture of the page as it is when it has answered.
        size: Of the window [px].
    """
    browser = find_browser()
    script = f"""<img src="/hold" width="1" height="1" alt=""><script>
      const until = async test => {{
        while (!test()) await new Promise(done => setTimeout(done, 20)); }};
      (async () => {{ {question} }})().then(
        answer => fetch("/answer", {{ method: "POST", body: JSON.stringify(answer) }}),
        error => fetch("/answer", {{ method: "POST", body: JSON.stringify(String(error)) }}));
    </script>"""
    head, end, tail = html.rpartition("</body>")
    page = f"{head}{script}{end}{tail}".encode()
    with _serve(page) as (url, answered, answer):
        command = [browser, *FLAGS, f"--user-data-dir={work / 'browser'}"]
        command += [f"--window-size={size[0]},{size[1]}", f"--timeout={int(1e3 * PATIENCE)}"]
        command += [f"--screenshot={picture}"] if picture else ["--dump-dom"]
        done = subprocess.run(
            [*command, url], capture_output=True, text=True, timeout=2 * PATIENCE, check=False
        )
        assert answered.wait(1.0), f"the page did not answer: {done.stderr[-2000:]}"
    return answer[0]


@contextmanager
def _serve(page: bytes) -> Iterator[tuple[str, threading.Event, list[Any]]]:
    """Serves the page; the event is set when it has answered, and the list holds the answer."""
    answered, answer = threading.Event(), []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path == "/hold":
                answered.wait(PATIENCE)
            self._reply(page if self.path == "/" else b"")

        def do_POST(self) -> None:
            answer.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self._reply(b"")
            answered.set()

        def _reply(self, body: bytes) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = False  # closing waits for them
    # A Meshcat must not be destroyed by another thread than made it, and collecting garbage may
    # happen in any: it aborts the process.
    gc.disable()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/", answered, answer
    finally:
        answered.set()
        server.shutdown()
        server.server_close()
        gc.enable()
