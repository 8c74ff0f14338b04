// Palpate in C# (Unity, Godot, Mono, .NET) over libpalpate: palpate.h says what all of it means. Units are SI;
// z is up in the sample models, and triangles turn counter-clockwise seen from outside. Unity's axes are
// left-handed: swap y and z of what goes in and out there, and two corners of each triangle.
using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;
using System.Text;
using System.Threading;

namespace Palpate
{
    /// <summary>What could not be done, and what to do about it.</summary>
    public sealed class PalpateException : Exception
    {
        public string Hint { get; }
        /// <summary>"argument", "file", "memory", "state", "incomplete" or "internal", as palpate.h has them.</summary>
        public string Code { get; }

        public PalpateException(string reason, string hint, string code) : base(reason) { Hint = hint; Code = code; }
    }

    [StructLayout(LayoutKind.Sequential)]
    public struct Vector
    {
        public double X, Y, Z;

        public Vector(double x, double y, double z) { X = x; Y = y; Z = z; }
    }

    /// <summary>A quaternion; (1, 0, 0, 0) is not turned.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Turn
    {
        public double W, X, Y, Z;

        public Turn(double w, double x, double y, double z) { W = w; X = x; Y = y; Z = z; }
    }

    /// <summary>A rigid tool; begin with <see cref="Sphere"/>.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Tool
    {
        UIntPtr size;
        public double Radius, Length, CouplingStiffness, CouplingTorsion, MaxForce, Friction, Reach, HandOver, DiscRadius;

        /// <summary>A sphere, or a point, without a coupling or a largest force, with the material's friction.</summary>
        public static Tool Sphere(double radius)
        {
            return new Tool
            {
                size = (UIntPtr)Marshal.SizeOf(typeof(Tool)),
                Radius = radius,
                CouplingStiffness = double.PositiveInfinity,
                CouplingTorsion = double.PositiveInfinity,
                MaxForce = double.PositiveInfinity,
                Friction = -1,
                HandOver = 0.005,
            };
        }
    }

    /// <summary>Where the device wants a tool.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Pose
    {
        UIntPtr size;
        public Vector Position;
        public Turn Orientation;
        int grab;

        public bool Grab { get { return grab != 0; } set { grab = value ? 1 : 0; } }

        public Pose(Vector position) : this(position, new Turn(1, 0, 0, 0), false) { }

        public Pose(Vector position, Turn orientation, bool grab)
        {
            size = (UIntPtr)Marshal.SizeOf(typeof(Pose));
            Position = position;
            Orientation = orientation;
            this.grab = grab ? 1 : 0;
        }
    }

    /// <summary>A finer mesh under the tools.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Overlay
    {
        UIntPtr size;
        public int Refinement, Rings;
        UIntPtr memory;

        public Overlay(int refinement, int rings, ulong bytes = 512UL << 20)
        {
            size = (UIntPtr)Marshal.SizeOf(typeof(Overlay));
            Refinement = refinement;
            Rings = rings;
            memory = (UIntPtr)bytes;
        }
    }

    /// <summary>How a session is to be, beyond its tools.</summary>
    public sealed class Options
    {
        public int MaxContacts = 32;
        public Overlay? Overlay;
        public bool DynamicContact;
        public double Tick = 0.001;
        public long StressTicks;
        public bool Depth;
    }

    /// <summary>What a tool feels since the last tick.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Felt
    {
        internal UIntPtr size;
        public Vector Force, Torque, ToolPosition;
        public Turn ToolOrientation;
        public int Contacts;
        public Vector StiffnessX, StiffnessY, StiffnessZ;  // rows of the local stiffness
        public Vector LocalPoint;
        public double LocalRadius, ForceError;
        public int LeftOut;
        public double GreensError;
    }

    /// <summary>A place where a tool and the surface press on each other: on the surface, with its normal, out of the body; the force is that on the tool.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Contact
    {
        internal UIntPtr size;
        public Vector Position, Normal, Force;
    }

    /// <summary>One body and the tools that touch it. One thread steps (Step, Felt, Contacts, SetTool, Reset, Record, EndRecording); others may draw
    /// at the same time (Rest, Surface, Displacement, Stress) and dispose. What comes after that throws ObjectDisposedException, and what
    /// a second thread that steps asks for InvalidOperationException.</summary>
    public sealed class Session : IDisposable
    {
        readonly IntPtr session;
        readonly int tools;
        readonly Native.Counts counts;
        int ended;

