"""A hand in the loop: another process as the device, what it feels, sessions that are replayed, killed and refused."""

import contextlib
import json
import pathlib
import signal
import socket
import struct
import subprocess
import time
import unittest

import numpy

from bridge_key import key_file, read_key, seal
from programs import BINARY, RUNTIME, ProgramTest, cube_toml, palpate, recorded, run

BRIDGE = BINARY / "runtime" / "palpate-bridge-example"
SPRING = 300.0  # of the example's hand [N/m]
# A cube of 10 cm, as stiff as a soft organ: at its top's middle some 80 N/m to a ball.
SMALL_CUBE = cube_toml(4, scope="full").replace("size = [1, 1, 1]", "size = [0.1, 0.1, 0.1]").replace("youngs_modulus = 1.0", "youngs_modulus = 3000")
# This machine may be busy: late ticks and reports, and hands that seem to jump meanwhile, have their own tests.
CALM = "late=10,most_late=1e9,stale_life=10,silence=30,silence_fade=20,frozen=100,ramp=0.2,buzz_flips=1000"
PATIENT = CALM + ",max_speed=1000"


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Felt(ProgramTest):
    """The bridge's example is the hand: it presses on the cube from above."""

    def setUp(self):
        super().setUp()
        self.file = self.bake(SMALL_CUBE)
        self.port = free_port()

    def start(self, program, *arguments):
        process = subprocess.Popen([str(program), *map(str, arguments)], cwd=self.folder, stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.stdin.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def play(self, *arguments):
        return self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.port}", "--tool", "sphere:0.01", "--origin",
                          "0.05,0.05,0.12", "--safety", PATIENT, "--record", "session.mcap", "--report", "report.json", *arguments)

    def hand(self, seconds, depth, period=0.0, start=0.0):
        return self.start(BRIDGE, "--port", self.port, "--seconds", seconds, "--rate", 1000, "--from", f"0,0,{start}", "--to",
                          f"0,0,{-depth}", "--period", period)

    def recorded(self, field):
        return recorded(self.folder / "session.mcap", field)

    def shown(self):
        """The size of the force on the hand in each tick up to now."""
        return numpy.linalg.norm(numpy.reshape(self.recorded("shown_force"), (-1, 3)), axis=1)

    def finish(self, process, code=0):
        _, messages = process.communicate(timeout=120)
        self.assertEqual(process.returncode, code, messages)
        return messages

    def test_the_hand_rests_where_its_spring_and_the_body_balance(self):
        """Half a period of 8 s in: the target is 20 mm below touch. Hand and body share it by their stiffnesses."""
        runtime = self.play("--duration", "4")
        self.hand(60, 0.03, 8)
        messages = self.finish(runtime)
        self.assertIn(f"device: bridge:127.0.0.1:{self.port}", messages)
        report = json.loads((self.folder / "report.json").read_text())
        self.assertEqual(report["ticks"], 4000)
        self.assertGreater(report["ticks_in_contact"], 1000)
        self.assertEqual(sum(report["safety"]["faults"].values()), 0)
        session = palpate.read(self.folder / "session.mcap")
        ticks = session
        end = slice(3800, 4000)
        z, force = ticks["handle_position"][end, 2], ticks["shown_force"][end, 2]
        shown, computed = ticks["shown_force"][end], ticks["force"][end]
        t = ticks["arrived_ns"][end] * 1e-9
        numpy.testing.assert_allclose(shown, -computed, rtol=1e-9, atol=1e-9)
        self.assertGreater(force.min(), 0.3)
        # The target of the hand began its way when the bridge was started, a little before the loop: its spring's force
        # is the shown one, but for damper and mass, which a slow hand hardly feels.
        def target(t, offset):
            return -0.03 * (0.5 - 0.5 * numpy.cos(2 * numpy.pi * (t + offset) / 8))
        offsets = numpy.linspace(-1, 4, 5001)
        errors = [numpy.abs(SPRING * (target(t, offset) - z) + force).max() for offset in offsets]
        self.assertLess(min(errors), 0.05 * force.max())

    def test_a_killed_session_opens_and_its_replay_is_the_same_bit_by_bit(self):
        runtime = self.play("--overlay", "r=2,rings=1")
        self.hand(60, 0.03, 1.5)
        self.wait_for(lambda: len(force := self.recorded("force")) >= 2500 and numpy.abs(force).max() > 0.1, runtime)
        runtime.send_signal(signal.SIGKILL)
        runtime.wait()
        session = palpate.read(self.folder / "session.mcap")
        force = session["force"]
        self.assertGreaterEqual(len(force), 2500)
        self.assertGreater(numpy.abs(force).max(), 0.1)
        replay = run(RUNTIME, "play", self.file, "--device", "replay:session.mcap", "--fast", "--record", "again.mcap", "--report", "-", cwd=self.folder)
        self.assertEqual(replay.returncode, 0, replay.stderr)
        report = json.loads(replay.stdout)
        self.assertEqual((report["replay"]["ticks"], report["replay"]["different_ticks"]), (len(force), 0), replay.stderr)
        self.assertIsNone(report["replay"]["first_different_tick"])
        again = palpate.read(self.folder / "again.mcap")
        numpy.testing.assert_array_equal(again["force"], force)
        # It is a comparison: with another tool it is another session.
        other = run(RUNTIME, "play", self.file, "--device", "replay:session.mcap", "--fast", "--tool", "sphere:0.012", "--report", "-", cwd=self.folder)
        self.assertEqual(other.returncode, 3, other.stderr)
        told = json.loads(other.stdout)["replay"]
        self.assertGreater(told["different_ticks"], 100)
        self.assertIn(f"the first is tick {told['first_different_tick']}, in its {told['first_different_field']}", other.stderr)

    def test_a_bridge_that_goes_is_a_fault_and_may_come_back(self):
        runtime = self.play()
        first = self.hand(600, 0.03, 1.0)
        self.wait_for(lambda: (self.shown() > 0.1).any(), runtime)
        first.kill()
        first.wait()
        self.wait_for(lambda: numpy.any(self.recorded("fault")), runtime)
        self.hand(600, 0.03, 1.0)
        gone = numpy.nonzero(self.recorded("fault"))[0][0]
        self.wait_for(lambda: (self.shown()[gone:] > 0.1).any(), runtime)
        runtime.send_signal(signal.SIGINT)
        messages = self.finish(runtime, 130)
        self.assertIn("device_lost", messages)
        self.assertIn("the device is back", messages)
        report = json.loads((self.folder / "report.json").read_text())
        self.assertEqual(report["device"]["opened_again"], 1)
        session = palpate.read(self.folder / "session.mcap")
        shown = numpy.linalg.norm(session["shown_force"], axis=1)
        fault = session["fault"]
        gone, = numpy.nonzero(fault)
        self.assertEqual(shown[gone].max(), 0)
        self.assertGreater(shown[: gone[0]].max(), 0.1)
        self.assertGreater(shown[gone[0]:].max(), 0.1, "force has begun again")

    def test_a_fault_is_latched_until_enter(self):
        def press_enter(runtime):
            with contextlib.suppress(BrokenPipeError):  # it has ended
                runtime.stdin.write("\n")
                runtime.stdin.flush()
        self.fault_is_acknowledged(press_enter)

    def test_a_fault_is_latched_until_the_signal(self):
        """As for a run in the background, which has no terminal to press Enter at."""
        self.fault_is_acknowledged(lambda runtime: runtime.send_signal(signal.SIGUSR1))

    def fault_is_acknowledged(self, acknowledge):
        runtime = self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.port}", "--origin", "0.05,0.05,0.12", "--safety",
                             CALM + ",max_speed=0.1", "--record", "session.mcap", "--report", "report.json")
        self.hand(600, 0.0, 3.5, 0.15)  # 0.13 m/s at most, at 0.9 s: free space all the way, slow for half of the time
        self.wait_for(lambda: numpy.any(self.recorded("fault")), runtime)

        def acknowledged_for_long():
            """It must come while the hand is slow."""
            acknowledge(runtime)
            time.sleep(0.3)
            fault, event = self.recorded("fault"), self.recorded("event")
            return any(len(fault) >= k + 400 and not fault[k : k + 400].any() for k in numpy.flatnonzero(numpy.bitwise_and(event, 4)))

        self.wait_for(acknowledged_for_long, runtime)
        runtime.send_signal(signal.SIGINT)
        messages = self.finish(runtime, 130)
        self.assertIn("no force, too_fast: the handle moved faster than max_speed. Press Enter to go on, or: kill -USR1 "
                      f"{runtime.pid}", messages)
        self.assertIn("acknowledged; force begins again out of contact", messages)
        session = palpate.read(self.folder / "session.mcap")
        fault, event = session["fault"], session["event"]
        acknowledged, latched = numpy.flatnonzero(event & 4), numpy.flatnonzero(fault)
        self.assertEqual(set(fault[latched[0] : acknowledged[0]]), {1}, "nothing else ends it")
        ended = 1 + numpy.flatnonzero((fault[:-1] == 1) & (fault[1:] == 0))
        self.assertGreater(len(ended), 0)
        self.assertTrue((event[ended] & 4 != 0).all(), "nothing else ends it")

    def test_datagrams_that_are_not_taken_are_told(self):
        runtime = self.play("--duration", "0.2")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hand:
            for _ in range(5):
                hand.sendto(b"nonsense", ("127.0.0.1", self.port))
                time.sleep(0.2)
        self.hand(60, 0.0, 0.0, 0.1)
        messages = self.finish(runtime)
        self.assertIn("waiting for bridge:", messages)
        self.assertRegex(messages, "refused: [1-5] datagrams by magic")
        report = json.loads((self.folder / "report.json").read_text())
        self.assertRegex(report["device"]["refused"], "^[1-5] datagrams by magic$")

    def test_signals_leave_no_force_and_a_whole_session(self):
        for stop in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hand:
                hand.settimeout(20)
                runtime = self.play()
                state = struct.Struct("<4sHHQIIQ3d3d4f f 5f 8x")
                nonce, last = 0, b""
                for k in range(1, 100000):
                    z = -min(0.02, 2e-5 * k)
                    said = state.pack(b"PLPS", 2, 128, nonce, k, 1 << 16, time.monotonic_ns(), 0, 0, z + 1e-6 * (k % 5), 0, 0, 0,
                                      1, 0, 0, 0, 0, 0, 0, 0, 0, 0)
                    if key_file(self.port).exists():
                        hand.sendto(seal(read_key(self.port), said), ("127.0.0.1", self.port))
                    time.sleep(0.001)
                    hand.setblocking(False)
                    try:
                        while True:
                            last = hand.recv(256)
                    except OSError:
                        pass
                    if last:
                        nonce = struct.unpack_from("<Q", last, 8)[0]
                        if struct.unpack_from("<d", last, 56)[0] > 0.2:
                            break
                self.assertGreater(struct.unpack_from("<d", last, 56)[0], 0.2, "it was felt")
                runtime.send_signal(stop)
                self.finish(runtime, 130)
                try:
                    while True:
                        last = hand.recv(256)
                except OSError:
                    pass
                self.assertEqual(struct.unpack_from("<I", last, 32)[0], 0, "the last word is no force")
            session = palpate.read(self.folder / "session.mcap")
            self.assertGreater(len(session["time"]), 100)

    def test_the_example_finds_the_body_by_itself(self):
        """docs/devices.md's two commands: without --to the hand goes down until it feels something."""
        runtime = self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.port}", "--safety", PATIENT, "--duration", "6",
                             "--report", "report.json")
        hand = self.start(BRIDGE, "--port", self.port, "--rate", 2000, "--seconds", 60)
        messages = self.finish(runtime)
        self.assertNotIn("never touched", messages)
        report = json.loads((self.folder / "report.json").read_text())
        self.assertGreater(report["ticks_in_contact"], 100)
        self.assertGreater(report["largest_force_N"], 0.3)
        self.assertGreater(report["tool"]["radius_m"], 0, "a ball that suits the body")
        hand.terminate()
        said, _ = hand.communicate(timeout=60)
        self.assertNotIn("no force was ever felt", said)

    def test_who_never_touches_is_told(self):
        runtime = self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.port}", "--safety", PATIENT, "--duration", "0.5",
                             "--report", "report.json")
        hand = self.start(BRIDGE, "--port", self.port, "--seconds", 60, "--to", "0,0,0.02")
        messages = self.finish(runtime)
        self.assertRegex(messages, r"the tool never touched the body: move the device on.*the tool ended at \(.*\) m; the body rests in \(0, 0, 0\)")
        hand.terminate()
        self.assertIn("no force was ever felt", hand.communicate(timeout=60)[0])

    def test_a_stranger_is_told_where_the_key_is(self):
        runtime = self.play("--duration", "0.2")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.settimeout(0.2)
            while not key_file(self.port).exists():
                time.sleep(0.02)
            hello = struct.pack("<4sHHQIIQ3d3d4f f 5f 8x", b"PLPS", 2, 128, 0, 1, 0, 1, *[0.0] * 6, 1.0, *[0.0] * 9)
            for _ in range(3):
                stranger.sendto(hello, ("127.0.0.1", self.port))
                with self.assertRaises(TimeoutError):
                    stranger.recv(256)
        self.assertEqual(key_file(self.port).stat().st_mode & 0o777, 0o600)
        self.hand(60, 0.0, 0.0, 0.1)
        messages = self.finish(runtime)
        self.assertIn(f"3 datagrams by seal (the key is in {key_file(self.port)})", messages)
        self.assertFalse(key_file(self.port).exists(), "it is gone with the runtime")


