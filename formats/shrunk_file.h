// Mapped files that another program cuts off.
#pragma once

namespace palpate {

/// From now on SIGBUS, which is what reading a mapped file gives that was cut off meanwhile or whose disk
/// failed, ends the program with an error line that names the file, and exit_input_error, in place of a crash.
/// A device's guardian then takes its force to zero. For programs, not for libraries.
void end_with_an_error_on_shrunk_files();

}  // namespace palpate