        /// <summary>Loads a baked file (NAME.palpate.hdf). Throws PalpateException.</summary>
        public Session(string file, Tool[] tools, Options options = null)
        {
            options = options ?? new Options();
            this.tools = tools.Length;
            var error = new byte[4096];
            var c = new Native.Options
            {
                size = (UIntPtr)Marshal.SizeOf(typeof(Native.Options)),
                dynamicContact = options.DynamicContact ? 1 : 0,
                tick = options.Tick,
                stressTicks = options.StressTicks,
                depth = options.Depth ? 1 : 0,
            };
            var overlay = GCHandle.Alloc(options.Overlay.GetValueOrDefault(), GCHandleType.Pinned);
            try
            {
                if (options.Overlay.HasValue) c.overlay = overlay.AddrOfPinnedObject();
                session = Native.palpate_create_with_options(Name(file), tools, tools.Length, options.MaxContacts, ref c, error, (UIntPtr)error.Length);
            }
            finally
            {
                overlay.Free();
            }
            if (session == IntPtr.Zero) throw Failure(error, Native.palpate_last_code());
            counts.size = (UIntPtr)Marshal.SizeOf(typeof(Native.Counts));
            Native.palpate_surface_counts(session, ref counts);
        }

        public Session(string file, Tool tool, Options options = null) : this(file, new[] { tool }, options) { }

        public int Nodes { get { return counts.nodes; } }
        public int Simplices { get { return counts.simplices; } }
        public int Corners { get { return counts.corners; } }

        /// <summary>One tick of a session with one tool; status bits. Takes no memory.</summary>
        public uint Step(Pose pose)
        {
            if (tools != 1) throw new ArgumentException("the session has " + tools + " tools: give a pose for each");
            return Stepped(Native.palpate_step(Open(), ref pose));
        }

        /// <summary>One tick, a pose for each tool; status bits. Takes no memory.</summary>
        public uint Step(Pose[] poses)
        {
            if (poses.Length != tools) throw new ArgumentException("the session has " + tools + " tools: give a pose for each");
            return Stepped(Native.palpate_step(Open(), poses));
        }

        /// <summary>What a tool feels since the last tick.</summary>
        public Felt Felt(int tool = 0)
        {
            var felt = new Felt { size = (UIntPtr)Marshal.SizeOf(typeof(Felt)) };
            if (Done(Native.palpate_get(Open(), tool, ref felt)) != 0) throw new ArgumentOutOfRangeException("tool");
            return felt;
        }

        /// <summary>Fills the array with the first contacts of a tool in the last tick, and says how many there are.</summary>
        public int Contacts(Contact[] contacts, int tool = 0)
        {
            if (contacts.Length > 0) contacts[0].size = (UIntPtr)Marshal.SizeOf(typeof(Contact));
            int count;
            if (Done(Native.palpate_get_contacts(Open(), tool, contacts, contacts.Length, out count)) != 0) throw new ArgumentOutOfRangeException("tool");
            return count;
        }

        /// <summary>What a tool is from the next tick on; false where its shape is another, or a value makes no sense.</summary>
        public bool SetTool(int number, Tool tool) { return Done(Native.palpate_set_tool(Open(), number, ref tool)) == 0; }

        /// <summary>To a body that nobody has touched; not while it is recorded.</summary>
        public void Reset() { Done(Native.palpate_reset(Open())); }

        /// <summary>Records each tick of a tool from now on, from the untouched body, with so many pictures of the surface a second. Throws PalpateException.</summary>
        public void Record(string file, double pictures = 60, int tool = 0)
        {
            var options = new Native.RecordOptions { size = (UIntPtr)Marshal.SizeOf(typeof(Native.RecordOptions)), tool = tool, pictures = pictures };
            var error = new byte[4096];
            int code = Native.palpate_record(Open(), Name(file), ref options, error, (UIntPtr)error.Length);
            if (code != 0) throw Failure(error, code);
        }

        /// <summary>Ends the recording. Throws PalpateException.</summary>
        public void EndRecording()
        {
            var error = new byte[4096];
            int code = Native.palpate_record_end(Open(), error, (UIntPtr)error.Length);
            if (code != 0) throw Failure(error, code);
        }

        /// <summary>Fills positions at rest, 3 Nodes numbers [m].</summary>
        public void Rest(double[] xyz) { Done(Native.palpate_surface_rest(Open(), Room(xyz, 3 * Nodes))); }

        /// <summary>Fills corners of the simplices, Corners * Simplices numbers.</summary>
        public void Surface(int[] corners) { Done(Native.palpate_surface_simplices(Open(), Room(corners, Corners * Simplices))); }

        /// <summary>Fills displacements in the last tick, 3 Nodes numbers [m].</summary>
        public void Displacement(double[] xyz) { Done(Native.palpate_surface_displacement(Open(), Room(xyz, 3 * Nodes))); }

        /// <summary>Fills von Mises stress and pressure, Nodes numbers each [Pa], and returns the tick that they belong to; -1: none yet.</summary>
        public long Stress(float[] vonMises, float[] pressure)
        {
            return Native.palpate_surface_stress(Open(), Room(vonMises, Nodes), Room(pressure, Nodes));
        }

