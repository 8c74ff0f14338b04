// Mapped files that another program cuts off.
#pragma once

namespace palpate {

/// From now on SIGBUS, which is what reading a mapped file gives that was cut off meanwhile, ends the program
/// with an error line and exit_input_error in place of a crash. For programs, not for libraries.
void end_with_an_error_on_shrunk_files();

}  // namespace palpate
