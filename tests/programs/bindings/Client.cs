// Plays poses through Palpate.cs: as client.c.
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using Palpate;

static class Client
{
    static string Bits(Vector v)
    {
        return string.Format(" {0:x16} {1:x16} {2:x16}", BitConverter.DoubleToInt64Bits(v.X), BitConverter.DoubleToInt64Bits(v.Y),
                             BitConverter.DoubleToInt64Bits(v.Z));
    }

    static int Main(string[] words)
    {
        try
        {
            Tool tool = Tool.Sphere(0.1);
            tool.Friction = 0.3;
            tool.CouplingStiffness = 500;
            using (var session = new Session(words.Length > 0 ? words[0] : "", tool))
            {
                if (words.Length > 1) session.Record(words[1]);
                var times = new List<long>();
                var watch = new Stopwatch();
                string line;
                while ((line = Console.ReadLine()) != null)
                {
                    double[] n = Array.ConvertAll(line.Split(' '), word => double.Parse(word, CultureInfo.InvariantCulture));
                    var pose = new Pose(new Vector(n[0], n[1], n[2]), new Turn(n[3], n[4], n[5], n[6]), n[7] != 0);
                    watch.Restart();
                    uint status = session.Step(pose);
                    Felt felt = session.Felt();
                    var touched = new Contact[1];
                    session.Contacts(touched);
                    times.Add(watch.ElapsedTicks * 1000000000 / Stopwatch.Frequency);
                    Console.WriteLine(status + Bits(felt.Force) + Bits(felt.Torque) + Bits(touched[0].Position) + Bits(touched[0].Normal));
                }
                if (words.Length > 1) session.EndRecording();
                times.Sort();
                if (times.Count > 0) Console.WriteLine("# " + times[times.Count / 2] + " " + times[(times.Count - 1) * 999 / 1000]);
            }
            return 0;
        }
        catch (PalpateException error)
        {
            Console.Error.WriteLine("error: " + error.Message + "\nhint: " + error.Hint);
            return 1;
        }
    }
}
