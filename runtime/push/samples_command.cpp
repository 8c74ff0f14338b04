#include "runtime/push/samples_command.h"

#include <cstdlib>
#include <filesystem>
#include <string>

#include "base/error.h"
#include "base/program.h"
#include "runtime/push/other_program.h"

namespace palpate {
namespace {

bool has_screen() {
  return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
}

/// Opens a page in the person's browser; without a browser nothing happens.
void open_in_browser(const std::filesystem::path& page) {
  try {
    (void)run_other_program(find_program("xdg-open"), {page.string()});
  } catch (const Error&) {  // the address is printed
  }
}

}  // namespace

CLI::App* add_samples(CLI::App& app) {
  CLI::App* samples =
      app.add_subcommand("samples", "show small programs, one for each thing that Palpate does");
  samples->footer(
      "It prints the address of a page and opens it where there is a browser.\n"
      "To copy a sample into a folder of yours and run it: python3 -m palpate.samples NAME");
  return samples;
}

int show_samples() {
  std::error_code error;
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  const std::filesystem::path page = here.parent_path() / "share" / "palpate" / "samples.html";
  if (!std::filesystem::is_regular_file(page, error))
    throw Error("the page of samples is not there", page.string(),
                "install Palpate whole, or build the target samples_page");
  say(stdout, "file://{}\n", page.string());
  if (has_screen()) open_in_browser(page);
  return exit_ok;
}

}  // namespace palpate