class Choice(ProgramTest):
    """What is said about devices that are not there, or cannot be what they should be."""

    def test_wrong_choices(self):
        file = self.bake(cube_toml(2))
        script = self.write("a.csv", "t,x,y,z\n0,0,0,2\n0.01,0,0,2\n")
        for arguments, pieces in (
                ((), ("--device", "--view")),
                (("--device", "mouse"), ("'mouse' is the pointer in a browser", "--view")),
                (("--view", "--fast"), ("--fast", "keeps the clock")),
                (("--view", "--view-address", "1:2:70000"), ("'1:2:70000' is not [ADDRESS:]PORT",)),
                (("--device", f"script:{script}", "--view-address", "8017"), ("--view-address", "--view")),
                (("--view", "--origin", "0,0,1"), ("--origin", "in the body's frame")),
                (("--device", f"script:{script}", "--load-scale", "-1"), ("--load-scale", "not a number that is 0 or more")),
                (("--device", f"script:{script}", "--stiffness-scale", "0"), ("--stiffness-scale", "not a number that is greater than 0")),
                (("--device", "mouse-trap"), ("is none of script:FILE.csv, replay:SESSION.mcap, hid[:WHICH]",)),
                (("--device", "script:"), ("is none of",)),
                (("--device", "hid", "--fast"), ("--fast", "a hand cannot be run ahead of")),
                (("--device", f"script:{script}", "--profile", "polhem_v1"), ("--profile", "--device hid")),
                (("--device", f"script:{script}", "--axes", "x,y,-z"), ("--axes", "mirror image")),
                (("--device", f"script:{script}", "--origin", "1,2,nan"), ("--origin", "not finite numbers")),
                (("--device", f"script:{script}", "--motion-scale", "0"), ("--motion-scale", "not a number that is greater than 0")),
                (("--device", f"script:{script}", "--safety", "max_farce=3"), ("--safety", "no safety option 'max_farce'")),
                (("--device", f"script:{script}", "--rate", "999"), ("--rate", "from 1000 to 5000")),
                (("--device", f"script:{script}", "--cpu", "one"), ("--cpu", "not the number of a processor")),
        ):
            result = run(RUNTIME, "play", file, *arguments, cwd=self.folder)
            self.assertEqual(result.returncode, 2, f"{arguments}: {result.stderr}")
            for piece in pieces:
                self.assertIn(piece, result.stderr)
        for device, pieces in (("replay:none.mcap", ("none.mcap",)), (f"replay:{file}", ("is a model, not a recording",)),
                               ("bridge:70000", ("70000",)), ("bridge:1.2.3.4:4270", ("1.2.3.4",))):
            self.assert_refused(run(RUNTIME, "play", file, "--device", device, cwd=self.folder), *pieces)
        self.assert_refused(run(RUNTIME, "play", file, "--device", f"script:{script}", "--cpu", "4000", cwd=self.folder),
                            "--cpu", "processor 4000")

    @unittest.skipIf(any(pathlib.Path("/sys/class/hidraw").glob("*")), "there are HID devices")
    def test_no_device(self):
        file = self.bake(cube_toml(2))
        self.assert_refused(run(RUNTIME, "play", file, "--device", "hid", cwd=self.folder), "no HID device is attached", "/dev/hidraw")
        listed = run(RUNTIME, "devices")
        self.assertEqual(listed.returncode, 0)
        self.assertIn("No HID device is attached", listed.stdout)

    def test_two_runtimes_on_one_port(self):
        file = self.bake(cube_toml(2))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            port = taken.getsockname()[1]
            self.assert_refused(run(RUNTIME, "play", file, "--device", f"bridge:{port}", cwd=self.folder), str(port))


