// `palpate-runtime samples`: a page of small programs to begin with.
#pragma once

#include <CLI/CLI.hpp>

namespace palpate {

/// Adds the subcommand.
CLI::App* add_samples(CLI::App& app);

/// Prints the address of the page of samples and, where there is a screen, opens it in a browser. Returns the
/// exit status. Throws Error if the page is not installed.
int show_samples();

}  // namespace palpate