        /// <summary>Names of the bits of a status.</summary>
        public static List<string> StatusNames(uint status)
        {
            var names = new List<string>();
            for (int k = 0; k < 32; ++k)
            {
                if ((status & 1u << k) == 0) continue;
                string name = Marshal.PtrToStringAnsi(Native.palpate_status_name(1u << k));
                if (name != null) names.Add(name);
            }
            return names;
        }

        /// <summary>Ends the session, after the step under way in another thread.</summary>
        public void Dispose()
        {
            if (Interlocked.Exchange(ref ended, 1) == 0 && session != IntPtr.Zero) Native.palpate_destroy(session);
            GC.SuppressFinalize(this);
        }

        ~Session() { Dispose(); }

        IntPtr Open()
        {
            if (ended != 0) throw new ObjectDisposedException("Session");
            return session;
        }

        uint Stepped(uint status)
        {
            if ((status & Native.NotStepped) != 0) Done(Native.ErrorState);
            return status;
        }

        int Done(int code)
        {
            if (code != Native.ErrorState) return code;
            Open();
            throw new InvalidOperationException("another thread steps the session, or it is recorded");
        }

        static byte[] Name(string file)
        {
            if (file.IndexOf('\0') >= 0) throw new ArgumentException("a file's name has no zero character", "file");
            return Encoding.UTF8.GetBytes(file + "\0");
        }

        static T[] Room<T>(T[] numbers, int count)
        {
            if (numbers.Length < count) throw new ArgumentException("room for " + count + " numbers is needed");
            return numbers;
        }

        static PalpateException Failure(byte[] error, int code)
        {
            string told = Encoding.UTF8.GetString(error, 0, Math.Max(0, Array.IndexOf(error, (byte)0)));
            return new PalpateException(Part(told, "error: "), Part(told, "hint: "), Marshal.PtrToStringAnsi(Native.palpate_code_name(code)));
        }

        static string Part(string told, string name)
        {
            foreach (string line in told.Split('\n'))
            {
                if (line.StartsWith(name, StringComparison.Ordinal)) return line.Substring(name.Length);
            }
            return "";
        }
    }

    static class Native
    {
        const string Library = "palpate";
        internal const uint NotStepped = 1 << 15;
        internal const int ErrorState = 4;

        [StructLayout(LayoutKind.Sequential)]
        internal struct Options
        {
            internal UIntPtr size;
            internal IntPtr overlay;
            internal int dynamicContact;
            internal double tick;
            internal long stressTicks;
            internal int depth;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct RecordOptions
        {
            internal UIntPtr size;
            internal int tool;
            internal double pictures;
        }

        [StructLayout(LayoutKind.Sequential)]
        internal struct Counts
        {
            internal UIntPtr size;
            internal int nodes, simplices, corners;
        }

        [DllImport(Library)]
        internal static extern IntPtr palpate_status_name(uint bit);
        [DllImport(Library)]
        internal static extern IntPtr palpate_create_with_options(byte[] file, Tool[] tools, int toolCount, int maxContacts, ref Options options,
                                                                  byte[] error, UIntPtr errorSize);
        [DllImport(Library)]
        internal static extern void palpate_destroy(IntPtr session);
        [DllImport(Library)]
        internal static extern uint palpate_step(IntPtr session, Pose[] poses);
        [DllImport(Library)]
        internal static extern uint palpate_step(IntPtr session, ref Pose pose);
        [DllImport(Library)]
        internal static extern int palpate_get(IntPtr session, int tool, ref Felt result);
        [DllImport(Library)]
        internal static extern int palpate_get_contacts(IntPtr session, int tool, [In, Out] Contact[] contacts, int room, out int count);
        [DllImport(Library)]
        internal static extern int palpate_set_tool(IntPtr session, int number, ref Tool tool);
        [DllImport(Library)]
        internal static extern int palpate_reset(IntPtr session);
        [DllImport(Library)]
        internal static extern int palpate_last_code();
        [DllImport(Library)]
        internal static extern IntPtr palpate_code_name(int code);
        [DllImport(Library)]
        internal static extern int palpate_record(IntPtr session, byte[] file, ref RecordOptions options, byte[] error, UIntPtr errorSize);
        [DllImport(Library)]
        internal static extern int palpate_record_end(IntPtr session, byte[] error, UIntPtr errorSize);
        [DllImport(Library)]
        internal static extern int palpate_surface_counts(IntPtr session, ref Counts counts);
        [DllImport(Library)]
        internal static extern int palpate_surface_rest(IntPtr session, double[] xyz);
        [DllImport(Library)]
        internal static extern int palpate_surface_simplices(IntPtr session, int[] corners);
        [DllImport(Library)]
        internal static extern int palpate_surface_displacement(IntPtr session, double[] xyz);
        [DllImport(Library)]
        internal static extern long palpate_surface_stress(IntPtr session, float[] vonMises, float[] pressure);
    }
}
