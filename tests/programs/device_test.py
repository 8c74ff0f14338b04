"""A hand in the loop: another process as the device, what it feels, sessions that are replayed, killed and refused."""

import contextlib
import json
import os
import pathlib
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest
from unittest import mock

import numpy

from programs import BINARY, PATIENCE, RUNTIME, ProgramTest, cube_toml, done, palpate, recorded, run

BRIDGE = BINARY / "runtime" / "palpate-bridge-example"
SPRING = 300.0  # of the example's hand [N/m]
# A cube of 10 cm, as stiff as a soft organ: at its top's middle some 80 N/m to a ball.
SMALL_CUBE = cube_toml(4, scope="full").replace("size = [1, 1, 1]", "size = [0.1, 0.1, 0.1]").replace("youngs_modulus = 1.0", "youngs_modulus = 3000")
# This machine may be busy: late ticks and reports, and hands that seem to jump meanwhile, have their own tests.
CALM = "late=10,most_late=1e9,stale_life=10,silence=30,silence_fade=20,frozen=100,ramp=0.2,buzz_flips=1000"
PATIENT = CALM + ",max_speed=1000"


def bridge_socket():
    return socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)


class Hand(threading.Thread):
    """A device of the test's own behind the bridge. Its way is by what it hears, not by a clock: `move(hand)` gives the height [m] that it says next."""

    STATE = struct.Struct("<4sIIIQ3d3d4ff5f")

    def __init__(self, name, move):
        super().__init__(daemon=True)
        self.name = name
        self.move = move
        self.height = 0.0
        self.force = 0.0  # along z, of the last word [N]
        self.heard = 0  # words
        self.said = 0
        self.last = b""
        self.is_over = False
        self.start()

    def run(self):
        while not self.is_over:
            with contextlib.suppress(FileNotFoundError, ConnectionRefusedError), bridge_socket() as wire:  # there is no runtime, or not yet
                wire.connect(str(self.name))
                wire.settimeout(0.05)
                while not self.is_over and self.hear(wire):
                    self.say(wire)
                wire.setblocking(False)
                while self.hear(wire):
                    pass
            time.sleep(0.01)

    def say(self, wire):
        self.height = self.move(self)
        self.said += 1
        tremor = 1e-6 * (self.said % 5)
        with contextlib.suppress(OSError):  # the runtime has ended: what it said last is still to be heard
            wire.send(self.STATE.pack(b"PLPS", 3, self.said, 1 << 16, time.monotonic_ns(), 0, 0, self.height + tremor, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0))

    def hear(self, wire):
        """The next word; false where there is no more."""
        try:
            word = wire.recv(256)
        except TimeoutError:
            return True  # it is silent: it may wait for us
        except ConnectionResetError:
            return True  # said once
        except BlockingIOError:
            return False
        if word:
            self.last = word
            self.force = struct.unpack_from("<d", word, 40)[0]
            self.heard += 1
        return bool(word)

    def end(self):
        self.is_over = True
        self.join()


def down_to(height):
    """From 1 cm above touch, where it stays for as long as force may need to begin, down by 0.02 mm a word."""
    return lambda hand: max(height, 0.01 - 2e-5 * max(0, hand.heard - 300))


