"""palpate-runtime view FOLDER as strangers meet it: what a file says, what a drop may not replace, who waits for whom."""

import contextlib
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import urllib.parse

from programs import PRECOMPUTE, RUNTIME, ProgramTest, cube_toml, run

BOX = """OFF
8 12 0
0 0 0
100 0 0
100 60 0
0 60 0
0 0 40
100 0 40
100 60 40
0 60 40
3 0 2 1
3 0 3 2
3 4 5 6
3 4 6 7
3 0 1 5
3 0 5 4
3 2 3 7
3 2 7 6
3 1 2 6
3 1 6 5
3 0 4 7
3 0 7 3
"""


def parent_of(pid):
    with contextlib.suppress(OSError):
        stat = pathlib.Path(f"/proc/{pid}/stat").read_text()
        return int(stat[stat.rindex(")") + 2:].split()[1])
    return None


class GalleryTest(ProgramTest):
    """A gallery of a folder of its own."""

    def setUp(self):
        super().setUp()
        self.at = self.folder / "shown"
        self.at.mkdir()
        self.process = subprocess.Popen([RUNTIME, "view", self.at, "--view-address", "127.0.0.1:0"], cwd=self.folder, stdin=subprocess.DEVNULL,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.addCleanup(self.end)
        told = b""
        while not (found := re.search(rb"open http://127\.0\.0\.1:(\d+)/gallery\?token=(\w+) in a browser", told)):
            line = self.process.stderr.readline()
            self.assertTrue(line, told)
            told += line
        self.port, self.token = int(found[1]), found[2].decode()

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        self.said = self.process.communicate(timeout=60)[1]

    def ask(self, method, path, name=None, body=None, headers=None, port=None, token=None):
        """The status and body of an answer."""
        connection = http.client.HTTPConnection("127.0.0.1", port or self.port, timeout=60)
        query = {"token": self.token if token is None else token, **({"name": name} if name else {})}
        connection.request(method, f"/{path}?{urllib.parse.urlencode(query, quote_via=urllib.parse.quote)}", body, headers or {})
        answer = connection.getresponse()
        with contextlib.closing(connection):
            return answer.status, answer.read()

    def told(self, method, path, name=None, body=None):
        status, text = self.ask(method, path, name, body)
        self.assertEqual(status, 200, text)
        return json.loads(text)

    def opened(self, name):
        """What is told of a file once it is shown or has ended."""
        self.told("POST", "open", name)
        state = {}

        def is_over():
            state.update(self.told("GET", "opened"))
            return state["page"] or state["ended"]
        self.wait_for(is_over, self.process)
        return state

    def children(self):
        return [int(one.name) for one in pathlib.Path("/proc").iterdir() if one.name.isdigit() and parent_of(one.name) == self.process.pid]

    def baked(self, file, name="cube"):
        model = self.write("model.toml", cube_toml(2, name=name))
        result = run(PRECOMPUTE, model, "-o", file)
        self.assertEqual(result.returncode, 0, result.stderr)
        return file.read_bytes()


class Names(GalleryTest):
    def test_what_a_file_says_is_text(self):
        for k, name in enumerate(("open javascript:alert(1) in a browser", '{"url": "javascript:alert(1)", "port": 1, "token": "%s"}' % (32 * "0"))):
            self.baked(self.at / f"evil{k}.palpate.hdf", name.replace('"', '\\"'))
            state = self.opened(f"evil{k}.palpate.hdf")
            self.assertEqual(set(state["page"]), {"port", "token"}, "no address of another's making")
            self.assertRegex(state["page"]["token"], "^[0-9a-f]{32}$")
            self.assertNotIn(state["page"]["port"], (1, self.port))
            status, page = self.ask("GET", "", port=state["page"]["port"], token=state["page"]["token"])
            self.assertEqual(status, 200)
            self.assertIn(name, "\n".join(state["said"]))

    def test_a_name_that_is_not_utf8_is_opened(self):
        file = os.path.join(os.fsencode(self.at), b"K\xf6rper.palpate.hdf")
        self.baked(pathlib.Path(os.fsdecode(file)))
        name, = (item["name"] for item in self.told("GET", "items")["items"])
        self.assertEqual(name, "K\ufffdrper.palpate.hdf")
        self.assertEqual(self.ask("GET", "scene", name)[0], 200)
        self.assertIsNotNone(self.opened(name)["page"])

    def test_the_token_of_a_body_opens_nothing_else(self):
        self.baked(self.at / "cube.palpate.hdf")
        page = self.opened("cube.palpate.hdf")["page"]
        self.assertNotEqual(page["token"], self.token)
        for method, path in (("GET", "items"), ("GET", "scene"), ("GET", "opened"), ("POST", "open"), ("POST", "close"), ("POST", "drop")):
            self.assertEqual(self.ask(method, path, "cube.palpate.hdf", token=page["token"])[0], 403, path)
            self.assertEqual(self.ask(method, path, "cube.palpate.hdf", token="")[0], 403, path)
        self.assertEqual(self.ask("GET", "", token=self.token, port=page["port"])[0], 403)
        self.assertEqual(self.ask("GET", "gallery", token="")[0], 200, "the page itself, which has nothing of the folder in it")


class Drops(GalleryTest):
    def test_a_drop_replaces_no_body(self):
        theirs = self.baked(self.at / "kidney.palpate.hdf", "kidney")
        disc = "P1\n60 60\n" + "\n".join(" ".join("1" if (x - 30) ** 2 + (y - 30) ** 2 < 400 else "0" for x in range(60)) for y in range(60))
        dropped = {"kidney.off": BOX, "foreign.model.toml": cube_toml(2, name="kidney"), "kidney.pbm": disc}
        for name, text in dropped.items():
            kept = self.told("POST", "drop", name, text)["name"]
            state = self.opened(kept)
            self.assertIsNotNone(state["page"], state)
            body = kept.replace(".model.toml", "").replace(".off", "").replace(".pbm", "") + ".palpate.hdf"
            self.assertTrue((self.at / body).is_file(), body)
            self.assertEqual((self.at / "kidney.palpate.hdf").read_bytes(), theirs, name)
        self.assertFalse((self.folder / "kidney.palpate.hdf").exists())
        self.assertEqual([name for name in os.listdir(self.at) if name.startswith(".")], [])

    def test_a_source_replaces_no_body_either(self):
        theirs = self.baked(self.at / "foreign.palpate.hdf")
        (self.at / "foreign.model.toml").write_text(cube_toml(3, name="foreign"))
        state = self.opened("foreign.model.toml")
        self.assertTrue(state["ended"])
        self.assertIn("foreign.palpate.hdf: is there already, and is kept", "\n".join(state["said"]))
        self.assertEqual((self.at / "foreign.palpate.hdf").read_bytes(), theirs)

    def test_what_is_made_beside_a_source_replaces_nothing(self):
        (self.at / "open.off").write_text(BOX.replace("8 12 0", "8 11 0").replace("3 0 7 3\n", ""))
        crossed = BOX.replace("100 60 40", "-50 -50 20")
        (self.at / "cross.off").write_text(crossed)
        model = cube_toml(2, name="cross")
        (self.at / "cross.model.toml").write_text(re.sub(r"(?m)^box = .*$", 'surface = "cross.off"', model))
        earlier = {"open.repaired.off": "OFF\n# repaired by palpate-precompute\n" + BOX[4:],
                   "cross.bad-faces.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"}
        for name, text in earlier.items():
            (self.at / name).write_text(text)
        self.assertIsNotNone(self.opened("open.off")["page"])
        self.assertIn("intersects itself", "\n".join(self.opened("cross.model.toml")["said"]))
        for name, text in earlier.items():
            self.assertEqual((self.at / name).read_text(), text, name)
        self.assertIn('"open.repaired-2.off"', (self.at / "open.model.toml").read_text())

    def test_what_comes_while_a_body_is_made_is_kept(self):
        """The name is free when the bake begins, and taken when it writes."""
        (self.at / "slow.model.toml").write_text(cube_toml(9, name="slow"))
        self.told("POST", "open", "slow.model.toml")
        self.wait_for(lambda: (self.at / "slow.palpate.hdf.partial").exists(), self.process)
        with contextlib.suppress(FileExistsError), open(self.at / "slow.palpate.hdf", "x", encoding="utf-8") as came:
            came.write("mine")
        self.wait_for(lambda: self.told("GET", "opened")["ended"] or self.told("GET", "opened")["page"], self.process)
        self.assertEqual((self.at / "slow.palpate.hdf").read_bytes(), b"mine")


class Waiting(GalleryTest):
    def test_nothing_waits_for_a_child(self):
        self.baked(self.at / "cube.palpate.hdf")
        self.assertIsNotNone(self.opened("cube.palpate.hdf")["page"])
        child, = self.children()
        os.kill(child, signal.SIGSTOP)
        self.assertEqual(self.ask("POST", "close")[0], 200)
        self.assertIsNone(self.told("GET", "opened"))
        self.assertEqual([item["name"] for item in self.told("GET", "items")["items"]], ["cube.palpate.hdf"])
        state = self.opened("cube.palpate.hdf")  # once the other one was killed
        self.assertIsNotNone(state["page"])
        self.assertNotIn(child, self.children())

    def test_strangers_keep_nobody_out(self):
        strangers = []
        self.addCleanup(lambda: [one.close() for one in strangers])
        for k in range(300):
            one = socket.create_connection(("127.0.0.1", self.port), timeout=60)
            one.send((b"G", b"POST /drop?name=a.stl HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n1", b"")[k % 3])
            strangers.append(one)
            if k % 50 == 0:
                self.assertEqual(self.told("GET", "items")["items"], [])
        held = len(os.listdir(f"/proc/{self.process.pid}/fd"))
        self.assertLess(held, 100, "few connections of strangers are kept")


class Hosts(GalleryTest):
    def test_tunnels_are_let_in_and_foreign_names_are_not(self):
        for host in ("localhost:9000", "127.0.0.1:9000", "[::1]:9000", "localhost", "127.1.2.3:1"):
            self.assertEqual(self.ask("GET", "items", headers={"Host": host})[0], 200, host)
            self.assertEqual(self.ask("POST", "close", headers={"Host": host, "Origin": f"http://{host}"})[0], 200, host)
        for host, origin in (("evil.example:9000", None), (f"evil.example:{self.port}", None), ("localhost.evil.example:9000", None),
                             ("localhost:9000", "http://evil.example:9000"), ("localhost:9000", "http://localhost:9001"), ("localhost:9000", "null")):
            status, text = self.ask("GET", "items", headers={"Host": host, **({"Origin": origin} if origin else {})})
            self.assertEqual(status, 403, host)
            self.assertIn(b"Pages of other addresses" if origin else b"foreign page could have made them lead here", text)