class Scripted(ProgramTest):
    """Safety, workspace and rate for a script, in which no hand is."""

    def test_a_faster_loop_finds_the_same_forces(self):
        file = self.bake(SMALL_CUBE)
        script = self.write("press.csv", "t,x,y,z\n0,0.05,0.05,0.12\n0.2,0.05,0.05,0.1\n0.3,0.05,0.05,0.1\n")
        forces = {}
        for rate in (1000, 5000):
            result = run(RUNTIME, "play", file, "--device", f"script:{script}", "--tool", "sphere:0.01", "--rate", rate, "--fast",
                         "--record", f"{rate}.mcap", cwd=self.folder)
            self.assertEqual(result.returncode, 0, result.stderr)
            session = palpate.read(self.folder / f"{rate}.mcap")
            self.assertEqual(session.rate, rate)
            self.assertEqual(len(session["time"]), 3 * rate // 10 + 1)
            forces[rate] = session["force"][:: rate // 1000]
        self.assertGreater(numpy.abs(forces[1000]).max(), 0.3)
        # The path is the same, so it differs by what a tick's motion is in the contact's linearisation.
        numpy.testing.assert_allclose(forces[5000], forces[1000], atol=0.02 * numpy.abs(forces[1000]).max())

    def test_safety_where_it_is_asked_for(self):
        file = self.bake(SMALL_CUBE)
        script = self.write("press.csv", "t,x,y,z\n0,0.05,0.05,0.12\n0.3,0.05,0.05,0.1\n0.8,0.05,0.05,0.1001\n")
        common = (RUNTIME, "play", file, "--device", f"script:{script}", "--tool", "sphere:0.01", "--fast", "--record", "a.mcap", "--report", "-")
        plain = run(*common, cwd=self.folder)
        self.assertEqual(plain.returncode, 0, plain.stderr)
        self.assertNotIn("safety", json.loads(plain.stdout))
        session = palpate.read(self.folder / "a.mcap")
        numpy.testing.assert_array_equal(session["shown_force"], -session["force"])
        guarded = run(*common, "--safety", "max_force=0.2,ramp=0.1,max_damping=0", cwd=self.folder)
        self.assertEqual(guarded.returncode, 0, guarded.stderr)
        self.assertAlmostEqual(json.loads(guarded.stdout)["safety"]["largest_shown_N"], 0.2, places=12)
        session = palpate.read(self.folder / "a.mcap")
        computed = numpy.linalg.norm(session["force"], axis=1)
        shown = numpy.linalg.norm(session["shown_force"], axis=1)
        self.assertGreater(computed.max(), 0.4)
        numpy.testing.assert_allclose(shown[200:], numpy.minimum(computed, 0.2)[200:], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
