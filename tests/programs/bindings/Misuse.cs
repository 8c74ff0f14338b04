// A session of Palpate.cs used as it may not be: exceptions, and never a crash or a wait for ever. Prints "ok".
using System;
using System.Collections.Generic;
using System.Threading;
using Palpate;

static class Misuse
{
    static readonly Pose Pressing = new Pose(new Vector(0.5, 0.5, 1.08));

    static void Expect(bool holds, string what)
    {
        if (!holds) throw new Exception(what);
    }

    static void Throws<T>(Action use) where T : Exception
    {
        try { use(); }
        catch (T) { return; }
        throw new Exception("no " + typeof(T));
    }

    static void DisposeWhileAThreadSteps(string file, string recording)
    {
        for (int run = 0; run < 8; ++run)
        {
            var session = new Session(file, Tool.Sphere(0.1), new Options { StressTicks = 4 });
            if (run % 2 == 0) session.Record(recording + run);
            int steps = 0;
            Exception failure = null;
            var loop = new Thread(() =>
            {
                try
                {
                    for (; ; Interlocked.Increment(ref steps)) { session.Step(Pressing); session.Felt(); }
                }
                catch (Exception error) { failure = error; }
            });
            loop.Start();
            while (Volatile.Read(ref steps) < 20) Thread.Yield();
            var other = new Thread(session.Dispose);
            other.Start();
            session.Dispose();
            other.Join();
            loop.Join();
            Expect(failure is ObjectDisposedException, "" + failure);
        }
    }

    static void TwoThreadsThatStep(string file)
    {
        using (var session = new Session(file, Tool.Sphere(0.1)))
        {
            Exception failure = null;
            ThreadStart step = () =>
            {
                try
                {
                    while (Volatile.Read(ref failure) == null) session.Step(Pressing);
                }
                catch (Exception error) { Volatile.Write(ref failure, error); }
            };
            var threads = new List<Thread> { new Thread(step), new Thread(step) };
            threads.ForEach(thread => thread.Start());
            threads.ForEach(thread => thread.Join());
            Expect(failure is InvalidOperationException && !(failure is ObjectDisposedException), "" + failure);
            session.Step(Pressing);
        }
    }

    static void UseAfterDispose(string file)
    {
        var session = new Session(file, Tool.Sphere(0.1));
        int nodes = session.Nodes;
        session.Dispose();
        session.Dispose();
        var uses = new List<Action>
        {
            () => session.Step(Pressing), () => session.Step(new[] { Pressing }), () => session.Felt(), () => session.Contacts(new Contact[2]), () => session.SetTool(0, Tool.Sphere(0.1)),
            session.Reset, () => session.Record("a.mcap"), session.EndRecording, () => session.Rest(new double[3 * nodes]),
            () => session.Surface(new int[session.Corners * session.Simplices]), () => session.Displacement(new double[3 * nodes]),
            () => session.Stress(new float[nodes], new float[nodes]),
        };
        uses.ForEach(Throws<ObjectDisposedException>);
    }

    static void WrongArguments(string file)
    {
        Throws<ArgumentException>(() => new Session(file + "\0b", Tool.Sphere(0.1)).Dispose());
        using (var session = new Session(file, Tool.Sphere(0.1)))
        {
            Throws<ArgumentException>(() => session.Record("a.mcap\0b"));
            Throws<PalpateException>(() => session.Record(file));
            foreach (int tool in new[] { -1, 1, int.MaxValue }) Throws<ArgumentOutOfRangeException>(() => session.Felt(tool));
            Throws<ArgumentException>(() => session.Rest(new double[1]));
            Throws<ArgumentException>(() => session.Step(new Pose[2]));
        }
    }

    static void Main(string[] words)
    {
        DisposeWhileAThreadSteps(words[0], words[1]);
        TwoThreadsThatStep(words[0]);
        UseAfterDispose(words[0]);
        WrongArguments(words[0]);
        Console.WriteLine("ok");
    }
}
