// The folders of this build. Not macros on the command line: a compiler cache then knows a test of another
// clone again.
#pragma once

#include <string>

namespace palpate::test {

/// Absolute path of a file of the sources, by its path from their root.
std::string source_file(const std::string& name);

/// Absolute path of a file that was built, by its path from the build folder.
std::string built_file(const std::string& name);

}  // namespace palpate::test
