/* Palpate in your own loop: feel a body that palpate-precompute has baked. C99 and C++.
 *
 * A session is one body and the tools that touch it. All units are SI: metres, newtons, radians. For a body
 * in the plane, z of each input is ignored and z of each output is 0 (of a torque, only z is not 0).
 *
 * No function throws or prints. Sessions are independent of each other. Within a session, one thread calls
 * the functions of the loop (palpate_step, palpate_get, palpate_get_contacts, palpate_set_tool,
 * palpate_reset, palpate_record and palpate_record_end), while any others may call those of the surface. If a
 * second thread calls the loop at the same time, or the session has ended, the call does nothing and returns
 * PALPATE_NOT_STEPPED or PALPATE_ERROR_STATE. NULL for a session or an array is refused with -1. "Real-time
 * safe" below means: no memory allocation, no lock, no system call, and bounded time.
 *
 * Each struct begins with its size, so that later versions can add members at its end. Initialise yours with
 * its PALPATE_..._INIT, which sets the size and the defaults, then change members. A program compiled with an
 * older palpate.h has smaller structs: missing members have their defaults. One compiled with a newer
 * palpate.h must leave members unknown to this library at 0; a struct with such a member set, or with a size
 * of 0, is refused. All elements of an array have the same size. */
#ifndef PALPATE_H
#define PALPATE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define PALPATE_NOEXCEPT noexcept
extern "C" {
#else
#define PALPATE_NOEXCEPT
#endif

typedef struct palpate_session palpate_session;

/* A rigid tool: all points within `radius` of its core. The core is a segment of `length` from the tool's
 * origin along its own z axis (in the plane: its own y axis), or a flat disc around the origin, normal to
 * that axis, that gives the whole tool the radius `disc_radius`. With neither, the tool is a sphere; with
 * radius 0 as well, a point. A spring, the virtual coupling, connects it to the device in series with the
 * body: the hand never feels more than its stiffness. */
typedef struct palpate_tool {
  size_t size;               /* sizeof(palpate_tool) */
  double radius;             /* [m] */
  double length;             /* [m] */
  double coupling_stiffness; /* [N/m] largest stiffness that the device can show; HUGE_VAL: no spring */
  double coupling_torsion;   /* [N m/rad] the same for rotation */
  double max_force;          /* [N] largest force on the hand; HUGE_VAL: unlimited */
  double friction;           /* Coulomb coefficient; negative: that of the body's material */
  double reach;              /* [m] a grab without contact holds the nearest surface within this distance */
  double hand_over;          /* fraction of the force that may change per millisecond without a matching
                              * motion of the tool; HUGE_VAL: any, then slipping contact is felt as a kick */
  double disc_radius;        /* [m] radius of a disc including its edge, rounded by `radius`; 0: no disc */
} palpate_tool;

/* Default tool: a point without a coupling or limit, with the material's friction, no reach and a hand-over
 * of 0.005. */
#define PALPATE_TOOL_INIT \
  { sizeof(palpate_tool), 0.0, 0.0, HUGE_VAL, HUGE_VAL, HUGE_VAL, -1.0, 0.0, 0.005, 0.0 }

/* Pose of a tool requested by the device. */
typedef struct palpate_pose {
  size_t size;           /* sizeof(palpate_pose) */
  double position[3];    /* position of the tool's origin [m] */
  double orientation[4]; /* quaternion w, x, y, z of any length except 0; identity: 1, 0, 0, 0 */
  int grab;              /* not 0: hold the touched surface until it is 0 again */
} palpate_pose;

/* Default pose: at the origin, no rotation, no grab. */
#define PALPATE_POSE_INIT \
  { sizeof(palpate_pose), {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}, 0 }

/* Limitations of a tick; a bit mask, 0 if there are none. The forces are finite in any case. */
enum palpate_status {
  PALPATE_NOTHING_IN_REACH = 1 << 0,  /* grab is set, but the tool touches nothing and nothing is in reach */
  PALPATE_CAPACITY_FULL = 1 << 1,     /* more contacts than the capacity, merged: the deepest are kept */
  PALPATE_UNSETTLED = 1 << 2,         /* contact forces still change although nothing has moved for long */
  PALPATE_POSE_NOT_FINITE = 1 << 3,   /* a pose was ignored: the last valid one is used */
  PALPATE_RESULT_NOT_FINITE = 1 << 4, /* the forces overflowed: the last valid ones are used */
  PALPATE_INSIDE_BODY = 1 << 6,       /* a tool started inside the body: no force until it is out */
  PALPATE_POSE_LIMITED = 1 << 7,      /* a pose jumped: the tool follows at a bounded speed */
  PALPATE_NOT_CONVERGED = 1 << 8,     /* the contact forces did not reach their tolerance within the budget */
  PALPATE_FORCE_LIMITED = 1 << 9,     /* a force was cut to max_force */
  PALPATE_HANDING_OVER = 1 << 10,     /* a force is on its way to the contact's, so as not to kick */
  PALPATE_OLDER_PATCH = 1 << 11,      /* the overlay for this place was not there yet */
  PALPATE_LATE_MOTION = 1 << 12,      /* the body's free motion was not there in time */
  PALPATE_RIGID_CONTACT = 1 << 13,    /* a tool presses on what cannot move: only its coupling gives way */
  PALPATE_UNBALANCED = 1 << 14,       /* the body's balance at depth was not met: see force_error */
  PALPATE_NOT_STEPPED = 1 << 15       /* nothing happened: the session is NULL or has ended, or another thread
                                       * is in its loop */
};

/* Returns the name of a status bit: "capacity_full" and so on; NULL unless it is a single known bit.
 * Real-time safe. */
const char* palpate_status_name(uint32_t bit) PALPATE_NOEXCEPT;

/* Loads a baked file (NAME.palpate.hdf) and creates a session with `tool_count` tools and a capacity of
 * `max_contacts` contact points for all tools together, 1 to 256 (32 suits a fingertip, 256 a hand). Takes
 * between a tenth of a second and seconds, and several threads for unfolding.
 *
 * Returns NULL on failure; `error`, unless NULL, then has the reason and the remedy: a line "error: ..." and
 * a line "hint: ...", cut to `error_size` bytes including the terminating zero. On success it is empty. */
palpate_session* palpate_create(const char* file, const palpate_tool* tools, int tool_count, int max_contacts,
                                char* error, size_t error_size) PALPATE_NOEXCEPT;

/* A finer mesh under the tools (s-FEM): each element of the body within `rings` rings around a tool is
 * divided into refinement^3 elements (in the plane refinement^2). The whole surface is refined likewise, so
 * that small tools are resolved; the file must store as many layers below the surface as there are rings. At
 * most four tools have overlays. */
typedef struct palpate_overlay {
  size_t size;    /* sizeof(palpate_overlay) */
  int refinement; /* 2 to 16; start with 3. Or PALPATE_OVERLAY_LOCAL */
  int rings;      /* 1 to 16; 2 is markedly better than 1 */
  size_t memory;  /* [bytes] limit for all overlays; 512 MB is ample */
} palpate_overlay;

/* In the place of a refinement: no finer mesh, but close to the tools the body's own compliance in place of
 * its mesh's, as palpate-runtime play has by default (docs/overlays.md); the surface is refined for the
 * smallest tool, so give room for 256 contact points. Needs no layers. Of no effect where that is not
 * possible. */
#define PALPATE_OVERLAY_LOCAL 0

/* Default overlay: refinement 3, 2 rings, 512 MB. */
#define PALPATE_OVERLAY_INIT \
  { sizeof(palpate_overlay), 3, 2, (size_t)512 << 20 }

/* Result of a function. */
enum palpate_code {
  PALPATE_OK = 0,
  PALPATE_ERROR_ARGUMENT = 1, /* an argument is invalid, or does not fit the body */
  PALPATE_ERROR_FILE = 2,     /* a file is missing, of the wrong kind, damaged or not writable */
  PALPATE_ERROR_MEMORY = 3,   /* out of memory */
  PALPATE_ERROR_STATE = 4,    /* wrong state: a recording is in progress, or none is; the session or recording
                               * has ended; another thread is in the session's loop */
  PALPATE_ERROR_INCOMPLETE = 5, /* a recording lacks ticks or pictures: a buffer or the disk was full */
  PALPATE_ERROR_INTERNAL = 6    /* a defect of the library */
};

/* Returns the name of a code: "argument", "file" and so on, "ok" for PALPATE_OK; NULL for an unknown one.
 * Real-time safe. */
const char* palpate_code_name(int code) PALPATE_NOEXCEPT;

/* Returns the result of this thread's last call that takes `error`; PALPATE_OK if it succeeded. */
int palpate_last_code(void) PALPATE_NOEXCEPT;

/* Options of a session, beside its tools. */
typedef struct palpate_options {
  size_t size;                    /* sizeof(palpate_options) */
  const palpate_overlay* overlay; /* NULL: none. A thread of the session builds overlays ahead of the tools,
                                   * at the priority of the calling thread; palpate_step never waits */
  int dynamic_contact;  /* not 0: contact includes the body's inertia and viscosity. The file must have
                         * dynamics, with a time step of one tick */
  double tick;          /* time between two calls of palpate_step, for bodies with dynamics [s] */
  int64_t stress_ticks; /* ticks between two computations of surface stress and pressure, by a thread of the
                         * session, for palpate_surface_stress; 0: never */
  int depth;            /* not 0: the body turns and bends far, as by palpate-runtime play --depth yes;
                         * not with dynamic contact or a finer mesh */
} palpate_options;

/* Default options: no overlay, quasi-static contact, ticks of 0.001 s, no stress, small strain. */
#define PALPATE_OPTIONS_INIT \
  { sizeof(palpate_options), NULL, 0, 0.001, 0, 0 }

/* Does the same as palpate_create, with options. The motion of a body whose file has packed dynamics, or that
 * turns and bends far, is computed by threads of the session. */
palpate_session* palpate_create_with_options(const char* file, const palpate_tool* tools, int tool_count,
                                             int max_contacts, const palpate_options* options, char* error,
                                             size_t error_size) PALPATE_NOEXCEPT;

/* Ends a session; NULL and an ended session are ignored. Waits for calls of other threads in progress; later
 * calls are refused. */
void palpate_destroy(palpate_session* session) PALPATE_NOEXCEPT;

/* --- The loop --- */

/* Performs one tick. `poses` has one pose for each tool, in the order of palpate_create.
 * Returns status bits. If `poses` is NULL or refused, nothing happens and it returns PALPATE_POSE_NOT_FINITE.
 * Real-time safe. */
uint32_t palpate_step(palpate_session* session, const palpate_pose* poses) PALPATE_NOEXCEPT;

/* Force and pose of a tool since the last tick. For devices with a higher rate, and for late ticks: while the
 * device is at x, within local_radius of local_point, the force is
 *   force - local_stiffness (x - local_point). */
typedef struct palpate_result {
  size_t size;                /* sizeof(palpate_result) */
  double force[3];            /* force on the hand, to be displayed by the device [N] */
  double torque[3];           /* torque on the hand, about the tool's origin [N m] */
  double tool_position[3];    /* position of the tool itself, which stays outside the surface [m] */
  double tool_orientation[4]; /* quaternion w, x, y, z, length 1 */
  int contacts;               /* number of contact points with a force */
  double local_stiffness[9];  /* symmetric, positive semidefinite, row-major [N/m] */
  double local_point[3];      /* [m] */
  double local_radius;        /* [m] */
  double force_error;         /* estimated error of `force` relative to the converged contact, if the tick was
                               * a best effort (PALPATE_NOT_CONVERGED, or left_out is not 0); else 0 [N] */
  int left_out;               /* contact points pressed by the tool beyond the capacity */
  double greens_error;        /* bound on the error of `force` from compressed Green's functions; 0 if they
                               * are exact [N] */
  double small_strain;        /* with `depth`: by which small strain has more force for the places of the last
                               * balance, as a fraction of it; else 0 */
} palpate_result;

/* Default result: all zero. */
#define PALPATE_RESULT_INIT                                                                             \
  {                                                                                                     \
    sizeof(palpate_result), {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}, 0, \
        {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.0, 0.0, 0, 0.0, 0.0           \
  }

/* Writes the members of `result` for tool 0, 1, ... Returns 0; -1 if there is no such tool, with all members
 * zero, or the size is refused, with nothing written; PALPATE_ERROR_STATE, with all members zero. Real-time
 * safe. */
int palpate_get(const palpate_session* session, int tool, palpate_result* result) PALPATE_NOEXCEPT;

/* A contact point between a tool and the surface. */
typedef struct palpate_contact {
  size_t size;        /* sizeof(palpate_contact) */
  double position[3]; /* on the deformed surface [m] */
  double normal[3];   /* outward normal of the surface, length 1 */
  double force[3];    /* force on the tool; a tool's forces add up to its contact force [N] */
} palpate_contact;

/* Default contact: all zero. */
#define PALPATE_CONTACT_INIT                                     \
  {                                                              \
    sizeof(palpate_contact), {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, { \
      0.0, 0.0, 0.0                                              \
    }                                                            \
  }

/* Writes the contacts of a tool in the last tick. `count` becomes their number, as in palpate_result, and the
 * first `room` elements of `contacts` are filled; the first one gives the size of all. With a room of 0 it
 * only counts. Returns 0; -1 if there is no such tool, the room is negative or the size is refused, with
 * nothing written; PALPATE_ERROR_STATE. Real-time safe; a function of the loop. */
int palpate_get_contacts(const palpate_session* session, int tool, palpate_contact* contacts, int room,
                         int* count) PALPATE_NOEXCEPT;

/* Changes a tool from the next tick on: coupling, largest force, friction, reach and hand-over. Its shape
 * (radius, length, disc_radius) must stay that of palpate_create: a surface cannot be pushed aside within a
 * tick. palpate_reset reverts the change.
 * Returns 0; -1, with nothing changed, if there is no such tool, the shape differs, a value is invalid or the
 * size is refused; PALPATE_ERROR_STATE. Real-time safe; a function of the loop. */
int palpate_set_tool(palpate_session* session, int number, const palpate_tool* tool) PALPATE_NOEXCEPT;

/* Restores the state after palpate_create, an untouched body. Allocates no memory, but takes too long for a
 * tick. Returns 0; -1; PALPATE_ERROR_STATE, also during a recording, which has a single run. */
int palpate_reset(palpate_session* session) PALPATE_NOEXCEPT;

/* --- Recordings, which palpate-runtime view, session and export read --- */

/* Options of a recording. */
typedef struct palpate_record_options {
  size_t size;     /* sizeof(palpate_record_options) */
  int tool;        /* tool whose ticks are recorded; a recording has one */
  double pictures; /* surface pictures per second; 0: none */
} palpate_record_options;

/* Default options: tool 0, 60 pictures per second. */
#define PALPATE_RECORD_OPTIONS_INIT \
  { sizeof(palpate_record_options), 0, 60.0 }

/* Records each tick from now on to `file` (OUT.mcap), until palpate_record_end or palpate_destroy. As in the
 * programs, an existing file is replaced only if it is empty or a recording without ticks, and never if it is
 * the model, one of its sources or not a regular file, under any name. Starts with the untouched body
 * (palpate_reset), as a replay does: for a session with one tool that is not changed meanwhile,
 * `palpate-runtime play BODY --device replay:OUT.mcap` repeats every tick to the last bit. options.tick must
 * be 1/rate of a whole rate from 1000 to 5000 ticks per second. Threads of the session write; palpate_step
 * stays real-time safe. The file is a valid recording at any time. Returns PALPATE_OK, or a code with the
 * reason in `error` as in palpate_create. On Windows refuses. */
int palpate_record(palpate_session* session, const char* file, const palpate_record_options* options,
                   char* error, size_t error_size) PALPATE_NOEXCEPT;

/* Ends the recording; its file is complete then. Returns the same as palpate_record. Takes some time. */
int palpate_record_end(palpate_session* session, char* error, size_t error_size) PALPATE_NOEXCEPT;

/* A recording that is read back, made by palpate_record or by palpate-runtime play --record. */
typedef struct palpate_recording palpate_recording;

/* Opens a recording: reads and checks all of it except the values of the pictures. Returns NULL on failure,
 * as palpate_create does. */
palpate_recording* palpate_recording_open(const char* file, char* error, size_t error_size) PALPATE_NOEXCEPT;

/* Closes a recording, in the same way as palpate_destroy. Any number of threads may use the other functions;
 * each returns PALPATE_ERROR_STATE once the recording is closed. */
void palpate_recording_close(palpate_recording* recording) PALPATE_NOEXCEPT;

typedef struct palpate_recording_counts {
  size_t size; /* sizeof(palpate_recording_counts) */
  int64_t ticks;
  int64_t rate; /* ticks per second */
  int64_t pictures;
  int32_t nodes; /* surface nodes */
  int32_t simplices;
  int32_t corners; /* of a simplex: 3, triangles; in the plane 2, lines */
} palpate_recording_counts;

#define PALPATE_RECORDING_COUNTS_INIT \
  { sizeof(palpate_recording_counts), 0, 0, 0, 0, 0, 0 }

/* Writes the members of `counts`. Returns 0; -1 if the size is refused. */
int palpate_recording_count(const palpate_recording* recording,
                            palpate_recording_counts* counts) PALPATE_NOEXCEPT;

/* Requested pose and displayed force of a tick. Passed to palpate_step in order, the poses repeat a
 * session. */
typedef struct palpate_recorded_tick {
  size_t size;           /* sizeof(palpate_recorded_tick) */
  double time;           /* time since the first tick [s] */
  double position[3];    /* position requested by the device [m] */
  double orientation[4]; /* quaternion w, x, y, z */
  int grab;
  double force[3];            /* on the hand [N] */
  double torque[3];           /* on the hand [N m] */
  double tool_position[3];    /* [m] */
  double tool_orientation[4]; /* quaternion w, x, y, z */
  int contacts;
  uint32_t status; /* bits of palpate_status */
} palpate_recorded_tick;

#define PALPATE_RECORDED_TICK_INIT                                                                 \
  {                                                                                                \
    sizeof(palpate_recorded_tick), 0.0, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}, 0, {0.0, 0.0, 0.0}, \
        {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}, 0, 0                               \
  }

/* Writes the members of `tick` for tick 0, 1, ... Returns 0; -1 if there is no such tick, with all members
 * zero, or the size is refused, with nothing written; PALPATE_ERROR_FILE, with all members zero, if the file
 * cannot be read any more. Fast in sequence: a block of ticks is read from the file at a time. Threads wait
 * for each other. */
int palpate_recording_tick(const palpate_recording* recording, int64_t number,
                           palpate_recorded_tick* tick) PALPATE_NOEXCEPT;

/* Do the same as palpate_surface_rest and palpate_surface_simplices, for the recorded surface. */
int palpate_recording_rest(const palpate_recording* recording, double* xyz) PALPATE_NOEXCEPT;
int palpate_recording_simplices(const palpate_recording* recording, int32_t* corners) PALPATE_NOEXCEPT;

/* Writes the displacement of the surface nodes in picture 0, 1, ..., 3 `nodes` numbers [m], and its time
 * since the first tick [s]. If the file has only contact forces (palpate_record with options.pictures, for a
 * body without dynamics), the displacement is computed with the model, which is loaded for the first picture
 * and must be at its original path or beside the recording. Threads wait for each other. Returns the same as
 * palpate_record. */
int palpate_recording_picture(const palpate_recording* recording, int64_t number, float* xyz, double* time,
                              char* error, size_t error_size) PALPATE_NOEXCEPT;

/* --- The surface, for display --- */

typedef struct palpate_counts {
  size_t size; /* sizeof(palpate_counts) */
  int32_t nodes;
  int32_t simplices;
  int32_t corners; /* of a simplex: 3, triangles; in the plane 2, lines */
} palpate_counts;

#define PALPATE_COUNTS_INIT \
  { sizeof(palpate_counts), 0, 0, 0 }

/* Writes the members of `counts`. Returns 0; -1 if the size is refused; PALPATE_ERROR_STATE, as the functions
 * below. */
int palpate_surface_counts(const palpate_session* session, palpate_counts* counts) PALPATE_NOEXCEPT;

/* Writes the positions of the surface nodes on the body at rest, 3 `nodes` numbers x, y, z [m]. They never
 * change. */
int palpate_surface_rest(const palpate_session* session, double* xyz) PALPATE_NOEXCEPT;

/* Writes the nodes of the simplices, `corners` `simplices` numbers from 0: triangles counter-clockwise seen
 * from outside, lines with the body on their left. They never change. */
int palpate_surface_simplices(const palpate_session* session, int32_t* corners) PALPATE_NOEXCEPT;

/* Writes the displacement of the surface nodes from rest after the last finished tick, 3 `nodes` numbers [m];
 * exactly zero where the body is fixed. Never delays the loop, but takes some microseconds per contact and
 * thousand nodes, too long for a tick: call it in the thread that draws. Threads that draw wait for each
 * other. */
int palpate_surface_displacement(palpate_session* session, double* xyz) PALPATE_NOEXCEPT;

/* Writes the latest von Mises stress and contact pressure at the surface nodes, `nodes` numbers each [Pa];
 * the stress is NaN where it is unknown (next to held nodes only). Either may be NULL. Returns the tick that
 * they belong to, counted from 0 since palpate_create; -1, with nothing written, if there are none yet or
 * options.stress_ticks is 0. With an overlay, the values are those of the body's nodes below it. */
int64_t palpate_surface_stress(palpate_session* session, float* von_mises, float* pressure) PALPATE_NOEXCEPT;

#ifdef __cplusplus
}
#endif
#endif
