/* Palpate in your own loop: feel a body that palpate-precompute has baked. C99 and C++.
 *
 * A session is one body and the tools that touch it. All units are SI: metres, newtons, radians. For a body
 * in the plane, z of what you give is ignored and z of what you get is 0 (of a torque, only z is not).
 *
 * Nothing here throws, and nothing prints. Sessions are independent of each other. Of one session, one thread
 * uses the functions of the loop (palpate_step, palpate_get, palpate_get_contacts, palpate_set_tool,
 * palpate_reset, palpate_record and palpate_record_end), and any others may use those of the surface
 * meanwhile. Where a second thread uses the loop at the same moment, or the session has ended, the call does
 * nothing and says so: it returns PALPATE_NOT_STEPPED or PALPATE_ERROR_STATE. NULL for a session or an array
 * is refused likewise, by -1. "Real-time safe" below means: no memory is taken, no lock, no system call, and
 * the time is bounded.
 *
 * Each struct begins with its size, so that later versions can add members at its end: begin yours with its
 * PALPATE_..._INIT, which sets the size and the defaults, then change what is to differ. A program that was
 * compiled with an older palpate.h has smaller structs: what they lack takes its default. One compiled with a
 * newer palpate.h may leave members that this library does not know 0; set, or with a size of 0, a struct is
 * refused. All elements of an array have one size.
 */
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

/* A rigid tool: all points within `radius` of its core, the segment of `length` from the tool's origin along
 * its own z axis (in the plane: its own y axis), or a flat disc around the origin, normal to that axis, that
 * makes the whole tool as wide as `disc_radius`. With neither it is a sphere, with radius 0 too a point. It
 * hangs on the device by a spring, the virtual coupling, in series with the body: what the hand feels is
 * never stiffer than that. */
typedef struct palpate_tool {
  size_t size;               /* sizeof(palpate_tool) */
  double radius;             /* [m] */
  double length;             /* [m] */
  double coupling_stiffness; /* [N/m] the stiffest that the device can show; HUGE_VAL: no spring */
  double coupling_torsion;   /* [N m/rad] the same for turning */
  double max_force;          /* [N] the largest force that the hand is given; HUGE_VAL: any */
  double friction;           /* Coulomb's coefficient; negative: that of the body's material */
  double reach;              /* [m] a grab that touches nothing holds the nearest surface within this */
  double hand_over;          /* share of the force that may change in a millisecond without the tool's motion
                              * explaining it; HUGE_VAL: any, then contact that slips is felt as a kick */
  double disc_radius;        /* [m] of a disc with its edge, which is rounded by `radius`; 0: no disc */
} palpate_tool;

/* A point without a coupling or limit, with the material's friction, no reach and a hand-over of
 * 0.005. */
#define PALPATE_TOOL_INIT \
  { sizeof(palpate_tool), 0.0, 0.0, HUGE_VAL, HUGE_VAL, HUGE_VAL, -1.0, 0.0, 0.005, 0.0 }

/* Where the device wants a tool. */
typedef struct palpate_pose {
  size_t size;           /* sizeof(palpate_pose) */
  double position[3];    /* of the tool's origin [m] */
  double orientation[4]; /* quaternion w, x, y, z of any length but 0; 1, 0, 0, 0 is not turned */
  int grab;              /* not 0: hold what the tool touches until it is 0 again */
} palpate_pose;

/* At the origin, not turned, no grab. */
#define PALPATE_POSE_INIT \
  { sizeof(palpate_pose), {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}, 0 }

