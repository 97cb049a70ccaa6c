"""Students of a JupyterHub without a browser: log in, run a notebook's cells, move a Stage, as JupyterLab's page does.

Every request and every message goes through the hub's proxy. Used by the test of the hub and by `bench/hub_load.py`.
"""

import json
import struct
import time
import uuid
from urllib.parse import urlsplit

import requests
import websocket

LOOK = {"width": 900, "height": 700, "ratio": 1, "dark": False, "letters": 1}  # the room a page gives a figure
SECONDS = 300  # for whatever is waited for: other tests may hold the processors meanwhile
ASIDE = ("Hint", "Solution", "Start over", "Lock in")  # buttons that are no choice of a prediction


class Student:
    """One student with a browser's cookies."""

    def __init__(self, hub, name, password):
        self.hub, self.name, self.password = hub.rstrip("/"), name, password
        self.place = f"{self.hub}/user/{name}"
        self.page = requests.Session()

    def log_in(self):
        """Log in by the form, and wait for the server of one's own."""
        self.page.get(f"{self.hub}/hub/login").raise_for_status()
        form = {"username": self.name, "password": self.password, "_xsrf": self._xsrf("/hub/")}
        self.page.post(f"{self.hub}/hub/login", data=form).raise_for_status()
        self.start()

    def start(self):
        """Ask for the server of one's own until it answers."""
        self.page.get(f"{self.hub}/hub/spawn/{self.name}").raise_for_status()
        deadline = time.monotonic() + SECONDS
        while time.monotonic() < deadline:
            answer = self.page.get(f"{self.place}/lab")
            if answer.ok and urlsplit(answer.url).path.startswith(f"/user/{self.name}/lab"):
                return
            time.sleep(0.2)
        raise TimeoutError(f"the server of {self.name} did not start within {SECONDS} s")

    def stop(self):
        """Have the server stopped, and wait until it is."""
        place = f"{self.hub}/hub/api/users/{self.name}/server"
        self.page.delete(place, headers={"X-XSRFToken": self._xsrf("/hub/")}).raise_for_status()
        while self.page.get(f"{self.hub}/hub/api/users/{self.name}").json().get("server"):
            time.sleep(0.1)

    def open(self, notebook):
        """(code cells of a notebook, a connection to a kernel of its own)."""
        content = self.page.get(f"{self.place}/api/contents/{notebook}").json()["content"]
        cells = [cell["source"] for cell in content["cells"] if cell["cell_type"] == "code"]
        wanted = {"path": notebook, "name": notebook, "type": "notebook", "kernel": {"name": "python3"}}
        answer = self.page.post(
            f"{self.place}/api/sessions", json=wanted, headers={"X-XSRFToken": self._xsrf(f"/user/{self.name}/")}
        )
        answer.raise_for_status()
        return cells, Kernel(self, answer.json()["kernel"]["id"])

    def _xsrf(self, path):
        return next(cookie.value for cookie in self.page.cookies if cookie.name == "_xsrf" and cookie.path == path)

    def cookies(self):
        """What a browser would send along with the web socket's first request."""
        return "; ".join(f"{c.name}={c.value}" for c in self.page.cookies if f"/user/{self.name}/".startswith(c.path))


class Kernel:
    """The messages between a page and its kernel."""

    def __init__(self, student, id):
        self.session, self.stages, self.choices, self.printed = uuid.uuid4().hex, {}, [], ""
        place = f"{student.place}/api/kernels/{id}/channels?session_id={self.session}".replace("http", "ws", 1)
        self.socket = websocket.create_connection(place, cookie=student.cookies(), timeout=SECONDS)

    def run(self, code):
        """Run one cell; returns None, or the name of what it raised."""
        known = len(self.choices)
        asked = self._send("execute_request", {"code": code, "allow_stdin": False, "store_history": True})
        reply, idle = None, False
        while not (reply and idle):
            message = self._hear()
            if message["parent_header"].get("msg_id") == asked:
                kind, content = message["msg_type"], message["content"]
                reply = content if kind == "execute_reply" else reply
                idle = idle or _is_idle(message)
        del self.choices[known + 1 :]  # of several choices a student takes one
        return reply.get("ename")

    def run_all(self, cells):
        """Run all cells and predict everywhere; returns the names of what was raised."""
        raised = [self.run(code) for code in cells]
        while self.choices:
            asked = self._tell(self.choices.pop(0), {"event": "click"})
            while not (_is_idle(message := self._hear()) and message["parent_header"].get("msg_id") == asked):
                pass
        return [name for name in raised if name]

    def move(self, stage, times, pause=0.03):
        """Milliseconds from each of so many moves of a Stage to the picture that answers it."""
        self._tell(stage, {"look": LOOK, "serial": 0})
        self._picture(stage, 0)
        found = []
        for serial in range(1, times + 1):
            begun = time.perf_counter()
            self._tell(stage, {**self._step(stage, serial), "serial": serial, "shown": serial})
            self._picture(stage, serial)
            found.append(1e3 * (time.perf_counter() - begun))
            time.sleep(pause)
        return found

    def _step(self, stage, serial):
        """One arrow key on the first handle, or on the first slider; there and back again."""
        declared, there = self.stages[stage], 1 if serial % 10 < 5 else -1
        if declared["handles"]:
            return {"step": {next(iter(declared["handles"])): [there, 0]}}
        return {"control": {next(iter(declared["controls"])): 0.5 + 0.01 * (serial % 10)}}

    def _tell(self, stage, content):
        return self._send("comm_msg", {"comm_id": stage, "data": {"method": "custom", "content": content}})

    def _picture(self, stage, serial):
        while True:
            message = self._hear()
            if message["msg_type"] == "comm_msg" and message["content"]["comm_id"] == stage:
                content = message["content"]["data"].get("content", {})
                if content.get("serial") == serial and "picture" in content:
                    return content

    def _send(self, kind, content):
        id = uuid.uuid4().hex
        header = {"msg_id": id, "msg_type": kind, "session": self.session, "username": "", "version": "5.3"}
        message = {"header": header, "parent_header": {}, "metadata": {}, "content": content, "buffers": []}
        self.socket.send(json.dumps({**message, "channel": "shell"}))
        return id

    def _hear(self):
        data = self.socket.recv()
        message = json.loads(data if isinstance(data, str) else _first_part(data))
        content = message["content"]
        if message["msg_type"] == "comm_open":
            state = content["data"].get("state", {})
            if "declaration" in state:
                self.stages[content["comm_id"]] = state["declaration"]
            if state.get("_model_name") == "ButtonModel" and not state["description"].startswith(ASIDE):
                self.choices.append(content["comm_id"])
        if message["msg_type"] == "stream":
            self.printed += content["text"]
        return message

    def close(self):
        self.socket.close()


def _is_idle(message):
    return message["msg_type"] == "status" and message["content"]["execution_state"] == "idle"


def _first_part(data):
    """The JSON of a message that carries buffers: their number, where each part begins, the parts."""
    (number,) = struct.unpack("!I", data[:4])
    begins = [*struct.unpack(f"!{number}I", data[4 : 4 * (number + 1)]), len(data)]
    return data[begins[0] : begins[1]]
