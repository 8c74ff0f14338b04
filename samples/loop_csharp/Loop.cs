// The same in C#, as in Unity, Godot or .NET: Palpate.cs is one file beside yours.
using System;
using System.Threading;
using Palpate;

static class Loop {
  static int Main() {
    try {
      using (var session = new Session("block.palpate.hdf", Tool.Sphere(0.01))) {
        session.Record("loop.mcap");
        for (int tick = 0; tick <= 420; ++tick) {
          session.Step(new Pose(new Vector(0.03, 0.03, 0.0402 - 0.00001 * tick)));
          Felt felt = session.Felt();
          if (tick % 70 == 0) Console.WriteLine("{0,3} ms: {1:F6} N, {2} contacts", tick, felt.Force.Z, felt.Contacts);
          Thread.Sleep(1);  // a thread of its own, not Update
        }
        session.EndRecording();
      }
      return 0;
    } catch (PalpateException error) {
      Console.Error.WriteLine(error.Message + ": " + error.Hint);
      return 1;
    }
  }
}