/* What palpate_step could not do; bits, 0 when all is well. Whatever they say, the forces are finite. */
enum palpate_status {
  PALPATE_NOTHING_IN_REACH = 1 << 0,  /* grab is set, but the tool touches nothing and nothing is in reach */
  PALPATE_CAPACITY_FULL = 1 << 1,     /* more contacts than there is room for, merged: the deepest are kept */
  PALPATE_UNSETTLED = 1 << 2,         /* nothing has moved for long, and the contact forces still change */
  PALPATE_POSE_NOT_FINITE = 1 << 3,   /* a pose was ignored: the last valid one stands */
  PALPATE_RESULT_NOT_FINITE = 1 << 4, /* the forces overflowed: the last valid ones stand */
  PALPATE_INSIDE_BODY = 1 << 6,       /* a tool began inside the body: it feels nothing until it is out */
  PALPATE_POSE_LIMITED = 1 << 7,      /* a pose jumped: the tool follows at a bounded speed */
  PALPATE_NOT_CONVERGED = 1 << 8,     /* the contact forces did not reach their tolerance within the budget */
  PALPATE_FORCE_LIMITED = 1 << 9,     /* a force was cut to max_force */
  PALPATE_HANDING_OVER = 1 << 10,     /* a force is on its way to the contact's, so as not to kick */
  PALPATE_OLDER_PATCH = 1 << 11,      /* the overlay for this place was not there yet */
  PALPATE_LATE_MOTION = 1 << 12,      /* the body's free motion was not there in time */
  PALPATE_RIGID_CONTACT = 1 << 13,    /* a tool presses on what cannot move: only its coupling gives way */
  PALPATE_NEAR_STEP_LIMIT = 1 << 14,  /* a live body's explicit step is close to the longest stable one */
  PALPATE_NOT_STEPPED = 1 << 15       /* nothing happened: the session is NULL or has ended, or another thread
                                       * is in its loop */
};

/* "capacity_full" and so on; NULL for what is not one bit of these. Real-time safe. */
const char* palpate_status_name(uint32_t bit) PALPATE_NOEXCEPT;

/* Loads a baked file (NAME.palpate.hdf) and makes a session with `tool_count` tools and room for
 * `max_contacts` contact points of all tools together, 1 to 256 (32 suits a finger tip, 256 a hand). Takes
 * from a tenth of a second to seconds, and several threads for unfolding.
 *
 * Returns NULL where that cannot be done; `error`, unless NULL, then says why and what to do about it: a line
 * "error: ..." and a line "hint: ...", cut to `error_size` bytes with the zero at its end. It is empty where
 * all is well. */
palpate_session* palpate_create(const char* file, const palpate_tool* tools, int tool_count, int max_contacts,
                                char* error, size_t error_size) PALPATE_NOEXCEPT;

/* A finer mesh under the tools (s-FEM): each element of the body within `rings` rings round where a tool is
 * is cut into refinement^3 (in the plane refinement^2). The whole surface is then as fine, so that small
 * tools are felt; the file must keep as many layers below the surface as there are rings. Four tools at most
 * have overlays. */
typedef struct palpate_overlay {
  size_t size;    /* sizeof(palpate_overlay) */
  int refinement; /* 2 to 16; 3 is a good beginning */
  int rings;      /* 1 to 16; 2 is markedly better than 1 */
  size_t memory;  /* [bytes] that overlays may take; 512 MB is much */
} palpate_overlay;

/* Refined 3 times, 2 rings, 512 MB. */
#define PALPATE_OVERLAY_INIT \
  { sizeof(palpate_overlay), 3, 2, (size_t)512 << 20 }

/* Why a function could not do what it was asked for. */
enum palpate_code {
  PALPATE_OK = 0,
  PALPATE_ERROR_ARGUMENT = 1, /* what it was given makes no sense, or does not fit the body */
  PALPATE_ERROR_FILE = 2, /* a file is not there, is not what it should be, is damaged or cannot be written */
  PALPATE_ERROR_MEMORY = 3, /* there is not enough memory */
  PALPATE_ERROR_STATE = 4,  /* not now: a recording is being made, or none is; the session or recording has
                             * ended; another thread is in the session's loop */
  PALPATE_ERROR_INCOMPLETE = 5, /* a recording lacks ticks or pictures for which there was no room or disk */
  PALPATE_ERROR_INTERNAL = 6    /* a mistake of the library's own */
};

/* "argument", "file" and so on, "ok" for PALPATE_OK; NULL for what is not one of these. Real-time safe. */
const char* palpate_code_name(int code) PALPATE_NOEXCEPT;

/* Of the last call of this thread that takes `error`: why it failed, PALPATE_OK where it did not. */
int palpate_last_code(void) PALPATE_NOEXCEPT;

