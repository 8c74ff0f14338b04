"""palpate-runtime play --view, view and export as a person starts them."""

import contextlib
import json
import re
import signal
import socket
import subprocess
import urllib.error
import urllib.request

from programs import PATIENCE, RUNTIME, SOURCE, ProgramTest, run

CUBE = SOURCE / "tests" / "golden" / "cube2" / "cube2.palpate.hdf"
TOUCH = "t,x,y,z\n0,0.5,0.5,1.3\n0.2,0.5,0.5,1.05\n"


def status_of(url):
    """The page is asked for without a proxy."""
    try:
        with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(url, timeout=60) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


class ViewTest(ProgramTest):
    def assert_usage(self, piece, *arguments):
        result = run(RUNTIME, *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertRegex(result.stderr, r"^error: .*\nhint: .*--help\n$")
        self.assertIn(piece, result.stderr)

    def record(self, *arguments):
        self.write("touch.csv", TOUCH)
        result = run(RUNTIME, "play", CUBE, "--device", "script:touch.csv", "--tool", "sphere:0.1", "--fast", "--record", "touch.mcap",
                     *arguments, cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)

    @contextlib.contextmanager
    def started(self, *arguments):
        """The process, and the address that it says."""
        process = subprocess.Popen([RUNTIME, *map(str, arguments)], cwd=self.folder, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            told = ""
            while not (found := re.search(r"open (\S+) in a browser", told)):
                line = process.stderr.readline()
                self.assertTrue(line, told)
                told += line
            yield process, found[1]
        finally:
            process.kill()
            process.communicate()

    def end(self, process, number):
        process.send_signal(number)
        output, _ = process.communicate(timeout=PATIENCE)
        return process.returncode, output

    def assert_taken(self, *arguments):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            result = run(RUNTIME, *arguments, "--view-address", port, cwd=self.folder)
        self.assert_refused(result, f"127.0.0.1:{port}: cannot listen", "Choose another port")
        self.assertNotIn("loaded in", result.stderr, "the port is looked at first")
        self.assertNotIn("open http", result.stderr)

    def assert_asks_for_token(self, *arguments):
        tokens = set()
        for address in ("127.0.0.1:0", "0.0.0.0:0"):
            with self.started(*arguments, "--view-address", address) as (_, url):
                self.assertRegex(url, r"^http://127\.0\.0\.1:\d+/\?token=[0-9a-f]{32}$")
                bare, token = url.split("?")
                tokens.add(token)
                self.assertEqual(status_of(url), 200)
                self.assertEqual(status_of(bare), 403)
                self.assertEqual(status_of(bare + "surface.stl"), 403)
                self.assertEqual(status_of(f"{bare}?token={32 * '0'}"), 403)
        self.assertEqual(len(tokens), 2)

    def assert_wrong_addresses(self, *arguments):
        for text in ("bogus", "127.0.0.1:", ":8017", "65536", "127.0.0.1:-1"):
            with self.subTest(text=text):
                self.assert_usage(f"'{text}' is not [ADDRESS:]PORT", *arguments, f"--view-address={text}")
        self.assert_refused(run(RUNTIME, *arguments, "--view-address", "elsewhere:0", cwd=self.folder),
                            "'elsewhere' is not an IP address", "127.0.0.1")


class PlayView(ViewTest):
    PLAY = ("play", CUBE, "--view")

    def test_shows_itself_until_it_is_stopped(self):
        with self.started(*self.PLAY, "--view-address", "0", "--tool", "sphere:0.1", "--report", "-") as (process, url):
            self.assertEqual(status_of(url), 200)
            code, output = self.end(process, signal.SIGTERM)
            self.assertEqual(code, 130)
            self.assertEqual(json.loads(output)["ticks_in_contact"], 0)

    def test_says_where_only_when_it_can_be_seen(self):
        """What is refused is refused before anybody opens a page for it."""
        self.write("broken.palpate.hdf", "nothing")
        for arguments in (("play", "broken.palpate.hdf", "--view"), (*self.PLAY, "--overlay", "r=3,rings=1"),
                          (*self.PLAY, "--contact", "dynamic"), (*self.PLAY, "--record", "none/out.mcap")):
            with self.subTest(arguments=arguments):
                result = run(RUNTIME, *arguments, "--view-address", "0", "--duration", "0.1", cwd=self.folder)
                if arguments[-1] == "r=3,rings=1" and result.returncode == 0:
                    continue
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertNotIn("open http", result.stderr)
                self.assertRegex(result.stderr, "error: .*\nhint: ")

    def test_the_tool_where_none_is_given(self):
        for arguments, tool in (((), {"radius_m": 0.17}), (("--tool", "point"), {"radius_m": 0}), (("--tool", "sphere:0.05"), {"radius_m": 0.05})):
            result = run(RUNTIME, *self.PLAY, "--view-address", "0", "--duration", "0.05", "--report", "-", *arguments, cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            told = json.loads(result.stdout)["tool"]
            self.assertEqual({name: told[name] for name in tool}, tool)
            self.assertEqual("tool: sphere:0.17, which suits the body" in result.stderr, not arguments, result.stderr)
        self.write("touch.csv", TOUCH)
        script = run(RUNTIME, "play", CUBE, "--device", "script:touch.csv", "--fast", "--report", "-", cwd=self.folder)
        self.assertEqual(json.loads(script.stdout)["tool"]["radius_m"], 0, "what a script does depends on no mesh")

    def test_a_tool_larger_than_the_body_is_told(self):
        for tool, is_large in (("sphere:0.86", False), ("sphere:0.87", True), ("sphere:8", True)):
            result = run(RUNTIME, *self.PLAY, "--view-address", "0", "--duration", "0.05", "--tool", tool, cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual("m long, and the whole body 1.732 m: lengths are metres" in result.stderr, is_large, result.stderr)

    def test_a_duration_ends_it(self):
        with self.started(*self.PLAY, "--view-address", "0", "--duration", "0.2", "--report", "-") as (process, _):
            output, _ = process.communicate(timeout=PATIENCE)
            self.assertEqual((process.returncode, json.loads(output)["ticks"]), (0, 200))

    def test_address(self):
        self.assert_taken(*self.PLAY)
        self.assert_asks_for_token(*self.PLAY)
        self.assert_wrong_addresses(*self.PLAY)

    def test_a_recording_beside_it(self):
        self.record()
        with self.started(*self.PLAY, "--view-address", "0", "--beside", "touch.mcap") as (process, url):
            for page in ("beside", "", "2/"):
                self.assertEqual(status_of(url.replace("/beside?", f"/{page}?")), 200)
            self.assertEqual(self.end(process, signal.SIGTERM)[0], 130)
        over_itself = run(RUNTIME, *self.PLAY, "--view-address", "0", "--beside", "touch.mcap", "--record", "touch.mcap", cwd=self.folder)
        self.assert_refused(over_itself, "the recording beside it")

    def test_wrong_arguments(self):
        self.assert_usage("what is shown keeps the clock", *self.PLAY, "--fast")
        self.assert_usage("what is shown keeps the clock", *self.PLAY, "--fast", "--device", "script:touch.csv")
        self.assert_usage("it is for --view, which is not given", "play", CUBE, "--device", "script:touch.csv", "--view-address", "0")
        self.assert_usage("or --view (to move it with the pointer", "play", CUBE)
        self.assert_usage("it is for --view, which is not given", "play", CUBE, "--device", "script:touch.csv", "--beside", "touch.mcap")
        self.assert_usage("give --view too", "play", CUBE, "--device", "mouse")
        self.assert_usage("the pointer is in the body's frame already", *self.PLAY, "--motion-scale", "2")
        self.assert_usage("profiles are for --device hid", *self.PLAY, "--profile", "polhem_v1")


class View(ViewTest):
    def test_shows_a_recording_until_it_is_stopped(self):
        self.record()
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.started("view", "touch.mcap", "--view-address", "0") as (process, url):
                self.assertEqual(status_of(url), 200)
                self.assertEqual(status_of(url.replace("/?", "/surface.vtu?")), 200)
                self.assertEqual(self.end(process, number), (0, ""))

    def test_shows_two_side_by_side(self):
        self.record()
        with self.started("view", "touch.mcap", "touch.mcap", "--view-address", "0") as (process, url):
            self.assertIn("/beside?token=", url)
            for page in ("beside", "", "2/", "2/surface.vtu"):
                self.assertEqual(status_of(url.replace("/beside?", f"/{page}?")), 200)
            self.assertEqual(self.end(process, signal.SIGINT), (0, ""))

    def test_address(self):
        self.record()
        self.assert_taken("view", "touch.mcap")
        self.assert_asks_for_token("view", "touch.mcap")
        self.assert_wrong_addresses("view", "touch.mcap")

    def test_refuses_what_it_cannot_show(self):
        self.assert_refused(run(RUNTIME, "view", CUBE), "is a model, not a recording", "play")
        self.assert_refused(run(RUNTIME, "view", "none.mcap", cwd=self.folder), "none.mcap")
        self.record("--record-frames", "0")
        self.assert_refused(run(RUNTIME, "view", "touch.mcap", cwd=self.folder), "touch.mcap", "--record-frames 0")


class Export(ViewTest):
    def export(self, *arguments, html="touch.html"):
        return run(RUNTIME, "export", "touch.mcap", "--html", html, *arguments, cwd=self.folder)

    def test_writes_a_page(self):
        self.record()
        result = self.export()
        self.assertEqual(result.returncode, 0, result.stderr)
        page = (self.folder / "touch.html").read_text(encoding="utf-8")
        self.assertIn('id="palpate-session"', page)
        self.assertRegex(result.stderr, rf"^touch\.html: 6 pictures, 0\.2 s, {len(page.encode()) / 1e6:.1f} MB\n$")
        self.assertIn(": 3 pictures, 0.1 s,", self.export("--fps", "15", "--from", "0.05").stderr)
        self.assertIn(": 2 pictures, ", self.export("--to", "0.05").stderr)

    def test_what_cannot_be(self):
        self.record()
        self.assert_refused(self.export("--from", "3"), "has no pictures from 3 s on", "It lasts from 0 to 0.187 s")
        self.assert_refused(self.export(html="none/touch.html"), "none/touch.html: cannot be written")
        self.assert_refused(run(RUNTIME, "export", "none.mcap", "--html", "touch.html", cwd=self.folder), "none.mcap")
        self.assertFalse((self.folder / "touch.html").exists())
        self.assert_usage("--html", "export", "touch.mcap")
        for option, text in (("--fps", "0"), ("--fps", "-1"), ("--fps", "nan"), ("--from", "-1"), ("--to", "soon")):
            with self.subTest(option=option, text=text):
                self.assert_usage(option, "export", "touch.mcap", "--html", "touch.html", f"{option}={text}")