class Felt(ProgramTest):
    """The bridge's example is the hand: it presses on the cube from above."""

    def setUp(self):
        super().setUp()
        self.file = self.bake(SMALL_CUBE)
        self.name = self.folder / "bridge.socket"

    def start(self, program, *arguments):
        messages = tempfile.NamedTemporaryFile("w+", dir=self.folder, suffix=".txt")
        self.addCleanup(messages.close)
        process = subprocess.Popen([str(program), *map(str, arguments)], cwd=self.folder, stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=messages, text=True)
        process.messages = pathlib.Path(messages.name)  # what it has said
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stdin.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def play(self, *arguments):
        return self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.name}", "--tool", "sphere:0.01", "--origin",
                          "0.05,0.05,0.12", "--safety", PATIENT, "--record", "session.mcap", "--report", "report.json", *arguments)

    def hand(self, seconds, depth, period=0.0, start=0.0):
        return self.start(BRIDGE, "--socket", self.name, "--seconds", seconds, "--rate", 1000, "--from", f"0,0,{start}", "--to",
                          f"0,0,{-depth}", "--period", period)

    def own_hand(self, move):
        hand = Hand(self.name, move)
        self.addCleanup(hand.end)
        return hand

    def recorded(self, field):
        return recorded(self.folder / "session.mcap", field)

    def shown(self):
        """The size of the force on the hand in each tick up to now."""
        return numpy.linalg.norm(numpy.reshape(self.recorded("shown_force"), (-1, 3)), axis=1)

    def finish(self, process, code=0):
        process.communicate(timeout=PATIENCE)
        messages = process.messages.read_text()
        self.assertEqual(process.returncode, code, messages)
        return messages

    def test_the_hand_rests_where_its_spring_and_the_body_balance(self):
        """The hand's spring is drawn to 20 mm below touch. Hand and body share it by their stiffnesses."""
        def drawn(hand):
            if hand.heard < 300:
                return 0.01  # force begins out of contact
            wanted = -0.02 + hand.force / SPRING
            hand.still = hand.still + 1 if abs(wanted - hand.height) < 5e-6 else 0
            return hand.height + 0.05 * (wanted - hand.height)
        Hand.still = 0
        runtime = self.play("--overlay", "no", "--depth", "no")  # as `probe`; a fine surface's force at such depth depends on the way there
        hand = self.own_hand(drawn)
        self.wait_for(lambda: hand.still > 500, runtime)
        runtime.send_signal(signal.SIGINT)
        messages = self.finish(runtime, 130)
        self.assertIn(f"device: bridge:{self.name}", messages)
        report = json.loads((self.folder / "report.json").read_text())
        self.assertGreater(report["ticks_in_contact"], 500)
        self.assertEqual(sum(report["safety"]["faults"].values()), 0)
        ticks = palpate.read(self.folder / "session.mcap")
        z = ticks["handle_position"][-100:, 2]
        shown, computed = ticks["shown_force"][-100:], ticks["force"][-100:]
        numpy.testing.assert_allclose(shown, -computed, rtol=1e-9, atol=1e-9)
        numpy.testing.assert_allclose(shown[:, 2], SPRING * (z + 0.02), atol=4e-3)  # of 1.3 N; 1.2e-3 N by the tremor
        self.assertGreater(shown[:, 2].min(), 0.3)
        # The same place by a script, in another run without a hand.
        height = 0.12 + z.mean()
        script = self.write("there.csv", f"t,x,y,z\n0,0.05,0.05,0.13\n0.5,0.05,0.05,{height}\n1.5,0.05,0.05,{height}\n")
        done(RUNTIME, "play", self.file, "--device", f"script:{script}", "--tool", "sphere:0.01", "--overlay", "no", "--depth", "no", "--coupling", "2000", "--fast", "--record", "there.mcap", cwd=self.folder)
        there = palpate.read(self.folder / "there.mcap")
        self.assertAlmostEqual(shown[:, 2].mean(), -there["force"][-1, 2], delta=2e-3)

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
        runtime = self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.name}", "--origin", "0.05,0.05,0.12", "--safety",
                             CALM + ",max_speed=0.1", "--record", "session.mcap", "--report", "report.json")
        # In free space to and fro by 5 cm, until that was too fast; then it rests.
        hand = self.own_hand(lambda hand: 0.15 + 0.05 * (hand.heard % 2))
        self.wait_for(lambda: numpy.any(self.recorded("fault")), runtime)
        hand.move = lambda hand: 0.15

        def acknowledged_for_long():
            acknowledge(runtime)
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

    def test_messages_that_are_not_taken_are_told(self):
        runtime = self.play("--duration", "0.2")
        self.wait_for(lambda: "waiting for bridge:" in runtime.messages.read_text(), runtime)
        with bridge_socket() as hand:
            hand.connect(str(self.name))
            for _ in range(5):
                hand.send(b"nonsense")
        self.own_hand(down_to(0.01))
        messages = self.finish(runtime)
        self.assertIn("refused of the device: 5 messages by version", messages)
        report = json.loads((self.folder / "report.json").read_text())
        self.assertRegex(report["device"]["refused"], "^5 messages by version")  # on a busy machine some by their age, too

    def test_signals_leave_no_force_and_a_whole_session(self):
        for stop in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(stop=stop):
                runtime = self.play("--force")  # in the place of the recording of the signal before
                hand = self.own_hand(down_to(-0.02))
                self.wait_for(lambda: hand.force > 0.2, runtime)
                runtime.send_signal(stop)
                self.finish(runtime, 130)
                hand.end()
                self.assertEqual(struct.unpack_from("<I", hand.last, 12)[0], 0, "the last word is no force")
                self.assertGreater(len(palpate.read(self.folder / "session.mcap")["time"]), 100)

    def test_the_example_finds_runtime_and_body_by_itself(self):
        """docs/devices.md's two commands: without --to the hand goes down until it feels something."""
        with mock.patch.dict(os.environ, XDG_RUNTIME_DIR=str(self.folder)):
            runtime = self.start(RUNTIME, "play", self.file, "--device", "bridge", "--safety", PATIENT, "--record", "session.mcap",
                                 "--report", "report.json")
            hand = self.start(BRIDGE, "--rate", 2000, "--seconds", 600)
        self.wait_for(lambda: (self.shown() > 0.3).sum() > 100, runtime)
        runtime.send_signal(signal.SIGINT)
        messages = self.finish(runtime, 130)
        self.assertNotIn("never touched", messages)
        report = json.loads((self.folder / "report.json").read_text())
        self.assertGreater(report["ticks_in_contact"], 100)
        self.assertGreater(report["largest_force_N"], 0.3)
        self.assertGreater(report["tool"]["radius_m"], 0, "a ball that suits the body")
        hand.terminate()
        said, _ = hand.communicate(timeout=PATIENCE)
        self.assertNotIn("no force was ever felt", said)

    def test_who_never_touches_is_told(self):
        runtime = self.start(RUNTIME, "play", self.file, "--device", f"bridge:{self.name}", "--safety", PATIENT, "--duration", "0.5",
                             "--report", "report.json")
        hand = self.start(BRIDGE, "--socket", self.name, "--seconds", 60, "--to", "0,0,0.02")
        messages = self.finish(runtime)
        self.assertRegex(messages, r"the tool never touched the body: move the device on.*the tool ended at \(.*\) m; the body rests in \(0, 0, 0\)")
        hand.terminate()
        self.assertIn("no force was ever felt", hand.communicate(timeout=PATIENCE)[0])

    def test_its_socket_is_for_this_user_and_as_long_as_it_runs(self):
        runtime = self.play("--duration", "0.2")
        self.wait_for(lambda: "waiting for bridge:" in runtime.messages.read_text(), runtime)
        self.assertEqual(self.name.stat().st_mode & 0o777, 0o600)
        self.hand(60, 0.0, 0.0, 0.1)
        self.finish(runtime)
        self.assertFalse(self.name.exists())


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
                               (f"bridge:{self.folder / ('x' * 200)}", ("at most 107 bytes",)), ("bridge:/tmp/bridge.socket", ("/tmp", "somebody else may write there"))):
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

    def test_two_runtimes_at_one_socket(self):
        file = self.bake(cube_toml(2))
        name = self.folder / "bridge.socket"
        with bridge_socket() as taken:
            taken.bind(str(name))
            taken.listen()
            self.assert_refused(run(RUNTIME, "play", file, "--device", f"bridge:{name}", cwd=self.folder), str(name))


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
        common = (RUNTIME, "play", file, "--device", f"script:{script}", "--tool", "sphere:0.01", "--fast", "--record", "a.mcap", "--force", "--report", "-")
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
        self.assertGreater(computed.max(), 0.3)
        numpy.testing.assert_allclose(shown[200:], numpy.minimum(computed, 0.2)[200:], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