/* How a session is to be, beyond its tools. */
typedef struct palpate_options {
  size_t size; /* sizeof(palpate_options) */
  const palpate_overlay*
      overlay;          /* NULL: none. A thread of the session builds overlays ahead of the tools, at
                         * the priority of the thread that calls this; palpate_step never waits */
  int dynamic_contact;  /* not 0: the tools meet the body's inertia and viscosity too. The file must have
                         * dynamics, with a time step of one tick */
  double tick;          /* time from one palpate_step to the next, for bodies that swing [s] */
  int64_t stress_ticks; /* a thread of the session finds stress and pressure on the surface each so many
                         * ticks, for palpate_surface_stress; 0: never */
} palpate_options;

/* No overlay, quasi-static contact, 0.001 s, no stress. */
#define PALPATE_OPTIONS_INIT \
  { sizeof(palpate_options), NULL, 0, 0.001, 0 }

/* palpate_create with options. A body whose file has packed dynamics is swung by threads of the session. */
palpate_session* palpate_create_with_options(const char* file, const palpate_tool* tools, int tool_count,
                                             int max_contacts, const palpate_options* options, char* error,
                                             size_t error_size) PALPATE_NOEXCEPT;

/* Ends a session; NULL and one that has ended are ignored. Waits for the calls of other threads that are
 * under way; those that come later are refused. */
void palpate_destroy(palpate_session* session) PALPATE_NOEXCEPT;

/* --- The loop --- */

/* One tick: one pose for each tool, in the order of palpate_create.
 * Returns status bits. Real-time safe. With `poses` NULL or refused nothing happens: PALPATE_POSE_NOT_FINITE.
 */
uint32_t palpate_step(palpate_session* session, const palpate_pose* poses) PALPATE_NOEXCEPT;

/* What a tool feels since the last tick. For devices that run faster, and for ticks that come late: while the
 * device is at x, within local_radius of local_point, the force is
 *   force - local_stiffness (x - local_point). */
typedef struct palpate_result {
  size_t size;                /* sizeof(palpate_result) */
  double force[3];            /* on the hand: what the device is to display [N] */
  double torque[3];           /* on the hand, about the tool's origin [N m] */
  double tool_position[3];    /* of the tool itself, which the surface keeps outside [m] */
  double tool_orientation[4]; /* quaternion w, x, y, z, length 1 */
  int contacts;               /* places where tool and surface press on each other */
  double local_stiffness[9];  /* symmetric, positive semidefinite, rows one after the other [N/m] */
  double local_point[3];      /* [m] */
  double local_radius;        /* [m] */
  double force_error;         /* how far `force` may be from what the contact asks for, about, where the tick
                               * was a best effort (PALPATE_NOT_CONVERGED, or left_out is not 0); else 0 [N] */
  int left_out;               /* contact points that the tool presses on and that found no room */
  double greens_error;        /* what `force` may be off by at most as compressed Green's functions are not
                               * exact; 0 where they are [N] */
} palpate_result;

