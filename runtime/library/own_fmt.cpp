// The functions of fmt, compiled here once: Debian has no libfmt.a, and libpalpate.so is to need nothing but
// the C and C++ libraries of the system.
#define FMT_HEADER_ONLY
#include <fmt/format.h>