/* All zero. */
#define PALPATE_RESULT_INIT                                                                             \
  {                                                                                                     \
    sizeof(palpate_result), {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}, 0, \
        {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, 0.0, 0.0, 0, 0.0                \
  }

/* Fills the members that `result` has for tool 0, 1, ... Returns 0; -1 where the number is none, and all is
 * zero, or the size is refused, and nothing is written; PALPATE_ERROR_STATE, and all is zero. Real-time safe.
 */
int palpate_get(const palpate_session* session, int tool, palpate_result* result) PALPATE_NOEXCEPT;

/* A place where a tool and the surface press on each other. */
typedef struct palpate_contact {
  size_t size;        /* sizeof(palpate_contact) */
  double position[3]; /* of the surface now [m] */
  double normal[3];   /* of the surface, out of the body, length 1 */
  double force[3];    /* on the tool; those of a tool are together what its contact asks for [N] */
} palpate_contact;

/* All zero. */
#define PALPATE_CONTACT_INIT                                     \
  {                                                              \
    sizeof(palpate_contact), {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, { \
      0.0, 0.0, 0.0                                              \
    }                                                            \
  }

/* The contacts of a tool in the last tick: `count` becomes how many there are, as in palpate_result, and the
 * first `room` elements of `contacts` are filled, whose size the first one tells. With a room of 0 it only
 * counts. Returns 0; -1 where the number is none, the room is negative or the size is refused, and nothing is
 * written; PALPATE_ERROR_STATE. Real-time safe; a function of the loop. */
int palpate_get_contacts(const palpate_session* session, int tool, palpate_contact* contacts, int room,
                         int* count) PALPATE_NOEXCEPT;

/* What a tool is from the next tick on: its coupling, largest force, friction, reach and hand-over. Its shape
 * (radius, length, disc_radius) stays that of palpate_create: a surface cannot be pushed aside within a tick.
 * palpate_reset takes the change back.
 * Returns 0; -1, and nothing changes, where the number is none, the shape is another, a value makes no sense,
 * or the size is refused; PALPATE_ERROR_STATE. Real-time safe; a function of the loop. */
int palpate_set_tool(palpate_session* session, int number, const palpate_tool* tool) PALPATE_NOEXCEPT;

/* To the state after palpate_create: a body that nobody has touched. Takes no memory, but too long for a
 * tick. Returns 0; -1; PALPATE_ERROR_STATE, also while the session is recorded: a recording is of one run. */
int palpate_reset(palpate_session* session) PALPATE_NOEXCEPT;

/* --- Recordings, which palpate-runtime view, session and export read --- */

/* How a session is recorded. */
typedef struct palpate_record_options {
  size_t size;     /* sizeof(palpate_record_options) */
  int tool;        /* whose ticks are kept: a recording has one tool, and tells the pictures' */
  double pictures; /* of the surface, a second; 0: none */
} palpate_record_options;

/* Tool 0, 60 pictures a second. */
#define PALPATE_RECORD_OPTIONS_INIT \
  { sizeof(palpate_record_options), 0, 60.0 }

/* Records each tick from now on to `file` (OUT.mcap), until palpate_record_end or palpate_destroy. By the
 * rules of the programs: what stands there is replaced only where it is empty or a recording without ticks,
 * and never the model, its sources or anything but a regular file, under whatever name. Begins with the
 * untouched body (palpate_reset), as a replay does: of a session with one tool that nobody changes meanwhile,
 * `palpate-runtime play BODY --device replay:OUT.mcap` repeats every tick to the last bit. options.tick must
 * be 1/rate of a whole rate from 1000 to 5000 ticks a second. Threads of the session write; palpate_step
 * stays real-time safe. The file is a valid recording at each instant. Returns PALPATE_OK, or a code with the
 * reason in `error` as palpate_create has it. */
int palpate_record(palpate_session* session, const char* file, const palpate_record_options* options,
                   char* error, size_t error_size) PALPATE_NOEXCEPT;

/* Ends the recording, whose file is one plain file then. Returns as palpate_record. Takes some time. */
int palpate_record_end(palpate_session* session, char* error, size_t error_size) PALPATE_NOEXCEPT;

/* A recording that is read back: by palpate_record or by palpate-runtime play --record. */
typedef struct palpate_recording palpate_recording;

/* Reads and proves all of it except the pictures' values. Returns NULL as palpate_create. Forks once, as that
 * does. */
palpate_recording* palpate_recording_open(const char* file, char* error, size_t error_size) PALPATE_NOEXCEPT;

/* As palpate_destroy. Any number of threads may use the other functions; each returns PALPATE_ERROR_STATE
 * once the recording is closed. */
void palpate_recording_close(palpate_recording* recording) PALPATE_NOEXCEPT;

typedef struct palpate_recording_counts {
  size_t size; /* sizeof(palpate_recording_counts) */
  int64_t ticks;
  int64_t rate; /* ticks a second */
  int64_t pictures;
  int32_t nodes; /* of the surface */
  int32_t simplices;
  int32_t corners; /* of a simplex: 3, triangles; in the plane 2, lines */
} palpate_recording_counts;

#define PALPATE_RECORDING_COUNTS_INIT \
  { sizeof(palpate_recording_counts), 0, 0, 0, 0, 0, 0 }

/* Fills the members that `counts` has. Returns 0; -1 where the size is refused. */
int palpate_recording_count(const palpate_recording* recording,
                            palpate_recording_counts* counts) PALPATE_NOEXCEPT;

/* What was wanted and felt in a tick. Given to palpate_step one after the other, the poses repeat a session.
 */
typedef struct palpate_recorded_tick {
  size_t size;           /* sizeof(palpate_recorded_tick) */
  double time;           /* since the first tick [s] */
  double position[3];    /* where the device wanted the tool [m] */
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

/* Fills the members that `tick` has for tick 0, 1, ... Returns 0; -1 where the number is none, and all is
 * zero, or the size is refused, and nothing is written; PALPATE_ERROR_FILE, and all is zero, where the file
 * cannot be read any more. Quick one after the other: now and then a stretch of ticks is read from the file.
 * Threads wait for each other. */
int palpate_recording_tick(const palpate_recording* recording, int64_t number,
                           palpate_recorded_tick* tick) PALPATE_NOEXCEPT;

/* As palpate_surface_rest and palpate_surface_simplices, of the surface that was recorded. */
int palpate_recording_rest(const palpate_recording* recording, double* xyz) PALPATE_NOEXCEPT;
int palpate_recording_simplices(const palpate_recording* recording, int32_t* corners) PALPATE_NOEXCEPT;

/* Displacement of the surface nodes in picture 0, 1, ..., 3 `nodes` numbers [m], and its time since the first
 * tick [s]. Where the file holds only the forces of contacts (palpate_record with options.pictures, of a body
 * without dynamics), it is computed by the model, which is loaded with the first one and has to be where it
 * was or beside the recording. Threads wait for each other. Returns as palpate_record. */
int palpate_recording_picture(const palpate_recording* recording, int64_t number, float* xyz, double* time,
                              char* error, size_t error_size) PALPATE_NOEXCEPT;

/* --- The surface, for the eye --- */

typedef struct palpate_counts {
  size_t size; /* sizeof(palpate_counts) */
  int32_t nodes;
  int32_t simplices;
  int32_t corners; /* of a simplex: 3, triangles; in the plane 2, lines */
} palpate_counts;

#define PALPATE_COUNTS_INIT \
  { sizeof(palpate_counts), 0, 0, 0 }

/* Fills the members that `counts` has. Returns 0; -1 where the size is refused; PALPATE_ERROR_STATE, as the
 * functions below. */
int palpate_surface_counts(const palpate_session* session, palpate_counts* counts) PALPATE_NOEXCEPT;

/* Positions of the surface nodes on the body at rest, 3 `nodes` numbers x, y, z [m]. Never changes. */
int palpate_surface_rest(const palpate_session* session, double* xyz) PALPATE_NOEXCEPT;

/* Nodes of the simplices, `corners` `simplices` numbers from 0: triangles counter-clockwise seen from
 * outside, lines with the body on their left. Never changes. */
int palpate_surface_simplices(const palpate_session* session, int32_t* corners) PALPATE_NOEXCEPT;

/* Displacement of the surface nodes from rest in the last tick that was finished, 3 `nodes` numbers [m];
 * exactly zero where the body is fixed. Never makes the loop wait, but takes some microseconds a contact
 * and thousand nodes, too long for a tick: call it where you draw. Threads that draw wait for each other. */
int palpate_surface_displacement(palpate_session* session, double* xyz) PALPATE_NOEXCEPT;

/* Von Mises stress and contact pressure at the surface nodes, `nodes` numbers each [Pa], as they were found
 * last; stress is not a number where it is not known (all around is held). Either may be NULL. Returns the
 * tick that they belong to, counted from 0 since palpate_create; -1, and nothing is written, where there are
 * none yet or options.stress_ticks is 0. With an overlay, on the body's nodes as it is under it. */
int64_t palpate_surface_stress(palpate_session* session, float* von_mises, float* pressure) PALPATE_NOEXCEPT;

#ifdef __cplusplus
}
#endif
#endif
